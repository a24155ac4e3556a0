"""The plan and the past as bars, lanes and ticks for the timeline. Pure; made where the facts are read, off the UI thread."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date, datetime, timedelta
from itertools import pairwise
from zoneinfo import ZoneInfo

from app.database.robots import Hold
from app.domain.models import Execution, Group, Robot, State
from app.i18n import _, ngettext
from app.screens.common import foreseen, formats
from app.screens.common.robot_appearance import off_word, silence_word
from app.screens.scheduler import axis, of_groups
from app.screens.scheduler.axis import Band, Range, Tick
from app.screens.scheduler.contested import Contested
from app.screens.scheduler.facts import HOURS, SchedulerFacts, Window, full_hour
from app.services.planning.planned import ASSUMED_S, PlannedRun
from app.widgets.items import Bar, Lane
from app.widgets.time_scale import TimeScale

SHORTEST = 1 / 60  # hours: a bar of no length would be no bar
THIN = 1 / 85  # share of the visible part: bars this short, and this close together (twice), become one
MERGED_FROM = 3  # of them
UNEVEN = 0.2  # of an interval: runs at a fixed interval may begin this much sooner or later
ROOM = 4  # lanes that are seen at once
MANY = 12  # lanes with bars; of more those of a group are one line
IDLE = "idle"  # key of the line for robots without a bar
CONTENDING = ("planned", "running", "draft")  # states of bars that need their robot
SPANS = (6, 8, 24, 168)  # hours to choose from
STEPS = {6: 1, 12: 1, 24: 3, 48: 4, 96: 12}  # hours between labelled ticks for this many visible hours; a day beyond

BARS = {
    State.COMPLETED: "past",
    State.CANCELLED: "past",
    State.FAILED: "failed",
    State.SKIPPED: "skipped",
    State.MISSED: "skipped",
    State.EXECUTING: "running",
    State.WAITING: "planned",
    State.SUBMITTING: "planned",
    State.QUEUED: "planned",
}


@dataclass(frozen=True)
class TimelineView:
    """What the widget shows."""

    origin: datetime | None = None
    lanes: tuple[Lane, ...] = ()
    bands: tuple[Band, ...] = ()
    ticks: tuple[Tick, ...] = ()
    first: float = 0.0
    hours: float = HOURS
    now: float = 0.0
    now_label: str = ""
    span: str = ""  # in words
    robots: str = ""  # whose, in words, if there are many
    is_filtered: bool = False

    @property
    def folds(self) -> list[tuple[datetime, datetime]]:
        """From when to when time is folded."""
        at = [(timedelta(hours=band.start), timedelta(hours=band.end)) for band in self.bands if band.kind == "folded"]
        return [(self.origin + start, self.origin + end) for start, end in at] if self.origin else []


def span_text(hours: float) -> str:
    """How much is seen at once."""
    whole = round(hours)
    if whole < 48:
        return _("{n} h").format(n=whole)
    return ngettext("{n} day", "{n} days", round(hours / 24)).format(n=round(hours / 24))


def looks_in_words() -> str:
    """What colours and shapes mean."""
    return "\n".join(
        (
            _("Dark: working"),
            _("Light: planned"),
            _("Grey: ended"),
            _("Red: failed"),
            _("Amber frame: not run, or on hold"),
            _("Amber edge: overlaps"),
            _("Dashed: not saved yet"),
            _("Hatched: no work"),
        )
    )


def spanning(window: Window, hours: float, now: datetime, zone: ZoneInfo) -> Window:
    """So many hours around the same middle; a window that moves with the time still does."""
    if window.left is None:
        return replace(window, hours=hours)
    return replace(window, left=window.start(now, zone) + timedelta(hours=(window.hours - hours) / 2), hours=hours)


def moved(
    window: Window, screens: float, now: datetime, zone: ZoneInfo, folds: Iterable[tuple[datetime, datetime]] = ()
) -> Window:
    """Forward or back by that share of the visible part; ``folds`` are not seen, so they don't count."""
    left, hour = window.start(now, zone), timedelta(hours=1)
    scale = TimeScale(((start - left) / hour, (end - left) / hour) for start, end in folds)
    return replace(window, left=left + hour * scale.hour(scale.drawn(0) + window.hours * screens))


