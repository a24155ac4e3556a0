"""The first stage of a check-up: everything that can be read from a robot. It changes nothing there."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from typing import Any
from zoneinfo import ZoneInfo

from app.domain.check_up import Topic
from app.domain.message import Message, message
from app.domain.robot import IdentifiedBy, RobotState, RobotStatus
from app.mir import parse
from app.mir.errors import RobotError, Unauthorized
from app.mir.mission_queue import UNSUPPORTED
from app.mir.texts import clean
from app.services.catalogue.checks import is_zone
from app.services.check_up.load_probes import latency, load
from app.services.check_up.queue_probes import others, queue
from app.services.check_up.session import CheckUpSession, Found, amber, green, red

MISSIONS_S = 15.0  # at most, for the details of missions
SMALL_OFFSET_S, LARGE_OFFSET_S = 10.0, 600.0  # of clocks; from the second on the app doubts the tablet's
# What distinguishes MiR's definitions of the interface, and the software versions of each.
DEFINITIONS: Mapping[str, tuple[bool, bool]] = {"2.14.7": (False, False), "3.5.4": (True, False), "3.8.1": (True, True)}
ITEM_STATES = ("Pending", "Executing", "Abort", "Done", "Aborted")


def identity(session: CheckUpSession) -> Found:
    found = session.identity
    same = sorted(each.name for each in session.other_robots if each.serial_number == found.serial_number)
    if found.serial_number and same:
        return red(
            "Its serial number {number} is also that of {robots}",
            "They are one machine, or one of their addresses is wrong: starts for both end up in one queue. Correct "
            "the address, or remove one of them.",
            number=found.serial_number,
            robots=", ".join(same),
        )
    if found.identified_by is IdentifiedBy.ADDRESS:
        return amber(
            "It is known by its address only, as it shows no serial number without a password",
            "Another machine at this address would be sent the password. A fixed address for the robot, or https, helps.",
        )
    return green(
        "It is {name}, a {model}, serial number {number}",
        name=found.name or "?",
        model=found.model or "?",
        number=found.serial_number or "?",
    )


def software(session: CheckUpSession) -> Found:
    offers = _offers(session, "/software/system_status"), _offers(session, "/guided_move/waypoints")
    fits = next((version for version, those in DEFINITIONS.items() if those == offers), None)
    name = session.identity.software or "?"
    means = message("Try it with a mission before its first night, and look at its runs in the morning.")
    if None in offers:
        return amber(
            "Its software is {software}. Not found out which of MiR's definitions fits, as it does not say "
            "what it offers",
            means,
            software=name,
        )
    if fits is None:
        return amber(
            "Its software is {software}. None of MiR's known definitions fits what it offers", means, software=name
        )
    if session.identity.software is None:
        return amber(
            "It does not report its software. MiR's definition of {definition} fits",
            "The app can't see when its software changes: check it up again after each change.",
            definition=fits,
        )
    if fits != session.identity.software and session.identity.software in DEFINITIONS:
        return amber(
            "Its software is {software}, but it offers what {definition} does", means, software=name, definition=fits
        )
    return green("Its software is {software}. MiR's definition of {definition} fits", software=name, definition=fits)


def _offers(session: CheckUpSession, path: str) -> bool | None:
    """None: unknown, as the user may not read it or the robot has an error."""
    answer = session.robot.get(path)
    if answer.is_good:
        return True
    return False if answer.status in UNSUPPORTED else None


def certificate(session: CheckUpSession) -> Found:
    if session.robot.client.address.is_secure:
        return green("It is asked over https, and its certificate is trusted")
    return amber(
        "It is asked over http: anyone on the network can read the password",
        "Where the robot offers https (software 3 and later), change its address to https://… Otherwise keep its network "
        "for robots only.",
    )


def battery(session: CheckUpSession) -> Found:
    status = session.identity.status
    if status.battery_percentage is not None:
        return green("Its battery is at {percent} %", percent=round(status.battery_percentage))
    if status.state is RobotState.EMERGENCY_STOP:
        return amber(
            "Not found out whether it reports its battery level, as it stands in emergency stop",
            "Check up again when it is released.",
        )
    return amber(
        "It does not report its battery level",
        "A start that needs a minimum battery is not run on it: set none for its schedules.",
    )


def clock(session: CheckUpSession) -> Found:
    zone = session.robot.get("/platform/timezone").one.get("value")
    zone = zone if isinstance(zone, str) and is_zone(zone) else None
    session.facts["timezone"] = zone
    status = session.status()
    return compared(session, zone, None if status is None else status.date)


def compared(session: CheckUpSession, zone: str | None, date: datetime | None) -> Found:
    """The tablet's clock with one in this zone, which shows this ``date`` now."""
    offset = None if date is None else (date - session.clock.now()).total_seconds()
    session.facts["clock_offset"] = None if offset is None else round(offset, 1)
    if offset is None:
        return amber(
            "It does not report its time",
            "The app can't compare the tablet's clock with it: have the tablet set its time by the network.",
        )
    if abs(offset) > LARGE_OFFSET_S:
        return red(
            _difference(offset),
            "One of the two is wrong. If it is the tablet's, missions start at wrong times. If it is the robot's, "
            "the app asks at every start which one is right. Correct it.",
        )
    if zone is not None and _differs(session, zone):
        return amber(
            "Its clock is set to {zone}, the plan to {own}",
            "Starts follow the plan's time zone. Times on the robot's own pages differ: set its time zone to avoid mistakes.",
            zone=zone,
            own=session.zone,
        )
    if abs(offset) > SMALL_OFFSET_S:
        return amber(
            _difference(offset),
            "Starts follow the tablet's clock. Let both set their time by the network.",
        )
    return green(
        "Its clock is right, in {zone}" if zone else "Its clock is right. It does not report its time zone", zone=zone
    )


