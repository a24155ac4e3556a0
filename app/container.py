"""Builds the services once, without kivy: the window, ``--headless``, the one-shot commands and the tests use the same."""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from app.database.alarms import AlarmRepository
from app.database.backups import newest_good_backup
from app.database.connection import Database, DatabaseDamaged
from app.database.executions import ExecutionRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.domain.activity import can_work, is_charging
from app.domain.clock import Clock, SystemClock
from app.domain.models import ANY_VEHICLE, Connection, Fleet, FleetKind, Robot
from app.domain.robot import FleetIdentity
from app.mir.address import Address
from app.mir.classic_vehicle import ClassicVehicle
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.enterprise_vehicle import EnterpriseVehicle
from app.mir.fleet_connection import FleetConnection
from app.mir.target import Target
from app.mir.transport import Pace
from app.services.catalogue import schedule_edit, zones
from app.services.catalogue.catalogue import Catalogue
from app.services.catalogue.database_check import find_problem
from app.services.catalogue.moving import Moving
from app.services.catalogue.pausing import Pausing
from app.services.catalogue.preview import Forecasts
from app.services.check_up.fleet_check_ups import FleetCheckUps
from app.services.check_up.service import CheckUps
from app.services.dispatch.allocator import Allocator
from app.services.dispatch.chores import SameMachine
from app.services.dispatch.clock_guard import ClockGuard
from app.services.dispatch.context import Context
from app.services.dispatch.engine import Engine
from app.services.dispatch.ledger import Ledger
from app.services.dispatch.planner import Planner
from app.services.dispatch.restored_starts import RestoredStarts
from app.services.dispatch.runner import Runner
from app.services.dispatch.worker import RobotWorker
from app.services.files.calendar_import import CalendarFiles
from app.services.files.exports import DataFiles
from app.services.files.plan_export import PlanFiles
from app.services.history.kpis import Kpis
from app.services.history.runs import History, RobotStates
from app.services.history.shift_report import ShiftReports
from app.services.live.access import Access
from app.services.live.alarms import Alarms, Prompts
from app.services.live.changes import CachedUntilChanged, Changes, Topic
from app.services.live.downtime import Downtime
from app.services.live.holds import Clearing, Holds
from app.services.live.mission_parameters import MissionParameters
from app.services.live.snapshots import Snapshots
from app.services.live.tablet import Tablet, machine_id
from app.services.live.tablet_zone import TabletZone, tablet_zone
from app.services.planning.durations import LiveRobots
from app.services.planning.plan import Plan
from app.services.planning.working_days import working_calendar
from app.services.robots.commands import ClientFactory, Operator
from app.services.robots.fleets import Fleets
from app.services.robots.maps import RobotMaps
from app.services.robots.mission_actions import MissionActionsReader
from app.services.robots.missions import RobotMissions
from app.services.robots.proposed_places import ProposedPlaces
from app.services.suggestions.suggestions import Suggestions

log = logging.getLogger(__name__)

DATABASE_NAME = "amr-scheduler.db"
MAPS = "maps"  # directory next to the database


class Repositories:
    def __init__(self) -> None:
        self.robots = RobotRepository()
        self.missions = MissionRepository()
        self.schedules = ScheduleRepository()
        self.executions = ExecutionRepository()
        self.settings = SettingsRepository()
        self.alarms = AlarmRepository()


