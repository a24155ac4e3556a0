"""One Friday afternoon at an invented plant, as Home's facts: what the pictures show and the presenter's tests ask about."""

from __future__ import annotations

import base64
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

from app.database.robots import Hold
from app.domain.execution import DurationEstimate, Execution, Reason, ReasonCode, State, Trigger, Wait
from app.domain.models import Connection, Group, Mission, Robot, RobotSnapshot, Schedule, Settings
from app.domain.robot import (
    MapPosition,
    Pose,
    QueueItem,
    QueueState,
    RobotMap,
    RobotProblem,
    RobotState,
    RobotStatus,
    UserPrompt,
)
from app.mir.errors import Unreachable
from app.screens.home.facts import HomeFacts
from app.services.planning.planned import PlannedRun
from app.services.robots.map_picture import picture_of
from mir_sim import floor_plan, world

NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)  # 14:38 in Helsinki
ZONE = "Europe/Helsinki"
SETTINGS = Settings(timezone=ZONE, selected_robot_id=1, minimum_battery_percent=30)

AINO = Robot("Aino", "http://10.40.12.21", id=1, model="MiR250", token="x")
VEIKKO = Robot("Veikko", "http://10.40.12.22", id=2, model="MiR100", token="x")
SISU = Robot("Sisu", "http://10.40.12.23", id=3, model="MiR1350", token="x")

EMPTIES = Mission("Collect empties", "g1", 1, favourite=True)
KITS = Mission("Deliver kits to line 2", "g2", 2, favourite=True)
CHARGER = Mission("Return to charger", "g3", 3, favourite=True)
PALLET = Mission("Bring pallet to dock", "g4", 4)
WASTE = Mission("Waste to compactor", "g5", 5)
COILS = Mission("Move coils to press", "g6", 6)

HOLD = Hold("Maintenance", NOW + timedelta(hours=1), NOW - timedelta(minutes=1))

FLOOR = RobotMap(
    world.MAP_GUID,
    world.MAP_NAME,
    base64.b64decode(floor_plan.base_map()),
    floor_plan.RESOLUTION,
    Pose(floor_plan.PLAN.left, floor_plan.PLAN.bottom, 0.0),
)
HALL = picture_of(
    FLOOR,
    [
        MapPosition(
            station.guid,
            station.name,
            station.type_id,
            world.MAP_GUID,
            Pose(station.pose.x, station.pose.y, station.pose.orientation),
        )
        for station in world.STATIONS
    ],
)

EXECUTING = RobotStatus(
    state=RobotState.EXECUTING,
    mission_text="Moving to 'Line 2' (12.4 meters to goal)",
    battery_percentage=78.0,
    battery_time_remaining_s=15000.0,
    robot_model="MiR250",
    distance_to_next_target=12.4,
    moved=671648.0,
    position=Pose(18.0, 12.0, 0.0),
    map_id=world.MAP_GUID,
)
READY = replace(
    EXECUTING,
    state=RobotState.READY,
    mission_text="Waiting for new missions...",
    battery_percentage=64.0,
    distance_to_next_target=0.0,
)
CHARGING = replace(READY, mission_text="Charging... Waiting for new mission...", battery_percentage=19.0)
STOPPED = replace(
    EXECUTING,
    state=RobotState.EMERGENCY_STOP,
    mission_text="Cameras are ready to stream",
    battery_percentage=None,
)
FAILED = replace(
    EXECUTING,
    state=RobotState.ERROR,
    errors=(RobotProblem(10120, "Failed to reach goal position 'Line 2'", "MissionController"),),
)
ASKING = replace(
    EXECUTING, user_prompt=UserPrompt("p1", "Is the pallet loaded at Dock 3?", ("Yes", "No", "Skip this stop"))
)


def at_station(status: RobotStatus, name: str) -> RobotStatus:
    """The same robot where the floor plan has that place."""
    pose = world.BY_NAME[name].pose
    return replace(status, position=Pose(pose.x, pose.y, pose.orientation))


def ago(**span: float) -> datetime:
    return NOW - timedelta(**span)


def snapshot(
    robot_id: int,
    status: RobotStatus | None,
    queue: tuple[QueueItem, ...] = (),
    *,
    age: float = 2.0,
    connection: Connection = Connection.CONNECTED,
    **values: Any,
) -> RobotSnapshot:
    """As read ``age`` seconds ago."""
    return RobotSnapshot(
        robot_id, connection, status, ago(seconds=age), queue, ago(seconds=age), since=ago(minutes=20), **values
    )


