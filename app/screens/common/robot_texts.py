"""The commonest texts of robots in our words, each with the next step. The robot's own text is always shown with them, in quotes. Pure."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from app.domain.message import render
from app.domain.robot import RobotStatus, problems_in_words
from app.i18n import _


@dataclass(frozen=True)
class Problem:
    """``words`` and ``step`` are ours, and empty for a text that is not known; ``quote`` is the robot's."""

    words: str = ""
    step: str = ""
    quote: str = ""


Words = Callable[[], tuple[str, str]]  # made when they are shown: the language may change

# Of the robot's English texts, the first that is found; a group is the name of a place.
_KNOWN: tuple[tuple[str, Words], ...] = (
    (
        r"failed to reach goal position '(?P<place>[^']+)'",
        lambda: (_("Can't reach {place}"), _("Clear the way. Then reset.")),
    ),
    (
        r"dock\w* (?:to|at) '(?P<place>[^']+)'.*(?:failed|not)|failed to dock (?:to|at) '(?P<dock>[^']+)'",
        lambda: (_("Can't dock at {place}"), _("Clear the place. Then reset.")),
    ),
    (r"marker", lambda: (_("Can't see its marker"), _("Clear the marker. Then reset."))),
    (r"dock", lambda: (_("Can't dock"), _("Clear the place. Then reset."))),
    (r"failed to reach|goal", lambda: (_("Can't reach its goal"), _("Clear the way. Then reset."))),
    (r"\bpath\b|planner", lambda: (_("Finds no way"), _("Clear the way. Then reset."))),
    (r"blocked|obstacle", lambda: (_("Something is in the way"), _("Clear the way. Then reset."))),
    (
        r"locali[sz]|position lost|amcl",
        lambda: (_("Doesn't know where it is"), _("Set its position on the robot's map.")),
    ),
    (r"scanner", lambda: (_("A laser scanner sees nothing"), _("Clean the scanners. Then reset."))),
    (r"camera", lambda: (_("A camera sees nothing"), _("Clean the cameras. Then reset."))),
    (r"protective|safety", lambda: (_("Its safety system has stopped it"), _("Clear the way. Then reset."))),
    (r"brake", lambda: (_("Its brake is off"), _("Turn the brake switch back."))),
    (r"motor|wheel|drive", lambda: (_("Its drive has failed"), _("Switch it off and on."))),
    (r"charg", lambda: (_("Can't charge"), _("Look at the charger. Then reset."))),
    (r"batter", lambda: (_("Its battery has a problem"), _("Take it to its charger."))),
    (r"elevator|\blift\b", lambda: (_("The lift doesn't answer"), _("Look at the lift. Then reset."))),
    (r"plc|register", lambda: (_("A machine doesn't answer"), _("Look at the machine. Then reset."))),
    (r"\bcart\b|shelf|pallet", lambda: (_("Can't take its load"), _("Look at the load. Then reset."))),
    (r"user request", lambda: (_("Cancelled at the robot"), "")),
    (r"was stopped", lambda: (_("Stopped at the robot"), "")),  # by a person, or as the robot was switched off
    (r"time.?out", lambda: (_("It waited too long"), _("Look what it waits for. Then reset."))),
)


def problem_of(text: str) -> Problem:
    """What the robot says is wrong."""
    for pattern, words in _KNOWN:
        if found := re.search(pattern, text, re.IGNORECASE):
            place = next(filter(None, found.groups()), "")
            said, step = words()
            return Problem(said.format(place=place), step, text)
    return Problem(quote=text)


def problem_of_status(status: RobotStatus) -> Problem:
    """What stops it from working."""
    return problem_of(render(problems_in_words(status.errors), _) or status.mission_text)
