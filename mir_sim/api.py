"""The robot's REST API as a pure function: a request in, an answer out."""

from __future__ import annotations

import base64
import binascii
import hmac
from collections.abc import Iterable
from functools import lru_cache
from typing import Any

from mir_sim import definition, listing
from mir_sim.control import MAP_PATH, PATH, control
from mir_sim.definition import Routes
from mir_sim.errors import ApiError, argument_error
from mir_sim.messages import Request, Response
from mir_sim.resources import registry, rows
from mir_sim.resources.call import Call
from mir_sim.robot import SimulatedRobot
from mir_sim.site import Row

BASE = "/api/v2.0.0"


def handle(robot: SimulatedRobot, request: Request) -> Response:
    """Advance the robot to its clock and answer one request, without the faults that ``exchange`` applies."""
    with robot.lock:
        robot.catch_up()
        if request.path.rstrip("/") in (PATH, MAP_PATH):
            return control(robot, request)
        robot.note_request()
        if not robot.online:
            return refuse(robot, ApiError(503))
        return answer(robot, request)


def answer(robot: SimulatedRobot, request: Request) -> Response:
    """Answer a request below /api."""
    if robot.now < robot.api_down_until:
        return refuse(robot, ApiError(503))
    try:
        status, value = _dispatch(robot, request)
    except ApiError as error:
        return refuse(robot, error)
    if isinstance(value, Response):
        return Response(value.status, {**value.headers, **_headers(robot)}, value.body)
    if value is None:
        return Response(status, _headers(robot))
    return Response.json_of(status, value, _headers(robot))


def refuse(robot: SimulatedRobot, error: ApiError) -> Response:
    return Response.json_of(
        error.status, {**error.body(), "error_human": robot.profile.text(error.text)}, _headers(robot)
    )


def below_base(path: str) -> str | None:
    """The path below /api/v2.0.0 without a trailing slash, or None for a path that is elsewhere."""
    if path != BASE and not path.startswith(BASE + "/"):
        return None
    return path[len(BASE) :].rstrip("/") or "/"


def _headers(robot: SimulatedRobot) -> dict[str, str]:
    return {"Robot-Version": robot.software, "API-Version": "v2.0.0", "MiR-Product": robot.model.upper()}


@lru_cache(maxsize=len(definition.SOFTWARE))
def _routes(version: str) -> Routes:
    return Routes([*definition.load(version).templates(), *(template for _, template in registry.UNLISTED)])


def _dispatch(robot: SimulatedRobot, request: Request) -> tuple[int, Any]:
    path, verb = below_base(request.path), request.method.lower()
    if path is None:
        raise ApiError(404)
    user = _user(robot, request.headers.get("authorization", ""))
    if user is None and (verb, path) != ("get", "/status"):
        raise ApiError(401)
    if verb == "post" and path.endswith("/search"):
        return 201, _search(robot, request, path.removesuffix("/search"), user)
    call = _call(robot, request, verb, path, user)
    value = _handled(call)
    if verb == "get":
        value = _listed(call, value, ())
    elif verb == "put" and isinstance(value, dict):  # whose answers were not recorded: as the definition has them
        value = definition.declared(robot.definition.properties(call.operation.schema), value)
    return call.operation.success, value


def _handled(call: Call) -> Any:
    """A missing object on the path of an operation that doesn't document 404 is a wrong argument."""
    operation = call.operation
    try:
        return registry.handler(operation.verb, operation.template)(call)
    except ApiError as error:
        if error.status == 404 and operation.refusals and 404 not in operation.refusals:
            raise argument_error(*list(call.params)[-1:]) from None
        raise


def _call(robot: SimulatedRobot, request: Request, verb: str, path: str, user: Row | None) -> Call:
    found = _routes(robot.software).find(path)
    if found is None:
        raise ApiError(404)
    template, params = found
    operation = robot.definition.operation(verb, template) or registry.UNLISTED.get((verb, template))
    if operation is None:
        raise ApiError(404)

    def ask(method: str, path: str, body: bytes) -> Response:
        return answer(robot, Request.of(method, BASE + path, request.headers, body))

    return Call(robot, request, operation, params, user, ask)


def _search(robot: SimulatedRobot, request: Request, path: str, user: Row | None) -> Any:
    if not robot.profile.search:
        raise ApiError(404)
    call = _call(robot, request, "get", path, user)
    body = call.json()
    filters = body.get("filters", []) if isinstance(body, dict) else None
    if not isinstance(filters, list):
        raise ApiError(400, listing.FILTERS)
    value = registry.handler("get", call.operation.template)(call)
    if isinstance(value, dict):
        raise ApiError(404)
    return _listed(call, value, filters)


def _listed(call: Call, value: Any, filters: list[Any] | tuple[()]) -> Any:
    """Apply whitelist, sort_by, limit, offset and filters to the result of a GET."""
    profile = call.robot.profile
    query = {name: one for name, one in call.request.query.items() if name not in profile.ignores}
    if isinstance(value, Response) or (isinstance(value, dict) and "whitelist" not in query):
        return value
    properties = set(call.robot.definition.properties(call.operation.schema))
    if isinstance(value, dict):
        return listing.pick(value, query, properties)
    entries = (
        [_PlainEntry(entry) if isinstance(entry, dict) else entry for entry in value]
        if isinstance(value, list)
        else value
    )
    wanted = () if "filters" in profile.ignores else filters
    return listing.show(entries, query, properties | _fields(call, entries), wanted, profile.page_limit)


def _fields(call: Call, entries: Iterable[listing.Listed]) -> set[str]:
    """Every field that a list's entries may have, taken from the first entry and from the definition."""
    first = next(iter(entries), None)
    shown = set(first.full()) | set(first.summary()) if first is not None else set()
    return shown | set(rows.properties(call.robot.software, call.operation.template))


class _PlainEntry:
    """A list entry that is a plain object."""

    def __init__(self, value: dict[str, Any]) -> None:
        self._value = value

    def summary(self) -> dict[str, Any]:
        return self._value

    full = summary

    def value(self, name: str) -> Any:
        return self._value.get(name)


def _user(robot: SimulatedRobot, authorization: str) -> Row | None:
    """The user with these Basic credentials, or None. The password is sent as its SHA-256 in lower-case hexadecimal.

    User names are compared without regard to case (guess).
    """
    name, secret = _credentials(authorization)
    for user in robot.site.table("/users"):
        if user["username"].lower() == name.lower() and hmac.compare_digest(
            user["password_hash"].encode(), secret.encode()
        ):
            return user
    return None


@lru_cache(maxsize=256)
def _credentials(authorization: str) -> tuple[str, str]:
    """Name and secret of a Basic header; both empty, which no user has, if it is not one."""
    scheme, _, token = authorization.partition(" ")
    if scheme.lower() != "basic":
        return "", ""
    try:
        name, _, secret = base64.b64decode(token.strip(), validate=True).decode().partition(":")
    except (binascii.Error, ValueError):
        return "", ""
    return name, secret
