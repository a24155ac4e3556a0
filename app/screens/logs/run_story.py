"""The story of one run on a sheet: next to the list in a wide window, else over it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any
from zoneinfo import ZoneInfo

from kivy.properties import BooleanProperty, ObjectProperty

from app.domain import rules
from app.domain.models import Group, Robot
from app.i18n import _
from app.screens.common.holding import hold_at, run_words
from app.screens.common.robot_appearance import is_old
from app.screens.common.shell import PROBLEM_SECONDS, Shell
from app.screens.common.start_now import is_stopped, why_not
from app.screens.common.started import StartReports
from app.screens.logs import of_groups, view
from app.screens.logs.facts import LogsServices, filters_with, read_story
from app.screens.logs.part import LogsPart
from app.screens.logs.story import Story, StoryFacts, story
from app.screens.logs.view import Filters, Period
from app.widgets.items import Item
from app.widgets.sheet import Sheet
from app.widgets.surfaces import TonedSurface

if TYPE_CHECKING:
    from app.screens.logs.screen import LogsViewModel


class StorySheet(Sheet):
    """``story`` is a RunStory."""

    story = ObjectProperty(None, rebind=True, allownone=True)
    scrolls = BooleanProperty(False)


class StoryCause(TonedSurface):
    """Why the run ended so, and what the robot said."""

    story = ObjectProperty(Story(), rebind=True)


class RunStory(LogsPart[StoryFacts | None]):
    """Of the run with the id ``run``, whose story is shown or being read."""

    run = ObjectProperty(None, allownone=True)
    words = ObjectProperty(Story(), rebind=True)
    above = ObjectProperty(None, allownone=True)  # the run before it in the list
    below = ObjectProperty(None, allownone=True)
    like = ObjectProperty(Item(None), rebind=True)  # the row that leads to the runs of the same cause

    def __init__(self, services: LogsServices, shell: Shell, logs: LogsViewModel) -> None:
        super().__init__(services, shell, logs)
        self._is_linked = False  # another screen asked for it: its list has to have it
        self._sheet: StorySheet | None = None
        self._started = StartReports(logs, shell, services.history)
        self.fbind("run", self._look_around)
        logs.fbind("rows", self._look_around)

    def start(self) -> None:
        """The screen is shown."""
        self._logs.keep(self.refresher.start())

    def open(self, run: int) -> None:
        self.run = run
        self.refresher.reread()

    def follow(self, run: int) -> None:
        """Another screen asked for it."""
        self._is_linked = True
        self.open(run)

    def close(self) -> None:
        self.run, self._facts, self._is_linked, self.words = None, None, False, Story()
        sheet, self._sheet = self._sheet, None
        self._shell.sheets.close(sheet)

    def forget_link(self) -> bool:
        """The user has moved on: it must not undo a newer choice. Returns whether there was one."""
        was_linked = self._is_linked
        if was_linked:
            self.close()
        return was_linked

    # ------------------------------------------------------------------ reading
    def _wanted(self) -> object:
        return self.run

    def _start_reading(self) -> Callable[[], StoryFacts | None]:
        services, run = self._services, self.run
        return lambda: None if run is None else read_story(services, run)

    def _take(self, facts: StoryFacts | None) -> None:
        run = self.run
        if run is None:
            return
        if facts is None:
            self._shell.snackbars.show(_("This run is no longer in the history"), icon="information-outline")
            self.close()
            self._logs.read()
            return
        if self._is_linked:
            self._is_linked = False
            zone = ZoneInfo(self._services.settings().timezone)
            now, period = self._services.clock.now(), self._logs.wanted.period
            self._logs.show_runs(filters_with(facts.run.planned_at, now, zone, period), run)
        super()._take(facts)

    def show(self) -> None:
        facts = self._facts
        if facts is None or facts.run.id != self.run:
            return
        self.words = story(facts, self._services.clock.now(), self._logs.zone, self._shell.mission_names.known)
        self.like = Item("like", self.words.like, meta_icon="chevron-right", strong=False)
        if self._sheet is None:
            self._sheet = StorySheet(story=self)
            self._sheet.bind(on_close=lambda *_args: self._logs.close_story())
        self._shell.sheets.show(self._sheet)

    # ------------------------------------------------------------------ what its buttons do
    def _look_around(self, *_args: object) -> None:
        runs = [None, *(row.key for row in self._logs.rows if row.opens), None]
        threes = zip(runs, runs[1:], runs[2:], strict=False)
        self.above, self.below = next(((above, below) for above, run, below in threes if run == self.run), (None, None))

    def step(self, run: int) -> None:
        """The story of the run above or below."""
        self._logs.open_story(run)

    def show_like(self) -> None:
        """All runs that ended for the same cause, in 30 days."""
        if self._facts is not None:
            like = view.like_of(self._facts.run, self._logs.zone)
            self._logs.show_runs(Filters(Period.MONTH, like=like), self.run)

    def run_again(self) -> None:
        """Ask first: the reader may not see the robot. Not asked if nothing can be started now."""
        if self._facts is None:
            return
        run, facts, shell = self._facts.run, self._logs.facts, self._shell
        mission, where = shell.mission_names.known.run(run), of_groups.any_of(run) or run.robot
        target = facts.target(run)  # if it is no longer there, starting it says so
        nothing, instead = self._start_now(target) if target is not None else ("", "")
        if nothing:
            text = _("{mission} was not started on {robot}. {why}").format(mission=mission, robot=where, why=nothing)
            shell.snackbars.show(text, icon="alert-circle-outline", seconds=PROBLEM_SECONDS)
            return

        def start() -> Any:
            return shell.background.run(
                lambda: self._services.operator.run_again(run.id), self._started.follow, shell.say_problem
            )

        question = _("Run {mission} on {robot} now?").format(mission=mission, robot=where)
        shell.sheets.ask(question, "", instead or _("Run now"), start)

    def _start_now(self, target: Robot | Group) -> tuple[str, str]:
        """Why nothing can be started there now, and what a start does if it is not sent at once ("Queue, on hold"); each
        may be empty."""
        services, settings, now = self._services, self._logs.facts.settings, self._services.clock.now()
        robot = target if isinstance(target, Robot) else None
        hold = hold_at(services.holds.all_active(), robot.id if robot else None, now)
        snapshot = services.snapshots.get(robot.id) if robot else None
        stopped = snapshot is not None and is_stopped(snapshot, settings, now)
        silent = robot if snapshot is not None and is_old(snapshot, now, settings) else None
        words = run_words(hold, silent, rules.closes_at(now, None, settings), settings.timezone, now)
        return why_not(target, self._logs.facts.robots, hold, stopped), words[0] if words is not None else ""
