"""The dialog that holds all robots, or one: nothing is sent until its end, or until somebody releases it."""
from __future__ import annotations

from datetime import UTC, date, datetime, time, timedelta
from typing import TYPE_CHECKING, Any
from zoneinfo import ZoneInfo

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty

from app.domain.models import InvalidInput
from app.i18n import _
from app.screens.common.problems import sentence_of
from app.screens.common.shell import Shell
from app.screens.scheduler import hold_view as words
from app.screens.scheduler.facts import SchedulerFacts
from app.services.live.holds import Hold
from app.services.planning.recurrence import to_utc
from app.widgets.dialogs import FormDialog

if TYPE_CHECKING:
    from app.container import Container


class HoldForm(EventDispatcher):
    robot_id = NumericProperty(words.ALL)
    robot = StringProperty()
    reason = StringProperty()
    reasons = ListProperty()
    ends = ListProperty()
    follows = StringProperty()
    standing = StringProperty()          # what holds already what is chosen
    reason_problem = StringProperty()
    end_problem = StringProperty()
    problem = StringProperty()
    saving = BooleanProperty(False)


class HoldDialog(FormDialog):
    """Which robots, why, until when."""
    vm = ObjectProperty(None, rebind=True, allownone=True)

    def __init__(self, container: Container, shell: Shell, facts: SchedulerFacts, **kwargs: Any) -> None:
        self._container, self._shell, self._facts = container, shell, facts
        self._zone = facts.settings.timezone
        self._end, self._chosen = words.HOUR, None            # type: tuple[str, datetime | None]
        form = HoldForm()
        super().__init__(vm=form, **kwargs)
        form.fbind("reason", self._show)
        self._show()

    def _show(self, *_args: Any) -> None:
        form, now = self.vm, self._container.clock.now()
        form.robot = words.robot_word(self._facts, int(form.robot_id))
        form.reasons = words.reason_chips(form.reason)
        form.ends = words.end_chips(self._end, self._chosen, self._zone, now)
        form.follows = words.what_follows(words.end_of(self._end, self._chosen, self._zone, now), self._zone, now)
        form.standing = words.held_sentence(words.held(self._facts, int(form.robot_id)), self._zone, now)
        form.reason_problem = form.end_problem = form.problem = ""

    # ------------------------------------------------------------------ what is chosen
    def choose_robot(self) -> None:
        self._shell.dialogs.choose(_("Hold"), words.robot_options(self._facts), self._robot_chosen, selected=int(self.vm.robot_id))

    def _robot_chosen(self, robot_id: int) -> None:
        self.vm.robot_id = robot_id
        self._show()

    def choose_reason(self, key: str) -> None:
        """A second tap takes it back."""
        word = words.reason_words()[key]
        self.vm.reason = "" if self.vm.reason == word else word

    def choose_end(self, end: str) -> None:
        if end == words.CHOSEN:
            today = self._local_now().date()
            self._shell.dialogs.pick_date(_("Hold until"), today, self._day_chosen, today=today, first=today)
            return
        self._end = end
        self._show()

    def _day_chosen(self, day: date) -> None:
        later = self._local_now() + timedelta(hours=2)
        self._shell.dialogs.pick_time(_("Hold until"), time(later.hour, 0), lambda at: self._time_chosen(day, at))

    def _time_chosen(self, day: date, at: time) -> None:
        self._end, self._chosen = words.CHOSEN, to_utc(datetime.combine(day, at), ZoneInfo(self._zone)).astimezone(UTC)
        self._show()

    def _local_now(self) -> datetime:
        return self._container.clock.now().astimezone(ZoneInfo(self._zone))

    # ------------------------------------------------------------------ doing it
    def hold(self) -> None:
        form = self.vm
        if form.saving:
            return
        form.saving = True
        robot_id, reason = int(form.robot_id) or None, words.reason_of(form.reason)
        until = words.end_of(self._end, self._chosen, self._zone, self._container.clock.now())
        self._shell.background.run(lambda: self._container.holds.hold(reason, until, robot_id), self._is_held, self._refused)

    def _is_held(self, hold: Hold) -> None:
        self.dismiss()
        robot = self._facts.robot(hold.robot_id)
        self._shell.snackbars.show(words.held_message(robot.name if robot else None, hold.until, self._zone, self._container.clock.now()),
                                   icon="hand-back-right-outline")

    def release(self) -> None:
        form = self.vm
        if form.saving:
            return
        form.saving = True
        robot_id = int(form.robot_id) or None
        self._shell.background.run(lambda: self._container.holds.release(robot_id), self._is_released, self._refused)

    def _is_released(self, _none: None) -> None:
        self.dismiss()
        self._shell.snackbars.show(_("Released"), icon="play-circle-outline")

    def _refused(self, problem: BaseException) -> None:
        form = self.vm
        form.saving = False
        field = problem.field if isinstance(problem, InvalidInput) else ""
        setattr(form, {"reason": "reason_problem", "until": "end_problem"}.get(field, "problem"), sentence_of(problem))
