"""Scheduler: the plan, the schedules, suggestions, and the form beside them. Facts are read in the background; view.py,
timeline.py and form_view.py make texts and bars of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from kivy.properties import BooleanProperty, ObjectProperty, OptionProperty

from app.domain.models import Schedule
from app.i18n import _
from app.screens.common.group_starts import GroupStarts
from app.screens.common.mission_names import MissionNameLookup
from app.screens.common.presses import Presses
from app.screens.common.shell import Shell
from app.screens.common.started import StartReports
from app.screens.common.view_model import Changed, Refresher, ScreenBase
from app.screens.scheduler import cards, hold_view, timeline, view
from app.screens.scheduler.actions import ScheduleActions
from app.screens.scheduler.advice import AdviceModel
from app.screens.scheduler.draft import Draft
from app.screens.scheduler.facts import SchedulerFacts, SchedulerServices, Window, live, read
from app.screens.scheduler.form import FormModel
from app.screens.scheduler.hold import HoldSheet
from app.screens.scheduler.listed import ScheduleList
from app.screens.scheduler.on_timeline import OnTimeline
from app.screens.scheduler.timeline import TimelineView
from app.services.files.plan_export import PlanExport
from app.services.live.changes import Topic
from app.widgets import load_kv
from app.widgets.dock import dock
from app.widgets.items import Option
from app.widgets.tabs import Tab

REFRESH_SECONDS = 60.0  # after which the plan is read again even without a published change
EXPORT_SECONDS = 12.0  # that the path of an export stays on screen
NOW_LINE_SECONDS = 15.0  # between two positions of the now-line: at its widest the plan has 17 s per pixel
MANY = 200  # schedules, from which on their texts are not rebuilt every second

Reading = tuple[Window, SchedulerFacts, TimelineView]  # what was asked for, and what to show


class SchedulerViewModel(OnTimeline):
    """What kv reads. ``tab``: the plan, the list of schedules, or suggestions."""

    tab = OptionProperty("plan", options=("plan", "schedules", "suggestions"))
    has_robots = BooleanProperty(True)
    held = BooleanProperty(False)  # nothing is sent to any robot
    nothing = BooleanProperty(False)  # is planned, as is known
    exporting = BooleanProperty(False)
    advice = ObjectProperty(None, rebind=True)

    def __init__(self, services: SchedulerServices, shell: Shell) -> None:
        super().__init__()
        self._services, self._shell, self.sheets = services, shell, shell.sheets
        self._refresher = Refresher(shell, self._reading, self._take)
        self._started = StartReports(self, shell, services.history)
        self.actions = ScheduleActions(
            services, shell, self._started, lambda schedule: self._facts.called(schedule), done=self._refresher.request
        )
        self.group_starts = GroupStarts(
            services.operator,
            services.catalogue,
            shell,
            self._refresher.request,
            self._started.follow,
            lambda number: next((one for one in self._facts.past if one.id == number), None),
        )
        self.form = FormModel(services, shell, self, self._facts)
        self.advice = AdviceModel(services, shell, lambda: self._facts, self.begin, self._refresher.request)
        self.listed = ScheduleList(shell, services.clock.now)
        self._given = MissionNameLookup(services.robot_missions, services.clock, shell, self._refresher.request)
        self._is_read = False
        self._presses = Presses()
        self._wanted: int | None = None  # a schedule to open as soon as they are read

    # ------------------------------------------------------------------ reading
    def opened(self, schedule_id: int | None = None, form: FormModel | None = None) -> None:
        """``schedule_id`` opens that schedule in the form; ``form`` is one that was put aside."""
        self._wanted = schedule_id
        if form is not None:
            self.show_form(form)
        self.keep(self._shell.bus.subscribe(Changed, self._changed))
        self.keep(self._refresher.start())
        self.keep(self.advice.opened())
        self.every(1, self._tick)
        self.every(NOW_LINE_SECONDS, self._move_now)
        self.every(REFRESH_SECONDS, self._refresher.request)
        self._refresher.read()

    def _changed(self, event: Changed) -> None:
        """The plan does not depend on robots' frequent reports."""
        if event.topic is not Topic.SNAPSHOT:
            self._refresher.request()

    def retranslated(self) -> None:
        self._show_schedules()
        self.form.retranslated()
        self.advice.show()
        self._refresher.request()

    def on_touched(self, *_args: object) -> None:
        """What was withheld from under the fingers."""
        if not self.touched:
            self._refresher.request()

    def _reading(self) -> Callable[[], Reading]:
        services, window = self._services, self._window
        mission_names = self._shell.mission_names.known

        def work() -> Reading:
            facts, now = replace(read(services, window), mission_names=mission_names), services.clock.now()
            return window, facts, timeline.timeline(facts, now, window)

        return work

    def _take(self, reading: Reading) -> None:
        window, facts, shown = reading
        self._facts, self._is_read = facts, True
        self._given.look(facts.robots, facts.given_to())
        self.has_robots = bool(facts.robots)
        self.held = any(hold.covers(None, self._services.clock.now()) for hold in facts.holds)
        if not self.touched and window == self._window:  # else it has changed since
            self.take_plan(shown)
        self.nothing = not facts.schedules and not any(lane.bars for lane in shown.lanes)
        self.form.take(facts)
        wanted, self._wanted = self._wanted, None  # if it is not there now, nothing waits for it
        if wanted is not None:
            self.edit(wanted)
        self._show_schedules()

    # ------------------------------------------------------------------ showing
    def _tick(self) -> None:
        services, facts = self._services, self._facts
        if any(getattr(facts, name) != now for name, now in live(services, facts.settings, facts.robots).items()):
            self._refresher.request()
        if len(facts.schedules) <= MANY:
            self._show_schedules()

    def _show_schedules(self) -> None:
        if self._is_read:  # unknown until then
            self.listed.show(self._facts)

    def saved(self, schedule: Schedule, undo: Callable[[], Any]) -> bool:
        """In the form. Returns whether the message about it, with its Undo, is shown here."""
        others = (each for each in self._facts.schedules if each.id != schedule.id)
        self._facts = replace(self._facts, schedules=(*others, schedule))
        is_said: bool = self.advice.saved(schedule, undo)
        self._refresher.reread()
        return is_said

    # ------------------------------------------------------------------ what the operator presses
    def row_action(self, schedule_id: int, action: str, *values: Any) -> None:
        """A row of the list was used."""
        match action:
            case "open":
                self.edit(schedule_id)
            case "switch":
                self.actions.switch(schedule_id, values[0])
            case "menu":
                self._menu(schedule_id, values[0])

    def _menu(self, schedule_id: int, anchor: Any) -> None:
        schedule = self._facts.schedule(schedule_id)
        if schedule is None:
            return
        calls: dict[str, Callable[[Schedule], object]] = {
            "edit": lambda _schedule: self.edit(schedule_id),
            "run": self.actions.run_now,
            "skip": self.actions.skip_next,
            "pause": self.actions.pause,
            "resume": self.actions.resume,
            "duplicate": lambda _schedule: self.begin(Draft.of(schedule).copy()),
            "delete": self.delete,
        }
        title, text = view.menu_title(self._facts, schedule)
        self._shell.dialogs.menu(
            anchor,
            title,
            view.schedule_menu(self._facts, schedule, self._services.clock.now()),
            lambda key: calls[key](schedule),
            text,
        )

    def hold(self) -> None:
        """Hold all robots, or one."""
        if self._facts.robots:
            robot_id = hold_view.looked_at(self._facts, self._window.robots)
            self._shell.sheets.show(HoldSheet(self._services, self._shell, self._facts, robot_id=robot_id))

    def plan_menu(self, anchor: Any) -> None:
        """What is rarely needed."""
        calls: dict[str, Callable[[], object]] = {
            "export": self.export,
            "robots": self.choose_robots,
            "looks": lambda: self._shell.dialogs.explain(anchor, _("Colours"), view.looks_in_words()),
        }
        items = [
            Option("export", _("Export"), "calendar-export"),
            *([Option("robots", _("Robots in the plan"), "robot-outline")] if self.timeline.robots else []),
            Option("looks", _("Colours"), "information-outline"),
        ]
        self._shell.dialogs.menu(anchor, _("Plan"), items, lambda key: calls[key]())

    def export(self) -> None:
        """Write the starts of the next days as a calendar file and show its path."""
        if self.exporting or self._presses.is_same("export"):
            return
        self.exporting = True
        self._shell.background.run(self._services.plan_files.export, self._exported, self._not_exported)

    def _exported(self, done: PlanExport) -> None:
        self.exporting = False
        self._presses.rest("export")
        self._shell.snackbars.show(
            view.export_result(done, self._facts.settings.timezone), icon="calendar-export", seconds=EXPORT_SECONDS
        )

    def _not_exported(self, problem: BaseException) -> None:
        self.exporting = False
        self._shell.say_problem(problem)

    def add_robot(self) -> None:
        self._shell.go("settings", section="robots", add=True)

    def delete(self, schedule: Schedule) -> None:
        """What was entered for it can still be brought back, by hand: perhaps the deletion is undone."""
        if self.form.editing == schedule.id:
            self.form.put_aside()
        self.actions.delete(schedule)


