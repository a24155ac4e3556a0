"""How a mission is ordered, and how robots word queue items: as MiR defines them, or in other words that a check-up has found."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from app.domain.check_up import NOTHING_KNOWN, RobotProfile
from app.mir import parse
from app.mir.texts import clean, resolve

LONGEST_DESCRIPTION = 200  # characters of message and description (MiR's REST definition 3.5.4)
CANCELLED = "Cancelled"  # of ``item_states``: one that a person has ended
USER_REQUEST = "Aborted - User Request"  # the message of an item that a person has ended, in the robot's language en_US


def in_mir_words(item: Any, known: RobotProfile) -> Any:
    """The item with its description, state and message as in MiR's definition; everything else unchanged."""
    if known is NOTHING_KNOWN or not isinstance(item, dict):
        return item
    own: parse.Object = {}
    if known.token_field and known.token_field in item:
        own["description"] = item[known.token_field]
    state = known.item_states.get(clean(item.get("state"), 40))
    is_cancelled = state == CANCELLED
    if state:
        own["state"] = "Aborted" if is_cancelled else state
    if known.cancelled_message and own.get("state", item.get("state")) == "Aborted":
        is_cancelled |= resolve(item.get("message")).casefold().startswith(known.cancelled_message.casefold())
    return item | own | ({"message": USER_REQUEST} if is_cancelled else {})


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


def as_stored(text: str) -> str:
    """The message of an item without the robot's own text: the text that was sent with it, as returned."""
    return resolve(text[:LONGEST_DESCRIPTION])
