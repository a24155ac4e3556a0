"""Check-ups of fleets: the same as of robots, with other probes. Nothing moves: the one order that is tried is to begin a
day later and is deleted before. Only a fleet that was tried so gets starts by itself (``Fleet.known``)."""

from __future__ import annotations

import logging
import uuid
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from typing import Any

from app.database.check_ups import CheckUpRepository
from app.database.connection import Database
from app.database.fleets import FleetRepository
from app.database.robots import RobotRepository
from app.domain.check_up import LeftBehind, Progress, Report, RobotProfile, Topic, Trial
from app.domain.clock import Clock
from app.domain.message import Message, message
from app.domain.models import ANY_VEHICLE, Fleet, InvalidInput, Robot, Settings, existing
from app.domain.robot import FleetIdentity, Vehicle
from app.mir.classic_vehicle import ClassicVehicle
from app.mir.enterprise_vehicle import EnterpriseVehicle
from app.mir.errors import RobotError
from app.mir.raw_client import PATIENT, RawClient
from app.mir.target import Target
from app.services.check_up import fleet_probes, fleet_trial
from app.services.check_up.fleet_orders import ClassicOrders, EnterpriseOrders
from app.services.check_up.fleet_trial import FleetJournal, OrderTrial
from app.services.check_up.remains import Remains
from app.services.check_up.session import Cancelled, CheckUpSession, amber, green, red
from app.services.check_up.trials import missions_of
from app.services.dispatch.ledger import Ledger
from app.services.live.alarms import Alarms
from app.services.live.changes import Changes
from app.services.live.changes import Topic as Change
from app.services.live.holds import Holds

log = logging.getLogger(__name__)

FleetClient = ClassicVehicle | EnterpriseVehicle


