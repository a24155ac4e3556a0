"""The page of figures in words: what was planned and ran, how long it waited, why it failed, how long missions take. Pure."""
from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from typing import Any

from app.domain.models import Reason
from app.domain.reasons import sentence
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.logs.figures import Figures, MoreFigures
from app.screens.logs.kpi_view import period_row, with_interval
from app.services.history.kpi import Adherence, Delays
from app.services.history.pareto import Cause
from app.services.planning.durations import Trend

Row = dict[str, Any]

VITAL = 0.8                  # share of all failures that the first few causes are told to make up
ROUGHLY = 0.05               # of the usual duration, within which the median is called as usual


def pages(figures: Figures, more: MoreFigures) -> tuple[Row, Row, Row, Row]:
    """The four cards: planned and run, waiting, reasons of failure, durations. Each has ``note`` for its head, ``words``, ``rows``."""
    found, delays = figures.adherence, figures.delays
    return (
        {"note": adherence_head(found), "words": adherence_words(found), "rows": adherence_rows(found)},
        {"note": delay_head(delays), "words": waiting_words(delays), "rows": delay_rows(delays), "share": delays.queue_share or 0.0},
        {"note": cause_head(more.causes), "words": cause_words(more.causes), "rows": cause_rows(more.causes)},
        {"note": "", "words": "" if more.trends else _("No mission was completed."),
         "rows": trend_rows(more.trends, figures.first_day, figures.last_day)})


# ---------------------------------------------------------------------- planned and run
def adherence_head(found: Adherence) -> str:
    """95.7 % of 94 planned"""
    if found.rate is None:
        return _("Nothing was planned")
    text = ngettext("{share} of {n} planned", "{share} of {n} planned", found.planned).format(
        share=formats.percent(found.rate * 100, 0 if found.rate == 1 else 1), n=found.planned)
    return with_interval(text, found.ran, found.planned)


def adherence_rows(found: Adherence) -> list[Row]:
    """Why planned runs did not run, the most frequent reason first."""
    return [{"key": str(code), "label": sentence(Reason(code), "UTC", _), "value": str(number),
             "note": formats.percent(number / found.planned * 100, 1), "share": number / found.planned}
            for code, number in found.not_run.items()]


def adherence_words(found: Adherence) -> str:
    if found.planned and found.ran == found.planned:
        return _("Everything that was planned ran.")
    return ""


# ---------------------------------------------------------------------- waiting
def delay_rows(delays: Delays) -> list[Row]:
    """Figures of starting and waiting: label and value."""
    if not delays.count:
        return []
    return [{"key": "half", "label": _("Half started within"), "value": formats.duration(delays.p50_s)},
            {"key": "most", "label": _("Nine of ten within"), "value": formats.duration(delays.p90_s)},
            {"key": "queue", "label": _("Wait in the robot's queue, median"), "value": formats.duration(delays.queue_p50_s)},
            {"key": "run", "label": _("Run, median"), "value": formats.duration(delays.run_p50_s)}]


def delay_head(delays: Delays) -> str:
    return ngettext("{n} run", "{n} runs", delays.count).format(n=delays.count) if delays.count else _("No planned run has started")


def waiting_words(delays: Delays) -> str:
    """Waiting against running."""
    if delays.queue_share is None:
        return ""
    return _("Of the time from order to end, {share} was waiting in the queue.").format(
        share=formats.percent(delays.queue_share * 100, 1))


# ---------------------------------------------------------------------- why runs failed
def cause_text(cause: Cause) -> str:
    if cause.code is None:
        return _("All other reasons")
    return cause.words or sentence(Reason(cause.code), "UTC", _)


def cause_rows(causes: Sequence[Cause]) -> list[Row]:
    """Bars with, at ``cumulative``, the share of all failures down to here; ``above`` and ``below`` those of the neighbours, -1 none."""
    rows = []
    for n, cause in enumerate(causes):
        rows.append({"key": n, "label": cause_text(cause), "value": str(cause.number), "share": cause.share, "cumulative": cause.cumulative,
                     "note": formats.percent(cause.cumulative * 100), "above": causes[n - 1].cumulative if n else -1,
                     "below": causes[n + 1].cumulative if n + 1 < len(causes) else -1})
    return rows


def cause_head(causes: Sequence[Cause]) -> str:
    number = sum(cause.number for cause in causes)
    return ngettext("{n} failed run", "{n} failed runs", number).format(n=number) if number else ""


def cause_words(causes: Sequence[Cause]) -> str:
    """How few causes make up most of it."""
    if not causes:
        return _("No run failed.")
    first = next(n for n, cause in enumerate(causes, 1) if cause.cumulative >= VITAL)
    if first == len(causes) or causes[first - 1].code is None:
        return ""
    share = formats.percent(causes[first - 1].cumulative * 100)
    return ngettext("The first reason makes up {share} of all failures.", "The first {n} reasons make up {share} of all failures.",
                    first).format(n=first, share=share)


