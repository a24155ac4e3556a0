"""The first stage of a check-up: everything that a robot tells when it is asked. It changes nothing there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from zoneinfo import ZoneInfo

from app.domain.check_up import Topic
from app.domain.message import Message, message
from app.domain.robot import IdentifiedBy, Identity, RobotState, RobotStatus
from app.mir import parse
from app.mir.errors import RobotError, Unauthorized
from app.mir.mission_queue import UNSUPPORTED
from app.mir.probe import Answer
from app.mir.texts import clean
from app.services.check_up import pace
from app.services.check_up.look import Look, why
from app.services.check_up.queue_lists import QueueLists, look_at_others
from app.services.check_up.robot_words import look_at_language

READS_S = 25.0  # that the questions before the measurement take, about
MISSIONS_S = 15.0  # at most, for the details of missions
SMALL_OFFSET_S, LARGE_OFFSET_S = 10.0, 600.0  # of clocks; from the second on the app doubts the tablet's
# What tells MiR's definitions of the interface apart, and the softwares that have each.
DEFINITIONS: Mapping[str, tuple[bool, bool]] = {"2.14.7": (False, False), "3.5.4": (True, False), "3.8.1": (True, True)}


def length_s() -> float:
    """How long it takes, about."""
    return READS_S + pace.MINUTE + pace.LOAD_S


def read_robot(look: Look) -> Identity | None:
    """All topics that are read. Returns who answers; None, with what is wrong as a finding, where nobody does. Raises NotWanted."""
    whole = length_s()
    look.at(message("Asking who it is"), 0.0, whole)
    try:
        identity = look.probe.identity()
    except Unauthorized as error:
        look.red(
            Topic.RIGHTS,
            message("It does not accept the user: {problem}", problem=why(error)),
            message("Enter user name and password again in its settings."),
        )
        return None
    except RobotError as error:
        look.red(
            Topic.IDENTITY,
            message("It could not be asked: {problem}", problem=why(error)),
            message("Nothing can be scheduled on it before it answers."),
        )
        return None
    status = identity.status
    _identity(look, identity)
    _software(look, identity)
    _certificate(look)
    _battery(look, status)
    _clock(look)
    look.at(message("Reading missions and maps"), 3.0, whole)
    missions = look.probe.get("/missions")
    maps = look.probe.get("/maps")
    _rights(look, identity, missions, maps)
    _password(look, identity)
    _missions(look, missions)
    _maps(look, status, maps)
    look.at(message("Reading its queue"), 18.0, whole)
    lists = QueueLists(look)
    look.entries = entries = lists.look()
    look_at_language(look, status, entries)
    look_at_others(look, entries, identity.user_name, is_empty=lists.is_empty)
    pace.measure(look, pace.MINUTE, READS_S, whole)
    pace.load(look, READS_S + pace.MINUTE, whole)
    return identity


def _identity(look: Look, identity: Identity) -> None:
    if identity.serial_number and (others := look.same_machine(identity.serial_number)):
        look.red(
            Topic.IDENTITY,
            message(
                "Its serial number {number} is also that of {robots}",
                number=identity.serial_number,
                robots=", ".join(others),
            ),
            message(
                "They are one machine, or one of their addresses is wrong: starts for both end up in one queue. Correct "
                "the address, or remove one of them."
            ),
        )
    elif identity.identified_by is IdentifiedBy.ADDRESS:
        look.amber(
            Topic.IDENTITY,
            message("It is known by its address only, as it shows no serial number without a password"),
            message(
                "Another machine at this address would be sent the password. A fixed address for the robot, or https, helps."
            ),
        )
    else:
        look.green(
            Topic.IDENTITY,
            message(
                "It is {name}, a {model}, serial number {number}",
                name=identity.name or "?",
                model=identity.model or "?",
                number=identity.serial_number or "?",
            ),
        )


def _software(look: Look, identity: Identity) -> None:
    offers = _offers(look, "/software/system_status"), _offers(look, "/guided_move/waypoints")
    fits = next((version for version, those in DEFINITIONS.items() if those == offers), None)
    software = identity.software or "?"
    means = message("Try it with a mission before its first night, and look at its runs in the morning.")
    if None in offers:
        look.amber(
            Topic.SOFTWARE,
            message(
                "Its software is {software}; not found out which of MiR's definitions fits, as it does not say "
                "what it offers",
                software=software,
            ),
            means,
        )
    elif fits is None:
        look.amber(
            Topic.SOFTWARE,
            message(
                "Its software is {software}; none of MiR's known definitions fits what it offers", software=software
            ),
            means,
        )
    elif identity.software is None:
        look.amber(
            Topic.SOFTWARE,
            message("It does not tell its software; MiR's definition of {definition} fits", definition=fits),
            message("The app can't see when it gets other software: check it up again after each change."),
        )
    elif fits != identity.software and identity.software in DEFINITIONS:
        look.amber(
            Topic.SOFTWARE,
            message(
                "Its software is {software}, but it offers what {definition} does", software=software, definition=fits
            ),
            means,
        )
    else:
        look.green(
            Topic.SOFTWARE,
            message(
                "Its software is {software}; MiR's definition of {definition} fits", software=software, definition=fits
            ),
        )


def _offers(look: Look, path: str) -> bool | None:
    """None: it can't be told, as the user may not read it or the robot has an error."""
    answer = look.probe.get(path)
    if answer.is_good:
        return True
    return False if answer.status in UNSUPPORTED else None


