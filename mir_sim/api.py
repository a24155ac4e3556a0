"""The REST API of a machine as a pure function: a request in, an answer out."""

from __future__ import annotations

import base64
import binascii
import hmac
from collections.abc import Iterable
from functools import lru_cache, singledispatch
from typing import Any

from mir_sim import definition, listing
from mir_sim.control import MAP_PATH, PATH, control
from mir_sim.definition import Routes
from mir_sim.errors import ApiError, argument_error
from mir_sim.machine import Machine
from mir_sim.messages import Request, Response
from mir_sim.resources import registry, rows
from mir_sim.resources.call import Call
from mir_sim.rest_machine import RestMachine
from mir_sim.robot import SimulatedRobot
from mir_sim.site import Row

BASE = Machine.base


def handle(machine: Machine, request: Request) -> Response:
    """Advance the machine to its clock and answer one request, without the faults that ``exchange`` applies."""
    with machine.lock:
        machine.catch_up()
        if request.path.rstrip("/") in (PATH, MAP_PATH):
            return control(machine, request)
        if isinstance(machine, SimulatedRobot):
            machine.note_request()
        if not machine.online or machine.now < machine.api_down_until:
            return refuse(machine, ApiError(503))
        return answer(machine, request)


@singledispatch
def answer(machine: Machine, request: Request) -> Response:
    """Answer a request to the API. Each kind of machine registers how."""
    raise NotImplementedError


@singledispatch
def refuse(machine: Machine, error: ApiError) -> Response:
    """The answer that says an error. Each kind of machine registers how."""
    raise NotImplementedError


@answer.register
def answer_rest(machine: RestMachine, request: Request) -> Response:
    """As robots and classic fleets answer."""
    try:
        status, value = _dispatch(machine, request)
    except ApiError as error:
        return refuse(machine, error)
    if isinstance(value, Response):
        return Response(value.status, {**value.headers, **_headers(machine)}, value.body)
    if value is None:
        return Response(status, _headers(machine))
    return Response.json_of(status, value, _headers(machine))


@refuse.register
def _(machine: RestMachine, error: ApiError) -> Response:
    body = {**error.body(), "error_human": machine.profile.text(error.text)}
    return Response.json_of(error.status, body, _headers(machine))


def below_base(machine: Machine, path: str) -> str | None:
    """The path below that of the API, without a trailing slash, or None for a path that is elsewhere."""
    if path != machine.base and not path.startswith(machine.base + "/"):
        return None
    return path[len(machine.base) :].rstrip("/") or "/"


def _headers(machine: RestMachine) -> dict[str, str]:
    return {"Robot-Version": machine.software, "API-Version": "v2.0.0", "MiR-Product": machine.model.upper()}


@lru_cache(maxsize=len(definition.SOFTWARE) + 1)
def _routes(version: str) -> Routes:
    return Routes([*definition.load(version).templates(), *(template for _, template in registry.UNLISTED)])


def _dispatch(machine: RestMachine, request: Request) -> tuple[int, Any]:
    path, verb = below_base(machine, request.path), request.method.lower()
    if path is None:
        raise ApiError(404)
    user = _user(machine, request.headers.get("authorization", ""))
    if user is None and (verb, path) != ("get", "/status"):
        raise ApiError(401)
    if verb == "post" and path.endswith("/search"):
        return _search(machine, request, path.removesuffix("/search"), user)
    call = _call(machine, request, verb, path, user)
    value = _handled(call)
    if verb == "get":
        value = _listed(call, value, ())
    elif verb == "put" and isinstance(value, dict):  # whose answers were not recorded: as the definition has them
        value = definition.declared(machine.definition.properties(call.operation.schema), value)
    return call.operation.success, value


def _handled(call: Call) -> Any:
    """A missing object on the path of an operation that doesn't document 404 is a wrong argument."""
    operation = call.operation
    try:
        return registry.handler(call.machine, operation.verb, operation.template)(call)
    except ApiError as error:
        if error.status == 404 and operation.refusals and 404 not in operation.refusals:
            raise argument_error(*list(call.params)[-1:]) from None
        raise


def _call(machine: RestMachine, request: Request, verb: str, path: str, user: Row | None) -> Call:
    found = _routes(machine.software).find(path)
    if found is None:
        raise ApiError(404)
    template, params = found
    operation = machine.definition.operation(verb, template) or registry.UNLISTED.get((verb, template))
    if operation is None:
        raise ApiError(404)

    def ask(method: str, path: str, body: bytes) -> Response:
        return answer(machine, Request.of(method, BASE + path, request.headers, body))

    return Call(machine, request, operation, params, user, ask)


def _search(machine: RestMachine, request: Request, path: str, user: Row | None) -> tuple[int, Any]:
    if machine.search_status is None:
        raise ApiError(404)
    call = _call(machine, request, "get", path, user)
    body = call.json()
    filters = body.get("filters", []) if isinstance(body, dict) else None
    if not isinstance(filters, list):
        raise ApiError(400, listing.FILTERS)
    value = registry.handler(machine, "get", call.operation.template)(call)
    if isinstance(value, dict):
        raise ApiError(404)
    return machine.search_status, _listed(call, value, filters)


def _listed(call: Call, value: Any, filters: list[Any] | tuple[()]) -> Any:
    """Apply whitelist, sort_by, limit, offset and filters to the result of a GET."""
    profile = call.machine.profile
    query = {name: one for name, one in call.request.query.items() if name not in profile.ignores}
    if isinstance(value, Response) or (isinstance(value, dict) and "whitelist" not in query):
        return value
    properties = set(call.machine.definition.properties(call.operation.schema))
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
    return shown | set(rows.properties(call.machine.software, call.operation.template))


class _PlainEntry:
    """A list entry that is a plain object."""

    def __init__(self, value: dict[str, Any]) -> None:
        self._value = value

    def summary(self) -> dict[str, Any]:
        return self._value

    full = summary

    def value(self, name: str) -> Any:
        return self._value.get(name)


def _user(machine: RestMachine, authorization: str) -> Row | None:
    """The user with these Basic credentials, or None. The password is sent as its SHA-256 in lower-case hexadecimal.

    User names are compared without regard to case (guess).
    """
    name, secret = _credentials(authorization)
    for user in machine.site.table("/users"):
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
