"""The page of figures in words: what was planned and ran, how long it waited, why it failed, how long missions take. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import date, timedelta
from typing import Generic, TypeVar

from app.domain.models import Reason
from app.domain.reasons import sentence
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.logs.figures import Figures, MoreFigures
from app.screens.logs.group_figures import GroupCardView, cards
from app.screens.logs.kpi_view import Explanation, FactLine, in_unit, period_line, with_interval
from app.services.history.figures import DELAY_FIGURES, Cause, Delays, Facts, queue_share
from app.services.planning.durations import Trend

Row = TypeVar("Row")

MOST_FAILURES = 0.8  # share of all failures that the listed causes make up at least
LEAST_DRAWN = 0.02  # share of the whole below which no bar is drawn
ABOUT_USUAL = 0.05  # of the usual duration, within which the median is called as usual


@dataclass(frozen=True)
class RankedBar:
    """One bar of a ranking, ``share`` 0..1; ``detail`` goes under its label."""

    label: str
    value: str
    note: str
    share: float
    detail: str = ""


@dataclass(frozen=True)
class Point:
    """A day's median in seconds, at 0..1 of the period; ``joined``: the day before has one too."""

    place: float
    value: float
    joined: bool = False


@dataclass(frozen=True)
class UsualBand:
    """What was usual before the period: eight of ten runs took between ``low`` and ``high`` seconds; ``middle`` is the median."""

    low: float
    middle: float
    high: float


@dataclass(frozen=True)
class TrendLine:
    """How long a mission takes: in words, and day by day as a chart."""

    key: str
    mission: str
    value: str
    note: str
    tone: str
    icon: str
    points: tuple[Point, ...]
    band: UsualBand | None
    count: str
    scale: tuple[str, str]  # the lowest and the highest that is drawn
    days: tuple[str, str]  # the first and the last day


@dataclass(frozen=True)
class Panel(Generic[Row]):
    """The content of a card; ``note`` is in its head."""

    note: str = ""
    text: str = ""
    rows: tuple[Row, ...] = ()


@dataclass(frozen=True)
class FiguresPage:
    adherence: Panel[RankedBar] = Panel()
    waiting: Panel[FactLine] = Panel()
    causes: Panel[RankedBar] = Panel()
    durations: Panel[TrendLine] = Panel()
    queue_share: float = 0.0  # of the time from submission to end; 0: too little to be drawn
    groups: tuple[GroupCardView, ...] = ()


def page(figures: Figures, more: MoreFigures) -> FiguresPage:
    found, delays = figures.facts, figures.delays
    return FiguresPage(
        Panel(adherence_head(found), adherence_text(found), adherence_rows(found)),
        Panel(delay_head(delays), waiting_text(delays), delay_rows(delays)),
        Panel(cause_head(more.causes), cause_summary(more.causes), cause_rows(more.causes)),
        Panel(
            "",
            "" if more.trends else _("No mission was completed."),
            trend_rows(more.trends, figures.first_day, figures.last_day),
        ),
        share if (share := queue_share(delays) or 0.0) >= LEAST_DRAWN else 0.0,
        cards(more.groups),
    )


# ---------------------------------------------------------------------- planned and run
def adherence_head(found: Facts) -> str:
    """95.7 % of 94 planned"""
    share = found.value("adherence")
    if share is None:
        return _("Nothing was planned")
    text = ngettext("{share} of {n} planned", "{share} of {n} planned", found.planned).format(
        share=formats.percent(share * 100, 0 if share == 1 else 1), n=found.planned
    )
    return with_interval(text, found.ran, found.planned)


def adherence_rows(found: Facts) -> tuple[RankedBar, ...]:
    """Why planned runs did not run, the most frequent reason first."""
    return tuple(
        RankedBar(
            sentence(Reason(code), "UTC", _),
            str(number),
            formats.percent(number / found.planned * 100, 1),
            number / found.planned,
        )
        for code, number in found.not_run.items()
    )


def adherence_text(found: Facts) -> str:
    if found.planned and found.ran == found.planned:
        return _("Everything that was planned ran.")
    return ""


# ---------------------------------------------------------------------- waiting
def delay_rows(delays: Delays) -> tuple[FactLine, ...]:
    if not delays.starts:
        return ()
    return (
        FactLine(_("Half started within"), formats.duration(delays.value("delay_half"))),
        FactLine(_("Nine of ten within"), formats.duration(delays.value("delay_most"))),
        FactLine(_("Wait in the robot's queue, median"), formats.duration(delays.value("queue"))),
        FactLine(_("Run, median"), formats.duration(delays.value("run_half"))),
    )


def delay_head(delays: Delays) -> str:
    return (
        ngettext("{n} run", "{n} runs", len(delays.starts)).format(n=len(delays.starts))
        if delays.starts
        else _("No planned run has started")
    )


def waiting_text(delays: Delays) -> str:
    """Waiting against running."""
    share = queue_share(delays)
    if share is None:
        return ""
    text = _("Of the time from submission to end, {share} was waiting in the queue.")
    return text.format(share=formats.percent(share * 100, 1))


# ---------------------------------------------------------------------- why runs failed
def cause_text(cause: Cause) -> str:
    if cause.code is None:
        return _("All other reasons")
    return cause.words or sentence(Reason(cause.code), "UTC", _)


def cause_rows(causes: Sequence[Cause]) -> tuple[RankedBar, ...]:
    return tuple(
        RankedBar(
            cause_text(cause),
            str(cause.number),
            formats.percent(cause.share * 100),
            cause.share,
            ", ".join(f"{name} ×{number}" for name, number in cause.particulars),
        )
        for cause in causes
    )


