"""The stored data of a robot or a classic fleet, which have the same paths for it: missions, what they ask for, maps,
positions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar
from urllib.parse import quote

from app.domain.message import message
from app.domain.robot import MapPosition, MissionActions, MissionDetail, MissionInfo, MissionParameter, RobotMap
from app.mir import parameters as mission_parameters
from app.mir import parse
from app.mir.errors import Refusal
from app.mir.mission_queue import UNSUPPORTED
from app.mir.rest import LARGEST_OBJECT, RestRequests
from app.mir.transport import API, Response

MOST_MISSIONS = 2000  # sites have tens to hundreds
LARGEST_MISSIONS = 1024 * 1024  # bytes of their list, three times the need of this number

T = TypeVar("T")


class StoredData(RestRequests):
    # ------------------------------------------------------------------ missions
    def missions(self) -> list[MissionInfo]:
        """All missions of the site that the robot has. Raises Unreadable for more than MOST_MISSIONS."""
        return self._get(
            "/missions",
            lambda found: parse.listed(found, message("the mission list"), parse.mission_info, MOST_MISSIONS),
            largest=LARGEST_MISSIONS,
        )

    def mission(self, guid: str) -> MissionDetail:
        """Raises Rejected with status 404 when the robot has no such mission."""
        return self._get(f"/missions/{_segment(guid)}", parse.mission_detail)

    def parameters(self, guid: str) -> list[MissionParameter] | None:
        """Parameters required when this mission is queued; [] for most missions. None: the robot does not say. Raises
        Rejected with status 404 when it has no such mission."""
        mission = self.mission(guid)
        if mission.has_user_parameters is False:
            return []
        own = f"{API}/missions/{_segment(guid)}"
        defined, of_actions = (
            self._parameters(url, read)
            for url, read in (
                (mission.definition_url or f"{own}/definition", mission_parameters.from_definition),
                (mission.actions_url or f"{own}/actions", mission_parameters.from_actions),
            )
        )
        found = mission_parameters.with_meaning(defined or (), of_actions or ())
        return found or (None if mission.has_user_parameters or of_actions is None else [])

    def actions(self, guid: str) -> MissionActions:
        """Facts from the mission's actions."""
        url = self.mission(guid).actions_url or f"{API}/missions/{_segment(guid)}/actions"
        return self._get(url.removeprefix(API), mission_parameters.actions, largest=None)

    def _parameters(self, url: str, read: Callable[[Any], list[MissionParameter]]) -> list[MissionParameter] | None:
        try:
            return self._get(url.removeprefix(API), read, largest=None)
        except Refusal as error:
            if error.status not in UNSUPPORTED:
                raise
            return None

    def map(self, map_id: str) -> RobotMap:
        """Picture and scale of a map; ``RobotStatus.map_id`` is the current one."""
        return self._get(f"/maps/{_segment(map_id)}", parse.robot_map, largest=None)

    def positions(self, map_id: str | None = None) -> list[MapPosition]:
        """Named places, of one map or of all. With coordinates if the robot supports the whitelist."""
        path = f"/maps/{_segment(map_id)}/positions" if map_id else "/positions"
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
        return self._get(f"/positions/{_segment(guid)}", parse.position)

    # ------------------------------------------------------------------ requests
    def _request(self, method: str, path: str, *, query: Mapping[str, str] | None = None, json: Any = None) -> Response:
        """With credentials, to the machine that is known. Raises RobotError."""
        raise NotImplementedError

    def _get(
        self,
        path: str,
        read: Callable[[Any], T],
        query: Mapping[str, str] | None = None,
        *,
        largest: int | None = LARGEST_OBJECT,
    ) -> T:
        return self._read(self._request("GET", path, query=query), read, largest)


def _segment(identifier: str) -> str:
    """One segment of a path."""
    return quote(identifier, safe="", errors="replace")
