"""The shift report as one HTML page without scripts or other files, for printing on A4, in the language of the app. Pure.

Everything that comes from people, robots or files goes through ``html.escape``.
"""
from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from datetime import datetime
from html import escape

from app.domain.activity import NO_DATA
from app.domain.models import Alarm, Execution, Reason, State
from app.domain.reasons import sentence
from app.i18n import _, ngettext, translator
from app.screens.common import execution_appearance, formats
from app.screens.common.alarms_view import alarm_text
from app.screens.logs.kpi_view import with_interval
from app.screens.logs.more_view import cause_text
from app.screens.logs.robot_states import word
from app.services.history import group_kpi
from app.services.history.kpi import RobotKpis
from app.services.history.robot_states import RobotTimeline
from app.services.history.shift_report import ShiftReport

STYLE = """
@page { size: A4; margin: 12mm }
* { box-sizing: border-box }
body { margin: 0 auto; max-width: 190mm; padding: 8mm; font: 10pt/1.3 system-ui, "Segoe UI", Roboto, sans-serif; color: #101c25;
  background: #fff }
h1 { font-size: 18pt; line-height: 1.1; margin: 0 }
h2 { font-size: 11pt; margin: 4mm 0 1mm; border-bottom: 1px solid #76838f; break-after: avoid }
p { margin: 1mm 0 }
.quiet { color: #44525f }
.head { display: flex; flex-wrap: wrap; align-items: end; justify-content: space-between; gap: 0 8mm }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(31mm, 1fr)); gap: 2mm; margin: 3mm .3mm 0 }
.figure { display: grid; grid-row: span 3; grid-template-rows: subgrid; row-gap: 0; border: 1px solid #76838f; border-radius: 2mm;
  padding: 1.5mm 2mm }
.figure b { font-size: 14pt; line-height: 1.2; white-space: nowrap }
.figure small, .figure span { font-size: 8pt; line-height: 1.2 }
.figure small { align-self: end }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(75mm, 1fr)); gap: 0 8mm }
table { width: 100%; border-collapse: collapse; font-size: 9pt }
thead { display: table-header-group }
tr { break-inside: avoid }
th, td { text-align: left; vertical-align: top; padding: .5mm 3mm .5mm 0; border-bottom: 1px solid #c3cad1 }
th:last-child, td:last-child { padding-right: 0 }
th { font-weight: 600; color: #44525f; vertical-align: bottom }
td.number, th.number { text-align: right; white-space: nowrap }
td.short { white-space: nowrap }
td.some { min-width: 42mm }
tr.more td { border-top-style: hidden }
tr.with-more td { border-bottom-style: none }
.bar { display: block; width: 16mm; height: 2.6mm; margin-top: .8mm; border: 1px solid #101c25 }
.bar i { display: block; height: 100%; background: #101c25 }
.ends { margin-top: 4mm; font-size: 8pt; line-height: 1.25 }
@media screen and (max-width: 170mm) { section { overflow-x: auto } td.some { min-width: 24mm } }
@media print { body { padding: 0; max-width: none; font-size: 9pt } * { -webkit-print-color-adjust: exact; print-color-adjust: exact } }
"""
NO_BREAK, JOIN = "\N{NO-BREAK SPACE}", "\N{WORD JOINER}"


_UNIT = re.compile(r"(?<=\d) (?=\D)| (?=…)")            # between a number and its unit, before what is left out
_RANGE = re.compile(r"(?<=\d)–(?=\d)")


def page(report: ShiftReport) -> str:
    """The whole document."""
    title = _("Shift report")
    pair = f'<div class="pair">\n{_planned(report)}\n{_causes(report)}\n</div>'
    parts = [_head(report, title), _figures(report), pair, _robots(report), _runs(report), _alarms(report),
             f'<p class="quiet ends">{escape(_explained())}</p>']
    return (f'<!DOCTYPE html>\n<html lang="{escape(translator.language)}">\n<head>\n<meta charset="utf-8">\n'
            '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; style-src \'unsafe-inline\'">\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{escape(f'{title} {_period(report)}')}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
            + "\n".join(part for part in parts if part) + "\n</body>\n</html>\n")