def _difference(offset: float) -> Message:
    if offset > 0:
        return message("Its clock is {seconds} s ahead of the tablet's", seconds=round(offset))
    return message("Its clock is {seconds} s behind the tablet's", seconds=round(-offset))


def _differs(session: CheckUpSession, zone: str) -> bool:
    now = session.clock.now()
    return now.astimezone(ZoneInfo(zone)).utcoffset() != now.astimezone(ZoneInfo(session.zone)).utcoffset()


def rights(session: CheckUpSession) -> Found:
    group = clean(session.robot.get("/users/me/group").one.get("name"), 80)
    user = session.identity.user_name or "?"
    failed = [
        (what, answer.error)
        for what, answer in (
            (message("missions"), session.robot.get_once("/missions")),
            (message("maps"), session.robot.get_once("/maps")),
            (message("mission queue"), session.robot.get(session.robot.queue, limit="1")),
        )
        if answer.error
    ]
    refused = [what for what, error in failed if isinstance(error, Unauthorized)]
    if refused:
        return red(
            "User {user} may not read: {what}",
            "Give the user more rights on the robot (Setup, Users), or use another one.",
            user=user,
            what=refused[0],
        )
    if failed:
        return amber(
            "Not found out whether user {user} may read: {what}",
            "Check up again once it can be read.",
            user=user,
            what=failed[0][0],
        )
    return green(
        "User {user} of the group {group} may read missions, queue and maps"
        if group
        else "User {user} may read missions, queue and maps",
        "A trial shows whether it may start missions.",
        user=user,
        group=group,
    )


def password(session: CheckUpSession) -> Found:
    if session.robot.client.has_default_password:
        return amber(
            "User {user} has the default password that MiR's manuals print",
            "Anyone on the network can drive the robot with it. Change it on the robot (Setup, Users) and in its settings here.",
            user=session.identity.user_name or "?",
        )
    return green("The password is none of those that MiR's manuals print")


def missions(session: CheckUpSession) -> Found:
    answer = session.robot.get_once("/missions")
    guids = [guid for entry in answer.rows if (guid := parse.text_or_none(entry.get("guid")))]
    if not answer.is_list:
        return red(
            "Its missions can't be read: {problem}", "Nothing can be planned without them.", problem=answer.problem
        )
    began, seen = session.clock.monotonic(), list[Mapping[str, Any]]()
    for guid in guids:
        session.check_is_wanted()
        if session.clock.monotonic() - began > MISSIONS_S:
            break
        if (detail := session.robot.get(f"/missions/{guid}")).is_good:
            seen.append(detail.one)
    with_parameters = sum(mission.get("has_user_parameters") is True for mission in seen)
    invalid = [clean(mission.get("name"), 80) or "?" for mission in seen if mission.get("valid") is False][:5]
    if invalid:
        return amber(
            "Of {n} missions these are not valid: {names}",
            "Correct them on the robot before they are planned.",
            n=len(guids),
            names=", ".join(invalid),
        )
    if guids and not seen:
        return amber(
            "It has {n} missions. Not found out which ask for values when they are started",
            "None of them could be read: open one on the robot, and check up again.",
            n=len(guids),
        )
    if guids:
        return green(
            "It has {n} missions, {parameters} of {seen} looked at ask for values when they are started",
            n=len(guids),
            parameters=with_parameters,
            seen=len(seen),
        )
    return amber("It has no missions", "Make one on the robot before it is planned.")


