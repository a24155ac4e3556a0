"""What a person asks for: Run now, Pause and Resume, Reset errors, Clear queue, cancel, answer a prompt, test a connection.

Called on background threads, never on the UI's; every call talks to the robot on a connection of its own, so it doesn't wait behind a poll.
Problems with the robot are raised as RobotError with one sentence.
"""
from __future__ import annotations

import logging
import uuid
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import replace
from typing import Any

from app.database.connection import Database
from app.database.groups import GroupRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.domain import rules
from app.domain.clock import Clock
from app.domain.models import Execution, Group, InvalidInput, Mission, Reason, ReasonCode, Robot, Settings, State, Trigger
from app.domain.robot import IdentifiedBy, Identity, MissionInfo, RobotState
from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import normalise_fingerprint, token_for
from app.mir.errors import Delivery, RobotError
from app.mir.fingerprint import presented_fingerprint
from app.services.allocation.belief import HIGH
from app.services.catalogue import validation
from app.services.dispatch.engine import Engine
from app.services.dispatch.ledger import Ledger
from app.services.live.holds import Holds
from app.services.robots.missions import RobotMissions

log = logging.getLogger(__name__)

MOST_TOLD = 20               # starts in one line of the log

ClientFactory = Callable[[Robot], RobotClient]


class Operator:
    def __init__(self, db: Database, *, robots: RobotRepository, missions: MissionRepository, ledger: Ledger, clock: Clock, engine: Engine,
                 holds: Holds, settings: Callable[[], Settings], make_client: ClientFactory, robot_missions: RobotMissions) -> None:
        self._db, self._robots, self._missions = db, robots, missions
        self._ledger, self._clock, self._engine, self._settings, self._make_client = ledger, clock, engine, settings, make_client
        self._holds, self._robot_missions = holds, robot_missions

    # ------------------------------------------------------------------ missions
    def run_now(self, robot_id: int, mission_id: int, parameters: Mapping[str, Any] | None = None, token: str | None = None) -> Execution:
        """Submit a mission at once, whatever its constraints are. ``token`` is made per press, so a press that arrives twice runs once.
        Raises InvalidInput, also where the data was copied from another tablet: it must not wait here until the plan moves."""
        robot, mission = self._robot(robot_id), self._mission(mission_id)
        if robot.needs_password:
            raise InvalidInput("robot", "{robot} is switched off until its password is entered in Settings", robot=robot.name)
        if not robot.enabled:
            raise InvalidInput("robot", "{robot} is switched off in Settings", robot=robot.name)
        if self._holds.is_copy is not None:
            raise InvalidInput("robot", "this data was copied from another tablet: nothing is sent from here before it moves here")
        parameters = self._robot_missions.checked(robot_id, mission.guid, parameters or {})
        return self._start(robot, mission, parameters, token)

    def run_on_any(self, group_id: int, mission_id: int, parameters: Mapping[str, Any] | None = None, token: str | None = None, *,
                   priority: int = HIGH) -> Execution:
        """The same on whichever robot of a group will be done first; before what is planned with a lower priority. It waits as long as none
        is free. Raises InvalidInput."""
        group = GroupRepository().get(self._db.read(), group_id)
        if group is None:
            raise InvalidInput("group", "there is no such group any more")
        mission = self._missions.by_name(self._db.read(), self._mission(mission_id).name)
        if mission is None:
            raise InvalidInput("mission", "the mission {name} is for one robot only; a group needs one for all robots",
                               name=self._mission(mission_id).name)
        if self._holds.is_copy is not None:
            raise InvalidInput("robot", "this data was copied from another tablet: nothing is sent from here before it moves here")
        return self._start(group, mission, parameters or {}, token, priority)

    def _start(self, target: Robot | Group, mission: Mission, parameters: Mapping[str, Any], token: str | None,
               priority: int = 0) -> Execution:
        token = token or str(uuid.uuid4())
        row = rules.one_off(Trigger.MANUAL, target, mission, self._settings(), self._clock.now(), token,
                            parameters=validation.parameters(parameters), priority=priority)
        execution = self._ledger.add(row) or self._ledger.by_token(token)
        if execution is None:
            raise LookupError(token)
        return execution

    def cancel_execution(self, execution_id: int) -> Execution | None:
        """Cancel one of ours, in whatever state it is. Returns the row as it is now; the robot's answer may still decide: one that can't be
        asked now is asked again until it has answered. Raises RobotError when it refuses."""
        execution = self._ledger.get(execution_id)
        if execution is None or not execution.state.is_open:
            return execution
        if execution.state is State.WAITING and (ended := self._ledger.end(execution, Reason(ReasonCode.USER_CANCELLED))):
            return ended
        self._ledger.ask_cancel([execution], ReasonCode.USER_CANCELLED)
        if execution.queue_id is not None and execution.robot_id is not None:
            try:
                self.cancel_item(execution.robot_id, execution.queue_id)
            except RobotError as error:
                if error.delivery is Delivery.REFUSED:
                    self._ledger.ask_cancel([execution], None)
                    raise
                log.info("#%d is cancelled as soon as %r answers: %s", execution.id, execution.robot, error.text)
        return self._ledger.get(execution_id)

    def hold_starts(self, execution_ids: Collection[int], held: bool = True) -> int:
        """Keep these back while they wait, until they are let go; one that is still held when its start window closes is skipped. Returns
        how many were not on their way yet."""
        waiting = self._ledger.unsent([*execution_ids])
        count = self._ledger.hold(execution_ids, held)
        if count and any(row.held != held for row in waiting):
            names = ", ".join(f"#{row.id} {row.mission!r} on {row.robot!r}" for row in waiting[:MOST_TOLD])
            log.info("%d of %d starts %s: %s%s", count, len(waiting), "kept back" if held else "let go", names,
                     f" and {len(waiting) - MOST_TOLD} more" if len(waiting) > MOST_TOLD else "")
        return count

    def cancel_item(self, robot_id: int, queue_id: int) -> None:
        """Cancel one item of the robot's queue, whoever put it there. One that has just ended stays as it ended."""
        ours = [e for e in self._ledger.open_for(robot_id) if e.queue_id == queue_id]
        self._ledger.ask_cancel(ours, ReasonCode.USER_CANCELLED)
        with self._client(robot_id, f"Cancel of queue item {queue_id}") as client:
            client.cancel(queue_id)
        self._engine.poll(robot_id)

    def clear_queue(self, robot_id: int) -> None:
        """Everything pending or executing on the robot goes, and what waits here to be sent there."""
        ours = self._ledger.open_for(robot_id)
        sent = [e for e in ours if e.state is not State.WAITING]
        self._ledger.ask_cancel(sent, ReasonCode.QUEUE_CLEARED)
        try:
            with self._client(robot_id, "Clear queue") as client:
                client.clear_queue()
        except RobotError as error:
            if error.certainly_without_effect:
                self._ledger.ask_cancel(sent, None)
            raise
        for execution in ours:
            if execution.state is State.WAITING:
                self._ledger.end(execution, Reason(ReasonCode.QUEUE_CLEARED))
        self._engine.poll(robot_id)

    # ------------------------------------------------------------------ the robot
    def pause(self, robot_id: int) -> None:
        self._set_state(robot_id, RobotState.PAUSE)

    def resume(self, robot_id: int) -> None:
        self._set_state(robot_id, RobotState.READY)

    def reset_errors(self, robot_id: int) -> None:
        """Clears resettable errors. Never moves the robot: it stays in Pause until Resume."""
        with self._client(robot_id, "Reset errors") as client:
            client.clear_error()
        self._engine.poll(robot_id)

    def answer_prompt(self, robot_id: int, guid: str, answer: str) -> None:
        with self._client(robot_id, f"its question is answered with {answer!r}") as client:
            client.answer_prompt(guid, answer)
        self._engine.poll(robot_id)

    def _set_state(self, robot_id: int, state: RobotState) -> None:
        with self._client(robot_id, "Pause" if state is RobotState.PAUSE else "Resume") as client:
            client.set_state(state)
        self._engine.poll(robot_id)

    # ------------------------------------------------------------------ the integrator
    def test_connection(self, robot: Robot, password: str | None = None, *, by_address: bool = False) -> Identity:
        """Who answers to ``robot`` as it is entered, saved or not. Without a password the token of the saved robot is used, where it
        belongs to that user, address, certificate and serial number. ``by_address``: a person has agreed that credentials go to a machine
        which no longer shows the known serial number. Raises InvalidInput or RobotError, AnotherRobot and SerialNumberHidden among them.
        """
        stored = self._robots.get(self._db.read(), robot.id) if robot.id else None
        pin = robot.certificate_sha256
        robot = replace(robot, address=Address.parse(robot.address).url, certificate_sha256=normalise_fingerprint(pin) if pin else None,
                        serial_number=robot.serial_number or (stored.serial_number if stored else None))
        token = token_for(robot, password, stored)
        if token is None:
            raise InvalidInput("password", "enter the password: the stored one belongs to another user, address, certificate or robot")
        known_by = (stored.identified_by if stored else None) or IdentifiedBy.SERIAL_NUMBER
        identified_by = IdentifiedBy.ADDRESS if by_address else known_by
        with closing(self._make_client(replace(robot, token=token, identified_by=identified_by))) as client:
            return client.identify()

    def presented_fingerprint(self, address: str) -> str:
        """SHA-256 of the certificate at an https address, for a person to compare; sends no request. Raises InvalidInput or RobotError."""
        return presented_fingerprint(Address.parse(address))

    def fetch_missions(self, robot_id: int) -> list[MissionInfo]:
        """The missions that the robot has, by name."""
        with self._client(robot_id) as client:
            return sorted(client.missions(), key=lambda mission: mission.name.casefold())

    # ------------------------------------------------------------------ inside
    @contextmanager
    def _client(self, robot_id: int, command: str = "") -> Iterator[RobotClient]:
        """A connection of its own. A ``command`` that the robot has taken on it is noted."""
        robot = self._robot(robot_id)
        with closing(self._make_client(robot)) as client:
            yield client
        if command:
            log.info("robot %r: %s", robot.name, command)

    def _robot(self, robot_id: int) -> Robot:
        if robot := self._robots.get(self._db.read(), robot_id):
            return robot
        raise InvalidInput("robot", "this robot has been removed")

    def _mission(self, mission_id: int) -> Mission:
        if mission := self._missions.get(self._db.read(), mission_id):
            return mission
        raise InvalidInput("mission", "this mission has been removed")
