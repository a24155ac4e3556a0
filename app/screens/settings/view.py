"""Texts and values that Settings shows: sections, rows of robots, the result of a connection test. Pure functions of the facts.

Those of missions are in missions_view.py, those of the calendar in calendar_view.py.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from app import __version__
from app.domain.message import Message
from app.domain.models import WEEKDAYS, Connection, HandOver, Robot
from app.domain.robot import IdentifiedBy, Identity
from app.i18n import _, ngettext
from app.mir.credentials import Token
from app.mir.errors import CertificateProblem
from app.screens.common import formats
from app.screens.common.problems import is_of_robot, sentence_of, words_of
from app.screens.common.robot_appearance import link_appearance
from app.screens.common.robot_groups import robots_in_words
from app.screens.settings.facts import SettingsFacts
from app.services.catalogue.configuration.import_lines import stops_a_robot
from app.services.catalogue.configuration.importing import DeletesRuns
from app.services.files.places import FoundFile
from app.widgets.items import Action, Item

# key, icon; the names are in section_names
SECTIONS = (
    ("setup", "flag-checkered"),
    ("robots", "robot-outline"),
    ("missions", "flag-outline"),
    ("constraints", "shield-check-outline"),
    ("idle", "sleep"),
    ("scheduler", "calendar-sync-outline"),
    ("display", "translate"),
    ("data", "database-outline"),
    ("about", "information-outline"),
)


@dataclass(frozen=True)
class NoticeView:
    """A message in a block of one tone; without ``text`` it is not shown."""

    text: str = ""
    note: str = ""
    tone: str = "neutral"
    icon: str = ""


def done(text: str, note: str = "") -> NoticeView:
    return NoticeView(text, note, "done", "check-circle")


# ---------------------------------------------------------------------- sections
def section_names() -> dict[str, str]:
    return {
        "setup": _("Set-up"),
        "robots": _("Robots"),
        "missions": _("Missions"),
        "constraints": _("Conditions"),
        "idle": _("When idle"),
        "scheduler": _("Planning"),
        "display": _("Display"),
        "data": _("Data"),
        "about": _("About"),
    }


def section_items(facts: SettingsFacts, now: datetime, current: str, setup: str = "") -> list[Item]:
    """Each section with its present value, amber if there is something to do. ``setup``: how far that is; empty: done, and not shown."""
    names, notes = section_names(), {"setup": NoticeView(setup), **section_notes(facts, now)}
    return [
        Item(
            key,
            names[key],
            notes[key].text,
            icon=icon,
            support_tone=notes[key].tone,
            look="chosen" if key == current else "plain",
        )
        for key, icon in SECTIONS
        if notes[key].text
    ]


def section_notes(facts: SettingsFacts, now: datetime) -> dict[str, NoticeView]:
    settings = facts.settings
    battery = (
        _("{n} %").format(n=formats.plain(settings.minimum_battery_percent)) if settings.minimum_battery_percent else ""
    )
    return {
        "robots": _robots_note(facts),
        "missions": _missions_note(facts),
        "constraints": NoticeView(", ".join(filter(None, (battery, days_phrase(settings.working_days))))),
        "idle": _idle_note(facts),
        "scheduler": NoticeView(_("reads every {n} s").format(n=settings.poll_interval_seconds)),
        "display": NoticeView(f"{theme_names()[settings.theme]}, {formats.language_name(settings.language)}"),
        "data": _backup_note(facts, now),
        "about": NoticeView(__version__),
    }


def _robots_note(facts: SettingsFacts) -> NoticeView:
    if waiting := [robot.name for robot in facts.robots if robot.needs_password]:
        return NoticeView(
            ngettext("{robots} needs a password", "{robots} need passwords", len(waiting)).format(
                robots=", ".join(waiting)
            ),
            tone="attention",
        )
    if not facts.robots:
        return NoticeView(_("none yet"))
    robots = robots_in_words(facts.robots)
    groups = ngettext("{n} group", "{n} groups", len(facts.groups)).format(n=len(facts.groups)) if facts.groups else ""
    return NoticeView(", ".join(filter(None, (robots, groups))))


def _missions_note(facts: SettingsFacts) -> NoticeView:
    if not facts.missions:
        return NoticeView(_("none yet"))
    missions = ngettext("{n} mission", "{n} missions", len(facts.missions)).format(n=len(facts.missions))
    missing = sum(1 for mission in facts.missions if facts.robots_missing(mission))
    if not missing:
        return NoticeView(missions)
    return NoticeView(_("{n}, {missing} missing").format(n=len(facts.missions), missing=missing), tone="attention")


def _idle_note(facts: SettingsFacts) -> NoticeView:
    on = [robot for robot in facts.robots if robot.idle is not None and robot.idle.enabled]
    if not on:
        return NoticeView(_("off"))
    return NoticeView(robots_in_words(on))


def _backup_note(facts: SettingsFacts, now: datetime) -> NoticeView:
    if not facts.backups:
        return NoticeView(_("no backup yet"))
    return NoticeView(
        _("last backup {when}").format(
            when=formats.day_and_time(facts.backups[0].changed_at, facts.settings.timezone, now)
        )
    )


# ---------------------------------------------------------------------- words for values
def theme_names() -> dict[str, str]:
    return {"light": _("Light"), "dark": _("Dark"), "contrast": _("High contrast")}


def keyboard_words() -> dict[str, str]:
    """When the on-screen keyboard appears."""
    return {"auto": _("When needed"), "on": _("Always"), "off": _("Never")}


def weekday_names() -> dict[str, str]:
    """Short ones, by RFC 5545's two letters."""
    return dict(zip(WEEKDAYS, formats.current().weekdays_date, strict=True))


