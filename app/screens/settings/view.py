"""Settings in words: the sections with their present value, the robots' panels, what a connection test found. Pure.

Missions are in settings_missions_view; rows are dicts of the properties of the row classes that kv names.
"""
from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any
from zoneinfo import ZoneInfo

from app import __version__
from app.domain.message import Message
from app.domain.models import WEEKDAYS, Connection, Robot, Settings
from app.domain.robot import Identity
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.problems import sentence_of, words_of
from app.screens.common.robot_appearance import link_look
from app.screens.settings.facts import SettingsFacts

Row = dict[str, Any]

# key, icon (empty: the robot's own glyph); the words are in section_names
SECTIONS = (
    ("robots", ""), ("missions", "flag-outline"), ("constraints", "shield-check-outline"), ("idle", "sleep"),
    ("scheduler", "calendar-sync-outline"), ("display", "translate"), ("data", "database-outline"), ("about", "information-outline"))

LANGUAGE_NAMES = {"en": "English", "fi": "Suomi"}        # each in its own words, so that nobody is locked out by a wrong choice


@dataclass(frozen=True)
class NoticeView:
    """A block of one tone: sentence and further words. Without ``text`` there is none."""
    text: str = ""
    note: str = ""
    tone: str = "neutral"
    icon: str = ""


# ---------------------------------------------------------------------- sections
def section_names() -> dict[str, str]:
    return {"robots": _("Robots"), "missions": _("Missions"), "constraints": _("Constraints"), "idle": _("Idle automation"),
            "scheduler": _("Scheduler"), "display": _("Display & language"), "data": _("Data"), "about": _("About")}


def section_rows(facts: SettingsFacts, now: datetime, current: str) -> list[Row]:
    """Rows of SectionRow: each section with its present value, amber where something is to be done."""
    names, notes = section_names(), section_notes(facts, now)
    return [{"key": key, "icon": icon, "text": names[key], "note": notes[key].text, "tone": notes[key].tone, "selected": key == current}
            for key, icon in SECTIONS]


def section_notes(facts: SettingsFacts, now: datetime) -> dict[str, NoticeView]:
    settings = facts.settings
    battery = _("Battery {n} %").format(n=formats.plain(settings.minimum_battery_percent)) if settings.minimum_battery_percent else \
        _("No minimum battery")
    return {
        "robots": _robots_note(facts),
        "missions": _missions_note(facts),
        "constraints": NoticeView(_("{battery}, {days}").format(battery=battery, days=days_phrase(settings.working_days))),
        "idle": _idle_note(facts),
        "scheduler": NoticeView(_("asks robots every {n} s").format(n=settings.poll_interval_seconds)),
        "display": NoticeView(f"{theme_names()[settings.theme]}, {language_name(settings.language)}"),
        "data": _backup_note(facts, now),
        "about": NoticeView(_("version {version}").format(version=__version__)),
    }


def _robots_note(facts: SettingsFacts) -> NoticeView:
    if waiting := [robot.name for robot in facts.robots if robot.needs_password]:
        return NoticeView(ngettext("{robots} needs a password", "{robots} need passwords", len(waiting)).format(robots=", ".join(waiting)),
                          tone="attention")
    if not facts.robots:
        return NoticeView(_("none yet"))
    return NoticeView(ngettext("{n} robot", "{n} robots", len(facts.robots)).format(n=len(facts.robots)))


def _missions_note(facts: SettingsFacts) -> NoticeView:
    if not facts.missions:
        return NoticeView(_("none yet"))
    missions = ngettext("{n} mission", "{n} missions", len(facts.missions)).format(n=len(facts.missions))
    missing = sum(1 for mission in facts.missions if facts.robots_missing(mission))
    if not missing:
        return NoticeView(missions)
    return NoticeView(_("{missions}, {n} missing").format(missions=missions, n=missing), tone="attention")


def _idle_note(facts: SettingsFacts) -> NoticeView:
    on = [robot for robot in facts.robots if robot.idle is not None and robot.idle.enabled]
    if not on:
        return NoticeView(_("off"))
    return NoticeView(ngettext("on for {n} robot", "on for {n} robots", len(on)).format(n=len(on)))


def _backup_note(facts: SettingsFacts, now: datetime) -> NoticeView:
    if not facts.backups:
        return NoticeView(_("no backup yet"))
    return NoticeView(_("last backup {when}").format(when=formats.day_and_time(facts.backups[0].made_at, facts.settings.timezone, now)))


# ---------------------------------------------------------------------- words for values
def theme_names() -> dict[str, str]:
    return {"light": _("Light"), "dark": _("Dark"), "contrast": _("High contrast")}


def keyboard_words() -> dict[str, str]:
    """When the keyboard on the screen comes up."""
    return {"auto": _("When needed"), "on": _("Always"), "off": _("Never")}


def language_name(language: str) -> str:
    return LANGUAGE_NAMES.get(language, language)


def weekday_names() -> dict[str, str]:
    """Short ones, by RFC 5545's two letters."""
    return dict(zip(WEEKDAYS, formats.current().weekdays_date, strict=True))


def days_phrase(days: Sequence[str]) -> str:
    """Days of the week in few words: "every day", "Mon–Fri", "Mon, Wed, Fri"."""
    numbers = sorted(WEEKDAYS.index(day) for day in days)
    if len(numbers) == len(WEEKDAYS):
        return _("every day")
    names = list(weekday_names().values())
    runs: list[list[int]] = []
    for number in numbers:
        if runs and runs[-1][-1] == number - 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    words = [f"{names[run[0]]}–{names[run[-1]]}" if len(run) > 2 else ", ".join(names[number] for number in run) for run in runs]
    return ", ".join(words)


