"""The missions as the robot itself knows them: their names, also of those not entered here, and the parameters they ask for.

Everything but ``names`` talks to the robot and belongs on a background thread. What was read is kept until it is read again.
"""
from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager

from app.domain.clock import Clock
from app.domain.models import InvalidInput, Robot
from app.domain.robot import MissionParameter
from app.mir.client import RobotClient
from app.mir.errors import RobotError

ASK_AGAIN_AFTER = 60.0       # s between two questions for names that the robot may not have either
PARAMETERS_HOLD = 300.0      # s for which a mission's parameters are kept; an integrator may edit the mission meanwhile


class RobotMissions:
    """``robot`` finds a configured robot by id; ``make_client`` connects to it."""

    def __init__(self, robot: Callable[[int], Robot | None], make_client: Callable[[Robot], RobotClient], clock: Clock) -> None:
        self._robot, self._make_client, self._clock = robot, make_client, clock
        self._lock = threading.Lock()
        self._names: dict[int, dict[str, str]] = {}
        self._asked_at: dict[int, float] = {}
        self._parameters: dict[tuple[int, str], tuple[float, Sequence[MissionParameter]]] = {}

    def names(self, robot_id: int) -> Mapping[str, str]:
        """Guid -> name, as far as known."""
        with self._lock:
            return self._names.get(robot_id, {})           # replaced as a whole, never changed

    def learn_names(self, robot_id: int) -> bool:
        """Ask the robot; whether that brought something new. One asked within the last minute, or that doesn't answer, brings nothing."""
        now = self._clock.monotonic()
        with self._lock:
            if now - self._asked_at.get(robot_id, now - ASK_AGAIN_AFTER) < ASK_AGAIN_AFTER:
                return False
            self._asked_at[robot_id] = now
        try:
            with self._client(robot_id) as client:
                found = {mission.guid: mission.name for mission in client.missions()}
        except (RobotError, InvalidInput):
            return False
        with self._lock:
            before, self._names[robot_id] = self._names.get(robot_id), found
        return found != before

    def parameters(self, robot_id: int, guid: str) -> Sequence[MissionParameter]:
        """What has to be given when this mission is queued. Raises RobotError, or InvalidInput when the robot has been removed."""
        with self._lock:
            learnt_at, known = self._parameters.get((robot_id, guid), (0.0, None))
        now = self._clock.monotonic()
        if known is not None and now - learnt_at < PARAMETERS_HOLD:
            return known
        with self._client(robot_id) as client:
            found = tuple(client.parameters(guid))
        with self._lock:
            self._parameters[robot_id, guid] = now, found
        return found

    @contextmanager
    def _client(self, robot_id: int) -> Iterator[RobotClient]:
        robot = self._robot(robot_id)
        if robot is None:
            raise InvalidInput("robot", "this robot has been removed")
        client = self._make_client(robot)
        try:
            yield client
        finally:
            client.close()