def days_phrase(days: Sequence[str]) -> str:
    """Days of the week in few words: "every day", "Mon–Fri", "Mon, Wed, Fri"."""
    return _("every day") if len({*days}) == len(WEEKDAYS) else formats.weekdays(days)


# ---------------------------------------------------------------------- robots
def robot_items(
    facts: SettingsFacts, now: datetime, check_ups: Mapping[int, NoticeView], chosen: int | None = None
) -> list[Item]:
    """A row per robot, with what is wrong with it; ``check_ups``: how they stand, by robot."""
    return [_robot_item(facts, robot, now, check_ups.get(robot.id, NoticeView()), chosen) for robot in facts.robots]


def _robot_item(facts: SettingsFacts, robot: Robot, now: datetime, check_up: NoticeView, chosen: int | None) -> Item:
    link = link_appearance(robot, facts.snapshot(robot.id), now, facts.settings)
    groups = ", ".join(group.name for group in facts.groups if robot.id in group.members)
    model = _("Any robot of the fleet") if robot.is_any else robot.model or _("MiR robot")
    way = robot.fleet.name if robot.fleet else groups or formats.address(robot.address)
    problem = _problem(facts, robot, check_up)
    if not problem.text and (link.tone != "neutral" or not robot.enabled):
        problem = NoticeView(link.word, tone=link.tone)
    return Item(
        robot.id,
        robot.name,
        " · ".join(part for part in (model, way, groups if robot.fleet else "") if part),
        problem.text,
        icon=link.icon,
        tone=link.tone,
        look="chosen" if robot.id == chosen else "plain",
        meta_tone=problem.tone,
        meta_icon=problem.icon,
        actions=(Action("open", icon="chevron-right"),),
    )


def _problem(facts: SettingsFacts, robot: Robot, check_up: NoticeView) -> NoticeView:
    """The first thing that an integrator has to do there."""
    if robot.needs_password:
        return NoticeView(_("Needs a password"), tone="attention", icon="key-alert-outline")
    if twin := _twin(facts, robot):
        return NoticeView(_("Same machine as {robot}").format(robot=twin.name), tone="fault", icon="alert-octagon")
    if missing := len(facts.missing[robot.id]):
        text = ngettext("{n} mission missing", "{n} missions missing", missing).format(n=missing)
        return NoticeView(text, tone="attention", icon="alert")
    return check_up if check_up.tone in ("fault", "attention", "accent") else NoticeView()


def robot_note(facts: SettingsFacts, robot: Robot, now: datetime) -> NoticeView:
    """How it answers, and what it is."""
    link = link_appearance(robot, facts.snapshot(robot.id), now, facts.settings)
    if needs_decision(facts, robot):
        return NoticeView(_("Nothing is sent to {robot}").format(robot=robot.name), link.word, "attention", link.icon)
    is_default = robot.fleet is None and Token(robot.token or "").is_published_default
    found = (
        _("The fleet chooses the robot")
        if robot.is_any
        else machine_phrase(robot.model or _("MiR robot"), robot.serial_number, robot.software),
        robot.fleet is None and robot.identified_by and _("Identified by {what}").format(what=_identified_by(robot)),
        is_default and _("Default password of MiR: change it on the robot"),
    )
    tone = "attention" if is_default and link.tone == "neutral" else link.tone
    return NoticeView(link.word, " · ".join(part for part in found if part), tone, link.icon)


NOT_TRUSTED = (Connection.WRONG_ROBOT, Connection.OTHER_CERTIFICATE, Connection.UNTRUSTED)


def needs_decision(facts: SettingsFacts, robot: Robot) -> bool:
    """Whether nothing is sent to it until a person has decided."""
    return facts.snapshot(robot.id).connection in (*NOT_TRUSTED, Connection.UNAUTHORIZED)


def advanced_item(hand_over: HandOver, *, is_open: bool) -> Item:
    """The row that unfolds what is rarely changed."""
    words = {HandOver.AT_ONCE: _("Starts at once"), HandOver.WHEN_FREE: _("Starts when free")}
    arrow = Action("open", icon="chevron-up" if is_open else "chevron-down")
    return Item("advanced", _("Advanced"), meta="" if is_open else words[hand_over], strong=False, actions=(arrow,))


def idle_phrase(facts: SettingsFacts, robot: Robot) -> str:
    mission = facts.mission(robot.idle.mission_id) if robot.idle is not None and robot.idle.enabled else None
    if robot.idle is None or mission is None:
        return _("Off")
    return _("{mission} after {n} min").format(mission=mission.name, n=robot.idle.after_minutes)