def timeline(facts: SchedulerFacts, now: datetime, window: Window | None = None) -> TimelineView:
    """What the window shows and a margin on either side."""
    window = window or Window()
    left = window.start(now, facts.zone)
    origin = full_hour(left, facts.zone)
    first = (left - origin).total_seconds() / 3600
    low, high = ((instant - origin).total_seconds() / 3600 for instant in window.span(now, facts.zone, facts.calendar))
    read = Range(origin, low, high)
    step = next((hours for span, hours in STEPS.items() if window.hours <= span), 24)
    robots = [robot for robot in facts.robots if robot.id in window.robots]
    planned, contested = defaultdict[Hashable, list[PlannedRun]](list), defaultdict[Hashable, list[PlannedRun]](list)
    conflicts = Contested(facts.conflicts)
    for run in facts.planned:
        planned[run.lane].append(run)
        if conflicts.of(run):
            contested[run.lane].append(run)
    shown = robots or facts.robots
    groups = [group for group in facts.groups if any(robot.id in group.members for robot in shown)]
    thin = window.hours * THIN
    of_groups = (
        _group_lane(facts, group, planned["group", group.id], contested["group", group.id], now, read, thin)
        for group in groups
    )
    of_robots = [_lane(facts, robot, planned[robot.id], contested[robot.id], now, read, thin) for robot in shown]
    waiting = [lane for lane in of_groups if lane.bars]
    lanes: Sequence[Lane] = (*waiting, *of_robots)
    closed = tuple(
        axis.closed(facts, read, ((bar.start, bar.end) for lane in lanes for bar in lane.bars), window.unfolded)
    )
    folds = [band for band in closed if band.kind == "folded"]
    if window.left is None:  # what moves with the time doesn't begin amid a fold
        first = next((fold.start for fold in folds if fold.start < first < fold.end), first)
    seen = Range(origin, first, _right_edge(first, window.hours, folds))
    if not robots:
        of_robots = _with_groups(facts, of_robots, planned, window.opened, now, seen)
    lanes = _with_idle_last(
        (*waiting, *of_robots), window.opened
    )  # first those without a robot: they may need a person
    return TimelineView(
        origin,
        lanes=tuple(lanes),
        bands=(*closed, *axis.held(facts, now, read)),
        robots=_robots_word(facts, robots),
        is_filtered=bool(robots),
        ticks=tuple(
            tick
            for tick in axis.ticks(facts.zone, read, step)
            if not any(fold.start <= tick.hour < fold.end for fold in folds)
        ),
        first=first,
        hours=window.hours,
        now=read.at(now),
        now_label=formats.wall_time(now.astimezone(facts.zone)),
        span=span_text(window.hours),
    )


def _right_edge(first: float, hours: float, folds: Iterable[Band]) -> float:
    """The end of this many hours from ``first``; a folded break takes hardly any."""
    end = first + hours
    for fold in folds:
        if fold.start < end and fold.end > first:
            end += fold.end - max(fold.start, first)
    return end


def _with_groups(
    facts: SchedulerFacts,
    lanes: list[Lane],
    planned: Mapping[Hashable, Sequence[PlannedRun]],
    opened: Hashable,
    now: datetime,
    seen: Range,
) -> list[Lane]:
    """With many robots, those of a group are one line, and below it when it is open: the first one, until another is
    chosen."""
    busy = {lane.key: lane for lane in lanes if lane.bars}
    if len(busy) <= MANY:
        return lanes
    lines: list[Lane] = []
    for group in facts.groups:
        members = [lane for number, lane in busy.items() if number in group.members]
        if len(members) > 1:
            key, words = ("robots of", group.id), _group_line(facts, members, planned, now, seen)
            is_open = opened == key or (opened is None and not lines)
            lines += [Lane(group.name, key=key, line=words, is_open=is_open), *(members if is_open else ())]
            busy = {number: lane for number, lane in busy.items() if lane not in members}
    return [*lines, *(lane for lane in lanes if not lane.bars or lane.key in busy)]


