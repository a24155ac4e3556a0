"""The result of Reset errors: "sent" at once, the rest after the next reading of the robot."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from datetime import datetime

from kivy.clock import Clock

from app.domain.models import Robot, RobotSnapshot
from app.i18n import _
from app.screens.common.shell import PROBLEM_SECONDS
from app.screens.home.card import error_words, has_errors
from app.screens.home.facts import HomeFacts, Standing, standing
from app.widgets.snackbar import SECONDS

READ_WITHIN = 5.0  # s until the message that errors remain after the reset


class ResetReport:
    """``say(text, icon, about, seconds)`` shows the result, once for each ``begin``, unless another screen is shown."""

    def __init__(self, say: Callable[[str, str, Hashable, float], object]) -> None:
        self._say = say
        self._asked: tuple[int, datetime, float] | None = (
            None  # which robot, since when, and until when to wait for its answer
        )
        self.without_effect: frozenset[Standing] = frozenset()  # errors that were reset and stand

    def begin(self, robot: Robot, pressed_at: datetime) -> None:
        """The robot has taken Reset errors."""
        self._asked = robot.id, pressed_at, Clock.get_time() + READ_WITHIN
        self._tell(robot, _("Reset errors was sent to {robot}"), "restore-alert")

    def forget(self) -> None:
        """It may be long ago when this screen is shown again."""
        self._asked, self.without_effect = None, frozenset()

    def look(self, facts: HomeFacts) -> None:
        """Report when the errors are over, or after a while that they are not."""
        self.without_effect &= {standing(snapshot) for snapshot in facts.snapshots.values()}
        if self._asked is None:
            return
        robot_id, since, until = self._asked
        robot = next((robot for robot in facts.robots if robot.id == robot_id), None)
        seen = facts.snapshots.get(robot_id) or RobotSnapshot(robot_id)
        status = seen.status if seen.read_at is not None and seen.read_at >= since else None
        if robot is None:
            self._asked = None
        elif status is not None and not has_errors(status):
            self._asked = None
            self._tell(robot, _("The errors of {robot} are reset. Press Resume to continue"), "check")
        elif Clock.get_time() >= until:
            self._asked = None
            if status is not None:
                self.without_effect |= {standing(seen)}
            text = (
                _("Reset errors was sent to {robot}, which has not answered since")
                if status is None
                else _("Still there: {problem}. Remove its cause at {robot}, then reset again")
            )
            self._tell(
                robot, text, "alert-circle-outline", PROBLEM_SECONDS, problem=error_words(status) if status else ""
            )

    def _tell(self, robot: Robot, text: str, icon: str, seconds: float = SECONDS, **details: str) -> None:
        self._say(text.format(robot=robot.name, **details), icon, ("reset", robot.id), seconds)
