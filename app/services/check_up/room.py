"""Whether missions may be queued on a robot for its check-up: the plan goes first, and so does what a person holds back."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Any
from zoneinfo import ZoneInfo

from app.database.groups import GroupRepository
from app.database.schedules import ScheduleRepository
from app.domain.message import message
from app.domain.models import InvalidInput, Robot, Schedule, Settings
from app.services.dispatch.ledger import Ledger
from app.services.live.holds import Holds

KEEP_FREE = timedelta(minutes=3)  # between the end of a check-up and the next planned start


def check_usable(robot: Robot) -> None:
    """Raises InvalidInput for one that can't be asked."""
    if robot.needs_password or not robot.token:
        raise InvalidInput(
            "robot", "{robot} is switched off until its password is entered in Settings", robot=robot.name
        )


def check_is_no_copy(holds: Holds) -> None:
    """Raises InvalidInput."""
    if holds.is_copy is not None:
        raise InvalidInput(
            "robot", "this data was copied from another tablet: nothing is sent from here before it moves here"
        )


def check_room(
    c: Any, robot: Robot, ledger: Ledger, holds: Holds, settings: Settings, now: datetime, takes: timedelta
) -> None:
    """Raises InvalidInput with what is in the way of a trial that begins now and takes so long."""
    groups = {group.id for group in GroupRepository().all(c) if robot.id in group.members}
    if not robot.enabled:
        raise InvalidInput("robot", "{robot} is switched off in Settings", robot=robot.name)
    check_is_no_copy(holds)
    if (hold := holds.active(robot.id)) is not None:
        if hold.reason:
            raise InvalidInput(
                "robot",
                "{robot} is held back ({reason}): check up when it is released",
                robot=robot.name,
                reason=message(hold.reason),
            )  # those that are offered, and a check-up's, have a translation
        raise InvalidInput("robot", "{robot} is held back: check up when it is released", robot=robot.name)
    rows = [*ledger.open_for(robot.id), *(row for row in ledger.unbound() if row.group_id in groups)]
    if rows:
        raise InvalidInput(
            "robot",
            "{mission} waits for {robot} or runs there: check up after it",
            mission=rows[0].mission,
            robot=robot.name,
        )
    schedules = ScheduleRepository()
    planned = [*schedules.for_robot(c, robot.id), *(each for group in groups for each in schedules.for_group(c, group))]
    soon = [schedule for schedule in planned if _is_due(schedule, now + takes + KEEP_FREE)]
    if soon:
        first = min(soon, key=lambda schedule: schedule.next_at or now)
        at = (first.next_at or now).astimezone(ZoneInfo(settings.timezone))
        raise InvalidInput(
            "robot", "{schedule} is planned at {time}: check up after it", schedule=first.name, time=f"{at:%H:%M}"
        )


def _is_due(schedule: Schedule, until: datetime) -> bool:
    """Whether it may start by then."""
    at = schedule.next_at
    return schedule.enabled and at is not None and at <= until and not schedule.is_paused(at)