def _group_line(
    facts: SchedulerFacts,
    lanes: Sequence[Lane],
    planned: Mapping[Hashable, Sequence[PlannedRun]],
    now: datetime,
    seen: Range,
) -> str:
    """Its lanes' robots, what is visible on them (future starts, problems), and their notes."""

    def is_seen(at: datetime) -> bool:
        return seen.low <= seen.at(at) < seen.high

    robots = {lane.key for lane in lanes}
    starts = sum(is_seen(run.begins) for robot in robots for run in planned[robot])
    failed = sum(run.robot_id in robots and run.state is State.FAILED and is_seen(run.planned_at) for run in facts.past)
    is_more = any(
        schedule.robot_id in robots and seen.at(facts.more[schedule.id]) < seen.high
        for schedule in facts.schedules
        if schedule.id in facts.more
    )
    overlaps = sum(end > seen.low and start < seen.high for lane in lanes for start, end in lane.overlaps)
    held = sum(_own_hold(facts, robot, now) is not None for robot in robots)
    silent = len(robots & facts.silent.keys())
    return of_groups.line(len(lanes), starts, is_more, failed, overlaps, held, silent)


def _with_idle_last(lanes: Sequence[Lane], opened: Hashable) -> tuple[Lane, ...]:
    """With many robots, those without a bar are one line, and below it when it is open."""
    idle = [lane for lane in lanes if not lane.bars and not lane.line]
    if len(lanes) <= ROOM or len(idle) < 2:
        return tuple(lanes)
    is_open = opened == IDLE
    words = ngettext("{n} robot with nothing planned", "{n} robots with nothing planned", len(idle)).format(n=len(idle))
    return (
        *(lane for lane in lanes if lane not in idle),
        Lane("", key=IDLE, line=words, is_open=is_open),
        *(idle if is_open else ()),
    )


def _robots_word(facts: SchedulerFacts, chosen: Sequence[Robot]) -> str:
    if len(facts.robots) <= ROOM:
        return ""
    if len(chosen) == 1:
        return chosen[0].name
    return ngettext("{n} robot", "{n} robots", len(chosen)).format(n=len(chosen)) if chosen else _("All robots")


# ---------------------------------------------------------------------- bars
def _lane(
    facts: SchedulerFacts,
    robot: Robot,
    planned: Iterable[PlannedRun],
    contested: Iterable[PlannedRun],
    now: datetime,
    read: Range,
    thin: float,
) -> Lane:
    bars = [_past_bar(facts, execution, now, read) for execution in facts.past if execution.robot_id == robot.id]
    bars += [_planned_bar(facts, run, read) for run in planned]
    bars = sorted((bar for bar in bars if bar.end > read.low and bar.start < read.high), key=lambda bar: bar.start)
    more = [
        at
        for schedule in facts.schedules
        if schedule.robot_id == robot.id and (at := facts.more.get(schedule.id)) is not None
    ]
    said = axis.held_until(_own_hold(facts, robot.id, now), facts, now) or silence_word(facts.silent.get(robot.id))
    icon, tone = facts.icons.get(robot.id, ("", "neutral"))
    return Lane(
        robot.name,
        said if robot.enabled else off_word(robot),
        (*_merged(bars, thin, lambda hour: read.instant(hour).astimezone(facts.zone).date()), *_more_bar(more, read)),
        _joined([*_overlaps(bars), *_conflicts(contested, read)]),
        robot.id,
        icon=icon,
        tone=tone,
    )


def _own_hold(facts: SchedulerFacts, robot_id: Hashable, now: datetime) -> Hold | None:
    """That of this robot alone: one of all robots is a band."""
    return next((hold for hold in facts.holds if hold.robot_id == robot_id and hold.covers(hold.robot_id, now)), None)


def _group_lane(
    facts: SchedulerFacts,
    group: Group,
    planned: Iterable[PlannedRun],
    contested: Iterable[PlannedRun],
    now: datetime,
    read: Range,
    thin: float,
) -> Lane:
    """Starts without a robot of the group: now, in the past, or in the forecast."""
    planned = list(planned)
    bars = [
        _past_bar(facts, execution, now, read)
        for execution in facts.past
        if execution.robot_id is None and execution.group_id == group.id
    ]
    bars += [_planned_bar(facts, run, read) for run in planned]
    bars = sorted((bar for bar in bars if bar.end > read.low and bar.start < read.high), key=lambda bar: bar.start)
    more = [
        at
        for schedule in facts.schedules
        if schedule.group_id == group.id and (at := facts.more.get(schedule.id)) is not None
    ]
    return Lane(
        _("Any of {group}").format(group=group.name),
        _group_note(facts, group, planned),
        (*_merged(bars, thin, lambda hour: read.instant(hour).astimezone(facts.zone).date()), *_more_bar(more, read)),
        _joined(_conflicts(contested, read)),
        ("group", group.id),
    )


