"""Answers shaped after those recorded on robots, with invented ids."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.transport import Response

MISSION = "3d7c7c40-ce85-11ef-904a-000e8e9884eb"
MAP = "20f7a3b1-ce85-11ef-904a-000e8e9884eb"

STATUS: dict[str, Any] = {
    "allowed_methods": None,
    "battery_percentage": 93.5,
    "battery_time_remaining": 89725,
    "distance_to_next_target": 0.199,
    "errors": [],
    "footprint": "[[-0.454,0.32],[0.506,0.32],[0.506,-0.32],[-0.454,-0.32]]",
    "joystick_low_speed_mode_enabled": False,
    "joystick_web_session_id": "",
    "map_id": MAP,
    "mission_queue_id": 14026,
    "mission_queue_url": "/v2.0.0/mission_queue/14026",
    "mission_text": "Charging until battery reaches 95% (Current: 94%)...",
    "mode_id": 7,
    "mode_key_state": "idle",
    "mode_text": "Mission",
    "moved": 671648.391,
    "position": {"x": 9.52, "y": 7.156, "orientation": 104.3},
    "robot_model": "MiR100",
    "robot_name": "R1",
    "safety_system_muted": False,
    "serial_number": "200100000000000",
    "session_id": "85e7b6a1-61bb-11ed-9f1f-0001299981c4",
    "state_id": 5,
    "state_text": "Executing",
    "unloaded_map_changes": False,
    "uptime": 3552693,
    "user_prompt": None,
    "velocity": {"linear": 0.0, "angular": 0.0},
}


def item(number: int = 723, state: str = "Executing", **values: Any) -> dict[str, Any]:
    return {
        "actions": f"/v2.0.0/mission_queue/{number}/actions",
        "allowed_methods": ["PUT", "GET", "DELETE"],
        "control_posid": "0",
        "control_state": 0,
        "created_by": "/v2.0.0/users/mirconst-guid-0000-0005-users0000000",
        "created_by_id": "mirconst-guid-0000-0005-users0000000",
        "created_by_name": "Administrator",
        "description": "",
        "finished": None,
        "fleet_schedule_guid": "",
        "id": number,
        "message": "",
        "mission": f"/v2.0.0/missions/{MISSION}",
        "mission_id": MISSION,
        "ordered": "2023-12-07T10:54:31",
        "parameters": [],
        "priority": 0,
        "started": "2023-12-07T10:54:31",
        "state": state,
        **values,
    }


@dataclass
class Scripted:
    """A transport that gives the answers in turn, the last one for ever."""

    answers: list[Response]
    methods: list[str] = field(default_factory=list)

    def send(self, method: str, path: str, **_options: object) -> Response:
        self.methods.append(method)
        path.encode("ascii")
        return self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]

    def read_connection(self) -> None:
        """No connection."""

    def close(self) -> None:
        """Nothing is open."""


def answered(status: int, body: bytes, headers: dict[str, str] | None = None, token: Token = Token()) -> RobotClient:  # noqa: B008
    """A client whose every request is answered with this."""
    return RobotClient(Address.parse("10.0.0.1"), token, transport=Scripted([Response(status, body, headers or {})]))


def short(number: int, state: str = "Done") -> dict[str, Any]:
    return {"url": f"/v2.0.0/mission_queue/{number}", "state": state, "id": number}
