"""Scheduler: what will happen, the form to plan it, the schedules. Facts are read in the background, words made by scheduler_view."""
from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, OptionProperty, StringProperty

from app.container import Container
from app.i18n import _
from app.models import Execution, Schedule
from app.screens import scheduler_view as words
from app.screens.base import ScreenBase, ViewModel
from app.screens.scheduler_cards import SchedulerEmpty
from app.screens.scheduler_facts import SchedulerFacts, read
from app.screens.scheduler_form import FormModel
from app.screens.scheduler_view import TimelineView
from app.screens.shell import Shell
from app.services.catalogue import Removed
from app.services.forecast import Forecasts
from app.services.robot_missions import RobotMissions
from app.services.skipping import Skipping
from app.widgets import load_kv

LOOKS_AGAIN = 60.0           # s after which the plan is read anew although nothing was said to have changed
MOVES = 5.0                  # s between two positions of the now-line
MANY = 200                   # schedules, from which on their words are not made anew every second
WIDE_TICKS, NARROW_TICKS = 2, 4


class SchedulerViewModel(ViewModel):
    """What kv reads. ``mode``: the timeline of 24 hours, or the list of 7 days."""
    mode = OptionProperty("hours", options=("hours", "days"))
    timeline = ObjectProperty(TimelineView(), rebind=True)
    days = ListProperty()
    schedules = ListProperty()
    schedules_note = StringProperty()
    has_robots = BooleanProperty(True)
    narrow = BooleanProperty(False)
    busy = ListProperty()                # ids of schedules that something is being done to

    def __init__(self, container: Container, shell: Shell) -> None:
        super().__init__()
        self._container, self._shell = container, shell
        robots = container.repositories.robots
        robot_missions = RobotMissions(lambda robot_id: robots.get(container.db.read(), robot_id), container.make_client, container.clock)
        self._skipping = Skipping(container.db, container.clock, container.changes)
        self.form = FormModel(container, shell, Forecasts(container.db, container.clock), robot_missions,
                              saved=lambda _schedule: self._refresh())
        self._facts = SchedulerFacts()
        self._wanted: int | None = None                       # a schedule to open as soon as it is known
        self._reading = self._stale = False
        self._refresh = Clock.create_trigger(lambda _dt: self._read(), 0)
        self.form.fbind("view", lambda *_args: self._show_schedules())
        self.fbind("narrow", lambda *_args: self._show_timeline())

    # ------------------------------------------------------------------ reading
    def opened(self, schedule_id: int | None = None, mission_id: int | None = None) -> None:
        """``schedule_id`` opens that schedule in the form, ``mission_id`` begins a new one for that mission."""
        self._wanted = schedule_id
        if mission_id is not None:
            self.form.begin()
            self.form.set(mission_id=mission_id)
        self.keep(self._container.changes.subscribe(lambda _topic, _about: self._refresh()))
        self.every(1, self._tick)
        self.every(MOVES, self._show_timeline)
        self.every(LOOKS_AGAIN, self._read)
        self._read()

    def retranslated(self) -> None:
        self._show()
        self.form.show()

    def _read(self) -> None:
        """One reading at a time; what changes meanwhile asks for one more."""
        if self._reading:
            self._stale = True
            return
        self._reading, self._stale = True, False
        days = self.mode == "days"
        self._shell.background.run(lambda: read(self._container, days), self._take, self._not_read)

    def _take(self, facts: SchedulerFacts) -> None:
        self._reading = False
        if self._stale:
            self._refresh()
        self._facts = facts
        self.has_robots = bool(facts.robots)
        self.form.take(facts)
        if (schedule := facts.schedule(self._wanted)) is not None:
            self._wanted = None
            self.form.edit(schedule)
        self._show()

    def _not_read(self, problem: BaseException) -> None:
        self._reading = False
        self._shell.say_problem(problem)

    # ------------------------------------------------------------------ showing
    def _tick(self) -> None:
        if len(self._facts.schedules) <= MANY:
            self._show_schedules()

    def _show(self) -> None:
        self._show_timeline()
        self._show_schedules()
        self.schedules_note = words.schedules_note(self._facts)

    def _show_timeline(self) -> None:
        now = self._container.clock.now()
        if self.mode == "hours":
            self.timeline = words.timeline(self._facts, now, NARROW_TICKS if self.narrow else WIDE_TICKS)
        else:
            self.days = words.days(self._facts, now)

    def _show_schedules(self) -> None:
        self.schedules = words.schedule_rows(self._facts, self._container.clock.now(), self.form.editing)

    def choose_mode(self, mode: str) -> None:
        self.mode = mode
        self.days = []
        self._read()

    # ------------------------------------------------------------------ what the operator presses
    def open_bar(self, key: tuple[str, int]) -> None:
        """A bar of the timeline: its story, or its schedule."""
        kind, number = key[0], key[1]
        if kind == "execution":
            self._shell.go("logs", execution_id=number)
        else:
            self.edit(number)

    def open_day(self, key: tuple[str, int, Any]) -> None:
        self.choose_mode("hours")
        self.edit(key[1])

    def row_action(self, schedule_id: int, action: str, *values: Any) -> None:
        """A row of the list was used."""
        match action:
            case "edit":
                self.edit(schedule_id)
            case "switch":
                self.switch(schedule_id, values[0])
            case "menu":
                self._menu(schedule_id, values[0])

    def edit(self, schedule_id: int) -> None:
        if (schedule := self._facts.schedule(schedule_id)) is not None:
            self.form.edit(schedule)

    def switch(self, schedule_id: int, on: bool) -> None:
        self._act(schedule_id, lambda: self._container.catalogue.set_schedule_enabled(schedule_id, on), lambda _schedule: None)

    def _menu(self, schedule_id: int, anchor: Any) -> None:
        schedule = self._facts.schedule(schedule_id)
        if schedule is None:
            return
        items = [
            {"key": "run", "text": _("Run now"), "icon": "play"},
            {"key": "skip", "text": _("Skip next"), "icon": "skip-next", "disabled": not (schedule.enabled and schedule.next_at)},
            {"key": "duplicate", "text": _("Duplicate"), "icon": "content-copy"},
            {"key": "delete", "text": _("Delete"), "icon": "trash-can-outline", "tone": "fault"},
        ]
        calls: dict[str, Callable[[Schedule], object]] = {
            "run": self.run_now, "skip": self.skip_next, "duplicate": self.form.duplicate, "delete": self.delete}
        self._shell.dialogs.menu(anchor, items, lambda key: calls[key](schedule))

    def add_robot(self) -> None:
        self._shell.go("settings", section="robots", add=True)

    def run_now(self, schedule: Schedule) -> None:
        """With the schedule's own parameters, whatever its constraints are."""
        self._act(schedule.id, lambda: self._container.operator.run_now(schedule.robot_id, schedule.mission_id, schedule.parameters),
                  self._started)

    def _started(self, execution: Execution) -> None:
        self._say(_("{mission} is on its way to {robot}").format(mission=execution.mission, robot=execution.robot), "play")

    def skip_next(self, schedule: Schedule) -> None:
        self._act(schedule.id, lambda: self._skipping.skip_next(schedule.id), lambda _at: self._say(
            _("The next start of {name} is skipped").format(name=schedule.name), "skip-next"))

    def delete(self, schedule: Schedule) -> None:
        """It is off at once; 8 s to take that back."""
        def deleted(removed: Removed) -> None:
            self._shell.snackbars.undo(
                _("{name} is deleted").format(name=schedule.name), _("Undo"),
                lambda: self._act(schedule.id, lambda: self._container.catalogue.restore(removed), lambda _none: None))

        if self.form.editing == schedule.id:
            self.form.begin()
        self._act(schedule.id, lambda: self._container.catalogue.remove_schedule(schedule.id), deleted)

    def _act(self, name: int, work: Callable[[], Any], done: Callable[[Any], object]) -> None:
        """Do it elsewhere; what came of it is on screen with the next reading."""
        if name in self.busy:
            return
        self.busy = [*self.busy, name]

        def ended(tell: Callable[[Any], object], outcome: Any) -> None:
            self.busy = [other for other in self.busy if other != name]
            tell(outcome)
            self._refresh()

        self._shell.background.run(work, lambda outcome: ended(done, outcome), lambda problem: ended(self._shell.say_problem, problem))

    def _say(self, text: str, icon: str) -> None:
        self._shell.snackbars.show(text, icon=icon)


