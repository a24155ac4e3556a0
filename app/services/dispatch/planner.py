"""Turns schedules into executions when they fall due: each occurrence one row, in the same transaction that advances its schedule."""

from __future__ import annotations

import logging
import sqlite3
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from typing import NamedTuple

from app.database.connection import Database
from app.database.execution_history import ExecutionHistory
from app.database.executions import ExecutionRepository
from app.database.group_executions import GroupExecutionRepository
from app.database.groups import GroupRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import Progress, ScheduleRepository
from app.database.settings import SettingsRepository
from app.domain import rules
from app.domain.clock import EARLIEST, MOMENT, Clock
from app.domain.execution import Execution, Reason, ReasonCode, State, Wait
from app.domain.models import Alarm, Robot, Schedule, Settings
from app.services.dispatch.ledger import Ledger
from app.services.dispatch.messages import Readiness
from app.services.dispatch.planned_rows import PlanningContext, RowMaker, passed
from app.services.dispatch.restored_starts import RestoredStarts
from app.services.dispatch.timing import LONGEST_WAIT
from app.services.executions import transitions
from app.services.executions.transitions import NOT_WITH_THE_ROBOT, Transition
from app.services.live.alarms import Alarms
from app.services.live.changes import NO_ROBOT, Changes, Topic
from app.services.live.downtime import UNKNOWN_START, Downtime, Gap
from app.services.planning.planned import first_due
from app.services.planning.recurrence import next_occurrence
from app.services.planning.working_days import WorkingCalendar, working_calendar

log = logging.getLogger(__name__)

LATELY = timedelta(minutes=1)  # earlier starts are written after those due now
AT_ONCE = 100  # schedules and rows per transaction, so that no burst blocks the writer for long
COUNTS_FOR = 10  # rows: one whose starts have to be counted, which takes about 1 ms a year (of 1,440 times a day 30)


@dataclass
class DueBatch:
    """What one reading of the plan found due."""

    robot_ids: set[int] = field(default_factory=set)  # with something that waits to be sent
    has_unbound: bool = False  # something waits for a robot of a group
    touched: set[int] = field(default_factory=set)  # with something new in the ledger; NO_ROBOT: no robot yet
    skipped: list[Execution] = field(default_factory=list)
    missed: int = 0
    intents: list[Execution] = field(default_factory=list)  # to be sent at their instants

    def note(self, added: Iterable[Execution]) -> None:
        """These are in the ledger now."""
        for row in added:
            match row.state:
                case State.SKIPPED:
                    self.skipped.append(row)
                case State.SUBMITTING:
                    self.intents.append(row)
                case State.WAITING if row.robot_id is None:
                    self.has_unbound = True
                case State.WAITING if row.robot_id is not None:
                    self.robot_ids.add(row.robot_id)