def _group_note(facts: SchedulerFacts, group: Group, planned: Sequence[PlannedRun]) -> str:
    """Why its starts have no robot; bars themselves show holds and outcomes."""
    foreseeable = [run for run in planned if facts.hold_of(run) is None]
    if foreseeable:
        return _("none has the mission") if all(run.lacks_mission for run in foreseeable) else _("no robot expected")
    waits = any(row.state is State.WAITING and row.robot_id is None and row.group_id == group.id for row in facts.past)
    return _("Waits for a robot") if waits else ""


def _overlaps(bars: list[Bar]) -> Iterable[tuple[float, float]]:
    """The future time that two bars share, compared by whole seconds: runs that touch don't overlap."""
    wanted = [(round(bar.start * 3600), round(bar.end * 3600)) for bar in bars if bar.state in CONTENDING]
    taken, spans = -math.inf, []  # type: float, list[tuple[int, int]]
    for start, end in sorted(wanted):
        if start < taken:
            shared = start, int(min(taken, end))
            if spans and shared[0] <= spans[-1][1]:
                spans[-1] = spans[-1][0], max(spans[-1][1], shared[1])
            else:
                spans.append(shared)
        taken = max(taken, end)
    return ((start / 3600, end / 3600) for start, end in spans)


def _conflicts(contested: Iterable[PlannedRun], read: Range) -> list[tuple[float, float]]:
    """When planned runs compete for a robot or a place, or delay more important ones."""
    spans = [(read.at(run.begins), read.at(run.begins) + (run.usual_s or ASSUMED_S) / 3600) for run in contested]
    return [(start, end) for start, end in spans if end > read.low and start < read.high]


