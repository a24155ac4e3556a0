"""The page of figures in words: five figures, why runs failed, values for the charts. Pure; numbers.py explains the figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, timedelta

from app.domain.execution import Reason
from app.domain.reasons import sentence
from app.i18n import _
from app.screens.common import formats
from app.screens.common.robot_texts import problem_of
from app.screens.logs.figures import Figures
from app.screens.logs.numbers import in_unit, label
from app.screens.logs.view import Like, like_kind
from app.services.history.figures import FIGURES, Cause, Facts, Figure, Unit
from app.services.planning.durations import Band, Trend

MAX_POINTS = 11  # of a card's small history
LEAST_SHARE = 0.1  # that the history of a share spans: less would make a mountain of nothing
LEAST_CASES = 5  # fewer make no share
ROUGH_FROM_S = 600.0  # a mean duration from here on has no seconds


@dataclass(frozen=True)
class Card:
    """A figure. ``value`` is markup; ``change`` sets it against the period before; ``history`` has the days that are over,
    ``before`` as many of the period before. ``least_span``: what the drawing spans at least; 0: it begins at zero."""

    key: str
    label: str
    value: str = formats.NOTHING
    change: str = ""
    history: tuple[float | None, ...] = ()
    before: tuple[float | None, ...] = ()
    least_span: float = 0.0


@dataclass(frozen=True)
class CauseRow:
    """Why runs failed: how many, and of the most frequent cause that ``share``; ``key`` finds them."""

    key: Like | None
    number: str
    label: str
    share: float


@dataclass(frozen=True)
class RobotBar:
    """Use of a robot: its share as text, then the drawn parts, 0..1 of the observed time."""

    key: int
    robot: str
    share: str
    busy: float
    charging: float


@dataclass(frozen=True)
class DayBar:
    """How many runs of a day ended how. ``label`` names it among its neighbours, ``date`` alone."""

    key: date
    label: str
    date: str
    completed: int
    not_run: int
    failed: int


@dataclass(frozen=True)
class Point:
    """A day's median in seconds, at 0..1 of the period; ``joined``: the day before has one too."""

    place: float
    value: float
    joined: bool = False


@dataclass(frozen=True)
class TrendLine:
    """How long a mission takes, day by day. ``key``: robots may have missions of one name."""

    key: tuple[str, str]
    mission: str
    value: str
    points: tuple[Point, ...]
    band: Band | None
    scale: tuple[str, str]  # the lowest and the highest that is drawn
    days: tuple[str, str]  # the first and the last day
    tone: str = "neutral"


@dataclass(frozen=True)
class FiguresPage:
    cards: tuple[Card, ...] = ()
    causes: tuple[CauseRow, ...] = ()
    days: tuple[DayBar, ...] = ()
    robots: tuple[RobotBar, ...] = ()
    trends: tuple[TrendLine, ...] = ()


def page(figures: Figures | None) -> FiguresPage:
    """None: not read yet."""
    if figures is None:
        return FiguresPage(tuple(Card(key, label(key)) for key in FIGURES))
    return FiguresPage(
        tuple(_card(key, figure, figures) for key, figure in FIGURES.items()),
        tuple(cause_rows(figures.causes)),
        tuple(outcome_days(figures.days)),
        tuple(robot_bars(figures.facts.robots)),
        tuple(_trend(each, figures.first_day, figures.last_day) for each in figures.trends),
    )


# ---------------------------------------------------------------------- the cards
def _card(key: str, figure: Figure[Facts], figures: Figures) -> Card:
    text = change(figures, key)
    return Card(
        key,
        label(key),
        value_of(key, figures.facts),
        f"{text} {_against(figures)}" if text and key == next(iter(FIGURES)) else text,
        condense([figure.compute(day) for day in figures.days[:-1]]),
        condense([figure.compute(day) for day in figures.before[1:]]),
        LEAST_SHARE if figure.unit is Unit.SHARE else 0.0,
    )


def _known(key: str, facts: Facts) -> float | None:
    """The figure, if there is enough to tell it from."""
    cases = {"success": facts.completed + facts.failed, "adherence": facts.planned}
    return facts.value(key) if cases.get(key, LEAST_CASES) >= LEAST_CASES else None


def value_of(key: str, facts: Facts) -> str:
    """With the unit set smaller behind it."""
    figure, value = FIGURES[key], _known(key, facts)
    if value is None:
        return formats.NOTHING
    if figure.unit is Unit.SHARE:
        return with_unit(formats.number(value * 100, 0 if value in (0.0, 1.0) else figure.digits), "%")
    if figure.unit is Unit.SECONDS:
        parts = (formats.duration if value < ROUGH_FROM_S else formats.rough_duration)(value).split()
        return " ".join(with_unit(number, unit) for number, unit in zip(parts[::2], parts[1::2], strict=True))
    return with_unit(formats.number(value, 0 if value >= 10 else 1), _("a day"))


