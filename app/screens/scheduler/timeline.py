"""The plan and the past as bars, lanes and ticks for the timeline. Pure; made where the facts are read, off the UI thread."""
from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import pairwise
from typing import Any
from zoneinfo import ZoneInfo

from app.domain.models import Execution, Robot, State
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.scheduler.facts import HOURS, MARGIN, SchedulerFacts, Window
from app.screens.scheduler.view import day_begins
from app.services.planning.overlaps import ASSUMED_S
from app.services.planning.plan import PlannedRun

Row = dict[str, Any]

SHORTEST = 1 / 60                        # hours: a bar of no length would be no bar
NEAR_NOW = 0.03                          # of what is seen, around the now-line, without a tick's label
THIN = 1 / 250                           # of what is seen: bars this short and this close together become one
MERGED_FROM = 3                          # of them
SPANS = (6, 12, 24, 48, 96, 168)         # hours to choose from
STEPS = {6: 1, 12: 1, 24: 2, 48: 4, 96: 12}     # hours between labelled ticks when so many are seen; a day beyond

BARS = {
    State.COMPLETED: "past", State.CANCELLED: "past", State.FAILED: "failed", State.SKIPPED: "skipped", State.MISSED: "skipped",
    State.EXECUTING: "running", State.WAITING: "planned", State.SUBMITTING: "planned", State.QUEUED: "planned",
}


@dataclass(frozen=True)
class TimelineView:
    """Hours are floats from ``origin`` on."""
    origin: datetime | None = None
    lanes: tuple[Row, ...] = ()
    closed: tuple[tuple[float, float, str], ...] = ()
    ticks: tuple[tuple[float, str, bool], ...] = ()
    first: float = 0.0
    hours: float = HOURS
    now: float = 0.0
    now_label: str = ""
    span: str = ""                       # in words


def span_words(hours: float) -> str:
    """How much is seen at once."""
    whole = round(hours)
    if whole < 48:
        return _("{n} h").format(n=whole)
    return ngettext("{n} day", "{n} days", round(hours / 24)).format(n=round(hours / 24))


def zoomed(window: Window, further: bool, now: datetime, zone: ZoneInfo) -> Window:
    """The next span of the row, around the same middle; one that goes with the time goes on doing so."""
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
    origin = _full_hour(left, facts.zone)
    at = _scale(origin)
    first = at(left)
    reach = (first - window.hours * MARGIN, first + window.hours * (1 + MARGIN))
    step = next((hours for span, hours in STEPS.items() if window.hours <= span), 24) * (2 if narrow else 1)
    return TimelineView(
        origin, lanes=tuple(_lane(facts, robot, now, at, reach, window.hours * THIN) for robot in facts.robots),
        closed=(*_closed(facts, origin, reach), *_held(facts, at, reach)),
        ticks=tuple(_ticks(origin, facts.zone, reach, at(now), step, window.hours)), first=first, hours=window.hours, now=at(now),
        now_label=formats.wall_time(now.astimezone(facts.zone)), span=span_words(window.hours))


def _full_hour(instant: datetime, zone: ZoneInfo) -> datetime:
    local = instant.astimezone(zone)
    return instant - timedelta(minutes=local.minute, seconds=local.second, microseconds=local.microsecond)


def _scale(origin: datetime) -> Callable[[datetime], float]:
    return lambda instant: (instant - origin).total_seconds() / 3600


# ---------------------------------------------------------------------- bars
def _lane(facts: SchedulerFacts, robot: Robot, now: datetime, at: Callable[[datetime], float], reach: tuple[float, float],
          thin: float) -> Row:
    bars = [_past_bar(facts, execution, now, at) for execution in facts.past if execution.robot_id == robot.id]
    bars += [_planned_bar(facts, run, at) for run in facts.planned if run.robot.id == robot.id]
    bars = sorted((bar for bar in bars if bar["end"] > reach[0] and bar["start"] < reach[1]), key=lambda bar: bar["start"])
    return {"name": robot.name, "note": robot.model or "" if robot.enabled else _("switched off"), "bars": _together(bars, thin)}


def _together(bars: list[Row], thin: float) -> list[Row]:
    """Bars too thin and too close to be told apart become one, which a tap zooms into."""
    groups: list[list[Row]] = []
    for bar in bars:
        last = groups[-1][-1] if groups else None
        if (last and bar["state"] == last["state"] and bar["start"] - last["end"] < thin
                and bar["end"] - bar["start"] < thin and last["end"] - last["start"] < thin):
            groups[-1].append(bar)
        else:
            groups.append([bar])
    told: list[Row] = []
    for group in groups:
        told += group if len(group) < MERGED_FROM else [_block(group)]
    return told


