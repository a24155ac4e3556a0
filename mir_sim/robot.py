"""The model of one MiR: a pure, deterministic machine that is told the time and never asks for it.

Between events everything is a straight line or a planned trip, so what the robot shows at an instant does not depend on how often it was
asked before. Times are simulated seconds since the robot was switched on unless a name says otherwise.
"""
from __future__ import annotations

import heapq
import itertools
import json
import random
import threading
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

from mir_sim import definition, world
from mir_sim.clock import RobotClock
from mir_sim.faults import FaultList
from mir_sim.mission_queue import USER_ABORT, ItemState, MissionQueue, QueueAction, QueueItem
from mir_sim.motion import Motion, Pose
from mir_sim.power import STANDING, Battery
from mir_sim.run import Run
from mir_sim.site import USER_GROUPS, Row, Site
from mir_sim.state import MISSION_CONTROLLER, ModeId, Prompt, RobotError, StateId
from mir_sim.steps import ChargeStep, Step, UnknownPosition, step_for

START_DELAY = 1.0             # s from "next in the queue" to Executing: right after a POST, /status still says Ready
TRANSIENT = 0.5               # s for which Completed and Aborted are shown
STARTING_UP = 3.0             # s of state Starting after a reboot
MONDAY = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)
WAITING_TEXT = "Waiting for new missions..."