def _certificate(look: Look) -> None:
    if look.probe.client.address.is_secure:
        look.green(Topic.CERTIFICATE, message("It is asked over https, and its certificate is trusted"))
    else:
        look.amber(
            Topic.CERTIFICATE,
            message("It is asked over http: whoever listens on the network can read the password"),
            message(
                "Where the robot offers https (software 3 and later), change its address to https://…; else keep its network "
                "for robots only."
            ),
        )


def _battery(look: Look, status: RobotStatus) -> None:
    if status.battery_percentage is not None:
        look.green(Topic.BATTERY, message("Its battery is at {percent} %", percent=round(status.battery_percentage)))
    elif status.state is RobotState.EMERGENCY_STOP:
        look.amber(
            Topic.BATTERY,
            message("Not found out whether it reports its battery level, as it stands in emergency stop"),
            message("Check up again when it is released."),
        )
    else:
        look.amber(
            Topic.BATTERY,
            message("It does not report its battery level"),
            message("A start that needs a minimum battery is skipped on it: set none for its schedules."),
        )


def _clock(look: Look) -> None:
    zone = look.probe.get("/platform/timezone").one.get("value")
    zone = zone if isinstance(zone, str) and _is_zone(zone) else None
    look.seen["timezone"] = zone
    offset = _offset(look)
    look.seen["clock_offset"] = None if offset is None else round(offset, 1)
    if offset is None:
        look.amber(
            Topic.CLOCK,
            message("It does not tell its time"),
            message("The app can't compare the tablet's clock with it: have the tablet set its time by the network."),
        )
    elif abs(offset) > LARGE_OFFSET_S:
        look.red(
            Topic.CLOCK,
            _beside(offset),
            message(
                "One of the two is wrong. If it is the tablet's, missions start at wrong times; if it is the robot's, the app "
                "asks which one is right whenever it starts. Set it."
            ),
        )
    elif zone is not None and _differs(look, zone):
        look.amber(
            Topic.CLOCK,
            message("Its clock is set to {zone}, the plan to {own}", zone=zone, own=look.zone),
            message(
                "Starts follow the plan's time zone. Times on the robot's own pages differ; set its time zone, so that nobody "
                "is misled."
            ),
        )
    elif abs(offset) > SMALL_OFFSET_S:
        look.amber(
            Topic.CLOCK,
            _beside(offset),
            message("Starts follow the tablet's clock. Let both set their time by the network."),
        )
    elif zone is not None:
        look.green(Topic.CLOCK, message("Its clock is right, in {zone}", zone=zone))
    else:
        look.green(Topic.CLOCK, message("Its clock is right; its time zone is not told"))


def _offset(look: Look) -> float | None:
    """Seconds that its clock is ahead of the tablet's; None: it doesn't tell."""
    try:
        date = look.probe.status().date
    except RobotError:
        return None
    return None if date is None else (date - look.now()).total_seconds()


def _beside(offset: float) -> Message:
    if offset > 0:
        return message("Its clock is {seconds} s ahead of the tablet's", seconds=round(offset))
    return message("Its clock is {seconds} s behind the tablet's", seconds=round(-offset))


def _is_zone(name: str) -> bool:
    try:
        ZoneInfo(name)
    except (ValueError, OSError, LookupError):
        return False
    return True


def _differs(look: Look, zone: str) -> bool:
    now = look.now()
    return now.astimezone(ZoneInfo(zone)).utcoffset() != now.astimezone(ZoneInfo(look.zone)).utcoffset()


