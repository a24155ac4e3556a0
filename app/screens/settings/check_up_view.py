"""Texts and values of a robot's or a fleet's check-up in Settings: its state, findings, and what will move. Pure functions."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from datetime import datetime

from app.domain.check_up import Finding, Level, Progress, Report, Topic, Trial
from app.domain.models import Fleet, InvalidInput, Robot
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.problems import sentence_of, words_of
from app.screens.common.robot_appearance import Appearance
from app.screens.settings.view import NoticeView, went_wrong
from app.services.check_up.report import LEVELS, TOPICS
from app.widgets.items import Action, Item, Option

OFFERED = ""  # in place of a mission's name: the one that waits a second
QUEUED = 4  # missions of a trial


def appearance(level: Level) -> Appearance:
    """Of a level: never the colour alone."""
    icon, tone = {
        Level.RED: ("alert-circle", "fault"),
        Level.AMBER: ("information-outline", "action"),
        Level.GREEN: ("check", "neutral"),
    }[level]
    return Appearance(words_of(LEVELS[level]), icon, tone)


# ---------------------------------------------------------------------- how a robot stands
def standing(
    target: Robot | Fleet, report: Report | None, now: datetime, zone: str, *, is_left: bool = False
) -> NoticeView:
    """One line: when it was checked up, and the result. ``is_left``: changes of an interrupted trial remain."""
    if is_left:
        return NoticeView(
            _("Changes of a check-up must still be undone there"), tone="attention", icon="backup-restore"
        )
    if report is None:
        return NoticeView(_("Never checked up"), icon="clipboard-outline")
    if why := outdated(target, report):
        return NoticeView(why, tone="attention", icon="update")
    when = formats.local(report.began_at, zone).date()
    day = _("today") if when == formats.local(now, zone).date() else formats.wall_day(when, year=when.year != now.year)
    seen = appearance(report.level)
    return NoticeView(
        _("Checked up {day}: {found}").format(day=day, found=counts(report.findings)), tone=seen.tone, icon=seen.icon
    )


def outdated(target: Robot | Fleet, report: Report) -> str:
    """Why the report is outdated; empty: it is not."""
    profile = report.profile
    known = target.identity if isinstance(target, Fleet) else target.serial_number
    if profile.serial_number != known:
        return _("It is another machine now: check it up")
    if profile.software != target.software:
        return _("Software is {version} now: check it up again").format(version=target.software or "?")
    return ""


def counts(findings: Sequence[Finding]) -> str:
    """1 problem, 2 notes"""
    red, amber = (sum(finding.level is level for finding in findings) for level in (Level.RED, Level.AMBER))
    words = [ngettext("{n} problem", "{n} problems", red).format(n=red)] if red else []
    words += [ngettext("{n} note", "{n} notes", amber).format(n=amber)] if amber else []
    return ", ".join(words) or _("all fine")


# ---------------------------------------------------------------------- the report
def verdict(target: Robot | Fleet, report: Report, zone: str) -> NoticeView:
    """Its head: the result, when it was made, and whether anything was queued."""
    seen = appearance(report.level)
    found = counts(report.findings)
    text = found[:1].upper() + found[1:]
    lines = [
        f"{formats.day_and_time(report.began_at, zone)} · {formats.duration(report.took_s)}",
        queued_sentence(report),
    ]
    if not report.is_complete:
        lines.append(_("It was stopped, or there was no answer to the end: check it up again."))
    if why := outdated(target, report):
        lines.append(why)
    tone = "attention" if report.level is Level.GREEN and len(lines) > 2 else seen.tone
    return NoticeView(text, "\n".join(lines), tone, seen.icon)


def queued_sentence(report: Report) -> str:
    return (
        _("Tried with the mission {mission}").format(mission=report.mission)
        if report.mission
        else _("Only read: no mission was queued")
    )


def finding_items(findings: Sequence[Finding], opened: Collection[str] = ()) -> list[Item]:
    """A row for each, the worst first, then in the order of topics. A tap on what is not in order shows its meaning."""
    levels, order = [Level.RED, Level.AMBER, Level.GREEN], list(Topic)
    ordered = sorted(findings, key=lambda finding: (levels.index(finding.level), order.index(finding.topic)))
    return [_finding_item(f"{finding.topic} {n}", finding, opened) for n, finding in enumerate(ordered)]


def _finding_item(key: str, finding: Finding, opened: Collection[str]) -> Item:
    seen, is_open, means = appearance(finding.level), key in opened, words_of(finding.means)
    arrow = Action("open", icon="chevron-up" if is_open else "chevron-down")
    return Item(
        key,
        words_of(finding.says),
        words_of(TOPICS[finding.topic]),
        icon=seen.icon,
        tone=seen.tone,
        note=means if is_open else "",
        strong=finding.level is Level.RED,
        opens=bool(means),
        actions=(arrow,) if means else (),
    )


# ---------------------------------------------------------------------- before
def reads(target: Robot | Fleet) -> str:
    if isinstance(target, Fleet):
        return _("Robots, clock, rights, missions, and how its orders are listed")
    return _("Identity, clock, rights, missions, maps, queue, and how fast it answers")


def begins(trial: Trial | None, seconds: float, *, of_fleet: bool = False) -> str:
    """How long it takes, and whether anything moves."""
    if trial is None:
        return _("Reads only: takes about {time}, nothing moves").format(time=formats.duration(seconds))
    if of_fleet:
        text = _("Reads first, then makes one order for tomorrow and deletes it: takes about {time}")
        return text.format(time=formats.duration(seconds))
    return _("Reads first, then queues missions: takes about {time}").format(time=formats.duration(seconds))


def mission_options(names: Sequence[str], *, of_fleet: bool = False) -> list[Option]:
    """The offered one first, then the robot's own; on a fleet none is made."""
    offered = Option(OFFERED, mission_word(OFFERED), "timer-sand", _("Nothing drives"))
    return [*([] if of_fleet else [offered]), *(Option(name, name, "flag-outline") for name in names)]


