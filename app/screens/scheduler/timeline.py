"""The plan and the past as bars, lanes and ticks for the timeline. Pure; made where the facts are read, off the UI thread."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import date, datetime, timedelta
from zoneinfo import ZoneInfo

from app.database.robots import Hold
from app.domain.execution import Execution, State
from app.domain.models import Group, Robot
from app.i18n import _, ngettext
from app.screens.common import foreseen, formats
from app.screens.common.robot_appearance import off_word, silence_word
from app.screens.common.robot_groups import robots_in_words
from app.screens.scheduler import axis, of_groups
from app.screens.scheduler.axis import Band, Range, Span, Tick
from app.screens.scheduler.contested import Contested
from app.screens.scheduler.facts import HOURS, SchedulerFacts, Window, full_hour
from app.services.catalogue.preview import Forecast
from app.services.planning.planned import ASSUMED_S, PlannedRun
from app.widgets.items import Bar, Lane
from app.widgets.time_scale import TimeScale

SHORTEST = 1 / 60  # hours: a bar of no length would be no bar
THIN = 1 / 85  # share of the visible part: bars this short, and this close together (twice), become one
MERGED_FROM = 3  # of them
FEW = 4  # robots, among which none is chosen
MANY = 12  # lanes, as many as are seen at once; of more, those of a group are one line
CONTENDING = ("planned", "running", "draft")  # states of bars that need their robot
SPANS = (6, 8, 24, 168)  # hours to choose from
STEPS = {6: 1, 12: 1, 24: 3, 48: 4, 96: 12}  # hours between labelled ticks for this many visible hours; a day beyond

BARS = {
    **dict.fromkeys((State.COMPLETED, State.CANCELLED), "past"),
    State.FAILED: "failed",
    **dict.fromkeys((State.SKIPPED, State.MISSED), "skipped"),
    State.EXECUTING: "running",
    **dict.fromkeys((State.WAITING, State.SUBMITTING, State.QUEUED), "planned"),
}


@dataclass(frozen=True)
class TimelineView:
    """What the widget shows."""

    origin: datetime | None = None
    lanes: tuple[Lane, ...] = ()
    every: tuple[Lane, ...] = ()  # also of robots that are not chosen or in a line, and of groups without bars
    bands: tuple[Band, ...] = ()
    ticks: tuple[Tick, ...] = ()
    first: float = 0.0
    hours: float = HOURS
    now: float = 0.0
    now_label: str = ""
    robots: str = ""  # whose, in words, if there are many
    is_filtered: bool = False

    @property
    def span(self) -> str:
        """How much is seen at once, in words."""
        return span_text(self.hours)

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
    span = window.span(now, facts.zone, facts.calendar)
    read = Range(origin, *((instant - origin) / timedelta(hours=1) for instant in span))
    chosen, first = [robot for robot in facts.robots if robot.id in window.robots], read.at(left)
    made = _Lanes(facts, now, read, window.hours * THIN)
    groups, robots = [made.of_group(group) for group in facts.groups], [made.of_robot(robot) for robot in facts.robots]
    seen = {robot.id for robot in chosen or facts.robots}
    waiting = [
        lane
        for group, lane in zip(facts.groups, groups, strict=True)
        if lane.bars and not seen.isdisjoint(group.members)
    ]
    lanes = [lane for lane in robots if lane.key in seen]
    taken = ((bar.start, bar.end) for lane in (*waiting, *lanes) for bar in lane.bars)
    closed = tuple(axis.closed(facts, read, taken, window.unfolded))
    folds = [band for band in closed if band.kind == "folded"]
    if window.left is None:  # what moves with the time doesn't begin amid a fold
        first = next((fold.start for fold in folds if fold.start < first < fold.end), first)
    if not chosen:
        lanes = made.with_lines(lanes, window.opened, Range(origin, first, _right_edge(first, window.hours, folds)))
    return TimelineView(
        origin,
        lanes=(*waiting, *lanes),  # what has no robot is what people look for
        every=(*groups, *robots),
        bands=(*closed, *axis.held(facts, now, read)),
        robots=_robots_word(facts, chosen),
        is_filtered=bool(chosen),
        ticks=tuple(
            tick
            for tick in axis.ticks(facts.zone, read, next((n for most, n in STEPS.items() if window.hours <= most), 24))
            if not any(fold.start <= tick.hour < fold.end for fold in folds)
        ),
        first=first,
        hours=window.hours,
        now=read.at(now),
        now_label=formats.wall_time(now.astimezone(facts.zone)),
    )


def _right_edge(first: float, hours: float, folds: Iterable[Band]) -> float:
    """The end of this many hours from ``first``; a folded break takes hardly any."""
    end = first + hours
    for fold in folds:
        if fold.start < end and fold.end > first:
            end += fold.end - max(fold.start, first)
    return end


def _robots_word(facts: SchedulerFacts, chosen: Sequence[Robot]) -> str:
    if len(facts.robots) <= FEW:
        return ""
    if len(chosen) == 1:
        return chosen[0].name
    return robots_in_words(chosen) if chosen else _("All robots")


# ---------------------------------------------------------------------- lanes
class _Lanes:
    """What is planned for robots and groups and what they did, in the time that was read; bars shorter than ``thin`` hours and as close
    become one."""

    def __init__(self, facts: SchedulerFacts, now: datetime, read: Range, thin: float) -> None:
        self._facts, self._now, self._read, self._thin = facts, now, read, thin
        self._planned = defaultdict[Hashable, list[PlannedRun]](list)  # by the key of their lane, as the others
        self._past = defaultdict[Hashable, list[Execution]](list)
        self._contested = defaultdict[Hashable, list[Span]](list)
        conflicts = Contested(facts.conflicts)
        for run in facts.planned:
            self._planned[run.lane].append(run)
            if conflicts.of(run):
                self._contested[run.lane].append((read.at(run.begins), read.at(run.ends)))
        for row in facts.past:
            self._past[row.robot_id or ("group", row.group_id)].append(row)
        self._more = {
            schedule.id: (schedule.robot_id or ("group", schedule.group_id), read.at(facts.more[schedule.id]))
            for schedule in facts.schedules
            if schedule.id in facts.more
        }

    def of_robot(self, robot: Robot) -> Lane:
        facts = self._facts
        said = axis.held_until(_own_hold(facts, robot.id, self._now), facts, self._now)
        icon, tone = facts.icons.get(robot.id, ("", "neutral"))
        note = (said or silence_word(facts.silent.get(robot.id))) if robot.enabled else off_word(robot)
        return self._lane(robot.id, robot.name, note)._replace(icon=icon, tone=tone)

    def of_group(self, group: Group) -> Lane:
        """Starts without a robot of the group: now, in the past, or in the forecast."""
        key = "group", group.id
        note = _group_note(self._facts, group, self._planned[key])
        return self._lane(key, _("Any of {group}").format(group=group.name), note)

    def _lane(self, key: Hashable, name: str, note: str) -> Lane:
        facts, read = self._facts, self._read
        bars = [_past_bar(facts, row, self._now, read) for row in self._past[key]]
        bars += [_planned_bar(facts, run, read) for run in self._planned[key]]
        bars = sorted((bar for bar in bars if bar.end > read.low and bar.start < read.high), key=lambda bar: bar.start)
        own = _overlaps(bars) if isinstance(key, int) else ()  # those of a group may get different robots
        blocks = _merged(bars, self._thin, lambda hour: read.instant(hour).astimezone(facts.zone).date())
        begins = max(read.low, min((hour for lane, hour in self._more.values() if lane == key), default=read.high))
        more = Bar(("zoom", begins, SPANS[0]), begins, read.high, _("and more starts"))
        shown = (*blocks, more) if begins < read.high else tuple(blocks)
        return Lane(name, note, shown, axis.joined([*own, *self._contested[key]]), key)

    def with_lines(self, lanes: list[Lane], opened: Hashable, seen: Range) -> list[Lane]:
        """With many robots, those of a group are one line, and below it when it is open: the first one, until another is
        chosen."""
        if len(lanes) <= MANY:
            return lanes
        lines, single = list[Lane](), {lane.key: lane for lane in lanes}
        for group in self._facts.groups:
            members = [lane for number, lane in single.items() if number in group.members]
            if len(members) > 1:
                key, words = ("robots of", group.id), self._line(members, seen)
                is_open = opened == key or (opened is None and not lines)
                lines += [Lane(group.name, key=key, line=words, is_open=is_open), *(members if is_open else ())]
                single = {number: lane for number, lane in single.items() if lane not in members}
        return [*lines, *single.values()]

    def _line(self, lanes: Sequence[Lane], seen: Range) -> str:
        """Their robots, what is visible of them (future starts, problems), and their notes."""
        robots = {lane.key for lane in lanes}
        runs = [run.begins for robot in robots for run in self._planned[robot]]
        failed = [row.planned_at for robot in robots for row in self._past[robot] if row.state is State.FAILED]
        return of_groups.line(
            len(lanes),
            sum(seen.low <= seen.at(at) < seen.high for at in runs),
            any(lane in robots and hour < seen.high for lane, hour in self._more.values()),
            sum(seen.low <= seen.at(at) < seen.high for at in failed),
            sum(end > seen.low and start < seen.high for lane in lanes for start, end in lane.overlaps),
            sum(_own_hold(self._facts, robot, self._now) is not None for robot in robots),
            len(robots & self._facts.silent.keys()),
        )


def _own_hold(facts: SchedulerFacts, robot_id: Hashable, now: datetime) -> Hold | None:
    """That of this robot alone: one of all robots is a band."""
    return next((hold for hold in facts.holds if hold.robot_id == robot_id and hold.covers(hold.robot_id, now)), None)


def _group_note(facts: SchedulerFacts, group: Group, planned: Sequence[PlannedRun]) -> str:
    """Why its starts have no robot; bars themselves show holds and outcomes."""
    foreseeable = [run for run in planned if facts.hold_of(run) is None]
    if foreseeable:
        return _("none has the mission") if all(run.lacks_mission for run in foreseeable) else _("no robot expected")
    waits = any(row.state is State.WAITING and row.robot_id is None and row.group_id == group.id for row in facts.past)
    return _("Waits for a robot") if waits else ""


def _overlaps(bars: Iterable[Bar]) -> Iterator[Span]:
    """The future time that two bars share, compared by whole seconds: runs that touch don't overlap."""
    taken = -math.inf
    for start, end in sorted(
        (round(bar.start * 3600), round(bar.end * 3600)) for bar in bars if bar.state in CONTENDING
    ):
        if start < taken:
            yield start / 3600, min(taken, end) / 3600
        taken = max(taken, end)


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
    """Their mission, if it is one, and their number."""
    begins, ends, count = group[0].start, max(bar.end for bar in group), len(group)
    runs, names = ngettext("{n} run", "{n} runs", count).format(n=count), {bar.label for bar in group}
    labels = [*(f"{name} · {runs}" for name in names if name and len(names) == 1), runs, str(count)]
    return Bar(
        ("zoom", (begins + ends) / 2, ends - begins), begins, ends, labels[0], group[0].state, shorter=tuple(labels[1:])
    )