class FleetCheckUps(Remains):
    """By the ids of fleets; else as ``CheckUps``."""

    def __init__(
        self,
        db: Database,
        *,
        clock: Clock,
        ledger: Ledger,
        holds: Holds,
        alarms: Alarms,
        changes: Changes,
        settings: Callable[[], Settings],
        make_client: Callable[[Robot], Target],
    ) -> None:
        super().__init__(clock)
        self._db, self._ledger, self._holds, self._alarms, self._changes = db, ledger, holds, alarms, changes
        self._settings, self._make_client = settings, make_client
        self._fleets, self._check_ups = FleetRepository(), CheckUpRepository()

    # ------------------------------------------------------------------ before
    def report(self, fleet_id: int) -> Report | None:
        """Of the last one."""
        return self._check_ups.report_of_fleet(self._db.read(), fleet_id)

    @staticmethod
    def length_s(trial: Trial | None) -> float:
        """Of the whole check-up, about."""
        return length_s(trial)

    def moves(self, fleet_id: int, trial: Trial) -> Message:
        """Exactly what happens in a trial, for a person to agree to."""
        return moves(self._fleet(fleet_id).name, trial)

    def harmless_missions(self, fleet_id: int) -> Sequence[str]:
        """Names of its missions. Asks the fleet, as ``robots``. Raises RobotError or InvalidInput."""
        with self._client(self._fleet(fleet_id)) as client:
            return sorted(missions_of(client), key=str.casefold)

    def robots(self, fleet_id: int) -> Sequence[str]:
        """Names of its robots, as the app calls them."""
        fleet = self._fleet(fleet_id)
        with self._client(fleet) as client:
            return sorted(self._by_name(fleet, client.identify_fleet()), key=str.casefold)

    # ------------------------------------------------------------------ the check-up
    def run(
        self,
        fleet_id: int,
        trial: Trial | None = None,
        on_progress: Callable[[Progress], None] = lambda progress: None,
        is_wanted: Callable[[], bool] = lambda: True,
    ) -> Report:
        """As ``CheckUps.run``; a trial needs a mission and a robot."""
        fleet = self._fleet(fleet_id)
        if trial is not None and not (trial.mission and trial.robot):
            raise InvalidInput("mission", "choose a mission and a robot of the fleet for the trial")
        with self._alone_with(fleet.id, fleet.name):
            try:  # first: remains of the last one may block this one
                problem = self._put_back(fleet)
            except (RobotError, InvalidInput) as error:
                problem = error.message
            if problem is not None and trial is not None:
                raise InvalidInput("robot", "the last check-up has not been undone yet: {problem}", problem=problem)
            if trial is not None:
                self._check_room(fleet)
            report, known = self._run(fleet, trial, on_progress, is_wanted)
        if report.is_complete:
            self._db.write(lambda c: self._check_ups.put_of_fleet(c, fleet.id, report, known))
            self._changes.publish(Change.ROBOTS)
        log.info(
            "fleet %r was checked up: %s%s", fleet.name, report.level, "" if report.is_complete else ", not complete"
        )
        return report

    def _run(
        self,
        fleet: Fleet,
        trial: Trial | None,
        on_progress: Callable[[Progress], None],
        is_wanted: Callable[[], bool],
    ) -> tuple[Report, RobotProfile | None]:
        """And what the app may rely on from now on."""
        began_at, began = self._clock.now(), self._clock.monotonic()
        is_complete, is_known = False, False
        with self._client(fleet) as client:
            session = self._session(client, is_wanted=is_wanted, on_progress=on_progress, length_s=length_s(trial))
            with suppress(Cancelled):
                said = fleet_probes.read_fleet(session, client)
                if said is not None:
                    self._note_identity(fleet, said)
                    is_complete = trial is None
                if said is not None and trial is not None:
                    is_complete, is_known = self._try(session, fleet, said, trial)
        profile = RobotProfile(session.identity.serial_number, session.identity.software, **session.facts)
        was_tried = any(finding.topic is Topic.LEFT for finding in session.findings)
        report = Report(
            fleet.name,
            fleet.address,
            "",
            began_at,
            self._clock.monotonic() - began,
            tuple(session.findings),
            profile,
            trial.mission or "" if trial is not None and was_tried else "",
            is_complete,
            of_fleet=True,
        )
        if trial is None and fleet.profile is not None:
            shown = session.facts.get("ended_shown_s", fleet.profile.ended_shown_s)
            return report, replace(fleet.profile, ended_shown_s=shown)
        return report, profile if is_known else None

    def _note_identity(self, fleet: Fleet, said: FleetIdentity) -> None:
        """A profile counts for that fleet with this software. Raises InvalidInput where it is another one."""
        if None not in (fleet.identity, said.identity) and fleet.identity != said.identity:
            raise InvalidInput(
                "address",
                "another fleet answers at this address: {found} instead of {expected}",
                found=said.identity,
                expected=fleet.identity,
            )
        stored = self._fleet(fleet.id)
        self._db.write(lambda c: self._fleets.note_identity(c, stored, said.identity, said.software))

    # ------------------------------------------------------------------ the trial
    def _try(self, session: CheckUpSession, fleet: Fleet, said: FleetIdentity, trial: Trial) -> tuple[bool, bool]:
        """Whether it was tried to the end, and whether the app can rely on what was found. Raises Cancelled."""
        by_name = {_name(each): each for each in said.vehicles} | self._by_name(fleet, said)
        vehicle = by_name.get(trial.robot)
        with self._client(fleet, vehicle) as client:
            session.robot = RawClient(client, self._clock)
            try:
                if vehicle is None:
                    raise InvalidInput("robot", "the fleet has no robot {robot}", robot=trial.robot)
                mission = _mission(client, trial)
                floor = client.highest_queue_id() or 0
            except (InvalidInput, RobotError) as refused:
                session.add(Topic.ORDER, amber("Not tried: {problem}", "Check up again.", problem=refused.message))
                return False, False
            date = fleet_probes.date_of(session)
            if date is None:
                session.add(
                    Topic.ORDER,
                    red(
                        "Not tried, as it does not report its time",
                        "An order for tomorrow could begin at once: nothing is sent by itself.",
                    ),
                )
                return True, False
            left = LeftBehind(fleet.identity, None, (str(uuid.uuid4()),), floor, queued=mission, vehicle=vehicle.id)
            journal = FleetJournal(self._db, self._holds, self._alarms, fleet, left)
            orders = self._orders(session.robot, client, fleet)
            tried = OrderTrial(session, orders, journal, date)
            try:
                journal.begin(self._fleets.robot_ids(self._db.read(), fleet.id))
                self._check_room(fleet)
                is_complete = tried.run()
            finally:
                self._finish(session, orders, journal)
        return is_complete, tried.is_known

    def _by_name(self, fleet: Fleet, said: FleetIdentity) -> dict[str, Vehicle]:
        """Its robots by their names in the app; those that were not added by the fleet's: another fleet may have one of
        that name."""
        robots = RobotRepository().all(self._db.read())
        added = {robot.vehicle: robot.name for robot in robots if robot.fleet_id == fleet.id}
        return {added.get(each.id, f"{_name(each)} ({fleet.name})"): each for each in said.vehicles}

    def _finish(self, session: CheckUpSession, orders: ClassicOrders | EnterpriseOrders, journal: FleetJournal) -> None:
        """Delete what is still there, and report it as a finding."""
        try:
            problem = fleet_trial.put_back(session, orders, journal)
        except RobotError as error:
            problem = error.message
        if problem is None:
            session.add(Topic.LEFT, green("Nothing of the trial is left there"))
            return
        journal.warn(problem)
        session.add(
            Topic.LEFT,
            red(
                "An order of the trial may be left there: {problem}",
                "It would begin tomorrow. The app deletes it as soon as it can: look at the fleet.",
                problem=problem,
            ),
        )

    def _orders(self, robot: RawClient, client: FleetClient, fleet: Fleet) -> ClassicOrders | EnterpriseOrders:
        if isinstance(client, EnterpriseVehicle):
            return EnterpriseOrders(robot, client)
        robots = self._fleets.robot_ids(self._db.read(), fleet.id)
        return ClassicOrders(
            robot, client, lambda number: any(self._ledger.is_claimed(robot_id, number) for robot_id in robots)
        )

    # ------------------------------------------------------------------ what a trial left
    def _left(self) -> Iterable[int]:
        return self._check_ups.left_on_fleets(self._db.read())

    def put_back(self, id_: int) -> Message | None:
        fleet = self._fleet(id_)
        with self._alone_with(fleet.id, fleet.name):
            return self._put_back(fleet)

    def _put_back(self, fleet: Fleet) -> Message | None:
        left = self._check_ups.left_on_fleets(self._db.read()).get(fleet.id)
        if left is None:
            return None
        self._holds.check_is_no_copy()
        journal = FleetJournal(self._db, self._holds, self._alarms, fleet, left)
        try:
            with self._client(fleet, Vehicle(left.vehicle, "")) as client:
                session = self._session(client)
                problem = fleet_trial.put_back(session, self._orders(session.robot, client, fleet), journal)
        except RobotError as error:
            journal.warn(error.message)
            raise
        if problem is not None:
            journal.warn(problem)
        return problem

    # ------------------------------------------------------------------ inside
    def _session(self, client: FleetClient, **values: Any) -> CheckUpSession:
        return CheckUpSession(RawClient(client, self._clock), self._clock, self._settings().timezone, **values)

    @contextmanager
    def _client(self, fleet: Fleet, vehicle: Vehicle | None = None) -> Iterator[FleetClient]:
        """A separate one with long time-outs, for this robot of the fleet."""
        if fleet.needs_password or not fleet.token:
            raise InvalidInput(
                "fleet", "{fleet} is switched off until its password is entered in Settings", fleet=fleet.name
            )
        robot = Robot("", "", vehicle=vehicle.id if vehicle else ANY_VEHICLE)
        with closing(self._make_client(robot.within(fleet))) as client:
            assert isinstance(client, ClassicVehicle | EnterpriseVehicle)
            client.timeouts = PATIENT
            yield client

    def _check_room(self, fleet: Fleet) -> None:
        """Its order could be taken for a start whose answer was lost. Raises InvalidInput."""
        self._holds.check_is_no_copy()
        for robot_id in self._fleets.robot_ids(self._db.read(), fleet.id):
            if rows := self._ledger.open_for(robot_id):
                raise InvalidInput(
                    "robot",
                    "{mission} waits for {robot} or runs there: check up after it",
                    mission=rows[0].mission,
                    robot=rows[0].robot,
                )

    def _fleet(self, fleet_id: int) -> Fleet:
        return existing(self._fleets.get(self._db.read(), fleet_id), "fleet", "this fleet no longer exists")


def length_s(trial: Trial | None) -> float:
    """Of the whole check-up, about."""
    return fleet_probes.LENGTH_S + (fleet_trial.TAKES_S if trial is not None else 0.0)


def moves(fleet: str, trial: Trial) -> Message:
    """What happens at the fleet of this name."""
    return message(
        "{fleet} gets one order: {mission} for {robot}, not before tomorrow. It is looked at, and deleted within half a "
        "minute. The order should not run. If {robot} begins it anyway, it is cancelled at once: stand where you "
        "can stop the robot.",
        fleet=fleet,
        mission=trial.mission or "?",
        robot=trial.robot or "?",
    )


def _name(vehicle: Vehicle) -> str:
    return vehicle.name or vehicle.id


def _mission(client: FleetClient, trial: Trial) -> str:
    """Its guid. Raises InvalidInput or RobotError."""
    guid = missions_of(client).get(trial.mission or "")
    if guid is None:
        raise InvalidInput("mission", "the fleet has no mission {mission}", mission=trial.mission or "?")
    if any(parameter.default in (None, "") for parameter in client.parameters(guid) or ()):
        raise InvalidInput(
            "mission", "{mission} asks for values when it is started: choose another mission", mission=trial.mission
        )
    return guid
