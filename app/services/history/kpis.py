"""Reads the data of key figures: computed when shown, never stored.

A period is [start, end) of the instant at which an execution ended, and never goes beyond now: a start that a person
skips in advance ends at its planned time. Days are local days of settings.timezone, of 23, 24 or 25 hours.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime
from typing import Any
from zoneinfo import ZoneInfo

from app.database.activities import ActivityRepository
from app.database.connection import Database
from app.database.groups import GroupRepository
from app.database.kpi import EARLIEST, Count, KpiRepository, MissionRuns, Span
from app.database.robots import RobotRepository
from app.database.settings import SettingsRepository
from app.database.values import from_json, to_instant, to_text
from app.domain.activity import seen_seconds
from app.domain.clock import DAY, MOMENT, Clock, days_between, midnight
from app.domain.execution import Execution
from app.domain.models import Robot
from app.services.history.figures import LATE_S, Cause, Delays, Facts, GroupFacts, causes, counted
from app.services.planning.durations import BASELINE_OF, DURATIONS_OF, MOST_MISSIONS, Trend, trend

_FIRST_INSTANT = datetime(1970, 1, 1, tzinfo=UTC)
NEWEST = 5_000  # runs that the percentiles of delays and waits rest on


@dataclass(frozen=True)
class KpiFilter:
    """Which ended executions count; None: from the first, until now, of all robots. ``group``: starts that any of its
    robots could take, by its name then; its robots' use and observed time are those of ``robot_ids``, including
    missions of others."""

    start: datetime | None = None
    end: datetime | None = None
    robot_ids: Sequence[int] | None = None
    group: str | None = None

    def span(self, now: datetime) -> Span:
        """As the columns have it; of what has ended so far."""
        until = now + MOMENT
        return Span(
            to_text(self.start) if self.start else EARLIEST,
            to_text(min(self.end or until, until)),
            None if self.group is not None else self.robot_ids,
            self.group,
        )


Seen = Mapping[date, Mapping[str, float]]  # seconds of each activity, by local day


ALL = KpiFilter()


class Kpis:
    def __init__(self, db: Database, clock: Clock) -> None:
        self._db, self._clock = db, clock
        self._repository, self._settings, self._activities = KpiRepository(), SettingsRepository(), ActivityRepository()

    def facts(self, wanted: KpiFilter = ALL) -> Facts:
        """Of the whole period; ``robots`` are the configured ones of the filter, and removed ones with history in
        it. What any robot of a fleet was asked for is one of them as far as it is not known which robot took it."""
        c = self._db.read()
        span, zone = wanted.span(self._clock.now()), self._zone()
        counts = self._repository.counts(c, span.start, span.end, wanted.robot_ids or ())
        named = self._robots(wanted, counts)
        seen = self._seen(named, wanted.start or _FIRST_INSTANT, wanted.end, zone)
        return self._facts(
            counts,
            wanted,
            named,
            {robot_id: list(of_days.values()) for robot_id, of_days in seen.items()},
            recorded_days=len(self._repository.recorded_days(c, span, zone)),
        )

    def per_day(self, wanted: KpiFilter = ALL, dates: Sequence[date] = ()) -> list[Facts]:
        """Of each local day, cut to the period; without ``dates`` every day from the first to the last with something recorded."""
        c = self._db.read()
        span, zone = wanted.span(self._clock.now()), self._zone()
        recorded = dates or self._repository.recorded_days(c, span, zone)
        if not recorded:
            return []
        named = self._robots(wanted, ())
        seen = self._seen(named, midnight(recorded[0], zone), midnight(recorded[-1] + DAY, zone), zone)
        found = []
        for day in days_between(recorded[0], recorded[-1]):
            start, end = (to_text(midnight(each, zone)) for each in (day, day + DAY))
            counts = self._repository.counts(c, max(start, span.start), min(end, span.end), wanted.robot_ids or ())
            seconds = {robot_id: [of_days.get(day, {})] for robot_id, of_days in seen.items()}
            facts = self._facts(counts, wanted, named, seconds, day=day)
            found.append(replace(facts, recorded_days=int(facts.total > 0)))
        return found

    def _facts(
        self,
        counts: Sequence[Count],
        wanted: KpiFilter,
        named: Mapping[int, Robot],
        seen: Mapping[int, Sequence[Mapping[str, float]]],
        **more: Any,
    ) -> Facts:
        of_robot = defaultdict[int, list[Count]](list)
        for one in counts:
            of_robot[one.robot_id].append(one)
        robots = [
            counted(
                of_robot[robot_id],
                robot_id=robot_id,
                robot=robot.name,
                is_any=robot.is_any,
                observed_s=sum(seen_seconds(seconds) for seconds in seen[robot_id]),
                charging_s=sum(seconds.get("charging", 0.0) for seconds in seen[robot_id]),
            )
            for robot_id, robot in sorted(named.items(), key=lambda item: (item[1].name.casefold(), item[0]))
        ]
        return counted(
            (one for one in counts if _is_wanted(one, wanted)),
            robots=robots,
            mission_s=sum(robot.mission_s for robot in robots),
            observed_s=sum(robot.observed_s for robot in robots),
            charging_s=sum(robot.charging_s for robot in robots),
            **more,
        )

    def _robots(self, wanted: KpiFilter, counts: Iterable[Count]) -> dict[int, Robot]:
        """By id. What stands for any robot of a fleet has its name if it is asked for, else the fleet's, and is left out
        if nothing counts for it."""
        c, span, ids = self._db.read(), wanted.span(self._clock.now()), wanted.robot_ids
        found, counted_ids = {robot.id: robot for robot in RobotRepository().all(c)}, {one.robot_id for one in counts}
        for robot_id in counted_ids - found.keys() - {0}:
            found[robot_id] = Robot(self._repository.name_of_robot(c, span, robot_id), "", id=robot_id)
        if ids is not None:
            return {robot_id: robot for robot_id, robot in found.items() if robot_id in ids}
        return {
            robot.id: replace(robot, name=robot.fleet.name) if robot.is_any and robot.fleet is not None else robot
            for robot in found.values()
            if not robot.is_any or robot.id in counted_ids
        }

    def _seen(self, robot_ids: Iterable[int], start: datetime, end: datetime | None, zone: ZoneInfo) -> dict[int, Seen]:
        """By robot; up to now."""
        until = min(end or self._clock.now(), self._clock.now())
        return {
            robot_id: self._activities.seconds(self._db.read(), robot_id, start, until, zone) if start < until else {}
            for robot_id in robot_ids
        }

    def _zone(self) -> ZoneInfo:
        return ZoneInfo(self._settings.load(self._db.read()).timezone)

    # ------------------------------------------------------------------ beyond what is counted
    def kept_since(self) -> datetime | None:
        """The end of the first run of the history: older ones were deleted, or never existed. None: nothing has run."""
        first = self._repository.kept_since(self._db.read())
        return to_instant(first) if first else None

    def delays(self, wanted: KpiFilter = ALL) -> Delays:
        """Of scheduled executions that started on the robot."""
        found = self._repository.timings(self._db.read(), wanted.span(self._clock.now()), NEWEST)
        return Delays(
            sorted(one.app_s + one.queue_s for one in found),
            sorted(one.app_s for one in found),
            sorted(one.queue_s for one in found),
            sorted(one.run_s for one in found if one.run_s is not None),
        )

    def failures(self, wanted: KpiFilter = ALL) -> Sequence[Cause]:
        """Why runs of any trigger failed, the most frequent cause first."""
        return causes(self._repository.failures(self._db.read(), wanted.span(self._clock.now())))

    def not_completed(self, wanted: KpiFilter = ALL, most: int = 50) -> Sequence[Execution]:
        """Ended executions except completed ones, newest first."""
        return self._repository.not_completed(self._db.read(), wanted.span(self._clock.now()), most)

    def trends(self, wanted: KpiFilter = ALL, most: int = MOST_MISSIONS) -> Sequence[Trend]:
        """How long completed runs took, of the missions that took the most time in all, against the runs before the period."""
        c, span, zone = self._db.read(), wanted.span(self._clock.now()), self._zone()
        of_guid = defaultdict[str, list[MissionRuns]](list)
        for one in self._repository.missions(c, span):
            of_guid[one.guid].append(one)
        total = {
            guid: sum(one.seconds for one in ones) for guid, ones in of_guid.items() if any(one.number for one in ones)
        }
        days = [(day, to_text(midnight(day, zone))) for day in self._repository.recorded_days(c, span, zone)]
        before = replace(span, start=EARLIEST, end=span.start)
        found = []
        for guid in sorted(total, key=lambda guid: (-total[guid], guid))[:most]:
            robots, name = [one.robot_id for one in of_guid[guid]], max(of_guid[guid], key=lambda one: one.last_at).name
            runs = self._repository.newest_durations(c, span, guid, robots, DURATIONS_OF)
            usual = self._repository.newest_durations(c, before, guid, robots, BASELINE_OF)
            number = sum(one.number for one in of_guid[guid])
            found.append(trend(guid, name, number, runs, [seconds for _, seconds in usual], days))
        return found

    def groups(self, wanted: KpiFilter = ALL, robots: Sequence[Facts] = ()) -> list[GroupFacts]:
        """In order of name; without groups that have no start in the period. ``robots``: of the same period."""
        c = self._db.read()
        span = replace(wanted.span(self._clock.now()), group=None)
        groups = {group.id: group for group in GroupRepository().all(c)}
        found = []
        for one in self._repository.group_starts(c, span, LATE_S):
            group = groups.get(one.group_id)
            name, members = (group.name, group.members) if group is not None else (one.name, from_json(one.robots))
            if wanted.group not in (None, name):
                continue
            waits = sorted(self._repository.group_waits(c, span, one.group_id, NEWEST))
            used = [
                (robot.robot, share)
                for robot in robots
                if robot.robot_id in members and (share := robot.value("utilisation")) is not None
            ]
            found.append(GroupFacts(one.group_id, name, one.starts, one.in_time, waits, used))
        return sorted(found, key=lambda one: (one.group.casefold(), one.group_id))


def _is_wanted(one: Count, wanted: KpiFilter) -> bool:
    if wanted.group is not None:
        return one.robot_group == wanted.group
    return wanted.robot_ids is None or one.robot_id in wanted.robot_ids
