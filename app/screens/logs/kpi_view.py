"""The figures of the Logs in words: cards, what each figure means, bars for the charts. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date

from app.domain.models import Reason, State
from app.domain.reasons import sentence
from app.i18n import _, ngettext
from app.screens.common import execution_appearance, formats
from app.screens.logs.figures import Figures
from app.services.history.figures import FIGURES, Facts, Figure, Unit
from app.services.planning.durations import wilson

MAX_POINTS = 11  # of a card's small history
LEAST_SHARE = 0.1  # that the history of a share spans: less would make a mountain of nothing
ROUGH_FROM_S = 600.0  # a mean duration from here on has no seconds
FEW_CASES = 30  # below it a share is shown with its confidence interval


@dataclass(frozen=True)
class Card:
    """A figure, the number of runs or days it is computed from, and its history, with today's value last. ``value`` is
    markup; ``change`` sets it against the period before. ``least_span``: what the history's drawing spans at least; 0:
    it begins at zero. One that is ``pending`` has texts like those that will come."""

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
    """Utilisation of a robot: its share and its time on missions as text, then the drawn parts, 0..1 of the observed
    time."""

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
_OFTEN = Facts(
    110,
    5,
    timed=110,
    completed_s=200000.0,
    planned=100,
    ran=95,
    recorded_days=5,
    mission_s=200000.0,
    observed_s=820000.0,
)
_LIKELY = Figures(
    _OFTEN,
    first_day=date(2026, 1, 1),
    last_day=date(2026, 1, 30),
    earlier=replace(_OFTEN, failed=8, completed_s=180000.0, recorded_days=4, mission_s=180000.0, ran=93),
)


def cards(figures: Figures) -> list[Card]:
    """One for each of FIGURES."""
    return [_card(key, figure, figures) for key, figure in FIGURES.items()]


def pending_cards() -> list[Card]:
    """Until the figures are known: with the room that they will need."""
    return [replace(card, value=formats.NOTHING, history=(), pending=True) for card in cards(_LIKELY)]


def _card(key: str, figure: Figure[Facts], figures: Figures) -> Card:
    return Card(
        key,
        _(figure.title),
        _value(figure, figure.compute(figures.facts)),
        note(key, figures.facts),
        condense([figure.compute(day) for day in figures.days]),
        change(figures, key),
        LEAST_SHARE if figure.unit is Unit.SHARE else 0.0,
    )


def _value(figure: Figure[Facts], value: float | None) -> str:
    """With the unit set smaller behind it."""
    if value is None:
        return formats.NOTHING
    if figure.unit is Unit.SHARE:
        return with_unit(formats.number(value * 100, 0 if value in (0.0, 1.0) else figure.digits), "%")
    if figure.unit is Unit.SECONDS:
        parts = (formats.duration if value < ROUGH_FROM_S else formats.rough_duration)(value).split()
        return " ".join(with_unit(number, unit) for number, unit in zip(parts[::2], parts[1::2], strict=True))
    return formats.number(value, 0 if value >= 10 else 1)


def note(key: str, facts: Facts) -> str:
    """What one of FIGURES was computed from."""
    ended = facts.completed + facts.failed
    if key == "success":
        if not ended:
            return _("no run has ended")
        text = ngettext("{completed} of {n} ended run", "{completed} of {n} ended runs", ended)
        return with_interval(text.format(completed=facts.completed, n=ended), facts.completed, ended)
    if key == "adherence":
        if not facts.planned:
            return _("nothing was planned")
        text = ngettext("{ran} of {n} planned", "{ran} of {n} planned", facts.planned)
        return with_interval(text.format(ran=facts.ran, n=facts.planned), facts.ran, facts.planned)
    if key == "duration":
        text = ngettext("{n} completed run", "{n} completed runs", facts.timed).format(n=facts.timed)
        return text if facts.timed else _("no completed run")
    if key == "per_day":
        text = ngettext("{n} recorded day", "{n} recorded days", facts.recorded_days).format(n=facts.recorded_days)
        return text if facts.recorded_days else _("no recorded day")
    if key == "utilisation":
        text = _("of {duration} observed").format(duration=formats.rough_duration(facts.observed_s))
        return text if facts.observed_s else _("never observed")
    return ""


def change(figures: Figures, key: str) -> str:
    """Against the same days before: "−1.9 points against the 7 days before"; empty where one of them is not known."""
    value, before = figures.facts.value(key), None if figures.earlier is None else figures.earlier.value(key)
    if value is None or before is None or figures.first_day is None or figures.last_day is None:
        return ""
    days = (figures.last_day - figures.first_day).days + 1
    size = _difference(abs(value - before), FIGURES[key].unit)
    if not size:
        return _("Same as yesterday at this time") if days == 1 else _("As in the {n} days before").format(n=days)
    size = f"{'+' if value > before else '−'}{size}"
    if days == 1:
        return _("{change} against yesterday at this time").format(change=size)
    return _("{change} against the {n} days before").format(change=size, n=days)


def _difference(size: float, unit: Unit) -> str:
    """Empty if it is too small to show."""
    if unit is Unit.SECONDS:
        return formats.duration(size) if size >= 1 else ""
    size = size * 100 if unit is Unit.SHARE else size
    text = formats.number(size, 1) if size >= 0.05 else ""
    return _("{n} points").format(n=text) if text and unit is Unit.SHARE else text


def in_unit(value: float | None, unit: Unit) -> str:
    """A figure among others, in a line."""
    if unit is Unit.SECONDS or value is None:
        return formats.duration(value)
    if unit is Unit.POINTS:
        return _("{n} points").format(n=round(value * 100))
    return formats.percent(value * 100) if unit is Unit.SHARE else formats.number(value, 1)


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
    """At most MAX_POINTS, as means of neighbouring days: a small line shows the trend and not every day. Today, which
    has not ended, stays separate."""
    past = history[:-1]
    size = -(-len(past) // (MAX_POINTS - 1)) or 1
    groups = [past[max(0, end - size) : end] for end in range(len(past), 0, -size)]
    known = [[value for value in group if value is not None] for group in reversed(groups)]
    return (*(sum(values) / len(values) if values else None for values in known), *history[-1:])


# ---------------------------------------------------------------------- what they mean
def explanation(key: str, figures: Figures) -> Explanation:
    """Of a card."""
    text = _(FIGURES[key].explain)
    if key == "utilisation" and figures.group:
        text += " " + _("Everything that the robots of {group} did counts, also for others.").format(
            group=figures.group
        )
    return Explanation(_(FIGURES[key].title), text, (*_numbers(key, figures), period_line(figures)))


def period_line(figures: Figures) -> FactLine:
    """The days that a figure covers."""
    text, first = formats.wall_day(figures.last_day), figures.first_day or figures.kept_since
    if figures.last_day is not None and first is None:
        text = _("up to {day}").format(day=text)
    elif first != figures.last_day:
        text = f"{formats.wall_day(first, year=figures.first_day is None and _is_long_ago(figures))} – {text}"
    return FactLine(_("Period"), text, reach(figures))


def reach(figures: Figures, narrow_list: bool = False) -> str:
    """The first stored day, if the period begins before it, and the note that figures ignore the list's filters."""
    all_of_them = _("Figures also count the runs left out") if narrow_list else ""
    if figures.kept_since is None or (figures.first_day is not None and figures.kept_since <= figures.first_day):
        return all_of_them
    kept = _("Runs kept since {day}").format(day=formats.wall_day(figures.kept_since, year=_is_long_ago(figures)))
    return " · ".join(filter(None, (all_of_them, kept)))