class Planner:
    def __init__(
        self,
        db: Database,
        *,
        clock: Clock,
        downtime: Downtime,
        alarms: Alarms,
        ledger: Ledger,
        changes: Changes,
        restored_starts: RestoredStarts,
        hold_late_starts: bool,
    ) -> None:
        self._db, self._schedules, self._executions = db, ScheduleRepository(), ExecutionRepository()
        self._robots, self._groups, self._history = RobotRepository(), GroupRepository(), ExecutionHistory()
        self._missions, self._settings = MissionRepository(), SettingsRepository()
        self._clock, self._downtime, self._alarms = clock, downtime, alarms
        self._ledger, self._changes, self._restored_starts = ledger, changes, restored_starts
        self._hold_late_starts = hold_late_starts  # only a window can show the list with its Hold button
        self._lasts_until: dict[int, float] = {}  # on the monotonic clock, by id of a Run now of a clock that was ahead

    def next_due(self) -> datetime | None:
        return self._schedules.next_due(self._db.read())

    def robots_due(self, after: datetime, until: datetime) -> set[int]:
        """Robots with an occurrence after one instant and not after the other."""
        due = self.next_due()
        return set() if due is None or due > until else self._schedules.robots_due(self._db.read(), after, until)

    def insert_due(self, ready: Callable[[int], Readiness | None], hand_over: Callable[[Execution], None]) -> DueBatch:
        """Write a row for every instant up to now, and for those due in a moment if nothing prevents them:
        ``hand_over`` gives their intents to the workers, to be sent at their instants. Costs one index lookup if
        nothing is due."""
        batch = DueBatch()
        due = self.next_due()
        is_more = due is not None and due <= self._clock.now() + rules.INTENT_LEAD
        while is_more:
            is_more = self._db.write(lambda c: self._take_due(c, batch, ready))
            for intent in rules.in_dispatch_order(batch.intents):  # before listeners are notified and read
                hand_over(intent)
            batch.intents.clear()
        if batch.missed or batch.skipped:
            self._ledger.grew = True
        if batch.missed:
            self._alarms.raise_("executions_missed", "plan", count=batch.missed)
        for execution in batch.skipped:
            if execution.reason and execution.reason.code is not ReasonCode.HOLD:  # a paused schedule needs no alarm
                self._ledger.alarm_for(execution)
        for robot_id in batch.touched:
            self._changes.publish(Topic.EXECUTIONS, robot_id)
        if batch.touched:
            self._changes.publish(Topic.SCHEDULES)
        return batch

    def _take_due(self, c: sqlite3.Connection, batch: DueBatch, ready: Callable[[int], Readiness | None]) -> bool:
        """Take all that is due when the writer runs this, not only at the time of the call; returns whether there may
        be more."""
        now, read, work = self._clock.now(), 0, 0
        rows: list[Execution] = []
        progress: list[Progress] = []
        while True:
            schedules = self._schedules.due(c, now + rules.INTENT_LEAD, now - LATELY, AT_ONCE, read)
            context = self._load_context(c, schedules, now, ready)
            for schedule in schedules:
                if taken := self._take(schedule, context, batch):
                    rows += taken.rows
                    progress.append(taken.progress)
                    work += sum(1 if row.starts == 1 else COUNTS_FOR for row in taken.rows)
                    if work >= AT_ONCE:
                        break
            read += len(schedules)
            if progress or len(schedules) < AT_ONCE:  # else all of these wait, without blocking later ones
                break
        added = self._executions.add_each_once(c, rows)
        limit = context.settings.history_limit
        if limit is not None and any(row.state is State.MISSED or row.starts > 1 for row in added):
            self._history.drop_oldest(c, self._history.surplus(c, limit))
        self._schedules.advance_all(c, progress)
        for row in added:
            if row.held and row.schedule_id is not None:  # now the row says so
                self._schedules.unskip(c, row.schedule_id, row.planned_at)
        if len(added) < len(rows):
            log.info("%d occurrences are in the ledger already", len(rows) - len(added))
        batch.note(added)
        return work >= AT_ONCE or (len(schedules) == AT_ONCE and len(progress) == AT_ONCE)

    def replan_after_clock_step(self, step: timedelta, wrong: tuple[datetime, datetime] | None) -> None:
        """The clock has been set, by that ``step`` or before this start of the app: schedules made or changed while it
        was wrong (before the app existed, or during ``wrong``) count from now; instants that will come again are
        planned again, and no Run now waits longer because of it."""

        def work(c: sqlite3.Connection) -> tuple[int, int]:
            now, settings = self._clock.now(), self._settings.load(c)
            calendar, spans = working_calendar(c, settings), [wrong] if wrong else []
            if now >= EARLIEST:
                spans.append((UNKNOWN_START, EARLIEST))
            changed = {
                schedule.id: schedule for span in spans for schedule in self._schedules.changed_between(c, *span)
            }
            for schedule in changed.values():
                next_at = first_due(schedule, settings, now, calendar, self._schedules.skipped(c, schedule.id))
                self._schedules.count_from(c, schedule.id, next_at, now)
            ahead = self._schedules.planned_beyond(c, now)
            for schedule in ahead:
                self._replan(c, schedule, now, settings, calendar)
            self._time_unplanned(c, now, step)
            return len(changed), len(ahead)

        counted, planned_again = self._db.write(work)
        if counted:
            log.warning(
                "The clock was wrong and has been set: %d schedules that were changed before count from now", counted
            )
        if planned_again:
            log.warning("The clock was set back: what had been planned beyond it is planned again")
        if counted or planned_again:
            self._changes.publish(Topic.SCHEDULES)
            self._changes.publish(Topic.EXECUTIONS)

    def _replan(
        self, c: sqlite3.Connection, schedule: Schedule, now: datetime, settings: Settings, calendar: WorkingCalendar
    ) -> None:
        """From the last begun instant on. Later unsent rows are removed; instants that the begun one passed over stay
        missed."""
        through = self._executions.make_room_after(c, schedule.id, max(now, schedule.started_through or now), now)
        next_at = first_due(
            replace(schedule, planned_through=through),
            settings,
            min(now, through),
            calendar,
            self._schedules.skipped(c, schedule.id),
        )
        self._schedules.replan(c, schedule.id, next_at, through, now)

    def _time_unplanned(self, c: sqlite3.Connection, now: datetime, step: timedelta) -> None:
        """A Run now lasts its full window even if the clock is set; its times stay, as the clock may be set ahead
        again. One from before this start of the app lasts a whole window more, as its age is unknown."""
        for row in self._executions.unplanned_after(c, now):
            left, window = row.closes_at - (now - step), row.closes_at - row.planned_at
            left = left if timedelta() < left < window else window  # perhaps made between two steps
            self._lasts_until.setdefault(row.id, self._clock.monotonic() + left.total_seconds())

    def close_expired_run_nows(self) -> None:
        """Close Run nows whose window is over although the clock was set back."""
        over = [row_id for row_id, until in self._lasts_until.items() if until <= self._clock.monotonic()]
        if not over:
            return

        def find(c: sqlite3.Connection) -> Iterable[Transition]:
            now = self._clock.now()
            for row in self._executions.in_states(c, over, NOT_WITH_THE_ROBOT):
                if row.planned_at > now:  # else it is unchanged
                    yield transitions.redefine(row, planned_at=now - (row.closes_at - row.planned_at), closes_at=now)

        self._ledger.apply_found(find, quietly=True)
        for row_id in over:
            del self._lasts_until[row_id]

    def note_unwritable(self, alarm: Alarm) -> None:
        """Starts that fell due while nothing could be written get their rows afterwards; also the one of the first
        failure."""
        self._downtime.add(
            Gap(alarm.raised_at - timedelta(seconds=LONGEST_WAIT), self._clock.now(), problem=alarm.details["problem"])
        )

    def list_late_starts(self, since: datetime) -> None:
        """After an absence that began then, late starts are first listed for some seconds, if there is a window; those
        that may have run, once that is known."""
        now, through = self._clock.now(), self._restored_starts.uncertain_until
        if self._hold_late_starts:
            self._ledger.apply_found(
                lambda c: (transitions.list_late(row, now, through) for row in self._executions.late(c, since, now)),
                quietly=True,
            )

    def _load_context(
        self,
        c: sqlite3.Connection,
        schedules: Sequence[Schedule],
        now: datetime,
        ready: Callable[[int], Readiness | None],
    ) -> PlanningContext:
        """All that the rows of these schedules depend on. Few statements for however many of them: each releases the interpreter, and
        has to wait until it gets it back."""
        settings = self._settings.load(c)
        robot_ids = {schedule.robot_id for schedule in schedules if schedule.robot_id is not None}
        groups = (
            {group.id: group for group in self._groups.all(c)}
            if any(schedule.group_id for schedule in schedules)
            else {}
        )
        return PlanningContext(
            now,
            settings,
            self._settings.install_id(c),
            working_calendar(c, settings),
            self._robots.by_ids(c, robot_ids),
            groups,
            self._missions.by_ids(c, {schedule.mission_id for schedule in schedules}),
            self._executions.waited_for(c, robot_ids),
            self._executions.open_of_schedules(c, {schedule.whole_id for schedule in schedules}),
            self._schedules.skips(c, [schedule.id for schedule in schedules]),
            self._schedules.skips(c, [schedule.id for schedule in schedules], held=True),
            GroupExecutionRepository().with_places(c),
            ready,
            self._restored_starts.uncertain_until,
        )

    def _take(self, schedule: Schedule, context: PlanningContext, batch: DueBatch) -> _DueSchedule | None:
        """The outcome of its instants up to now. None: its instant is in the future, and an obstacle can only be judged
        then."""
        target, mission = context.target_of(schedule), context.missions.get(schedule.mission_id)
        if target is None or mission is None:  # foreign keys prevent that
            return _DueSchedule([], Progress(schedule.id, None, None, None))
        if (
            schedule.next_at is not None
            and schedule.next_at > context.now
            and context.waits_for_its_instant(target, mission)
        ):
            return None  # first, as the rest takes time: called every few ms until its instant
        make = RowMaker(schedule, target, mission, context)
        rows, latest, following = self._passed_and_latest(schedule, make)
        while (
            following is not None and (schedule.id, following) in context.skips
        ):  # its row was written when it was skipped
            following = next_occurrence(schedule, following, context.calendar)
        through, started = rows[-1].planned_at if rows else None, None
        if latest is not None:
            row = self._row(latest, make)
            if latest > context.now and not _may_be_written_early(row):
                return None
            if row.state is State.SUBMITTING:
                started = latest
            if row.state is State.WAITING and row.robot_id is not None:
                context.waited_for.add(row.robot_id)
            if row.state.is_open and schedule.whole_id in context.open_of_schedule:
                context.open_of_schedule[schedule.whole_id] = latest
            through, rows = latest, [*rows, row]
        batch.missed += sum(row.starts for row in rows if row.state is State.MISSED)
        batch.touched.add(schedule.robot_id or NO_ROBOT)
        return _DueSchedule(rows, Progress(schedule.id, following, through, started))

    def _passed_and_latest(
        self, schedule: Schedule, make: RowMaker
    ) -> tuple[list[Execution], datetime | None, datetime | None]:
        """Rows of instants that can no longer run; the latest instant that may still run, to be decided; and the next
        one."""
        context = make.context
        following = next_occurrence(schedule, schedule.next_at or context.now, context.calendar)
        if following is None or following > context.now:  # usual case: one instant is due
            return [], schedule.next_at, following
        latest = make.still_open()
        skipped = {instant for schedule_id, instant in context.skips if schedule_id == schedule.id}
        until = context.now if latest is None else latest - MOMENT
        rows = [make.passed(each) for each in passed(schedule, until, context.calendar, self._downtime, skipped)]
        return rows, latest, next_occurrence(schedule, context.now, context.calendar)

    def _row(self, instant: datetime, make: RowMaker) -> Execution:
        """With the intent of its first attempt if the robot is ready for it: the row that a POST needs is then on disk
        with one write."""
        schedule, context = make.schedule, make.context
        if make.is_skipped(instant):
            return make.skipped_row(instant)
        if context.now >= rules.closes_at(instant, schedule.start_window_minutes, context.settings):
            return make.missed(instant, self._downtime.at(instant))
        robot = make.target if isinstance(make.target, Robot) else None
        if robot is not None and not robot.enabled:
            return make.ended(instant, Reason(ReasonCode.ROBOT_REMOVED, {"robot": robot.name}))
        if previous := context.open_of_schedule.get(schedule.whole_id):
            return make.ended(instant, Reason(ReasonCode.OVERLAP, {"planned_at": previous.isoformat()}))
        if (schedule.id, instant) in context.kept_back:
            return replace(make.waiting(instant), held=True, wait=Wait.HOLD)
        if self._hold_late_starts and (gap := self._downtime.at(instant)) is not None and gap.problem is None:
            return make.waiting(instant, late=True)
        ready = None if robot is None else context.readiness(robot, make.mission)
        return make.waiting(instant) if ready is None else make.submitting(instant, ready)


def _may_be_written_early(row: Execution) -> bool:
    """Whether a row can be written before its instant, as nothing prevents its start: its robot is ready, or a robot of
    its group must be chosen."""
    return row.state is State.SUBMITTING or (
        row.state is State.WAITING and row.robot_id is None and row.wait is Wait.DUE
    )


class _DueSchedule(NamedTuple):
    """What became of a schedule."""

    rows: list[Execution]
    progress: Progress
