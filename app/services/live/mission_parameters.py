"""What missions ask for when they are queued, as robots have said it, and what follows for the values that are entered.

It is kept in the database, as a robot may be silent when it is needed. Somebody may edit a mission on the robot afterwards: so a robot is
asked again before anything is refused, where it can be, and no start is refused by what is only remembered.
"""
from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import replace
from typing import Any, NamedTuple

from app.database.connection import Database
from app.database.errors import DatabaseError
from app.database.mission_parameters import MissionParameterRepository
from app.domain.clock import Clock
from app.domain.models import Connection, Execution, InvalidInput, Reason, ReasonCode, Robot
from app.domain.parameters import values_for
from app.domain.robot import ENTRIES, MapPosition, MissionParameter
from app.mir.client import RobotClient
from app.mir.errors import Refusal, Rejected, RobotError, RobotFault, Unreadable
from app.services.live.snapshots import Snapshots

log = logging.getLogger(__name__)

HOLDS_FOR = 300.0            # s for which a screen does not ask again; an integrator may edit the mission
ANSWERED_WITHIN = 10.0       # s for all robots that are asked before something is saved
ASKED_TOGETHER = 16          # robots

Said = dict[tuple[int, str], Sequence[MissionParameter]]             # by robot and guid


class _Kept(NamedTuple):
    """``at`` on the monotonic clock; ``parameters`` None: the robot was asked and does not say, or it never was (``at`` −∞)."""
    at: float
    parameters: Sequence[MissionParameter] | None