class SchedulerScreen(ScreenBase):
    """Upcoming across the top, below it the form and the schedules; the days of a week take the whole screen."""
    lower_height = NumericProperty(0)    # least, of the form and the schedules

    def __init__(self, container: Container, shell: Shell, **kwargs: Any) -> None:
        load_kv("flow", "slots", "scheduler")
        super().__init__(vm=SchedulerViewModel(container, shell), **kwargs)
        self._page, self._lower = self.ids.page.__self__, self.ids.lower.__self__
        self._empty = SchedulerEmpty()
        self._empty.bind(on_release=lambda _empty: self.vm.add_robot())
        for name in ("mode", "has_robots"):
            self.vm.fbind(name, self._choose_parts)
        self.fbind("portrait", self._tell_width)
        self._choose_parts()

    def _tell_width(self, *_: Any) -> None:
        self.vm.narrow = self.portrait

    def _choose_parts(self, *_: Any) -> None:
        wanted = self._page if self.vm.has_robots else self._empty
        if wanted not in self.children:
            self.clear_widgets()
            self.add_widget(wanted)
        column, lower = self.ids.column, self._lower
        if (self.vm.mode == "hours") != (lower.parent is not None):
            column.remove_widget(lower) if lower.parent is not None else column.add_widget(lower)