def mission_word(mission: str) -> str:
    return mission or _("One that waits a second, made and removed again")


def not_yet(target: Robot | Fleet) -> str:
    """Why it can't begin."""
    return _("Choose a mission and a robot") if isinstance(target, Fleet) else asking(target).text


def asking(target: Robot | Fleet) -> NoticeView:
    text = _("Asking the fleet …") if isinstance(target, Fleet) else _("Asking the robot …")
    return NoticeView(text, icon="timer-sand")


def begin_word(target: Robot | Fleet, trial: Trial | None) -> str:
    """What the button does, by its name."""
    if trial is None:
        return _("Check up")
    if isinstance(target, Fleet):
        return _("Make one order for tomorrow")
    return _("Queue {n} missions on {robot}").format(n=QUEUED, robot=target.name)


def refused(problem: BaseException) -> NoticeView:
    """Why it can't run now, or what went wrong."""
    if isinstance(problem, InvalidInput):
        return NoticeView(sentence_of(problem), tone="attention", icon="clock-alert-outline")
    return went_wrong(problem)


# ---------------------------------------------------------------------- while it runs
def progress_words(
    target: Robot | Fleet, progress: Progress | None, *, stopping: bool = False
) -> tuple[str, str, float]:
    """Its present step, its progress in words, and as a share (0–1)."""
    if progress is None:
        return asking(target).text, "", 0.0
    share = min(1.0, progress.done / progress.of) if progress.of else 0.0
    says = _("Stopping: changes are being undone") if stopping else words_of(progress.says)
    return says, how_far(progress), share


def waits(target: Robot | Fleet, seconds: float) -> str:
    return _("Waiting {time} for {robot}. Without an answer it continues after a minute.").format(
        time=formats.duration(seconds), robot=target.name
    )


def how_far(progress: Progress) -> str:
    return _("{done} of about {of}").format(done=formats.duration(progress.done), of=formats.duration(progress.of))


def under_way(progress: Progress | None) -> NoticeView:
    """For the robot's row."""
    if progress is None:
        return NoticeView(_("Is being checked up"), tone="accent", icon="clipboard-clock-outline")
    text = _("Is being checked up: {progress}").format(progress=how_far(progress))
    return NoticeView(text, tone="accent", icon="clipboard-clock-outline")


def ended_sentence(report: Report) -> NoticeView:
    """For the snackbar."""
    found = counts(report.findings)
    text = (
        _("{robot} is checked up: {found}") if report.is_complete else _("The check-up of {robot} ended early: {found}")
    )
    return NoticeView(text.format(robot=report.robot, found=found), icon=appearance(report.level).icon)
