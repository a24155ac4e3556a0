"""A robot's activity, in the few kinds that utilisation counts, and the time spans of each; whether it can take a start."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import date, datetime, timedelta
from itertools import zip_longest
from operator import itemgetter
from typing import NamedTuple
from zoneinfo import ZoneInfo

from app.domain.choice import LEAVES_ROBOT_FREE
from app.domain.clock import DAY, midnight
from app.domain.execution import Execution, State, Trigger
from app.domain.robot import QueueItem, RobotState, RobotStatus

ACTIVITIES = ("executing", "charging", "idle", "paused", "error", "offline")
_CAN_WORK = frozenset(
    {
        RobotState.READY,
        RobotState.EXECUTING,
        *(RobotState.ABORTED, RobotState.COMPLETED, RobotState.DOCKED, RobotState.DOCKING),  # for moments after a run
    }
)
NO_DATA = "no_data"  # the robot was not polled: worked out when reading, never stored
CLOCK_STEP_S = 5.0  # the wall clock differs from the monotonic one by more: it was set, or the tablet slept


class ActivitySpan(NamedTuple):
    """One of ``ACTIVITIES``, or NO_DATA, over [start, end)."""

    activity: str
    start: datetime
    end: datetime

    @property
    def seconds(self) -> float:
        return (self.end - self.start).total_seconds()


def activity_of(status: RobotStatus) -> str:
    """One of ``ACTIVITIES``. A robot charges when its state is Docked or its mission text says so."""
    if status.state is RobotState.DOCKED or status.mission_text.startswith("Charging"):
        return "charging"
    match status.state:
        case RobotState.EXECUTING | RobotState.DOCKING:
            return "executing"
        case RobotState.PAUSE | RobotState.MANUAL_CONTROL:
            return "paused"
        case RobotState.ERROR | RobotState.EMERGENCY_STOP:
            return "error"
    return "idle"


def can_work(status: RobotStatus) -> bool:
    """It has no error, is not paused, stopped, driven by hand or mapping."""
    return status.state in _CAN_WORK and not status.errors


def is_charging(status: RobotStatus | None) -> bool:
    """With a mission that ends by itself when something comes."""
    return status is not None and activity_of(status) == "charging"


def at_work(rows: Iterable[Execution], status: RobotStatus | None) -> list[Execution]:
    """A robot's open starts that block others."""
    return [row for row in rows if is_at_work(row, is_charging(status))]


def is_at_work(row: Execution, charges: bool) -> bool:
    """Not a robot's idle mission while it charges, and not a start that waits for something other than the robot."""
    waits_for_another = row.state is State.WAITING and row.wait in LEAVES_ROBOT_FREE
    return not waits_for_another and not (row.trigger is Trigger.IDLE and charges)


def is_free(status: RobotStatus | None, queue: Sequence[QueueItem], rows: Iterable[Execution]) -> bool:
    """Ready, or charging, with an empty queue: between two missions it is ready for a moment. ``rows``: its open
    executions, except the one to be sent."""
    if status is None or not (status.state is RobotState.READY or is_charging(status)) or not can_work(status):
        return False
    return not at_work(rows, status) and not any(item.is_pending for item in queue)


class SpanRecorder:
    """Turns polls of one robot into spans. The time since the last poll counts as the present activity; long gaps and
    changes of the wall clock leave a hole."""

    def __init__(self) -> None:
        self._span: ActivitySpan | None = None
        self._mono = 0.0
        self._done: list[ActivitySpan] = []
        self.has_changed = False  # since ``take``: something else is being done

    def saw(self, activity: str, now: datetime, mono: float, longest_gap: float) -> None:
        """``mono`` and ``longest_gap`` in monotonic seconds."""
        span, passed = self._span, mono - self._mono
        is_whole = span is not None and abs((now - span.end).total_seconds() - passed) <= CLOCK_STEP_S
        begins = span.end if span is not None and is_whole and 0 <= passed <= longest_gap else None
        self._mono = mono
        if span is not None and begins is not None and span.activity == activity:
            self._span = span._replace(end=max(now, begins))
            return
        if span is not None and span.end > span.start:
            self._done.append(span)
        self._span = ActivitySpan(activity, begins or now, max(now, begins or now))
        self.has_changed = True

    def take(self) -> Sequence[ActivitySpan]:
        """Spans to store: those that ended since the last call, and the present one, which will be extended."""
        spans = [*self._done, *([self._span] if self._span is not None and self._span.end > self._span.start else [])]
        self._done, self.has_changed = [], False
        return spans


