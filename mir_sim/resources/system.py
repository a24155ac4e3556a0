"""The machine: registers, software, distances, time zone, diagnostics, guided moves."""

from __future__ import annotations

from datetime import timedelta
from typing import Any
from zoneinfo import ZoneInfoNotFoundError

from mir_sim import floor_plan
from mir_sim.errors import ApiError, argument_error
from mir_sim.messages import Response
from mir_sim.resources.call import Call, Handlers
from mir_sim.site import Row

DAYS_OF_STATISTICS = 7


def _register(call: Call) -> Row:
    row = call.robot.site.table("/registers").get(call.params["id"])
    if row is None:
        raise ApiError(404)
    return row


def _shown(row: Row) -> dict[str, Any]:
    return {"allowed_methods": ["PUT", "GET", "POST"], "id": row["id"], "value": row["value"], "label": row["label"]}


def get_register(call: Call) -> dict[str, Any]:
    return _shown(_register(call))


def write_register(call: Call) -> dict[str, Any]:
    """PUT and POST do the same; the definition lacks the body of the PUT. Registers 1–100 hold integers, 101–200 floats."""
    row, body = _register(call), call.json()
    definition = call.robot.definition
    posted = definition.operation("post", "/registers/{id}")
    fields = definition.check_body(posted.body_schema if posted and posted.body_schema else {}, body)
    if row["id"] <= 100 and float(fields.get("value", 0)) % 1:
        raise argument_error("value")
    row["label"] = fields.get("label", row["label"])
    if "value" in fields:
        call.robot.set_register(row["id"], fields["value"])
    return _shown(row)


def swagger(call: Call) -> dict[str, Any]:
    """The definition of this robot's API, reduced as ``mir_sim/definitions/README.md`` says."""
    return call.robot.definition.document


def system_status(call: Call) -> dict[str, Any]:
    """One object of texts (recorded); the definition has a list."""
    return {
        "url": "/v2.0.0/software/system_status",
        "platform_version": "3.2.1",
        "application_version": call.robot.software,
        "last_sw_update_type": "application",
        "last_sw_update_status": "success",
        "last_sw_update_date": "2026-03-02T08:15:00",
        "free_disk_space": "18.4 GB",
        "used_disk_space": "9.1 GB",
    }


def distances(call: Call) -> list[dict[str, Any]]:
    """Metres driven by the end of each of the last days and until now. Clients read a list; the definition has one object."""
    robot, metres = call.robot, call.robot.controller.odometer
    today = robot.clock.local(robot.now).replace(microsecond=0)
    began = robot.clock.local(0.0).replace(hour=0, minute=0, second=0, microsecond=0)
    per_day = round(robot.controller.first_odometer / 200, 3)
    days = [
        {
            "allowed_methods": None,
            "date": (began - timedelta(days=back)).isoformat(),
            "distance": round(robot.controller.first_odometer - back * per_day, 3),
        }
        for back in range(DAYS_OF_STATISTICS - 1, -1, -1)
    ]
    return [*days, {"allowed_methods": None, "date": today.isoformat(), "distance": round(metres, 3)}]


def get_timezone(call: Call) -> dict[str, Any]:
    return {"value": call.robot.clock.zone}


def set_timezone(call: Call) -> dict[str, Any]:
    try:
        call.robot.clock.set_zone(call.fields()["value"])
    except (ZoneInfoNotFoundError, ValueError, OSError):
        raise argument_error("value") from None
    return get_timezone(call)


def guided_moves(call: Call) -> list[dict[str, Any]]:
    """Drives that a fleet continues from waypoint to waypoint. None was recorded: all of it is a guess."""
    return list(call.robot.site.table("/guided_move"))


def guide(call: Call) -> dict[str, Any]:
    """Let the robot go as far as a waypoint. A move begins when it is first named; the simulated robot doesn't drive it (guess)."""
    fields, moves = call.changes(), call.robot.site.table("/guided_move")
    if "guided_move_id" not in fields:
        raise argument_error("guided_move_id")
    move = moves.get(fields["guided_move_id"]) or moves.add(
        {
            **fields,
            "url": "/v2.0.0/guided_move",
            "current_waypoint_index": 0,
            "assigned_waypoint_index": 0,
            "node_resource_handling_enabled": "false",
        }
    )
    move.update(fields)
    return move