class SchedulerScreen(ScreenBase):
    """One of three tabs, and beside it the form as a sheet."""

    Services, Model = SchedulerServices, SchedulerViewModel
    has_form = BooleanProperty(False)  # an open one

    def __init__(self, vm: SchedulerViewModel, **kwargs: Any) -> None:
        load_kv("scheduler/screen", "scheduler/form", "scheduler/hold")
        super().__init__(vm=vm, **kwargs)
        self._sheets, self._sheet = vm.sheets, cards.FormSheet(card=vm.form)
        self.bind(has_form=self._show_form)
        vm.bind(tab=self._name_tabs, form=self._change_form)
        vm.advice.bind(count=self._name_tabs)
        self._name_tabs()

    def shown(self, **intent: Any) -> None:
        super().shown(**intent)
        self._name_tabs()
        self._show_form()

    def _show_form(self, *_args: Any) -> None:
        """Beside the page; what was entered stays while another screen is shown."""
        if not self.has_form:
            self._sheets.close(self._sheet)
        elif self.vm.is_open:
            self._sheets.show(self._sheet)

    def _name_tabs(self, *_args: Any) -> None:
        count = int(self.vm.advice.count)
        self.tabs = [
            Tab("plan", _("Plan")),
            Tab("schedules", _("Schedules")),
            Tab("suggestions", _("Suggestions"), tone="attention", count=count),
        ]
        self.tab = self.vm.tab

    def choose_tab(self, key: str) -> None:
        self.vm.tab = key

    def _change_form(self, _vm: SchedulerViewModel, form: FormModel) -> None:
        """The focus was in the one of before: this one must not get the keys."""
        dock.leave(self._sheet)
        self._sheets.close(self._sheets.picker)  # it asks for that of before
        self._sheet.card = form
        self._sheet.ids.page.scroll_y = 1
