"""Reset errors that did not help. That it did shows by itself."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime

from kivy.clock import Clock

from app.domain.models import Robot, RobotSnapshot
from app.i18n import _
from app.screens.home.card import error_words, has_errors
from app.screens.home.facts import HomeFacts, Standing, standing

READ_WITHIN = 5.0  # s until the message that errors remain after the reset


class ResetReport:
    """``say(text)`` shows it, once for each ``begin``, unless another screen is shown."""

    def __init__(self, say: Callable[[str], object]) -> None:
        self._say = say
        self._asked: tuple[Robot, datetime, float] | None = None  # since when, and until when to wait for its answer
        self.without_effect: frozenset[Standing] = frozenset()  # errors that were reset and stand

    def begin(self, robot: Robot, pressed_at: datetime) -> None:
        """The robot has taken Reset errors."""
        self._asked = robot, pressed_at, Clock.get_time() + READ_WITHIN

    def forget(self) -> None:
        """It may be long ago when this screen is shown again."""
        self._asked, self.without_effect = None, frozenset()

    def look(self, facts: HomeFacts) -> None:
        """Whether its errors are over."""
        self.without_effect &= {standing(snapshot) for snapshot in facts.snapshots.values()}
        if self._asked is None:
            return
        robot, since, until = self._asked
        seen = facts.snapshots.get(robot.id) or RobotSnapshot(robot.id)
        status = seen.status if seen.read_at is not None and seen.read_at >= since else None
        is_over = status is not None and not has_errors(status)
        if not is_over and Clock.get_time() < until:
            return
        self._asked = None
        if status is not None and not is_over:
            self.without_effect |= {standing(seen)}
            text = _("Still there: {problem}. Remove its cause at {robot}, then reset again")
            self._say(text.format(problem=error_words(status), robot=robot.name))