def _planned_bar(facts: SchedulerFacts, run: PlannedRun, read: Range) -> Bar:
    start, name = read.at(run.begins), facts.mission_names.start(run)
    return Bar(
        ("schedule", run.schedule.id, run.at),
        start,
        start + (run.usual_s or ASSUMED_S) / 3600,
        foreseen.label(run, name),
        "held" if facts.hold_of(run) is not None else "refused" if run.schedule.id in facts.refused else "planned",
        movable=run.begins == run.at,
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
    forecast: Forecast,
    name: str,
) -> TimelineView:
    """With the form's next starts dashed in the lane of its robot or group, which is first if it was not shown, and those
    of its schedule ``base`` as they were. What they overlap with is what the form warns of."""
    origin = view.origin
    if origin is None:
        return view
    if forecast.starts and all(lane.key != target for lane in view.lanes):
        view = replace(view, lanes=(*(lane for lane in view.every if lane.key == target), *view.lanes))
    length = (forecast.usual_s or ASSUMED_S) / 3600
    times = {start.instant: (start.instant - origin).total_seconds() / 3600 for start in forecast.starts}
    return _changed(
        view,
        lambda bar: base is not None and isinstance(bar.key, tuple) and bar.key[:2] == ("schedule", base),
        target,
        [Bar(("draft", hour), hour, hour + length, name, "draft") for hour in times.values()],
        [(hour, hour + length) for at, hour in times.items() if at in forecast.in_the_way],
    )


def with_moved(view: TimelineView, key: Hashable, hour: float) -> TimelineView:
    """With that bar dashed where it was dragged to, and as it was."""
    found = [(lane.key, bar) for lane in view.lanes for bar in lane.bars if bar.key == key]
    if not found:
        return view
    lane, bar = found[0]
    others = [other for each in view.lanes if each.key == lane for other in each.bars if other is not bar]
    moved = bar._replace(key=("draft", hour), start=hour, end=hour + bar.end - bar.start, state="draft", movable=False)
    return _changed(view, lambda other: other.key == key, lane, [moved], list(_overlaps([*others, moved])))


def _changed(
    view: TimelineView,
    was: Callable[[Bar], bool],
    target: Hashable,
    added: Sequence[Bar],
    overlaps: Sequence[Span],
) -> TimelineView:
    lanes = []
    for lane in view.lanes:
        bars = [bar._replace(state="was", label="", movable=False) if was(bar) else bar for bar in lane.bars]
        if lane.key == target:
            bars = sorted([*bars, *added], key=lambda bar: bar.start)
            lane = lane._replace(overlaps=axis.joined([*lane.overlaps, *overlaps]))
        lanes.append(lane._replace(bars=tuple(bars)))
    return replace(view, lanes=tuple(lanes))
