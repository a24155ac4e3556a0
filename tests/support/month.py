"""A month at an invented plant in Finland, up to Friday 20 Nov 2026, 14:38: robots, missions, schedules and their runs.

Everything is drawn from a seed, so pictures and numbers are the same each time.
"""

from __future__ import annotations

import random
import uuid
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime, time, timedelta
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from zoneinfo import ZoneInfo

from app.container import Container
from app.database.activities import ActivityRepository
from app.database.connection import DATABASE_NAME, Database
from app.domain.activity import ActivitySpan
from app.domain.execution import Execution, Reason, ReasonCode, State, Trigger, Wait
from app.domain.models import Between, Mission, Robot, Schedule
from tests.support.clock import VirtualClock

NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)
ZONE = "Europe/Helsinki"
DAYS = 29
ROBOTS = (("Aino", "MiR250"), ("Veikko", "MiR100"), ("Sisu", "MiR1350"))
MISSIONS = (
    "Deliver kits to line 2",
    "Collect empties",
    "Return to charger",
    "Waste to compactor",
    "Move coils to press",
    "Bring pallet to dock",
    "Night stock count",
    "Coils to store",
    "Floor wash, hall A",
)
TROUBLES = (
    "Failed to reach goal position 'Dock 1'",
    "Failed to reach goal position 'Dock 2'",
    "Blocked by an obstacle for 60 s",
    "The cart was not found",
)


@dataclass(frozen=True)
class Habit:
    """A schedule: when it starts on a working day, how many minutes it takes."""

    robot: str
    mission: str
    starts: Sequence[time]
    recurrence: str
    minutes: float
    between: Between | None = None
    enabled: bool = True


HABITS = (
    Habit(
        "Aino",
        "Deliver kits to line 2",
        [time(hour) for hour in range(6, 19)],
        "FREQ=HOURLY;BYDAY=MO,TU,WE,TH,FR",
        6.4,
        Between(time(6), time(18)),
    ),
    Habit("Aino", "Night stock count", [time(19)], "FREQ=WEEKLY;BYDAY=MO,TU,WE,TH,FR", 175.0),
    Habit(
        "Veikko",
        "Collect empties",
        [time(6, 10), time(15, 10), time(17, 10)],
        "FREQ=DAILY;BYHOUR=6,15,17;BYMINUTE=10",
        45.0,
    ),
    Habit("Veikko", "Waste to compactor", [time(16, 30)], "FREQ=WEEKLY;BYDAY=MO,WE,FR", 60.0),
    Habit("Sisu", "Move coils to press", [time(14, 15), time(15, 15)], "FREQ=DAILY;BYHOUR=14,15;BYMINUTE=15", 33.0),
    Habit("Sisu", "Coils to store", [time(19)], "FREQ=DAILY", 140.0),
    Habit("Veikko", "Floor wash, hall A", [time(5)], "FREQ=MONTHLY;BYDAY=1MO", 80.0, enabled=False),
)
EXTRA = "Waste, extra round"  # once, three minutes ago, with a minimum of its own that its battery doesn't reach
SCHEDULED = (*(habit.mission for habit in HABITS), "Waste to compactor")  # missions of all schedules
EXTRA_ROUNDS = (
    ("Collect empties", time(11, 20), 480.0),
    ("Waste to compactor", time(11, 40), 700.0),
)  # by hand, the days before


def plant(directory: Path, furnished: bool = True, now: datetime = NOW) -> Container:
    """Services on a throw-away database whose clock is at ``now``; nothing runs."""
    path = directory / DATABASE_NAME
    directory.mkdir(parents=True, exist_ok=True)
    path.write_bytes(_database(furnished, now))
    clock = VirtualClock(now)
    return Container(Database.open(path, clock=clock, durable=False), clock)


@cache
def _database(furnished: bool, now: datetime) -> bytes:
    """The file, which takes a while to make."""
    with TemporaryDirectory() as directory:
        path, clock = Path(directory) / DATABASE_NAME, VirtualClock(now)
        container = Container(Database.open(path, clock=clock, durable=False), clock)
        container.catalogue.change_settings(timezone=ZONE, minimum_battery_percent=30, history_limit=None)
        if furnished:
            furnish(container, now)
        container.close()
        return path.read_bytes()


