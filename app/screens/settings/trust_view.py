"""What is asked before a machine is trusted that is not known. Pure functions."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import zip_longest

from app.domain.models import Robot
from app.i18n import _
from app.mir.errors import AnotherRobot, SerialNumberHidden


@dataclass(frozen=True)
class Question:
    """``before`` and ``now``: serial numbers or fingerprints; empty: none. ``risky`` is the word on the button."""

    title: str
    text: str
    risky: str
    more: str = ""
    robot: str = ""
    before: str = ""
    now: str = ""


def another_robot(robot: Robot, problem: AnotherRobot, *, has_password: bool) -> Question:
    """``has_password``: one is entered, which an accepted machine gets."""
    takes_over = (
        _("A new {robot} takes over its plan and history, and gets the entered password.")
        if has_password
        else _("A new {robot} takes over its plan and history. It needs its password again.")
    )
    return Question(
        _("Another robot answers"),
        _("At its address, with another serial number:"),
        _("This is the new {robot}").format(robot=robot.name),
        takes_over.format(robot=robot.name),
        robot.name,
        problem.params["expected"],
        problem.params["found"],
    )


def hidden_number(robot: Robot, problem: SerialNumberHidden) -> Question:
    return Question(
        _("No serial number"),
        _("{robot} no longer shows it. Only its address would identify it.").format(robot=robot.name),
        _("Send the password"),
        _("Check at the robot that it is the same one."),
        robot.name,
        problem.params["expected"],
    )


def certificate(name: str, found: str, trusted: str) -> Question:
    """``found`` and ``trusted`` are fingerprints; ``trusted`` may be empty."""
    return Question(
        _("Another certificate") if trusted else _("Unknown certificate"),
        _("Compare its fingerprint with the one shown there, or ask its administrator."),
        _("Trust it"),
        robot=name,
        before=trusted.upper(),
        now=found.upper(),
    )


def no_encryption() -> Question:
    return Question(
        _("Connect without encryption?"),
        _("So far it is reached over https. Over http, anyone on the network can read its password or key."),
        _("Use http"),
    )


def fours(number: str, other: str = "") -> list[tuple[str, bool]]:
    """In groups of four, as people compare it, and whether that group differs from the ``other`` number's."""
    groups, others = ([text[n : n + 4] for n in range(0, len(text), 4)] for text in (number, other))
    return [(a, bool(other) and a != b) for a, b in zip_longest(groups, others, fillvalue="") if a]
