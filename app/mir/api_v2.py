"""What robots and classic fleets have in common, by the same paths: missions, what they ask for, maps, positions; and
orders with numbers, in a list that keeps those that have ended."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from datetime import datetime
from typing import Any

from app.domain.check_up import NOTHING_KNOWN, RobotProfile
from app.domain.message import message
from app.domain.robot import (
    MapPosition,
    MissionActions,
    MissionInfo,
    MissionParameter,
    QueueItem,
    RobotMap,
)
from app.mir import parameters as mission_parameters
from app.mir import parse
from app.mir.address import Address
from app.mir.credentials import Token
from app.mir.errors import NotAMir, Refusal, Unnumbered, Unreadable
from app.mir.mission_queue import UNSUPPORTED, QueueReader
from app.mir.rest import RestRequests, segment
from app.mir.robot_vocabulary import in_mir_words
from app.mir.target import Target
from app.mir.transport import Response

MOST_MISSIONS = 2000  # sites have tens to hundreds
LARGEST_MISSIONS = 1024 * 1024  # bytes of their list, three times the need of this number


class ApiV2(RestRequests, Target):
    queue_path = "/mission_queue"

    def __init__(self, address: Address, token: Token, **options: Any) -> None:
        self._words = self._words_of(NOTHING_KNOWN)
        self._queue = QueueReader(self._entries, self._next_item, self.queue_path, self._words)
        super().__init__(address, token, **options)

    def _apply_profile(self) -> None:
        super()._apply_profile()
        self._words = self._words_of(self._profile)
        self._queue.use_profile(self._words)

    def _words_of(self, profile: RobotProfile) -> RobotProfile:
        """With the words that are known without a check-up."""
        return profile

    # ------------------------------------------------------------------ missions
    def missions(self) -> list[MissionInfo]:
        """All missions of the site that the robot has. Raises Unreadable for more than MOST_MISSIONS."""
        return self._get(
            "/missions",
            lambda found: parse.listed(found, message("the mission list"), parse.mission_info, MOST_MISSIONS),
            largest=LARGEST_MISSIONS,
        )

    def mission(self, guid: str) -> parse.Object:
        """Raises Rejected with status 404 when the robot has no such mission."""
        return self._get(f"/missions/{segment(guid)}", parse.mission)

    def parameters(self, guid: str) -> list[MissionParameter] | None:
        """Parameters required when this mission is queued; [] for most missions. None: the robot does not say. Raises
        Rejected with status 404 when it has no such mission."""
        mission = self.mission(guid)
        asks = mission.get("has_user_parameters")
        if asks is False:
            return []
        defined, of_actions = (
            self._parameters(_path_of(mission, guid, what), read)
            for what, read in (
                ("definition", mission_parameters.from_definition),
                ("actions", mission_parameters.from_actions),
            )
        )
        found = mission_parameters.with_meaning(defined or (), of_actions or ())
        return found or (None if asks is True or of_actions is None else [])

    def actions(self, guid: str) -> MissionActions:
        """Facts from the mission's actions."""
        path = _path_of(self.mission(guid), guid, "actions")
        return self._get(path, mission_parameters.actions, largest=None)

    def _parameters(self, path: str, read: Callable[[Any], list[MissionParameter]]) -> list[MissionParameter] | None:
        try:
            return self._get(path, read, largest=None)
        except Refusal as error:
            if error.status not in UNSUPPORTED:
                raise
            return None

    def map(self, map_id: str) -> RobotMap:
        """Picture and scale of a map; ``RobotStatus.map_id`` is the current one."""
        return self._get(f"/maps/{segment(map_id)}", parse.robot_map, largest=None)

    def positions(self, map_id: str | None = None) -> list[MapPosition]:
        """Named places, of one map or of all. With coordinates if the robot supports the whitelist."""
        path = f"/maps/{segment(map_id)}/positions" if map_id else "/positions"
        return self._get(
            path,
            lambda found: parse.listed(
                found, message("the list of positions"), lambda entry: parse.map_position(entry, map_id)
            ),
            {"whitelist": "all"},
            largest=None,
        )

    def position(self, guid: str) -> MapPosition:
        """With its coordinates. Raises Rejected with status 404 when the robot has no such position."""
        return self._get(f"/positions/{segment(guid)}", parse.position)

    # ------------------------------------------------------------------ orders
    def note_sent(self, token: str, mission_guid: str, ago: float, date: datetime) -> None:
        """Needs nothing: its orders are numbered."""

    def ended_shown_for(self, enough: float) -> float:
        """Its list has all."""
        return math.inf

    def _number_of_new(self, answer: Response) -> int:
        """Only 201, or the robot's known status, counts as accepted; without an integer id it raises Unnumbered."""
        if answer.status not in (201, self._profile.order_status):
            problem = message("status {status} instead of 201", status=answer.status)
            raise Unreadable(problem=problem, address=self.address.netloc)
        try:
            return self._read(answer, parse.queue_id)
        except (Unreadable, NotAMir):
            raise Unnumbered(address=self.address.netloc) from None

    def _entries(self, method: str, path: str, query: Mapping[str, str], json: Any) -> list[parse.Object]:
        self.on_pause()
        answer = self._request(method, path, query=query, json=json)
        entries = self._read(answer, lambda found: parse.objects(found, message("the mission queue")), None)
        return [self._in_mir_words(entry) for entry in entries]

    def _next_item(self, queue_id: int) -> QueueItem:
        self.on_pause()
        return self.queue_item(queue_id)

    def _in_mir_words(self, item: Any) -> Any:
        return in_mir_words(item, self._words)


def _path_of(mission: parse.Object, guid: str, what: str) -> str:
    """Where the mission says that its actions or its definition are, or else where they usually are."""
    return parse.own_path(mission.get(what)) or f"/missions/{segment(guid)}/{what}"
