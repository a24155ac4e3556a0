"""What Settings uses and shows: its services, and the facts of one moment, read on a background thread."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from app.domain.check_up import Report
from app.domain.clock import Clock
from app.domain.models import DayException, Fleet, Mission, Place, Robot, RobotSnapshot, Schedule, Settings
from app.screens.common.mission_names import NOTHING_KNOWN, MissionNames
from app.screens.common.name_order import by_name, with_id
from app.screens.common.plant import Plant
from app.services.catalogue.catalogue import Catalogue
from app.services.check_up.fleet_check_ups import FleetCheckUps
from app.services.check_up.service import CheckUps
from app.services.files.calendar_import import CalendarFiles
from app.services.files.exports import DataFiles
from app.services.files.places import FoundFile
from app.services.live.access import Access
from app.services.live.snapshots import Snapshots
from app.services.planning import public_holidays
from app.services.planning.plan import Plan
from app.services.planning.working_days import WorkingCalendar
from app.services.robots.commands import Operator
from app.services.robots.fleets import Fleets
from app.services.robots.missions import RobotMissions
from app.services.robots.proposed_places import ProposedPlace, ProposedPlaces


@dataclass(frozen=True)
class SettingsServices:
    """The services that Settings uses; each field is named as the container's attribute."""

    settings: Callable[[], Settings]
    clock: Clock
    catalogue: Catalogue
    plan: Plan
    snapshots: Snapshots
    access: Access
    operator: Operator
    robot_missions: RobotMissions
    proposed_places: ProposedPlaces
    check_ups: CheckUps
    fleets: Fleets
    fleet_check_ups: FleetCheckUps
    files: DataFiles
    calendar_files: CalendarFiles


@dataclass(frozen=True)
class SettingsFacts(Plant):
    fleets: tuple[Fleet, ...] = ()
    missions: tuple[Mission, ...] = ()
    usual_s: Mapping[str, float] = field(default_factory=dict)  # how long missions took, by guid; absent: never run
    schedules: tuple[Schedule, ...] = ()
    refused: frozenset[int] = frozenset()  # schedules whose values no robot takes
    places: tuple[Place, ...] = ()
    proposed: tuple[ProposedPlace, ...] = ()
    snapshots: Mapping[int, RobotSnapshot] = field(default_factory=dict)  # by robot id
    names: Mapping[int, Mapping[str, str]] = field(
        default_factory=dict
    )  # robot id -> guid -> name; absent: not read from the robot yet
    reports: Mapping[int, Report] = field(default_factory=dict)  # of check-ups, by robot id; absent: never checked up
    fleet_reports: Mapping[int, Report] = field(default_factory=dict)  # the same, by fleet id
    left_behind: frozenset[int] = frozenset()  # robots with remaining changes of a check-up
    backups: tuple[FoundFile, ...] = ()  # newest first
    exceptions: tuple[DayException, ...] = ()  # days off and extra working days
    country: str = ""  # name of the country of the public holidays; empty: none
    region: str = ""  # name of its part
    has_pin: bool = False
    steps_left_out: frozenset[str] = frozenset()  # of the set-up
    has_regions: bool = False  # whether parts of that country have holidays of their own
    mission_names: MissionNames = NOTHING_KNOWN  # what is known of the values that missions get

    @cached_property
    def calendar(self) -> WorkingCalendar:
        return WorkingCalendar(self.settings, self.exceptions)

    def having(self, kind: str, it: Any) -> SettingsFacts:
        """With the newest of what has its id."""
        newest: Any = tuple(it if each.id == it.id else each for each in getattr(self, kind))
        return replace(self, **{kind: newest})

    def fleet(self, fleet_id: int | None) -> Fleet | None:
        return with_id(self.fleets, fleet_id)

    def robots_of(self, fleet: Fleet) -> tuple[Robot, ...]:
        """Those of the plan, in order of name."""
        return tuple(robot for robot in self.robots if robot.fleet is not None and robot.fleet.id == fleet.id)

    def report(self, target: Robot | Fleet) -> Report | None:
        """Of its last check-up."""
        return (self.fleet_reports if isinstance(target, Fleet) else self.reports).get(target.id)

    def mission(self, mission_id: int | None) -> Mission | None:
        return with_id(self.missions, mission_id)

    def place(self, place_id: int | None) -> Place | None:
        return with_id(self.places, place_id)

    def snapshot(self, robot_id: int) -> RobotSnapshot:
        return self.snapshots.get(robot_id) or RobotSnapshot(robot_id)

    # ------------------------------------------------------------------ which missions are used where
    def schedules_of(self, mission: Mission) -> tuple[Schedule, ...]:
        return tuple(schedule for schedule in self.schedules if schedule.mission_id == mission.id)

    def idle_on(self, mission: Mission) -> tuple[Robot, ...]:
        """Robots whose idle automation starts it."""
        return tuple(robot for robot in self.robots if robot.idle is not None and robot.idle.mission_id == mission.id)

    @cached_property
    def missing(self) -> Mapping[int, tuple[Mission, ...]]:
        """By robot, the missions that start there automatically, or are entered only for it, and that its own list does not have; none
        while that list has not been read."""
        planned: dict[int, set[int]] = {robot.id: set() for robot in self.robots}
        members = {group.id: group.members for group in self.groups}
        for schedule in self.schedules:
            for robot_id in members.get(schedule.group_id or 0, (schedule.robot_id,)):
                planned.get(robot_id or 0, set()).add(schedule.mission_id)
        for robot in self.robots:
            if robot.idle is not None:
                planned[robot.id].add(robot.idle.mission_id)
        own = {(mission.robot_id, mission.name) for mission in self.missions}

        def is_used(mission: Mission, robot: Robot) -> bool:
            """A robot's own mission takes the place of the one for all robots."""
            if mission.robot_id is not None:
                return mission.robot_id == robot.id
            return mission.id in planned[robot.id] and (robot.id, mission.name) not in own

        return {
            robot.id: tuple(
                mission
                for mission in self.missions
                if (names := self.names.get(robot.id)) and mission.guid not in names and is_used(mission, robot)
            )
            for robot in self.robots
        }

    def robots_missing(self, mission: Mission) -> tuple[Robot, ...]:
        return tuple(robot for robot in self.robots if mission in self.missing[robot.id])


