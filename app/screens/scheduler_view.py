"""The Scheduler in words and bars: the timeline, the list of days, the list of schedules. Pure; the form is scheduler_form_view."""
from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from itertools import groupby
from typing import Any
from zoneinfo import ZoneInfo

from app.i18n import _, ngettext
from app.models import Execution, Robot, Schedule, State
from app.screens import formats, logs_looks
from app.screens.scheduler_facts import DAYS, HOURS, SchedulerFacts, window_start
from app.screens.scheduler_words import rule_line
from app.services.plan import PlannedRun

Row = dict[str, Any]

ASSUMED_S = 300.0                        # length of a bar whose mission was never seen to its end
SHORTEST = 1 / 60                        # hours: a bar of no length would be no bar
GROUPED_FROM = 4                         # starts of one schedule on one day become one line
NEAR_NOW = 0.7                           # hours around the now-line without a tick's label

BARS = {
    State.COMPLETED: "past", State.CANCELLED: "past", State.FAILED: "failed", State.SKIPPED: "skipped", State.MISSED: "skipped",
    State.EXECUTING: "running", State.WAITING: "planned", State.SUBMITTING: "planned", State.QUEUED: "planned",
}


@dataclass(frozen=True)
class TimelineView:
    """Hours are floats from the left edge."""
    lanes: tuple[Row, ...] = ()
    closed: tuple[tuple[float, float, str], ...] = ()
    ticks: tuple[tuple[float, str, bool], ...] = ()
    now: float = 0.0
    now_label: str = ""
    hours: float = HOURS


# ---------------------------------------------------------------------- the timeline
def timeline(facts: SchedulerFacts, now: datetime, step: int = 2) -> TimelineView:
    """From a full hour a little ago on; ``step`` hours between labelled ticks."""
    start = window_start(now, facts.zone)
    at = _scale(start)
    return TimelineView(
        lanes=tuple(_lane(facts, robot, now, at) for robot in facts.robots), closed=tuple(_closed(facts, start)),
        ticks=tuple(_ticks(start, facts.zone, at(now), step)), now=at(now), now_label=formats.wall_time(now.astimezone(facts.zone)))


def _scale(start: datetime) -> Callable[[datetime], float]:
    return lambda instant: (instant - start).total_seconds() / 3600


def _lane(facts: SchedulerFacts, robot: Robot, now: datetime, at: Callable[[datetime], float]) -> Row:
    bars = [_past_bar(facts, execution, now, at) for execution in facts.past if execution.robot_id == robot.id]
    bars += [_planned_bar(run, at) for run in facts.planned if run.robot.id == robot.id]
    note = robot.model or "" if robot.enabled else _("switched off")
    return {"name": robot.name, "note": note, "bars": [bar for bar in bars if bar["end"] > 0 and bar["start"] < HOURS]}


def _planned_bar(run: PlannedRun, at: Callable[[datetime], float]) -> Row:
    start = at(run.at)
    return {"key": ("schedule", run.schedule.id), "start": start, "end": start + (run.usual_s or ASSUMED_S) / 3600,
            "label": run.mission.name, "state": "planned"}


def _past_bar(facts: SchedulerFacts, execution: Execution, now: datetime, at: Callable[[datetime], float]) -> Row:
    begins, ends = _span(facts, execution, now)
    state = BARS[execution.state]
    start = at(begins)
    return {"key": ("execution", execution.id), "start": start, "end": max(at(ends), start + SHORTEST),
            "label": execution.mission if execution.state.is_open else "", "state": state}


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


