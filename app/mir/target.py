"""What the app asks of whatever takes its missions: one robot, or a robot of a fleet through that fleet.

A target is used by one thread at a time. Every call raises only RobotError; ``error.delivery`` says what a failed one
may have done. Calls that change something are never repeated by a target.

``token``, ``tokens``: what the app's own orders were sent with. A target whose orders have ids that the app chose
(``FindBy.ID``) needs them to ask for an order; the others ignore them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from datetime import datetime
from typing import Any, Protocol

from app.domain.capabilities import Capabilities
from app.domain.check_up import RobotProfile
from app.domain.robot import (
    IdentifiedBy,
    Identity,
    MapPosition,
    MissionActions,
    MissionInfo,
    MissionParameter,
    QueueItem,
    RobotMap,
    RobotState,
    RobotStatus,
)
from app.mir.transport import Timeouts

Known = dict[int, QueueItem | None]


class Target(Protocol):
    """``serial_number``, ``identified_by``: as known so far, see ``VerifiedRequests``. ``on_pause`` is called between
    the requests of a long read."""

    serial_number: str | None
    identified_by: IdentifiedBy | None
    timeouts: Timeouts
    on_pause: Callable[[], None]

    @property
    def capabilities(self) -> Capabilities:
        """As known now; a check-up and the software's version may change them."""

    def use_profile(self, profile: RobotProfile | None) -> None:
        """The check-up's profile of the robot in its present state; None: none."""

    def close(self) -> None:
        """Close the connections; a later call opens new ones."""

    # ------------------------------------------------------------------ who it is
    def status(self) -> RobotStatus:
        """The robot's status. Raises AnotherRobot if another robot answers than the known one."""

    def identify(self) -> Identity:
        """Status and user, to detect wrong credentials (Unauthorized)."""

    # ------------------------------------------------------------------ missions
    def missions(self) -> list[MissionInfo]:
        """All missions that it has."""

    def mission(self, guid: str) -> object:
        """Raises Rejected with status 404 when it has no such mission."""

    def parameters(self, guid: str) -> list[MissionParameter] | None:
        """What has to be given when this mission is ordered; None: it does not say."""

    def actions(self, guid: str) -> MissionActions:
        """Facts from the mission's actions."""

    # ------------------------------------------------------------------ orders
    def enqueue(
        self,
        mission_guid: str,
        *,
        description: str = "",
        text: str = "",
        priority: int = 0,
        parameters: Mapping[str, Any] | None = None,
        is_wanted: Callable[[], bool] = lambda: True,
    ) -> int:
        """Order a mission with the token ``description``; returns the order's id. Raises NotWanted, with nothing sent,
        if ``is_wanted`` says no once the connection is open, Unnumbered if it was taken without an id."""

    def queue_item(self, queue_id: int, token: str = "") -> QueueItem:
        """Raises Rejected with status 404 when there is no such order (any more)."""

    def note_sent(self, token: str, mission_guid: str, ago: float, date: datetime) -> None:
        """An earlier run of the app has sent this order, so many seconds ago by the tablet, after ``date`` by the fleet: needed by
        a target that does not show tokens of those that have ended."""

    def ended_shown_for(self, enough: float) -> float:
        """Seconds for which it shows an order that has ended, at least, as far as can be seen now; ``enough`` of them
        end the search."""

    def open_items(self) -> list[QueueItem]:
        """Everything of this robot that is pending or executing, of the app and of others, by ascending id."""

    def items_after(
        self, id_floor: int, known: Known | None = None, highest: int = 0, tokens: Collection[str] = ()
    ) -> list[QueueItem]:
        """Every order with a higher id, by ascending id, or raises, as a missing one is a reason to send again.
        ``tokens``: those that are looked for; all that a target with ``FindBy.ID`` has to find. ``known`` and
        ``highest``: see ``RobotClient``."""

    def highest_queue_id(self) -> int | None:
        """Of all orders; where ids don't grow, the time by the fleet's own clock, in seconds. None: there are none, or it is
        not known."""

    def newest_id(self, token: str = "") -> int | None:
        """Of the orders of this robot; another one shows that it was used. ``token``: of the last one that it took from
        the app. None: not known."""

    def cancel(self, queue_id: int, token: str = "") -> None:
        """Cancel one order."""

    def clear_queue(self, own: Mapping[int, str] | None = None) -> None:
        """Cancel everything on a robot, of the app and of others; on a fleet only the app's ``own`` orders, by their
        ids and tokens."""

    # ------------------------------------------------------------------ the robot
    def set_state(self, state: RobotState) -> RobotStatus | None:
        """READY: continue; PAUSE: pause."""

    def clear_error(self) -> RobotStatus | None:
        """Clear resettable errors. The robot does not move."""

    def answer_prompt(self, guid: str, answer: str) -> RobotStatus | None:
        """Answer the question with this guid (``RobotStatus.user_prompt``)."""

    def map(self, map_id: str) -> RobotMap:
        """Picture and scale of a map."""

    def positions(self, map_id: str | None = None) -> list[MapPosition]:
        """Named places, of one map or of all."""

    def position(self, guid: str) -> MapPosition:
        """Raises Rejected with status 404 when there is no such position."""
