"""The figures of the Logs in words: cards with their count, what each means, bars for the charts. Pure."""
from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from app.domain.intervals import wilson
from app.domain.models import Reason
from app.domain.reasons import sentence
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.logs.figures import Figures
from app.services.history.kpi import DayKpis, RobotKpis

Row = dict[str, Any]

MOST_POINTS = 10             # of a card's small history
FEW = 30                     # cases, below which a share is told with how far it can be trusted


# ---------------------------------------------------------------------- the cards
def cards(figures: Figures) -> list[Row]:
    """Five, each with the number of rows it rests on and its history."""
    found = [_success(figures), _duration(figures), _per_day(figures), _utilisation(figures), _adherence(figures)]
    return [{**card, "history": calm(card["history"])} for card in found]


def _success(figures: Figures) -> Row:
    kpis = figures.thesis
    ended = kpis.completed + kpis.failed
    note = ngettext("{completed} of {n} ended run", "{completed} of {n} ended runs", ended).format(completed=kpis.completed, n=ended) \
        if ended else _("no run has ended")
    note = with_interval(note, kpis.completed, ended)
    return {"key": "success", "label": _("Success rate"), "value": _share(kpis.success_rate, 1), "note": note,
            "history": [_ratio(day.completed, day.completed + day.failed) for day in figures.days]}


def _duration(figures: Figures) -> Row:
    kpis = figures.thesis
    note = ngettext("{n} completed run", "{n} completed runs", kpis.timed).format(n=kpis.timed) if kpis.timed else _("no completed run")
    return {"key": "duration", "label": _("Mean duration"), "value": _span(kpis.mean_duration_s), "note": note,
            "history": [day.completed_s / day.timed if day.timed else None for day in figures.days]}


def _per_day(figures: Figures) -> Row:
    kpis = figures.thesis
    rate = kpis.completed_per_day
    note = ngettext("{n} recorded day", "{n} recorded days", kpis.recorded_days).format(n=kpis.recorded_days) \
        if kpis.recorded_days else _("no recorded day")
    digits = 0 if rate is None or rate >= 10 else 1
    return {"key": "per_day", "label": _("Missions per day"), "value": formats.number(rate, digits), "note": note,
            "history": [float(day.completed) if day.total else None for day in figures.days]}


def _utilisation(figures: Figures) -> Row:
    robot = _of(figures.everyone.robots, figures.robot.id) if figures.robot else None
    seen = robot.observed_s if robot else 0.0
    note = _("of {duration} observed").format(duration=formats.rough_duration(seen)) if seen else _("never observed")
    label = _("Utilisation, {robot}").format(robot=figures.robot.name) if figures.robot else _("Utilisation")
    return {"key": "utilisation", "label": label, "value": _share(robot.utilisation if robot else None, 0), "note": note,
            "history": list(figures.utilisation_days)}


def _adherence(figures: Figures) -> Row:
    found = figures.adherence
    note = ngettext("{ran} of {n} planned", "{ran} of {n} planned", found.planned).format(ran=found.ran, n=found.planned) \
        if found.planned else _("nothing was planned")
    note = with_interval(note, found.ran, found.planned)
    return {"key": "adherence", "label": _("Schedule adherence"), "value": _share(found.rate, 1), "note": note,
            "history": list(figures.adherence_days)}


def _share(value: float | None, digits: int) -> str:
    if value is None:
        return formats.NOTHING
    return with_unit(formats.number(value * 100, 0 if value in (0.0, 1.0) else digits), "%")


def _span(seconds: float | None) -> str:
    """A duration whose units are set smaller."""
    if seconds is None:
        return formats.NOTHING
    parts = formats.duration(seconds).split()
    return " ".join(with_unit(number, unit) for number, unit in zip(parts[::2], parts[1::2], strict=True))


def with_interval(note: str, successes: int, cases: int) -> str:
    """Of few cases: how far their share can be trusted, behind it."""
    ends = wilson(successes, cases) if cases < FEW else None
    if ends is None:
        return note
    return _("{note} ({low}–{high} %)").format(note=note, low=formats.number(ends[0] * 100), high=formats.number(ends[1] * 100))


def with_unit(value: str, unit: str) -> str:
    """Markup of a figure with its unit set smaller behind it, as ``app.widgets.display.with_unit`` writes it, without kivy."""
    return f"{value}[size=18sp][font=Roboto] {unit}[/font][/size]"


