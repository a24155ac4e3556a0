"""A person's commands: Run now, Pause and Resume, Reset errors, Clear queue, cancel, answer a prompt, test a
connection.

Called on background threads, never on the UI's; every call uses its own connection to the robot, so it doesn't wait
behind a poll. Problems with the robot are raised as RobotError with one sentence.
"""

from __future__ import annotations

import logging
import uuid
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from app.database.connection import Database
from app.database.groups import GroupRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.domain import rules
from app.domain.clock import Clock
from app.domain.execution import Execution, Reason, ReasonCode, State, Trigger
from app.domain.models import Group, HandOver, InvalidInput, Mission, Robot, Settings, existing
from app.domain.robot import IdentifiedBy, Identity, MissionInfo, RobotState
from app.mir.address import Address
from app.mir.credentials import normalised, with_token
from app.mir.errors import Delivery, RobotError
from app.mir.http import presented_fingerprint
from app.mir.target import Target
from app.services.allocation.situation import HIGH
from app.services.catalogue import checks
from app.services.catalogue.parameter_check import Checked, check
from app.services.dispatch.engine import Engine
from app.services.dispatch.ledger import Ledger
from app.services.executions import transitions
from app.services.live.holds import Clearing, Holds
from app.services.live.mission_parameters import MissionParameters

log = logging.getLogger(__name__)

MOST_LISTED = 20  # starts in one line of the log

EMPTY: Mapping[str, Any] = MappingProxyType({})

ClientFactory = Callable[[Robot], Target]


