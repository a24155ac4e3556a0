"""The plan and the past as bars, lanes and ticks for the timeline. Pure; made where the facts are read, off the UI thread."""
from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from typing import NamedTuple
from zoneinfo import ZoneInfo

from app.domain.models import Execution, Reason, ReasonCode, Robot, State
from app.domain.reasons import sentence, waiting_sentence
from app.i18n import _, ngettext, pgettext
from app.screens.common import execution_appearance, formats
from app.screens.common.options import MenuItem
from app.screens.common.robot_appearance import off_word
from app.screens.scheduler.facts import HOURS, MARGIN, SchedulerFacts, Window, full_hour
from app.screens.scheduler.view import day_begins
from app.services.planning.overlaps import ASSUMED_S
from app.services.planning.plan import PlannedRun

SHORTEST = 1 / 60                        # hours: a bar of no length would be no bar
NEAR_NOW = 0.03                          # of what is seen, around the now-line, where ticks have no label
THIN = 1 / 250                           # of what is seen: bars this short and this close together become one
MERGED_FROM = 3                          # of them
CONTENDING = ("planned", "running")      # states of bars that need their robot
SPANS = (6, 12, 24, 48, 96, 168)         # hours to choose from
STEPS = {6: 1, 12: 1, 24: 2, 48: 4, 96: 12}     # hours between labelled ticks when so many are seen; a day beyond

BARS = {
    State.COMPLETED: "past", State.CANCELLED: "past", State.FAILED: "failed", State.SKIPPED: "skipped", State.MISSED: "skipped",
    State.EXECUTING: "running", State.WAITING: "planned", State.SUBMITTING: "planned", State.QUEUED: "planned",
}


# Hours are floats from the timeline's origin on. Named tuples, because kivy compares thousands of them whenever they are set.
class Bar(NamedTuple):
    """A run, or several that are too short to be distinguished. ``key`` is handed back when it is tapped."""
    key: Hashable
    start: float
    end: float
    label: str = ""
    state: str = "planned"               # past, failed, skipped, held, running or planned
    late: float | None = None            # when nine of ten runs have ended
    assumed: bool = False                # its length is not known
    typed: bool = False                  # its length was entered by a person


class Closed(NamedTuple):
    """A time when nothing is started."""
    start: float
    end: float
    text: str


class Tick(NamedTuple):
    """A line of the axis; a strong one begins a day."""
    hour: float
    label: str
    strong: bool


class Lane(NamedTuple):
    """A robot, its bars, and from when to when two of them want it."""
    name: str
    note: str = ""
    bars: tuple[Bar, ...] = ()
    overlaps: tuple[tuple[float, float], ...] = ()


class LegendEntry(NamedTuple):
    """What something that is drawn means."""
    kind: str
    text: str


@dataclass(frozen=True)
class TimelineView:
    """What the widget shows."""
    origin: datetime | None = None
    lanes: tuple[Lane, ...] = ()
    closed: tuple[Closed, ...] = ()
    ticks: tuple[Tick, ...] = ()
    first: float = 0.0
    hours: float = HOURS
    now: float = 0.0
    now_label: str = ""
    span: str = ""                       # in words
    legend: tuple[LegendEntry, ...] = ()


@dataclass(frozen=True)
class _Range:
    """The hours that are read: from ``low`` to ``high``."""
    origin: datetime
    low: float
    high: float

    def at(self, instant: datetime) -> float:
        return (instant - self.origin).total_seconds() / 3600

    def instant(self, hour: float) -> datetime:
        return self.origin + timedelta(hours=hour)


def span_text(hours: float) -> str:
    """How much is seen at once."""
    whole = round(hours)
    if whole < 48:
        return _("{n} h").format(n=whole)
    return ngettext("{n} day", "{n} days", round(hours / 24)).format(n=round(hours / 24))


def zoomed(window: Window, further: bool, now: datetime, zone: ZoneInfo) -> Window:
    """The next of SPANS around the same middle; a window that moves with the time still does."""
    wider = [span for span in SPANS if span > window.hours + 0.5]
    nearer = [span for span in SPANS if span < window.hours - 0.5]
    hours = (wider[0] if wider else SPANS[-1]) if further else (nearer[-1] if nearer else SPANS[0])
    if window.left is None:
        return Window(None, hours)
    return Window(window.start(now, zone) + timedelta(hours=(window.hours - hours) / 2), hours)


def moved(window: Window, screens: float, now: datetime, zone: ZoneInfo) -> Window:
    """Forward or back by that share of what is seen."""
    return Window(window.start(now, zone) + timedelta(hours=window.hours * screens), window.hours)


