"""The Scheduler's timeline: its content, and the actions of buttons and fingers on it."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any
from zoneinfo import ZoneInfo

from kivy.properties import BooleanProperty, ObjectProperty
from kivy.uix.widget import Widget

from app.domain.models import Execution
from app.i18n import _
from app.screens.common import formats
from app.screens.common.group_starts import GroupStarts, robots_for
from app.screens.common.options import Card, Option
from app.screens.common.shell import Shell
from app.screens.common.view_model import Refresher, ViewModel
from app.screens.scheduler import bar_card, timeline
from app.screens.scheduler.actions import ScheduleActions
from app.screens.scheduler.draft import Draft
from app.screens.scheduler.facts import SchedulerFacts, SchedulerServices, Window
from app.screens.scheduler.form import FormModel
from app.screens.scheduler.timeline import TimelineView

PAGE = 0.5  # of what the timeline shows, that a press moves it by


class OnTimeline(ViewModel):
    """The part of the view model that kv's timeline reads and calls. Hours are those from its origin."""

    timeline = ObjectProperty(TimelineView(), rebind=True)
    follows = BooleanProperty(True)  # the timeline moves with the time
    touched = BooleanProperty(False)  # by fingers that move it: it must not change under them
    form: FormModel
    actions: ScheduleActions
    group_starts: GroupStarts
    _services: SchedulerServices
    _shell: Shell
    _refresher: Refresher[Any]
    _facts: SchedulerFacts
    _window: Window  # what the timeline shows

    # ------------------------------------------------------------------ its window
    def zoom(self, further: bool) -> None:
        self._show_window(timeline.zoomed(self._window, further, self._services.clock.now(), self._facts.zone))

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

    def fingers_moved(self, first: float, hours: float) -> None:
        """To what the timeline shows now, in hours from its origin."""
        self._show_window(replace(self._window, left=self._instant(first), hours=hours))

    def choose_robots(self) -> None:
        """Whose lanes are shown; none chosen: all."""
        options = [Option(robot.id, robot.name, "robot-outline", robot.model or "") for robot in self._facts.robots]
        self._shell.dialogs.choose_many(
            _("Robots on the timeline"), options, _("Show"), self._robots_chosen, selected=tuple(self._window.robots)
        )

    def _robots_chosen(self, robots: list[int]) -> None:
        self._show_window(replace(self._window, robots=frozenset(robots)))

    def open_line(self, key: Hashable) -> None:
        """The lanes that a line stands for, or the line alone."""
        self._show_window(replace(self._window, opened=self._window.opened ^ {key}))

    def _show_window(self, window: Window) -> None:
        """Show at once what has been read already, and the rest after the next reading."""
        self._window, self.follows = window, window.left is None
        if self.timeline.origin is not None:
            start = window.start(self._services.clock.now(), self._facts.zone)
            self.timeline = replace(
                self.timeline,
                first=(start - self.timeline.origin).total_seconds() / 3600,
                hours=window.hours,
                span=timeline.span_text(window.hours),
            )
        self._refresher.read()

    def _move_now(self) -> None:
        """Move the now-line; a window that moves with it does so with the next reading."""
        if self.timeline.origin is not None and not self.touched and self.mode == "hours":
            now = self._services.clock.now()
            self.timeline = replace(
                self.timeline,
                now=(now - self.timeline.origin).total_seconds() / 3600,
                now_label=formats.wall_time(now.astimezone(self._facts.zone)),
            )

    # ------------------------------------------------------------------ its bars
    def open_bars(self, keys: Sequence[tuple[Any, ...]], place: Widget) -> None:
        """Overlapping bars of the timeline were tapped at ``place``: show their cards, the first one first. Zoom into a
        bar that represents several."""
        match keys[0]:
            case ("zoom", middle, length):
                hours = float(next((span for span in timeline.SPANS if span >= length), self._window.hours))
                hours = min(hours, max(self._window.hours / 2, timeline.SPANS[0]))
                self._show_window(replace(self._window, left=self._instant(middle - hours / 2), hours=hours))
            case _:
                if cards := [card for key in keys if (card := self._card(key)) is not None]:
                    self._shell.dialogs.cards(
                        place, [card for card, _calls in cards], lambda n, key: cards[n][1][key]()
                    )

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
                        "edit": lambda: self.edit(number),
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

    def edit(self, schedule_id: int) -> None:
        if (schedule := self._facts.schedule(schedule_id)) is not None:
            self.form.edit(schedule)

    # ------------------------------------------------------------------ fingers
    def day_text(self, hour: float) -> str:
        """The day of an hour of the timeline, with the year of another one."""
        if self.timeline.origin is None:
            return ""
        day, today = (
            instant.astimezone(self._facts.zone).date() for instant in (self._instant(hour), self._services.clock.now())
        )
        return formats.wall_day(day, year=day.year != today.year)

    def time_text(self, hour: float) -> str:
        """When that is, in hours from the timeline's origin."""
        return formats.day_and_time(self._instant(hour), self._facts.settings.timezone, self._services.clock.now())

    def begin_at(self, robot_id: int, hour: float) -> None:
        """A new schedule in the form."""
        if self._is_ahead(hour):
            self.form.begin_at(robot_id, self._instant(hour))

    def move_start(self, key: tuple[Any, ...], hour: float) -> None:
        """A planned start was dragged: open the form with its new time and the other entries. It counts when it is
        saved."""
        _kind, number, at = key
        if (schedule := self._facts.schedule(number)) is None or not self._is_ahead(hour):
            return
        before, after = (
            instant.astimezone(ZoneInfo(schedule.timezone)).replace(tzinfo=None)
            for instant in (at, self._instant(hour))
        )
        stored = Draft.of(schedule, self._facts.name(schedule))
        moved, shown = stored.moved(before, after), self.form.draft if self.form.editing == number else stored
        if moved.starts_at(after, self._facts.calendar):
            draft = shown.timed_as(moved)
            self.form.begin(draft if draft.keeps(shown) else moved)  # of another rule than the bar's nothing is kept
        else:
            self.form.begin(shown)
            self._say(_("No start of this rule can be moved there: change the rule itself"), "calendar-edit-outline")

    def _instant(self, hour: float) -> datetime:
        return (self.timeline.origin or self._services.clock.now()) + timedelta(hours=hour)

    def _is_ahead(self, hour: float) -> bool:
        if self._instant(hour) > self._services.clock.now():
            return True
        self._say(_("That time has passed"), "clock-alert-outline")
        return False

    def _say(self, text: str, icon: str) -> None:
        self._shell.snackbars.show(text, icon=icon)