def _explained() -> str:
    return _(
        "Runs count that ended in the period. Success rate: completed out of completed and failed ones. Adherence: planned starts that "
        "reached the robot. Utilisation: time on missions out of the time for which the robot was observed. Late: started more than "
        "a minute after the planned time. In brackets: where the true share probably lies when there are few cases (95 %).")


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
    return (f"<h1>{escape(title)}</h1>\n"
            f'<div class="head"><p><strong>{escape(_period(report))}</strong> · {escape(_whose(report))}</p>\n'
            f'<p class="quiet">{escape(made)}</p></div>')


def _figures(report: ShiftReport) -> str:
    thesis, adherence, delays = report.thesis, report.adherence, report.delays
    tried = thesis.completed + thesis.failed
    shown = [
        (_("Success rate"), _share(thesis.success_rate), with_interval(
            ngettext("{completed} of {n} ended run", "{completed} of {n} ended runs", tried).format(completed=thesis.completed, n=tried),
            thesis.completed, tried)),
        (_("Schedule adherence"), _share(adherence.rate), with_interval(
            ngettext("{ran} of {n} planned", "{ran} of {n} planned", adherence.planned).format(ran=adherence.ran, n=adherence.planned),
            adherence.ran, adherence.planned)),
        (_("Mean duration"), formats.duration(thesis.mean_duration_s),
         ngettext("{n} completed run", "{n} completed runs", thesis.timed).format(n=thesis.timed)),
        (_("Start delay, median"), formats.duration(delays.p50_s),
         _("nine of ten within {duration}").format(duration=formats.duration(delays.p90_s))),
        (_("On missions"), formats.rough_duration(thesis.mission_s), ngettext("{n} robot", "{n} robots", len(thesis.robots)).format(
            n=len(thesis.robots)))]
    return '<section class="figures">\n' + "\n".join(
        f'<div class="figure"><small>{escape(label)}</small><b>{escape(value)}</b>'
        f'<span class="quiet">{escape(_unbroken(note))}</span></div>' for label, value, note in shown) + "\n</section>" + "".join(
            f'\n<p class="quiet">{escape(_unbroken(group_kpi.line(group, _)))}</p>' for group in report.groups)


def _unbroken(text: str) -> str:
    """Numbers stay on one line with their units and ranges."""
    return _RANGE.sub(JOIN + "–" + JOIN, _UNIT.sub(NO_BREAK, text))


def _share(value: float | None) -> str:
    return formats.percent(None if value is None else value * 100, 0 if value in (0.0, 1.0) else 1)


# ---------------------------------------------------------------------- tables
def _table(title: str, head: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = (), note: str = "",
           short: Sequence[int] = (), some: Sequence[int] = (), more: Sequence[str] = ()) -> str:
    """A section. ``rows`` are HTML already; ``numbers`` are the columns aligned right, ``short`` those that never wrap, ``some`` those with
    a least width; ``more`` has for each row a further line below it over the whole width."""
    def kind(n: int) -> str:
        name = "number" if n in numbers else "short" if n in short else "some" if n in some else ""
        return f' class="{name}"' if name else ""

    def line(n: int, row: Sequence[str]) -> str:
        cells = "".join(f"<td{kind(n)}>{cell}</td>" for n, cell in enumerate(row))
        if not any(more[n:n + 1]):
            return f"<tr>{cells}</tr>"
        return f'<tr class="with-more">{cells}</tr>\n<tr class="more"><td></td><td colspan="{len(row) - 1}">{more[n]}</td></tr>'

    top = f"<thead><tr>{''.join(f'<th{kind(n)}>{escape(text)}</th>' for n, text in enumerate(head))}</tr></thead>\n" if head else ""
    body = "\n".join(line(n, row) for n, row in enumerate(rows))
    table = f"<table>\n{top}{body}\n</table>\n" if body else ""
    foot = f'<p class="quiet">{escape(note)}</p>\n' if note else ""
    return f"<section>\n<h2>{escape(title)}</h2>\n{table}{foot}</section>"