def furnish(container: Container, now: datetime = NOW) -> None:
    catalogue = container.catalogue
    robots = {
        name: catalogue.save_robot(Robot(name, f"10.40.12.{21 + n}", "scheduler", model=model), "secret")
        for n, (name, model) in enumerate(ROBOTS)
    }
    missions = {
        name: catalogue.save_mission(Mission(name, guid(name), favourite=name == MISSIONS[0])) for name in MISSIONS
    }
    catalogue.change_settings(selected_robot_id=robots["Aino"].id)
    rng = random.Random(20)
    rows: list[Execution] = []
    schedules: dict[str, Schedule] = {}
    for habit in HABITS:
        start = datetime.combine(now.date() - timedelta(days=DAYS), habit.starts[0])
        schedule = catalogue.save_schedule(
            Schedule(
                "",
                robots[habit.robot].id,
                missions[habit.mission].id,
                start,
                ZONE,
                habit.recurrence,
                between=habit.between,
                enabled=habit.enabled,
            )
        )
        rows += _history(schedule, habit, robots[habit.robot], now, rng)
        schedules[habit.mission] = schedule
    extra = Schedule(
        EXTRA,
        robots["Aino"].id,
        missions["Waste to compactor"].id,
        datetime(2026, 11, 20, 14, 35),
        ZONE,
        minimum_battery_percent=80.0,
        changed_at=now - timedelta(hours=1),
    )
    extra = container.db.write(lambda c: container.repositories.schedules.add(c, extra))
    rows += _extra_rounds(robots["Aino"], now)
    rows += _last_hour(robots, schedules["Move coils to press"], extra, now)
    container.db.write(
        lambda c: container.repositories.executions.add_many(c, sorted(rows, key=lambda row: row.planned_at))
    )
    _watch(container, robots, rows, now)


def guid(mission: str) -> str:
    return f"3d7c7c{MISSIONS.index(mission):02d}-ce85-11ef-904a-000e8e9884eb"


def _days(now: datetime) -> Iterator[date]:
    today = now.astimezone(ZoneInfo(ZONE)).date()
    return (
        today - timedelta(days=back) for back in range(DAYS, -1, -1) if (today - timedelta(days=back)).weekday() < 5
    )


def _history(schedule: Schedule, habit: Habit, robot: Robot, now: datetime, rng: random.Random) -> Iterator[Execution]:
    for day in _days(now) if habit.enabled else ():
        for start in habit.starts:
            planned_at = datetime.combine(day, start, ZoneInfo(ZONE)).astimezone(UTC)
            if planned_at < now - timedelta(minutes=30):
                row = _row(
                    robot,
                    habit.mission,
                    planned_at,
                    rng,
                    trigger=Trigger.SCHEDULED,
                    schedule_id=schedule.id,
                    schedule=schedule.name,
                )
                yield _ended(row, habit, rng)


def _row(robot: Robot, mission: str, planned_at: datetime, rng: random.Random, **values: object) -> Execution:
    return Execution(
        **{
            "trigger": Trigger.MANUAL,
            "robot_id": robot.id,
            "robot": robot.name,
            "mission": mission,
            "mission_guid": guid(mission),
            "planned_at": planned_at,
            "closes_at": planned_at + timedelta(minutes=15),
            "created_at": planned_at,
            "timezone": ZONE,
            "token": str(uuid.UUID(int=rng.getrandbits(128), version=4)),
            **values,
        }
    )


def _ended(row: Execution, habit: Habit, rng: random.Random) -> Execution:
    luck = rng.random()
    if luck < 0.02:
        reason = Reason(
            ReasonCode.BATTERY_LOW, {"battery": rng.randint(8, 28), "minimum": 30, "until": row.closes_at.isoformat()}
        )
        return replace(row, state=State.SKIPPED, reason=reason, ended_at=row.closes_at)
    took = max(30.0, rng.gauss(habit.minutes, habit.minutes * 0.08) * 60)
    if luck < 0.04:
        reason = Reason(ReasonCode.ROBOT_ABORTED, {"message": TROUBLES[rng.randint(1, 4) - 1]})
        return _ran(row, State.FAILED, took / 3, rng, reason)
    if luck < 0.048:
        return _ran(row, State.CANCELLED, took / 2, rng, Reason(ReasonCode.USER_CANCELLED))
    return _ran(row, State.COMPLETED, took, rng)


def _ran(row: Execution, state: State, took: float, rng: random.Random, reason: Reason | None = None) -> Execution:
    wait = rng.expovariate(1 / 8)
    submitted = row.planned_at + timedelta(seconds=rng.uniform(0.1, 2))
    started = submitted + timedelta(seconds=wait)
    return replace(
        row,
        state=state,
        reason=reason,
        attempts=1,
        submitted_at=submitted,
        started_at=started,
        robot_delay_s=wait,
        duration_s=took,
        ended_at=started + timedelta(seconds=took),
        queue_id=12_000 + rng.randint(0, 2000),
    )


def _extra_rounds(robot: Robot, now: datetime) -> Iterator[Execution]:
    """What Aino ran in addition to her plan, so that her usual durations are known."""
    rng = random.Random(8)
    for day in list(_days(now))[-6:-1]:
        for mission, start, seconds in EXTRA_ROUNDS:
            planned_at = datetime.combine(day, start, ZoneInfo(ZONE)).astimezone(UTC)
            yield _ran(_row(robot, mission, planned_at, rng), State.COMPLETED, rng.gauss(seconds, seconds * 0.05), rng)