def timeline(facts: SchedulerFacts, now: datetime, window: Window | None = None, narrow: bool = False) -> TimelineView:
    """What the window shows and a margin on either side; ``narrow``: half as many labelled ticks."""
    window = window or Window()
    left = window.start(now, facts.zone)
    origin = full_hour(left, facts.zone)
    first = (left - origin).total_seconds() / 3600
    read = _Range(origin, first - window.hours * MARGIN, first + window.hours * (1 + MARGIN))
    step = next((hours for span, hours in STEPS.items() if window.hours <= span), 24) * (2 if narrow else 1)
    lanes = tuple(_lane(facts, robot, now, read, window.hours * THIN) for robot in facts.robots)
    closed = tuple(_closed(facts, read))
    return TimelineView(
        origin, lanes=lanes, closed=(*closed, *_held(facts, read)), legend=tuple(_legend(lanes, closed)),
        ticks=tuple(_ticks(facts.zone, read, read.at(now), step, window.hours)),
        first=first, hours=window.hours, now=read.at(now), now_label=formats.wall_time(now.astimezone(facts.zone)),
        span=span_text(window.hours))


def _legend(lanes: Sequence[Lane], closed: Sequence[Closed]) -> Iterable[LegendEntry]:
    """Of what is drawn, and of nothing else."""
    bars = [bar for lane in lanes for bar in lane.bars]
    drawn = {"typed" if bar.typed else "assumed" if bar.assumed else bar.state for bar in bars}
    drawn |= {"overlap"} if any(lane.overlaps for lane in lanes) else set()
    drawn |= {"closed"} if closed else set()
    words = {"planned": _("Planned"), "typed": _("Length typed"), "assumed": _("Length not known yet"), "running": _("Running"),
             "past": _("Ended"), "failed": pgettext("run", "Failed"), "skipped": _("Not run"), "held": _("Held"), "overlap": _("Overlap"),
             "closed": _("No work")}
    return (LegendEntry(kind, text) for kind, text in words.items() if kind in drawn)


# ---------------------------------------------------------------------- bars
def _lane(facts: SchedulerFacts, robot: Robot, now: datetime, read: _Range, thin: float) -> Lane:
    bars = [_past_bar(facts, execution, now, read) for execution in facts.past if execution.robot_id == robot.id]
    bars += [_planned_bar(facts, run, read) for run in facts.planned if run.robot.id == robot.id]
    bars = sorted((bar for bar in bars if bar.end > read.low and bar.start < read.high), key=lambda bar: bar.start)
    return Lane(robot.name, robot.model or "" if robot.enabled else off_word(robot),
                tuple(_merged(bars, thin, lambda hour: read.instant(hour).astimezone(facts.zone).date())), tuple(_overlaps(bars)))


def _overlaps(bars: list[Bar]) -> Iterable[tuple[float, float]]:
    """What two bars share of the time to come, compared by whole seconds: runs that touch don't overlap."""
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


def _merged(bars: list[Bar], thin: float, day: Callable[[float], date]) -> Iterable[Bar]:
    """Bars of a day too thin and too close to be distinguished become one, which a tap zooms into."""
    groups: list[list[Bar]] = []
    for bar in bars:
        last = groups[-1][-1] if groups else None
        if (last and bar.state == last.state and bar.start - last.end < thin and bar.end - bar.start < thin
                and last.end - last.start < thin and day(bar.start) == day(last.start)):
            groups[-1].append(bar)
        else:
            groups.append([bar])
    for group in groups:
        yield from group if len(group) < MERGED_FROM else [_block(group)]


def _block(group: list[Bar]) -> Bar:
    begins, ends = group[0].start, max(bar.end for bar in group)
    return Bar(("zoom", (begins + ends) / 2, ends - begins), begins, ends, ngettext("{n} run", "{n} runs", len(group)).format(n=len(group)),
               group[0].state)


def _planned_bar(facts: SchedulerFacts, run: PlannedRun, read: _Range) -> Bar:
    start, held = read.at(run.at), facts.hold(run.robot.id, run.at) is not None
    is_slow = run.usual_s is not None and not run.typed and run.slow_s is not None and run.slow_s > run.usual_s
    return Bar(("schedule", run.schedule.id, run.at), start, start + (run.usual_s or ASSUMED_S) / 3600,
               _("Held: {mission}").format(mission=run.mission.name) if held else run.mission.name, "held" if held else "planned",
               late=start + (run.slow_s or 0) / 3600 if is_slow else None, assumed=run.usual_s is None,
               typed=run.usual_s is not None and run.typed)


def _past_bar(facts: SchedulerFacts, execution: Execution, now: datetime, read: _Range) -> Bar:
    begins, ends = _span(facts, execution, now)
    state, label, start = BARS[execution.state], execution.mission if execution.state.is_open else "", read.at(begins)
    key, waits = (execution.robot_id or 0, execution.mission_guid), state == "planned"
    typed = waits and key in facts.typed
    assumed = waits and not typed and key not in facts.usual_s
    if execution.state is State.WAITING and facts.hold(execution.robot_id, now) is not None:
        state, label = "held", _("Held: {mission}").format(mission=execution.mission)
    return Bar(("execution", execution.id), start, max(read.at(ends), start + SHORTEST), label, state, typed=typed, assumed=assumed)