def _block(group: list[Row]) -> Row:
    label = ngettext("{n} run", "{n} runs", len(group)).format(n=len(group))
    begins, ends = group[0]["start"], max(bar["end"] for bar in group)
    return {"key": ("zoom", (begins + ends) / 2, ends - begins), "start": begins, "end": ends, "label": label, "state": group[0]["state"],
            "overlaps": any(bar["start"] < before["end"] for before, bar in pairwise(group))}


def _planned_bar(facts: SchedulerFacts, run: PlannedRun, at: Callable[[datetime], float]) -> Row:
    start, held = at(run.at), facts.hold(run.robot.id, run.at) is not None
    bar = {"key": ("schedule", run.schedule.id), "start": start, "end": start + (run.usual_s or ASSUMED_S) / 3600,
           "label": _("Held: {mission}").format(mission=run.mission.name) if held else run.mission.name,
           "state": "skipped" if held else "planned"}
    if run.usual_s is None:
        bar["assumed"] = True
    elif run.typed:
        bar["typed"] = True
    elif run.slow_s is not None and run.slow_s > run.usual_s:
        bar["late"] = start + run.slow_s / 3600
    return bar


def _past_bar(facts: SchedulerFacts, execution: Execution, now: datetime, at: Callable[[datetime], float]) -> Row:
    begins, ends = _span(facts, execution, now)
    state, label = BARS[execution.state], execution.mission if execution.state.is_open else ""
    start = at(begins)
    unsure = _unsure(facts, execution) if state == "planned" else {}
    if execution.state is State.WAITING and facts.hold(execution.robot_id, now) is not None:
        state, label = "skipped", _("Held: {mission}").format(mission=execution.mission)
    return {"key": ("execution", execution.id), "start": start, "end": max(at(ends), start + SHORTEST), "label": label, "state": state,
            **unsure}


def _unsure(facts: SchedulerFacts, execution: Execution) -> Row:
    """How its length is known, where no run has shown it."""
    key = execution.robot_id or 0, execution.mission_guid
    return {"typed": True} if key in facts.typed else {} if key in facts.usual_s else {"assumed": True}


def _span(facts: SchedulerFacts, execution: Execution, now: datetime) -> tuple[datetime, datetime]:
    """From when to when an execution took its robot's time, or stood waiting for it."""
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


# ---------------------------------------------------------------------- ground
def _closed(facts: SchedulerFacts, origin: datetime, reach: tuple[float, float]) -> Iterable[tuple[float, float, str]]:
    zone, at, words = facts.zone, _scale(origin), formats.current()
    first = (origin + timedelta(hours=reach[0])).astimezone(zone).date()
    for n in range(int((reach[1] - reach[0]) / 24) + 3):
        day = first + timedelta(days=n)
        begins, ends = max(reach[0], at(day_begins(day, zone))), min(reach[1], at(day_begins(day + timedelta(days=1), zone)))
        look = facts.calendar.day_status(day)
        if begins < ends and not look.is_working:
            name = look.name or words.weekdays[day.weekday()]
            yield begins, ends, _("{weekday}: not a working day").format(weekday=name[:1].upper() + name[1:])


def _held(facts: SchedulerFacts, at: Callable[[datetime], float], reach: tuple[float, float]) -> Iterable[tuple[float, float, str]]:
    """As long as nothing is sent to any robot."""
    for hold in facts.holds:
        begins = max(reach[0], at(hold.since)) if hold.since else reach[0]
        ends = min(reach[1], at(hold.until)) if hold.until else reach[1]
        if hold.robot_id is None and begins < ends:
            yield begins, ends, ""                   # the bars in it say it, and the banner says why


def _ticks(origin: datetime, zone: ZoneInfo, reach: tuple[float, float], now: float, step: int,
           seen: float) -> Iterable[tuple[float, str, bool]]:
    """A tick every ``step`` local hours, strong at midnight, and one where the clock is changed."""
    begins = int(reach[0]) - 1
    before = (origin + timedelta(hours=begins)).astimezone(zone).utcoffset()
    for n in range(begins + 1, int(reach[1]) + 1):
        local = (origin + timedelta(hours=n)).astimezone(zone)
        if local.utcoffset() != before:
            before = local.utcoffset()
            yield float(n), _("Clock change"), True
        elif local.hour == 0:
            yield float(n), formats.wall_day(local.date()), True
        elif step < 24 and local.hour % step == 0:
            yield float(n), "" if abs(n - now) < seen * NEAR_NOW else formats.wall_time(local), False
