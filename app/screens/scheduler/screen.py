"""Scheduler: what will happen, the form to plan it, the schedules. Facts are read in the background; view.py, timeline.py and form_view.py
make texts and bars of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from kivy.clock import Clock
from kivy.properties import (
    AliasProperty,
    BooleanProperty,
    ListProperty,
    NumericProperty,
    ObjectProperty,
    OptionProperty,
)
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.widget import Widget

from app.domain.models import Schedule
from app.i18n import _
from app.screens.common.group_starts import GroupStarts
from app.screens.common.holding import about_hold
from app.screens.common.mission_names import MissionNameLookup
from app.screens.common.presses import Presses
from app.screens.common.shell import Shell
from app.screens.common.started import StartReports, as_it_is
from app.screens.common.view_model import Changed, Refresher, ScreenBase
from app.screens.scheduler import hold_view, timeline, view
from app.screens.scheduler.actions import ScheduleActions
from app.screens.scheduler.advice import NO_ADVICE, AdviceModel
from app.screens.scheduler.cards import SchedulerEmpty
from app.screens.scheduler.draft import Draft
from app.screens.scheduler.facts import SchedulerFacts, SchedulerServices, Window, read, silent, stopped
from app.screens.scheduler.form import FormModel
from app.screens.scheduler.hold import HoldDialog
from app.screens.scheduler.listed import ScheduleList
from app.screens.scheduler.on_timeline import OnTimeline
from app.screens.scheduler.timeline import TimelineView
from app.screens.scheduler.view import DayRow
from app.services.files.plan_export import PlanExport
from app.services.live.changes import Topic
from app.widgets import load_kv
from app.widgets.dock import dock

REFRESH_SECONDS = 60.0  # after which the plan is read again even without a published change
EXPORT_SECONDS = 12.0  # that the path of an export stays on screen
NOW_LINE_SECONDS = 15.0  # between two positions of the now-line: at its widest the timeline has 17 s per pixel
MANY = 200  # schedules, from which on their texts are not rebuilt every second

Reading = tuple[Window | None, SchedulerFacts, TimelineView | list[DayRow]]  # what was asked for, and what to show


class SchedulerViewModel(OnTimeline):
    """What kv reads. ``mode``: the timeline, or the list of 7 days."""

    mode = OptionProperty("hours", options=("hours", "days"))
    paged = BooleanProperty(False)  # plan, form and schedules are shown one at a time
    part = OptionProperty("plan", options=("plan", "form", "schedules"))  # which of them
    days = ListProperty()
    has_robots = BooleanProperty(True)
    held = BooleanProperty(False)  # nothing is sent to any robot
    narrow = BooleanProperty(False)
    side_by_side = BooleanProperty(False)  # the form has room next to the list of days
    exporting = BooleanProperty(False)
    advice = ObjectProperty(NO_ADVICE, rebind=True)

    def __init__(self, services: SchedulerServices, shell: Shell) -> None:
        super().__init__()
        self._services, self._shell = services, shell
        self._refresher = Refresher(shell, self._reading, self._take)
        self._started = StartReports(shell, as_it_is(services.history, services.holds))
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
        self.form = FormModel(services, shell, saved=self._saved, skip=self.actions.skip, again=self.actions.unskip)
        self.advice = AdviceModel(services, shell, lambda: self._facts, self.form.begin, self._refresher.request)
        self.listed = ScheduleList(shell, services.clock.now)
        self._given = MissionNameLookup(services.robot_missions, services.clock, shell, self._refresher.request)
        self._facts, self._is_read = SchedulerFacts(), False
        self._window = Window()  # what the timeline shows
        self._presses = Presses()
        self._wanted: int | None = None  # a schedule to open as soon as they are read
        self.form.fbind("view", lambda *_args: self._show_schedules())
        self.fbind("narrow", self._refresher.request)
        self.fbind("touched", self._touch_changed)

    # ------------------------------------------------------------------ reading
    def opened(
        self,
        schedule_id: int | None = None,
        plan: tuple[str, Window] | None = None,
        form: FormModel | None = None,
        drafts: Sequence[Draft] = (),
        back: Draft | None = None,
    ) -> None:
        """``schedule_id`` opens that schedule in the form; ``plan`` is the ``shown_plan`` and ``form`` the one to
        continue; ``drafts`` are the other drafts, and ``back`` the draft to open in the form."""
        self._wanted = schedule_id
        if form is not None:
            self.form.go_on_from(form)
        self.form.restore_drafts(drafts)
        self.form.retranslated()  # in Settings, since
        if plan is not None:
            self.mode, self._window = plan
            self.follows = self._window.left is None
        if back is not None:
            self.form.begin(back)
        self.keep(self._shell.bus.subscribe(Changed, self._changed))
        self.keep(self._refresher.start())
        self.keep(self._started.open())
        self.keep(self.advice.opened())
        self.every(1, self._tick)
        self.every(NOW_LINE_SECONDS, self._move_now)
        self.every(REFRESH_SECONDS, self._refresher.request)
        self._refresher.read()

    def closed(self) -> None:
        self.form.leave()

    def _changed(self, event: Changed) -> None:
        """The plan does not depend on robots' frequent reports."""
        if event.topic is not Topic.SNAPSHOT:
            self._refresher.request()

    def retranslated(self) -> None:
        self._show_schedules()
        self.form.retranslated()
        self.advice.show()
        self._refresher.request()

    def _touch_changed(self, *_args: object) -> None:
        if not self.touched:
            self._refresher.request()

    def _reading(self) -> Callable[[], Reading]:
        services, window, narrow = self._services, self._window if self.mode == "hours" else None, self.narrow
        mission_names = self._shell.mission_names.known

        def work() -> Reading:
            facts, now = replace(read(services, window), mission_names=mission_names), services.clock.now()
            return (
                window,
                facts,
                view.days(facts, now) if window is None else timeline.timeline(facts, now, window, narrow),
            )

        return work

    def _take(self, reading: Reading) -> None:
        window, facts, shown = reading
        self._facts, self._is_read = facts, True
        self._given.look(facts.robots, facts.given_to())
        self.has_robots = bool(facts.robots)
        self.held = any(hold.covers(None, self._services.clock.now()) for hold in facts.holds)
        self.form.take(facts)
        wanted, self._wanted = self._wanted, None  # if it is not there now, nothing waits for it
        if (schedule := facts.schedule(wanted)) is not None:
            self.form.edit(schedule)
        if isinstance(shown, TimelineView):
            if not self.touched and window == self._window:  # else it has changed since
                self.timeline = shown
        elif self.mode == "days":
            self.days = shown
        self._show_schedules()

    # ------------------------------------------------------------------ showing
    def _tick(self) -> None:
        services, facts = self._services, self._facts
        if (
            silent(services.snapshots, facts.robots) != facts.silent
            or stopped(services, facts.settings, facts.robots) != facts.stopped
        ):
            self._refresher.request()
        if len(self._facts.schedules) <= MANY:
            self._show_schedules()

    def _show_schedules(self) -> None:
        if self._is_read:  # unknown until then
            self.listed.show(self._facts, self.form.editing)

    @property
    def shown_plan(self) -> tuple[str, Window]:
        """The timeline or the list, and what the timeline shows."""
        return self.mode, self._window

    def _get_shown_part(self) -> str:
        part: str = self.mode if self.part == "plan" else self.part
        return part

    shown_part = AliasProperty(_get_shown_part, bind=("mode", "part"))  # the chosen page, if the screen is paged

    def choose_part(self, part: str) -> None:
        if part in ("hours", "days"):
            self.part = "plan"
            if part != self.mode:
                self.choose_mode(part)
        else:
            self.part = part

    def _saved(self, schedule: Schedule, is_left: bool) -> bool:
        """Show it in the form, unless another one is being edited there. Returns whether the form shows the message
        itself."""
        is_said: bool = self.advice.saved(schedule)
        if is_left:
            self.part = "plan"
        self._refresher.reread()
        return is_said

    def choose_mode(self, mode: str) -> None:
        self.mode = mode
        self.days = []
        self._refresher.read()

    # ------------------------------------------------------------------ what the operator presses
    def open_day(self, key: tuple[str, int, Any]) -> None:
        if not self.side_by_side and not self.paged:
            self.choose_mode("hours")
        self.edit(key[1])

    def row_action(self, schedule_id: int, action: str, *values: Any) -> None:
        """A row of the list was used."""
        match action:
            case "edit":
                self.edit(schedule_id)
            case "switch":
                self.actions.switch(schedule_id, values[0])
            case "menu":
                self._menu(schedule_id, values[0])

    def _menu(self, schedule_id: int, anchor: Widget) -> None:
        schedule = self._facts.schedule(schedule_id)
        if schedule is None:
            return
        calls: dict[str, Callable[[Schedule], object]] = {
            "edit": self.form.edit,
            "run": self.actions.run_now,
            "skip": self.actions.skip_next,
            "pause": self.actions.pause,
            "resume": self.actions.resume,
            "duplicate": self.form.duplicate,
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
        """Hold all robots, or one; while all are held, release them."""
        if self.held:
            self._shell.background.run(
                self._services.holds.release,
                lambda _none: self._shell.snackbars.show(
                    _("Released"), icon="play-circle-outline", about=about_hold(None)
                ),
                self._shell.say_problem,
            )
        elif self._facts.robots:
            robot_id = hold_view.looked_at(self._facts, self._window.robots, self._shell.navigator.all_robots)
            self._shell.dialogs.open(HoldDialog(self._services, self._shell, self._facts, robot_id=robot_id))

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
        self.form.deleted(schedule)
        self.actions.delete(schedule)


class SchedulerScreen(ScreenBase):
    """Upcoming across the top, below it the form and the schedules; the list of days has the form beside it, or where that has no ``room``
    the whole screen. In a low window each of them is a page of its own (``paged``)."""

    Services = SchedulerServices
    room = BooleanProperty(False)
    paged = BooleanProperty(False)
    lower_height = NumericProperty(0)  # least, of the form and the schedules

    def __init__(self, services: SchedulerServices, shell: Shell, **kwargs: Any) -> None:
        load_kv("widgets/flow", "scheduler/screen", "scheduler/form", "scheduler/hold", "scheduler/advice")
        super().__init__(vm=SchedulerViewModel(services, shell), **kwargs)
        self._page = self.ids.page.__self__
        self._parts = {name: self.ids[name].__self__ for name in ("parts", "upcoming", "lower", "form", "schedules")}
        self._empty = SchedulerEmpty()
        self._empty.bind(on_release=lambda _empty: self.vm.add_robot())
        for name in ("mode", "part", "has_robots"):
            self.vm.fbind(name, self._choose_parts)
        self.fbind("room", self._choose_parts)
        self.fbind("paged", self._turn_pages)
        self.fbind("portrait", self.vm.setter("narrow"))
        self._show_form_soon = Clock.create_trigger(self._show_form)
        self.vm.form.bind(on_draft=self._form_is_filled, entry=self._type_no_more)
        self._choose_parts()

    def place(self) -> dict[str, Any]:
        """With what somebody was filling in."""
        return {"plan": self.vm.shown_plan, "form": self.vm.form}

    def _form_is_filled(self, *_: Any) -> None:
        self._show_form_soon()

    def _show_form(self, _dt: float) -> None:
        """Bring it in sight: it may be on another page, or scrolled away."""
        if self.paged:
            self.vm.part = "form"
        elif self._page.do_scroll_y and self._parts["lower"].parent is not None:
            self._page.scroll_to(self.ids.form, padding=0, animate=False)

    def _type_no_more(self, *_: Any) -> None:
        """The focus was in a draft that has left the form: the new one must not get the keys."""
        dock.leave(self._parts["form"])

    def _turn_pages(self, *_: Any) -> None:
        """The banner of an alarm, or a smaller window, takes no form away that somebody fills in."""
        if self.paged and self.vm.form.is_in_use:
            self.vm.part = "form"
        self._choose_parts()

    def _choose_parts(self, *_: Any) -> None:
        wanted = self._page if self.vm.has_robots else self._empty
        if wanted not in self.children:
            self.clear_widgets()
            self.add_widget(wanted)
        in_hours, self.vm.paged = self.vm.mode == "hours", self.paged
        self.vm.side_by_side = self.room and not in_hours
        if self.paged:
            plan = self.vm.part == "plan"
            self._arrange(self.ids.lower, *(() if plan else (self.vm.part,)))
            self._arrange(self.ids.column, "parts", "upcoming" if plan else "lower")
        else:
            self._arrange(self.ids.lower, "form", *(("schedules",) if in_hours else ()))
            self._arrange(self.ids.column, "upcoming", *(("lower",) if in_hours or self.room else ()))

    def _arrange(self, box: BoxLayout, *names: str) -> None:
        """Exactly these parts, in that order; new ones are shown from their top."""
        wanted = [self._parts[name] for name in names]
        if box.children[::-1] != wanted:
            self._page.scroll_y = 1
            box.clear_widgets()
            for part in wanted:
                box.add_widget(part)
