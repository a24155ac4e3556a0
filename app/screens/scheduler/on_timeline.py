"""The Scheduler's timeline: its content, and the actions of buttons and fingers on it."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from datetime import datetime, time, timedelta
from typing import Any

from kivy.properties import BooleanProperty, ObjectProperty, StringProperty
from kivy.uix.widget import Widget

from app.domain.execution import Execution
from app.domain.models import Schedule
from app.i18n import _
from app.screens.common import formats
from app.screens.common.group_starts import GroupStarts, lacking, robots_for
from app.screens.common.robot_appearance import robot_option
from app.screens.common.shell import Shell
from app.screens.common.view_model import Refresher, ViewModel
from app.screens.scheduler import bar_card, of_groups, timeline, view
from app.screens.scheduler.actions import ScheduleActions
from app.screens.scheduler.draft import Draft
from app.screens.scheduler.facts import SchedulerFacts, SchedulerServices, Window, full_hour
from app.screens.scheduler.form import FormModel
from app.screens.scheduler.timeline import TimelineView
from app.services.catalogue.preview import Forecast
from app.services.planning.planned import PlannedRun
from app.widgets.items import Card, Option

PAGE = 0.5  # of what the plan shows, that a press moves it by
SEEN_BESIDE = 0.6  # of it, that is surely seen while the form is open


@dataclass(frozen=True)
class Moving:
    """A start that was dragged, and what is asked about it."""

    key: tuple[Any, ...]
    to: datetime
    schedule: Schedule
    title: str
    note: str
    keep: str
    only: str
    every: str  # empty: not possible


class OnTimeline(ViewModel):
    """The part of the view model that kv's timeline reads and calls. Hours are those from its origin."""

    timeline = ObjectProperty(TimelineView(), rebind=True)
    free = ObjectProperty(None, allownone=True)  # free time that was tapped: key of its lane, and hour
    free_text = StringProperty()
    moving = ObjectProperty(None, allownone=True, rebind=True)  # a start that waits for an answer
    touched = BooleanProperty(False)  # by a finger that moves it: it must not change under that
    form = ObjectProperty(None, rebind=True)  # FormModel
    actions: ScheduleActions
    group_starts: GroupStarts
    _services: SchedulerServices
    _shell: Shell
    _refresher: Refresher[Any]

    def __init__(self) -> None:
        super().__init__()
        self._facts = SchedulerFacts()
        self._window = Window()  # what the plan shows
        self._plan = TimelineView()  # as it is stored
        self._draft: tuple[Draft, Forecast] | None = None  # that is shown in it
        self._seen_at: datetime | None = None  # its first start that the plan was moved to

    # ------------------------------------------------------------------ the draft in it
    def take_plan(self, shown: TimelineView) -> None:
        """As it was read."""
        if shown.origin != self._plan.origin:
            self.free = None  # its hour is from the former origin
        self._plan = shown
        self._show_plan()

    def show_draft(self, draft: Draft | None, forecast: Forecast | None) -> None:
        """What the form would plan, as far as it is known."""
        if draft is None:
            self._draft = self._seen_at = None
        elif forecast is not None:
            self._draft = draft, forecast
            first = forecast.starts[0].instant if forecast.starts else None
            if first is not None and first != self._seen_at:
                self._seen_at = first
                self._bring_in_sight(first)
        self._show_plan()

    def _bring_in_sight(self, at: datetime) -> None:
        now, window = self._services.clock.now(), self._window
        begins = window.start(now, self._facts.zone)
        if not begins <= at < begins + timedelta(hours=window.hours * SEEN_BESIDE):
            left = full_hour(at - timedelta(hours=1), self._facts.zone)
            self._show_window(replace(window, left=left))

    def _show_plan(self) -> None:
        shown, facts = self._plan, self._facts
        if self._draft is not None:
            draft, forecast = self._draft
            target: Hashable = draft.robot_id if draft.group_id is None else ("group", draft.group_id)
            mission = facts.mission(draft.mission_id)
            shown = timeline.with_draft(
                shown,
                target,
                draft.base.id if draft.base is not None else None,
                forecast,
                mission.name if mission is not None else "",
            )
        if self.moving is not None and shown.origin is not None:
            hour = (self.moving.to - shown.origin).total_seconds() / 3600
            shown = timeline.with_moved(shown, self.moving.key, hour)
        if shown != self.timeline:
            self.timeline = shown

    # ------------------------------------------------------------------ its window
    def choose_span(self, anchor: Widget) -> None:
        """How much is seen at once."""
        items = [Option(hours, timeline.span_text(hours)) for hours in timeline.SPANS]
        self._shell.dialogs.menu(anchor, "", items, self.show_span)

    def show_span(self, hours: float) -> None:
        self._show_window(timeline.spanning(self._window, hours, self._services.clock.now(), self._facts.zone))

    def page(self, forward: bool) -> None:
        self._show_window(
            timeline.moved(
                self._window,
                PAGE if forward else -PAGE,
                self._services.clock.now(),
                self._facts.zone,
                self.timeline.folds,
            )
        )

    def fold(self, hour: float) -> None:
        """Unfold the closed time at that hour, or fold it again."""
        at = self._instant(hour)
        is_folded = any(start <= at < end for start, end in self.timeline.folds)
        self._show_window(replace(self._window, unfolded=self._window.unfolded | {at} if is_folded else frozenset()))

    def to_now(self) -> None:
        self._show_window(replace(self._window, left=None))

    def finger_moved(self, first: float) -> None:
        """To the hour from its origin with which it begins now."""
        self._show_window(replace(self._window, left=self._instant(first)))

    def choose_robots(self) -> None:
        """Whose lanes are shown; none chosen: all."""
        options = list(map(robot_option, self._facts.robots))
        self._shell.dialogs.choose_many(
            _("Robots in the plan"), options, _("Show"), self._robots_chosen, selected=tuple(self._window.robots)
        )

    def _robots_chosen(self, robots: list[int]) -> None:
        self._show_window(replace(self._window, robots=frozenset(robots)))

    def open_line(self, key: Hashable) -> None:
        """The lanes that a line stands for, or the line alone."""
        is_open = any(lane.key == key and lane.is_open for lane in self.timeline.lanes)
        self._show_window(replace(self._window, opened="" if is_open else key))

    def _show_window(self, window: Window) -> None:
        """Show at once what has been read already, and the rest after the next reading."""
        self._window = window
        if self._plan.origin is not None:
            start = window.start(self._services.clock.now(), self._facts.zone)
            self._plan = replace(
                self._plan,
                first=(start - self._plan.origin).total_seconds() / 3600,
                hours=window.hours,
            )
            self._show_plan()
        self.free = None
        self._refresher.read()

    def _move_now(self) -> None:
        """Move the now-line; a window that moves with it does so with the next reading."""
        if self._plan.origin is not None and not self.touched:
            now = self._services.clock.now()
            self._plan = replace(
                self._plan,
                now=(now - self._plan.origin).total_seconds() / 3600,
                now_label=formats.wall_time(now.astimezone(self._facts.zone)),
            )
            self._show_plan()

    # ------------------------------------------------------------------ its bars
    def open_bar(self, key: tuple[Any, ...], place: Widget) -> None:
        """A bar of the timeline was tapped at ``place``: show its card, or zoom into one that represents several."""
        self.free = None
        match key:
            case ("zoom", middle, length):
                hours = float(next((span for span in timeline.SPANS if span >= length), self._window.hours))
                hours = min(hours, max(self._window.hours / 2, timeline.SPANS[0]))
                self._show_window(replace(self._window, left=self._instant(middle - hours / 2), hours=hours))
            case _:
                if (found := self._card(key)) is not None:
                    card, calls = found
                    self._shell.dialogs.menu(place, card.title, card.items, lambda chosen: calls[chosen](), card.text)

    def _card(self, key: tuple[Any, ...]) -> tuple[Card, dict[Hashable, Callable[[], object]]] | None:
        """Of a bar, and what its commands do."""
        match key:
            case ("execution", number):
                execution = next((one for one in self._facts.past if one.id == number), None)
                if execution is not None:
                    schedule_id = execution.schedule_id or 0
                    return bar_card.run_card(self._facts, execution, self._services.clock.now()), {
                        "log": lambda: self._shell.go("logs", execution_id=number),
                        "edit": lambda: self.edit(schedule_id),
                        "again": lambda: self._take_again(schedule_id, execution.planned_at),
                        "give": lambda: self._give(execution),
                        "priority": lambda: self.group_starts.prioritise(execution),
                        "hold": lambda: self.group_starts.hold(execution, True),
                        "release": lambda: self.group_starts.hold(execution, False),
                        "cancel": lambda: self.group_starts.cancel(execution),
                    }
            case ("schedule", number, at):
                run = next((one for one in self._facts.planned if (one.schedule.id, one.at) == (number, at)), None)
                if run is not None:
                    return bar_card.start_card(self._facts, run, self._services.clock.now()), {
                        "move": lambda: self.pick_move(key),
                        "robot": lambda: self.pick_robot(run),
                        "edit": lambda: self.edit(run.schedule.moved_of or number),
                        "skip": lambda: self.actions.skip(run.schedule, at),
                        "run": lambda: self.actions.run_now(run.schedule),
                    }
        return None

    def _take_again(self, schedule_id: int, at: datetime) -> None:
        if (schedule := self._facts.schedule(schedule_id)) is not None:
            self.actions.unskip(schedule, at)

    def _give(self, execution: Execution) -> None:
        facts = self._facts
        self.group_starts.give(
            execution,
            robots_for(execution, facts.robots, facts.groups, facts.holds, facts.settings, self._services.clock.now()),
        )

    # ------------------------------------------------------------------ the form beside it
    def begin(self, draft: Draft | None = None) -> None:
        """A form with ``draft``, or an empty one."""
        self.show_form(FormModel(self._services, self._shell, self, self._facts, draft))

    def show_form(self, form: FormModel) -> None:
        """In the place of another one."""
        form.is_open = True  # the sheet stays
        before, self.form = self.form, form
        form.open()
        if before is not form:
            before.put_aside()

    def new(self) -> None:
        """It begins with the choice of a mission."""
        self.begin()
        self.form.choose_mission()

    def edit(self, schedule_id: int) -> None:
        schedule = self._facts.schedule(schedule_id)
        if schedule is not None and schedule.moved_of is not None:
            schedule = self._facts.schedule(schedule.moved_of)
        if schedule is not None and self.form.editing != schedule.id:
            self.begin(Draft.of(schedule, self._facts.name(schedule)))

    @property
    def shown_until(self) -> datetime:
        """The end of what the plan shows, without days off in it."""
        return self._window.start(self._services.clock.now(), self._facts.zone) + timedelta(hours=self._window.hours)

    # ------------------------------------------------------------------ fingers
    def day_text(self, hour: float) -> str:
        """The day of an hour of the plan, unless it is today; with the year of another one."""
        if self.timeline.origin is None:
            return ""
        day, today = (
            instant.astimezone(self._facts.zone).date() for instant in (self._instant(hour), self._services.clock.now())
        )
        return "" if day == today else formats.wall_day(day, year=day.year != today.year)

    def time_text(self, hour: float) -> str:
        """When that is, in hours from the timeline's origin."""
        return formats.day_and_time(self._instant(hour), self._facts.settings.timezone, self._services.clock.now())

    def tap_free(self, lane: Hashable, hour: float) -> None:
        """Offer a new schedule there; a tap elsewhere takes the offer away."""
        at = self._instant(hour)
        is_robot = isinstance(lane, int) and at > self._services.clock.now()
        self.free_text = formats.clock_time(at, self._facts.settings.timezone) if is_robot else ""
        self.free = (lane, hour) if is_robot else None

    def begin_free(self) -> None:
        """A new schedule in the form, at the offered time."""
        if self.free is not None:
            (robot_id, hour), self.free, form = self.free, None, self.form
            if not form.is_open or not form.draft.is_new or form.saving or form.draft.group_id is not None:
                self.begin()
            self.form.aim(robot_id, self._instant(hour))

    def move_start(self, key: tuple[Any, ...], hour: float) -> None:
        """A planned start was dragged: ask whether only this one, or all of its rule."""
        _kind, number, at = key
        planned = (run.schedule for run in self._facts.planned if (run.schedule.id, run.at) == (number, at))
        if (schedule := next(planned, None)) is None:
            return
        if self._instant(hour) <= self._services.clock.now():
            self._shell.snackbars.show(_("That time has passed"), icon="clock-alert-outline")
            return
        to, zone = self._instant(hour), schedule.timezone
        before, after = (formats.clock_time(moment, zone) for moment in (at, to))
        repeats = schedule.recurrence is not None
        moved = self.actions.moved(self._facts, schedule, at, to) if repeats else None
        was = formats.day_and_time(at, zone, self._services.clock.now())
        note = _("was {time}").format(time=was)
        if moved is not None:
            rule = view.zoned(view.short_rule(moved), zone, self._facts)
            if self._facts.drops_single_changes(moved):
                rule = _("{rule}, also those moved or skipped before").format(rule=rule)
            note += f" · {_('All starts')}: {rule}"
        self.moving = Moving(
            key,
            to,
            schedule,
            title=f"{self._facts.called(schedule)} → {after}",
            note=note,
            keep=_("Keep {time}").format(time=before),
            only=_("Only {time}").format(time=was) if repeats else _("Move"),
            every=_("All starts") if moved is not None else "",
        )
        self._show_plan()

    def keep_moved(self) -> None:
        """It stays where it was."""
        self.moving = None
        self._show_plan()

    def move_only(self) -> None:
        moving: Moving = self.moving
        self.keep_moved()
        self.actions.move_one(moving.schedule, moving.key[2], moving.to)

    def move_all(self) -> None:
        moving: Moving = self.moving
        self.keep_moved()
        self.actions.move_all(self._facts, moving.schedule, moving.key[2], moving.to)

    def pick_move(self, key: tuple[Any, ...]) -> None:
        """Of a planned start: ask for its new time of day."""
        zone, at = self._facts.zone, key[2]
        local = at.astimezone(zone)

        def picked(to: time) -> None:
            instant = local.replace(hour=to.hour, minute=to.minute)
            self.move_start(key, (instant - (self.timeline.origin or instant)).total_seconds() / 3600)

        self._shell.dialogs.pick_time(_("Move to"), local.time(), picked)

    def pick_robot(self, run: PlannedRun) -> None:
        """Of a planned start: ask which other one takes it. One without its mission can't."""
        facts = self._facts
        lacks = lacking(run.mission, facts.robots, facts.missions, facts.names)

        def picked(robot_id: int) -> None:
            robot = facts.robot(robot_id)
            if robot is not None and robot.name in lacks:
                said = _("{robot} does not have the mission {mission}").format(
                    robot=robot.name, mission=run.mission.name
                )
                self._shell.snackbars.show(said, icon="alert-circle-outline")
            else:
                self.actions.move_one(run.schedule, run.at, run.at, robot)

        self._shell.dialogs.choose(_("Move to"), of_groups.other_robots(facts, run, lacks), picked)

    def _instant(self, hour: float) -> datetime:
        return (self.timeline.origin or self._services.clock.now()) + timedelta(hours=hour)