class Container:
    """Every service by name. ``make_client`` and ``ask_fleet`` may be replaced, so that tests and the simulation speak to
    robots and fleets without sockets. ``machine`` identifies this machine; ``find_zone`` finds its time zone."""

    def __init__(
        self,
        db: Database,
        clock: Clock | None = None,
        *,
        make_client: ClientFactory | None = None,
        ask_fleet: Callable[[Fleet], FleetIdentity] | None = None,
        with_window: bool = False,
        machine: str | None = None,
        find_zone: Callable[[], TabletZone] = tablet_zone,
    ) -> None:
        self.db, self._find_zone = db, find_zone
        self.clock = clock = clock or SystemClock()
        self.repositories = repositories = Repositories()
        self.changes = Changes()
        connector = Connector()
        self.make_client = make_client or connector
        self.settings = CachedUntilChanged(lambda: repositories.settings.load(db.read()), self.changes, Topic.SETTINGS)
        # The present working days, exceptions and public holidays included.
        self.calendar = CachedUntilChanged(
            lambda: working_calendar(db.read(), self.settings()), self.changes, Topic.SETTINGS, Topic.CALENDAR
        )
        self.downtime = Downtime()
        self.snapshots = Snapshots(self.changes)
        self.alarms = Alarms(db, clock, self.changes)
        self.access = Access(db, clock, self.changes, self.alarms)
        self.holds = Holds(db, clock, self.changes)
        self.clearing = Clearing(self.changes)
        self.tablet = Tablet(db, clock, self.holds, machine)
        self.ledger = Ledger(db, clock, self.changes, self.alarms)
        self.history = History(db)
        self.parameters = MissionParameters(db, clock, self.make_client, self.snapshots, self.changes)
        self.catalogue = Catalogue(db, clock, self.changes, self.parameters)
        self.kpis = Kpis(db, clock)
        live = LiveRobots(
            self._is_unavailable, lambda robot_id: is_charging(self.snapshots.get(robot_id).status), self._may_have
        )
        self.plan = Plan(db, clock, live)
        robots = CachedUntilChanged(lambda: repositories.robots.all(db.read()), self.changes, Topic.ROBOTS)
        self.restored_starts = RestoredStarts(db, clock, self.changes, self.tablet, robots, self.settings)
        planner = Planner(
            db,
            clock=clock,
            downtime=self.downtime,
            alarms=self.alarms,
            ledger=self.ledger,
            changes=self.changes,
            restored_starts=self.restored_starts,
            hold_late_starts=with_window,
        )
        guard = ClockGuard(db, clock, self.holds, self.alarms, self.downtime)
        self.context = Context(
            db,
            clock,
            self.ledger,
            self.holds,
            self.clearing,
            self.alarms,
            self.downtime,
            self.snapshots,
            self.settings,
            self.calendar,
            self.tablet,
            self.restored_starts,
            lambda: self.engine.plan_version,
            guard.is_contradicted,
            self.parameters,
        )
        self.robot_missions = RobotMissions(self.catalogue.robot, self.make_client, clock, self.parameters)
        self.allocator = Allocator(self.context, self.robot_missions.lacks)
        self.engine = Engine(
            planner=planner,
            guard=guard,
            ledger=self.ledger,
            clock=clock,
            alarms=self.alarms,
            changes=self.changes,
            robots=lambda: repositories.robots.all(db.read()),
            make_worker=self.make_worker,
            poll_interval=lambda: self.settings().poll_interval_seconds,
            probe=self._probe,
            restored_starts=self.restored_starts,
            allocator=self.allocator,
        )
        self.engine.add_chore("Watching the database", db.check_in_place)
        of_one_machine = CachedUntilChanged(
            lambda: repositories.robots.of_one_machine(db.read()), self.changes, Topic.ROBOTS
        )
        self.engine.add_chore("Comparing serial numbers", SameMachine(of_one_machine, self.alarms).tick)
        self.prompts = Prompts(self.snapshots, self.alarms, self.changes, self.catalogue.robot)
        self.engine.add_chore("Reading the public holidays", self._read_holidays)
        self.runner = Runner(db, self.engine, clock, self.alarms)
        self.mission_actions = MissionActionsReader(db, self.catalogue, self.snapshots, self.make_client, clock)
        self.check_ups = CheckUps(
            db,
            clock=clock,
            ledger=self.ledger,
            holds=self.holds,
            alarms=self.alarms,
            changes=self.changes,
            settings=self.settings,
            make_client=self.make_client,
        )
        self.fleet_check_ups = FleetCheckUps(
            db,
            clock=clock,
            ledger=self.ledger,
            holds=self.holds,
            alarms=self.alarms,
            changes=self.changes,
            settings=self.settings,
            make_client=self.make_client,
        )
        self.operator = Operator(
            db,
            ledger=self.ledger,
            clock=clock,
            engine=self.engine,
            holds=self.holds,
            clearing=self.clearing,
            settings=self.settings,
            make_client=self.make_client,
            parameters=self.parameters,
            keep_paused=self.check_ups.keep_paused,
            answered=self.prompts.answered,
        )
        self.fleets = Fleets(self.catalogue, ask_fleet or connector.ask_fleet, clock)
        self.engine.add_chore("Asking fleets who they are", self.fleets.tick)
        self.maps = RobotMaps(db.path.parent / MAPS, self.catalogue.robot, self.make_client, clock)
        self.proposed_places = ProposedPlaces(db)
        self.robot_states = RobotStates(db)
        self.forecasts = Forecasts(db, clock, live)
        self.suggestions = Suggestions(db, clock, self._may_have, self.forecasts.free_at)
        self.pausing = Pausing(self.catalogue)
        self.moving = Moving(self.catalogue)
        self.files = DataFiles(db, self.catalogue, clock)
        self.plan_files = PlanFiles(db, self.catalogue, clock, self.plan)
        self.calendar_files = CalendarFiles(db, self.catalogue, clock)
        self.shift_reports = ShiftReports(db, clock)

    @classmethod
    def open(
        cls,
        data_dir: Path,
        clock: Clock | None = None,
        *,
        make_client: ClientFactory | None = None,
        with_window: bool = False,
    ) -> Container:
        """Open (or begin) the database in this directory. Raises what Database.open raises, and DatabaseDamaged for values in it that can't
        be used: met later, they would end all scheduling."""
        db = Database.open(data_dir / DATABASE_NAME)
        if problem := find_problem(db.read()):
            db.close()
            raise DatabaseDamaged(db.path, problem, backup=newest_good_backup(db.path, find_problem))
        container = cls(db, clock, make_client=make_client, with_window=with_window, machine=machine_id())
        container.first_start()
        return container

    def _is_unavailable(self, robot_id: int) -> bool:
        """Whether a robot is known to be silent or stopped."""
        seen = self.snapshots.get(robot_id)
        if seen.connection not in (Connection.UNKNOWN, Connection.CONNECTED, Connection.SLOW):
            return True
        return seen.status is not None and not can_work(seen.status)

    def _may_have(self, robot_id: int, guid: str) -> bool:
        """Whether a robot has a mission, as far as its list is known."""
        known = self.robot_missions.names(robot_id)
        return not known or guid in known

    def _probe(self) -> None:
        """Try to write. Raises DatabaseUnavailable if nothing can be written."""
        self.db.write(lambda c: self.repositories.settings.put(c, "probed_at", self.clock.now().isoformat()))

    def _read_holidays(self) -> None:
        """Load the large library they come from before something is due."""
        self.calendar().day_status(self.clock.now().date())

    def first_start(self) -> None:
        """A fresh database takes the tablet's own time zone, and its identity before the first backup can be made."""
        settings = self.repositories.settings
        if not settings.is_stored(self.db.read(), "install_id"):
            self.db.write(settings.install_id)
        self.tablet.begin()
        for line in self.catalogue.edit(lambda edit: zones.take_known_zones(edit, self._find_zone)):
            log.warning("At the start %s", line)
        self.catalogue.edit(lambda edit: edit.purge())
        if count := self.catalogue.edit(lambda edit: schedule_edit.replan_outdated(edit)):
            log.warning(
                "The rules or the time zone data are others than before: %d schedules were planned again", count
            )

    def make_worker(self, robot: Robot) -> RobotWorker:
        return RobotWorker(robot, self.make_client(robot), self.context)

    def close(self) -> None:
        self.runner.stop()
        self.db.close()