def _rights(look: Look, identity: Identity, missions: Answer, maps: Answer) -> None:
    group = clean(look.probe.get("/users/me/group").one.get("name"), 80)
    user = identity.user_name or "?"
    failed = [
        (what, answer.error)
        for what, answer in (
            (message("missions"), missions),
            (message("maps"), maps),
            (message("mission queue"), look.probe.queue(limit="1")),
        )
        if answer.error
    ]
    refused = [what for what, error in failed if isinstance(error, Unauthorized)]
    if refused:
        look.red(
            Topic.RIGHTS,
            message("User {user} may not read: {what}", user=user, what=refused[0]),
            message("Give the user more rights on the robot (Setup, Users), or use another one."),
        )
    elif failed:
        look.amber(
            Topic.RIGHTS,
            message("Not found out whether user {user} may read: {what}", user=user, what=failed[0][0]),
            message("Check up again once it can be read."),
        )
    elif group:
        look.green(
            Topic.RIGHTS,
            message("User {user} of the group {group} may read missions, queue and maps", user=user, group=group),
            message("Whether it may start missions shows when one is tried."),
        )
    else:
        look.green(
            Topic.RIGHTS,
            message("User {user} may read missions, queue and maps", user=user),
            message("Whether it may start missions shows when one is tried."),
        )


def _password(look: Look, identity: Identity) -> None:
    if look.probe.client.has_default_password:
        look.amber(
            Topic.PASSWORD,
            message("User {user} has the default password that MiR's manuals print", user=identity.user_name or "?"),
            message(
                "Anybody on the network can drive the robot with it. Change it on the robot (Setup, Users) and in its settings "
                "here."
            ),
        )
    else:
        look.green(Topic.PASSWORD, message("The password is none of those that MiR's manuals print"))


def _missions(look: Look, answer: Answer) -> None:
    guids = [guid for entry in answer.rows if (guid := parse.text_or_none(entry.get("guid")))]
    if not answer.is_good or not isinstance(answer.found, list):
        look.red(
            Topic.MISSIONS,
            message("Its missions can't be read: {problem}", problem=why(answer) or message("its answer is no list")),
            message("Nothing can be planned without them."),
        )
        return
    began, seen = look.probe.clock(), list[Mapping[str, Any]]()
    for guid in guids:
        look.check_is_wanted()
        if look.probe.clock() - began > MISSIONS_S:
            break
        if (detail := look.probe.get(f"/missions/{guid}")).is_good:
            seen.append(detail.one)
    with_parameters = sum(mission.get("has_user_parameters") is True for mission in seen)
    invalid = _named(mission for mission in seen if mission.get("valid") is False)
    if invalid:
        look.amber(
            Topic.MISSIONS,
            message("Of {n} missions these are not valid: {names}", n=len(guids), names=", ".join(invalid)),
            message("Open them on the robot and put them right before they are planned."),
        )
    elif guids and not seen:
        look.amber(
            Topic.MISSIONS,
            message("It has {n} missions; not found out which ask for values when they are started", n=len(guids)),
            message("None of them could be read: open one on the robot, and check up again."),
        )
    elif guids:
        look.green(
            Topic.MISSIONS,
            message(
                "It has {n} missions; {parameters} of {seen} looked at ask for values when they are started",
                n=len(guids),
                parameters=with_parameters,
                seen=len(seen),
            ),
        )
    else:
        look.amber(
            Topic.MISSIONS, message("It has no missions"), message("Make one on the robot before it is planned.")
        )


def _named(missions: Any) -> Sequence[str]:
    return [clean(mission.get("name"), 80) or "?" for mission in missions][:5]


def _maps(look: Look, status: RobotStatus, answer: Answer) -> None:
    if not answer.is_good or not isinstance(answer.found, list):
        look.amber(
            Topic.MAPS,
            message("Its maps can't be read: {problem}", problem=why(answer) or message("its answer is no list")),
            message("Home shows no map of it; everything else works."),
        )
        return
    current = next((clean(entry.get("name"), 80) for entry in answer.rows if entry.get("guid") == status.map_id), None)
    if current is None and status.map_id is None:
        look.amber(
            Topic.MAPS,
            message("Not found out which of its {n} maps is in use: its status does not tell", n=len(answer.rows)),
            message("Home shows no map of it; everything else works."),
        )
        return
    if current is None:
        look.amber(
            Topic.MAPS,
            message("It has {n} maps, none of them in use", n=len(answer.rows)),
            message("Load a map on the robot: missions that drive fail without."),
        )
        return
    positions = look.probe.get(f"/maps/{status.map_id}/positions")
    if not positions.is_good:
        look.amber(
            Topic.MAPS,
            message(
                "It drives on the map {name}, one of {n}; its positions can't be read: {problem}",
                name=current,
                n=len(answer.rows),
                problem=why(positions),
            ),
            message("Home shows no positions on it; everything else works."),
        )
        return
    look.green(
        Topic.MAPS,
        message(
            "It drives on the map {name}, one of {n}, with {positions} positions",
            name=current,
            positions=len(positions.rows),
            n=len(answer.rows),
        ),
    )
