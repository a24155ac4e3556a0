"""The sheet that puts all robots on hold, or one: nothing is sent until the hold ends or is released."""

from __future__ import annotations

from datetime import UTC, date, datetime, time, timedelta
from typing import Any
from zoneinfo import ZoneInfo

from kivy.properties import ListProperty, NumericProperty, StringProperty

from app.database.robots import Hold
from app.domain.models import InvalidInput
from app.i18n import _
from app.screens.common.holding import HAND, about_hold
from app.screens.common.problems import sentence_of
from app.screens.common.shell import Shell
from app.screens.scheduler import hold_view
from app.screens.scheduler.facts import SchedulerFacts, SchedulerServices
from app.services.planning.recurrence import to_utc
from app.widgets.sheet import Sheet


class HoldSheet(Sheet):
    """Which robots, why, until when."""

    robot_id = NumericProperty(hold_view.ALL)
    robot = StringProperty()
    reason = StringProperty()
    reasons = ListProperty()
    ends = ListProperty()
    follows = StringProperty()
    reason_problem = StringProperty()
    end_problem = StringProperty()

    def __init__(self, services: SchedulerServices, shell: Shell, facts: SchedulerFacts, **kwargs: Any) -> None:
        self._services, self._shell, self._facts = services, shell, facts
        self._zone = facts.settings.timezone
        self._end = hold_view.HOUR
        self._chosen: datetime | None = None
        super().__init__(**kwargs)
        self.fbind("reason", self._show)
        self._show()

    def _show(self, *_args: Any) -> None:
        self.reason_problem = self.end_problem = ""
        self.robot = hold_view.robot_name(self._facts, int(self.robot_id))
        self.reasons = hold_view.reason_chips(self.reason)
        self.ends = hold_view.end_chips(self._end, self._chosen, self._zone, self._services.clock.now())
        self.follows = hold_view.what_follows(self._facts, int(self.robot_id))

    # ------------------------------------------------------------------ what is chosen
    def choose_robot(self) -> None:
        self._shell.dialogs.choose(
            _("Hold"), hold_view.robot_options(self._facts), self._robot_chosen, selected=int(self.robot_id)
        )

    def _robot_chosen(self, robot_id: int) -> None:
        self.robot_id = robot_id
        self._show()

    def choose_reason(self, key: str) -> None:
        """A second tap clears it."""
        text = hold_view.reasons()[key]
        self.reason = "" if self.reason == text else text

    def choose_end(self, end: str) -> None:
        if end == hold_view.CHOSEN:
            today = self._local_now().date()
            self._shell.dialogs.pick_date(
                _("Hold until"), self._proposed.date(), self._day_chosen, today=today, first=today
            )
            return
        self._end = end
        self._show()

    def _day_chosen(self, day: date) -> None:
        at = min(self._proposed, datetime.combine(day, time(23, 59), self._proposed.tzinfo))  # if not past midnight
        self._shell.dialogs.pick_time(_("Hold until"), at.time(), lambda at: self._time_chosen(day, at))

    def _time_chosen(self, day: date, at: time) -> None:
        self._end, self._chosen = (
            hold_view.CHOSEN,
            to_utc(datetime.combine(day, at), ZoneInfo(self._zone)).astimezone(UTC),
        )
        self._show()

    @property
    def _proposed(self) -> datetime:
        return (self._local_now() + timedelta(hours=2)).replace(minute=0, second=0, microsecond=0)

    def _local_now(self) -> datetime:
        return self._services.clock.now().astimezone(ZoneInfo(self._zone))

    # ------------------------------------------------------------------ doing it
    def on_done(self) -> None:
        if self.busy:  # type: ignore[has-type]
            return
        self.busy, self.reason_problem, self.end_problem = True, "", ""
        robot_id, reason = int(self.robot_id) or None, hold_view.reason_of(self.reason)
        until = hold_view.end_of(self._end, self._chosen, self._zone, self._services.clock.now())
        self._shell.background.run(
            lambda: self._services.holds.hold(reason, until, robot_id), self._is_held, self._refused
        )

    def _is_held(self, hold: Hold) -> None:
        self._shell.sheets.close(self)
        robot = self._facts.robot(hold.robot_id)
        text = hold_view.held_message(robot.name if robot else None, hold.until, self._zone, self._services.clock.now())
        self._shell.snackbars.show(text, icon=HAND, about=about_hold(hold.robot_id))

    def _refused(self, problem: BaseException) -> None:
        self.busy = False
        field = problem.field if isinstance(problem, InvalidInput) else ""
        if field in ("reason", "until"):
            setattr(self, {"reason": "reason_problem", "until": "end_problem"}[field], sentence_of(problem))
        else:
            self._shell.say_problem(problem)
