"""The card of one robot: for each state what it says, its one button, and what can't be done and why. Pure."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta

from app.domain import rules
from app.domain.activity import is_charging
from app.domain.capabilities import Capabilities
from app.domain.models import Connection, Robot, RobotSnapshot
from app.domain.robot import RobotState, RobotStatus
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.formats import LONGEST_QUESTION
from app.screens.common.robot_appearance import (
    BatteryAppearance,
    battery_appearance,
    is_old,
    silent_fleet,
    state_appearance,
    why_not,
)
from app.screens.common.robot_groups import free_words
from app.screens.common.robot_texts import problem_of_status
from app.screens.home.facts import HomeFacts
from app.screens.home.today import next_words

_CHARGES_TO = re.compile(r"Charging until battery reaches (\d+) ?%")


@dataclass(frozen=True)
class Note:
    """What a person has to know or do. ``answers`` are those to a question, ``guid`` is of the question."""

    tone: str = "neutral"
    problem: str = ""
    step: str = ""
    quote: str = ""
    answers: tuple[str, ...] = ()
    guid: str = ""


@dataclass(frozen=True)
class Foot:
    """The card's button: to "pause", "resume" or "reset" the robot. ``why`` it is off, empty without a reason to say."""

    action: str = "pause"
    text: str = ""
    icon: str = "pause"
    style: str = "tonal"
    off: bool = False
    why: str = ""


@dataclass(frozen=True)
class Card:
    """``progress`` −1: not known. ``old``: values are from when it last answered."""

    name: str = ""
    state: str = formats.NOTHING
    icon: str = "timer-sand"
    tone: str = "offline"
    loud: bool = False
    since: str = ""
    battery: BatteryAppearance = field(default_factory=BatteryAppearance)
    mission: str = ""
    progress: float = -1.0
    left: str = ""
    end: str = ""
    end_tone: str = "neutral"
    note: Note = field(default_factory=Note)
    said: str = ""  # in small print
    old: bool = True
    foot: Foot = field(default_factory=lambda: Foot(off=True))
    send_off: str = ""  # why no mission can be sent
    send_note: str = ""  # when it starts, if not at once


def card(facts: HomeFacts, robot: Robot, now: datetime) -> Card:
    snapshot = facts.snapshot
    old = is_old(snapshot, now, facts.settings)
    free = free_words(robot, facts.robots, facts.snapshots.get, facts.settings, now)
    state = state_appearance(robot, snapshot, old, free)
    off, note = sending(facts, robot, now)
    shown = Card(
        name=robot.name,
        state=state.word,
        icon=state.disc_icon or state.icon,
        tone=state.tone,
        loud=state.loud,
        battery=_battery(facts, old, now),
        old=old,
        send_off=off,
        send_note=note,
    )
    if not robot.enabled:
        return _switched_off(shown, robot)
    if snapshot.status is None and snapshot.connection is Connection.UNKNOWN:
        return replace(shown, foot=_pause(_("Not read yet")))
    if old or snapshot.status is None:
        return _as_it_can(_silent(shown, facts, robot, now), robot, snapshot.capabilities)
    return _as_it_can(_answering(shown, facts, snapshot.status, robot, now), robot, snapshot.capabilities)


def _as_it_can(shown: Card, robot: Robot, can: Capabilities) -> Card:
    """What can't be done through the connection to it is off, and says why."""
    foot, note = shown.foot, shown.note
    if note.answers and (why := why_not(can.prompts)):
        note = replace(note, answers=(), step=why)
    if robot.is_any:
        foot = _pause(_("Pause a robot on its own page."))
    elif not foot.off and (why := why_not(can.clear_error if foot.action == "reset" else can.pause)):
        foot = replace(foot, off=True, style="tonal", why=why)
    return replace(shown, foot=foot, note=note)


def _pause(why: str = "") -> Foot:
    return Foot("pause", _("Pause"), "pause", "tonal", bool(why), why)


def _resume(why: str = "") -> Foot:
    return Foot("resume", _("Resume"), "play", "filled", bool(why), why)


def _switched_off(shown: Card, robot: Robot) -> Card:
    words = _("Enter its password in Settings.") if robot.needs_password else _("Switched off in Settings.")
    tone = "attention" if robot.needs_password else "neutral"
    return replace(shown, note=Note(tone, words), foot=_pause(_("{robot} is off").format(robot=robot.name)))


def _silent(shown: Card, facts: HomeFacts, robot: Robot, now: datetime) -> Card:
    """Pause can be tried while only a reading is late: stopping never waits for the next one."""
    snapshot, zone = facts.snapshot, facts.settings.timezone
    answers = snapshot.connection in (Connection.CONNECTED, Connection.SLOW)
    since = snapshot.read_at if answers or snapshot.status is not None else snapshot.since
    at, said = formats.day_and_time(since, zone, now), ""
    if snapshot.status is not None and not robot.is_any:
        then = state_appearance(robot, replace(snapshot, connection=Connection.CONNECTED), stale=False).word.lower()
        words = _("At {time}: {state}, {mission}") if facts.running else _("At {time}: {state}")
        said = words.format(time=at, state=then, mission=facts.name_of(facts.running) if facts.running else "")
    problem, step = _way_out(robot, snapshot)
    deaf = _("{robot} can't hear it. Use the button on the robot.").format(robot=robot.name)
    return replace(
        shown,
        since=_("since {time}").format(time=at) if since else "",
        note=Note("attention", problem, step),
        said=said,
        foot=_pause("" if answers else deaf),
    )