def _closed(facts: SchedulerFacts, start: datetime) -> Iterable[tuple[float, float, str]]:
    zone, at = facts.zone, _scale(start)
    words = formats.current()
    first = start.astimezone(zone).date()
    for n in range(HOURS // 24 + 2):
        day = first + timedelta(days=n)
        begins, ends = max(0.0, at(_midnight(day, zone))), min(float(HOURS), at(_midnight(day + timedelta(days=1), zone)))
        if begins < ends and not facts.settings.is_working_day(day):
            name = words.weekdays[day.weekday()]
            yield begins, ends, _("{weekday}: not a working day").format(weekday=name[:1].upper() + name[1:])


def _ticks(start: datetime, zone: ZoneInfo, now: float, step: int) -> Iterable[tuple[float, str, bool]]:
    """A tick every ``step`` local hours, strong at midnight, and one where the clock is changed."""
    before = start.astimezone(zone).utcoffset()
    for n in range(1, HOURS):
        local = (start + timedelta(hours=n)).astimezone(zone)
        if local.utcoffset() != before:
            before = local.utcoffset()
            yield float(n), _("Clock change"), True
        elif local.hour == 0:
            yield float(n), formats.wall_day(local.date()), True
        elif local.hour % step == 0:
            yield float(n), "" if abs(n - now) < NEAR_NOW else formats.wall_time(local), False


def _midnight(day: date, zone: ZoneInfo) -> datetime:
    return datetime.combine(day, time(), zone).astimezone(UTC)


# ---------------------------------------------------------------------- the days to come
def days(facts: SchedulerFacts, now: datetime) -> list[Row]:
    """The plan as a list: a heading for each of the days, below it its starts; many of one schedule are one line."""
    zone = facts.zone
    today = now.astimezone(zone).date()
    by_day: dict[date, list[PlannedRun]] = {today + timedelta(days=n): [] for n in range(DAYS)}
    for run in facts.planned:
        by_day.setdefault(run.at.astimezone(zone).date(), []).append(run)
    rows: list[Row] = []
    for day, runs in sorted(by_day.items()):
        rows.append(_day_heading(facts, day, today, len(runs)))
        rows += (row for _at, row in sorted(_day_rows(runs, now, zone), key=lambda entry: entry[0]))
    return rows


def _day_heading(facts: SchedulerFacts, day: date, today: date, count: int) -> Row:
    names = {0: _("Today"), 1: _("Tomorrow")}
    dated = formats.wall_day(day)
    near = names.get((day - today).days)
    notes = [ngettext("{n} start", "{n} starts", count).format(n=count) if count else _("nothing planned")]
    if not facts.settings.is_working_day(day):
        notes.append(_("not a working day"))
    return {"key": ("day", day.isoformat()), "heading": f"{near}, {dated}" if near else dated, "note": " · ".join(notes)}


def _day_rows(runs: list[PlannedRun], now: datetime, zone: ZoneInfo) -> Iterable[tuple[datetime, Row]]:
    """Lines with the instant by which they are ordered."""
    by_schedule = sorted(runs, key=lambda run: (run.schedule.id, run.at))
    for _id, group in groupby(by_schedule, key=lambda run: run.schedule.id):
        same = list(group)
        first = same[0]
        common = {"mission": first.mission.name, "heading": "", "robot": first.robot.name}
        if len(same) >= GROUPED_FROM:
            begins, ends = (formats.wall_time(run.at.astimezone(zone)) for run in (first, same[-1]))
            yield first.at, {
                **common, "key": ("schedule", first.schedule.id, first.at), "time": begins,
                "note": ngettext("{n} start until {time}", "{n} starts until {time}", len(same)).format(n=len(same), time=ends)}
            continue
        for run in same:
            yield run.at, {**common, "key": ("schedule", run.schedule.id, run.at), "time": formats.wall_time(run.at.astimezone(zone)),
                           "note": formats.ahead((run.at - now).total_seconds())}


# ---------------------------------------------------------------------- the schedules
def schedule_rows(facts: SchedulerFacts, now: datetime, selected: int | None = None) -> list[Row]:
    """In the order in which they come next; those that are off or over stand last, by name."""
    never = datetime.max.replace(tzinfo=UTC)
    in_order = sorted(facts.schedules, key=lambda s: (not s.enabled, s.next_at or never, s.name.casefold()))
    return [_schedule_row(facts, schedule, now, schedule.id == selected) for schedule in in_order]


def _schedule_row(facts: SchedulerFacts, schedule: Schedule, now: datetime, selected: bool) -> Row:
    robot, mission, last = facts.robot(schedule.robot_id), facts.mission(schedule.mission_id), facts.last.get(schedule.id)
    row = {"key": schedule.id, "on": schedule.enabled, "mission": mission.name if mission else schedule.name,
           "rule": rule_line(schedule),
           "next": " · ".join(filter(None, (robot.name if robot else "", _next(facts, schedule, robot, now)))), "selected": selected,
           "icon": "", "tone": "neutral", "last": ""}
    if last is not None:
        look = logs_looks.look(last)
        row |= {"icon": look["icon"], "tone": look["tone"], "last": look["outcome"]}
    return row


def _next(facts: SchedulerFacts, schedule: Schedule, robot: Robot | None, now: datetime) -> str:
    if not schedule.enabled:
        return _("switched off")
    if schedule.next_at is None:
        return _("no start left")
    if robot is not None and not robot.enabled:
        return _("the robot is switched off")
    if schedule.paused_until is not None and schedule.paused_until > now:
        return _("paused until {time}").format(time=formats.day_and_time(schedule.paused_until, facts.settings.timezone, now))
    return formats.until(schedule.next_at, now, facts.settings.timezone)


def schedules_note(facts: SchedulerFacts) -> str:
    """How many are on."""
    return _("{on} of {all} on").format(on=sum(schedule.enabled for schedule in facts.schedules), all=len(facts.schedules)) \
        if facts.schedules else ""
