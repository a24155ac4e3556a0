"""One call of the API, as the code behind a path sees it."""
from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mir_sim.definition import Operation
from mir_sim.errors import ApiError, bad_request
from mir_sim.messages import Request, Response
from mir_sim.robot import SimulatedRobot
from mir_sim.site import Row


@dataclass(frozen=True)
class Call:
    """A request whose operation is known.

    Attributes:
        params: values of the placeholders in the operation's path.
        user: row of the user who asks; None, anonymous, only on GET /status.
        ask: sends another request to the same robot as the same user: method, path below /api/v2.0.0, body.
    """

    robot: SimulatedRobot
    request: Request
    operation: Operation
    params: dict[str, str]
    user: Row | None
    ask: Callable[[str, str, bytes], Response]

    @property
    def asker(self) -> Row:
        if self.user is None:
            raise ApiError(401, "Unauthorized")
        return self.user

    def json(self) -> Any:
        """The body, parsed. Raises ApiError 400 with MiR's text when it isn't JSON or isn't said to be."""
        if "application/json" not in self.request.headers.get("content-type", "").lower():
            raise bad_request("Missing content type application/json on the header")
        try:
            return json.loads(self.request.body)
        except (ValueError, RecursionError):
            raise bad_request("Invalid JSON") from None

    def fields(self) -> dict[str, Any]:
        """The body's known fields, checked against the definition."""
        schema = self.operation.body_schema or {}
        return self.robot.definition.check_body(schema, self.json())

    def changes(self) -> dict[str, Any]:
        """As ``fields``, for a PUT, which must change something."""
        fields = self.fields()
        if not fields:
            raise bad_request("No fields")
        return fields


Handler = Callable[[Call], Any]
