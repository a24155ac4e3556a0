"""What the robots did over the period: read on a background thread, and in words for the bands. The words are pure."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, time, timedelta
from typing import TYPE_CHECKING, Any
from zoneinfo import ZoneInfo

from app.domain.activity import NO_DATA, ActivitySpan, as_drawn
from app.i18n import _
from app.screens.common import formats
from app.screens.logs.view import Chosen, period_start
from app.services.history.robot_states import RobotStates, RobotTimeline

if TYPE_CHECKING:
    from app.container import Container

Row = dict[str, Any]
Tick = tuple[float, str, bool]          # place 0..1, label, whether it is strong

LONGEST = timedelta(days=90)         # spans are kept for that long
COLUMNS = 600                        # of a band; finer can't be seen
HOUR = 3600.0


@dataclass(frozen=True)
class StatesFacts:
    start: datetime
    end: datetime
    timelines: Sequence[RobotTimeline]

    def place(self, instant: datetime) -> float:
        """0..1 of the period."""
        return (instant - self.start) / (self.end - self.start)

    def moment(self, place: float) -> datetime:
        return min(self.start + (self.end - self.start) * place, self.end - timedelta(microseconds=1))


def read(container: Container, chosen: Chosen, now: datetime, zone: ZoneInfo) -> StatesFacts:
    """Called off the UI thread."""
    start = period_start(chosen.period, now, zone) or period_start_of(now - LONGEST, zone)
    if start >= now:                     # at midnight sharp
        start = now - timedelta(minutes=1)
    robots = None if chosen.robot_id is None else (chosen.robot_id,)
    return StatesFacts(start, now, RobotStates(container.db).timelines(start, now, robots))


def period_start_of(instant: datetime, zone: ZoneInfo) -> datetime:
    """The local midnight before it."""
    return datetime.combine(instant.astimezone(zone).date(), time(), zone)


# ---------------------------------------------------------------------- in words
def word(activity: str) -> str:
    return {"executing": _("On a mission"), "charging": _("Charging"), "idle": _("Idle"), "paused": _("Paused"), "error": _("Error"),
            "offline": _("Offline"), NO_DATA: _("No data")}[activity]


def legend() -> list[tuple[str, str]]:
    return [(kind, word(kind)) for kind in ("executing", "charging", "idle", "paused", "error", "offline", NO_DATA)]


def lanes(facts: StatesFacts) -> list[Row]:
    return [{"key": one.robot_id, "name": one.robot, "note": _share_on_missions(one),
             "spans": [(facts.place(span.start), facts.place(span.end), span.activity) for span in as_drawn(one.spans, COLUMNS)]}
            for one in facts.timelines]


def _share_on_missions(one: RobotTimeline) -> str:
    """Of the time for which it was seen and could be reached."""
    seconds = one.seconds
    seen = sum(value for activity, value in seconds.items() if activity not in (NO_DATA, "offline"))
    if not seen:
        return _("never seen")
    return _("seen on missions {share}").format(share=formats.percent(seconds.get("executing", 0.0) / seen * 100))


def ticks(facts: StatesFacts, zone: ZoneInfo) -> list[Tick]:
    """Hours of one day, days of more."""
    length = facts.end - facts.start
    if length <= timedelta(hours=26):
        return list(_hours(facts, zone))
    return list(_days(facts, zone))


def _hours(facts: StatesFacts, zone: ZoneInfo) -> Iterator[Tick]:
    step = next(step for step in (1, 2, 3, 6, 24) if (facts.end - facts.start).total_seconds() / HOUR / step <= 12)
    at = facts.start.astimezone(zone).replace(minute=0, second=0, microsecond=0)
    for number in range(27):
        instant = at + timedelta(hours=number)
        if facts.start <= instant < facts.end and instant.hour % step == 0:
            yield facts.place(instant), formats.wall_time(instant), instant.hour == 0


def _days(facts: StatesFacts, zone: ZoneInfo) -> Iterator[Tick]:
    day, last = facts.start.astimezone(zone).date(), facts.end.astimezone(zone).date()
    names = (last - day).days < 14
    while day <= last:
        instant = datetime.combine(day, time(), zone)
        if facts.start <= instant < facts.end:
            label = formats.wall_day(day)
            yield facts.place(instant), label if names else label.partition(" ")[2], day.weekday() == 0
        day += timedelta(days=1)


def span_at(facts: StatesFacts, robot_id: int, place: float) -> tuple[RobotTimeline, ActivitySpan] | None:
    """What a tap there means."""
    one = next((timeline for timeline in facts.timelines if timeline.robot_id == robot_id), None)
    span = one.at(facts.moment(place)) if one else None
    return (one, span) if one and span else None


def story(one: RobotTimeline, span: ActivitySpan, now: datetime, zone: str) -> tuple[str, str, list[Row]]:
    """Title, what, and from when to when."""
    texts = {
        "executing": _("The robot was on a mission."), "charging": _("The robot was charging."), "idle": _("The robot was ready and idle."),
        "paused": _("The robot was paused or driven by hand."), "error": _("The robot reported an error or an emergency stop."),
        "offline": _("The robot did not answer."),
        NO_DATA: _("Nobody looked: the app was off or asleep, or this robot was switched off in Settings.")}
    ends = formats.day_and_time(span.end, zone, now) if span.end < now else _("still so")
    return _("{robot}: {what}").format(robot=one.robot, what=word(span.activity)), texts[span.activity], [
        {"label": _("From"), "value": formats.day_and_time(span.start, zone, now)}, {"label": _("To"), "value": ends},
        {"label": _("For"), "value": formats.duration(span.seconds)}]


def explanation(facts: StatesFacts | None) -> tuple[str, str, list[Row]]:
    """What the bands mean, and how long each activity took, robot by robot."""
    rows = []
    for one in facts.timelines if facts else ():
        seconds = one.seconds
        parts = [f"{word(kind)} {formats.rough_duration(seconds[kind])}" for kind, _word in legend() if kind in seconds]
        rows.append({"label": one.robot, "value": "", "note": " · ".join(parts)})
    return _("What the robots did"), _(
        "Written down at every poll. The time since the last look belongs to what is seen now; gaps of more than three polls have no data. "
        "Kept for 90 days. Where much lies close together, a band shows what took most of the time, and every error."), rows