class Connector:
    """Makes clients over HTTP for configured robots. Those of one address share their pace, those of one fleet also what
    it says of all its robots."""

    def __init__(self) -> None:
        self._paces: dict[str, Pace] = {}
        self._connections: dict[tuple[str | None, ...], FleetConnection] = {}

    def __call__(self, robot: Robot) -> Target:
        if robot.fleet is not None:
            return self._vehicle(robot, robot.fleet)
        return RobotClient(
            Address.parse(robot.address),
            Token.from_header(robot.token or ""),
            certificate_sha256=robot.certificate_sha256,
            serial_number=robot.serial_number,
            identified_by=robot.identified_by,
            profile=robot.known,
            pace=self._paces.setdefault(robot.address, Pace()),
        )

    def ask_fleet(self, fleet: Fleet) -> FleetIdentity:
        """Who it is, and its robots, as of now. Raises RobotError or InvalidInput."""
        any_of_it = Robot("", "", vehicle=ANY_VEHICLE).within(fleet)
        with closing(self._vehicle(any_of_it, replace(fleet, identity=None))) as client:
            return client.identify_fleet()

    def _vehicle(self, robot: Robot, fleet: Fleet) -> ClassicVehicle | EnterpriseVehicle:
        kind = EnterpriseVehicle if fleet.kind is FleetKind.ENTERPRISE else ClassicVehicle
        key = fleet.address, fleet.token, fleet.certificate_sha256
        return kind(
            Address.parse(fleet.address),
            Token.from_header(fleet.token or ""),
            robot.vehicle,
            connection=self._connections.setdefault(key, FleetConnection()),
            certificate_sha256=fleet.certificate_sha256,
            serial_number=robot.serial_number,
            identified_by=robot.identified_by,
            fleet_identity=fleet.identity,
            profile=robot.known,
        )
