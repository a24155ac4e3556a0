"""What a key figure means, and the numbers behind it. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from app.domain.execution import Reason, State
from app.domain.reasons import sentence
from app.i18n import _, ngettext, pgettext
from app.screens.common import execution_appearance, formats
from app.screens.logs.figures import Figures
from app.services.history.figures import FIGURES, GROUP_FIGURES, Facts, GroupFacts, Unit
from app.services.planning.durations import wilson

FEW_CASES = 30  # below it a share has its confidence interval


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


def label(key: str) -> str:
    """The short name of one of FIGURES."""
    return {
        "success": _("Success"),
        "duration": _("Duration"),
        "per_day": pgettext("figure", "Missions"),
        "utilisation": _("In use"),
        "adherence": _("On time"),
    }.get(key) or _(FIGURES[key].title)


def explanation(key: str, figures: Figures) -> Explanation:
    """Of a card."""
    text = _(FIGURES[key].explain)
    if key == "utilisation" and figures.group:
        text += " " + _("Everything that the robots of {group} did counts, also for others.").format(
            group=figures.group
        )
    return Explanation(label(key), text, (*_numbers(key, figures), period_line(figures)))


def period_line(figures: Figures) -> FactLine:
    """The days that a figure covers, and the first stored one, if the period begins before it."""
    last, kept, first = figures.last_day, figures.kept_since, figures.first_day or figures.kept_since
    of_another_year = kept is not None and last is not None and kept.year != last.year
    text = formats.wall_day(last)
    if first is None:
        text = _("up to {day}").format(day=text)
    elif first != last:
        text = f"{formats.wall_day(first, year=figures.first_day is None and of_another_year)} – {text}"
    is_cut = kept is not None and (figures.first_day is None or kept > figures.first_day)
    since = _("Runs kept since {day}").format(day=formats.wall_day(kept, year=of_another_year)) if is_cut else ""
    return FactLine(_("Period"), text, since)


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
        return [_utilisation_line(robot) for robot in facts.robots if not robot.is_any]
    counts = {_("Planned"): facts.planned, _("Ran"): facts.ran}
    counts |= {sentence(Reason(code), "UTC", _): number for code, number in facts.not_run.items()}
    return [
        *_counted(counts),
        *_interval_lines(facts.ran, facts.planned),
        *_delay_lines(figures),
        *(line for group in figures.groups for line in _group_lines(group)),
    ]


def _counted(numbers: Mapping[str, int]) -> list[FactLine]:
    return [FactLine(label, str(number)) for label, number in numbers.items()]


def _utilisation_line(robot: Facts) -> FactLine:
    text = _("{missions} of {observed}").format(
        missions=formats.rough_duration(robot.mission_s), observed=formats.rough_duration(robot.observed_s)
    )
    return FactLine(robot.robot, f"{in_unit(robot.value('utilisation'), Unit.SHARE)} · {text}")


def _delay_lines(figures: Figures) -> list[FactLine]:
    delays = figures.delays
    if not delays.starts:
        return []
    text = _("{half}, {most}").format(
        half=formats.duration(delays.value("delay_half")), most=formats.duration(delays.value("delay_most"))
    )
    return [FactLine(_("Start delay, median and 90 %"), text)]


def _group_lines(group: GroupFacts) -> list[FactLine]:
    """Unknown ones are omitted."""
    return [
        FactLine(_(figure.title), in_unit(value, figure.unit), _("Any of {group}").format(group=group.group))
        for key, figure in GROUP_FIGURES.items()
        if (value := group.value(key)) is not None
    ]


def _interval(successes: int, cases: int) -> tuple[float, float] | None:
    """For few cases: the 95 % confidence interval of their share."""
    return wilson(successes, cases) if cases < FEW_CASES else None


def _interval_lines(successes: int, cases: int) -> list[FactLine]:
    ends = _interval(successes, cases)
    if ends is None:
        return []
    return [
        FactLine(
            _("Few cases: probably between"),
            _("{low} and {high}").format(low=formats.percent(ends[0] * 100), high=formats.percent(ends[1] * 100)),
        )
    ]


# ---------------------------------------------------------------------- in the shift report
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
    text = _("of {duration} observed").format(duration=formats.rough_duration(facts.observed_s))
    return text if facts.observed_s else _("never observed")


def with_interval(note: str, successes: int, cases: int) -> str:
    """``note``, and for few cases the 95 % confidence interval of their share behind it."""
    ends = _interval(successes, cases)
    if ends is None:
        return note
    return _("{note} ({low}–{high} %)").format(
        note=note, low=formats.number(ends[0] * 100), high=formats.number(ends[1] * 100)
    )


def in_unit(value: float | None, unit: Unit) -> str:
    """A figure among others, in a line."""
    if unit is Unit.SECONDS or value is None:
        return formats.duration(value)
    if unit is Unit.POINTS:
        return _("{n} points").format(n=round(value * 100))
    return formats.percent(value * 100) if unit is Unit.SHARE else formats.number(value, 1)
