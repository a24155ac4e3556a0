"""The content of ``--demo``: five simulated robots, three with a plan, ready-made missions and a history of some weeks."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, time, timedelta
from itertools import groupby, takewhile
from zoneinfo import ZoneInfo

from app.container import Container
from app.database.activities import ActivityRepository
from app.domain import rules
from app.domain.activity import ActivitySpan
from app.domain.execution import Execution, Reason, ReasonCode, State
from app.domain.models import WEEKDAYS, Group, Mission, Robot, Schedule, Settings
from app.failures import BadInput
from app.services.catalogue import robot_edit
from app.services.planning.recurrence import occurrences

USER, PASSWORD = "distributor", "distributor"  # the simulator's
DAYS = 21
LIVE = ("Deliver kits to line 2", "Collect empties")  # in turn, every ten minutes: there is always something to see,
GROUP = "Hall 1"  # on the robot that will be done first
BETWEEN = timedelta(minutes=10)
FAVOURITES = ("Deliver kits to line 2", "Collect empties", "Return to charger")


@dataclass(frozen=True)
class _Rule:
    """A schedule of the demo: mission, hour and minute, recurrence, and how many minutes the mission usually takes."""

    mission: str
    hour: int
    minute: int
    recurrence: str
    minutes: float


PLAN: Sequence[Sequence[_Rule]] = (
    (
        _Rule("Deliver kits to line 2", 6, 0, "FREQ=DAILY;BYHOUR=6,8,10,12,14,16;BYMINUTE=0", 6.5),
        _Rule("Collect empties", 7, 30, "FREQ=WEEKLY;BYDAY=MO,WE,FR", 8.0),
        _Rule("Return to charger", 21, 0, "FREQ=DAILY", 3.4),
    ),
    (
        _Rule("Collect empties", 6, 20, "FREQ=DAILY;BYHOUR=6,9,12,15;BYMINUTE=20", 8.2),
        _Rule("Waste to compactor", 16, 30, "FREQ=WEEKLY;BYDAY=MO,WE,FR", 12.0),
        _Rule("Move coils to press", 12, 22, "FREQ=DAILY", 10.5),
    ),  # while it collects empties: there is something to suggest
    (
        _Rule("Move coils to press", 6, 15, "FREQ=DAILY;BYHOUR=6,10,14;BYMINUTE=15", 10.5),
        _Rule("Bring pallet to dock", 11, 45, "FREQ=WEEKLY;BYDAY=TU,TH", 22.0),
    ),
)


def furnish(container: Container, robots: Sequence[tuple[str, str]], missions: Mapping[str, str]) -> None:
    """Fill an empty database; in one of an earlier demo only update the robots' addresses. Raises BadInput for a
    database that is not a demo's: its robots are real.
    """
    known = container.repositories.robots.all(container.db.read())
    if known:
        _update_addresses(container, sorted(known, key=lambda robot: robot.id), robots)
        return
    container.catalogue.change_settings(working_days=WEEKDAYS)  # a demo on a Sunday has a plan too
    saved = [container.catalogue.save_robot(Robot(name, url, USER), password=PASSWORD) for name, url in robots]
    by_name = {
        name: container.catalogue.save_mission(Mission(name, guid, favourite=name in FAVOURITES))
        for name, guid in missions.items()
    }
    settings, install_id = container.settings(), container.db.write(container.repositories.settings.install_id)
    now = container.clock.now()
    history: list[Execution] = []
    rng = random.Random(20)
    for robot, its_rules in zip(saved, PLAN, strict=False):
        runs: list[Execution] = []
        for rule in its_rules:
            mission = by_name[rule.mission]
            schedule = container.catalogue.save_schedule(_schedule(rule, robot, mission, settings, now))
            # Its past belongs to it only if it was there already.
            begin = now - timedelta(days=DAYS + 1)
            old = replace(schedule, changed_at=begin)
            container.db.write(lambda w, old=old: container.repositories.schedules.update(w, old))  # type: ignore[misc]
            planned = (each.instant for each in occurrences(schedule, begin, container.calendar()))
            runs += [
                _ended(rules.scheduled(schedule, robot, mission, settings, install_id, at, at), rule, number, rng)
                for number, at in enumerate(takewhile(lambda at: at < now - timedelta(hours=1), planned))
            ]
        history += _one_at_a_time(runs)
    group = container.catalogue.save_group(Group(GROUP, tuple(robot.id for robot in saved[: len(PLAN)])))
    for number, name in enumerate(LIVE):
        container.catalogue.save_schedule(_live_schedule(group, by_name[name], settings, now + number * BETWEEN))
    container.catalogue.change_idle_rule(saved[0].id, mission_id=by_name["Return to charger"].id, after_minutes=15)
    history.sort(key=lambda row: row.planned_at)
    container.db.write(lambda w: container.repositories.executions.add_many(w, history))
    for number, robot in enumerate(saved):
        seen = _seen(
            [row for row in history if row.robot_id == robot.id], settings, now, timedelta(minutes=75 + 5 * number)
        )
        container.db.write(lambda w, robot=robot, seen=seen: ActivityRepository().save(w, robot.id, seen))  # type: ignore[misc]
    # The demo is right in any zone, so it does not ask for one.
    container.catalogue.change_settings(history_limit=None, selected_robot_id=saved[0].id, timezone=settings.timezone)


def _update_addresses(container: Container, known: Sequence[Robot], robots: Sequence[tuple[str, str]]) -> None:
    if any("//127.0.0.1:" not in robot.address for robot in known):
        raise BadInput(
            "this data directory is no demo's, its robots are real: leave --data-dir out, or give the demo one of its own"
        )
    addresses, names = dict(robots), {robot.name for robot in known}
    of_renamed = iter([url for name, url in robots if name not in names])
    found = [(robot, addresses.get(robot.name) or next(of_renamed, "")) for robot in known]
    container.catalogue.edit(
        lambda edit: [
            robot_edit.save(edit, replace(robot, address=url), PASSWORD, is_one_of_many=True)
            for robot, url in found
            if url
        ]
    )


def _schedule(rule: _Rule, robot: Robot, mission: Mission, settings: Settings, now: datetime) -> Schedule:
    first = (now.astimezone(ZoneInfo(settings.timezone)) - timedelta(days=DAYS)).replace(
        hour=rule.hour, minute=rule.minute, second=0, microsecond=0, tzinfo=None
    )
    return Schedule(f"{mission.name} on {robot.name}", robot.id, mission.id, first, settings.timezone, rule.recurrence)


def _live_schedule(group: Group, mission: Mission, settings: Settings, now: datetime) -> Schedule:
    first = (now.astimezone(ZoneInfo(settings.timezone)) + timedelta(seconds=90)).replace(
        second=0, microsecond=0, tzinfo=None
    )
    return Schedule(
        "",
        None,
        mission.id,
        first,
        settings.timezone,
        f"FREQ=MINUTELY;INTERVAL={len(LIVE) * BETWEEN // timedelta(minutes=1)}",
        group_id=group.id,
    )


def _ended(row: Execution, rule: _Rule, number: int, rng: random.Random) -> Execution:
    """A run that could have been: most are fine, some are not."""
    luck = rng.random()
    if luck < 0.03:
        reason = Reason(
            ReasonCode.BATTERY_LOW, {"battery": rng.randint(8, 28), "minimum": 30, "until": row.closes_at.isoformat()}
        )
        return rules.ended(row, reason, row.closes_at)
    wait, took = rng.expovariate(1 / 20), max(30.0, rng.gauss(rule.minutes, rule.minutes * 0.12) * 60)
    submitted = row.planned_at + timedelta(seconds=rng.uniform(0.1, 0.6))
    started = submitted + timedelta(seconds=wait)
    ran = replace(
        row,
        attempts=1 if rng.random() < 0.95 else 2,
        submitted_at=submitted,
        started_at=started,
        robot_delay_s=wait,
        queue_id=12_000 + number,
        queue_floor=11_999 + number,
    )
    if luck < 0.06:
        reason = Reason(
            ReasonCode.ROBOT_ABORTED, {"message": f"Failed to reach goal position 'Dock {rng.randint(1, 4)}'"}
        )
        return replace(rules.ended(ran, reason, started + timedelta(seconds=took / 3)), duration_s=took / 3)
    if luck < 0.075:
        return replace(
            rules.ended(ran, Reason(ReasonCode.USER_CANCELLED), started + timedelta(seconds=took / 2)),
            duration_s=took / 2,
        )
    return replace(ran, state=State.COMPLETED, duration_s=took, ended_at=started + timedelta(seconds=took))


def _one_at_a_time(runs: Sequence[Execution]) -> Iterator[Execution]:
    """The runs of one robot: those that find it busy wait in its queue."""
    free = datetime.min.replace(tzinfo=UTC)
    for row in sorted(runs, key=lambda row: row.planned_at):
        if row.started_at is not None and row.ended_at is not None:
            wait = max(timedelta(), free - row.started_at)
            row = replace(
                row,
                started_at=row.started_at + wait,
                robot_delay_s=(row.robot_delay_s or 0.0) + wait.total_seconds(),
                ended_at=row.ended_at + wait,
            )
            free = row.ended_at or free
        yield row


def _seen(runs: Sequence[Execution], settings: Settings, now: datetime, charging: timedelta) -> Iterator[ActivitySpan]:
    """A robot's activity on each day with runs, from 4:30 to 22:00: first it charged, then it ran or was idle."""
    zone = ZoneInfo(settings.timezone)
    for day, of_day in groupby(runs, key=lambda row: row.planned_at.astimezone(zone).date()):
        at, closes = (datetime.combine(day, moment, zone).astimezone(UTC) for moment in (time(4, 30), time(22)))
        yield ActivitySpan("charging", at, at := at + charging)
        for row in of_day:
            if row.started_at and row.ended_at and row.ended_at > at:
                yield ActivitySpan("idle", at, started := max(at, row.started_at))
                yield ActivitySpan("executing", started, at := row.ended_at)
        yield ActivitySpan("idle", at, max(at, min(closes, now)))
