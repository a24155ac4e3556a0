"""Queue items of robots that say them in another way than MiR's definition, which a check-up has found out."""

from __future__ import annotations

from typing import Any

from app.domain.check_up import NOTHING_KNOWN, RobotProfile
from app.mir import parse
from app.mir.texts import clean, resolve

CANCELLED = "Cancelled"  # of ``item_states``: one that a person has ended
USER_REQUEST = "Aborted - User Request"  # the message of an item that a person has ended, in the robot's language en_US


def as_defined(item: Any, known: RobotProfile) -> Any:
    """The item with its description, state and message as MiR's definition has them; anything else as it is."""
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