# ---------------------------------------------------------------------- reading them
def without_gaps(stored: Sequence[ActivitySpan], start: datetime, end: datetime) -> list[ActivitySpan]:
    """[start, end) without gaps: NO_DATA where nothing was seen, neighbours of the same kind joined. If spans overlap
    (the clock had been set back), the later one counts.
    """
    found: list[ActivitySpan] = []
    for span in _one_at_a_time(stored, start, end):
        _append(found, ActivitySpan(NO_DATA, found[-1].end if found else start, span.start))
        _append(found, span)
    _append(found, ActivitySpan(NO_DATA, found[-1].end if found else start, end))
    return found


def _append(found: list[ActivitySpan], span: ActivitySpan) -> None:
    """Empty ones are omitted, successive ones of the same kind joined."""
    if found and found[-1].activity == span.activity:
        found[-1] = found[-1]._replace(end=span.end)
    elif span.end > span.start:
        found.append(span)


def _one_at_a_time(stored: Sequence[ActivitySpan], start: datetime, end: datetime) -> Iterator[ActivitySpan]:
    """The parts of these spans in [start, end), in order, each cut where the next begins."""
    ordered = sorted(stored, key=itemgetter(1))
    for span, following in zip_longest(ordered, ordered[1:]):
        since, until = max(span.start, start), min(span.end, end)
        if following is not None and following.start < until:
            until = following.start
        if since < until:
            yield ActivitySpan(span.activity, since, until)


def seconds_by_day(
    stored: Sequence[ActivitySpan], start: datetime, end: datetime, zone: ZoneInfo
) -> dict[date, dict[str, float]]:
    """How long each activity was seen in [start, end), by local day; days and activities without any are omitted."""
    found: dict[date, dict[str, float]] = {}
    day, day_ends = date.min, start
    for activity, at, until in _one_at_a_time(stored, start, end):
        while at < until:
            if at >= day_ends:
                day = at.astimezone(zone).date()
                day_ends = midnight(day + DAY, zone)
                found.setdefault(day, {})
            part = min(until, day_ends)
            found[day][activity] = found[day].get(activity, 0.0) + (part - at).total_seconds()
            at = part
    return found


def seen_seconds(by_activity: Mapping[str, float]) -> float:
    """Of these, for how long the robot was seen and answered."""
    return sum(seconds for activity, seconds in by_activity.items() if activity not in (NO_DATA, "offline"))


def as_drawn(spans: Sequence[ActivitySpan], columns: int) -> list[ActivitySpan]:
    """Spans that follow each other without gaps, thinned out for a band with this many columns: each has its longest
    activity, or "error" if there was any, as short errors must stay visible."""
    if not spans or len(spans) <= columns:
        return list(spans)
    start, width = spans[0].start, (spans[-1].end - spans[0].start) / columns
    found: list[ActivitySpan] = []
    first = 0
    for column in range(columns):
        left, right = start + width * column, spans[-1].end if column == columns - 1 else start + width * (column + 1)
        while spans[first].end <= left:
            first += 1
        shares: dict[str, timedelta] = {}
        for number in range(first, len(spans)):  # not a slice: copying the rest for each column took most of the time
            span = spans[number]
            if span.start >= right:
                break
            shares[span.activity] = (
                shares.get(span.activity, timedelta()) + min(span.end, right) - max(span.start, left)
            )
        activity = "error" if "error" in shares else max(shares, key=lambda name: shares[name])
        _append(found, ActivitySpan(activity, left, right))
    return found