def _span(facts: SchedulerFacts, execution: Execution, now: datetime) -> tuple[datetime, datetime]:
    """From when to when an execution used its robot, or waited for it."""
    usual = timedelta(seconds=facts.usual_s.get((execution.robot_id or 0, execution.mission_guid), ASSUMED_S))
    if execution.state is State.EXECUTING:
        begins = execution.started_at or execution.submitted_at or execution.planned_at
        return begins, max(begins + usual, now)
    if execution.state.is_open:
        return now, now + usual
    ended = execution.ended_at or execution.planned_at
    if execution.state in (State.SKIPPED, State.MISSED):
        return execution.planned_at, min(ended, execution.closes_at)
    return execution.started_at or execution.submitted_at or execution.planned_at, ended


# ---------------------------------------------------------------------- the card of a bar
@dataclass(frozen=True)
class BarCard:
    """What a bar stands for, and what can be done with it."""
    title: str
    text: str
    items: tuple[MenuItem, ...]


def run_card(facts: SchedulerFacts, execution: Execution, now: datetime) -> BarCard:
    """Of a run that has begun, waits or has ended: what came of it and why."""
    begins, ends = _span(facts, execution, now)
    why = waiting_sentence(execution, facts.zone, _) if execution.state.is_open else \
        sentence(execution.reason, facts.zone, _) if execution.reason else execution_appearance.word(execution.state)
    items = [MenuItem("log", _("Open in Logs"), "text-box-outline")]
    if facts.schedule(execution.schedule_id) is not None:
        items.append(MenuItem("edit", _("Edit schedule"), "pencil-outline"))
    return BarCard(execution.mission, _lines(f"{execution.robot} · {_from_to(facts, begins, ends)}", why), tuple(items))


def start_card(facts: SchedulerFacts, run: PlannedRun) -> BarCard:
    """Of a planned start: how long it will take, as far as that is known, and what keeps it back."""
    hold, ends = facts.hold(run.robot.id, run.at), run.at + timedelta(seconds=run.usual_s or ASSUMED_S)
    usual, slow = formats.duration(run.usual_s), formats.duration(run.slow_s)
    if run.usual_s is None:
        length = _("Its length is not known yet: 5 min are assumed")
    elif run.typed or run.slow_s is None:
        length = _("Usually {usual}").format(usual=usual)
    else:
        length = _("Usually {usual}, nine of ten within {slow}").format(usual=usual, slow=slow)
    held = ""
    if hold is not None:
        held = _("Held until it is released") if hold.until is None else sentence(
            Reason(ReasonCode.HOLD, {"hold": hold.reason, "until": hold.until.isoformat()}), facts.zone, _)
    is_next = run.at == run.schedule.next_at
    items = (MenuItem("edit", _("Edit schedule"), "pencil-outline"),
             *([MenuItem("skip", _("Skip this one"), "skip-next")] if is_next else []), MenuItem("run", _("Run now"), "play"))
    return BarCard(run.mission.name, _lines(f"{run.robot.name} · {_from_to(facts, run.at, ends)}", length, held), items)


def _from_to(facts: SchedulerFacts, begins: datetime, ends: datetime) -> str:
    start, end = begins.astimezone(facts.zone), ends.astimezone(facts.zone)
    return f"{formats.wall_day(start.date())} {formats.wall_time(start)}–{formats.wall_time(end)}"


def _lines(*lines: str) -> str:
    return "\n".join(line for line in lines if line)


# ---------------------------------------------------------------------- closed time and axis
def _closed(facts: SchedulerFacts, read: _Range) -> Iterable[Closed]:
    zone = facts.zone
    first = read.instant(read.low).astimezone(zone).date()
    for n in range(int((read.high - read.low) / 24) + 3):
        day = first + timedelta(days=n)
        begins, ends = max(read.low, read.at(day_begins(day, zone))), min(read.high, read.at(day_begins(day + timedelta(days=1), zone)))
        status = facts.calendar.day_status(day)
        if begins < ends and not status.is_working:
            name = status.name or formats.current().weekdays[day.weekday()]
            yield Closed(begins, ends, _("{weekday}: not a working day").format(weekday=name[:1].upper() + name[1:]))


def _held(facts: SchedulerFacts, read: _Range) -> Iterable[Closed]:
    """As long as nothing is sent to any robot."""
    for hold in facts.holds:
        begins = max(read.low, read.at(hold.since)) if hold.since else read.low
        ends = min(read.high, read.at(hold.until)) if hold.until else read.high
        if hold.robot_id is None and begins < ends:
            yield Closed(begins, ends, "")           # the bars in it say it, and the banner says why


def _ticks(zone: ZoneInfo, read: _Range, now: float, step: int, seen: float) -> Iterable[Tick]:
    """A tick every ``step`` local hours, strong at midnight, and one where the clock is changed."""
    begins = int(read.low) - 1
    before = read.instant(begins).astimezone(zone).utcoffset()
    for n in range(begins + 1, int(read.high) + 1):
        local = read.instant(n).astimezone(zone)
        if local.utcoffset() != before:
            before = local.utcoffset()
            yield Tick(n, _("Clock change"), True)
        elif local.hour == 0:
            yield Tick(n, formats.wall_day(local.date()), True)
        elif step < 24 and local.hour % step == 0:
            yield Tick(n, "" if abs(n - now) < seen * NEAR_NOW else formats.wall_time(local), False)
