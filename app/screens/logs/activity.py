"""What the robots did: read on a background thread, and in words for the lanes. The words are pure."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

from app.database.activities import KEPT_FOR
from app.domain.activity import NO_DATA, ActivitySpan, as_drawn
from app.domain.clock import days_between, midnight
from app.domain.models import Group
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.name_order import by_name
from app.screens.common.options import Option
from app.screens.logs.facts import LogsServices
from app.screens.logs.numbers import Explanation, FactLine
from app.screens.logs.view import Filters
from app.services.history.figures import Facts
from app.services.history.kpis import KpiFilter
from app.services.history.runs import RobotTimeline

COLUMNS = 600  # of a lane; finer can't be seen
HOUR = timedelta(hours=1)
MOST_LANES = 12  # more are shown by groups
KINDS = ("executing", "charging", "idle", "paused", "error", "offline", NO_DATA)


@dataclass(frozen=True)
class Window:
    """The time that is looked at. ``end`` None: it ends now."""

    length: timedelta = 8 * HOUR
    end: datetime | None = None

    def span(self, now: datetime) -> tuple[datetime, datetime]:
        end = min(self.end or now, now)
        return end - self.length, end

    def moved(self, later: bool, now: datetime) -> Window:
        """Half its length earlier or later, at most to now and as far as the recordings are kept."""
        end = self.span(now)[1] + self.length / 2 * (1 if later else -1)
        return Window(self.length, None if end >= now else max(end, now - KEPT_FOR + self.length))


@dataclass(frozen=True)
class ActivityFacts:
    start: datetime
    end: datetime
    timelines: Sequence[RobotTimeline]
    figures: Sequence[Facts] = ()  # of the robots, in the same time
    groups: Sequence[Group] = ()

    def place(self, instant: datetime) -> float:
        """0..1 of what is drawn."""
        return (instant - self.start) / (self.end - self.start)

    def moment(self, place: float) -> datetime:
        """The instant at 0..1 of what is drawn."""
        return min(self.start + (self.end - self.start) * place, self.end - timedelta(microseconds=1))


@dataclass(frozen=True)
class Span:
    """One activity from ``start`` to ``end``, both 0..1 of the time; ``text`` if there is room for it."""

    start: float
    end: float
    kind: str
    text: str


@dataclass(frozen=True)
class Lane:
    """The lane of one robot, or the head of a group: ``is_open`` tells whether its robots are below it."""

    key: Hashable
    name: str
    note: str
    spans: tuple[Span, ...] = ()
    is_open: bool | None = None


@dataclass(frozen=True)
class Tick:
    """A mark on the axis at 0..1 of the time."""

    place: float
    label: str
    strong: bool


@dataclass(frozen=True)
class LegendEntry:
    kind: str
    text: str


def read_activity(services: LogsServices, filters: Filters, window: Window, now: datetime) -> ActivityFacts:
    """Called off the UI thread."""
    start, end = window.span(now)
    timelines = by_name(services.robot_states.timelines(start, end, filters.robot_ids), "robot")
    facts = services.kpis.facts(KpiFilter(start, end, filters.robot_ids))
    return ActivityFacts(start, end, timelines, facts.robots, by_name(services.catalogue.groups()))


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


def window_options() -> list[Option]:
    return [
        Option(8 * HOUR, _("8 h")),
        Option(24 * HOUR, _("24 h")),
        Option(timedelta(days=7), _("7 days")),
        Option(timedelta(days=30), _("30 days")),
    ]


def window_word(window: Window) -> str:
    return next(option.text for option in window_options() if option.key == window.length)


def legend(facts: ActivityFacts) -> list[LegendEntry]:
    drawn = {span.activity for one in facts.timelines for span in one.spans}
    return [LegendEntry(kind, word(kind)) for kind in KINDS if kind in drawn]


def lanes(facts: ActivityFacts, opened: Hashable = None) -> list[Lane]:
    """One per robot; of many, below the names of their groups, and of the group ``opened`` only. A robot of several groups
    is in the first."""
    if len(facts.timelines) <= MOST_LANES:
        return [_lane(facts, one) for one in facts.timelines]
    found, left = list[Lane](), {one.robot_id: one for one in facts.timelines}
    of_groups = [(group.id, group.name, group.members) for group in facts.groups]
    for key, name, members in (*of_groups, (0, _("Without group"), tuple(left))):
        ones = [left.pop(member) for member in members if member in left]
        if ones:
            robots = ngettext("{n} robot", "{n} robots", len(ones)).format(n=len(ones))
            opened = key if opened is None else opened
            found.append(Lane(("group", key), f"{name} · {robots}", _in_use(facts, ones), is_open=key == opened))
            found += [_lane(facts, one, ("paused", "error", "offline")) for one in ones if key == opened]
    return found


def _lane(facts: ActivityFacts, one: RobotTimeline, named: Collection[str] = KINDS) -> Lane:
    spans = as_drawn(one.spans, COLUMNS)
    return Lane(
        one.robot_id,
        one.robot,
        _in_use(facts, [one]) if named == KINDS else "",
        tuple(
            Span(
                facts.place(span.start),
                facts.place(span.end),
                span.activity,
                word(span.activity) if span.activity in named else "",
            )
            for span in spans
        ),
    )


def _in_use(facts: ActivityFacts, timelines: Sequence[RobotTimeline]) -> str:
    """The figure of the same name, of these robots together."""
    wanted = {one.robot_id for one in timelines}
    share = Facts(robots=[robot for robot in facts.figures if robot.robot_id in wanted]).value("utilisation")
    return formats.NOTHING if share is None else _("{share} in use").format(share=formats.percent(share * 100))


def ticks(facts: ActivityFacts, zone: ZoneInfo) -> list[Tick]:
    """Hours of one day, days of more."""
    return list((_hours if facts.end - facts.start <= 26 * HOUR else _days)(facts, zone))


def _hours(facts: ActivityFacts, zone: ZoneInfo) -> Iterator[Tick]:
    """The day stands at its midnight."""
    step = next(step for step in (1, 2, 3, 6, 24) if (facts.end - facts.start) / HOUR / step <= 12)
    at = facts.start.astimezone(UTC).replace(minute=0, second=0, microsecond=0)
    for quarters in range(4 * 27):  # clocks are changed by half an hour, too
        instant = (at + timedelta(minutes=15 * quarters)).astimezone(zone)
        if facts.start <= instant < facts.end and instant.minute == 0 and instant.hour % step == 0:
            label = formats.wall_time(instant) if instant.hour else formats.wall_day(instant.date())
            yield Tick(facts.place(instant), label, instant.hour == 0)


def _days(facts: ActivityFacts, zone: ZoneInfo) -> Iterator[Tick]:
    first, last = facts.start.astimezone(zone).date(), facts.end.astimezone(zone).date()
    names = (last - first).days < 14
    for day in days_between(first, last):
        instant = midnight(day, zone)
        if facts.start <= instant < facts.end:
            label = formats.wall_day(day)
            yield Tick(facts.place(instant), label if names else label.partition(" ")[2], day.weekday() == 0)


def when(facts: ActivityFacts, zone: ZoneInfo) -> str:
    """The day that is looked at, or the first of several."""
    first, last = (at.astimezone(zone).date() for at in (facts.start, facts.end))
    return formats.wall_day(last) if first == last else f"{formats.wall_day(first)} – {formats.wall_day(last)}"


def span_at(facts: ActivityFacts, robot_id: int, place: float) -> tuple[RobotTimeline, ActivitySpan] | None:
    """What a tap there means."""
    one = next((timeline for timeline in facts.timelines if timeline.robot_id == robot_id), None)
    span = one.at(facts.moment(place)) if one else None
    return (one, span) if one and span else None


def span_details(one: RobotTimeline, span: ActivitySpan, now: datetime, zone: str) -> Explanation:
    """What, and from when to when."""
    texts = {
        "paused": _("The robot was paused, asked something or was driven by hand."),
        "error": _("The robot reported an error or an emergency stop."),
        NO_DATA: _("The app was off or asleep, or the robot was off in Settings."),
    }
    ends = formats.day_and_time(span.end, zone, now) if span.end < now else _("ongoing")
    return Explanation(
        f"{one.robot} · {word(span.activity)}",
        texts.get(span.activity, ""),
        (
            FactLine(_("From"), formats.day_and_time(span.start, zone, now)),
            FactLine(_("To"), ends),
            FactLine(_("For"), formats.duration(span.seconds)),
        ),
    )
