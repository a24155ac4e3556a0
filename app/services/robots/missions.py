"""The missions as the robot itself knows them: their names, also of those not entered here, and the parameters they ask
for.

Everything except ``names`` talks to the robot and belongs on a background thread. Results are kept until the next
reading.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing

from app.domain.clock import Clock
from app.domain.models import InvalidInput, Mission, Robot, existing
from app.domain.robot import MissionParameter
from app.mir.errors import RobotError
from app.mir.target import Target
from app.services.live.mission_parameters import MissionParameters

ASK_AGAIN_AFTER = 60.0  # s between two questions for names that the robot may not have either
NAMES_VALID_FOR = 3600.0  # s for which a robot whose list lacks a mission is not chosen to start it
NOTHING: tuple[float, Mapping[str, str]] = -math.inf, {}


class RobotMissions:
    """``robot`` finds a configured robot by id; ``make_client`` connects to it."""

    def __init__(
        self,
        robot: Callable[[int], Robot | None],
        make_client: Callable[[Robot], Target],
        clock: Clock,
        parameters: MissionParameters,
    ) -> None:
        self._robot, self._make_client, self._clock, self._parameters = robot, make_client, clock, parameters
        self._lock = threading.Lock()
        self._asked_at: dict[int, float] = {}
        self._learned: dict[int, tuple[float, Mapping[str, str]]] = {}  # when, and guid -> name

    def names(self, robot_id: int) -> Mapping[str, str]:
        """Guid -> name, as far as known."""
        return self._learned.get(robot_id, NOTHING)[1]

    def lacks(self, robot_id: int, guid: str) -> bool:
        """Whether the robot's list, read within the hour, does not have it."""
        at, names = self._learned.get(robot_id, NOTHING)
        return bool(names) and guid not in names and self._clock.monotonic() - at < NAMES_VALID_FOR

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
        before = self._learned.get(robot_id)
        self._learned[robot_id] = self._clock.monotonic(), found
        return before is None or found != before[1]

    def parameters(self, robot_id: int, guid: str) -> Sequence[MissionParameter]:
        """What has to be given when this mission is queued. Raises RobotError, or InvalidInput when the robot has been removed."""
        if (lately := self._parameters.recent(robot_id, guid)) is not None:
            return lately
        with self._client(robot_id) as client:
            return self._parameters.learn(robot_id, guid, client) or ()

    def offered(self, robot_id: int, missions: Iterable[Mission]) -> list[Mission]:
        """Those that the robot has, in their order; all if its list has not been read."""
        names = self.names(robot_id)
        return [mission for mission in missions if not names or mission.guid in names]

    def _client(self, robot_id: int) -> closing[Target]:
        robot = existing(self._robot(robot_id), "robot", "this robot has been removed")
        return closing(self._make_client(robot))