# ---------------------------------------------------------------------- how long missions take
def trend_rows(trends: Sequence[Trend], first: date | None, last: date | None) -> list[Row]:
    """One per mission: its median in words, and day by day as points of a chart that runs from ``first`` to ``last``."""
    return [_trend_row(trend, first or trend.days[0].day, last or trend.days[-1].day) for trend in trends]


def _trend_row(trend: Trend, first: date, last: date) -> Row:
    length = max(1, (last - first).days)
    usual = trend.usual
    return {
        "key": trend.guid, "mission": trend.mission, "value": formats.duration(trend.median_s), "note": _against(trend),
        "tone": "attention" if trend.is_longer else "neutral",
        "icon": "arrow-up-bold" if trend.is_longer else "arrow-down-bold" if trend.is_shorter else "",
        "points": [((day.day - first).days / length, day.median_s) for day in trend.days],
        "band": [usual.p10_s, usual.p50_s, usual.p90_s] if usual else [],
        "count": ngettext("{n} run", "{n} runs", trend.count).format(n=trend.count)}


def _against(trend: Trend) -> str:
    """The median against what was usual before the period."""
    usual = trend.usual
    if usual is None:
        return _("Too few runs before it to say what is usual")
    values = {"usual": formats.duration(usual.p50_s), "low": formats.duration(usual.p10_s), "high": formats.duration(usual.p90_s)}
    change = trend.median_s / usual.p50_s - 1 if usual.p50_s else 0.0
    text = _("As usual: {usual} ({low} to {high})")
    if trend.is_longer:
        text = _("Clearly longer than usual: {usual} ({low} to {high})")
    elif trend.is_shorter:
        text = _("Clearly shorter than usual: {usual} ({low} to {high})")
    elif change > ROUGHLY:
        text = _("A little longer than usual: {usual} ({low} to {high})")
    elif change < -ROUGHLY:
        text = _("A little shorter than usual: {usual} ({low} to {high})")
    return text.format(**values)


# ---------------------------------------------------------------------- what they mean
MORE = ("delays", "causes", "durations")


def explanation(key: str, figures: Figures, more: MoreFigures) -> tuple[str, str, list[Row]]:
    """Title, what the figure is, and the numbers behind it, of the keys in ``MORE``."""
    title, text, rows = {"delays": lambda: _about_delays(figures.delays), "causes": lambda: _about_causes(more.causes),
                         "durations": lambda: _about_durations(more.trends)}[key]()
    return title, text, [*rows, period_row(figures)]


def _about_delays(delays: Delays) -> tuple[str, str, list[Row]]:
    rows = [{"label": _("Runs"), "value": str(delays.count)}]
    for label, value in ((_("Start delay, median"), delays.p50_s), (_("Start delay, nine of ten within"), delays.p90_s),
                         (_("of it until the robot had accepted, median"), delays.app_p50_s),
                         (_("of it in the robot's queue, median"), delays.queue_p50_s), (_("Run, median"), delays.run_p50_s),
                         (_("Run, nine of ten within"), delays.run_p90_s)):
        rows.append({"label": label, "value": formats.duration(value)})
    return _("Starting and waiting"), _(
        "Of the newest 5,000 planned runs that started. The start delay goes from the planned time to the start on the robot: until "
        "the robot had accepted it, and then in its queue. Waiting is set against the time from start to end, by the robot's own "
        "clock."), rows


def _about_causes(causes: Sequence[Cause]) -> tuple[str, str, list[Row]]:
    rows = [{"label": cause_text(cause), "value": _("{n} · {share}").format(n=cause.number, share=formats.percent(cause.share * 100)),
             "note": ""} for cause in causes]
    return _("Reasons for failure"), _(
        "Failed runs, however they had been started, by why they failed, most frequent first. What the robot ended itself is told in its "
        "own words, without names and numbers. The line shows which share of all failures the reasons down to there make up."), rows


def _about_durations(trends: Sequence[Trend]) -> tuple[str, str, list[Row]]:
    rows = []
    for trend in trends:
        before = ngettext("{n} run before the period", "{n} runs before the period", trend.usual.count).format(n=trend.usual.count) \
            if trend.usual else ""
        runs = ngettext("{n} run", "{n} runs", trend.count).format(n=trend.count)
        rows.append({"label": trend.mission, "value": formats.duration(trend.median_s), "note": f"{runs} · {before}" if before else runs})
    return _("Duration of missions"), _(
        "The median duration of completed runs, day by day, of the missions that took the most time in all. The band is what was usual "
        "before the period: between its edges lay eight of ten of the newest 200 runs. It takes at least 10 runs to draw one."), rows