def silent(robot: Robot, status: RobotStatus, queue: tuple[QueueItem, ...] = (), *, minutes: float) -> RobotSnapshot:
    """A robot that has not answered for this long, in the app's words."""
    problem = Unreachable(code="no_answer", address=robot.address.removeprefix("http://")).message
    read = snapshot(robot.id, status, queue, age=60.0 * minutes, connection=Connection.UNREACHABLE, problem=problem)
    return replace(read, since=read.read_at)


def execution(
    number: int,
    robot: Robot,
    mission: str,
    state: State,
    trigger: Trigger = Trigger.SCHEDULED,
    guid: str = "g9",
    planned: datetime | None = None,
    **values: Any,
) -> Execution:
    planned = planned or ago(minutes=4)
    return Execution(
        trigger=trigger,
        robot_id=robot.id,
        robot=robot.name,
        mission=mission,
        mission_guid=guid,
        planned_at=planned,
        closes_at=planned + timedelta(minutes=15),
        created_at=planned,
        token=f"token-{number}",
        timezone=ZONE,
        state=state,
        id=number,
        **values,
    )


def planned(robot: Robot, mission: Mission, **ahead: float) -> PlannedRun:
    schedule = Schedule(
        mission.name, robot.id, mission.id, datetime(2026, 11, 20, 15), ZONE, id=int(sum(ahead.values()))
    )
    return PlannedRun(NOW + timedelta(**ahead), schedule, robot, mission, DurationEstimate(300.0, 300.0))


QUEUE = (
    QueueItem(101, QueueState.EXECUTING, mission_id=KITS.guid),
    QueueItem(102, QueueState.PENDING, mission_id=EMPTIES.guid),
    QueueItem(
        103, QueueState.PENDING, mission_id=PALLET.guid, created_by_name="Matti", ordered=datetime(2026, 11, 20, 14, 37)
    ),
)
RUNNING = execution(
    1,
    AINO,
    KITS.name,
    State.EXECUTING,
    Trigger.MANUAL,
    KITS.guid,
    planned=ago(minutes=4, seconds=20),
    queue_id=101,
    submitted_at=ago(minutes=4, seconds=20),
    started_at=ago(minutes=4, seconds=12),
)
QUEUED = execution(
    2,
    AINO,
    EMPTIES.name,
    State.QUEUED,
    Trigger.MANUAL,
    EMPTIES.guid,
    planned=ago(minutes=2),
    queue_id=102,
    submitted_at=ago(minutes=2),
)
HELD = execution(
    3,
    AINO,
    WASTE.name,
    State.WAITING,
    guid=WASTE.guid,
    schedule="Waste, extra round",
    wait=Wait.BATTERY,
    wait_details={"battery": 78.0, "minimum": 80.0},
    planned=ago(minutes=3),
    minimum_battery_percent=80.0,
)

# What tests/support/month.py plans next and has finished last; tests/unit/screens/test_sample_facts_agree.py compares them.
PLANNED = (
    planned(AINO, KITS, minutes=22),
    planned(VEIKKO, EMPTIES, minutes=32),
    planned(SISU, COILS, minutes=37),
    planned(AINO, KITS, minutes=82),
    planned(VEIKKO, WASTE, minutes=112),
)
FINISHED = (
    execution(
        11,
        SISU,
        COILS.name,
        State.SKIPPED,
        planned=ago(minutes=23),
        ended_at=ago(minutes=8),
        reason=Reason(ReasonCode.BATTERY_LOW, {"battery": 12, "minimum": 30, "until": ago(minutes=8).isoformat()}),
    ),
    execution(
        12,
        VEIKKO,
        PALLET.name,
        State.COMPLETED,
        Trigger.MANUAL,
        planned=ago(minutes=25, seconds=10),
        ended_at=ago(minutes=17, seconds=2),
        duration_s=485.0,
    ),
    execution(
        13,
        AINO,
        KITS.name,
        State.COMPLETED,
        planned=ago(minutes=38),
        ended_at=ago(minutes=32, seconds=2),
        duration_s=355.0,
    ),
    execution(
        14,
        VEIKKO,
        PALLET.name,
        State.FAILED,
        Trigger.MANUAL,
        planned=ago(minutes=68),
        ended_at=ago(minutes=45, seconds=50),
        duration_s=1324.0,
        reason=Reason(ReasonCode.ROBOT_ABORTED, {"message": "Failed to reach goal position 'Dock 3'"}),
    ),
    execution(
        15,
        AINO,
        CHARGER.name,
        State.COMPLETED,
        Trigger.IDLE,
        planned=ago(minutes=61, seconds=20),
        ended_at=ago(minutes=57, seconds=58),
        duration_s=200.0,
    ),
)

