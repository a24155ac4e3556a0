"""One call of the API, as its handler gets it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

from mir_sim.definition import Operation
from mir_sim.errors import ApiError
from mir_sim.messages import Request, Response
from mir_sim.rest_machine import RestMachine
from mir_sim.robot import SimulatedRobot
from mir_sim.site import Row


@dataclass(frozen=True)
class Call:
    """A request whose operation is known.

    Attributes:
        params: values of the placeholders in the operation's path.
        user: row of the user who asks; None, anonymous, only on GET /status.
        ask: sends another request to the same machine as the same user: method, path below /api/v2.0.0, body.
    """

    machine: RestMachine
    request: Request
    operation: Operation
    params: dict[str, str]
    user: Row | None
    ask: Callable[[str, str, bytes], Response]

    @property
    def robot(self) -> SimulatedRobot:
        """The machine, in operations that only robots have."""
        return cast("SimulatedRobot", self.machine)

    @property
    def asker(self) -> Row:
        if self.user is None:
            raise ApiError(401)
        return self.user

    def json(self) -> Any:
        """The parsed body. Raises ApiError 400 when it isn't JSON or the header doesn't say so."""
        if "application/json" not in self.request.headers.get("content-type", "").lower():
            raise ApiError(400, "Missing content type application/json on the header")
        try:
            return json.loads(self.request.body)
        except (ValueError, RecursionError):
            raise ApiError(400, "Invalid JSON") from None

    def fields(self) -> dict[str, Any]:
        """The body's known fields, checked against the definition."""
        schema = self.operation.body_schema or {}
        return self.machine.definition.check_body(schema, self.json())

    def changes(self) -> dict[str, Any]:
        """As ``fields``, for a PUT, which must have at least one field."""
        fields = self.fields()
        if not fields:
            raise ApiError(400, "No fields")
        return fields


Handler = Callable[[Call], Any]
Handlers = dict[tuple[str, str], Handler]  # by verb and path template
