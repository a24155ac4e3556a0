"""The part of the robot that runs missions from the queue. It holds the running mission, the robot's pose and the odometer."""

from __future__ import annotations

import json
import random
from collections.abc import Iterator
from functools import partial
from typing import Protocol

from mir_sim import world
from mir_sim.machine import Event
from mir_sim.mission_queue import USER_ABORT, ItemState, QueueAction, QueueItem
from mir_sim.motion import Motion, Pose
from mir_sim.power import STANDING
from mir_sim.run import Run
from mir_sim.state import MISSION_CONTROLLER, RobotError, StateId
from mir_sim.steps import ChargeStep, Robot, Step, UnknownPosition, step_for

START_DELAY = 1.0  # s from first in the queue to Executing: right after a POST, /status still says Ready
TRANSIENT = 0.5  # s for which the states Completed, Aborted and Abort of an item last (guess: reported as short)
WAITING_TEXT = "Waiting for new missions..."


class MissionRobot(Robot, Protocol):
    """What the mission controller needs of its robot, in addition to what its steps need."""

    software: str
    rng: random.Random
    failure_rate: float
    fail_next: str | None

    def stamp(self) -> str: ...

    def add_error(self, error: RobotError) -> None: ...


class MissionController:
    """Runs one queue item at a time. Call ``settle`` after every change of the robot."""

    def __init__(self, robot: MissionRobot, pose: Pose, odometer: float) -> None:
        self._robot = robot
        self.run: Run | None = None
        self._pose = pose
        self.first_odometer = self._odometer = odometer
        self._text = WAITING_TEXT
        self._starts_at: float | None = None
        self._ended: tuple[StateId, float] = (StateId.READY, 0.0)
        self._aborting: tuple[QueueItem, float] | None = None

    # What the robot shows

    @property
    def state(self) -> StateId:
        """The state of the running step; for ``TRANSIENT`` seconds after a mission Completed or Aborted; otherwise Ready."""
        now = self._robot.now
        if self.run is not None:
            return self.run.step.state(self.run.elapsed(now))
        state, until = self._ended
        return state if now < until else StateId.READY

    @property
    def motion(self) -> Motion:
        """Where the robot is and how fast it moves. A robot that is held has no speed."""
        run = self.run
        moment = run.step.motion(run.elapsed(self._robot.now)) if run is not None else None
        if run is None or moment is None:
            return Motion(self._pose)
        return moment if run.since is not None else Motion(moment.pose, travelled=moment.travelled)

    @property
    def odometer(self) -> float:
        """Metres driven since the robot was made."""
        return self._odometer + self.motion.travelled

    @property
    def distance_to_target(self) -> float:
        """Metres still to drive to the next goal."""
        return self.run.step.length - self.motion.travelled if self.run is not None else 0.0

    @property
    def text(self) -> str:
        """``mission_text``: progress of the running mission, or the result of the last one."""
        return self._text if self.run is None else self.run.step.text(self._robot, self.run.elapsed(self._robot.now))

    @property
    def battery_rate(self) -> float:
        """Change of the battery in percent per second. A robot that is held on its charger still charges."""
        run = self.run
        active = run is not None and (run.since is not None or isinstance(run.step, ChargeStep))
        return run.step.battery_rate if run is not None and active else STANDING

    # What happens as time passes

    def events(self) -> Iterator[Event]:
        """What is due, as (simulated second, function to call)."""
        if self._starts_at is not None:
            yield self._starts_at, self._start_next
        if self._aborting is not None:
            yield self._aborting[1], self.finish_abort
        run = self.run
        if run is not None and run.since is not None:
            ends = run.step.ends_at(self._robot, run.since, run.done)
            if ends is not None:
                yield ends, self._next_step
            if run.fails_after is not None and run.failure is not None:
                yield run.since + run.fails_after - run.done, partial(self._fail, run.failure)

    def settle(self, free: bool) -> None:
        """Continue or suspend the running mission, and schedule the start of the next. ``free``: nothing holds the missions."""
        robot = self._robot
        if self.run is not None:
            if free:
                self.run.resume(robot.now)
            else:
                self.run.suspend(robot.now)
        if free and self.run is None and self._aborting is None and robot.queue.pending():
            self._starts_at = robot.now + START_DELAY if self._starts_at is None else self._starts_at
        else:
            self._starts_at = None

    def _start_next(self) -> None:
        robot = self._robot
        item = robot.queue.pending()[0]
        robot.queue.leave_pending(item)
        if item.mission_id not in robot.site.table("/missions"):
            item.finish(ItemState.ABORTED, robot.stamp(), "The mission does not exist")
            return
        item.state, item.started, item.message = ItemState.EXECUTING, robot.stamp(), ""
        self._starts_at = None
        self.run = Run(item, robot.site.mission_actions(item.mission_id), since=robot.now)
        if robot.fail_next is not None:
            self.run.failure, robot.fail_next = robot.fail_next, None
        elif robot.failure_rate and robot.rng.random() < robot.failure_rate:
            self.run.failure = self._goal_not_reached()

    def _goal_not_reached(self) -> str:
        """The message of a failed drive; software 2.x writes it as a template (recorded)."""
        name = self._robot.rng.choice(world.STATIONS).name
        if self._robot.software.startswith("2."):
            return json.dumps(
                {"message": "Failed to reach goal position '%(position_name)s'", "args": {"position_name": name}}
            )
        return f"Failed to reach goal position '{name}'"

    def _next_step(self) -> None:
        robot, run = self._robot, self.run
        if run is None:
            return
        step = self._leave_step()
        if step is not None:
            step.finish(robot)
        if run.item.actions and run.item.actions[-1].finished is None:
            run.item.actions[-1].finished = robot.stamp()
        if run.next_action >= len(run.actions):
            if run.failure is not None:
                self._fail(run.failure)
            else:
                self.end(ItemState.DONE, "")
            return
        action = run.actions[run.next_action]
        run.next_action += 1
        values = run.values(action)
        shown = [{"id": name, "value": value} for name, value in values.items()]
        number = run.item.id * 100 + len(
            run.item.actions
        )  # ids ascend over all items; a hundred actions per item are enough
        run.item.actions.append(QueueAction(number, action["guid"], action["action_type"], shown, robot.stamp()))
        try:
            step = step_for(robot, action["action_type"], values)
        except UnknownPosition:
            self._fail("The position of the action does not exist")
        except (KeyError, TypeError, ValueError, OverflowError):
            self._fail(f"Invalid parameters for action {action['action_type']}")
        else:
            step.begin(robot)
            run.begin(step, robot.now)

    def _leave_step(self) -> Step | None:
        """Take over pose and odometer from the current step; return that step."""
        motion = self.motion
        self._pose = motion.pose
        self._odometer += motion.travelled
        step = None
        if self.run is not None:
            step, self.run.step = self.run.step, Step(0.0)
        return step

    def _fail(self, text: str) -> None:
        """Abort the running mission and put the robot into Error."""
        self.end(ItemState.ABORTED, text)
        self._robot.add_error(RobotError(MISSION_CONTROLLER, text))

    # What others ask of it

    def end(self, state: ItemState, message: str) -> None:
        """End the running mission, if there is one, at the robot's present pose."""
        if self.run is not None:
            self.run.item.finish(state, self._robot.stamp(), message)
            self._stop(StateId.COMPLETED if state is ItemState.DONE else StateId.ABORTED, message)

    def _stop(self, shown: StateId, message: str) -> None:
        """Drop the running mission and show its result for ``TRANSIENT`` seconds."""
        robot = self._robot
        self._leave_step()
        self.run = None
        if robot.prompt is not None and not robot.prompt.blocks:
            robot.prompt = None
        self._text = message or WAITING_TEXT
        self._ended = (shown, robot.now + TRANSIENT)

    def cancel(self, item: QueueItem) -> None:
        """Cancel an item on a user's request: a pending one at once, the running one through Abort. An ended one stays as it is."""
        if item.state is ItemState.PENDING:
            self._robot.queue.leave_pending(item)
            item.finish(ItemState.ABORTED, self._robot.stamp(), USER_ABORT)
        elif self.run is not None and self.run.item is item:
            self._stop(StateId.ABORTED, USER_ABORT)
            item.state, self._aborting = ItemState.ABORT, (item, self._robot.now + TRANSIENT)

    def finish_abort(self) -> None:
        """End the item that is in Abort, if there is one. This happens even while missions are held: this one has stopped already."""
        if self._aborting is not None:
            item, self._aborting = self._aborting[0], None
            item.finish(ItemState.ABORTED, self._robot.stamp(), USER_ABORT)

    def reset_text(self) -> None:
        """Show that the robot waits for missions instead of the result of the last one."""
        self._text = WAITING_TEXT

    def relocate(self, pose: Pose) -> None:
        """Put the robot at another pose; a drive under way is planned again from there."""
        step = self._leave_step()
        self._pose = pose
        if self.run is not None and step is not None:
            step.begin(self._robot)
            self.run.begin(step, self._robot.now)
