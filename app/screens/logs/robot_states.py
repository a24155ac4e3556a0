"""What the robots did over the period: read on a background thread, and in words for the bands. The words are pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

from app.database.activities import KEPT_FOR
from app.domain.activity import NO_DATA, ActivitySpan, as_drawn
from app.domain.clock import days_between, midnight
from app.i18n import _
from app.screens.common import formats
from app.screens.common.name_order import by_name
from app.screens.logs.facts import LogsServices
from app.screens.logs.kpi_view import Explanation, FactLine
from app.screens.logs.view import Filters, period_start
from app.services.history.figures import Facts
from app.services.history.runs import RobotTimeline

COLUMNS = 600  # of a band; finer can't be seen
HOUR = 3600.0
SHORTEST = timedelta(hours=1)  # that can be zoomed to
KINDS = ("executing", "charging", "idle", "paused", "error", "offline", NO_DATA)


@dataclass(frozen=True)
class Steps:
    """What of the period can be looked at from here."""

    earlier: bool = False
    later: bool = False
    more: bool = False
    less: bool = False


@dataclass(frozen=True)
class StatesFacts:
    """``start`` and ``end`` are those of the drawing, ``whole`` those of the period read."""

    start: datetime
    end: datetime
    timelines: Sequence[RobotTimeline]
    whole: tuple[datetime, datetime] | None = None

    @property
    def period(self) -> tuple[datetime, datetime]:
        return self.whole or (self.start, self.end)

    def place(self, instant: datetime) -> float:
        """0..1 of what is drawn."""
        return (instant - self.start) / (self.end - self.start)

    def moment(self, place: float) -> datetime:
        """The instant at 0..1 of what is drawn."""
        return min(self.start + (self.end - self.start) * place, self.end - timedelta(microseconds=1))

    def within(self, start: datetime, length: timedelta) -> StatesFacts:
        """So long a part of the period, moved as far as it must be to lie in it."""
        first, last = self.period
        length = min(length, last - first)
        start = max(first, min(start, last - length))
        return replace(self, start=start, end=start + length, whole=(first, last))

    def as_before(self, seen: StatesFacts | None) -> StatesFacts:
        """The place looked at stays after a new reading; at the end of the period, it moves with the time."""
        if seen is None or seen.whole is None:
            return self
        length = seen.end - seen.start
        return self.within(self.end - length if seen.end == seen.whole[1] else seen.start, length)

    @property
    def steps(self) -> Steps:
        first, last = self.period
        return Steps(
            self.start > first, self.end < last, self.end - self.start < last - first, self.end - self.start > SHORTEST
        )

    def zoomed(self, further: bool) -> StatesFacts:
        """Half or twice the time: around the middle; a span that ends with the period keeps its end."""
        length = self.end - self.start
        wanted = max(SHORTEST, length / 2) if further else length * 2
        return self.within(
            self.end - wanted if self.end == self.period[1] else self.start + (length - wanted) / 2, wanted
        )

    def moved(self, later: bool) -> StatesFacts:
        """Half a view earlier or later."""
        length = self.end - self.start
        return self.within(self.start + length / 2 * (1 if later else -1), length)


@dataclass(frozen=True)
class Span:
    """One activity from ``start`` to ``end``, both 0..1 of the period."""

    start: float
    end: float
    kind: str


@dataclass(frozen=True)
class Lane:
    """The band of one robot."""

    key: int
    name: str
    note: str
    spans: tuple[Span, ...]


@dataclass(frozen=True)
class Tick:
    """A mark on the axis at 0..1 of the period."""

    place: float
    label: str
    strong: bool


@dataclass(frozen=True)
class Mark:
    """The frame around a span of the lane ``key``."""

    key: int
    start: float
    end: float


@dataclass(frozen=True)
class LegendEntry:
    kind: str
    text: str


def read_states(services: LogsServices, filters: Filters, now: datetime, zone: ZoneInfo) -> StatesFacts:
    """Called off the UI thread."""
    start = period_start(filters.period, now, zone) or midnight((now - KEPT_FOR).astimezone(zone).date(), zone)
    if start >= now:  # at midnight sharp
        start = now - timedelta(minutes=1)
    return StatesFacts(start, now, by_name(services.robot_states.timelines(start, now, filters.robot_ids), "robot"))


# ---------------------------------------------------------------------- in words
def word(activity: str) -> str:
    return {
        "executing": _("Working"),
        "charging": _("Charging"),
        "idle": _("Ready"),
        "paused": _("Paused"),
        "error": _("Stopped"),
        "offline": _("No answer"),
        NO_DATA: _("No data"),
    }[activity]


def legend() -> list[LegendEntry]:
    return [LegendEntry(kind, word(kind)) for kind in KINDS]


def lanes(facts: StatesFacts, robots: Sequence[Facts]) -> list[Lane]:
    """``robots``: their figures of the same period, whose utilisation is shown here too."""
    figures = {robot.robot_id: robot for robot in robots}
    return [
        Lane(
            one.robot_id,
            one.robot,
            _share_on_missions(figures.get(one.robot_id)),
            tuple(
                Span(facts.place(span.start), facts.place(span.end), span.activity)
                for span in as_drawn(_drawn(facts, one), COLUMNS)
            ),
        )
        for one in facts.timelines
    ]


def _drawn(facts: StatesFacts, one: RobotTimeline) -> list[ActivitySpan]:
    return [
        span._replace(start=max(span.start, facts.start), end=min(span.end, facts.end))
        for span in one.spans
        if span.end > facts.start and span.start < facts.end
    ]


def _share_on_missions(figures: Facts | None) -> str:
    """Of the observed time; nothing is known before it."""
    if figures is None:
        return ""
    share = figures.value("utilisation")
    if share is None:
        return _("never observed")
    return _("{share} on missions").format(share=formats.percent(share * 100))


def ticks(facts: StatesFacts, zone: ZoneInfo) -> list[Tick]:
    """Hours of one day, days of more."""
    length = facts.end - facts.start
    if length <= timedelta(hours=26):
        return list(_hours(facts, zone))
    return list(_days(facts, zone))


def _hours(facts: StatesFacts, zone: ZoneInfo) -> Iterator[Tick]:
    step = next(step for step in (1, 2, 3, 6, 24) if (facts.end - facts.start).total_seconds() / HOUR / step <= 12)
    at = facts.start.astimezone(UTC).replace(minute=0, second=0, microsecond=0)
    is_named = False
    for quarters in range(4 * 27):  # clocks are changed by half an hour, too
        instant = (at + timedelta(minutes=15 * quarters)).astimezone(zone)
        if facts.start <= instant < facts.end and instant.minute == 0 and instant.hour % step == 0:
            time, day = formats.wall_time(instant), formats.wall_day(instant.date())
            label = day if instant.hour == 0 else time if is_named else f"{day} {time}"
            is_named = True
            yield Tick(facts.place(instant), label, instant.hour == 0)


def _days(facts: StatesFacts, zone: ZoneInfo) -> Iterator[Tick]:
    first, last = facts.start.astimezone(zone).date(), facts.end.astimezone(zone).date()
    names = (last - first).days < 14
    for day in days_between(first, last):
        instant = midnight(day, zone)
        if facts.start <= instant < facts.end:
            label = formats.wall_day(day)
            yield Tick(facts.place(instant), label if names else label.partition(" ")[2], day.weekday() == 0)


def span_at(facts: StatesFacts, robot_id: int, place: float) -> tuple[RobotTimeline, ActivitySpan] | None:
    """What a tap there means."""
    one = next((timeline for timeline in facts.timelines if timeline.robot_id == robot_id), None)
    span = one.at(facts.moment(place)) if one else None
    return (one, span) if one and span else None


def span_details(one: RobotTimeline, span: ActivitySpan, now: datetime, zone: str) -> Explanation:
    """What, and from when to when."""
    texts = {
        "executing": _("The robot was on a mission."),
        "charging": _("The robot was charging."),
        "idle": _("The robot was ready and idle."),
        "paused": _("The robot was paused or driven by hand."),
        "error": _("The robot reported an error or an emergency stop."),
        "offline": _("The robot did not answer."),
        NO_DATA: _("Nothing was recorded: the app was off or asleep, or this robot was switched off in Settings."),
    }
    ends = formats.day_and_time(span.end, zone, now) if span.end < now else _("ongoing")
    return Explanation(
        _("{robot}: {what}").format(robot=one.robot, what=word(span.activity)),
        texts[span.activity],
        (
            FactLine(_("From"), formats.day_and_time(span.start, zone, now)),
            FactLine(_("To"), ends),
            FactLine(_("For"), formats.duration(span.seconds)),
        ),
    )


def explanation(facts: StatesFacts | None) -> Explanation:
    """What the bands mean, and how long each activity took, robot by robot."""
    lines = []
    for one in facts.timelines if facts else ():
        parts = [f"{word(kind)} {formats.rough_duration(one.seconds[kind])}" for kind in KINDS if kind in one.seconds]
        lines.append(FactLine(one.robot, "", " · ".join(parts)))
    return Explanation(
        _("What the robots did"),
        _(
            "Recorded at every poll. The time since the previous poll counts as the activity seen now; gaps of more "
            "than three polls have no data. Kept for 90 days. Where many spans are close together, a band shows the "
            "activity that took the most time, and every error."
        ),
        tuple(lines),
    )