def maps(session: CheckUpSession) -> Found:
    answer, map_id = session.robot.get_once("/maps"), session.identity.status.map_id
    if not answer.is_list:
        return amber(
            "Its maps can't be read: {problem}",
            "Home shows no map of it. Everything else works.",
            problem=answer.problem,
        )
    current = next((clean(entry.get("name"), 80) for entry in answer.rows if entry.get("guid") == map_id), None)
    if current is None and map_id is None:
        return amber(
            "Not found out which of its {n} maps is in use: its status does not say",
            "Home shows no map of it. Everything else works.",
            n=len(answer.rows),
        )
    if current is None:
        return amber(
            "It has {n} maps, none of them in use",
            "Load a map on the robot: missions that drive fail without.",
            n=len(answer.rows),
        )
    positions = session.robot.get(f"/maps/{map_id}/positions")
    if not positions.is_good:
        return amber(
            "It drives on the map {name}. Its positions can't be read: {problem}",
            "Home shows no positions on it. Everything else works.",
            name=current,
            problem=positions.problem,
        )
    return green(
        "It drives on the map {name}, positions: {positions}",
        name=current,
        positions=len(positions.rows),
    )


def language(session: CheckUpSession) -> Found:
    """By the word for its state, and those for its newest items."""
    status = session.identity.status
    unknown = sorted(
        {state for entry in session.entries if (state := clean(entry.get("state"), 40)) and state not in ITEM_STATES}
    )
    if unknown:
        return amber(
            "It has its own words for the states of missions: {words}",
            "A trial with a mission shows what they mean. Until then, a run with an unknown word is followed until "
            "the robot has ended it, and shown as failed with that word.",
            words=", ".join(unknown),
        )
    if status.state is not RobotState.UNKNOWN and status.state_text and not _is_english(status):
        return amber(
            "It speaks another language: its state is {text}",
            "Its texts are shown in its own words. A trial with a mission shows its word for a cancelled mission. "
            "Without one, a mission that somebody cancels at the robot is shown as failed.",
            text=status.state_text,
        )
    if not status.state_text:
        return amber(
            "Not found out which language it speaks: it has no words for its state",
            "Its texts are shown in its own words.",
        )
    return green("It speaks English")


def _is_english(status: RobotStatus) -> bool:
    return re.sub(r"[^a-z]", "", status.state_text.casefold()) == status.state.name.casefold().replace("_", "")


def silent(error: RobotError) -> tuple[Topic, Found]:
    """Why it could not be asked at all."""
    if isinstance(error, Unauthorized):
        return Topic.RIGHTS, red(
            "It does not accept the user: {problem}",
            "Enter user name and password again in its settings.",
            problem=error.message,
        )
    return Topic.IDENTITY, red(
        "It could not be asked: {problem}", "Nothing can be scheduled on it until it answers.", problem=error.message
    )


def read_robot(session: CheckUpSession) -> bool:
    """All topics that are read, in the order of the report. Whether it could be asked at all; if not, a finding says why. Raises
    Cancelled."""
    session.at(message("Asking who it is"), 0.0)
    try:
        session.identify()
    except RobotError as error:
        session.add(*silent(error))
        return False
    for says, done_s, probes in STEPS:
        session.at(says, done_s)
        for topic, look in probes:
            session.add(topic, look(session))
    return True


STEPS: Sequence[tuple[Message, float, Sequence[tuple[Topic, Callable[[CheckUpSession], Found]]]]] = (
    (
        message("Asking who it is"),
        0.0,
        (
            (Topic.IDENTITY, identity),
            (Topic.SOFTWARE, software),
            (Topic.CERTIFICATE, certificate),
            (Topic.BATTERY, battery),
            (Topic.CLOCK, clock),
        ),
    ),
    (
        message("Reading missions and maps"),
        3.0,
        (
            (Topic.RIGHTS, rights),
            (Topic.PASSWORD, password),
            (Topic.MISSIONS, missions),
            (Topic.MAPS, maps),
        ),
    ),
    (
        message("Reading its queue"),
        18.0,
        (
            (Topic.QUEUE, queue),
            (Topic.LANGUAGE, language),
            (Topic.OTHERS, others),
            (Topic.LATENCY, latency),
            (Topic.LOAD, load),
        ),
    ),
)