def _way_out(robot: Robot, snapshot: RobotSnapshot) -> tuple[str, str]:
    """Why there may be no answer, and what a person does; of a fleet it is the same for all of its robots."""
    if fleet := silent_fleet(robot, snapshot):
        if snapshot.connection is Connection.UNREACHABLE:
            problem, step = _("{fleet} is silent. Is its server on?"), _("Ask IT about the server if it is.")
            return problem.format(fleet=fleet.name), step
        return _("Look at {fleet} in Settings.").format(fleet=fleet.name), ""
    if robot.fleet is not None and snapshot.connection is Connection.WRONG_ROBOT:
        return _("The fleet has another robot in its place."), _("Delete it here, and add the new one.")
    return {
        Connection.UNAUTHORIZED: (_("Enter its password in Settings."), ""),
        Connection.WRONG_ROBOT: (_("Check its address in Settings."), ""),
        Connection.NOT_A_ROBOT: (_("Check its address in Settings."), ""),
        Connection.OTHER_CERTIFICATE: (_("Compare its certificate in Settings."), ""),
        Connection.UNTRUSTED: (_("Compare its certificate in Settings."), ""),
    }.get(snapshot.connection, (_("Is it switched on?"), _("Ask IT about the Wi-Fi if it is.")))


def _answering(shown: Card, facts: HomeFacts, status: RobotStatus, robot: Robot, now: datetime) -> Card:
    since = facts.state_since()
    abnormal = replace(
        shown,
        since=_("since {time}").format(time=formats.day_and_time(since, facts.settings.timezone, now)) if since else "",
        mission=facts.name_of(facts.running) if facts.running else "",
    )
    match status.state:
        case RobotState.EMERGENCY_STOP:
            note = Note("fault", _("Release the red button. Then press Reset on the robot."))
            return replace(abnormal, mission="", note=note, foot=_resume(_("after Reset on the robot")))
        case RobotState.ERROR:
            return _failed(abnormal, facts, status)
        case RobotState.MANUAL_CONTROL:
            words = _("Driven by hand. Turn the key back.")
            return replace(abnormal, mission="", note=Note("attention", words), foot=_pause(_("Driven by hand")))
        case RobotState.STARTING | RobotState.SHUTTING_DOWN:
            return replace(shown, foot=_pause(_("{robot} can't hear it").format(robot=robot.name)))
    if status.user_prompt is not None:
        return replace(shown, note=_question(facts, status), foot=_pause())
    if status.errors and facts.running is None:
        return _failed(abnormal, facts, status)
    if status.state is RobotState.PAUSE:
        failed = _failed(abnormal, facts, status)
        return failed if status.errors and failed.foot.action == "reset" else replace(abnormal, foot=_resume())
    is_working = facts.running is not None or status.state in (RobotState.EXECUTING, RobotState.DOCKING)
    if is_working and not robot.is_any:  # several of its fleet's robots may run something
        shown = _working(shown, facts, status, now)
    else:
        mission, said = next_words(facts, robot, now)
        shown = replace(shown, mission=mission, said=said)
    if status.errors:
        shown = replace(shown, note=replace(_problem(facts, status), tone="attention"))
    if is_charging(status) and (goal := _CHARGES_TO.match(status.mission_text)):
        shown = replace(shown, mission=_("Charging to {percent} %").format(percent=goal[1]))
    return replace(shown, foot=_pause())


# ---------------------------------------------------------------------- what is wrong, and the way out
def can_reset(status: RobotStatus | None) -> bool:
    """Whether Reset errors would change something: the emergency stop and other errors are solved at the robot itself."""
    if status is None or status.state is RobotState.EMERGENCY_STOP:
        return False
    if status.errors:
        return any(error.resettable for error in status.errors)
    return status.state is RobotState.ERROR


def has_errors(status: RobotStatus) -> bool:
    return status.state is RobotState.ERROR or bool(status.errors)


def error_words(status: RobotStatus) -> str:
    """What stops it from working, in the robot's words."""
    return problem_of_status(status).quote or _("An error")


def _failed(shown: Card, facts: HomeFacts, status: RobotStatus) -> Card:
    """The way out of a stop is Reset errors, then Resume."""
    foot = Foot("reset", _("Reset errors"), "restore", "filled")
    if not can_reset(status):
        foot = _resume(_("after Reset on the robot"))
    return replace(shown, mission="", note=_problem(facts, status), foot=foot)


def _problem(facts: HomeFacts, status: RobotStatus) -> Note:
    known = problem_of_status(status)
    step = known.step or _("Remove its cause. Then reset.")
    if not can_reset(status):
        step = _("Solve it at the robot.")
    elif facts.has_reset_no_effect:
        step = _("Still there. Remove its cause, reset again.")
    quote = f"“{known.quote}”" if known.quote else ""
    return Note("fault", known.words or quote or _("An error"), step, quote if known.words else "")


