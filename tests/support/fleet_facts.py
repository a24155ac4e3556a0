"""Many robots at the invented plant, as Home's facts: most of them work, some need a person."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime

from app.domain.activity import ActivitySpan
from app.domain.execution import DurationEstimate, Execution, Reason, ReasonCode, State
from app.domain.models import ANY_VEHICLE, Alarm, Fleet, Group, Priority, Robot, RobotSnapshot
from app.domain.robot import QueueItem, QueueState, RobotState, RobotStatus
from app.screens.home.facts import HomeFacts
from app.services.history.runs import RobotTimeline
from tests.support import home_facts as sample

NAMES = ("Aino", "Eino", "Helmi", "Ilmari", "Kaisa", "Lempi", "Onni", "Sisu", "Toivo", "Urho", "Veikko", "Väinö")
USUAL = DurationEstimate(420.0, 480.0)
TASKS = (
    "Deliver kits to line 2",
    "Collect empties",
    "Bring pallet to dock",
    "Waste to compactor",
    "Move coils to press",
)
PAUSED = replace(sample.READY, state=RobotState.PAUSE, mission_text="Paused")
ANY_READY = RobotStatus(state=RobotState.READY)
DRIVEN = replace(sample.READY, state=RobotState.MANUAL_CONTROL, mission_text="Driven by hand from its own screen")


def robots(count: int) -> tuple[Robot, ...]:
    """As many with names of their own as there are; of more, the plant's three and others with numbers."""
    numbered = tuple(
        Robot(
            NAMES[n] if count <= len(NAMES) else f"Robot {n + 1}" if n % 9 else f"Trukki {n + 1}",
            f"http://10.40.12.{21 + n}",
            id=n + 1,
            model="MiR250",
            token="x",
        )
        for n in range(count)
    )
    return numbered if count <= len(NAMES) else sample.FACTS.robots + numbered[len(sample.FACTS.robots) :]


def troubled(robot: Robot) -> RobotSnapshot | None:
    """The snapshot of one of the few robots that need a person; None for the others."""
    number = robot.id
    if number in (4, 31):
        return sample.snapshot(number, sample.STOPPED if number == 4 else sample.FAILED)
    if number == 7:
        return sample.snapshot(number, sample.ASKING)
    if number in (9, 23, 40):
        return sample.silent(robot, sample.READY, minutes=15)
    if number in (11, 36):
        return sample.snapshot(number, PAUSED if number == 11 else DRIVEN)
    return None


