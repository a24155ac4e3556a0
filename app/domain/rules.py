"""Pure decisions about one execution: its first columns, what blocks it, when it is tried again, and its end. No I/O,
no clock."""

from __future__ import annotations

import uuid
from collections.abc import Iterable, Mapping
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from types import MappingProxyType
from typing import Any

from app.domain.execution import Execution, Reason, ReasonCode, State, Trigger, Wait
from app.domain.message import Message, message
from app.domain.models import Group, Mission, Robot, Schedule, Settings

SHORTEST_WINDOW = timedelta(minutes=1)
LATE_START_HOLD = timedelta(seconds=30)
# of a late start that may have run: listed if it has not
LISTED_LATER: Mapping[str, Any] = MappingProxyType({"late": True})
LONGEST_QUIET = 600.0  # s, the limit for measured values
INTENT_LEAD = timedelta(
    milliseconds=250
)  # the intent is on disk this long before its instant, so that then only the POST remains


def closes_at(planned_at: datetime, window_minutes: int | None, settings: Settings) -> datetime:
    """Until when an execution may be sent: planned + max(window, 1 min)."""
    minutes = settings.start_window_minutes if window_minutes is None else window_minutes
    return planned_at + max(timedelta(minutes=minutes), SHORTEST_WINDOW)


def minimum_battery(schedule: Schedule | None, mission: Mission | None, settings: Settings) -> float | None:
    """The minimum battery for a mission of a schedule or when idle; None: no minimum. A schedule's own value goes
    before the mission's permission, and both before the setting (a schedule's 0 switches that off)."""
    if schedule is not None and schedule.minimum_battery_percent is not None:
        return schedule.minimum_battery_percent or None
    return None if mission is not None and mission.runs_on_low_battery else settings.minimum_battery_percent or None


def token_of(install_id: str, schedule_id: int, planned_at: datetime) -> str:
    """The identity of an occurrence on the robot: a UUID of version 5. Deterministic, so that even a restored backup makes the same one."""
    return str(uuid.uuid5(uuid.UUID(install_id), f"{schedule_id}|{planned_at.astimezone(UTC).isoformat()[:19]}Z"))


# ---------------------------------------------------------------------- the rows of new executions
def as_planned(schedule: Schedule, mission: Mission, settings: Settings, planned_at: datetime) -> dict[str, Any]:
    """Of an occurrence what follows its schedule and mission as long as no robot has it."""
    finish_by = schedule.finish_by_minutes
    return {
        "schedule": schedule.name,
        "mission": mission.name,
        "mission_guid": mission.guid,
        "parameters": schedule.parameters,
        "priority": schedule.priority,
        "minimum_battery_percent": minimum_battery(schedule, mission, settings),
        "closes_at": closes_at(planned_at, schedule.start_window_minutes, settings),
        "finish_by": None if finish_by is None else planned_at + timedelta(minutes=finish_by),
    }


def scheduled(
    schedule: Schedule,
    target: Robot | Group,
    mission: Mission,
    settings: Settings,
    install_id: str,
    planned_at: datetime,
    now: datetime,
    intent_floor: int | None = None,
) -> Execution:
    """An occurrence of a schedule, waiting, for a group without a robot; with ``intent_floor``, the highest queue id known of its robot,
    already with the intent of its first attempt."""
    is_intent, robot = intent_floor is not None, target if isinstance(target, Robot) else None
    return Execution(
        **as_planned(schedule, mission, settings, planned_at),
        state=State.SUBMITTING if is_intent else State.WAITING,
        attempts=int(is_intent),
        begun_at=now if is_intent else None,
        queue_floor=intent_floor,
        trigger=Trigger.SCHEDULED,
        schedule_id=schedule.id,
        moved_from=schedule.moved_from,
        **_for(target),
        robot_address=robot.address if robot and is_intent else None,
        robot_serial=robot.serial_number if robot and is_intent else None,
        timezone=schedule.timezone,
        planned_at=planned_at,
        created_at=now,
        token=token_of(install_id, schedule.id, planned_at),
    )


def one_off(
    trigger: Trigger,
    target: Robot | Group,
    mission: Mission,
    settings: Settings,
    now: datetime,
    token: str,
    *,
    parameters: Mapping[str, Any] | None = None,
    queue_floor: int | None = None,
    priority: int = 0,
) -> Execution:
    """A manual or idle execution, waiting: due now, within the general start window. A manual one has no minimum battery."""
    minimum = minimum_battery(None, mission, settings) if trigger is Trigger.IDLE else None
    return Execution(
        trigger=trigger,
        **_for(target),
        priority=priority,
        mission=mission.name,
        mission_guid=mission.guid,
        parameters=parameters or {},
        minimum_battery_percent=minimum,
        timezone=settings.timezone,
        planned_at=now,
        closes_at=closes_at(now, None, settings),
        created_at=now,
        token=token,
        queue_floor=queue_floor,
    )


def _for(target: Robot | Group) -> dict[str, Any]:
    if isinstance(target, Robot):
        return {"robot_id": target.id, "robot": target.name}
    return {"robot_id": None, "robot": "", "group_id": target.id, "robot_group": target.name}


