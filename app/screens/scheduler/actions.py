"""What an operator does with a schedule apart from editing it: run it now, skip starts, pause, delete."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from datetime import date, datetime, timedelta
from functools import partial
from zoneinfo import ZoneInfo

from app.domain.models import InvalidInput, Robot, Schedule
from app.i18n import _
from app.screens.common import formats
from app.screens.common.presses import Commands
from app.screens.common.shell import Shell
from app.screens.common.started import StartReports
from app.screens.scheduler import view
from app.screens.scheduler.draft import Draft
from app.screens.scheduler.facts import SchedulerFacts, SchedulerServices
from app.services.catalogue.catalogue import Removed
from app.services.catalogue.undo import Changed


class ScheduleActions:
    """Commands in the background, one at a time for each schedule; ``done()`` when one ends, even with an error: its
    effect can be read. ``name`` returns a schedule's name."""

    def __init__(
        self,
        services: SchedulerServices,
        shell: Shell,
        started: StartReports,
        name: Callable[[Schedule], str],
        done: Callable[[], object],
    ) -> None:
        self._services, self._shell, self._started, self._name, self._done = services, shell, started, name, done
        self._act = Commands(shell, done).run

    def switch(self, schedule_id: int, on: bool) -> None:
        words = _("{name} is switched on") if on else _("{name} is switched off")

        def switched(changed: Changed) -> None:
            self._offer_undo(words.format(name=self._name(changed.after)), changed)

        self._act(schedule_id, lambda: self._services.catalogue.switch_schedule(schedule_id, on), switched)

    def run_now(self, schedule: Schedule) -> None:
        """With the schedule's own parameters, ignoring its constraints. Asked first: it can't be undone."""
        title = _("Run {name} now?").format(name=self._name(schedule))
        self._shell.sheets.ask(title, "", _("Run now"), lambda: self._run(schedule))

    def _run(self, schedule: Schedule) -> None:
        operator = self._services.operator
        start, target = (
            (operator.run_now, schedule.robot_id)
            if schedule.group_id is None
            else (operator.run_on_any, schedule.group_id)
        )
        self._act(
            schedule.id, lambda: start(target or 0, schedule.mission_id, schedule.parameters), self._started.follow
        )

    def skip_next(self, schedule: Schedule) -> None:
        if schedule.next_at is not None:
            self.skip(schedule, schedule.next_at)

    def skip(self, schedule: Schedule, at: datetime) -> None:
        """The start planned at that instant."""
        self._act(
            schedule.id,
            lambda: self._services.pausing.skip(schedule.id, at),
            lambda _none: self._was_skipped(schedule, at),
        )

    def unskip(self, schedule: Schedule, at: datetime) -> None:
        """What was skipped is started after all."""
        text = _("The start of {name} is planned again: {time}").format(
            name=self._name(schedule), time=self._time(schedule, at)
        )
        pausing = self._services.pausing
        self._act(
            schedule.id,
            lambda: pausing.unskip(schedule.id, at, must_run=True),
            lambda _none: self._shell.offer_undo(
                text, lambda: pausing.skip(schedule.id, at), self._done, about=about(schedule.id, at)
            ),
        )

    # ------------------------------------------------------------------ moving a start
    @staticmethod
    def moved(facts: SchedulerFacts, schedule: Schedule, at: datetime, to: datetime) -> Schedule | None:
        """The schedule with all its starts moved like that one. None: its rule can't, doesn't have that one, or stays the same."""
        zone = ZoneInfo(schedule.timezone)
        before, after = (moment.astimezone(zone).replace(tzinfo=None) for moment in (at, to))
        draft = Draft.of(schedule, facts.name(schedule))
        moved = draft.moved(before, after)
        can = draft.starts_at(before, facts.calendar) and moved.starts_at(after, facts.calendar)
        return moved.schedule() if can and not moved.is_stored else None

    def move_one(self, schedule: Schedule, at: datetime, to: datetime, robot: Robot | None = None) -> None:
        """Only the start planned at that instant, to another time or ``robot``."""
        moving, local = self._services.moving, to.astimezone(ZoneInfo(schedule.timezone)).replace(tzinfo=None)
        time = self._time(schedule, to)
        where = f"{robot.name} · {time}" if robot is not None else time
        text = _("{name} is moved to {where}").format(name=self._name(schedule), where=where)
        self._act(
            schedule.id,
            lambda: moving.move(schedule.id, at, local, robot_id=robot.id if robot is not None else None),
            lambda moved: self._shell.offer_undo(
                text, lambda: moving.undo(moved), self._done, about=about(schedule.id, at)
            ),
        )

    def move_all(self, facts: SchedulerFacts, schedule: Schedule, at: datetime, to: datetime) -> None:
        """All its starts like that one, and nothing else of it as it is now: it may have been edited since the drag."""
        catalogue = self._services.catalogue

        def work() -> Changed:
            before = catalogue.schedule(schedule.id)
            moved = self.moved(facts, before, at, to) if before is not None else None
            if before is None or moved is None:
                raise InvalidInput("schedule", "this schedule no longer has this start")
            return catalogue.change_schedule(before, moved)

        def has_moved(changed: Changed) -> None:
            rule = view.zoned(view.short_rule(changed.after), schedule.timezone, facts)
            self._offer_undo(_("{name} is changed: {rule}").format(name=self._name(schedule), rule=rule), changed)

        self._act(schedule.id, work, has_moved)

    def _offer_undo(self, text: str, changed: Changed) -> None:
        undo = partial(self._services.catalogue.undo_change, changed)
        self._shell.offer_undo(text, undo, self._done, about=about(changed.after.id))

    def pause(self, schedule: Schedule) -> None:
        """Ask for the day on which it starts again; until then its starts are skipped."""
        today = self._services.clock.now().astimezone(ZoneInfo(schedule.timezone)).date()
        tomorrow = today + timedelta(days=1)
        self._shell.dialogs.pick_date(
            _("First day with starts again"),
            tomorrow,
            lambda day: self._pause_until(schedule, day),
            today=today,
            first=tomorrow,
        )

    def resume(self, schedule: Schedule) -> None:
        self._act(
            schedule.id,
            lambda: self._services.pausing.resume(schedule.id),
            lambda _resumed: self._say(
                schedule, _("{name} is resumed").format(name=self._name(schedule)), "play-circle-outline"
            ),
        )

    def delete(self, schedule: Schedule) -> None:
        """At once; it can be undone."""
        text = _("{name} is deleted").format(name=self._name(schedule))  # while its mission and robot are known

        def deleted(removed: Removed) -> None:
            self._shell.offer_undo(
                text,
                lambda: self._services.catalogue.restore(removed),
                self._done,
                about=about(schedule.id),
            )

        self._act(schedule.id, lambda: self._services.catalogue.remove_schedule(schedule.id), deleted)

    # ------------------------------------------------------------------ inside
    def _was_skipped(self, schedule: Schedule, at: datetime) -> None:
        text = _("The start of {name} is skipped: {time}").format(
            name=self._name(schedule), time=self._time(schedule, at)
        )
        self._shell.offer_undo(
            text, lambda: self._services.pausing.unskip(schedule.id, at), self._done, about=about(schedule.id, at)
        )

    def _time(self, schedule: Schedule, at: datetime) -> str:
        return formats.day_and_time(at, schedule.timezone, self._services.clock.now())

    def _pause_until(self, schedule: Schedule, day: date) -> None:
        until = view.day_begins(day, ZoneInfo(schedule.timezone))
        said = _("{name} is paused until {day}").format(name=self._name(schedule), day=formats.wall_day(day))
        self._act(
            schedule.id,
            lambda: self._services.pausing.pause(schedule.id, until),
            lambda _paused: self._say(schedule, said, "pause-circle-outline"),
        )

    def _say(self, schedule: Schedule, text: str, icon: str) -> None:
        self._shell.snackbars.show(text, icon=icon, about=about(schedule.id))


def about(schedule_id: int, at: datetime | None = None) -> Hashable:
    """The subject of messages about a schedule, or about its start at that instant: a newer one replaces the older."""
    return "schedule", schedule_id, at