def halls(count: int) -> tuple[Group, ...]:
    """Six groups of the robots."""
    names, size = ("Hall 1", "Hall 2", "Hall 3", "Hall 4", "Yard", "Spare"), -(-count // 6)
    return tuple(
        Group(name, tuple(range(n * size + 1, min(count, (n + 1) * size) + 1)), id=n + 1)
        for n, name in enumerate(names)
    )


def outage(count: int) -> HomeFacts:
    """Most robots have stopped answering in the same minute."""
    known = facts(count)
    lost = [
        robot for robot in known.robots if robot.id not in (1, 2, 5, 13, 20, 27, 33, 39, 44, 48) and not troubled(robot)
    ]
    silent = {robot.id: sample.silent(robot, sample.EXECUTING, minutes=2) for robot in lost}
    return replace(known, snapshots={**known.snapshots, **silent})


HALL_2 = Fleet("Hall 2", "http://10.40.12.5", id=3, identity="own user")
ANY = Robot("Any of Hall 2", "", id=10, vehicle=ANY_VEHICLE).within(HALL_2)


def of_fleet(*statuses: RobotStatus, silent: bool = False) -> HomeFacts:
    """A fleet's robots MiR 1, MiR 2, … in these states, and any of them, which is selected. ``silent``: the fleet is."""
    everybody = [Robot(f"MiR {n}", "", id=10 + n, vehicle=str(n)).within(HALL_2) for n in range(1, len(statuses) + 1)]
    shown = {robot.id: status for robot, status in zip([ANY, *everybody], [ANY_READY, *statuses], strict=True)}
    snapshots = {number: sample.snapshot(number, status) for number, status in shown.items()}
    if silent:  # each worker notices it at its own poll
        snapshots = {
            robot.id: replace(sample.silent(robot, shown[robot.id], minutes=2 + n), fleet_failed=True)
            for n, robot in enumerate([ANY, *everybody])
        }
    settings = replace(sample.SETTINGS, selected_robot_id=ANY.id)
    return replace(sample.FACTS, settings=settings, robots=(ANY, *everybody), snapshots=snapshots, open=())


def with_any_run() -> HomeFacts:
    """An order for any robot of a fleet runs on MiR 2, one has failed on MiR 1."""
    known = of_fleet(sample.READY, sample.EXECUTING)
    run = sample.execution(
        61, ANY, TASKS[0], State.EXECUTING, queue_id=7, taken_by="MiR 2", started_at=sample.ago(minutes=3)
    )
    failed = sample.execution(62, ANY, TASKS[1], State.FAILED, taken_by="MiR 1", ended_at=sample.ago(minutes=9))
    failed = replace(failed, reason=Reason(ReasonCode.VANISHED, {"fleet": True}))
    queue = (QueueItem(7, QueueState.EXECUTING, mission_id="g9", vehicle="2"),)
    seen = {number: replace(shot, queue=() if number == 11 else queue) for number, shot in known.snapshots.items()}
    return replace(known, open=(run,), finished=(failed,), planned=(), snapshots=seen)


def facts(count: int, *, well: bool = False) -> HomeFacts:
    """``well``: nothing is abnormal."""
    everybody = robots(count)
    snapshots: dict[int, RobotSnapshot] = {}
    runs: list[Execution] = []
    for robot in everybody:
        number, trouble = robot.id, None if well else troubled(robot)
        if robot in sample.FACTS.robots:
            snapshots[number] = sample.FACTS.snapshots[number]
            runs += [run for run in sample.FACTS.open if run.robot_id == number]
            continue
        battery = 31.0 + number * 37 % 69
        if trouble is not None:
            snapshots[number] = trouble
        elif number % 7 == 3:
            snapshots[number] = sample.snapshot(number, replace(sample.CHARGING, battery_percentage=battery / 2))
        elif number % 3 == 1:
            snapshots[number] = sample.snapshot(number, replace(sample.READY, battery_percentage=battery))
        else:
            guid = f"task-{number % len(TASKS)}"
            item = QueueItem(1000 + number, QueueState.EXECUTING, mission_id=guid)
            snapshots[number] = sample.snapshot(number, replace(sample.EXECUTING, battery_percentage=battery), (item,))
            runs.append(
                sample.execution(
                    1000 + number,
                    robot,
                    TASKS[number % len(TASKS)],
                    State.EXECUTING,
                    guid=guid,
                    queue_id=item.id,
                    started_at=sample.ago(seconds=20 + number * 53 % 400),
                )
            )
    return replace(sample.FACTS, robots=everybody, snapshots=snapshots, open=tuple(runs))


class Answers:
    """The services that the page asks about what runs, and since when robots need a person."""

    def expected(self, _robot_id: int, _guid: str) -> DurationEstimate:
        return USUAL

    def timelines(self, start: datetime, end: datetime, robot_ids: Sequence[int]) -> list[RobotTimeline]:
        """The robots that are stopped, paused or driven by hand."""
        began = {4: 2, 11: 40, 31: 7, 36: 26}
        return [
            RobotTimeline(number, "", (ActivitySpan("error", sample.ago(minutes=began[number]), end),))
            for number in robot_ids
            if number in began
        ]

    def request_cycle(self) -> None:
        """They are as they are."""

    def open(self) -> Sequence[Alarm]:
        question = {"robot": "Robot 7", "question": "Is the pallet loaded at Dock 3?"}
        return [Alarm("question", "robot:7", Priority.HIGH, sample.ago(minutes=1), question, id=1)]
