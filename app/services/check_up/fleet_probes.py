"""The first stage of a fleet's check-up: what can be read. It changes nothing there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime

from app.domain.check_up import Topic
from app.domain.message import message
from app.domain.robot import FleetIdentity, RobotStatus
from app.mir.classic_requests import BUILT_IN
from app.mir.classic_vehicle import ClassicVehicle
from app.mir.enterprise_vehicle import EnterpriseVehicle
from app.mir.errors import RobotError, Unauthorized
from app.mir.fleet_vocabulary import ORDER_STATES
from app.mir.texts import clean
from app.services.check_up import probes
from app.services.check_up.queue_probes import queue
from app.services.check_up.session import CheckUpSession, Found, amber, green, red

LENGTH_S = 15.0  # that it takes, about
LONG_AGO = 1800.0  # s, of an order that has ended: no older one is searched for
SHOWN_FOR_LONG = 600.0  # s, of an order that has ended: longer than most starts are in doubt
NOT_MARKED = message(
    "Another fleet at its address could be taken for it: any robot of it, and one without serial number, get no starts. "
    "Nor are the app's orders told from others, if the trial shows no mark: give the app a user of its own."
)


def date_of(session: CheckUpSession) -> datetime | None:
    """By the fleet's clock; None: it does not say."""
    path = "/status" if isinstance(session.robot.client, ClassicVehicle) else "/system/version"
    return session.robot.get(path).date


def clock(session: CheckUpSession) -> Found:
    return probes.compared(session, None, date_of(session))


def missions(session: CheckUpSession) -> Found:
    try:
        found = session.robot.client.missions()
    except RobotError as error:
        return red(
            "Its missions can't be read: {problem}", "Nothing can be planned without them.", problem=error.message
        )
    if not found:
        return amber("It has no missions", "Make one on the robot before it is planned.")
    return green("It has {n} missions", n=len(found))


def words(session: CheckUpSession) -> Found:
    """Those for the states of its newest orders."""
    seen = {clean(entry.get("state"), 40).capitalize() for entry in session.entries}
    if unknown := sorted(filter(None, seen - set(ORDER_STATES))):
        return amber(
            "It has its own words for the states of orders: {words}",
            "A run with an unknown word is followed until the fleet has ended it, and shown as failed with that word.",
            words=", ".join(unknown),
        )
    return green("It speaks English")


def users(session: CheckUpSession) -> Found:
    """Whether its user there is the app's own."""
    user = session.robot.get_once("/users/me").one
    guid, name = clean(user.get("guid"), 80), clean(user.get("name"), 80) or "?"
    if not guid:
        return amber("It does not say who the app's user is", NOT_MARKED)
    if guid.startswith(BUILT_IN):
        return amber("User {user} is one that all fleets have, so people may use it too", NOT_MARKED, user=name)
    return green("User {user} is not one that all fleets have", user=name)


def has_own_user(session: CheckUpSession) -> bool:
    guid = clean(session.robot.get_once("/users/me").one.get("guid"), 80)
    return bool(guid) and not guid.startswith(BUILT_IN)


def certificate(session: CheckUpSession) -> Found:
    """Of a fleet that is asked with a key."""
    if session.robot.client.address.is_secure:
        return probes.certificate(session)
    return amber(
        "It is asked over http: anyone on the network can read the API key",
        "Change its address to https://… Otherwise keep its network for the fleet only.",
    )


def ended_orders(session: CheckUpSession) -> Found:
    """Until when a start in doubt, which may have run, is certainly shown."""
    client = session.robot.client
    assert isinstance(client, EnterpriseVehicle)
    try:
        shown = session.facts["ended_shown_s"] = client.ended_shown_for(LONG_AGO)
    except RobotError as error:
        return red(
            "Its orders can't be read: {problem}",
            "The app looks for a start whose answer was lost there: it is not sent again.",
            problem=error.message,
        )
    if shown >= SHOWN_FOR_LONG:
        return green("It shows orders that ended {minutes} min ago", minutes=int(shown / 60))
    return amber(
        "It shows no order that ended more than {seconds} s ago",
        "A start whose answer was lost longer ago may have run, so it is not sent again: check up again when the fleet has "
        "worked for an hour.",
        seconds=int(shown),
    )


CLASSIC: Sequence[tuple[Topic, Callable[[CheckUpSession], Found]]] = (
    (Topic.CERTIFICATE, probes.certificate),
    (Topic.CLOCK, clock),
    (Topic.RIGHTS, probes.rights),
    (Topic.PASSWORD, probes.password),
    (Topic.MISSIONS, missions),
    (Topic.QUEUE, queue),
    (Topic.LANGUAGE, words),
    (Topic.OTHERS, users),
)
ENTERPRISE: Sequence[tuple[Topic, Callable[[CheckUpSession], Found]]] = (
    (Topic.CERTIFICATE, certificate),
    (Topic.CLOCK, clock),
    (Topic.MISSIONS, missions),
    (Topic.QUEUE, ended_orders),
)


def read_fleet(session: CheckUpSession, client: ClassicVehicle | EnterpriseVehicle) -> FleetIdentity | None:
    """All topics that are read, in the order of the report. None: it could not be asked; a finding says why. Raises
    Cancelled."""
    session.at(message("Asking who it is"), 0.0)
    try:
        fleet = client.identify_fleet()
    except RobotError as error:
        session.add(*_silent(client, error))
        return None
    status = RobotStatus(serial_number=fleet.identity)
    session.identity = replace(session.identity, status=status, software=fleet.software)
    session.add(Topic.IDENTITY, _robots(fleet))
    if isinstance(client, ClassicVehicle):
        name = clean(session.robot.get_once("/users/me").one.get("name"), 80)
        session.identity = replace(session.identity, user_name=name)
    else:
        session.add(Topic.SOFTWARE, _version(fleet.software or "?", client))
    for topic, look in CLASSIC if isinstance(client, ClassicVehicle) else ENTERPRISE:
        session.at(message("Reading missions and maps"), 3.0)
        session.add(topic, look(session))
    return fleet


def _silent(client: ClassicVehicle | EnterpriseVehicle, error: RobotError) -> tuple[Topic, Found]:
    if isinstance(error, Unauthorized) and isinstance(client, EnterpriseVehicle):
        return Topic.RIGHTS, red(
            "It does not accept the API key: {problem}", "Enter it again in its settings.", problem=error.message
        )
    return probes.silent(error)


def _robots(fleet: FleetIdentity) -> Found:
    names = ", ".join(sorted(vehicle.name or vehicle.id for vehicle in fleet.vehicles)[:20])
    if not names:
        return red("It has no robots", "Add them at the fleet: nothing can be scheduled on it until it has some.")
    return green("It has {n} robots: {names}", n=len(fleet.vehicles), names=names)


def _version(software: str, client: EnterpriseVehicle) -> Found:
    if client.finds_by_id:
        return green("Its software is {software}", software=software)
    return amber(
        "Its software is {software}: an order that has ended can't be found by its id",
        "Give the app an API key that nothing else uses. From software 1.5 on each order is found by its id.",
        software=software,
    )
