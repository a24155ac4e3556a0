"""The report of a check-up as a page to print, in the language of the app: what an integrator leaves at the site. Pure."""

from __future__ import annotations

from html import escape

from app import __version__
from app.domain.check_up import Finding, Level, Report, Topic
from app.i18n import _
from app.screens.common import formats
from app.screens.common.printed import document, table, unbroken
from app.screens.common.problems import words_of
from app.screens.settings.check_up_view import appearance, counts, queued_sentence
from app.screens.settings.view import machine_phrase
from app.services.check_up.report import TOPICS


def page(report: Report, zone: str) -> str:
    """The whole document."""
    title = _("Check-up of {robot}").format(robot=report.robot)
    tables = [
        _table(level, [finding for finding in report.findings if finding.level is level])
        for level in (Level.RED, Level.AMBER, Level.GREEN)
    ]
    return document(
        f"{title} {formats.day(report.began_at, zone, year=True)}", [_head(report, title, zone), *tables, _foot()]
    )


def _head(report: Report, title: str, zone: str) -> str:
    profile = report.profile
    machine = machine_phrase(report.model, profile.serial_number, profile.software)
    machine = " · ".join(filter(None, (machine, formats.address(report.address))))
    when = f"{formats.day(report.began_at, zone, year=True)} {formats.clock_time(report.began_at, zone)}"
    made = _("Made {when}, {zone}").format(when=when, zone=zone)
    found = counts(report.findings)
    lines = [
        queued_sentence(report),
        *([] if report.is_complete else [_("It was stopped, or there was no answer to the end: check it up again.")]),
    ]
    return (
        f"<h1>{escape(title)}</h1>\n"
        f'<div class="head"><p><strong>{escape(machine)}</strong></p>\n<p class="quiet">{escape(made)}</p></div>\n'
        f"<p><strong>{escape(found[:1].upper() + found[1:])}</strong></p>\n"
        + "\n".join(f"<p>{escape(line)}</p>" for line in lines)
    )


def _table(level: Level, findings: list[Finding]) -> str:
    if not findings:
        return ""
    order = list(Topic)
    return table(
        appearance(level).word,
        (_("What"), _("The robot"), _("For scheduling")),
        [
            (
                escape(words_of(TOPICS[finding.topic])),
                escape(unbroken(words_of(finding.says))),
                escape(unbroken(words_of(finding.means))),
            )
            for finding in sorted(findings, key=lambda finding: order.index(finding.topic))
        ],
        some=(0,),
    )


def _foot() -> str:
    text = _(
        "By AMR Scheduler {version}. What a robot does may change with its software: check it up again after each change."
    ).format(version=__version__)
    return f'<p class="quiet ends">{escape(text)}</p>'
