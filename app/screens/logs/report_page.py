"""The shift report as a page to print, in the language of the app. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from html import escape

from app.domain.activity import NO_DATA
from app.domain.execution import Execution, Reason, State
from app.domain.models import Alarm
from app.domain.reasons import sentence
from app.i18n import _, ngettext
from app.screens.common import execution_appearance, formats
from app.screens.common.alarms_view import alarm_text
from app.screens.common.mission_names import NOTHING_KNOWN, MissionNames
from app.screens.common.name_order import by_name
from app.screens.common.printed import NO_BREAK, document, table, unbroken
from app.screens.logs.activity import word
from app.screens.logs.key_figures import cause_text
from app.screens.logs.numbers import Explanation, FactLine, in_unit, note
from app.services.history import figures
from app.services.history.figures import FIGURES, Facts, Unit
from app.services.history.runs import RobotTimeline
from app.services.history.shift_report import ShiftReport


def page(report: ShiftReport, mission_names: MissionNames = NOTHING_KNOWN) -> str:
    """The whole document; ``mission_names``: what is known of the values that missions get."""
    title = _("Shift report")
    pair = f'<div class="pair">\n{_planned(report)}\n{_causes(report)}\n</div>'
    parts = [
        _head(report, title),
        _figures(report),
        pair,
        _robots(report),
        _runs(report, mission_names),
        _alarms(report),
        f'<p class="quiet ends">{escape(_explained())}</p>',
    ]
    return document(f"{title} {_period(report)}", parts)


def on_screen(report: ShiftReport, mission_names: MissionNames = NOTHING_KNOWN) -> Explanation:
    """The same in short, for devices that can't open the file: the figures, robots, runs that were not completed, and
    alarms."""
    zone, at = report.settings.timezone, report.made_at
    alarms = (
        FactLine(alarm_text(alarm, report.settings, at), formats.day_and_time(alarm.raised_at, zone, at), alarm.note)
        for alarm in report.alarms
    )
    lines = [
        *(FactLine(*figure) for figure in _key_figures(report)),
        *(_robot_in_short(robot) for robot in by_name(report.facts.robots, "robot")),
        *(_run_in_short(run, report, mission_names) for run in report.runs),
        FactLine(_more_runs(report), ""),
        *alarms,
        FactLine(_more_alarms(report), ""),
    ]
    return Explanation(
        _("Shift report"), f"{_period(report)} · {_whose(report)}", tuple(line for line in lines if line.label)
    )


def _robot_in_short(robot: Facts) -> FactLine:
    numbers = (
        (_("Completed"), robot.completed),
        (execution_appearance.word(State.FAILED), robot.failed),
        (_("Cancelled"), robot.cancelled),
    )
    said = " · ".join(f"{label} {number}" for label, number in numbers if number)
    return FactLine(robot.robot, in_unit(robot.value("utilisation"), Unit.SHARE), said)


def _run_in_short(run: Execution, report: ShiftReport, mission_names: MissionNames) -> FactLine:
    zone = report.settings.timezone
    when, why = formats.day_and_time(run.planned_at, zone, report.made_at), execution_appearance.cause_line(run, zone)
    said = " · ".join(filter(None, (when, run.ran_on, why)))
    return FactLine(mission_names.run(run), execution_appearance.word(run.state), said)


def _more_runs(report: ShiftReport) -> str:
    n = report.more_runs
    return ngettext("and {n} more in the log", "and {n} more in the log", n).format(n=n) if n > 0 else ""


def _more_alarms(report: ShiftReport) -> str:
    n = report.more_alarms
    return ngettext("and {n} more", "and {n} more", n).format(n=n) if n else ""


def _explained() -> str:
    return _(
        "Counts runs that ended in the period. Success rate: completed runs as a share of completed and failed ones. "
        "Adherence: planned starts that reached the robot. Utilisation: time on missions as a share of the time for "
        "which the robot was observed. Late: started more than a minute after the planned time. In brackets: the "
        "probable range of the true share when there are few cases (95 %)."
    )


# ---------------------------------------------------------------------- head and figures
def _period(report: ShiftReport) -> str:
    zone = report.settings.timezone
    start, end = formats.local(report.start, zone), formats.local(report.end, zone)
    if start.date() == end.date():
        return f"{formats.wall_day(start.date(), year=True)} {formats.wall_time(start)}–{formats.wall_time(end)}"
    since = f"{formats.wall_day(start.date())} {formats.wall_time(start)}"
    return f"{since} – {formats.wall_day(end.date(), year=True)} {formats.wall_time(end)}"


def _whose(report: ShiftReport) -> str:
    return _("Any of {group}").format(group=report.group) if report.group else report.robot or _("All robots")


def _head(report: ShiftReport, title: str) -> str:
    zone = report.settings.timezone
    made = _("Made {when}, {zone}").format(when=formats.day_and_time(report.made_at, zone), zone=zone)
    return (
        f"<h1>{escape(title)}</h1>\n"
        f'<div class="head"><p><strong>{escape(_period(report))}</strong> · {escape(_whose(report))}</p>\n'
        f'<p class="quiet">{escape(made)}</p></div>'
    )


def _key_figures(report: ShiftReport) -> Sequence[tuple[str, str, str]]:
    """Label, value, and of what."""
    facts, delays = report.facts, report.delays
    most = _("nine of ten within {duration}").format(duration=formats.duration(delays.value("delay_most")))
    n = sum(not robot.is_any for robot in facts.robots)
    robots = ngettext("{n} robot", "{n} robots", n).format(n=n) if n else ""
    return [
        *((_(FIGURES[key].title), _share(facts.value(key)), note(key, facts)) for key in ("success", "adherence")),
        (_(FIGURES["duration"].title), formats.duration(facts.value("duration")), note("duration", facts)),
        (_("Start delay, median"), formats.duration(delays.value("delay_half")), most),
        (_("On missions"), formats.rough_duration(facts.mission_s), robots),
    ]


def _figures(report: ShiftReport) -> str:
    return (
        '<section class="figures">\n'
        + "\n".join(
            f'<div class="figure"><small>{escape(label)}</small><b>{escape(value)}</b>'
            f'<span class="quiet">{escape(unbroken(note))}</span></div>'
            for label, value, note in _key_figures(report)
        )
        + "\n</section>"
        + "".join(f'\n<p class="quiet">{escape(unbroken(figures.line(group, _)))}</p>' for group in report.groups)
    )


def _share(value: float | None) -> str:
    return formats.percent(None if value is None else value * 100, 0 if value in (0.0, 1.0) else 1)


# ---------------------------------------------------------------------- tables
def _planned(report: ShiftReport) -> str:
    facts = report.facts
    counts = [
        (_("Planned"), facts.planned),
        (_("Ran"), facts.ran),
        (_("Late"), report.delays.late),
        (_("Not run"), facts.planned - facts.ran),
    ]
    rows = [[escape(label), str(number)] for label, number in counts]
    rows += [[f"– {escape(sentence(Reason(code), 'UTC', _))}", str(number)] for code, number in facts.not_run.items()]
    ended = [
        (_("Completed"), facts.completed),
        (execution_appearance.word(State.FAILED), facts.failed),
        (_("Cancelled"), facts.cancelled),
        (_("Not run"), facts.skipped + facts.missed),
    ]
    note = _("All runs, also those started by hand or by idleness: {counts}.").format(
        counts=", ".join(f"{label}{NO_BREAK}{number}" for label, number in ended)
    )
    return table(_("Planned and run"), (), rows, (1,), note)


def _robots(report: ShiftReport) -> str:
    timelines = {one.robot_id: one for one in report.timelines}
    robots = by_name(report.facts.robots, "robot")
    return table(
        _("Robots"),
        (
            _("Robot"),
            _("Utilisation"),
            "",
            _("On missions"),
            _("Observed"),
            _("Completed"),
            execution_appearance.word(State.FAILED),
            _("Cancelled"),
        ),
        [_robot(robot) for robot in robots],
        (1, 3, 4, 5, 6, 7),
        note=_("Everything that the robots of {group} did counts, also for others.").format(group=report.group)
        if report.group
        else "",
        more=[_other_time(timelines.get(robot.robot_id)) for robot in robots],
    )


def _robot(robot: Facts) -> Sequence[str]:
    share = robot.value("utilisation")
    bar = f'<span class="bar"><i style="width:{share * 100:.0f}%"></i></span>' if share is not None else ""
    return (
        escape(robot.robot),
        escape(formats.percent(None if share is None else share * 100)),
        bar,
        escape(formats.rough_duration(robot.mission_s)),
        escape(formats.rough_duration(None if robot.is_any else robot.observed_s)),
        str(robot.completed),
        str(robot.failed),
        str(robot.cancelled),
    )


def _other_time(timeline: RobotTimeline | None) -> str:
    """What a robot did other than missions and idling."""
    seconds = timeline.seconds if timeline else {}
    parts = [
        f"{word(kind)} {formats.rough_duration(seconds[kind])}".replace(" ", NO_BREAK)
        for kind in ("charging", "paused", "error", "offline", NO_DATA)
        if seconds.get(kind, 0) >= 60
    ]
    return escape(", ".join(parts))


def _causes(report: ShiftReport) -> str:
    rows = [
        [escape(unbroken(cause_text(cause))), str(cause.number), escape(formats.percent(cause.cumulative * 100))]
        for cause in report.causes
    ]
    if not rows:
        return table(_("Reasons for failure"), (), rows, note=_("No run failed."))
    return table(_("Reasons for failure"), (_("Reason"), _("Number"), _("Cumulative")), rows, (1, 2))


def _runs(report: ShiftReport, mission_names: MissionNames) -> str:
    note = (
        _more_runs(report)
        if report.runs
        else _("Every run that ended was completed.")
        if report.facts.completed
        else _("Nothing ran.")
    )
    return table(
        _("Not completed"),
        (_("Planned"), _("Robot"), _("Mission"), _("Outcome"), _("Reason")) if report.runs else (),
        [_run(run, report, mission_names) for run in report.runs],
        note=note,
        short=(0, 1, 3),
        some=(2,),
    )


def _run(run: Execution, report: ShiftReport, mission_names: MissionNames) -> Sequence[str]:
    return (
        _when(run.planned_at, report),
        escape(run.ran_on),
        escape(mission_names.run(run)),
        escape(execution_appearance.word(run.state)),
        escape(unbroken(execution_appearance.cause_line(run, report.settings.timezone))),
    )


def _alarms(report: ShiftReport) -> str:
    return table(
        _("Alarms"),
        (_("Since"), _("Alarm"), _("Until"), _("Note")) if report.alarms else (),
        [_alarm(alarm, report) for alarm in report.alarms],
        note=_more_alarms(report) if report.alarms else _("There was none."),
        short=(0, 2),
    )


def _alarm(alarm: Alarm, report: ShiftReport) -> Sequence[str]:
    until = _when(alarm.cleared_at, report) if alarm.cleared_at else escape(_("ongoing"))
    return (
        _when(alarm.raised_at, report),
        escape(alarm_text(alarm, report.settings, report.made_at)),
        until,
        escape(alarm.note),
    )


def _when(instant: datetime, report: ShiftReport) -> str:
    return escape(formats.day_and_time(instant, report.settings.timezone, report.made_at))