def _is_long_ago(figures: Figures) -> bool:
    """In another year."""
    first, last = figures.kept_since, figures.last_day
    return first is not None and last is not None and first.year != last.year


def _numbers(key: str, figures: Figures) -> list[FactLine]:
    """That one of FIGURES was computed from."""
    facts = figures.facts
    if key == "success":
        counts = {
            _("Completed"): facts.completed,
            execution_appearance.word(State.FAILED): facts.failed,
            _("Cancelled, not counted"): facts.cancelled,
        }
        return [*_counted(counts), *_interval_lines(facts.completed, facts.completed + facts.failed)]
    if key == "duration":
        return [
            *_counted({_("Completed runs"): facts.timed}),
            FactLine(_("Total"), formats.duration(facts.completed_s)),
        ]
    if key == "per_day":
        return _counted({_("Completed"): facts.completed, _("Recorded days"): facts.recorded_days})
    if key == "utilisation":
        return [_utilisation_line(robot) for robot in facts.robots]
    if key == "adherence":
        counts = {_("Planned"): facts.planned, _("Ran"): facts.ran}
        counts |= {sentence(Reason(code), "UTC", _): number for code, number in facts.not_run.items()}
        return [*_counted(counts), *_interval_lines(facts.ran, facts.planned), *_delay_lines(figures)]
    return []


def _counted(numbers: Mapping[str, int]) -> list[FactLine]:
    return [FactLine(label, str(number)) for label, number in numbers.items()]


def _utilisation_line(robot: Facts) -> FactLine:
    text = _("{missions} of {observed}").format(
        missions=formats.rough_duration(robot.mission_s), observed=formats.rough_duration(robot.observed_s)
    )
    working = robot.mission_s / robot.working_s if robot.working_s > 0 else None
    note = _("{share} of the working days").format(share=formats.percent(working * 100)) if working is not None else ""
    return FactLine(robot.robot, f"{in_unit(robot.value('utilisation'), Unit.SHARE)} · {text}", note)


def _delay_lines(figures: Figures) -> list[FactLine]:
    delays = figures.delays
    if not delays.starts:
        return []
    text = _("{half}, {most}").format(
        half=formats.duration(delays.value("delay_half")), most=formats.duration(delays.value("delay_most"))
    )
    return [FactLine(_("Start delay, median and 90 %"), text)]


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
    return [
        RobotBar(
            robot.robot,
            in_unit(robot.value("utilisation"), Unit.SHARE),
            formats.rough_duration(robot.mission_s if robot.observed_s or robot.mission_s else None),
            robot.value("utilisation") or 0.0,
            robot.charging_s / robot.observed_s if robot.observed_s else 0.0,
        )
        for robot in figures.facts.robots
    ]


def total_note(figures: Figures) -> str:
    """Time on missions of these robots together."""
    return (
        _("{duration} total").format(duration=formats.rough_duration(figures.facts.mission_s))
        if figures.facts.robots
        else ""
    )


def outcome_days(days: Sequence[Facts]) -> list[DayBar]:
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
        if day.day is not None
    ]


def days_note(days: Sequence[DayBar]) -> str:
    """The number of outcomes, which differs from the period's if that is one day or very long."""
    return ngettext("{n} day", "{n} days", len(days)).format(n=len(days)) if days else ""