def _last_hour(robots: dict[str, Robot], coils: Schedule, extra: Schedule, now: datetime) -> list[Execution]:
    """What the operator pressed, what idleness started, what was skipped, what runs and waits: as Home shows it."""
    rng = random.Random(7)

    def at(hour: int, minute: int, second: int = 0) -> datetime:
        return datetime.combine(now.date(), time(hour, minute, second), ZoneInfo(ZONE)).astimezone(UTC)

    running = _row(
        robots["Aino"],
        "Deliver kits to line 2",
        at(14, 33, 40),
        rng,
        state=State.EXECUTING,
        attempts=1,
        queue_id=14_031,
        submitted_at=at(14, 33, 40),
        started_at=at(14, 33, 48),
    )
    pallet = _row(robots["Veikko"], "Bring pallet to dock", at(13, 30), rng)
    reason = Reason(ReasonCode.ROBOT_ABORTED, {"message": "Failed to reach goal position 'Dock 3'"})
    failed = replace(_ran(pallet, State.FAILED, 1324.0, rng, reason), queue_id=14_026)
    idle = _ran(
        _row(robots["Aino"], "Return to charger", at(13, 36, 40), rng, trigger=Trigger.IDLE),
        State.COMPLETED,
        200.0,
        rng,
    )
    skipped = replace(
        _row(
            robots["Sisu"],
            "Move coils to press",
            at(14, 15),
            rng,
            trigger=Trigger.SCHEDULED,
            schedule_id=coils.id,
            schedule=coils.name,
        ),
        state=State.SKIPPED,
        ended_at=at(14, 30),
        reason=Reason(ReasonCode.BATTERY_LOW, {"battery": 12, "minimum": 30, "until": at(14, 30).isoformat()}),
    )
    again = _ran(_row(robots["Veikko"], "Bring pallet to dock", at(14, 12, 50), rng), State.COMPLETED, 485.0, rng)
    queued = _row(
        robots["Aino"],
        "Collect empties",
        at(14, 36),
        rng,
        state=State.QUEUED,
        attempts=1,
        queue_id=14_032,
        submitted_at=at(14, 36),
    )
    held = _row(
        robots["Aino"],
        "Waste to compactor",
        at(14, 35),
        rng,
        trigger=Trigger.SCHEDULED,
        schedule_id=extra.id,
        schedule=extra.name,
        state=State.WAITING,
        wait=Wait.BATTERY,
        wait_details={"battery": 78.0, "minimum": 80.0},
        minimum_battery_percent=80.0,
    )
    return [running, failed, idle, skipped, again, queued, held]


def _watch(container: Container, robots: dict[str, Robot], rows: Sequence[Execution], now: datetime) -> None:
    """What each robot was seen doing on working days, 5:30 to 22:30; at night the app is off."""
    for n, robot in enumerate(robots.values()):
        spans: list[ActivitySpan] = []
        for day in _days(now):
            opens, closes = (
                datetime.combine(day, at, ZoneInfo(ZONE)).astimezone(UTC) for at in (time(5, 30), time(22, 30))
            )
            spans += _day_of(rows, robot, opens, min(closes, now), day.day + n)
        container.db.write(lambda c, robot=robot, spans=spans: ActivityRepository().save(c, robot.id, spans))


def _day_of(
    rows: Sequence[Execution], robot: Robot, opens: datetime, closes: datetime, luck: int
) -> Iterator[ActivitySpan]:
    """Missions where there were some, trouble after those that failed, an hour or two on the charger, idle otherwise."""
    events = [
        (row.started_at, row.ended_at or closes, "executing")
        for row in rows
        if row.robot_id == robot.id and row.started_at
    ]
    events += [
        (row.ended_at, row.ended_at + timedelta(minutes=8), "error")
        for row in rows
        if row.robot_id == robot.id and row.state is State.FAILED and row.ended_at
    ]
    events.append((opens + timedelta(hours=4.6), opens + timedelta(hours=6), "charging"))
    if luck % 3 == 0:
        events.append((opens + timedelta(hours=7.2), opens + timedelta(hours=7.7), "offline"))
    if luck % 4 == 0:
        events.append((opens + timedelta(hours=2.2), opens + timedelta(hours=2.6), "paused"))
    at = opens
    for start, end, activity in sorted(event for event in events if opens <= event[0] < closes):
        if start > at:
            yield ActivitySpan("idle", at, start)
        if min(end, closes) > max(start, at):
            yield ActivitySpan(activity, max(start, at), min(end, closes))
        at = max(at, min(end, closes))
    if at < closes:
        yield ActivitySpan("idle", at, closes)
