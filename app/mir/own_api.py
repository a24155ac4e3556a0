"""A fleet's robot by the robot's own API, for what a classic fleet can't do: pause and resume it, clear its errors, and
say why a mission failed."""

from __future__ import annotations

from app.domain.message import message
from app.domain.robot import RobotState, RobotStatus
from app.mir import parse
from app.mir.client import RobotClient
from app.mir.errors import RobotError
from app.mir.texts import resolve
from app.mir.transport import Timeouts

OF_ITS_OWN = Timeouts(connect=1.5, read=3.0, total=5.0)  # it may be on a network that only the fleet reaches
NEWEST = 50  # items of its queue that are searched for an order


class OwnApi:
    """``robot`` is used up: each call closes its connections."""

    def __init__(self, robot: RobotClient) -> None:
        self._robot, robot.timeouts = robot, OF_ITS_OWN

    def is_reached(self) -> bool:
        """Whether it answers, and accepts the fleet's user."""
        try:
            self._robot.identify()
        except RobotError:
            return False
        finally:
            self._robot.close()
        return True

    def set_state(self, state: RobotState) -> RobotStatus | None:
        try:
            return self._robot.set_state(state)
        finally:
            self._robot.close()

    def clear_error(self) -> RobotStatus | None:
        try:
            return self._robot.clear_error()
        finally:
            self._robot.close()

    def message_of(self, guid: str) -> str:
        """What it says about the fleet's order with this guid; "" if it can't be asked."""
        newest = {"whitelist": "all", "sort_by": "id,desc", "limit": str(NEWEST)}
        try:
            answer = self._robot.ask("GET", "/mission_queue", query=newest)
            items = parse.objects(parse.loads(answer.body), message("the mission queue"))
        except RobotError:
            return ""
        finally:
            self._robot.close()
        found = (item.get("message") for item in items if item.get("fleet_schedule_guid") == guid)
        return resolve(next(found, ""))
