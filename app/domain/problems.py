"""What is wrong with a robot, in its own words, short enough to be read."""

from __future__ import annotations

from collections.abc import Sequence

from app.domain.message import Message, message
from app.domain.robot import RobotProblem

MOST = 3
LONGEST = 280  # characters, so that the number of the others fits into 300


def in_words(problems: Sequence[RobotProblem]) -> Message:
    """The first different ones, each with its code, and how many more there are; empty when nothing is said of any."""
    found = list(dict.fromkeys(filter(None, map(_described, problems))))
    shown = found[:MOST]
    while len(shown) > 1 and len("; ".join(shown)) > LONGEST:
        shown.pop()
    text, more = clipped("; ".join(shown), LONGEST), len(found) - len(shown)
    return message("{problems} … and {count} more", problems=text, count=more) if more else text


def _described(problem: RobotProblem) -> str:
    """In the robot's words, with the number under which its manual has it."""
    text, number = problem.description or problem.module, "" if problem.code is None else f" ({problem.code})"
    return (clipped(text, LONGEST - len(number)) + number).strip()


def clipped(text: str, longest: int) -> str:
    """The text, or its beginning."""
    return text if len(text) <= longest else text[: longest - 1] + "…"