def calm(history: Sequence[float | None]) -> list[float | None]:
    """At most MOST_POINTS of it: means of days side by side, so that the small line shows where things go and not every day."""
    size = -(-len(history) // MOST_POINTS) or 1
    groups = [history[max(0, end - size):end] for end in range(len(history), 0, -size)]
    known = [[value for value in group if value is not None] for group in reversed(groups)]
    return [sum(values) / len(values) if values else None for values in known]


def _ratio(part: int, whole: int) -> float | None:
    return part / whole if whole else None


def _of(robots: Sequence[RobotKpis], robot_id: int) -> RobotKpis | None:
    return next((robot for robot in robots if robot.robot_id == robot_id), None)


# ---------------------------------------------------------------------- what they mean
def explanation(key: str, figures: Figures) -> tuple[str, str, list[Row]]:
    """Title, what the figure is, and the numbers behind it as rows of label and value."""
    title, text, rows = {"success": _about_success, "duration": _about_duration, "per_day": _about_per_day,
                         "utilisation": _about_utilisation, "adherence": _about_adherence}[key](figures)
    return title, text, [*rows, period_row(figures)]


def period_row(figures: Figures) -> Row:
    """For which days a figure holds."""
    if figures.last_day is None:
        return {"label": _("Period"), "value": formats.NOTHING}
    last = formats.wall_day(figures.last_day)
    if figures.first_day is None:
        return {"label": _("Period"), "value": _("up to {day}").format(day=last)}
    if figures.first_day == figures.last_day:
        return {"label": _("Period"), "value": last}
    return {"label": _("Period"), "value": f"{formats.wall_day(figures.first_day)} – {last}"}


def _about_success(figures: Figures) -> tuple[str, str, list[Row]]:
    kpis = figures.thesis
    rows = [_fact(_("Completed"), kpis.completed), _fact(_("Failed"), kpis.failed), _fact(_("Cancelled, not counted"), kpis.cancelled)]
    return _("Success rate"), _("Completed runs out of completed and failed ones. What a person cancelled is left out."), \
        [*rows, *_trust(kpis.completed, kpis.completed + kpis.failed)]


def _about_duration(figures: Figures) -> tuple[str, str, list[Row]]:
    kpis = figures.thesis
    rows = [{"label": _("Completed runs"), "value": str(kpis.timed)}, {"label": _("Together"), "value": formats.duration(kpis.completed_s)}]
    return _("Mean duration"), \
        _("Of completed runs, from start to end by the robot's own clock. Waiting in the robot's queue is left out."), rows


def _about_per_day(figures: Figures) -> tuple[str, str, list[Row]]:
    kpis = figures.thesis
    rows = [_fact(_("Completed"), kpis.completed), _fact(_("Recorded days"), kpis.recorded_days)]
    return _("Missions per day"), _("Completed runs per recorded day. A day is recorded when at least one run ended on it."), rows


def _about_utilisation(figures: Figures) -> tuple[str, str, list[Row]]:
    rows = []
    for robot in figures.everyone.robots:
        text = _("{missions} of {observed}").format(missions=formats.rough_duration(robot.mission_s),
                                                    observed=formats.rough_duration(robot.observed_s))
        share = formats.percent(None if robot.utilisation is None else robot.utilisation * 100)
        working = robot.utilisation_of_working_days
        note = _("{share} of the working days").format(share=formats.percent(working * 100)) if working is not None else ""
        rows.append({"label": robot.robot, "value": f"{share} · {text}", "note": note})
    return _("Utilisation"), _("Time on missions out of the time for which the robot was seen. Times without connection, and those when "
                               "the app was off, are left out."), rows


def _about_adherence(figures: Figures) -> tuple[str, str, list[Row]]:
    found, delays = figures.adherence, figures.delays
    rows = [{"label": _("Planned"), "value": str(found.planned)}, {"label": _("Ran"), "value": str(found.ran)}]
    rows += [{"label": sentence(Reason(code), "UTC", _), "value": str(number)} for code, number in found.not_run.items()]
    rows += _trust(found.ran, found.planned)
    if delays.count:
        rows.append({"label": _("Start delay, median and 90 %"), "value": _("{half}, {most}").format(
            half=formats.duration(delays.p50_s), most=formats.duration(delays.p90_s))})
    return _("Schedule adherence"), _("Planned starts that ran: they reached the robot and were carried out or tried there. "
                                      "The others, by why they did not:"), rows


def _fact(label: str, number: int) -> Row:
    return {"label": label, "value": str(number)}


def _trust(successes: int, cases: int) -> list[Row]:
    """Of few cases: between which shares the true one lies, 19 times out of 20."""
    ends = wilson(successes, cases) if cases < FEW else None
    if ends is None:
        return []
    return [{"label": _("Few cases: probably between"), "value": _("{low} and {high}").format(
        low=formats.percent(ends[0] * 100), high=formats.percent(ends[1] * 100))}]


# ---------------------------------------------------------------------- the charts
def utilisation_rows(figures: Figures) -> list[tuple[str, str, str, float, float]]:
    """(robot, share, time on missions, on missions 0..1, on the charger 0..1) of all robots."""
    rows = []
    for robot in figures.everyone.robots:
        seen = robot.observed_s
        share = formats.percent(None if robot.utilisation is None else robot.utilisation * 100)
        time = formats.rough_duration(robot.mission_s if seen or robot.mission_s else None)
        rows.append((robot.robot, share, time, robot.utilisation or 0.0,
                     figures.charging_s.get(robot.robot_id, 0.0) / seen if seen else 0.0))
    return rows


def total_note(figures: Figures) -> str:
    """Cumulative duration of all robots."""
    return _("{duration} in all").format(duration=formats.rough_duration(figures.everyone.mission_s)) if figures.everyone.robots else ""


def outcome_days(days: Sequence[DayKpis]) -> list[tuple[str, int, int, int, int]]:
    """(day, completed, skipped and missed, failed, cancelled)."""
    names = formats.current().weekdays_short
    long = len(days) > 14
    return [(str(day.day.day) if long else names[day.day.weekday()], day.completed, day.skipped + day.missed, day.failed, day.cancelled)
            for day in days]
