"""The deterministic model of one MiR robot.

Between events all values are linear in time or follow a planned trip, so what the robot shows at an instant does not depend on how often
it was asked before. Times are simulated seconds since the model began unless a name says otherwise.
"""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import datetime
from typing import Any

from mir_sim import definition, world
from mir_sim.clock import RobotClock
from mir_sim.faults import FaultList
from mir_sim.history import fill
from mir_sim.machine import MONDAY, Event
from mir_sim.mission_controller import WAITING_TEXT, MissionController
from mir_sim.mission_queue import ItemState, MissionQueue, QueueItem
from mir_sim.motion import Motion, Pose
from mir_sim.power import Battery
from mir_sim.profile import FAITHFUL, Profile
from mir_sim.rest_machine import RestMachine
from mir_sim.run import Run
from mir_sim.site import ADMINISTRATOR, USER_GROUPS, Row, Site
from mir_sim.state import BATTERY_EMPTY, MISSION_CONTROLLER, ModeId, Prompt, RobotError, StateId

GOING_DOWN = 1.0  # s in state ShuttingDown before a reboot (guess)
STARTING_UP = 3.0  # s in state Starting after a reboot (guess)
API_RESTART = 5.0  # s of 503 answers after the clock was set


class SimulatedRobot(RestMachine):
    """One robot.

    ``handle``, ``exchange`` and ``control`` call ``catch_up`` by themselves; before calling its methods directly, call it first.

    Args:
        name: ``robot_name`` of /status.
        seed: with the name, decides everything random.
        clock: returns simulated seconds; without one, time advances only by ``advance_to``.
        time_scale: simulated seconds per real second; matters only for /sim and for faults, which count real seconds.
        profile: how it differs from the faithful robot.
        software: one of ``definition.SOFTWARE``. This and the next ones: None for that of the profile.
        model: ``robot_model`` of /status.
        timezone: IANA zone of the robot's naive timestamps; in the faithful profile, that of the manufacturer.
        clock_offset, clock_drift: error of the robot's clock, in seconds and seconds per day.
        start: true time at simulated second 0.
        battery: charge at the start in percent; random when None.
        failure_rate: share of missions (0…1) that fail by themselves.
        chaos: share of API requests (0…1) that meet a random fault.
        history: ended items that the queue begins with.
    """

    def __init__(
        self,
        name: str = "MiR_S042",
        *,
        seed: int = 1,
        clock: Callable[[], float] | None = None,
        time_scale: float = 1.0,
        profile: Profile = FAITHFUL,
        software: str | None = None,
        model: str | None = None,
        timezone: str | None = None,
        clock_offset: float | None = None,
        clock_drift: float | None = None,
        start: datetime = MONDAY,
        battery: float | None = None,
        failure_rate: float = 0.0,
        chaos: float = 0.0,
        history: int = 0,
    ) -> None:
        own: dict[str, Any] = {
            "software": software,
            "model": model,
            "timezone": timezone,
            "clock_offset": clock_offset,
            "clock_drift": clock_drift,
        }
        self.profile = profile = replace(profile, **{name: value for name, value in own.items() if value is not None})
        latency = profile.latency and (profile.latency[0] / time_scale, profile.latency[1] / time_scale)
        super().__init__(
            name,
            RobotClock(start, profile.timezone, profile.clock_offset, profile.clock_drift),
            FaultList(chaos, random.Random(f"{seed}/{name}/chaos"), latency),
            clock,
            time_scale,
        )
        self.rng = random.Random(f"{seed}/{name}")
        self.definition = definition.load(profile.software)
        self.software, self.model = profile.software, profile.model
        self.serial_number = f"2502{self.rng.randrange(10**11):011d}"
        self.site = Site(self.rng, profile.software, profile.model)
        self.queue = MissionQueue()
        self.battery = Battery(self.rng.uniform(60, 95) if battery is None else battery)
        self.failure_rate = failure_rate
        self.map_id, self.session_id = world.MAP_GUID, world.SESSION_GUID
        self.mode = ModeId.MISSION
        self.joystick_session = ""
        self.paused = self.manual = self.emergency_stop = False
        self.errors: list[RobotError] = []
        self.error_causes: list[RobotError] = []
        self.fail_next: str | None = None
        self.prompt: Prompt | None = None
        self.reboots = 0
        self.switched_on = -float(self.rng.randrange(100_000, 4_000_000))
        self.controller = MissionController(
            self, world.BY_NAME["Home"].pose, round(self.rng.uniform(5_000, 900_000), 3)
        )
        self._battery_empty = False
        self._asked_at: deque[float] = deque()
        if profile.fleet is not None:
            self.call_at(profile.fleet.every_seconds, self._take_fleet_order)
        fill(self.queue, self.clock, history, random.Random(f"{seed}/{name}/history"))

    # Time

    def _events(self) -> Iterator[Event]:
        yield from super()._events()
        if self.prompt is not None:
            yield self.prompt.expires, self._expire_prompt
        if not self._battery_empty and self.battery.rate < 0 and (empty := self.battery.time_of(0.0)) is not None:
            yield empty, self._run_out_of_battery
        yield from self.controller.events()

    def _settle(self) -> None:
        """Adapt missions and battery to the robot's state after any change."""
        held = (
            self.emergency_stop
            or self.errors
            or self.manual
            or self.paused
            or self.state in (StateId.STARTING, StateId.SHUTTING_DOWN)
        )
        held = held or self.mode is not ModeId.MISSION or (self.prompt is not None and self.prompt.blocks)
        self.controller.settle(free=not held)
        self.battery.set_rate(self.controller.battery_rate, self.now)

    # What the robot shows

    @property
    def state(self) -> StateId:
        if self.shutting_down:
            return StateId.SHUTTING_DOWN
        if not self.online or (self.reboots and self.now < self.switched_on + STARTING_UP):
            return StateId.STARTING
        if self.emergency_stop:
            return StateId.EMERGENCY_STOP
        if self.errors:
            return StateId.ERROR
        if self.manual:
            return StateId.MANUAL_CONTROL
        return StateId.PAUSE if self.paused else self.controller.state

    @property
    def mission_text(self) -> str:
        state = self.state
        if state is StateId.SHUTTING_DOWN:
            return "Shutting down..."  # guess, by analogy with the next one
        if state is StateId.STARTING:
            return "Starting..."
        if state is StateId.EMERGENCY_STOP:
            return "Cameras are ready to stream"  # recorded, odd as it looks
        if state is StateId.ERROR:
            return self.errors[0].description
        return WAITING_TEXT if state is StateId.READY else self.controller.text

    @property
    def run(self) -> Run | None:
        """The mission being executed."""
        return self.controller.run

    @property
    def motion(self) -> Motion:
        return self.controller.motion

    @property
    def pose(self) -> Pose:
        return self.motion.pose

    def snapshot(self) -> dict[str, Any]:
        with self.lock:
            self.catch_up()
            return {
                "name": self.name,
                "now": self.stamp(),
                "seconds": round(self.now, 3),
                "state_id": int(self.state),
                "battery": round(self.battery.at(self.now), 2),
                "queue": [item.full() for item in self.queue],
                "faults": self.faults.full(),
                "errors": [error.full() for error in self.errors],
                "online": self.online,
            }

    # What clients request

    def order(
        self,
        mission_id: str,
        user: Row,
        *,
        message: str = "",
        description: str = "",
        parameters: list[Row] | None = None,
        priority: int = 0,
        fleet_schedule_guid: str = "",
    ) -> QueueItem:
        """Append a mission to the queue. The caller has checked that the mission exists."""
        item = QueueItem(
            self.queue.next_id,
            mission_id,
            self.stamp(),
            user["guid"],
            user["name"],
            message=message,
            description=description,
            parameters=parameters or [],
            priority=priority,
            fleet_schedule_guid=fleet_schedule_guid,
        )
        self.queue.add(item)
        self._settle()
        return item

    def cancel(self, item: QueueItem) -> None:
        """Cancel an item on a user's request. The running one is shortly in Abort; an ended one stays as it is."""
        self.controller.cancel(item)
        self._settle()

    def cancel_all(self) -> None:
        for item in [*self.queue.pending(), *([self.run.item] if self.run is not None else [])]:
            self.cancel(item)

    def pause(self) -> None:
        if not self.emergency_stop:
            self.paused, self.manual = True, False
            self._settle()

    def resume(self) -> None:
        """Continue the queue. Has no effect in emergency stop and while there are errors."""
        if not self.emergency_stop and not self.errors:
            self.paused = self.manual = False
            self.controller.reset_text()
            self._settle()

    def take_over(self) -> None:
        """Switch to manual control by joystick. Has no effect in emergency stop and while there are errors."""
        if not self.emergency_stop and not self.errors:
            self.manual, self.paused = True, False
            self._settle()

    def set_mode(self, mode: ModeId) -> None:
        self.mode = mode
        self._settle()

    def clear_errors(self) -> None:
        """Clear the errors whose cause has ended. After the last one the robot is in Pause."""
        if self.errors:
            self.errors = [error for error in self.errors if error in self.error_causes]
            self.paused = self.paused or not self.errors
            self._settle()

    def relocate(self, pose: Pose, map_id: str) -> None:
        """Correct the robot's pose and map, as a client does after a wrong localisation."""
        self.controller.relocate(pose)
        self.map_id = map_id
        self._settle()

    def ask(
        self, question: str, options: list[str], timeout: float, *, expires: float | None = None, blocks: bool = False
    ) -> Prompt:
        """Show a prompt for ``timeout`` seconds, or until the simulated second ``expires``."""
        self.prompt = Prompt(
            self.site.new_guid(),
            question,
            options,
            timeout,
            self.now + timeout if expires is None else expires,
            USER_GROUPS["Distributors"],
            blocks,
        )
        self._settle()
        return self.prompt

    def withdraw_prompt(self, guid: str) -> None:
        """Remove the prompt with this guid, if it is shown."""
        if self.prompt is not None and self.prompt.guid == guid:
            self.prompt = None
            self._settle()

    def set_clock(self, moment: datetime) -> None:
        """Set the robot's clock. On a robot this restarts the REST API and triggers an emergency stop (reported)."""
        self.clock.set_local(moment, self.now)
        self.api_down_until = self.in_real(API_RESTART)
        self.press_emergency_stop(True)

    def set_register(self, register: int, value: float) -> None:
        """Write a PLC register: 1–100 hold integers, 101–200 floats."""
        row = self.site.table("/registers").get(register)
        if row is not None:
            row["value"] = int(value) if register <= 100 else float(value)

    # What happens to the robot

    def press_emergency_stop(self, pressed: bool) -> None:
        """Press or release the button. After the release the robot is in Pause."""
        if self.emergency_stop and not pressed:
            self.paused, self.manual = True, False
        self.emergency_stop = pressed
        self._settle()

    def raise_error(self, error: RobotError, *, lasting: bool) -> None:
        """Put the robot into Error. An error of the mission controller ends the running mission, any other only holds it.

        Args:
            lasting: clearing has no effect until ``remove_error_causes``.
        """
        self.add_error(error)
        if lasting:
            self.error_causes.append(error)
        if error.code == MISSION_CONTROLLER:
            self.controller.end(ItemState.ABORTED, error.description)
        self._settle()

    def add_error(self, error: RobotError) -> None:
        """Enter the state Error and file a report of it."""
        self.errors.append(replace(error, at=self.now))
        self.file_report(error.module, self.profile.text(error.description))

    def remove_error_causes(self) -> None:
        self.error_causes.clear()

    def set_battery(self, percent: float) -> None:
        self.battery.set_level(percent, self.now)
        if percent > 0 and self._battery_empty:
            self._battery_empty = False
            self.error_causes = [error for error in self.error_causes if error != BATTERY_EMPTY]

    def reboot(self, real_seconds: float) -> None:
        """Shut down and be offline for a time. The queue is kept; the running mission is aborted.

        All this is a guess: no reboot was recorded. A robot that is shutting down already continues to; one that is offline
        stays so for the time given now.
        """
        if self.shutting_down:
            return
        self.controller.end(ItemState.ABORTED, "Mission was stopped..")
        self.controller.finish_abort()
        if self.online:
            self.shutting_down = True
            self.call_at(self.now + GOING_DOWN, lambda: self._go_offline(real_seconds))
        else:
            self._go_offline(real_seconds)
        self._settle()

    def note_request(self) -> None:
        """A client has asked for something. Robots whose profile says so reboot when that comes too often."""
        limit = self.profile.reboots
        if limit is None or self.shutting_down or not self.online:
            return
        self._asked_at.append(self.now)
        while self._asked_at[0] <= self.now - limit.within_seconds:
            self._asked_at.popleft()
        if len(self._asked_at) > limit.requests:
            self._asked_at.clear()
            self.reboot(limit.offline_seconds / self.time_scale)

    def _take_fleet_order(self) -> None:
        """Queue what the fleet of the profile orders, as an administrator (guess)."""
        fleet, administrator = self.profile.fleet, self.site.table("/users").get(ADMINISTRATOR)
        if fleet is None or administrator is None:
            return
        self.call_at(self.now + fleet.every_seconds, self._take_fleet_order)
        if self.online and not any(item.fleet_schedule_guid for item in self.queue.pending()):
            self.order(fleet.mission, administrator, fleet_schedule_guid=self.site.new_guid())

    def _go_offline(self, real_seconds: float) -> None:
        super()._go_offline(real_seconds)
        self.prompt = None
        self.manual = False
        self.errors = list(self.error_causes)

    def _come_online(self) -> None:
        super()._come_online()
        self.switched_on = self.now
        self.reboots += 1
        self.call_at(self.now + STARTING_UP, self._settle)

    def _run_out_of_battery(self) -> None:
        self._battery_empty = True
        self.raise_error(BATTERY_EMPTY, lasting=True)

    def _expire_prompt(self) -> None:
        if self.prompt is not None:
            self.withdraw_prompt(self.prompt.guid)
