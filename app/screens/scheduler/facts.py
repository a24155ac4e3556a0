"""The services of the Scheduler, and its content at one moment: read on a background thread, only from the database."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from typing import Any
from zoneinfo import ZoneInfo

from app.database.execution_history import ExecutionFilter
from app.database.robots import Hold
from app.domain import names
from app.domain.clock import MOMENT, Clock
from app.domain.execution import Execution
from app.domain.models import Connection, InvalidInput, Mission, Robot, Schedule, Settings
from app.screens.common.holding import hold_for, hold_of_run
from app.screens.common.mission_names import NOTHING_KNOWN, MissionNames, Start
from app.screens.common.name_order import by_name, with_id
from app.screens.common.plant import Plant
from app.screens.common.robot_appearance import is_old, is_silent, state_appearance
from app.screens.common.start_now import is_stopped
from app.services.catalogue.catalogue import Catalogue
from app.services.catalogue.moving import Moving
from app.services.catalogue.pausing import Pausing
from app.services.catalogue.preview import Forecasts
from app.services.files.plan_export import PlanFiles
from app.services.history.runs import History
from app.services.live.holds import Holds
from app.services.live.mission_parameters import MissionParameters
from app.services.live.snapshots import Snapshots
from app.services.planning.plan import LONGEST_RUN, Plan
from app.services.planning.planned import Conflict, PlannedRun
from app.services.planning.recurrence import next_occurrence
from app.services.planning.working_days import WorkingCalendar
from app.services.robots.commands import Operator
from app.services.robots.missions import RobotMissions
from app.services.suggestions.suggestions import Suggestions

HOURS = 8  # that the plan shows at first
MARGIN = 0.5  # read on both sides of the visible part, so that dragging finds content there
DAYS = 7
BEFORE = timedelta(hours=1)  # of the past stays in sight
LONGEST_BREAK = timedelta(days=60)  # of successive days off that can be folded, with the visible part around them
MOST_PAST = 5000  # runs of the past in one window


@dataclass(frozen=True)
class SchedulerServices:
    """Named as in the container."""

    settings: Callable[[], Settings]
    calendar: Callable[[], WorkingCalendar]
    catalogue: Catalogue
    clock: Clock
    forecasts: Forecasts
    history: History
    holds: Holds
    moving: Moving
    operator: Operator
    parameters: MissionParameters
    pausing: Pausing
    plan: Plan
    plan_files: PlanFiles
    robot_missions: RobotMissions
    snapshots: Snapshots
    suggestions: Suggestions


@dataclass(frozen=True)
class Window:
    """What the timeline shows. ``left`` None: it moves with the time, beginning a little before now. Time without work
    is folded, except around ``unfolded``; it takes hardly any of the ``hours``."""

    left: datetime | None = None
    hours: float = HOURS
    unfolded: frozenset[datetime] = frozenset()
    robots: frozenset[int] = frozenset()  # by id; none: all
    opened: Hashable = None  # the open line of those that represent several lanes; None: the first

    def start(self, now: datetime, zone: ZoneInfo) -> datetime:
        """UTC instant of the left edge."""
        return full_hour(now - BEFORE, zone) if self.left is None else self.left

    def span(self, now: datetime, zone: ZoneInfo, calendar: WorkingCalendar) -> tuple[datetime, datetime]:
        """What has to be read, from and to."""
        start, margin = self.start(now, zone), self.hours * MARGIN
        return _beyond(start, -margin, zone, calendar), _beyond(start, self.hours + margin, zone, calendar)


def _beyond(start: datetime, hours: float, zone: ZoneInfo, calendar: WorkingCalendar) -> datetime:
    """The instant so many hours of working days after ``start``, or before it."""
    at, left, way = start, abs(hours), 1 if hours > 0 else -1
    while left > 0 and abs(at - start) < LONGEST_BREAK:
        step = min(left, 1.0)
        left -= step if calendar.is_working_day((at + timedelta(hours=way * step / 2)).astimezone(zone).date()) else 0
        at += timedelta(hours=way * step)
    return at


@dataclass(frozen=True)
class SchedulerFacts(Plant):
    calendar: WorkingCalendar = field(default_factory=lambda: WorkingCalendar(Settings()))
    missions: tuple[Mission, ...] = ()
    schedules: tuple[Schedule, ...] = ()
    refused: Mapping[int, InvalidInput] = field(default_factory=dict)  # by schedule: why no robot takes its values
    after_pause: Mapping[int, datetime | None] = field(default_factory=dict)  # by paused schedule: its first start then
    last: Mapping[int, Execution] = field(default_factory=dict)  # by schedule: its newest execution
    planned: tuple[PlannedRun, ...] = ()  # within the window, or the next days for the list
    conflicts: tuple[Conflict, ...] = ()  # of them, in order of time
    more: Mapping[int, datetime] = field(
        default_factory=dict
    )  # by schedule: from when on it has starts that are not in ``planned``
    past: tuple[
        Execution, ...
    ] = ()  # planned within the window and before now, including open ones; and future skipped ones
    holds: tuple[Hold, ...] = ()  # set by persons and not over
    own_hold: Hold | None = None  # the tablet's: its clock is wrong, or its data another tablet's
    usual_s: Mapping[tuple[int, str], float] = field(
        default_factory=dict
    )  # how long open missions take, by robot and guid
    names: Mapping[int, Mapping[str, str]] = field(
        default_factory=dict
    )  # of the missions that a robot has, by its id and their guid
    stopped: frozenset[int] = frozenset()  # ids of robots that do nothing until a person helps them
    silent: Mapping[int, Connection] = field(
        default_factory=dict
    )  # connections of robots that give no answer, or none to trust
    mission_names: MissionNames = NOTHING_KNOWN  # what is known of the values that missions get
    icons: Mapping[int, tuple[str, str]] = field(default_factory=dict)  # by robot: icon of its state, and its tone
    skips: frozenset[tuple[int, datetime]] = frozenset()  # future skipped starts: schedule and instant
    moved: frozenset[tuple[int, datetime]] = frozenset()  # the same of starts that were moved, where they were
    skipped_moves: tuple[Schedule, ...] = ()  # starts that were moved and then skipped

    def hold(self, robot_id: int | None, group_id: int | None, at: datetime) -> Hold | None:
        """The hold that stops a start on that robot at that instant; without a robot, on all of the group."""
        return hold_for(self.holds, robot_id, self.group(group_id) if robot_id is None else None, self.robots, at)

    def hold_of(self, run: PlannedRun) -> Hold | None:
        """The same of a planned start."""
        return hold_of_run(self.holds, run, self.robots)

    def mission(self, mission_id: int | None) -> Mission | None:
        return with_id(self.missions, mission_id)

    def schedule(self, schedule_id: int | None) -> Schedule | None:
        return with_id((*self.schedules, *self.skipped_moves), schedule_id)

    def next_start(self, schedule: Schedule) -> datetime | None:
        """None: it is off, or has no more."""
        return self.after_pause.get(schedule.id, schedule.next_at) if schedule.enabled else None

    def is_skipped(self, execution: Execution, now: datetime) -> bool:
        """Whether it is a future start that a person has skipped."""
        return execution.planned_at > now and (execution.schedule_id, execution.planned_at) in self.skips

    def may_start_after_all(self, execution: Execution, now: datetime) -> bool:
        """Whether it is such a start, and would run if it were not skipped."""
        schedule, at = self.schedule(execution.schedule_id), execution.planned_at
        return (
            self.is_skipped(execution, now) and schedule is not None and schedule.enabled and not schedule.is_paused(at)
        )

    def drops_single_changes(self, schedule: Schedule) -> bool:
        """Whether it would have other starts in the place of those that were moved or skipped."""
        changed = self.moved | self.skips
        return any(number == schedule.id and not _is_start(at, schedule, self.calendar) for number, at in changed)

    def name(self, schedule: Schedule | None) -> str:
        """The name entered by a person; empty if it is made of mission and robot, or group."""
        if schedule is None:
            return ""
        target, mission = self.target(schedule), self.mission(schedule.mission_id)
        return (
            names.own_schedule_name(schedule.name, mission.name, target.name) if target and mission else schedule.name
        )

    def given_to(self) -> Iterator[Start]:
        """Values of missions, present and past, by robot."""
        yield from ((run.robot_id, run.mission_guid, run.parameters) for run in self.past)
        for schedule in self.schedules:
            if (mission := self.mission(schedule.mission_id)) is not None:
                robots = (member.id for member in self.members(schedule.group_id) if member.enabled)
                yield schedule.robot_id or next(robots, None), mission.guid, schedule.parameters

    def called(self, schedule: Schedule) -> str:
        """What a message calls it."""
        target, mission = self.target(schedule), self.mission(schedule.mission_id)
        return self.mission_names.schedule(schedule, mission, target) if target and mission else schedule.name


def full_hour(instant: datetime, zone: ZoneInfo) -> datetime:
    """UTC instant of the beginning of its local hour."""
    local = instant.astimezone(zone)
    return instant - timedelta(minutes=local.minute, seconds=local.second, microseconds=local.microsecond)


def read(services: SchedulerServices, window: Window | None = None) -> SchedulerFacts:
    """Read everything; without a window the plan of a week. Called off the UI thread: asks the database, never a robot."""
    catalogue, history, now, settings = services.catalogue, services.history, services.clock.now(), services.settings()
    calendar = services.calendar()
    start, end = (
        (now, now + timedelta(days=DAYS)) if window is None else window.span(now, ZoneInfo(settings.timezone), calendar)
    )
    stored = {schedule.id: schedule for schedule in catalogue.schedules()}
    skipped = services.plan.skips()
    skipped_moves = {number: catalogue.schedule(number) for number, _at in skipped if number not in stored}
    having = stored | skipped_moves
    skips = frozenset((number, at) for number, at in skipped if _is_start(at, having.get(number), calendar))
    schedules = tuple(_without(skips, schedule, calendar) for schedule in stored.values())
    moved = frozenset(catalogue.moved_away())
    rows = history.page(ExecutionFilter(start=start - LONGEST_RUN, end=end), size=MOST_PAST).rows
    soon = now + timedelta(seconds=1)
    past = tuple(e for e in rows if e.planned_at < soon or (e.schedule_id, e.planned_at) in skips)
    for year in (now.year, now.year + 1):  # so that drawing doesn't have to compute their public holidays
        calendar.day_status(now.date().replace(year=year, day=1))
    robots, planned = by_name(catalogue.robots()), services.plan.between(start, end)
    return SchedulerFacts(
        settings=settings,
        calendar=calendar,
        robots=robots,
        groups=by_name(catalogue.groups()),
        missions=tuple(catalogue.missions()),
        schedules=schedules,
        refused=catalogue.refused(),
        after_pause=dict(_after_pauses(skips | moved, schedules, calendar)),
        last={schedule.id: last for schedule in schedules if (last := _last(history, schedule, now)) is not None},
        planned=planned.runs,
        conflicts=planned.conflicts,
        more=planned.more,
        past=past,
        holds=tuple(services.holds.current()),
        own_hold=next((hold for hold in services.holds.all_active() if hold.clock or hold.is_copy), None),
        usual_s=_usual_s(history, past, now),
        names={robot.id: services.robot_missions.names(robot.id) for robot in robots},
        skips=skips,
        moved=moved,
        skipped_moves=tuple(filter(None, skipped_moves.values())),
        **live(services, settings, robots),
    )


def _usual_s(history: History, past: Iterable[Execution], now: datetime) -> dict[tuple[int, str], float]:
    """How long what is open takes, by robot and guid."""
    rows = (row for row in past if row.state.is_open or row.planned_at > now)
    keys = {(row.robot_id, row.mission_guid) for row in rows if row.robot_id is not None}
    return {key: one.median_s for key in keys if (one := history.expected(*key)) is not None and one.median_s}


def live(services: SchedulerServices, settings: Settings, robots: Iterable[Robot]) -> dict[str, Any]:
    """What robots say of themselves: ``silent``, ``stopped`` and ``icons`` of ``SchedulerFacts``."""
    now, found = services.clock.now(), [(robot, services.snapshots.get(robot.id)) for robot in robots]
    looks = {robot.id: state_appearance(robot, each, is_old(each, now, settings)) for robot, each in found}
    return {
        "silent": {robot.id: each.connection for robot, each in found if is_silent(each.connection)},
        "stopped": frozenset(robot.id for robot, each in found if is_stopped(each, settings, now)),
        "icons": {number: (look.icon, look.tone) for number, look in looks.items()},
    }


def _is_start(at: datetime, schedule: Schedule | None, calendar: WorkingCalendar) -> bool:
    """Whether its rule still has it."""
    return schedule is not None and next_occurrence(schedule, at - MOMENT, calendar) == at


def _last(history: History, schedule: Schedule, now: datetime) -> Execution | None:
    """Its newest execution, but a future skipped start only if there are no others."""
    last = history.last_of_schedule(schedule.id)
    if last is not None and last.planned_at > now and schedule.next_at is not None and not last.state.is_open:
        return history.last_of_schedule(schedule.id, until=now)
    return last


def _without(skips: Collection[tuple[int, datetime]], schedule: Schedule, calendar: WorkingCalendar) -> Schedule:
    """With the next start that is not skipped."""
    at = schedule.next_at
    while at is not None and (schedule.id, at) in skips:
        at = next_occurrence(schedule, at, calendar)
    return schedule if at == schedule.next_at else replace(schedule, next_at=at)


def _after_pauses(
    skips: Collection[tuple[int, datetime]], schedules: Iterable[Schedule], calendar: WorkingCalendar
) -> Iterator[tuple[int, datetime | None]]:
    for schedule in schedules:
        if schedule.next_at is not None and schedule.paused_until is not None and schedule.is_paused(schedule.next_at):
            resumed = replace(schedule, next_at=next_occurrence(schedule, schedule.paused_until - MOMENT, calendar))
            yield schedule.id, _without(skips, resumed, calendar).next_at