def plain_address(address: str) -> str:
    """As people say it: http goes without saying."""
    return address.removeprefix("http://")


def day_chips(settings: Settings) -> list[Row]:
    """Monday to Sunday, the working days chosen."""
    return [{"key": day, "text": name, "selected": day in settings.working_days} for day, name in weekday_names().items()]


# ---------------------------------------------------------------------- robots
def robot_panels(facts: SettingsFacts, now: datetime) -> list[Row]:
    """Rows of RobotPanel."""
    return [_panel(facts, robot, now) for robot in facts.robots]


def _panel(facts: SettingsFacts, robot: Robot, now: datetime) -> Row:
    badge = link_look(robot, facts.snapshot(robot.id), now, facts.settings)
    icon, text, tone = badge.icon, badge.word, badge.tone
    if robot.needs_password:
        icon, text, tone = "key-alert-outline", _("Needs a password"), "attention"
    used, missing = facts.used_on(robot), facts.missing_on(robot)
    row: Row = {
        "key": robot.id, "name": robot.name, "model": robot.model or _("MiR robot"), "address": plain_address(robot.address),
        "serial": robot.serial_number or "–", "software": robot.software or "–",
        "missions": ngettext("{n} in use", "{n} in use", len(used)).format(n=len(used)) if used else _("none in use"),
        "badge": text, "badge_icon": icon, "tone": tone}
    if missing:
        row |= {"missions": ngettext("{n} missing", "{n} missing", len(missing)).format(n=len(missing)), "missions_tone": "attention",
                "missions_icon": "alert"}
    return row


def connection_found(identity: Identity, stored: Robot | None = None) -> NoticeView:
    """What answered. Another serial number than the stored one is another machine, to which nothing is sent."""
    facts = " · ".join(filter(None, (
        identity.model,
        identity.serial_number and _("serial {number}").format(number=identity.serial_number),
        identity.software and _("software {version}").format(version=identity.software))))
    expected = stored.serial_number if stored else None
    if expected and identity.serial_number and identity.serial_number != expected:
        return NoticeView(_("Another robot answers here, not the one with serial {number}").format(number=expected), facts,
                          "attention", "robot-confused-outline")
    name = identity.name or identity.model or _("The robot")
    answer = _("{robot} answers in {n} ms").format(robot=name, n=max(1, round(identity.status.elapsed_s * 1000)))
    return NoticeView(answer, facts, "done", "check-circle")


def went_wrong(problem: BaseException) -> NoticeView:
    return NoticeView(sentence_of(problem), "", "fault", "alert-circle")


def asking_robot() -> NoticeView:
    return NoticeView(_("Asking the robot …"), "", "neutral", "timer-sand")


def is_same_connection(robot: Robot, address: str, username: str, password: str, fingerprint: str) -> bool:
    """Whether nothing that a test would find out has changed since the robot was saved."""
    return (robot.address == address and robot.username == username and not password and (robot.certificate_sha256 or "") == fingerprint
            and not robot.needs_password)


def answers(facts: SettingsFacts, robot: Robot) -> bool:
    """Whether asking the robot for something makes sense now."""
    return robot.enabled and facts.snapshot(robot.id).connection in (Connection.CONNECTED, Connection.SLOW)


# ---------------------------------------------------------------------- time zones
def zone_options(names: Iterable[str], now: datetime) -> list[Row]:
    """Options of the zone picker: places by name with their difference from UTC now; short forms such as EST are left out."""
    places = {name for name in names if "/" in name and name.partition("/")[0] not in ("Etc", "SystemV", "posix", "right")}
    options = []
    for name in sorted(places | {"UTC"}):
        minutes = int((now.astimezone(ZoneInfo(name)).utcoffset() or timedelta()).total_seconds() // 60)
        hours, rest = divmod(abs(minutes), 60)
        options.append({"key": name, "text": name.replace("_", " "), "note": f"UTC{'−' if minutes < 0 else '+'}{hours:02d}:{rest:02d}"})
    return options


# ---------------------------------------------------------------------- files
def backup_options(facts: SettingsFacts, now: datetime) -> list[Row]:
    """Options of the restore picker, newest first."""
    zone = facts.settings.timezone
    return [{"key": str(backup.path), "text": formats.day_and_time(backup.made_at, zone, now), "icon": "database-outline",
             "note": _("{file}, {size} kB").format(file=backup.path.name, size=max(1, round(backup.size / 1000)))}
            for backup in facts.backups]


def backups_phrase(facts: SettingsFacts, now: datetime) -> str:
    if not facts.backups:
        return _("There is no backup yet")
    count = ngettext("{n} backup", "{n} backups", len(facts.backups)).format(n=len(facts.backups))
    newest = formats.day_and_time(facts.backups[0].made_at, facts.settings.timezone, now)
    return _("{backups}, the newest of {when}").format(backups=count, when=newest)


def import_result(lines: Sequence[Message], most: int = 12) -> NoticeView:
    """What an import did; a long list is cut, and says so."""
    if not lines:
        return NoticeView(_("Everything in the file is here already"), tone="done", icon="check-circle")
    shown = [words_of(line) for line in lines[:most]]
    if len(lines) > most:
        shown.append(ngettext("and {n} more", "and {n} more", len(lines) - most).format(n=len(lines) - most))
    text = ngettext("{n} change imported", "{n} changes imported", len(lines)).format(n=len(lines))
    return NoticeView(text, "\n".join(shown), "done", "check-circle")