class MissionParameters:
    def __init__(self, db: Database, clock: Clock, make_client: Callable[[Robot], RobotClient], snapshots: Snapshots) -> None:
        self._db, self._clock, self._make_client, self._snapshots = db, clock, make_client, snapshots
        self._stored = MissionParameterRepository()
        self._lock = threading.Lock()
        self._kept: dict[tuple[int, str], _Kept] = {}

    # ------------------------------------------------------------------ what is known
    def _of(self, robot_id: int, guid: str) -> _Kept:
        with self._lock:
            kept = self._kept.get((robot_id, guid))
        if kept is None:
            kept = _Kept(-math.inf, self._stored.get(self._db.read(), robot_id, guid))
            with self._lock:
                kept = self._kept.setdefault((robot_id, guid), kept)
        return kept

    def known(self, robot_id: int, guid: str) -> Sequence[MissionParameter] | None:
        """As the robot has said, however long ago; None: it has not."""
        return self._of(robot_id, guid).parameters

    def known_of_any(self, guid: str) -> Sequence[MissionParameter] | None:
        """As any robot has said, but for the positions, which each robot has its own of."""
        found = self._stored.of_any(self._db.read(), guid)
        return found and tuple(replace(each, choices=(), elsewhere=()) if each.is_position else each for each in found)

    def lately(self, robot_id: int, guid: str) -> Sequence[MissionParameter] | None:
        """As the robot has said within the last minutes."""
        kept = self._of(robot_id, guid)
        return kept.parameters if self._clock.monotonic() - kept.at < HOLDS_FOR else None

    def was_asked(self, robot_id: int, guid: str) -> bool:
        """Whether there is nothing to ask for: the robot has said it, or was asked since the app began and does not say."""
        kept = self._of(robot_id, guid)
        return kept.parameters is not None or math.isfinite(kept.at)

    def values(self, robot_id: int, guid: str, mission: str, given: Mapping[str, Any]) -> Mapping[str, Any] | None:
        """What is sent to that robot: positions by their guid, choices by their value. As it was ``given`` where the robot does not say
        what the mission asks for; None: it has not been asked. Raises InvalidInput for what it would not take."""
        if not self.was_asked(robot_id, guid):
            return None
        known = self.known(robot_id, guid)
        return dict(given) if known is None else values_for(mission, known, given)

    # ------------------------------------------------------------------ asking
    def learn(self, robot_id: int, guid: str, client: RobotClient) -> Sequence[MissionParameter] | None:
        """Ask the robot. None: it does not say. Raises RobotError, Rejected with status 404 where it has no such mission."""
        found = _asked(client, guid)
        self.keep({(robot_id, guid): found})
        return found

    def learn_for(self, start: Execution, robot_id: int, client: RobotClient) -> Reason | None:
        """Ask the robot for what a start has to be given that is to be sent to it now: why it would refuse that. A robot that does not say
        it is left to judge for itself. Raises RobotError where it can't be asked."""
        try:
            self.learn(robot_id, start.mission_guid, client)
            self.values(robot_id, start.mission_guid, start.mission, start.parameters)
        except InvalidInput as problem:
            return Reason(ReasonCode.REFUSED, {"problem": problem.message})
        except (Rejected, RobotFault, Unreadable):
            self.keep({(robot_id, start.mission_guid): None})
        return None

    def may_send(self, start: Execution, robot_id: int, guid: str) -> bool:
        """Whether a start can be sent to this robot without asking it first."""
        try:
            return not start.parameters or self.values(robot_id, guid, start.mission, start.parameters) is not None
        except InvalidInput:
            return False

    def to_send(self, start: Execution, robot_id: int) -> Mapping[str, Any]:
        """What a start gives its mission there; as it was entered where the robot has changed its mind since that was judged."""
        given = dict(start.parameters)
        if given:
            with suppress(InvalidInput):
                return self.values(robot_id, start.mission_guid, start.mission, given) or given
        return given

    def keep(self, said: Mapping[tuple[int, str], Sequence[MissionParameter] | None]) -> None:
        """What robots have just said; None: one was asked and does not say."""
        now = self._clock.monotonic()
        new = {key: found for key, found in said.items() if found is not None and found != self._of(*key).parameters}
        with self._lock:
            self._kept |= {key: _Kept(now, found) for key, found in said.items()}
        if new:
            try:
                self._db.write(lambda c: self._stored.put(c, new), patient=True)
            except DatabaseError as problem:                 # it is asked again when it is needed
                log.info("What a mission asks for could not be stored: %s", problem)

    def ask(self, wanted: Sequence[tuple[Robot, Sequence[str]]], within: float = ANSWERED_WITHIN) -> Said:
        """What these robots say of missions (guids), many at a time, and nothing of those that don't answer ``within`` so many seconds. One
        that is silent, or is known to be, is not asked further. Keeps nothing: they need not be configured yet."""
        said, end = Said(), time.monotonic() + within
        left = [(robot, guids) for robot, guids in wanted if self._may_answer(robot)]

        def work() -> None:
            while left:
                with suppress(IndexError):                   # another one was quicker
                    self._ask_robot(*left.pop(0), said, end)

        threads = [threading.Thread(target=work, name="mission parameters", daemon=True) for _ in range(min(ASKED_TOGETHER, len(left)))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(max(0.0, end - time.monotonic()))
        return dict(said)

    def _may_answer(self, robot: Robot) -> bool:
        may = (Connection.UNKNOWN, Connection.CONNECTED, Connection.SLOW)
        return robot.enabled and not robot.needs_password and self._snapshots.get(robot.id).connection in may

    def _ask_robot(self, robot: Robot, guids: Sequence[str], said: Said, end: float) -> None:
        try:
            with closing(self._make_client(robot)) as client:
                for guid in guids:
                    if time.monotonic() > end:
                        return
                    with suppress(Rejected, RobotFault, Unreadable):         # it lacks the mission, or does not say what it asks for
                        if (found := _asked(client, guid)) is not None:
                            said[robot.id, guid] = found
        except (RobotError, InvalidInput) as error:
            log.info("What missions ask for was not said by %r: %s", robot.name, error)


def _asked(client: RobotClient, guid: str) -> Sequence[MissionParameter] | None:
    found = client.parameters(guid)
    if found is None or not any(parameter.is_position for parameter in found):
        return found and tuple(found)
    map_id = client.status().map_id
    here = _named(client.positions(map_id)) if map_id else ()
    try:
        everywhere = _named(client.positions())
    except Refusal:
        everywhere = here
    return tuple(_with_positions(parameter, here or everywhere, everywhere) for parameter in found)


def _named(positions: Iterable[MapPosition]) -> tuple[tuple[str, str], ...]:
    """Guid and name of where the robot can be sent, by name."""
    named = {position.guid: position.name for position in positions if position.name and position.type_id not in ENTRIES}
    return tuple(sorted(named.items(), key=lambda entry: entry[1].casefold()))


def _with_positions(parameter: MissionParameter, here: tuple[tuple[str, str], ...], everywhere: tuple[tuple[str, str], ...]
                    ) -> MissionParameter:
    """A default on another map is none."""
    if not parameter.is_position:
        return parameter
    choices = parameter.choices or here
    on_this_map = replace(parameter, choices=choices)
    default = on_this_map.value_of(parameter.default) if here else parameter.default
    return replace(on_this_map, default=default, elsewhere=tuple(entry for entry in everywhere if entry not in choices))