def cause_head(causes: Sequence[Cause]) -> str:
    number = sum(cause.number for cause in causes)
    return ngettext("{n} failed run", "{n} failed runs", number).format(n=number) if number else ""


def cause_summary(causes: Sequence[Cause]) -> str:
    """How few causes make up most of it."""
    if not causes:
        return _("No run failed.")
    first = next(n for n, cause in enumerate(causes, 1) if cause.cumulative >= MOST_FAILURES)
    if first == len(causes) or causes[first - 1].code is None:
        return ""
    share = formats.percent(causes[first - 1].cumulative * 100)
    return ngettext(
        "The first reason makes up {share} of all failures.",
        "The first {n} reasons make up {share} of all failures.",
        first,
    ).format(n=first, share=share)


# ---------------------------------------------------------------------- how long missions take
def trend_rows(trends: Sequence[Trend], first: date | None, last: date | None) -> tuple[TrendLine, ...]:
    """One per mission; the charts run from ``first`` to ``last``."""
    return tuple(_trend_row(trend, first or trend.days[0].day, last or trend.days[-1].day) for trend in trends)


def _trend_row(trend: Trend, first: date, last: date) -> TrendLine:
    length = max(1, (last - first).days)
    usual, known = trend.usual, {day.day for day in trend.days}
    drawn = [*(day.median_s for day in trend.days), *((usual.p10_s, usual.p90_s) if usual else ())]
    return TrendLine(
        trend.guid,
        trend.mission,
        formats.duration(trend.median_s),
        _comparison(trend),
        tone="attention" if trend.is_longer else "neutral",
        icon="arrow-up-bold" if trend.is_longer else "arrow-down-bold" if trend.is_shorter else "",
        points=tuple(
            Point((day.day - first).days / length, day.median_s, day.day - timedelta(days=1) in known)
            for day in trend.days
        ),
        band=UsualBand(usual.p10_s, usual.p50_s, usual.p90_s) if usual else None,
        count=ngettext("{n} run", "{n} runs", trend.count).format(n=trend.count),
        scale=(formats.duration(min(drawn)), formats.duration(max(drawn))),
        days=(formats.wall_day(first), formats.wall_day(last)),
    )


def _comparison(trend: Trend) -> str:
    """The median against what was usual before the period."""
    usual = trend.usual
    if usual is None:
        return _("No earlier period to compare with")
    values = {
        "usual": formats.duration(usual.p50_s),
        "low": formats.duration(usual.p10_s),
        "high": formats.duration(usual.p90_s),
    }
    change = trend.median_s / usual.p50_s - 1 if usual.p50_s else 0.0
    text = _("As usual: {usual} ({low} to {high})")
    if trend.is_longer:
        text = _("Clearly longer than usual: {usual} ({low} to {high})")
    elif trend.is_shorter:
        text = _("Clearly shorter than usual: {usual} ({low} to {high})")
    elif change > ABOUT_USUAL:
        text = _("A little longer than usual: {usual} ({low} to {high})")
    elif change < -ABOUT_USUAL:
        text = _("A little shorter than usual: {usual} ({low} to {high})")
    return text.format(**values)


# ---------------------------------------------------------------------- what they mean
MORE = ("delays", "causes", "durations")


def explanation(key: str, figures: Figures, more: MoreFigures) -> Explanation:
    """Of one of the keys in ``MORE``."""
    found = {
        "delays": lambda: _about_delays(figures.delays),
        "causes": lambda: _about_causes(more.causes),
        "durations": lambda: _about_durations(more.trends),
    }[key]()
    return replace(found, lines=(*found.lines, period_line(figures)))


def _about_delays(delays: Delays) -> Explanation:
    return Explanation(
        _("Starting and waiting"),
        _(
            "The newest 5,000 planned runs that started. The start delay is the time from the planned time to the "
            "start on the robot: first until the robot accepted it, then in its queue. Waiting is compared with the "
            "time from start to end, in robot time."
        ),
        (
            FactLine(_("Runs"), str(len(delays.starts))),
            *(
                FactLine(_(figure.title), in_unit(figure.compute(delays), figure.unit))
                for figure in DELAY_FIGURES.values()
            ),
        ),
    )


def _about_causes(causes: Sequence[Cause]) -> Explanation:
    return Explanation(
        _("Reasons for failure"),
        _(
            "All failed runs by their reason, most frequent first. For runs that the robot ended itself, the reason "
            "is the robot's message without names and numbers; the most frequent names are below."
        ),
        tuple(
            FactLine(
                cause_text(cause), _("{n} · {share}").format(n=cause.number, share=formats.percent(cause.share * 100))
            )
            for cause in causes
        ),
    )


def _about_durations(trends: Sequence[Trend]) -> Explanation:
    lines = []
    for trend in trends:
        before = (
            ngettext("{n} run before the period", "{n} runs before the period", trend.usual.count).format(
                n=trend.usual.count
            )
            if trend.usual
            else ""
        )
        runs = ngettext("{n} run", "{n} runs", trend.count).format(n=trend.count)
        lines.append(
            FactLine(trend.mission, formats.duration(trend.median_s), f"{runs} · {before}" if before else runs)
        )
    return Explanation(
        _("Duration of missions"),
        _(
            "The median duration of completed runs on each day, for the missions that took the most time in total. "
            "The band shows what was usual before the period: eight of ten of the newest 200 runs. It needs at least "
            "10 runs."
        ),
        tuple(lines),
    )