FACTS = HomeFacts(
    settings=SETTINGS,
    robots=(AINO, VEIKKO, SISU),
    missions=(EMPTIES, KITS, CHARGER, PALLET, WASTE),
    open=(RUNNING, QUEUED, HELD),
    snapshots={
        1: snapshot(1, EXECUTING, QUEUE),
        2: snapshot(2, at_station(READY, "Dock")),
        3: snapshot(3, at_station(CHARGING, "Charger")),
    },
    planned=tuple(run for run in PLANNED if run.robot is AINO),
    finished=tuple(run for run in FINISHED if run.robot_id == AINO.id),
    expected={KITS.guid: DurationEstimate(390.0, 450.0), EMPTIES.guid: DurationEstimate(480.0, 520.0)},
    map=HALL,
)


def with_aino(status: RobotStatus | None, queue: tuple[QueueItem, ...] = QUEUE, **values: Any) -> HomeFacts:
    """The same afternoon with Aino in another state."""
    return replace(FACTS, snapshots={**FACTS.snapshots, 1: snapshot(1, status, queue, **values)})


def on_hold(facts: HomeFacts) -> HomeFacts:
    """The same while nothing is sent to any robot."""
    return replace(
        facts,
        holds=(HOLD,),
        open=tuple(
            replace(run, wait=Wait.HOLD, wait_details={"hold": HOLD.reason}) if run.state is State.WAITING else run
            for run in facts.open
        ),
    )


def without_veikko() -> HomeFacts:
    """Aino's emergency stop is pressed, and Veikko has not answered for nine minutes."""
    facts = with_aino(STOPPED)
    return replace(facts, snapshots={**facts.snapshots, 2: silent(VEIKKO, at_station(READY, "Dock"), minutes=9)})


def without_aino() -> HomeFacts:
    """She has just begun when she falls silent, four minutes ago: what was asked of her since then is still to be sent."""
    facts = replace(FACTS, snapshots={**FACTS.snapshots, 1: silent(AINO, EXECUTING, QUEUE[:1], minutes=4)})
    problem = facts.snapshots[1].problem
    to_try = {
        "state": State.WAITING,
        "queue_id": None,
        "submitted_at": None,
        "wait": Wait.RETRY,
        "wait_details": {"problem": problem},
    }
    return replace(facts, open=(RUNNING, replace(HELD, **to_try, attempts=9), replace(QUEUED, **to_try, attempts=7)))


HALL_1 = Group("Hall 1", (1, 2, 3), id=5)


def waits(number: int, mission: str, priority: int, **details: Any) -> Execution:
    """A start of Hall 1 that has no robot yet."""
    row = execution(number, AINO, mission, State.WAITING, planned=ago(minutes=number % 7))
    return replace(
        row,
        robot_id=None,
        robot="",
        group_id=HALL_1.id,
        robot_group=HALL_1.name,
        priority=priority,
        wait=Wait.ROBOT,
        wait_details={"group": HALL_1.name, **details},
    )


_BUSY = {"robot": "Aino", "until": (NOW + timedelta(minutes=14)).isoformat()}
_LOW = {"robot": "Sisu", "out": "low_battery", "battery": 19.0}
_HELD = {"robot": "Veikko", "out": "held"}

# Four starts that no robot of the group can take now.
WITH_WAITING = replace(
    FACTS,
    groups=(HALL_1,),
    holds=(replace(HOLD, since=ago(minutes=9), robot_id=VEIKKO.id),),
    open=(
        *FACTS.open,
        waits(31, "Bring pallet to dock", 2, robots=[_BUSY, _HELD, _LOW]),
        waits(32, "Collect empties", 0, robots=[_BUSY, _HELD, _LOW]),
        waits(33, "Waste to compactor", -1, robots=[_BUSY, _HELD, _LOW], kept_for="Deliver kits to line 2"),
        waits(34, "Night stock count", -1, robots=[_BUSY, _HELD, _LOW]),
    ),
)