def _question(facts: HomeFacts, status: RobotStatus) -> Note:
    asked = status.user_prompt
    assert asked is not None
    question = asked.question
    if len(question) > LONGEST_QUESTION:
        question = _("{question} … read all of it at the robot").format(
            question=question[:LONGEST_QUESTION].rsplit(" ", 1)[0]
        )
    if asked.guid in facts.answered:
        return Note("neutral", question)
    more = asked.more_options
    step = (
        ngettext("{n} more answer at the robot", "{n} more answers at the robot", more).format(n=more) if more else ""
    )
    return Note("action", question, step, answers=asked.options, guid=asked.guid)


# ---------------------------------------------------------------------- the running mission
def _working(shown: Card, facts: HomeFacts, status: RobotStatus, now: datetime) -> Card:
    """How long it takes yet. What charges ends when the robot is charged or gets another mission, not after a usual time."""
    item = facts.running
    if item is None:
        return replace(shown, mission=formats.NOTHING)
    since, usual = facts.working_since(item, now), facts.expected.get(facts.guid_of(item))
    shown = replace(shown, mission=facts.name_of(item))
    if since is None or is_charging(status):
        return shown
    if usual is None or not usual.median_s:
        return replace(shown, end=_("since {time}").format(time=formats.clock_time(since, facts.settings.timezone)))
    elapsed = (now - since).total_seconds()
    left, end = usual.left_s(elapsed), since + timedelta(seconds=usual.median_s)
    shown = replace(shown, progress=min(1.0, max(0.0, elapsed / usual.median_s)))
    if left < 0:
        words = _("{time} longer than usual").format(time=formats.rough_duration(-left))
        return replace(shown, end=words, end_tone="attention")
    if not left:
        return replace(shown, left=_("soon done"))
    at = "" if any(hold.clock for hold in facts.holds) else formats.day_and_time(end, facts.settings.timezone, now)
    return replace(
        shown,
        left=_("{time} left").format(time=formats.rough_duration(max(60.0, left))),
        end=_("done {time}").format(time=at) if at else "",
    )


# ---------------------------------------------------------------------- battery
def _battery(facts: HomeFacts, old: bool, now: datetime) -> BatteryAppearance:
    """An old reading shows its time, and no charging."""
    battery = battery_appearance(facts.snapshot.status, facts.settings)
    if not old or battery.text == formats.NOTHING:
        return battery
    at = formats.day_and_time(facts.snapshot.read_at, facts.settings.timezone, now)
    words = _("{battery} at {time}").format(battery=battery.text, time=at)
    return BatteryAppearance(words, "battery-unknown", "offline")


def battery_words(facts: HomeFacts, old: bool) -> str:
    """How long it lasts, and the minimum."""
    minimum = facts.settings.minimum_battery_percent
    words = _("Minimum {percent} %").format(percent=formats.plain(minimum)) if minimum else ""
    settings = replace(facts.settings, minimum_battery_percent=None)
    left = "" if old else battery_appearance(facts.snapshot.status, settings).note
    return "\n".join(filter(None, (left, words))) or _("Nothing more is known.")


# ---------------------------------------------------------------------- what can be sent
def sending(facts: HomeFacts, robot: Robot, now: datetime) -> tuple[str, str]:
    """Why no mission can be sent, and when one starts, if not at once; each may be empty."""
    hold, status, name = facts.hold(robot.id, now), facts.snapshot.status, {"robot": robot.name}
    silent = silent_fleet(robot, facts.snapshot) or robot
    old = is_old(facts.snapshot, now, facts.settings)
    if hold is not None and hold.is_copy:
        return _("Nothing is sent from this tablet"), ""
    if not robot.enabled:
        return _("{robot} is off").format(**name), ""
    if not robot.is_identified:
        return _("Give the app its own user at the fleet"), ""
    if not old and status is not None and status.state is RobotState.ERROR and can_reset(status):
        return _("Reset errors first"), ""
    if not old and status is not None and status.state in (RobotState.ERROR, RobotState.EMERGENCY_STOP):
        return _("Not while {robot} is stopped").format(**name), ""
    if hold is not None:
        return "", _hold_words(facts, hold.until, hold.clock, now)
    if old:
        return "", _("Sent when {robot} answers").format(robot=silent.name)
    if status is not None and status.state is RobotState.MANUAL_CONTROL:
        return "", _("Waits while it is driven by hand")
    return "", _("Starts after Resume") if status is not None and status.state is RobotState.PAUSE else ""


def _hold_words(facts: HomeFacts, until: datetime | None, is_clock: bool, now: datetime) -> str:
    if is_clock:
        return _("Sent when the clock is right")
    zone, closes_at = facts.settings.timezone, rules.closes_at(now, None, facts.settings)
    if until is None or until >= closes_at:
        at = formats.day_and_time(closes_at, zone, now)
        return _("On hold, not run from {time}").format(time=at)
    return _("Starts after {time}").format(time=formats.day_or_time(until, zone, now))