def ended(execution: Execution, reason: Reason, now: datetime) -> Execution:
    """The same, ended for this reason."""
    return replace(execution, state=reason.state, reason=reason, ended_at=now)


# ---------------------------------------------------------------------- the end of a waiting start
def excluded_robot(robot: str, now: datetime) -> dict[str, Any]:
    """Of ``Execution.tried``: a robot that is not to get this start of its group."""
    at = now.isoformat()
    return {"robot": robot, "out": "tried", "tries": 0, "at": at, "until": at, "is_for_good": True, "floor": None}


def is_excluded(tried: Mapping[str, Any], robot_id: int) -> bool:
    """Whether nothing was tried on that robot."""
    there = tried.get(str(robot_id), {})
    return bool(there.get("is_for_good")) and not there.get("tries")


def may_try_again(tried: Mapping[str, Any]) -> dict[str, Any]:
    """The outcomes of a group's start on its robots, reset so that they may be asked again, as its mission has changed.
    Possible items there stay recorded."""
    return {
        robot_id: {**each, "is_for_good": False, "until": each.get("at", each["until"])}
        for robot_id, each in tried.items()
    }


def in_dispatch_order(executions: Iterable[Execution]) -> list[Execution]:
    """Due together on one robot: higher priority first, then planned time, then name. An idle mission goes after all
    that was planned."""
    return sorted(
        executions,
        key=lambda e: (e.trigger is Trigger.IDLE, -e.priority, e.planned_at, e.schedule or e.mission, e.id),
    )


def quiet_seconds(settings: Settings, *robots: Robot) -> float:
    """How long a request with unknown outcome may still arrive: as set, or longer if one of the robots was measured to
    be slow."""
    measured = [robot.known.quiet_s for robot in robots if robot.known is not None and robot.known.quiet_s is not None]
    return max(settings.unknown_outcome_quiet_seconds, min(max(measured, default=0.0), LONGEST_QUIET))


def back_off(attempts: int, settings: Settings) -> float:
    """Seconds until the next try after ``attempts`` failed ones: 2, 4, 8 …, at most the poll interval."""
    return float(min(2 ** min(attempts, 12), settings.poll_interval_seconds))


def battery_allows(battery: float | None, minimum: float | None) -> bool:
    """An unknown battery never satisfies a minimum (NaN compares false, so it does not either)."""
    return minimum is None or (battery is not None and battery >= minimum)


def after_failed_attempt(execution: Execution, settings: Settings, problem: Message) -> Reason | None:
    """The end of an execution whose attempt has just failed, or None if it is tried again."""
    if execution.attempts > settings.retry_limit:
        return Reason(ReasonCode.RETRY_LIMIT, {"attempts": execution.attempts, "problem": problem})
    return None


def reason_overtaken(idle: Execution, now: datetime) -> Reason:
    """Why an idle mission was not sent before its robot was used, or something else was planned."""
    if idle.wait in (Wait.DUE, Wait.RETRY, Wait.HOLD):  # nothing else had held it up
        return Reason(ReasonCode.OVERLAP, {"idle": True})
    return reason_window_closed(replace(idle, closes_at=now), app_was_down=False)


def is_listed_later(execution: Execution) -> bool:
    """A late start that may have run: it is listed once it is known that it has not."""
    return LISTED_LATER.items() <= execution.wait_details.items()


_WAITED_FOR: Mapping[Wait, ReasonCode] = MappingProxyType(
    {
        Wait.BATTERY: ReasonCode.BATTERY_LOW,
        Wait.HOLD: ReasonCode.HOLD,
        Wait.ROBOT: ReasonCode.NO_ROBOT,
        Wait.PLACE: ReasonCode.PLACE_BUSY,
    }
)


def reason_window_closed(execution: Execution, app_was_down: bool) -> Reason:
    """Why an execution that was still waiting when its start window closed was not sent."""
    until = execution.closes_at.isoformat()
    if execution.wait in _WAITED_FOR:
        return Reason(_WAITED_FOR[execution.wait], {**execution.wait_details, "until": until})
    if execution.wait is Wait.CLOCK:
        return Reason(ReasonCode.CLOCK_IMPLAUSIBLE, {"until": until})
    if execution.wait is Wait.ELSEWHERE:
        robots = execution.wait_details.get("robots")
        problem = (
            message("it may have run already, and {robots} did not answer", robots=robots)
            if robots
            else message("it may have run already, and there was no time to find out")
        )
        return Reason(ReasonCode.WINDOW_CLOSED, {"until": until, "problem": problem})
    if execution.wait is Wait.LATE_START or (
        app_was_down and execution.attempts == 0 and execution.wait is not Wait.CHECK_UP
    ):
        return Reason(ReasonCode.APP_DOWN, {"until": until})
    return Reason(
        ReasonCode.WINDOW_CLOSED,
        {"attempts": execution.attempts, "until": until, "problem": execution.wait_details.get("problem", "")},
    )