class Operator:
    def __init__(
        self,
        db: Database,
        *,
        ledger: Ledger,
        clock: Clock,
        engine: Engine,
        holds: Holds,
        clearing: Clearing,
        settings: Callable[[], Settings],
        make_client: ClientFactory,
        parameters: MissionParameters,
        keep_paused: Callable[[int], None],
        answered: Callable[[int, str, str], None],
    ) -> None:
        """``answered`` is called with robot, question (its guid) and answer that the robot has taken."""
        self._db, self._robots, self._missions = db, RobotRepository(), MissionRepository()
        self._ledger, self._clock, self._engine = ledger, clock, engine
        self._settings, self._make_client, self._parameters = settings, make_client, parameters
        self._holds, self._clearing, self._keep_paused = holds, clearing, keep_paused
        self._answered = answered

    # ------------------------------------------------------------------ missions
    def run_now(
        self, robot_id: int, mission_id: int, parameters: Mapping[str, Any] = EMPTY, token: str | None = None
    ) -> Execution:
        """Submit a mission at once, ignoring its constraints. ``token`` is made per press, so a press that arrives
        twice runs once. Raises InvalidInput, also where the data was copied from another tablet: it must not wait here
        until the plan moves to this tablet."""
        robot, mission = self._usable(robot_id), self._mission(mission_id)
        self._check_parameters(mission, parameters, [(robot, mission.guid)])
        return self._start(robot, mission, parameters, token, HIGH if robot.hand_over is HandOver.WHEN_FREE else 0)

    def run_on_any(
        self,
        group_id: int,
        mission_id: int,
        parameters: Mapping[str, Any] = EMPTY,
        token: str | None = None,
    ) -> Execution:
        """The same on the robot of a group that will be done first; before planned starts of lower priority. It waits
        until one is free. Raises InvalidInput."""
        group = self._group(group_id)
        name, c = self._mission(mission_id).name, self._db.read()
        mission = self._missions.by_name(c, name)
        if mission is None:
            raise InvalidInput(
                "mission", "the mission {name} is for one robot only, a group needs one for all robots", name=name
            )
        self._holds.check_is_no_copy()
        members = [
            (robot, own.guid)
            for robot in map(self._robot, group.members)
            if robot.enabled and (own := self._missions.for_robot(c, name, robot.id))
        ]
        self._check_parameters(mission, parameters, members)
        return self._start(group, mission, parameters, token, HIGH)

    def _check_parameters(
        self, mission: Mission, values: Mapping[str, Any], robots: Sequence[tuple[Robot, str]]
    ) -> None:
        """Check the values by these robots' answers about the mission; they are asked if they have not answered, or
        would refuse. Unknown ones are checked when it is sent. Raises InvalidInput."""

        def checked() -> Checked:
            return check(mission.name, values, robots, lambda robot, guid: self._parameters.known(robot.id, guid))

        first = checked()
        if not first.to_ask:
            return
        self._parameters.keep(self._parameters.ask([(robot, [guid]) for robot, guid in first.to_ask]))
        if (problem := checked().problem) is not None:
            raise problem

    def run_again(self, execution_id: int, token: str | None = None) -> Execution:
        """The mission of a run with its parameters, at once, on the same robot or on any of the same group. Raises InvalidInput."""
        row, c = self._ledger.get(execution_id), self._db.read()
        if row is None:
            raise InvalidInput("execution", "this run is no longer in the history")
        of_robot = self._missions.with_guid(c, row.mission_guid, row.robot_id or 0)
        mission = of_robot if row.group_id is None else self._missions.by_name(c, row.mission)
        if mission is None:
            raise InvalidInput(
                "mission", "{robot} has no mission {mission}", robot=row.robot_group or row.robot, mission=row.mission
            )
        run = self.run_now if row.group_id is None else self.run_on_any
        return run(row.group_id or row.robot_id or 0, mission.id, row.parameters, token)

    def assign_robot(self, execution_id: int, robot_id: int) -> Execution:
        """Assign this robot to a start that waits for one of its group; into its queue if it is busy. Raises
        InvalidInput."""
        row, robot, c = self._ledger.get(execution_id), self._usable(robot_id), self._db.read()
        if (
            row is None
            or row.group_id is None
            or row.state is not State.WAITING
            or row.robot_id is not None
            or row.held
            or (self._clearing.blocks(row))
        ):
            raise InvalidInput("robot", "it no longer waits for a robot")
        if robot_id not in self._group(row.group_id).members:
            raise InvalidInput("robot", "{robot} is no robot of {group}", robot=robot.name, group=row.robot_group)
        if self._holds.active(robot_id):
            raise InvalidInput("robot", "{robot} is on hold", robot=robot.name)
        if (full := self._ledger.full_place(row)) is not None:
            raise InvalidInput("robot", "{place} is full: {robot} uses it", place=full.name, robot=full.robot)
        mission = self._missions.for_robot(c, row.mission, robot_id)
        if mission is None:
            raise InvalidInput("mission", "{robot} has no mission {mission}", robot=robot.name, mission=row.mission)
        choice = {"by": "person", "robots": [{"robot": robot.name}]}
        assigned = transitions.assign(row, robot, mission.guid, choice, self._clock.now(), into_queue=True)
        if written := self._ledger.apply([assigned]):
            return written[0]
        raise InvalidInput("robot", "it has just been assigned to a robot, or changed")

    def prioritise(self, execution_id: int, priority: int) -> Execution:
        """A start that waits for a robot of its group gets another priority. Raises InvalidInput."""
        row = self._ledger.get(execution_id)
        if (
            row is not None
            and row.group_id is not None
            and row.robot_id is None
            and (changed := self._ledger.apply([transitions.redefine(row, priority=priority)]))
        ):
            return changed[0]
        raise InvalidInput("priority", "it no longer waits for a robot")

    def start_on_another(self, execution_id: int, robot_id: int | None = None, token: str | None = None) -> Execution:
        """Run the mission of a start that a robot may or may not have now on another robot (None: any other of its
        group). It is a separate start: if the first robot has the old one after all, both run; otherwise the old one is
        not sent again, or replaced twice. Raises InvalidInput."""
        row = self._ledger.get(execution_id)
        if row is None or row.robot_id is None:
            raise InvalidInput("robot", "its outcome is known already")
        if robot_id == row.robot_id:
            raise InvalidInput("robot", "choose another robot than {robot}", robot=row.robot)
        if robot_id is None and row.group_id is None:
            raise InvalidInput("robot", "choose a robot")
        self._holds.check_is_no_copy()
        target = self._group(row.group_id or 0) if robot_id is None else self._usable(robot_id)
        mission = self._missions.for_robot(self._db.read(), row.mission, robot_id or row.robot_id)
        if mission is None:
            raise InvalidInput("mission", "{robot} has no mission {mission}", robot=target.name, mission=row.mission)
        barred = {str(row.robot_id): rules.excluded_robot(row.robot, self._clock.now())} if robot_id is None else {}
        return self._start(target, mission, row.parameters, token, max(HIGH, row.priority), barred, instead_of=row)

    def _start(
        self,
        target: Robot | Group,
        mission: Mission,
        parameters: Mapping[str, Any],
        token: str | None,
        priority: int = 0,
        tried: Mapping[str, Any] = EMPTY,
        instead_of: Execution | None = None,
    ) -> Execution:
        token = token or str(uuid.uuid4())
        row = rules.one_off(
            Trigger.MANUAL,
            target,
            mission,
            self._settings(),
            self._clock.now(),
            token,
            parameters=checks.parameters(parameters),
            priority=priority,
        )
        execution = self._ledger.add(replace(row, tried=dict(tried)), instead_of) or self._ledger.by_token(token)
        assert execution is not None, "it was added, or is there"
        return execution

    def cancel_execution(self, execution_id: int) -> Execution | None:
        """Cancel one of the app's executions, in any state. Returns the row as it is now; the robot's answer may still
        decide: a silent robot is asked until it answers. Raises RobotError when it refuses."""
        execution = self._ledger.get(execution_id)
        if execution is None or not execution.state.is_open:
            return execution
        if execution.state is State.WAITING and (
            ended := self._ledger.apply([transitions.withdraw(execution, Reason(ReasonCode.USER_CANCELLED))])
        ):
            return ended[0]
        if execution.queue_id is None or execution.robot_id is None:
            self._ledger.cancel([execution.id], ReasonCode.USER_CANCELLED)
        else:
            try:
                self.cancel_item(execution.robot_id, execution.queue_id)
            except RobotError as error:
                if error.delivery is Delivery.REFUSED:
                    raise
                log.info("#%d is cancelled as soon as %r answers: %s", execution.id, execution.robot, error.text)
        return self._ledger.get(execution_id)

    def hold_starts(self, execution_ids: Collection[int], held: bool = True) -> int:
        """Hold these while they wait, until they are released; one still held when its start window closes is skipped.
        Returns how many had not been sent yet."""
        waiting = self._ledger.unsent([*execution_ids])
        count = self._ledger.hold(execution_ids, held)
        if count and any(row.held != held for row in waiting):
            names = ", ".join(f"#{row.id} {row.mission!r} on {row.robot!r}" for row in waiting[:MOST_LISTED])
            log.info(
                "%d of %d starts %s: %s%s",
                count,
                len(waiting),
                "kept back" if held else "let go",
                names,
                f" and {len(waiting) - MOST_LISTED} more" if len(waiting) > MOST_LISTED else "",
            )
        return count

    def cancel_item(self, robot_id: int, queue_id: int) -> None:
        """Cancel one item of the robot's queue, also of others. One that has just ended keeps its outcome."""
        ours = [row for row in self._ledger.open_for(robot_id) if row.queue_id == queue_id]
        asked = self._ledger.cancel([row.id for row in ours], ReasonCode.USER_CANCELLED)
        try:
            with self._client(robot_id, f"Cancel of queue item {queue_id}") as client:
                client.cancel(queue_id, ours[0].token if ours else "")
        except RobotError as error:
            if error.delivery is Delivery.REFUSED:
                self._ledger.uncancel(asked)
            raise
        self._engine.poll(robot_id)

    def clear_queue(self, robot_id: int) -> None:
        """Cancel everything pending or executing on the robot, and starts that wait for it here; even if it is unknown
        whether the robot has done it. Nothing is sent to it until then."""
        with self._clearing.of(robot_id) as cleared:
            rows = self._ledger.open_for(robot_id)
            cleared |= {row.id for row in rows}
            try:
                with self._client(robot_id, "Clear queue") as client:
                    client.clear_queue({row.queue_id: row.token for row in rows if row.queue_id is not None})
            except RobotError as error:
                if not error.certainly_without_effect:
                    self._ledger.cancel(cleared, ReasonCode.QUEUE_CLEARED)
                raise
            self._ledger.cancel(cleared, ReasonCode.QUEUE_CLEARED)
        self._engine.poll(robot_id)

    # ------------------------------------------------------------------ the robot
    def pause(self, robot_id: int) -> None:
        self._keep_paused(robot_id)  # a check-up would release it
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
        self._answered(robot_id, guid, answer)
        self._engine.poll(robot_id)

    def _set_state(self, robot_id: int, state: RobotState) -> None:
        with self._client(robot_id, "Pause" if state is RobotState.PAUSE else "Resume") as client:
            client.set_state(state)
        self._engine.poll(robot_id)

    # ------------------------------------------------------------------ the integrator
    def test_connection(self, robot: Robot, password: str | None = None, *, by_address: bool = False) -> Identity:
        """Test the connection to ``robot`` as entered, saved or not. Without a password the token of the saved robot is
        used, if it belongs to that user, address, certificate and serial number. ``by_address``: a person has agreed to
        send credentials to a machine that no longer shows the known serial number. Raises InvalidInput or RobotError,
        such as AnotherRobot and SerialNumberHidden.
        """
        stored = self._robots.get(self._db.read(), robot.id) if robot.id else None
        serial_number = robot.serial_number or (stored.serial_number if stored else None)
        robot = with_token(replace(normalised(robot), serial_number=serial_number), password, stored)
        if robot.needs_password:
            raise InvalidInput(
                "password", "enter the password: the stored one belongs to another user, address, certificate or robot"
            )
        known_by = (stored.identified_by if stored else None) or IdentifiedBy.SERIAL_NUMBER
        identified_by = IdentifiedBy.ADDRESS if by_address else known_by
        with closing(self._make_client(replace(robot, identified_by=identified_by))) as client:
            return client.identify()

    def presented_fingerprint(self, address: str) -> str:
        """SHA-256 of the certificate at an https address, for a person to compare; sends no request. Raises InvalidInput or RobotError."""
        return presented_fingerprint(Address.parse(address))

    def fetch_missions(self, robot_id: int) -> list[MissionInfo]:
        """The missions that people made on the robot, by name."""
        with self._client(robot_id) as client:
            found = [mission for mission in client.missions() if not mission.is_built_in]
        return sorted(found, key=lambda mission: mission.name.casefold())

    # ------------------------------------------------------------------ inside
    @contextmanager
    def _client(self, robot_id: int, command: str = "") -> Iterator[Target]:
        """A connection of its own. A ``command`` that the robot has taken on it is noted."""
        robot = self._robot(robot_id)
        with closing(self._make_client(robot)) as client:
            yield client
        if command:
            log.info("robot %r: %s", robot.name, command)

    def _robot(self, robot_id: int) -> Robot:
        return existing(self._robots.get(self._db.read(), robot_id), "robot", "this robot has been removed")

    def _usable(self, robot_id: int) -> Robot:
        """A robot that may get commands. Raises InvalidInput."""
        robot = self._robot(robot_id)
        if robot.needs_password:
            raise InvalidInput(
                "robot", "{robot} is switched off until its password is entered in Settings", robot=robot.name
            )
        if not robot.enabled:
            raise InvalidInput("robot", "{robot} is switched off in Settings", robot=robot.name)
        self._holds.check_is_no_copy()
        return robot

    def _group(self, group_id: int) -> Group:
        return existing(GroupRepository().get(self._db.read(), group_id), "group", "this group no longer exists")

    def _mission(self, mission_id: int) -> Mission:
        return existing(self._missions.get(self._db.read(), mission_id), "mission", "this mission has been removed")
