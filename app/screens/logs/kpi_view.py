"""The figures of the Logs in words: cards, what each figure means, bars for the charts. Pure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import date

from app.domain.intervals import wilson
from app.domain.models import Reason
from app.domain.reasons import sentence
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.logs.figures import Earlier, Figures
from app.services.history.kpi import Adherence, DayKpis, Delays, RobotKpis, ThesisKpis

MAX_POINTS = 11  # of a card's small history
LEAST_SHARE = 0.1  # that the history of a share spans: less would make a mountain of nothing
ROUGH_FROM_S = 600.0  # a mean duration from here on has no seconds
FEW_CASES = 30  # below it a share is shown with its confidence interval


@dataclass(frozen=True)
class Card:
    """A figure, the number of runs or days it is computed from, and its history, of which the last value is today's. ``value`` is markup;
    ``change`` sets it against the period before. ``least_span``: what the history's drawing spans at least; 0: it begins at zero. One
    that is ``pending`` has texts like those that will come."""

    key: str
    label: str
    value: str
    note: str
    history: tuple[float | None, ...]
    change: str = ""
    least_span: float = 0.0
    pending: bool = False


@dataclass(frozen=True)
class FactLine:
    """A label and its value, with a note under the label."""

    label: str
    value: str
    note: str = ""


@dataclass(frozen=True)
class Explanation:
    """What a figure means, and the numbers behind it."""

    title: str
    text: str
    lines: tuple[FactLine, ...]


@dataclass(frozen=True)
class RobotBar:
    """Utilisation of a robot: its share and its time on missions as text, then what is drawn, 0..1 of the observed time."""

    robot: str
    share: str
    time: str
    busy: float
    charging: float


@dataclass(frozen=True)
class DayBar:
    """How many runs of a day ended how. ``label`` names it among its neighbours."""

    label: str
    completed: int
    not_run: int
    failed: int
    cancelled: int
    date: str = ""


# ---------------------------------------------------------------------- the cards
_OFTEN = ThesisKpis(110, 5, 0, 110, 200000.0, 5, (RobotKpis(0, "", mission_s=200000.0, observed_s=820000.0),))
_LIKELY = Figures(
    _OFTEN,
    Adherence(100, 95, {}),
    Delays(0, None, None, None, None),
    first_day=date(2026, 1, 1),
    last_day=date(2026, 1, 30),
    earlier=Earlier(
        replace(
            _OFTEN,
            failed=8,
            completed_s=180000.0,
            recorded_days=4,
            robots=(RobotKpis(0, "", mission_s=180000.0, observed_s=820000.0),),
        ),
        Adherence(100, 93, {}),
    ),
)


def cards(figures: Figures) -> list[Card]:
    return [_success(figures), _duration(figures), _per_day(figures), _utilisation(figures), _adherence(figures)]


def pending_cards() -> list[Card]:
    """Until the figures are known: with the room that they will need."""
    return [replace(card, value=formats.NOTHING, history=(), pending=True) for card in cards(_LIKELY)]


def _success(figures: Figures) -> Card:
    kpis = figures.thesis
    ended = kpis.completed + kpis.failed
    note = (
        ngettext("{completed} of {n} ended run", "{completed} of {n} ended runs", ended).format(
            completed=kpis.completed, n=ended
        )
        if ended
        else _("no run has ended")
    )
    note = with_interval(note, kpis.completed, ended)
    return Card(
        "success",
        _("Success rate"),
        _share(kpis.success_rate, 1),
        note,
        condense([_ratio(day.completed, day.completed + day.failed) for day in figures.days]),
        change(figures, kpis.success_rate, lambda earlier: earlier.thesis.success_rate, _points),
        LEAST_SHARE,
    )


def _duration(figures: Figures) -> Card:
    kpis = figures.thesis
    note = (
        ngettext("{n} completed run", "{n} completed runs", kpis.timed).format(n=kpis.timed)
        if kpis.timed
        else _("no completed run")
    )
    return Card(
        "duration",
        _("Mean duration"),
        _span(kpis.mean_duration_s),
        note,
        condense([_ratio(day.completed_s, day.timed) for day in figures.days]),
        change(figures, kpis.mean_duration_s, lambda earlier: earlier.thesis.mean_duration_s, _seconds),
    )


def _per_day(figures: Figures) -> Card:
    kpis = figures.thesis
    rate = kpis.completed_per_day
    note = (
        ngettext("{n} recorded day", "{n} recorded days", kpis.recorded_days).format(n=kpis.recorded_days)
        if kpis.recorded_days
        else _("no recorded day")
    )
    digits = 0 if rate is None or rate >= 10 else 1
    return Card(
        "per_day",
        _("Missions per day"),
        formats.number(rate, digits),
        note,
        condense([float(day.completed) if day.total else None for day in figures.days]),
        change(figures, rate, lambda earlier: earlier.thesis.completed_per_day, _number),
    )


def _utilisation(figures: Figures) -> Card:
    kpis = figures.thesis
    note = (
        _("of {duration} observed").format(duration=formats.rough_duration(kpis.observed_s))
        if kpis.observed_s
        else _("never observed")
    )
    return Card(
        "utilisation",
        _("Utilisation"),
        _share(kpis.utilisation, 0),
        note,
        condense(figures.utilisation_days),
        change(figures, kpis.utilisation, lambda earlier: earlier.thesis.utilisation, _points),
        LEAST_SHARE,
    )


def _adherence(figures: Figures) -> Card:
    found = figures.adherence
    note = (
        ngettext("{ran} of {n} planned", "{ran} of {n} planned", found.planned).format(ran=found.ran, n=found.planned)
        if found.planned
        else _("nothing was planned")
    )
    note = with_interval(note, found.ran, found.planned)
    return Card(
        "adherence",
        _("Schedule adherence"),
        _share(found.rate, 1),
        note,
        condense(figures.adherence_days),
        change(figures, found.rate, lambda earlier: earlier.adherence.rate, _points),
        LEAST_SHARE,
    )


def change(
    figures: Figures, value: float | None, same: Callable[[Earlier], float | None], words: Callable[[float], str]
) -> str:
    """Against the same days before: "−1.9 points against the 7 days before"; empty where one of them is not known."""
    before = None if figures.earlier is None else same(figures.earlier)
    if value is None or before is None or figures.first_day is None or figures.last_day is None:
        return ""
    days = (figures.last_day - figures.first_day).days + 1
    size = words(abs(value - before))
    if not size:
        return _("As yesterday by this time") if days == 1 else _("As in the {n} days before").format(n=days)
    size = f"{'+' if value > before else '−'}{size}"
    if days == 1:
        return _("{change} against yesterday by this time").format(change=size)
    return _("{change} against the {n} days before").format(change=size, n=days)


def _points(share: float) -> str:
    text = formats.number(share * 100, 1)
    return _("{n} points").format(n=text) if share * 100 >= 0.05 else ""


def _seconds(seconds: float) -> str:
    return formats.duration(seconds) if seconds >= 1 else ""


def _number(value: float) -> str:
    return formats.number(value, 1) if value >= 0.05 else ""


def _share(value: float | None, digits: int) -> str:
    if value is None:
        return formats.NOTHING
    return with_unit(formats.number(value * 100, 0 if value in (0.0, 1.0) else digits), "%")


def _span(seconds: float | None) -> str:
    """A duration whose units are set smaller."""
    if seconds is None:
        return formats.NOTHING
    parts = (formats.duration if seconds < ROUGH_FROM_S else formats.rough_duration)(seconds).split()
    return " ".join(with_unit(number, unit) for number, unit in zip(parts[::2], parts[1::2], strict=True))


def with_interval(note: str, successes: int, cases: int) -> str:
    """``note``, and for few cases the 95 % confidence interval of their share behind it."""
    ends = wilson(successes, cases) if cases < FEW_CASES else None
    if ends is None:
        return note
    return _("{note} ({low}–{high} %)").format(
        note=note, low=formats.number(ends[0] * 100), high=formats.number(ends[1] * 100)
    )


def with_unit(value: str, unit: str) -> str:
    """Markup of a figure with its unit set smaller behind it."""
    return f"{value}[size=18sp][font=Roboto] {unit}[/font][/size]"


def condense(history: Sequence[float | None]) -> tuple[float | None, ...]:
    """At most MAX_POINTS of it, the means of neighbouring days: a small line shows the trend and not every day. Today, which has not
    ended, stays alone."""
    past = history[:-1]
    size = -(-len(past) // (MAX_POINTS - 1)) or 1
    groups = [past[max(0, end - size) : end] for end in range(len(past), 0, -size)]
    known = [[value for value in group if value is not None] for group in reversed(groups)]
    return (*(sum(values) / len(values) if values else None for values in known), *history[-1:])


def _ratio(part: float, whole: int) -> float | None:
    return part / whole if whole else None


# ---------------------------------------------------------------------- what they mean
def explanation(key: str, figures: Figures) -> Explanation:
    """Of a card."""
    return {
        "success": _about_success,
        "duration": _about_duration,
        "per_day": _about_per_day,
        "utilisation": _about_utilisation,
        "adherence": _about_adherence,
    }[key](figures)


def period_line(figures: Figures) -> FactLine:
    """The days that a figure covers."""
    text, first = formats.wall_day(figures.last_day), figures.first_day or figures.kept_since
    if figures.last_day is not None and first is None:
        text = _("up to {day}").format(day=text)
    elif first != figures.last_day:
        text = f"{formats.wall_day(first, year=figures.first_day is None and _is_long_ago(figures))} – {text}"
    return FactLine(_("Period"), text, reach(figures))


def reach(figures: Figures, narrow_list: bool = False) -> str:
    """Since when runs are kept, where the period begins before that, and that figures count what the list leaves out."""
    all_of_them = _("Figures also count the runs left out") if narrow_list else ""
    if figures.kept_since is None or (figures.first_day is not None and figures.kept_since <= figures.first_day):
        return all_of_them
    kept = _("Runs kept since {day}").format(day=formats.wall_day(figures.kept_since, year=_is_long_ago(figures)))
    return " · ".join(filter(None, (all_of_them, kept)))


def _is_long_ago(figures: Figures) -> bool:
    """In another year."""
    first, last = figures.kept_since, figures.last_day
    return first is not None and last is not None and first.year != last.year


def _about_success(figures: Figures) -> Explanation:
    kpis = figures.thesis
    return Explanation(
        _("Success rate"),
        _("Completed runs out of completed and failed ones. What a person cancelled is left out."),
        (
            FactLine(_("Completed"), str(kpis.completed)),
            FactLine(_("Failed"), str(kpis.failed)),
            FactLine(_("Cancelled, not counted"), str(kpis.cancelled)),
            *_interval_lines(kpis.completed, kpis.completed + kpis.failed),
            period_line(figures),
        ),
    )


def _about_duration(figures: Figures) -> Explanation:
    kpis = figures.thesis
    return Explanation(
        _("Mean duration"),
        _("Of completed runs, from start to end in robot time. Waiting in the robot's queue is left out."),
        (
            FactLine(_("Completed runs"), str(kpis.timed)),
            FactLine(_("Total"), formats.duration(kpis.completed_s)),
            period_line(figures),
        ),
    )


def _about_per_day(figures: Figures) -> Explanation:
    kpis = figures.thesis
    return Explanation(
        _("Missions per day"),
        _("Completed runs per recorded day. A day is recorded when at least one run ended on it."),
        (
            FactLine(_("Completed"), str(kpis.completed)),
            FactLine(_("Recorded days"), str(kpis.recorded_days)),
            period_line(figures),
        ),
    )


def _about_utilisation(figures: Figures) -> Explanation:
    lines = []
    for robot in figures.thesis.robots:
        text = _("{missions} of {observed}").format(
            missions=formats.rough_duration(robot.mission_s), observed=formats.rough_duration(robot.observed_s)
        )
        share = formats.percent(None if robot.utilisation is None else robot.utilisation * 100)
        working = robot.utilisation_of_working_days
        note = (
            _("{share} of the working days").format(share=formats.percent(working * 100)) if working is not None else ""
        )
        lines.append(FactLine(robot.robot, f"{share} · {text}", note))
    text = _(
        "Time on missions that were started from here, out of the time for which the robot was observed. Times without connection, "
        "and those when the app was off, are left out."
    )
    if figures.group:
        text += " " + _("All that the robots of {group} did counts, for whomever.").format(group=figures.group)
    return Explanation(_("Utilisation"), text, (*lines, period_line(figures)))


def _about_adherence(figures: Figures) -> Explanation:
    found, delays = figures.adherence, figures.delays
    lines = [FactLine(_("Planned"), str(found.planned)), FactLine(_("Ran"), str(found.ran))]
    lines += [FactLine(sentence(Reason(code), "UTC", _), str(number)) for code, number in found.not_run.items()]
    lines += _interval_lines(found.ran, found.planned)
    if delays.count:
        lines.append(
            FactLine(
                _("Start delay, median and 90 %"),
                _("{half}, {most}").format(half=formats.duration(delays.p50_s), most=formats.duration(delays.p90_s)),
            )
        )
    return Explanation(
        _("Schedule adherence"),
        _(
            "Planned starts that ran: they reached the robot and were carried out or tried there. The others, by why they did not:"
        ),
        (*lines, period_line(figures)),
    )


def _interval_lines(successes: int, cases: int) -> list[FactLine]:
    """For few cases: the 95 % confidence interval of their share."""
    ends = wilson(successes, cases) if cases < FEW_CASES else None
    if ends is None:
        return []
    return [
        FactLine(
            _("Few cases: probably between"),
            _("{low} and {high}").format(low=formats.percent(ends[0] * 100), high=formats.percent(ends[1] * 100)),
        )
    ]


# ---------------------------------------------------------------------- the charts
def utilisation_bars(figures: Figures) -> list[RobotBar]:
    """One for each robot of the filter."""
    bars = []
    for robot in figures.thesis.robots:
        observed_s = robot.observed_s
        share = formats.percent(None if robot.utilisation is None else robot.utilisation * 100)
        time = formats.rough_duration(robot.mission_s if observed_s or robot.mission_s else None)
        bars.append(
            RobotBar(
                robot.robot, share, time, robot.utilisation or 0.0, robot.charging_s / observed_s if observed_s else 0.0
            )
        )
    return bars


def total_note(figures: Figures) -> str:
    """Time on missions of these robots together."""
    return (
        _("{duration} total").format(duration=formats.rough_duration(figures.thesis.mission_s))
        if figures.thesis.robots
        else ""
    )


def outcome_days(days: Sequence[DayKpis]) -> list[DayBar]:
    names = formats.current().weekdays_short
    long = len(days) > 14
    return [
        DayBar(
            str(day.day.day) if long else names[day.day.weekday()],
            day.completed,
            day.skipped + day.missed,
            day.failed,
            day.cancelled,
            formats.wall_day(day.day),
        )
        for day in days
    ]


def days_note(days: Sequence[DayBar]) -> str:
    """How many there are, which is not what the period has where that is one day, or very long."""
    return ngettext("{n} day", "{n} days", len(days)).format(n=len(days)) if days else ""
