"""Check-ups of fleets: the same as of robots, with other probes. Nothing moves: the one order that is tried is to begin a
day later and is deleted before. Only a fleet that was tried so gets starts by itself (``Fleet.known``)."""

from __future__ import annotations

import logging
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import replace

from app.database.fleets import FleetRepository
from app.database.robots import RobotRepository
from app.domain.check_up import LeftBehind, Report, RobotProfile, Topic, Trial
from app.domain.message import Message, message
from app.domain.models import ANY_VEHICLE, Fleet, InvalidInput, Robot, existing
from app.domain.robot import FleetIdentity, Vehicle
from app.mir.classic_vehicle import ClassicVehicle
from app.mir.enterprise_vehicle import EnterpriseVehicle
from app.mir.errors import RobotError
from app.mir.raw_client import PATIENT, RawClient
from app.services.check_up import fleet_probes, fleet_trial
from app.services.check_up.base import CheckUpsOf, IsWanted, Keep, OnProgress, mission_called
from app.services.check_up.fleet_orders import ClassicOrders, EnterpriseOrders, Orders
from app.services.check_up.fleet_trial import FleetJournal, OrderTrial
from app.services.check_up.session import Cancelled, CheckUpSession, amber, green, red

log = logging.getLogger(__name__)

FleetClient = ClassicVehicle | EnterpriseVehicle


class FleetCheckUps(CheckUpsOf[Fleet, FleetClient, FleetJournal]):
    """A trial needs a mission and a robot."""

    WHAT = "fleet"
    _fleets = FleetRepository()

    def report(self, id_: int) -> Report | None:
        return self._check_ups.report_of_fleet(self._db.read(), id_)

    @staticmethod
    def length_s(trial: Trial | None) -> float:
        return fleet_probes.LENGTH_S + (fleet_trial.TAKES_S if trial is not None else 0.0)

    @staticmethod
    def moves(name: str, trial: Trial) -> Message:
        return message(
            "{fleet} gets one order: {mission} for {robot}, not before tomorrow. It is looked at, and deleted within half a "
            "minute. The order should not run. If {robot} begins it anyway, it is cancelled at once: stand where you "
            "can stop the robot.",
            fleet=name,
            mission=trial.mission or "?",
            robot=trial.robot or "?",
        )

    def robots(self, fleet_id: int) -> Sequence[str]:
        """Names of its robots, as the app calls them."""
        fleet = self._get(fleet_id)
        with self._client(fleet) as client:
            return sorted(self._by_name(fleet, client.identify_fleet()), key=str.casefold)

    # ------------------------------------------------------------------ the check-up
    def _run(self, it: Fleet, trial: Trial | None, on_progress: OnProgress, is_wanted: IsWanted) -> tuple[Report, Keep]:
        if trial is not None:
            if not (trial.mission and trial.robot):
                raise InvalidInput("mission", "choose a mission and a robot of the fleet for the trial")
            self._check_room(it)
        report, known = self._look(it, trial, on_progress, is_wanted)
        return report, lambda c: self._check_ups.put_of_fleet(c, it.id, report, known)

    def _look(
        self, fleet: Fleet, trial: Trial | None, on_progress: OnProgress, is_wanted: IsWanted
    ) -> tuple[Report, RobotProfile | None]:
        """And what the app may rely on from now on."""
        began_at, began = self._clock.now(), self._clock.monotonic()
        is_complete, is_known = False, False
        with self._client(fleet) as client:
            session = self._session(client, is_wanted=is_wanted, on_progress=on_progress, length_s=self.length_s(trial))
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
        stored = self._get(fleet.id)
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
                missing = InvalidInput("mission", "the fleet has no mission {mission}", mission=trial.mission or "?")
                mission = mission_called(trial.mission or "", client, missing)
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
            journal = self._journal(fleet, left)
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

    def _finish(self, session: CheckUpSession, orders: Orders, journal: FleetJournal) -> None:
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

    def _orders(self, robot: RawClient, client: FleetClient, fleet: Fleet) -> Orders:
        if isinstance(client, EnterpriseVehicle):
            return EnterpriseOrders(robot, client)
        robots = self._fleets.robot_ids(self._db.read(), fleet.id)
        return ClassicOrders(
            robot, client, lambda number: any(self._ledger.is_claimed(robot_id, number) for robot_id in robots)
        )

    # ------------------------------------------------------------------ what a trial left
    def _left(self) -> Mapping[int, LeftBehind]:
        return self._check_ups.left_on_fleets(self._db.read())

    def _journal(self, it: Fleet, left: LeftBehind) -> FleetJournal:
        return FleetJournal(self._db, self._holds, self._alarms, it, left)

    def _put_back(self, it: Fleet, journal: FleetJournal) -> Message | None:
        with self._client(it, Vehicle(journal.left.vehicle, "")) as client:
            session = self._session(client)
            return fleet_trial.put_back(session, self._orders(session.robot, client, it), journal)

    # ------------------------------------------------------------------ inside
    @contextmanager
    def _client(self, fleet: Fleet, vehicle: Vehicle | None = None) -> Iterator[FleetClient]:
        """For this robot of the fleet."""
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

    def _get(self, id_: int) -> Fleet:
        return existing(self._fleets.get(self._db.read(), id_), "fleet", "this fleet no longer exists")


def _name(vehicle: Vehicle) -> str:
    return vehicle.name or vehicle.id
