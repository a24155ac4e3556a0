"""What is planned badly: more starts than there are robots in a group or than a place has room for, a run that makes a
more important one late, and too little time. Pure.

It uses only planned instants and usual durations, so that a finding is true for any part of the plan.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from math import ceil
from typing import Any, NamedTuple

from app.domain.conflicts import ConflictCode
from app.domain.models import Group, Place
from app.services.planning.occupancy import Occupancy, Overload, Span, merged
from app.services.planning.planned import ASSUMED_S, Conflict, PlannedRun

HOUR = timedelta(hours=1)
CROWDED = 0.7  # of any hour: above that what waits for a place waits long


@dataclass(frozen=True)
class Shared:
    """What runs share: groups, by id, with their robots that are switched on, and places with the names of their missions."""

    groups: Mapping[int, tuple[Group, Sequence[int]]]
    places: Sequence[tuple[Place, frozenset[str]]]


class Resource(NamedTuple):
    """The robots of a group, or a place: ``room`` for so many runs at a time, and when runs use it."""

    code: ConflictCode
    room: int
    details: Mapping[str, Any]
    spans: Sequence[Span]

    def conflict(self, overload: Overload, until: datetime | None) -> Conflict:
        return Conflict(self.code, overload.at, {**self.details, "starts": overload.number, "until": until})


def resources(runs: Sequence[PlannedRun], shared: Shared, *, slow: bool = False) -> Iterator[Resource]:
    """Always in the same order. A run on one robot takes that robot from each of its groups, counted once for
    overlapping runs. ``slow``: runs take their 90th percentile instead of the usual time."""
    of_group, of_robot = defaultdict[int, list[Span]](list), defaultdict[int, list[Span]](list)
    for run in runs if shared.groups else ():
        spans = of_robot[run.robot.id] if run.group is None else of_group[run.group.id]
        spans.append(_span(run, slow))
    for group, robots in shared.groups.values():
        taken = [span for robot_id in robots for span in merged(of_robot.get(robot_id, ()))]
        details: dict[str, Any] = {"group": group.name, "group_id": group.id, "robots": len(robots)}
        yield Resource(ConflictCode.TOO_FEW_ROBOTS, len(robots), details, of_group[group.id] + taken)
    for place, missions in shared.places:
        details = {"place": place.name, "place_id": place.id, "most": place.most, "missions": missions}
        yield Resource(ConflictCode.PLACE_FULL, place.most, details, _at_place(runs, missions, slow=slow))


def _at_place(runs: Iterable[PlannedRun], missions: Collection[str], *, slow: bool = False) -> list[Span]:
    return [_span(run, slow) for run in runs if run.mission.name in missions]


def _span(run: PlannedRun, slow: bool) -> Span:
    seconds = run.usual.slow_s if slow and run.usual else run.usual_s
    return Span(run.at, run.at + timedelta(seconds=seconds or ASSUMED_S))


def crowded_hours(place: Resource) -> Iterator[Conflict]:
    """The hours in which it is in use most of the time, by the runs that begin in them."""
    seconds = defaultdict[datetime, float](float)
    for span in place.spans:
        hour = span.begins.replace(minute=0, second=0, microsecond=0)
        seconds[hour] += (span.ends - span.begins).total_seconds()
    of_place = {name: place.details[name] for name in ("place", "place_id")}
    for hour, total in seconds.items():
        if (share := total / (place.room * HOUR.total_seconds())) > CROWDED:
            details = {**of_place, "percent": round(100 * share), "until": hour + HOUR}
            yield Conflict(ConflictCode.PLACE_CROWDED, hour, details)


def late_because_of(runs: Sequence[PlannedRun], shared: Shared) -> Iterator[tuple[PlannedRun, PlannedRun]]:
    """``runs`` in order of time: each that in nine of ten cases has not ended when a more important one is planned on
    its only robot, with that one."""
    if len({run.schedule.priority for run in runs}) < 2:
        return
    going_on = defaultdict[int, list[PlannedRun]](list)
    for run in runs:
        if (robot_id := _only_robot(run, shared)) is None:
            continue
        earlier = going_on[robot_id] = [
            one for one in going_on[robot_id] if one.usual and one.at + timedelta(seconds=one.usual.quick_s) > run.at
        ]
        for one in earlier:
            if one.at < run.at and one.schedule.priority < run.schedule.priority:
                yield one, run
        earlier.append(run)


def _only_robot(run: PlannedRun, shared: Shared) -> int | None:
    if run.group is None:
        return None if run.robot.is_any else run.robot.id
    robots = shared.groups[run.group.id][1] if run.group.id in shared.groups else ()
    return robots[0] if len(robots) == 1 else None


def critical_behind(run: PlannedRun, late: PlannedRun, robot: str, schedule_id: int) -> Conflict:
    details = {
        "mission": run.mission.name,
        "behind": late.mission.name,
        "robot": robot,
        "start": late.at,
        "schedule_id": schedule_id,
    }
    return Conflict(ConflictCode.CRITICAL_BEHIND, run.at, details)


def finish_by_short(mission: str, minutes: int | None, usual_s: float | None) -> dict[str, Any] | None:
    """The values of the sentence that a mission usually takes longer than allowed; None if it does not."""
    if minutes is None or usual_s is None or usual_s <= minutes * 60:
        return None
    return {"mission": mission, "minutes": minutes, "usual_minutes": ceil(usual_s / 60)}


# ---------------------------------------------------------------------- the plan
def plan_conflicts(runs: Sequence[PlannedRun], shared: Shared, since: datetime, last: datetime) -> list[Conflict]:
    """In order of time. ``runs``: all planned in [since, last) and earlier ones that may still be under way then, in
    order. A conflict that lasts beyond the plan has no known end."""
    found = list[Conflict]()
    for resource in resources(runs, shared):
        for overload in Occupancy(resource.spans).overloads(resource.room):
            found.append(resource.conflict(overload, overload.until if overload.until <= last else None))
        if resource.code is ConflictCode.PLACE_FULL:
            found += (hour for hour in crowded_hours(resource) if hour.at + HOUR <= last)
    found += _finish_by(runs)
    found += (
        critical_behind(one, late, late.robot.name, one.schedule.id) for one, late in late_because_of(runs, shared)
    )
    return sorted((conflict for conflict in found if since <= conflict.at < last), key=lambda conflict: conflict.at)


def place_warning(runs: Iterable[PlannedRun], place: Place, missions: Collection[str]) -> Conflict | None:
    """The worst hour of a place, entered but perhaps not saved; None: no hour in which it is in use most of the
    time."""
    details = {"place": place.name, "place_id": place.id}
    resource = Resource(ConflictCode.PLACE_FULL, place.most, details, _at_place(runs, missions))
    return max(crowded_hours(resource), key=lambda one: (one.details["percent"], -one.at.timestamp()), default=None)


def _finish_by(runs: Sequence[PlannedRun]) -> Iterator[Conflict]:
    """Once for each schedule."""
    seen = set[int]()
    for run in runs:
        short = finish_by_short(run.mission.name, run.schedule.finish_by_minutes, run.usual_s)
        if short is not None and run.schedule.id not in seen:
            seen.add(run.schedule.id)
            yield Conflict(ConflictCode.FINISH_BY_SHORT, run.at, {**short, "schedule_id": run.schedule.id})
