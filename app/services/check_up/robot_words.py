"""The robot's words: which language it speaks, and what it calls the states of queue items."""

from __future__ import annotations

import re
from collections.abc import Sequence

from app.domain.check_up import Topic
from app.domain.message import message
from app.domain.robot import RobotState, RobotStatus
from app.mir import parse
from app.mir.texts import clean
from app.services.check_up.look import Look

ITEM_STATES = ("Pending", "Executing", "Abort", "Done", "Aborted")


def look_at_language(look: Look, status: RobotStatus, entries: Sequence[parse.Object]) -> None:
    """By the word for its state, and those for its newest items."""
    unknown = sorted(
        {state for entry in entries if (state := clean(entry.get("state"), 40)) and state not in ITEM_STATES}
    )
    if unknown:
        look.amber(
            Topic.LANGUAGE,
            message("It has words of its own for the states of missions: {words}", words=", ".join(unknown)),
            message(
                "Trying it with a mission shows what they mean; until then a run whose word is not known is followed until the "
                "robot has ended it, and shown as failed with that word."
            ),
        )
    elif status.state is not RobotState.UNKNOWN and status.state_text and not _is_english(status):
        look.amber(
            Topic.LANGUAGE,
            message("It speaks another language: its state is {text}", text=status.state_text),
            message(
                "Its texts are shown as it says them. What it says of a cancelled mission is learned by trying it with one; "
                "else a mission that somebody cancels at the robot is shown as failed."
            ),
        )
    elif not status.state_text:
        look.amber(
            Topic.LANGUAGE,
            message("Not found out which language it speaks: it has no words for its state"),
            message("Its texts are shown as it says them."),
        )
    else:
        look.green(Topic.LANGUAGE, message("It speaks English"))


def _is_english(status: RobotStatus) -> bool:
    return re.sub(r"[^a-z]", "", status.state_text.casefold()) == status.state.name.casefold().replace("_", "")