def _twin(facts: SettingsFacts, robot: Robot) -> Robot | None:
    """Another robot that is the same machine: found late if a robot was saved before it answered."""
    return next(
        (
            other
            for other in facts.robots
            if other.id != robot.id and robot.serial_number and other.serial_number == robot.serial_number
        ),
        None,
    )


def _identified_by(robot: Robot) -> str:
    """What makes the machine that answers the robot."""
    return {
        None: "–",
        IdentifiedBy.SERIAL_NUMBER: _("its serial number"),
        IdentifiedBy.CERTIFICATE: _("its certificate"),
        IdentifiedBy.ADDRESS: _("its address only"),
    }[robot.identified_by]


def machine_phrase(model: str | None, serial_number: str | None, software: str | None) -> str:
    """What is known of a robot's machine."""
    parts = (
        model,
        serial_number and _("serial {number}").format(number=serial_number),
        software and _("software {version}").format(version=software),
    )
    return " · ".join(part for part in parts if part)


def connection_found(identity: Identity, has_default_password: bool = False) -> NoticeView:
    """Which robot answered."""
    facts = machine_phrase(identity.model, identity.serial_number, identity.software)
    name = identity.name or identity.model or _("The robot")
    answer = _("{robot} answers in {n} ms").format(robot=name, n=max(1, round(identity.status.elapsed_s * 1000)))
    if has_default_password:
        facts = "\n".join(filter(None, (facts, _("Default password of MiR: change it on the robot"))))
    return done(answer, facts)


def nothing_sent() -> NoticeView:
    """While it is asked whether to trust what answers, and after."""
    return NoticeView(_("Nothing was sent to it."), tone="attention", icon="robot-confused-outline")


def went_wrong(problem: BaseException, robot: str = "") -> NoticeView:
    """``robot``: the name of the one that was asked, for its address."""
    if robot and is_of_robot(problem):
        problem = problem.at(robot)
    return NoticeView(sentence_of(problem), tone="fault", icon="alert-circle")


def has_unknown_certificate(problem: BaseException) -> bool:
    """Whether it shows a certificate that a person could compare and pin."""
    return isinstance(problem, CertificateProblem) and problem.code in ("certificate_untrusted", "certificate_mismatch")


def answers(facts: SettingsFacts, robot: Robot) -> bool:
    """Whether the robot is enabled and reachable now."""
    return robot.enabled and facts.snapshot(robot.id).connection in (Connection.CONNECTED, Connection.SLOW)


# ---------------------------------------------------------------------- files
def data_items(facts: SettingsFacts, now: datetime, *, can_restore: bool) -> list[Item]:
    """What goes out and comes in. ``can_restore``: this window can."""
    restore = Action("restore", _("Restore"), off="" if can_restore else _("Ask the person in charge"))
    return [
        Item(
            "configuration",
            _("Configuration"),
            _("Without passwords"),
            icon="cog-outline",
            opens=False,
            actions=(Action("import", _("Import")), Action("export", _("Export"))),
        ),
        Item(
            "log",
            _("Runs"),
            _("Table (CSV)"),
            icon="table",
            opens=False,
            actions=(Action("excel", _("For Excel")), Action("commas", _("With commas"))),
        ),
        Item(
            "backups",
            _("Backups"),
            _backup_note(facts, now).text,
            icon="backup-restore",
            opens=False,
            actions=(restore, Action("back_up", _("Back up"))),
        ),
    ]


def file_note(file: FoundFile, zone: str, now: datetime) -> str:
    """Day and size."""
    size = formats.file_size(file.size)
    return f"{formats.day_and_time(file.changed_at, zone, now)} · {size}"


def import_items(lines: Sequence[Message], deletes: DeletesRuns | None = None) -> list[Item]:
    """A row for each change that an import makes, first what is lost: runs of the history, and robots that it stops."""
    lost = []
    if deletes is not None:
        text = ngettext("Deletes the oldest run for ever", "Deletes the oldest {n} runs for ever", deletes.count)
        lost = [
            Item(
                "deletes",
                text.format(n=formats.count(deletes.count)),
                icon="delete-alert-outline",
                tone="fault",
                opens=False,
            )
        ]
    ordered = sorted(lines, key=lambda line: not stops_a_robot(line))
    return lost + [
        Item(
            n,
            words_of(line),
            icon="alert" if stops_a_robot(line) else "circle-small",
            tone="attention" if stops_a_robot(line) else "neutral",
            opens=False,
        )
        for n, line in enumerate(ordered)
    ]


def changes_phrase(lines: Sequence[Message]) -> str:
    return ngettext("{n} change", "{n} changes", len(lines)).format(n=len(lines))


def import_result(lines: Sequence[Message], backup: FoundFile) -> NoticeView:
    """How many changes, and what brings back the state from before."""
    text = ngettext("{n} change imported", "{n} changes imported", len(lines)).format(n=len(lines))
    return done(text, _("Backup from before it: {name}").format(name=backup.path.name))
