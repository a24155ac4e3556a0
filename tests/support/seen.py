"""What a person or the world can see of a site: the robots' own histories, the rows, the alarms."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime, timedelta

from app.domain.execution import Execution, Reason, ReasonCode, State
from app.domain.models import Robot, Schedule
from mir_sim.mission_queue import QueueItem
from tests.simulation.diary import instants
from tests.support.site import Site


def items(site: Site, robot: str = "R1") -> list[QueueItem]:
    """A robot's own history, as it is now."""
    return list(site.queue(robot))


def states(site: Site, robot: str = "R1") -> list[str]:
    return [str(item.state) for item in items(site, robot)]


def ours(site: Site, robot: str = "R1") -> list[QueueItem]:
    """Items with a token of a row."""
    of_rows = {row.token for row in site.executions()}
    return [item for item in items(site, robot) if item.description in of_rows]


def tokens(site: Site, robot: str = "R1") -> list[str]:
    """Of everything that the robot has ever had with one."""
    return [item.description for item in items(site, robot) if item.description]


def requests(site: Site) -> list[str]:
    """What robots are asked for from now on, such as "GET /status"."""
    asked: list[str] = []

    def note(where: str) -> None:
        if where.startswith("before "):
            asked.append(where.removeprefix("before "))

    site.network.interrupt = note
    return asked


def outcome(row: Execution) -> tuple[State, ReasonCode | None, int]:
    """State, reason and attempts."""
    return row.state, row.reason and row.reason.code, row.attempts


def outcomes(site: Site) -> list[tuple[State, ReasonCode | None, int]]:
    return [outcome(row) for row in site.executions()]


def reason(row: Execution) -> Reason:
    assert row.reason is not None, row
    return row.reason


def alarms(site: Site) -> list[str]:
    return [alarm.code for alarm in site.container.alarms.open()]


def robot_of(site: Site, name: str = "R1") -> Robot:
    return next(robot for robot in site.container.catalogue.robots() if robot.name == name)


def sent_at(site: Site, robot: str = "*") -> list[int]:
    """When submissions left, in whole seconds of true time since the site began."""
    return [round(post.at) for post in site.network.posts(robot)]


def covered(site: Site, schedule: Schedule) -> Iterator[datetime]:
    """Every instant that a row of the schedule stands for, counted by hand."""
    for row in site.executions():
        if row.schedule_id == schedule.id and row.starts == 1:
            yield row.planned_at
        elif row.schedule_id == schedule.id:
            first = datetime.fromisoformat(reason(row).details["first"])
            within = list(instants(schedule, first, row.planned_at + timedelta(seconds=1)))
            assert len(within) == row.starts, row
            yield from within