def read(services: SettingsServices) -> SettingsFacts:
    """Read everything. Called off the UI thread: it reads the database and the disk, but sends nothing to robots."""
    catalogue, settings = services.catalogue, services.settings()
    robots = by_name(catalogue.robots())
    names = {robot.id: services.robot_missions.names(robot.id) for robot in robots}
    country = settings.holiday_country  # names of countries are in a large library: only read where one is chosen
    regions = public_holidays.subdivisions(country) if country else {}
    fleets = by_name(catalogue.fleets())
    facts = SettingsFacts(
        settings=settings,
        robots=robots,
        fleets=fleets,
        missions=tuple(catalogue.missions()),
        usual_s=services.plan.usual_durations(),
        schedules=tuple(catalogue.schedules()),
        refused=frozenset(catalogue.refused()),
        groups=by_name(catalogue.groups()),
        places=tuple(catalogue.places()),
        proposed=tuple(services.proposed_places.all()),
        snapshots={robot.id: services.snapshots.get(robot.id) for robot in robots},
        names={robot_id: known for robot_id, known in names.items() if known},
        reports={robot.id: report for robot in robots if (report := services.check_ups.report(robot.id))},
        fleet_reports={fleet.id: found for fleet in fleets if (found := services.fleet_check_ups.report(fleet.id))},
        left_behind=frozenset(services.check_ups.left_behind()),
        backups=tuple(services.files.backups()),
        exceptions=tuple(catalogue.day_exceptions()),
        has_pin=services.access.is_set(),
        steps_left_out=catalogue.steps_left_out(),
        has_regions=bool(regions),
        country=public_holidays.countries().get(country, country) if country else "",
        region=regions.get(settings.holiday_subdivision, settings.holiday_subdivision),
    )
    facts.calendar.day_status(services.clock.now().date())  # loads the library of holidays here, not on the UI thread
    return facts
