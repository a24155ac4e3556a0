"""Scheduler: what will happen, the form to plan it, the schedules. Facts are read in the background, words made by scheduler_view."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import date, timedelta
from typing import Any
from zoneinfo import ZoneInfo

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, OptionProperty, StringProperty

from app.container import Container
from app.domain.models import Execution, Schedule
from app.i18n import _
from app.screens.common import formats
from app.screens.common.shell import Shell
from app.screens.common.view_model import ScreenBase, ViewModel
from app.screens.scheduler import timeline
from app.screens.scheduler import view as words
from app.screens.scheduler.cards import SchedulerEmpty
from app.screens.scheduler.facts import SchedulerFacts, Window, read
from app.screens.scheduler.form import FormModel
from app.screens.scheduler.hold import HoldDialog
from app.screens.scheduler.timeline import TimelineView
from app.services.catalogue.catalogue import Removed
from app.services.catalogue.pausing import Pausing
from app.services.catalogue.preview import Forecasts
from app.services.files.plan_export import PlanExport, PlanFiles
from app.services.live.changes import Topic
from app.services.robots.missions import RobotMissions
from app.widgets import load_kv

LOOKS_AGAIN = 60.0           # s after which the plan is read anew although nothing was said to have changed
TOLD_FOR = 12.0              # s that the place of an export stays readable
MOVES = 5.0                  # s between two positions of the now-line
MANY = 200                   # schedules, from which on their words are not made anew every second
PAGE = 0.5                   # of what the timeline shows, that a press moves it by


class SchedulerViewModel(ViewModel):
    """What kv reads. ``mode``: the timeline, or the list of 7 days."""
    mode = OptionProperty("hours", options=("hours", "days"))
    timeline = ObjectProperty(TimelineView(), rebind=True)
    follows = BooleanProperty(True)      # the timeline goes with the time
    touched = BooleanProperty(False)     # by fingers that move it: it must not change under them
    days = ListProperty()
    schedules = ListProperty()
    schedules_note = StringProperty()
    has_robots = BooleanProperty(True)
    narrow = BooleanProperty(False)
    exporting = BooleanProperty(False)
    busy = ListProperty()                # ids of schedules that something is being done to

    def __init__(self, container: Container, shell: Shell) -> None:
        super().__init__()
        self._container, self._shell = container, shell
        robots = container.repositories.robots
        robot_missions = RobotMissions(lambda robot_id: robots.get(container.db.read(), robot_id), container.make_client, container.clock)
        self._skipping = Pausing(container.db, container.clock, container.changes)
        self.form = FormModel(container, shell, Forecasts(container.db, container.clock), robot_missions,
                              saved=lambda _schedule: self._refresh())
        self._facts = SchedulerFacts()
        self._window = Window()                               # what the timeline shows
        self._wanted: int | None = None                       # a schedule to open as soon as it is known
        self._reading = self._stale = False
        self._refresh = Clock.create_trigger(lambda _dt: self._read(), 0)
        self.form.fbind("view", lambda *_args: self._show_schedules())
        self.fbind("narrow", lambda *_args: self._refresh())
        self.fbind("touched", lambda *_args: self.touched or self._refresh())

    # ------------------------------------------------------------------ reading
    def opened(self, schedule_id: int | None = None, mission_id: int | None = None) -> None:
        """``schedule_id`` opens that schedule in the form, ``mission_id`` begins a new one for that mission."""
        self._wanted = schedule_id
        if mission_id is not None:
            self.form.begin()
            self.form.set(mission_id=mission_id)
        self.keep(self._container.changes.subscribe(self._heard))
        self.every(1, self._tick)
        self.every(MOVES, self._move_now)
        self.every(LOOKS_AGAIN, self._read)
        self._read()

    def _heard(self, topic: Topic, _about: int | None) -> None:
        """On the publisher's thread. No plan depends on what robots say many times a second."""
        if topic is not Topic.SNAPSHOT:
            self._refresh()

    def retranslated(self) -> None:
        self._show_schedules()
        self.form.show()
        self._read()

    def _read(self) -> None:
        """One reading at a time; what changes meanwhile asks for one more."""
        if self._reading:
            self._stale = True
            return
        self._reading, self._stale = True, False
        window, narrow = self._window if self.mode == "hours" else None, self.narrow

        def facts_and_words() -> tuple[Window | None, SchedulerFacts, Any]:
            facts = read(self._container, window)
            now = self._container.clock.now()
            return window, facts, words.days(facts, now) if window is None else timeline.timeline(facts, now, window, narrow)

        self._shell.background.run(facts_and_words, self._take, self._not_read)

    def _take(self, found: tuple[Window | None, SchedulerFacts, Any]) -> None:
        self._reading = False
        if self._stale:
            self._refresh()
        window, facts, shown = found
        self._facts = facts
        self.has_robots = bool(facts.robots)
        self.form.take(facts)
        if (schedule := facts.schedule(self._wanted)) is not None:
            self._wanted = None
            self.form.edit(schedule)
        if isinstance(shown, TimelineView):
            if not self.touched and window == self._window:      # else it was moved on meanwhile
                self.timeline = shown
        elif self.mode == "days":
            self.days = shown
        self._show_schedules()
        self.schedules_note = words.schedules_note(self._facts)

    def _not_read(self, problem: BaseException) -> None:
        self._reading = False
        self._shell.say_problem(problem)

    # ------------------------------------------------------------------ showing
    def _tick(self) -> None:
        if len(self._facts.schedules) <= MANY:
            self._show_schedules()

    def _move_now(self) -> None:
        """The now-line moves; where it leads, the window goes along with the next reading."""
        if self.timeline.origin is not None and not self.touched and self.mode == "hours":
            now = self._container.clock.now()
            self.timeline = replace(self.timeline, now=(now - self.timeline.origin).total_seconds() / 3600,
                                    now_label=formats.wall_time(now.astimezone(self._facts.zone)))

    def _show_schedules(self) -> None:
        self.schedules = words.schedule_rows(self._facts, self._container.clock.now(), self.form.editing)

    def choose_mode(self, mode: str) -> None:
        self.mode = mode
        self.days = []
        self._read()

    # ------------------------------------------------------------------ the timeline's window
    def zoom(self, further: bool) -> None:
        self._look_at(timeline.zoomed(self._window, further, self._container.clock.now(), self._facts.zone))

    def page(self, forward: bool) -> None:
        self._look_at(timeline.moved(self._window, PAGE if forward else -PAGE, self._container.clock.now(), self._facts.zone))

    def to_now(self) -> None:
        self._look_at(Window(None, self._window.hours))

    def fingers_moved(self, first: float, hours: float) -> None:
        """To what the timeline shows now, in hours of its own."""
        if self.timeline.origin is not None:
            self._look_at(Window(self.timeline.origin + timedelta(hours=first), hours))

    def _look_at(self, window: Window) -> None:
        """Show at once what is there already; the rest comes with the reading."""
        self._window, self.follows = window, window.left is None
        if self.timeline.origin is not None:
            start = window.start(self._container.clock.now(), self._facts.zone)
            self.timeline = replace(self.timeline, first=(start - self.timeline.origin).total_seconds() / 3600, hours=window.hours,
                                    span=timeline.span_words(window.hours))
        self._read()

    # ------------------------------------------------------------------ what the operator presses
    def open_bar(self, key: tuple[str, Any]) -> None:
        """A bar of the timeline: its story, or its schedule; of many in one, a nearer look."""
        match key:
            case ("execution", number):
                self._shell.go("logs", execution_id=number)
            case ("zoom", middle, length) if self.timeline.origin is not None:
                hours = float(next((span for span in timeline.SPANS if span >= length), self._window.hours))
                hours = min(hours, max(self._window.hours / 2, timeline.SPANS[0]))
                self._look_at(Window(self.timeline.origin + timedelta(hours=middle - hours / 2), hours))
            case ("schedule", number):
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
        paused = schedule.is_paused(self._container.clock.now())
        items = [
            {"key": "run", "text": _("Run now"), "icon": "play"},
            {"key": "skip", "text": _("Skip next"), "icon": "skip-next", "disabled": not (schedule.enabled and schedule.next_at)},
            {"key": "resume", "text": _("Resume now"), "icon": "play-circle-outline"} if paused else
            {"key": "pause", "text": _("Pause until …"), "icon": "pause-circle-outline", "disabled": not schedule.enabled},
            {"key": "duplicate", "text": _("Duplicate"), "icon": "content-copy"},
            {"key": "delete", "text": _("Delete"), "icon": "trash-can-outline", "tone": "fault"},
        ]
        calls: dict[str, Callable[[Schedule], object]] = {
            "run": self.run_now, "skip": self.skip_next, "pause": self.pause, "resume": self.resume,
            "duplicate": self.form.duplicate, "delete": self.delete}
        self._shell.dialogs.menu(anchor, items, lambda key: calls[key](schedule))

    def hold(self) -> None:
        """Keep everything, or one robot, from being sent anything; the banner releases it."""
        if self._facts.robots:
            self._shell.dialogs.open(HoldDialog(self._container, self._shell, self._facts))

    def export(self) -> None:
        """The starts of the next days as a calendar file, saying where it went."""
        if self.exporting:
            return
        self.exporting = True
        container = self._container
        files = PlanFiles(container.db, container.catalogue, container.clock, container.plan)
        self._shell.background.run(files.export, self._exported, self._not_exported)

    def _exported(self, done: PlanExport) -> None:
        self.exporting = False
        self._shell.snackbars.show(words.export_result(done, self._facts.settings.timezone), icon="calendar-export", seconds=TOLD_FOR)

    def _not_exported(self, problem: BaseException) -> None:
        self.exporting = False
        self._shell.say_problem(problem)

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

    def pause(self, schedule: Schedule) -> None:
        """Until which day its starts are skipped."""
        self._shell.dialogs.choose(_("Pause {name}").format(name=schedule.name), words.pause_options(schedule, self._container.clock.now()),
                                   lambda day: self._pick_pause(schedule) if day == words.PICK else self._pause_until(schedule, day))

    def _pick_pause(self, schedule: Schedule) -> None:
        today = self._container.clock.now().astimezone(ZoneInfo(schedule.timezone)).date()
        tomorrow = today + timedelta(days=1)
        self._shell.dialogs.pick_date(_("First day with starts again"), tomorrow, lambda day: self._pause_until(schedule, day), today=today,
                                      first=tomorrow)

    def _pause_until(self, schedule: Schedule, day: date) -> None:
        until = words.day_begins(day, ZoneInfo(schedule.timezone))
        self._act(schedule.id, lambda: self._skipping.pause(schedule.id, until), lambda _paused: self._say(
            _("{name} is paused until {day}").format(name=schedule.name, day=formats.wall_day(day)), "pause-circle-outline"))

    def resume(self, schedule: Schedule) -> None:
        self._act(schedule.id, lambda: self._skipping.resume(schedule.id), lambda _resumed: self._say(
            _("{name} goes on").format(name=schedule.name), "play-circle-outline"))

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
        load_kv("widgets/flow", "widgets/slots", "scheduler/screen", "scheduler/form", "scheduler/hold")
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
