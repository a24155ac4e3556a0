"""Whether Reset errors has helped: said when the robot has been read again."""
from __future__ import annotations

from collections.abc import Callable
from datetime import datetime

from kivy.clock import Clock

from app.i18n import _
from app.screens.home.facts import HomeFacts
from app.screens.home.view import has_errors

READ_WITHIN = 5.0                        # s, after which it is said that errors stand although they were reset


class ResetReport:
    """``say(text, icon)`` is called once for each ``begin``, unless another robot is selected meanwhile."""

    def __init__(self, say: Callable[[str, str], object]) -> None:
        self._say = say
        self._asked: tuple[int, datetime, float] | None = None        # which robot, since when, and until when its answer is waited for

    def begin(self, robot_id: int, pressed_at: datetime) -> None:
        """The robot has taken Reset errors."""
        self._asked = robot_id, pressed_at, Clock.get_time() + READ_WITHIN

    def look(self, facts: HomeFacts) -> None:
        """Say that the errors are gone as soon as they are, or after a while that they are not."""
        if self._asked is None:
            return
        robot_id, since, until = self._asked
        robot, seen = facts.robot, facts.snapshot
        status = seen.status if seen.read_at is not None and seen.read_at >= since else None
        if robot is None or robot.id != robot_id:
            self._asked = None
        elif status is not None and not has_errors(status):
            self._asked = None
            self._say(_("The errors of {robot} are reset; press Resume to continue").format(robot=robot.name), "check")
        elif Clock.get_time() >= until:
            self._asked = None
            self._say(_("{robot} has got Reset errors, but its error stands").format(robot=robot.name) if status else
                      _("{robot} has got Reset errors and not answered since").format(robot=robot.name), "alert-circle-outline")
