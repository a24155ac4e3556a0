"""What is planned badly in a part of the plan. Pure.

It rests on planned instants and usual durations alone, so that whatever is said is true however much of the plan is looked at.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from math import ceil

from app.domain.conflicts import ConflictCode
from app.domain.models import Group
from app.services.planning.crowds import CROWDED, HOUR, Demand, Span, joined, load
from app.services.planning.overlaps import ASSUMED_S
from app.services.planning.planned import Conflict, PlannedRun


@dataclass(frozen=True)
class Shared:
    """What runs share, by id. ``groups``: each with its robots that are switched on; ``places``: name, room and names of its missions."""

    groups: Mapping[int, tuple[Group, Sequence[int]]]
    places: Mapping[int, tuple[str, int, frozenset[str]]]


def plan_conflicts(runs: Sequence[PlannedRun], shared: Shared, since: datetime, last: datetime) -> list[Conflict]:
    """In order of time. ``runs``: all that are planned in [since, last) and those before it that may still be under way then, in order."""
    found = [*_too_few(runs, shared, since, last), *_places(runs, shared, since, last), *_finish_by(runs)]
    found += _behind(runs, shared)
    return sorted((conflict for conflict in found if since <= conflict.at < last), key=lambda conflict: conflict.at)


def _span(run: PlannedRun) -> Span:
    return Span(run.at, run.at + timedelta(seconds=run.usual_s or ASSUMED_S))


def _crowds(spans: Iterable[Span], room: int, last: datetime) -> Iterator[tuple[datetime, dict[str, object]]]:
    """Of those that are not over when the plan ends the end is not known."""
    for crowd in Demand(spans).crowds(room):
        yield crowd.at, {"starts": crowd.number, "until": crowd.until if crowd.until <= last else None}


def _too_few(runs: Sequence[PlannedRun], shared: Shared, since: datetime, last: datetime) -> Iterator[Conflict]:
    if not shared.groups:
        return
    of_group, of_robot = defaultdict[int, list[Span]](list), defaultdict[int, list[Span]](list)
    for run in runs:
        if run.group is not None:
            of_group[run.group.id].append(_span(run))
        else:
            of_robot[run.robot.id].append(_span(run))
    for group, robots in shared.groups.values():
        spans = of_group[group.id]
        if not spans:
            continue
        spans += [span for robot_id in robots for span in joined(of_robot.get(robot_id, ()))]
        for at, details in _crowds(spans, len(robots), last):
            yield Conflict(
                ConflictCode.TOO_FEW_ROBOTS,
                at,
                {"group": group.name, "group_id": group.id, "robots": len(robots), **details},
            )


def _places(runs: Sequence[PlannedRun], shared: Shared, since: datetime, last: datetime) -> Iterator[Conflict]:
    for place_id, (name, room, missions) in shared.places.items():
        spans = [_span(run) for run in runs if run.mission.name in missions]
        for at, details in _crowds(spans, room, last):
            yield Conflict(
                ConflictCode.PLACE_FULL,
                at,
                {"place": name, "place_id": place_id, "most": room, "missions": missions, **details},
            )
        for hour, percent in _crowded_hours(spans, room):
            if hour >= since and hour + HOUR <= last:
                yield Conflict(
                    ConflictCode.PLACE_CROWDED,
                    hour,
                    {"place": name, "place_id": place_id, "percent": percent, "until": hour + HOUR},
                )


def _crowded_hours(spans: Iterable[Span], room: int) -> Iterator[tuple[datetime, int]]:
    """With the share of the hour in %."""
    hours = defaultdict[datetime, list[Span]](list)
    for span in spans:
        hours[span.begins.replace(minute=0, second=0, microsecond=0)].append(span)
    for hour, those in hours.items():
        if (share := load(those, room, hour)) > CROWDED:
            yield hour, round(100 * share)


def place_warning(runs: Iterable[PlannedRun], name: str, room: int, missions: Collection[str]) -> Conflict | None:
    """The worst hour of a place, entered but perhaps not saved; None: there is none in which it is wanted for most of the time."""
    hours = list(_crowded_hours((_span(run) for run in runs if run.mission.name in missions), room))
    if not hours:
        return None
    hour, percent = max(hours, key=lambda one: (one[1], -one[0].timestamp()))
    return Conflict(ConflictCode.PLACE_CROWDED, hour, {"place": name, "percent": percent, "until": hour + HOUR})


def _behind(runs: Sequence[PlannedRun], shared: Shared) -> Iterator[Conflict]:
    """A run that nine times of ten still goes on when one that matters more is planned on its only robot."""
    if len({run.schedule.priority for run in runs}) < 2:
        return
    going_on = defaultdict[int, list[PlannedRun]](list)
    for run in runs:
        if (robot_id := _only_robot(run, shared)) is None:
            continue
        those = going_on[robot_id] = [
            one for one in going_on[robot_id] if one.at + timedelta(seconds=one.quick_s or 0.0) > run.at
        ]
        for one in those:
            if one.at < run.at and one.schedule.priority < run.schedule.priority:
                yield Conflict(
                    ConflictCode.CRITICAL_BEHIND,
                    one.at,
                    {
                        "mission": one.mission.name,
                        "behind": run.mission.name,
                        "robot": run.robot.name,
                        "start": run.at,
                        "schedule_id": one.schedule.id,
                    },
                )
        those.append(run)


def _only_robot(run: PlannedRun, shared: Shared) -> int | None:
    if run.group is None:
        return run.robot.id
    robots = shared.groups[run.group.id][1] if run.group.id in shared.groups else ()
    return robots[0] if len(robots) == 1 else None


def _finish_by(runs: Sequence[PlannedRun]) -> Iterator[Conflict]:
    """Once for each schedule."""
    told = set[int]()
    for run in runs:
        minutes = run.schedule.finish_by_minutes
        if minutes is None or run.usual_s is None or run.usual_s <= minutes * 60 or run.schedule.id in told:
            continue
        told.add(run.schedule.id)
        yield Conflict(
            ConflictCode.FINISH_BY_SHORT,
            run.at,
            {
                "mission": run.mission.name,
                "minutes": minutes,
                "usual_minutes": ceil(run.usual_s / 60),
                "schedule_id": run.schedule.id,
            },
        )