def with_unit(value: str, unit: str) -> str:
    """Markup of a figure with its unit set smaller behind it."""
    return f"{value}[size=18sp][font=Roboto] {unit}[/font][/size]"


def change(figures: Figures, key: str) -> str:
    """Against as long before: "▼ 1.9"; empty where one of them is not known, "–" without a difference."""
    value = _known(key, figures.facts)
    before = None if figures.earlier is None else _known(key, figures.earlier)
    if value is None or before is None:
        return ""
    size, unit = abs(value - before), FIGURES[key].unit
    if unit is Unit.SECONDS:
        text = formats.rough_duration(size) if size >= 1 else ""
    else:
        size = size * 100 if unit is Unit.SHARE else size
        text = formats.number(size, 1) if size >= 0.05 else ""
    return f"{'▲' if value > before else '▼'} {text}" if text else formats.NOTHING


def _against(figures: Figures) -> str:
    """The period before."""
    days = (figures.last_day - figures.first_day).days + 1 if figures.last_day and figures.first_day else 0
    return {1: _("vs. yesterday"), 7: _("vs. last week")}.get(days, _("vs. month before"))


def condense(history: Sequence[float | None]) -> tuple[float | None, ...]:
    """At most MAX_POINTS, as means of neighbouring days: a small line shows the trend and not every day."""
    size = -(-len(history) // (MAX_POINTS - 1)) or 1
    groups = [history[max(0, end - size) : end] for end in range(len(history), 0, -size)]
    known = [[value for value in group if value is not None] for group in reversed(groups)]
    return tuple(sum(values) / len(values) if values else None for values in known)


# ---------------------------------------------------------------------- why runs failed
def cause_text(cause: Cause) -> str:
    if cause.code is None:
        return _("All other reasons")
    if not cause.words:
        return sentence(Reason(cause.code), "UTC", _)
    named = ", ".join(name for name, _number in cause.particulars)
    said = cause.words.replace("…", f"'{named}'" if named else "")
    return problem_of(said).words or " ".join(said.split())


def cause_rows(causes: Sequence[Cause]) -> list[CauseRow]:
    most = max((cause.number for cause in causes), default=1)
    return [
        CauseRow(
            like_kind(text, cause.code, cause.words) if cause.code else None,
            str(cause.number),
            text,
            cause.number / most,
        )
        for cause in causes
        for text in [cause_text(cause)]
    ]


# ---------------------------------------------------------------------- the charts
def robot_bars(robots: Sequence[Facts]) -> list[RobotBar]:
    return [
        RobotBar(
            robot.robot_id,
            robot.robot,
            in_unit(robot.value("utilisation"), Unit.SHARE),
            robot.value("utilisation") or 0.0,
            robot.charging_s / robot.observed_s if robot.observed_s else 0.0,
        )
        for robot in robots
        if not robot.is_any
    ]


def outcome_days(days: Sequence[Facts]) -> list[DayBar]:
    """The last one is today."""
    names, long = formats.current().weekdays_date, len(days) > 14
    known = [(day, day.day) for day in days if day.day is not None]
    return [
        DayBar(
            at,
            _("Today") if number == len(known) else str(at.day) if long else names[at.weekday()],
            formats.wall_day(at).partition(" ")[2],
            day.completed,
            day.skipped + day.missed,
            day.failed,
        )
        for number, (day, at) in enumerate(known, 1)
    ]


def _trend(trend: Trend, first: date | None, last: date | None) -> TrendLine:
    """The chart runs from ``first`` to ``last``."""
    first, last = first or trend.days[0].day, last or trend.days[-1].day
    length, usual, known = max(1, (last - first).days), trend.usual, {day.day for day in trend.days}
    drawn = [*(day.median_s for day in trend.days), *((usual.p10_s, usual.p90_s) if usual else ())]
    return TrendLine(
        (trend.guid, trend.mission),
        trend.mission,
        formats.rough_duration(trend.median_s),
        tuple(
            Point((day.day - first).days / length, day.median_s, day.day - timedelta(days=1) in known)
            for day in trend.days
        ),
        usual,
        (formats.rough_duration(min(drawn)), formats.rough_duration(max(drawn))),
        (formats.wall_day(first), formats.wall_day(last)),
        "attention" if trend.is_longer else "neutral",
    )
