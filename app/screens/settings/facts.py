"""What Settings needs to know at one moment, read on a background thread; settings_view turns it into words."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from app.domain.models import DayException, Mission, Robot, RobotSnapshot, Schedule, Settings
from app.services.planning import public_holidays
from app.services.planning.working_days import WorkingCalendar

if TYPE_CHECKING:
    from app.container import Container
    from app.services.files.exports import Backup, DataFiles
    from app.services.robots.missions import RobotMissions


@dataclass(frozen=True)
class SettingsFacts:
    settings: Settings = field(default_factory=Settings)
    robots: tuple[Robot, ...] = ()
    missions: tuple[Mission, ...] = ()
    schedules: tuple[Schedule, ...] = ()
    snapshots: Mapping[int, RobotSnapshot] = field(default_factory=dict)     # by robot
    names: Mapping[int, Mapping[str, str]] = field(default_factory=dict)     # robot -> guid -> name; robots that did not tell are absent
    backups: tuple[Backup, ...] = ()                                         # newest first
    exceptions: tuple[DayException, ...] = ()                                # to the working days
    country: str = ""                                                        # whose public holidays are closed, by name; empty: none
    region: str = ""                                                         # part of it
    has_regions: bool = False                                                # whether parts of that country have holidays of their own

    @cached_property
    def calendar(self) -> WorkingCalendar:
        return WorkingCalendar(self.settings, self.exceptions)

    def robot(self, robot_id: int | None) -> Robot | None:
        return next((robot for robot in self.robots if robot.id == robot_id), None)

    def mission(self, mission_id: int | None) -> Mission | None:
        return next((mission for mission in self.missions if mission.id == mission_id), None)

    def snapshot(self, robot_id: int) -> RobotSnapshot:
        return self.snapshots.get(robot_id) or RobotSnapshot(robot_id)

    # ------------------------------------------------------------------ which missions are used where
    def schedules_of(self, mission: Mission) -> tuple[Schedule, ...]:
        return tuple(schedule for schedule in self.schedules if schedule.mission_id == mission.id)

    def idle_on(self, mission: Mission) -> tuple[Robot, ...]:
        """Robots whose idle automation starts it."""
        return tuple(robot for robot in self.robots if robot.idle is not None and robot.idle.mission_id == mission.id)

    def used_on(self, robot: Robot) -> tuple[Mission, ...]:
        """Missions that this app may start on the robot by itself, and those entered for it alone."""
        planned = {schedule.mission_id for schedule in self.schedules if schedule.robot_id == robot.id}
        if robot.idle is not None:
            planned.add(robot.idle.mission_id)
        return tuple(mission for mission in self.missions if mission.id in planned or mission.robot_id == robot.id)

    def missing_on(self, robot: Robot) -> tuple[Mission, ...]:
        """Used on the robot, but the robot says that it has no such mission. Nothing is missing on a robot that did not tell."""
        names = self.names.get(robot.id)
        return tuple(mission for mission in self.used_on(robot) if names and mission.guid not in names)

    def robots_missing(self, mission: Mission) -> tuple[Robot, ...]:
        return tuple(robot for robot in self.robots if mission in self.missing_on(robot))

    def is_nowhere(self, mission: Mission) -> bool:
        """Every robot that is switched on has told its missions, and none has this one."""
        told = [self.names.get(robot.id) for robot in self.robots if robot.enabled]
        return bool(told) and all(names and mission.guid not in names for names in told)


def read(container: Container, robot_missions: RobotMissions, files: DataFiles) -> SettingsFacts:
    """Read everything. Called off the UI thread: it asks the database and the disk, never a robot."""
    repositories, db = container.repositories, container.db.read()
    robots = tuple(repositories.robots.all(db))
    told = {robot.id: robot_missions.names(robot.id) for robot in robots}
    settings = container.settings()
    country = settings.holiday_country           # their names are in a large library, which nobody reads who has chosen none
    regions = public_holidays.subdivisions(country) if country else {}
    facts = SettingsFacts(
        settings=settings, exceptions=tuple(repositories.calendar.all(db)), has_regions=bool(regions),
        country=public_holidays.countries().get(country, country) if country else "",
        region=regions.get(settings.holiday_subdivision, settings.holiday_subdivision), robots=robots,
        missions=tuple(repositories.missions.all(db)),
        schedules=tuple(repositories.schedules.all(db)), snapshots={robot.id: container.snapshots.get(robot.id) for robot in robots},
        names={robot_id: names for robot_id, names in told.items() if names}, backups=tuple(files.backups()))
    facts.calendar.look(container.clock.now().date())
    return facts