def waypoints(call: Call) -> list[dict[str, Any]]:
    return [
        {"url": "/v2.0.0/guided_move/waypoints", "guided_move_id": move["guided_move_id"], "waypoints": "[]"}
        for move in call.robot.site.table("/guided_move")
    ]


def diagnostics(call: Call) -> dict[str, Any]:
    """Health of each part of the robot, in the shape that was reported."""
    robot = call.robot
    level = robot.battery.at(robot.now)
    return {
        "/Computer/PC/CPU Load": {
            "level": 0,
            "message": "CPU load is normal",
            "values": {"Average CPU load": "23.5 %", "Cores": "4"},
        },
        "/Power System/Battery": {
            "level": 0 if level > 10 else 1,
            "message": "OK" if level > 10 else "Low battery",
            "values": {"Remaining battery capacity [%]": f"{level:.1f}"},
        },
        "/Motors/Left": {"level": 0, "message": "OK", "values": {"Temperature [C]": "31.0"}},
        "/Motors/Right": {"level": 0, "message": "OK", "values": {"Temperature [C]": "31.0"}},
        "/Safety System/Emergency Stop": {
            "level": 2 if robot.emergency_stop else 0,
            "message": "Emergency stop pressed" if robot.emergency_stop else "OK",
            "values": {},
        },
    }


def metrics(call: Call) -> Response:
    """OpenMetrics text with the recorded names."""
    robot = call.robot
    pose = robot.pose
    gauges = [
        ("localization_score", 0.93),
        ("position_x_meters", pose.x),
        ("position_y_meters", pose.y),
        ("orientation_degrees", pose.orientation),
        ("errors", len(robot.errors)),
        ("state_id", int(robot.state)),
        ("uptime_seconds", int(robot.now - robot.switched_on)),
        ("battery_percent", -1 if robot.emergency_stop else robot.battery.at(robot.now)),
        ("battery_time_remaining_seconds", -1 if robot.emergency_stop else robot.battery.seconds_left(robot.now)),
        ("wifi_access_point_rssi_dbm", -58),
        ("wifi_access_point_frequency_hertz", 5_180_000_000),
    ]
    lines = [
        text
        for name, value in gauges
        for text in (f"# TYPE mir_robot_{name} gauge", f"mir_robot_{name} {round(value, 3)}")
    ]
    labels = {
        "map_guid": robot.map_id,
        "model": robot.model,
        "name": robot.name,
        "serial_number": robot.serial_number,
        "software_version": robot.software,
    }
    lines += [
        "# TYPE mir_robot_distance_moved_meters counter",
        f"mir_robot_distance_moved_meters_total {round(robot.controller.odometer, 3)}",
        "# TYPE mir_robot info",
        "mir_robot_info{" + ",".join(f'{name}="{_escaped(value)}"' for name, value in labels.items()) + "} 1",
        "# TYPE mir_robot_wifi_access_point info",
        'mir_robot_wifi_access_point_info{bssid="00:1a:1e:4c:2b:90",ssid="Production"} 1',
        "# EOF",
        "",
    ]
    return Response(
        200, {"Content-Type": "application/openmetrics-text; version=1.0.0; charset=utf-8"}, "\n".join(lines).encode()
    )


def protective_scan(call: Call) -> Response:
    """A picture, as MiR's description of it says; its schema has no fields."""
    return Response(200, {"Content-Type": "image/png"}, floor_plan.scan(call.robot.pose))


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")


HANDLERS: Handlers = {
    ("get", "/registers/{id}"): get_register,
    ("put", "/registers/{id}"): write_register,
    ("post", "/registers/{id}"): write_register,
    ("get", "/swagger"): swagger,
    ("get", "/software/system_status"): system_status,
    ("get", "/statistics/distance"): distances,
    ("get", "/platform/timezone"): get_timezone,
    ("post", "/platform/timezone"): set_timezone,
    ("get", "/experimental/diagnostics"): diagnostics,
    ("get", "/guided_move"): guided_moves,
    ("put", "/guided_move"): guide,
    ("get", "/guided_move/waypoints"): waypoints,
    ("get", "/metrics"): metrics,
    ("get", "/system/protective_scan"): protective_scan,
}