class SimulatedRobot:
    """One robot.

    Args:
        name: ``robot_name`` of /status.
        seed: with the name, decides everything that is random.
        clock: supplies simulated seconds; without one the robot stands still until ``advance_to`` is called.
        time_scale: simulated seconds per real second; matters only where control and faults speak of real seconds.
        software: "3.5.4" or "2.14.7".
        model: ``robot_model`` of /status.
        start: true time at simulated second 0.
        timezone: IANA zone of the robot's naive timestamps.
        clock_offset, clock_drift: error of the robot's clock, in seconds and seconds per day.
        battery: charge at the start in percent; drawn by seed when None.
        failure_rate: share of missions (0…1) that fail by themselves.
    """

    def __init__(self, name: str = "MiR_S042", *, seed: int = 1, clock: Callable[[], float] | None = None, time_scale: float = 1.0,
                 software: str = "3.5.4", model: str = "MiR250", start: datetime = MONDAY, timezone: str = "UTC",
                 clock_offset: float = 0.0, clock_drift: float = 0.0, battery: float | None = None, failure_rate: float = 0.0) -> None:
        self.lock = threading.RLock()
        self.rng = random.Random(f"{seed}/{name}")
        self.definition = definition.load(software)
        self.name, self.software, self.model, self.time_scale = name, software, model, time_scale
        self.serial_number = f"2502{self.rng.randrange(10**11):011d}"
        self.clock = RobotClock(start, timezone, clock_offset, clock_drift)
        self.site = Site(self.rng)
        self.queue = MissionQueue()
        self.faults = FaultList()
        self.battery = Battery(self.rng.uniform(60, 95) if battery is None else battery)
        self.failure_rate = failure_rate
        self.now = 0.0
        self.map_id, self.session_id = world.MAP_GUID, world.SESSION_GUID
        self.mode = ModeId.MISSION
        self.joystick_session = ""
        self.paused = self.manual = self.emergency_stop = False
        self.errors: list[RobotError] = []
        self.error_causes: list[RobotError] = []
        self.fail_next: str | None = None
        self.prompt: Prompt | None = None
        self.run: Run | None = None
        self.offline_until: float | None = None
        self.reboots = 0
        self.switched_on = -float(self.rng.randrange(100_000, 4_000_000))
        self._time_source = clock
        self._pose = world.BY_NAME["Home"].pose
        self._moved = round(self.rng.uniform(5_000, 900_000), 3)
        self._text = WAITING_TEXT
        self._starts_at: float | None = None
        self._shown: tuple[StateId, float] = (StateId.READY, 0.0)
        self._calls: list[tuple[float, int, Callable[[], object]]] = []
        self._call_order = itertools.count()
        self._battery_empty = False

    # Time

    def catch_up(self) -> None:
        """Advance to what the clock says; without a clock, do only what is due by now."""
        self.advance_to(self._time_source() if self._time_source is not None else self.now)

    def advance_to(self, seconds: float) -> None:
        """Let the robot live until a simulated second. Going back is not possible and does nothing."""
        with self.lock:
            while (event := self._next_event()) is not None and event[0] <= seconds:
                self.now = max(self.now, event[0])
                event[1]()
                self._settle()
            self.now = max(self.now, seconds)

    def call_at(self, seconds: float, call: Callable[[], object]) -> None:
        """Have something done when simulated time reaches ``seconds``."""
        with self.lock:
            heapq.heappush(self._calls, (seconds, next(self._call_order), call))

    def in_real(self, seconds: float) -> float:
        """The simulated second that lies that many real seconds ahead."""
        return self.now + seconds * self.time_scale

    def _next_event(self) -> tuple[float, Callable[[], object]] | None:
        events: list[tuple[float, Callable[[], object]]] = []
        if self._calls:
            events.append((self._calls[0][0], lambda: heapq.heappop(self._calls)[2]()))
        if self.offline_until is not None:
            events.append((self.offline_until, self._come_online))
        if self.prompt is not None:
            events.append((self.prompt.expires, self._expire_prompt))
        if not self._battery_empty and (empty := self.battery.time_of(0.0)) is not None and self.battery.rate < 0:
            events.append((empty, self._run_out_of_battery))
        if self._starts_at is not None:
            events.append((self._starts_at, self._start_next))
        if self.run is not None and self.run.since is not None:
            ends = self.run.step.ends_at(self, self.run.since, self.run.done)
            if ends is not None:
                events.append((ends, self._next_step))
            if self.run.fails_after is not None:
                events.append((self.run.since + self.run.fails_after - self.run.done, self._fail_as_told))
        return min(events, key=lambda event: event[0], default=None)

    # What the robot shows

    @property
    def online(self) -> bool:
        return self.offline_until is None

    @property
    def state(self) -> StateId:
        if not self.online or (self.reboots and self.now < self.switched_on + STARTING_UP):
            return StateId.STARTING
        if self.emergency_stop:
            return StateId.EMERGENCY_STOP
        if self.errors:
            return StateId.ERROR
        if self.manual:
            return StateId.MANUAL_CONTROL
        if self.paused:
            return StateId.PAUSE
        if self.run is not None:
            return self.run.step.state(self.run.elapsed(self.now))
        state, until = self._shown
        return state if self.now < until else StateId.READY

    @property
    def motion(self) -> Motion:
        """Where the robot is and, if it is on its way, how fast. A held robot stands."""
        run = self.run
        moment = run.step.motion(run.elapsed(self.now)) if run is not None else None
        if moment is None:
            return Motion(self._pose)
        return moment if run is not None and run.since is not None else Motion(moment.pose, travelled=moment.travelled)

    @property
    def pose(self) -> Pose:
        return self.motion.pose

    @property
    def moved(self) -> float:
        """The odometer in metres."""
        return self._moved + self.motion.travelled

    @property
    def distance_to_target(self) -> float:
        """Metres still to drive to the next goal."""
        return self.run.step.length - self.motion.travelled if self.run is not None else 0.0

    @property
    def mission_text(self) -> str:
        state = self.state
        if state is StateId.STARTING:
            return "Starting..."
        if state is StateId.EMERGENCY_STOP:
            return "Cameras are ready to stream"
        if state is StateId.ERROR:
            return self.errors[0].description
        if self.run is not None:
            return self.run.step.text(self, self.run.elapsed(self.now))
        return self._text if state is not StateId.READY else WAITING_TEXT

    def stamp(self) -> str:
        """The robot's local time, as it writes it into its records."""
        return self.clock.stamp(self.now)

    # What clients do

    def order(self, mission_id: str, user: Row, *, message: str = "", description: str = "", parameters: list[Row] | None = None,
              priority: int = 0, fleet_schedule_guid: str = "") -> QueueItem:
        """Put a mission at the end of the queue. The caller has seen to it that the mission exists."""
        item = QueueItem(self.queue.next_id, mission_id, self.stamp(), user["guid"], user["name"], message=message, description=description,
                         parameters=parameters or [], priority=priority, fleet_schedule_guid=fleet_schedule_guid)
        self.queue.add(item)
        self._settle()
        return item

    def cancel(self, item: QueueItem) -> None:
        """End an open item as the user's wish; an ended one stays as it is."""
        if item.state is ItemState.PENDING:
            self.queue.leave_pending(item)
            item.finish(ItemState.ABORTED, self.stamp(), USER_ABORT)
        elif item.state is ItemState.EXECUTING:
            self._end_run(ItemState.ABORTED, USER_ABORT)
            self._text = USER_ABORT
        self._settle()

    def cancel_all(self) -> None:
        for item in self.queue.pending():
            self.cancel(item)
        if self.run is not None:
            self.cancel(self.run.item)

    def pause(self) -> None:
        if not self.emergency_stop:
            self.paused, self.manual = True, False
            self._settle()

    def resume(self) -> None:
        """Let the queue run. Without effect in emergency stop and while errors stand."""
        if not self.emergency_stop and not self.errors:
            self.paused = self.manual = False
            self._text = WAITING_TEXT
            self._settle()

    def take_over(self) -> None:
        """Manual control by joystick."""
        if not self.emergency_stop and not self.errors:
            self.manual, self.paused = True, False
            self._settle()

    def set_mode(self, mode: ModeId) -> None:
        self.mode = mode
        self._settle()

    def clear_errors(self) -> None:
        """Clear every error whose cause is gone; a robot cleared of its last one stands in Pause."""
        if self.errors:
            self.errors = [error for error in self.errors if error in self.error_causes]
            self.paused = self.paused or not self.errors
            self._settle()

    def relocate(self, pose: Pose, map_id: str) -> None:
        """Believe to be somewhere else; a drive under way is planned anew from there."""
        step = self._leave_step()
        self._pose, self.map_id = pose, map_id
        if self.run is not None and step is not None:
            step.begin(self)
            self.run.enter(step, self.now)
        self._settle()

    def ask(self, question: str, options: list[str], timeout: float, *, expires: float | None = None, blocks: bool = False) -> Prompt:
        """Show a prompt for ``timeout`` seconds, or until the simulated second ``expires``."""
        self.prompt = Prompt(self.site.new_guid(), question, options, timeout, self.now + timeout if expires is None else expires,
                             USER_GROUPS["Distributors"], blocks)
        self._settle()
        return self.prompt

    def withdraw_prompt(self, guid: str) -> None:
        """Take the prompt away (answered, timed out or aborted), if it is this one."""
        if self.prompt is not None and self.prompt.guid == guid:
            self.prompt = None
            self._settle()

    def set_clock(self, moment: datetime) -> None:
        """Set the robot's clock. On a robot this restarts the REST API and triggers an emergency stop (reported)."""
        self.clock.set_local(moment, self.now)
        self.press_emergency_stop(True)

    def set_register(self, register: int, value: float) -> None:
        row = self.site.table("/registers").get(register)
        if row is not None:
            row["value"] = int(value) if register <= 100 else float(value)

    # What befalls the robot

    def press_emergency_stop(self, pressed: bool) -> None:
        """Press or release the button. A released robot stands in Pause."""
        if self.emergency_stop and not pressed:
            self.paused, self.manual = True, False
        self.emergency_stop = pressed
        self._settle()

    def raise_error(self, error: RobotError, *, lasting: bool) -> None:
        """Stand in Error. A failure of the mission controller ends the running mission; any other error only holds it.

        Args:
            lasting: the error comes back until ``remove_error_causes``.
        """
        self.errors.append(error)
        if lasting:
            self.error_causes.append(error)
        if error.code == MISSION_CONTROLLER and self.run is not None:
            self._end_run(ItemState.ABORTED, error.description)
        self._settle()

    def remove_error_causes(self) -> None:
        self.error_causes.clear()

    def set_battery(self, percent: float) -> None:
        self.battery.set_level(percent, self.now)
        if percent > 0 and self._battery_empty:
            self._battery_empty = False
            self.error_causes = [error for error in self.error_causes if error != BATTERY_EMPTY]

    def reboot(self, real_seconds: float) -> None:
        """Go off the air. The queue is kept; what was executing is aborted (guess: no robot was recorded rebooting)."""
        if self.run is not None:
            self._end_run(ItemState.ABORTED, "Mission was stopped..")
        self.prompt = None
        self.manual = False
        self.errors = list(self.error_causes)
        self.offline_until = self.in_real(real_seconds)
        self._settle()

    def _come_online(self) -> None:
        self.switched_on, self.offline_until = self.now, None
        self.reboots += 1
        self.call_at(self.now + STARTING_UP, self._settle)

    def _run_out_of_battery(self) -> None:
        self._battery_empty = True
        self.raise_error(BATTERY_EMPTY, lasting=True)

    def _expire_prompt(self) -> None:
        if self.prompt is not None:
            self.withdraw_prompt(self.prompt.guid)

    # The mission controller

    def _free_to_run(self) -> bool:
        held = self.emergency_stop or self.errors or self.manual or self.paused or self.state is StateId.STARTING
        return not held and self.mode is ModeId.MISSION and not (self.prompt is not None and self.prompt.blocks)

    def _settle(self) -> None:
        """Bring run, queue and battery in line with the state after anything has changed."""
        free = self._free_to_run()
        if self.run is not None:
            if free:
                self.run.go_on(self.now)
            else:
                self.run.freeze(self.now)
        if free and self.run is None and self.queue.pending():
            self._starts_at = self.now + START_DELAY if self._starts_at is None else self._starts_at
        else:
            self._starts_at = None
        run = self.run
        drawing = run is not None and (run.since is not None or isinstance(run.step, ChargeStep))
        self.battery.set_rate(run.step.battery_rate() if run is not None and drawing else STANDING, self.now)

    def _start_next(self) -> None:
        item = self.queue.pending()[0]
        self.queue.leave_pending(item)
        item.state, item.started, item.message = ItemState.EXECUTING, self.stamp(), ""
        self._starts_at = None
        self.run = Run(item, self.site.mission_actions(item.mission_id), since=self.now)
        if self.fail_next is not None:
            self.run.failure, self.fail_next = self.fail_next, None
        elif self.failure_rate and self.rng.random() < self.failure_rate:
            self.run.failure = self._goal_not_reached()

    def _goal_not_reached(self) -> str:
        """The text of a failed drive; software 2.x writes it as a template (recorded)."""
        name = self.rng.choice(world.STATIONS).name
        if self.software.startswith("2."):
            return json.dumps({"message": "Failed to reach goal position '%(position_name)s'", "args": {"position_name": name}})
        return f"Failed to reach goal position '{name}'"

    def _next_step(self) -> None:
        run = self.run
        assert run is not None
        step = self._leave_step()
        if step is not None:
            step.finish(self)
        if run.item.actions and run.item.actions[-1].finished is None:
            run.item.actions[-1].finished = self.stamp()
        if run.next_action >= len(run.actions):
            if run.failure is not None:
                self._fail(run.failure)
            else:
                self._end_run(ItemState.DONE, "")
            return
        action = run.actions[run.next_action]
        run.next_action += 1
        values = run.values(action)
        shown = [{"id": name, "value": value} for name, value in values.items()]
        run.item.actions.append(QueueAction(self._action_id(run), action["guid"], action["action_type"], shown, self.stamp()))
        try:
            step = step_for(self, action["action_type"], values)
        except UnknownPosition:
            self._fail("The position of the action does not exist")
        except (KeyError, TypeError, ValueError):
            self._fail(f"Invalid parameters for action {action['action_type']}")
        else:
            step.begin(self)
            run.enter(step, self.now)

    @staticmethod
    def _action_id(run: Run) -> int:
        """Ids of started actions ascend over the life of the robot; a hundred per item is room enough."""
        return run.item.id * 100 + len(run.item.actions)

    def _leave_step(self) -> Step | None:
        """Stand where the present step has brought the robot; return that step."""
        motion = self.motion
        self._pose = motion.pose
        self._moved += motion.travelled
        step = None
        if self.run is not None:
            step, self.run.step = self.run.step, Step(0.0)
        return step

    def _fail_as_told(self) -> None:
        if self.run is not None and self.run.failure is not None:
            self._fail(self.run.failure)

    def _fail(self, text: str) -> None:
        """End the running mission as failed; the robot then stands in Error until it is cleared."""
        self._end_run(ItemState.ABORTED, text)
        self.errors.append(RobotError(MISSION_CONTROLLER, text))

    def _end_run(self, state: ItemState, message: str) -> None:
        run = self.run
        assert run is not None
        self._leave_step()
        run.item.finish(state, self.stamp(), message)
        self.run = None
        if self.prompt is not None and not self.prompt.blocks:
            self.prompt = None
        self._text = message or WAITING_TEXT
        self._shown = (StateId.COMPLETED if state is ItemState.DONE else StateId.ABORTED, self.now + TRANSIENT)

    def snapshot(self) -> dict[str, Any]:
        """What ``GET /sim`` shows: the truth about the robot, whatever its API says."""
        self.catch_up()
        with self.lock:
            return {
                "name": self.name, "now": self.stamp(), "seconds": round(self.now, 3), "state_id": int(self.state),
                "battery": round(self.battery.at(self.now), 2), "queue": [item.full() for item in self.queue],
                "faults": self.faults.full(), "errors": [error.full() for error in self.errors], "online": self.online,
            }


BATTERY_EMPTY = RobotError(10001, "Battery is empty", "Battery")     # code and words are a guess