def _planned(report: ShiftReport) -> str:
    adherence, thesis = report.adherence, report.thesis
    counts = [(_("Planned"), adherence.planned), (_("Ran"), adherence.ran), (_("Late"), report.delays.late),
              (_("Did not run"), adherence.planned - adherence.ran)]
    rows = [[escape(label), str(number)] for label, number in counts]
    rows += [[f"– {escape(sentence(Reason(code), 'UTC', _))}", str(number)] for code, number in adherence.not_run.items()]
    ended = [(_("Completed"), thesis.completed), (execution_appearance.word(State.FAILED), thesis.failed),
             (_("Cancelled"), thesis.cancelled), (_("Skipped"), report.skipped), (_("Missed"), report.missed)]
    note = _("All runs, also those started by hand or by idleness: {counts}.").format(
        counts=", ".join(f"{label}{NO_BREAK}{number}" for label, number in ended))
    return _table(_("Planned and run"), (), rows, (1,), note)


def _robots(report: ShiftReport) -> str:
    timelines = {one.robot_id: one for one in report.timelines}
    robots = report.thesis.robots
    return _table(_("Robots"), (_("Robot"), _("Utilisation"), "", _("On missions"), _("Observed"), _("Completed"),
                                execution_appearance.word(State.FAILED), _("Cancelled")),
                  [_robot(robot) for robot in robots], (1, 3, 4, 5, 6, 7),
                  note=_("All that the robots of {group} did counts, for whomever.").format(group=report.group) if report.group else "",
                  more=[_other_time(timelines.get(robot.robot_id)) for robot in robots])


def _robot(robot: RobotKpis) -> Sequence[str]:
    share = robot.utilisation
    bar = f'<span class="bar"><i style="width:{share * 100:.0f}%"></i></span>' if share is not None else ""
    return (escape(robot.robot), escape(formats.percent(None if share is None else share * 100)), bar,
            escape(formats.rough_duration(robot.mission_s)), escape(formats.rough_duration(robot.observed_s)), str(robot.completed),
            str(robot.failed), str(robot.cancelled))


def _other_time(timeline: RobotTimeline | None) -> str:
    """What a robot did other than missions and idling."""
    seconds = timeline.seconds if timeline else {}
    parts = [f"{word(kind)} {formats.rough_duration(seconds[kind])}".replace(" ", NO_BREAK)
             for kind in ("charging", "paused", "error", "offline", NO_DATA) if seconds.get(kind, 0) >= 60]
    return escape(", ".join(parts))


def _causes(report: ShiftReport) -> str:
    rows = [[escape(_unbroken(cause_text(cause))), str(cause.number), escape(formats.percent(cause.cumulative * 100))]
            for cause in report.causes]
    if not rows:
        return _table(_("Reasons for failure"), (), rows, note=_("No run failed."))
    return _table(_("Reasons for failure"), (_("Reason"), _("Number"), _("Cumulative")), rows, (1, 2))


def _runs(report: ShiftReport) -> str:
    more = ngettext("and {n} more in the log", "and {n} more in the log", report.more_runs).format(n=report.more_runs) \
        if report.more_runs > 0 else ""
    note = more if report.runs else _("Every run that ended was completed.") if report.thesis.completed else _("Nothing ran.")
    return _table(_("Not completed"), (_("Planned"), _("Robot"), _("Mission"), _("Outcome"), _("Reason")) if report.runs else (),
                  [_run(run, report) for run in report.runs], note=note, short=(0, 1, 3), some=(2,))


def _run(run: Execution, report: ShiftReport) -> Sequence[str]:
    reason = _unbroken(sentence(run.reason, report.settings.timezone, _)) if run.reason else ""
    return (_when(run.planned_at, report), escape(run.robot), escape(run.mission), escape(execution_appearance.word(run.state)),
            escape(reason))


def _alarms(report: ShiftReport) -> str:
    note = ngettext("and {n} more", "and {n} more", report.more_alarms).format(n=report.more_alarms) if report.more_alarms else ""
    return _table(_("Alarms"), (_("Since"), _("Alarm"), _("Until"), _("Note")) if report.alarms else (),
                  [_alarm(alarm, report) for alarm in report.alarms], note=note if report.alarms else _("There was none."),
                  short=(0, 2))


def _alarm(alarm: Alarm, report: ShiftReport) -> Sequence[str]:
    until = _when(alarm.cleared_at, report) if alarm.cleared_at else escape(_("ongoing"))
    return (_when(alarm.raised_at, report), escape(alarm_text(alarm, report.settings, report.made_at)), until, escape(alarm.note))


def _when(instant: datetime, report: ShiftReport) -> str:
    return escape(formats.day_and_time(instant, report.settings.timezone, report.made_at))
