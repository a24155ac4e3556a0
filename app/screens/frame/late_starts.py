"""Starts that fell due while the app was off: a sheet on Home, in which each is started or not, or all are put on hold."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime

from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty

from app.domain import rules
from app.domain.execution import Execution
from app.domain.models import Settings
from app.i18n import _
from app.screens.common.cancelled import say_cancelled
from app.screens.common.name_order import with_id
from app.screens.common.shell import Shell
from app.screens.frame.facts import FrameServices, OpenIssues
from app.screens.frame.view import counting_down, counting_words, late_rows, seconds_left
from app.widgets import load_kv
from app.widgets.sheet import Sheet


class LateSheet(Sheet):
    """``counts``: some of them start by themselves in a moment, and it can't be closed; without such it can ``release`` those on hold."""

    scrolls = BooleanProperty(False)
    line = StringProperty()
    share = NumericProperty(0)  # of the time that is over
    counts = BooleanProperty(False)
    can_release = BooleanProperty(False)
    rows = ListProperty()
    act = ObjectProperty()  # (key, action): the button of a row was pressed

    def show(self, issues: OpenIssues, settings: Settings, now: datetime) -> None:
        counting = counting_down(issues.late_starts)
        held = [e for e in issues.late_starts if e.held]
        self.counts, self.can_release = bool(counting), bool(held)
        on_hold = _("{n} on hold").format(n=len(held)) if held else ""
        self.line = counting_words(counting, now) if counting else on_hold
        self.share = 1 - seconds_left(counting, now) / rules.LATE_START_HOLD.total_seconds() if counting else 0
        self.rows = late_rows(issues.late_starts, issues.mission_names, settings, now)


class LateStarts:
    """The sheet opens by itself: a robot must not start because a person plugged the tablet in. ``hold(ids, held)`` starts what is not
    ``held``; ``release(count, work)`` asks before ``work()``."""

    def __init__(
        self,
        services: FrameServices,
        shell: Shell,
        hold: Callable[[Sequence[int], bool], object],
        release: Callable[[int, Callable[[], object]], object],
    ) -> None:
        self._services, self._shell, self._hold, self._release = services, shell, hold, release
        self._sheet: LateSheet | None = None
        self._issues = OpenIssues()
        self._closed: frozenset[object] = frozenset()  # those that were there when it left Home

    @property
    def is_shown(self) -> bool:
        return self._sheet is not None and self._shell.sheets.has(self._sheet)

    def open(self) -> None:
        """Show those on hold again."""
        self._sheet, self._closed = None, frozenset()
        self._shell.go("home")

    def show(self, issues: OpenIssues, settings: Settings, now: datetime) -> None:
        """On Home, while there are any."""
        if self._sheet is not None and not self.is_shown:  # closed, or another one came in its place
            self._sheet, was = None, self._issues.late_starts
            self._closed = self._closed if counting_down(was) else _listed(was)
        self._issues = issues
        is_home, late = self._shell.navigator.current == "home", issues.late_starts
        is_wanted = bool(counting_down(late)) or bool(_listed(late) - self._closed)
        if not late:
            self._shell.sheets.close(self._sheet)
        elif is_home and late and is_wanted and not self.is_shown:
            load_kv("frame/late_starts")
            self._sheet = LateSheet(act=self.act)
            self._sheet.bind(on_done=self._press)
            self._shell.sheets.show(self._sheet)
        if self._sheet is not None and self.is_shown:
            self._sheet.show(issues, settings, now)

    def _press(self, *_args: object) -> None:
        """Put all on hold that count down; or release those on hold."""
        if counting := counting_down(self._issues.late_starts):
            self._hold([e.id for e in counting], True)
        else:
            held = [e.id for e in self._issues.late_starts if e.held]
            self._release(len(held), lambda: self._hold(held, False))

    def act(self, key: int, name: str) -> None:
        """The button of a row decides it alone."""
        row = with_id(self._issues.late_starts, key)
        if row is None:
            return
        if name == "start":
            self._hold([key], False)
            return
        mission, services = self._issues.mission_names.run(row), self._services
        self._shell.background.run(
            lambda: services.operator.cancel_execution(key),
            lambda left: say_cancelled(self._shell, services.catalogue, mission, left, lambda: None),
            self._shell.say_problem,
        )


def _listed(late: Sequence[Execution]) -> frozenset[object]:
    """After another absence they are listed again."""
    return frozenset((e.id, e.listed_until) for e in late)
