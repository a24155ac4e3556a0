"""What the robots did: read on a background thread, and in words for the lanes. The words are pure."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

from app.database.activities import KEPT_FOR
from app.domain.activity import NO_DATA, ActivitySpan, as_drawn, seen_seconds
from app.domain.clock import days_between, midnight
from app.domain.models import Group
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.name_order import by_name
from app.screens.logs.facts import LogsServices
from app.screens.logs.numbers import Explanation, FactLine
from app.screens.logs.view import Filters
from app.services.history.runs import RobotTimeline
from app.widgets.items import Bar, Lane, Option

COLUMNS = 600  # of a lane; finer can't be seen
HOUR = timedelta(hours=1)
LENGTHS = (8 * HOUR, 24 * HOUR, timedelta(days=7), timedelta(days=30))
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
        """Half its length earlier or later."""
        end = self.span(now)[1] + self.length / 2 * (1 if later else -1)
        return Window(self.length, end).within(now)

    def within(self, now: datetime) -> Window:
        """No later than now, and no further back than the recordings are kept."""
        end = self.span(now)[1]
        return Window(self.length, None if end >= now else max(end, now - KEPT_FOR + self.length))


@dataclass(frozen=True)
class ActivityFacts:
    start: datetime
    end: datetime
    timelines: Sequence[RobotTimeline]
    groups: Sequence[Group] = ()

    def hour(self, instant: datetime) -> float:
        """Since the start."""
        return (instant - self.start) / HOUR


Tick = tuple[float, str, bool]  # hour, label, whether a day or a week begins


def read_activity(services: LogsServices, filters: Filters, window: Window, now: datetime) -> ActivityFacts:
    """Called off the UI thread."""
    start, end = window.span(now)
    timelines = by_name(services.robot_states.timelines(start, end, filters.robot_ids), "robot")
    return ActivityFacts(start, end, timelines, by_name(services.catalogue.groups()))


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
    words = (_("8 h"), _("24 h"), _("7 days"), _("30 days"))
    return [Option(length, word) for length, word in zip(LENGTHS, words, strict=True)]


def window_word(window: Window) -> str:
    return next(option.text for option in window_options() if option.key == window.length)


def legend(facts: ActivityFacts) -> list[tuple[str, str]]:
    drawn = {span.activity for one in facts.timelines for span in one.spans}
    return [(kind, word(kind)) for kind in KINDS if kind in drawn]


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
            found.append(Lane(name, key=key, line=f"{robots} · {_in_use(ones)}", is_open=key == opened))
            found += [_lane(facts, one, ("paused", "error", "offline")) for one in ones if key == opened]
    return found


def _lane(facts: ActivityFacts, one: RobotTimeline, named: Collection[str] = KINDS) -> Lane:
    bars = [
        Bar(
            (one.robot_id, span),
            facts.hour(span.start),
            facts.hour(span.end),
            word(span.activity) if span.activity in named else "",
            span.activity,
            shorter=("!", "") if span.activity == "error" else ("",),  # never by its colour alone
        )
        for span in as_drawn(one.spans, COLUMNS)
    ]
    return Lane(one.robot, _in_use([one]) if named == KINDS else "", tuple(bars), key=one.robot_id)


def _in_use(timelines: Sequence[RobotTimeline]) -> str:
    """How much of the time in which they were seen these robots worked."""
    seen = sum(seen_seconds(one.seconds) for one in timelines)
    if not seen:
        return formats.NOTHING
    worked = sum(one.seconds.get("executing", 0.0) for one in timelines)
    return _("{share} in use").format(share=formats.percent(worked / seen * 100))


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
            yield facts.hour(instant), label, instant.hour == 0


def _days(facts: ActivityFacts, zone: ZoneInfo) -> Iterator[Tick]:
    first, last = facts.start.astimezone(zone).date(), facts.end.astimezone(zone).date()
    names = (last - first).days < 14
    for day in days_between(first, last):
        instant = midnight(day, zone)
        if facts.start <= instant < facts.end:
            label = formats.wall_day(day)
            yield facts.hour(instant), label if names else label.partition(" ")[2], day.weekday() == 0


def span_of(facts: ActivityFacts, key: tuple[int, ActivitySpan]) -> tuple[RobotTimeline, ActivitySpan] | None:
    """What a bar stands for; of several, the longest."""
    robot_id, drawn = key
    one = next((timeline for timeline in facts.timelines if timeline.robot_id == robot_id), None)
    spans = [
        span
        for span in (one.spans if one else ())
        if span.activity == drawn.activity and span.end > drawn.start and span.start < drawn.end
    ]
    return (one, max(spans, key=lambda span: span.seconds)) if one and spans else None


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