def _joined(spans: Iterable[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    joined: list[tuple[float, float]] = []
    for start, end in sorted(spans):
        if joined and start <= joined[-1][1]:
            joined[-1] = joined[-1][0], max(joined[-1][1], end)
        else:
            joined.append((start, end))
    return tuple(joined)


def _merged(bars: list[Bar], thin: float, day: Callable[[float], date]) -> Iterable[Bar]:
    """Bars of a day too thin and too close to be distinguished become one, which a tap zooms into."""
    groups: list[list[Bar]] = []
    for bar in bars:
        last = groups[-1][-1] if groups else None
        if (
            last
            and bar.state == last.state
            and bar.start - last.start < 2 * thin
            and bar.end - bar.start < thin
            and last.end - last.start < thin
            and day(bar.start) == day(last.start)
        ):
            groups[-1].append(bar)
        else:
            groups.append([bar])
    for group in groups:
        yield from group if len(group) < MERGED_FROM else [_block(group)]


def _block(group: list[Bar]) -> Bar:
    """What they have in common: the mission, how often it starts, their number."""
    begins, ends, count = group[0].start, max(bar.end for bar in group), len(group)
    said = [str(count), ngettext("{n} run", "{n} runs", count).format(n=count)]
    names, every = {bar.label for bar in group}, _interval([bar.start for bar in group])
    if every:
        said.append(_("every {time} · {runs}").format(time=formats.duration(every), runs=said[-1]))
    if len(names) == 1 and (name := names.pop()):
        said.append(f"{name} · {said[-1]}")
    label, *shorter = reversed(said)
    return Bar(
        ("zoom", (begins + ends) / 2, ends - begins), begins, ends, label, group[0].state, shorter=tuple(shorter)
    )


def _interval(starts: Sequence[float]) -> float:
    """Seconds, in whole minutes, after which the next one follows; 0: now sooner, now later."""
    gaps = [(after - before) * 3600 for before, after in pairwise(starts)]
    usual = round(sum(gaps) / len(gaps) / 60) * 60
    return usual if usual and all(abs(gap - usual) <= usual * UNEVEN for gap in gaps) else 0


def _more_bar(more: Sequence[datetime], read: Range) -> Iterable[Bar]:
    """The time after which more starts exist than were computed."""
    begins = max(read.low, read.at(min(more))) if more else read.high
    if begins < read.high:
        yield Bar(("zoom", begins, SPANS[0]), begins, read.high, _("and more starts"))


def _planned_bar(facts: SchedulerFacts, run: PlannedRun, read: Range) -> Bar:
    start, name = read.at(run.begins), facts.mission_names.start(run)
    return Bar(
        ("schedule", run.schedule.id, run.at),
        start,
        start + (run.usual_s or ASSUMED_S) / 3600,
        foreseen.label(run, name),
        "held" if facts.hold_of(run) is not None else "planned",
        movable=run.begins == run.at,
        shorter=(foreseen.ABOUT,) if run.is_approximate else (),
    )


def _past_bar(facts: SchedulerFacts, execution: Execution, now: datetime, read: Range) -> Bar:
    begins, ends = span_of(facts, execution, now)
    name, start = facts.mission_names.run(execution), read.at(begins)
    state = BARS[execution.state]
    if execution.state is State.WAITING and facts.hold(execution.robot_id, execution.group_id, now) is not None:
        state = "held"
    is_named = execution.state.is_open or facts.is_skipped(execution, now)
    return Bar(
        ("execution", execution.id), start, max(read.at(ends), start + SHORTEST), name if is_named else "", state
    )


def span_of(facts: SchedulerFacts, execution: Execution, now: datetime) -> tuple[datetime, datetime]:
    """From when to when an execution used its robot, or waited for it."""
    usual = timedelta(seconds=facts.usual_s.get((execution.robot_id or 0, execution.mission_guid), ASSUMED_S))
    if execution.state is State.EXECUTING:
        begins = execution.started_at or execution.submitted_at or execution.planned_at
        return begins, max(begins + usual, now)
    if execution.state.is_open:
        return now, now + usual
    if facts.is_skipped(execution, now):
        return execution.planned_at, execution.planned_at + usual
    ended = execution.ended_at or execution.planned_at
    if execution.state in (State.SKIPPED, State.MISSED):
        return execution.planned_at, min(ended, execution.closes_at)
    return execution.started_at or execution.submitted_at or execution.planned_at, ended


# ---------------------------------------------------------------------- what is not saved yet
def with_draft(
    view: TimelineView,
    target: Hashable,
    base: int | None,
    starts: Iterable[datetime],
    length_s: float | None,
    name: str,
) -> TimelineView:
    """With the form's next ``starts`` dashed in the lane of its robot or group, and those of its schedule ``base`` as
    they were."""
    origin = view.origin
    if origin is None:
        return view
    length, times = (length_s or ASSUMED_S) / 3600, [(at - origin).total_seconds() / 3600 for at in starts]
    drafts = [Bar(("draft", hour), hour, hour + length, name, "draft") for hour in times]
    return _changed(
        view,
        lambda bar: base is not None and isinstance(bar.key, tuple) and bar.key[:2] == ("schedule", base),
        target,
        drafts,
    )


def with_moved(view: TimelineView, key: Hashable, hour: float) -> TimelineView:
    """With that bar dashed where it was dragged to, and as it was."""
    found = [(lane.key, bar) for lane in view.lanes for bar in lane.bars if bar.key == key]
    if not found:
        return view
    lane, bar = found[0]
    moved = bar._replace(key=("draft", hour), start=hour, end=hour + bar.end - bar.start, state="draft", movable=False)
    return _changed(view, lambda other: other.key == key, lane, [moved])


def _changed(view: TimelineView, was: Callable[[Bar], bool], target: Hashable, added: Sequence[Bar]) -> TimelineView:
    lanes = []
    for lane in view.lanes:
        bars = [bar._replace(state="was", label="", movable=False) if was(bar) else bar for bar in lane.bars]
        if lane.key == target:
            bars = sorted([*bars, *added], key=lambda bar: bar.start)
            lane = lane._replace(overlaps=_joined([*lane.overlaps, *_overlaps(bars)]))
        lanes.append(lane._replace(bars=tuple(bars)))
    return replace(view, lanes=tuple(lanes))
