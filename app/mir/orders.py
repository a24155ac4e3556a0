"""What is sent to put a mission on a robot's queue, and what counts as taken."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from app.domain.check_up import RobotProfile
from app.domain.message import message
from app.mir import parse
from app.mir.errors import Unnumbered, Unreadable
from app.mir.texts import resolve
from app.mir.transport import Response

LONGEST_DESCRIPTION = 200  # characters of message and description (MiR's REST definition 3.5.4)


def order(mission_guid: str, description: str, text: str, priority: int, parameters: Mapping[str, Any]) -> parse.Object:
    """Raises TypeError, ValueError or RecursionError for parameters that can't be written as JSON."""
    body: parse.Object = {"mission_id": mission_guid, "priority": priority}
    if description:
        body["description"] = description[:LONGEST_DESCRIPTION]
    if text:
        body["message"] = text[:LONGEST_DESCRIPTION]
    if parameters:
        body["parameters"] = [{"input_name": name, "value": value} for name, value in parameters.items()]
    json.dumps(body, allow_nan=False)
    return body


def as_kept(text: str) -> str:
    """The message of an item in which the robot has written nothing: the text that was sent with it, as it comes back."""
    return resolve(text[:LONGEST_DESCRIPTION])


def problem_of(answer: Response, known: RobotProfile) -> Unreadable | None:
    """Why an answer of success does not say that the mission was taken, or under which number. Only 201 does, unless the robot is known to
    answer otherwise."""
    if answer.status not in (201, known.order_status):
        return Unreadable(problem=message("status {status} instead of 201", status=answer.status))
    return None if _has_number(answer) else Unnumbered()


def _has_number(answer: Response) -> bool:
    try:
        parse.queue_id(parse.loads(answer.body))
    except Unreadable:
        return False
    return True
