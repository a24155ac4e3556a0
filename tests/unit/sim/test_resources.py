"""Other resources: missions, positions, maps, registers, users, figures about the robot."""

from __future__ import annotations

import base64
from io import BytesIO

import pytest
from PIL import Image

from mir_sim import MISSIONS, world
from mir_sim.motion import Trip
from tests.unit.sim.asking import GUIDS, HEADERS, Asker, credentials


# ---------------------------------------------------------------------- who asks
@pytest.mark.parametrize(
    "authorization",
    [
        "",
        "Basic",
        "Basic !!!",
        "Basic ZGlzdHJpYnV0b3I=",
        "Bearer x",
        credentials("distributor", "Distributor"),
        credentials("nobody", "distributor"),
        "Basic " + base64.b64encode(b"distributor:distributor").decode(),
    ],
)  # a plain password is refused, as reported
def test_wrong_credentials_are_refused(aino: Asker, authorization: str) -> None:
    response = aino.send("GET", "/missions", headers={**HEADERS, "Authorization": authorization})
    assert (response.status, set(response.json())) == (401, {"error_code", "error_human"})


@pytest.mark.parametrize("user", ["distributor", "Distributor", "DISTRIBUTOR"])
def test_user_names_do_not_mind_case(aino: Asker, user: str) -> None:
    assert aino.send("GET", "/missions", headers={"Authorization": credentials(user)}).status == 200


def test_a_new_user_can_log_in_and_no_password_is_ever_shown(aino: Asker) -> None:
    group = aino.get("/user_groups")[0]["guid"]
    made = aino.send(
        "POST", "/users", {"username": "tablet", "password": "secret", "name": "Tablet", "user_group_id": group}
    ).json()
    headers = {**HEADERS, "Authorization": credentials("tablet", "secret")}
    me = aino.send("GET", "/users/me", headers=headers).json()
    assert (me["guid"], me["url"]) == (made["guid"], f"/v2.0.0/users/{made['guid']}")
    assert "secret" not in str(aino.get(f"/users/{made['guid']}"))
    aino.send("PUT", "/users/me", {"password": "other"}, headers)
    assert aino.send("GET", "/users/me", headers=headers).status == 401


# ---------------------------------------------------------------------- missions
def test_ready_made_missions_have_the_same_guids_on_every_robot() -> None:
    for seed in (1, 2):
        listed = {mission["guid"]: mission["name"] for mission in Asker(seed=seed).get("/missions")}
        assert all(listed[mission.guid] == mission.name for mission in MISSIONS)
    assert GUIDS["Deliver"] == "3d7c7c40-ce85-11ef-904a-000e8e9884eb"
    assert all(len(guid) == 36 for guid in listed)


def test_a_mission_has_the_recorded_fields(aino: Asker) -> None:
    mission = aino.get(f"/missions/{GUIDS['Go to position']}")
    assert mission["has_user_parameters"] is True
    assert mission["actions"] == f"/v2.0.0/missions/{mission['guid']}/actions"
    assert (mission["allowed_methods"], mission["created_by_name"], mission["valid"]) == (
        ["PUT", "GET", "DELETE"],
        "Distributor",
        True,
    )
    assert aino.get(f"/missions/{GUIDS['Home']}")["has_user_parameters"] is False


def test_a_mission_made_by_a_client_runs(aino: Asker) -> None:
    group = aino.get("/mission_groups")[0]["guid"]
    made = aino.send(
        "POST", "/missions", {"name": "Count", "group_id": group, "guid": "11111111-2222-11ef-8000-000000000000"}
    )
    assert (made.status, made.json()["name"]) == (201, "Count")
    guid = made.json()["guid"]
    again = aino.send("POST", "/missions", {"name": "Count", "group_id": group, "guid": guid})
    assert (again.status, again.json()["error_human"]) == (409, "Duplicate entry")
    steps = [("wait", {"time": "00:00:30.000000"}), ("set_plc_register", {"register": 101, "value": 2.5})]
    for priority, (kind, parameters) in enumerate(steps, start=1):
        body = {
            "mission_id": guid,
            "action_type": kind,
            "priority": priority,
            "parameters": [{"id": name, "value": value} for name, value in parameters.items()],
        }
        assert aino.send("POST", f"/missions/{guid}/actions", body).status == 201
    aino.send("POST", "/mission_queue", {"mission_id": guid})
    aino.pass_time(20)
    assert aino.get("/registers/101")["value"] == 0.0
    aino.pass_time(20)
    assert aino.get("/registers/101")["value"] == 2.5
    assert aino.send("PUT", f"/missions/{guid}", {"name": "Count up"}).json()["name"] == "Count up"


@pytest.mark.parametrize(
    ("action_type", "parameters", "text"),
    [
        ("move", [{"id": "position", "value": "gone"}], "The position of the action does not exist"),
        ("wait", [{"id": "time", "value": "soon"}], "Invalid parameters for action wait"),
        ("set_plc_register", [], "Invalid parameters for action set_plc_register"),
    ],
)
def test_an_impossible_action_fails_the_mission(
    aino: Asker, action_type: str, parameters: list[object], text: str
) -> None:
    guid = GUIDS["Home"]
    for action in aino.get(f"/missions/{guid}/actions"):
        aino.send("DELETE", f"/missions/{guid}/actions/{action['guid']}")
    action = {"mission_id": guid, "action_type": action_type, "priority": 1, "parameters": parameters}
    aino.send("POST", f"/missions/{guid}/actions", action)
    number = aino.run_for(10, "Home")
    assert (aino.item(number)["state"], aino.item(number)["message"]) == ("Aborted", text)


def test_a_deleted_mission_answers_410_on_newer_software_and_404_on_older() -> None:
    for software, status in (("3.5.4", 410), ("2.14.7", 404)):
        asker = Asker(software=software)
        number = asker.order("Home")
        assert asker.send("DELETE", f"/missions/{GUIDS['Home']}").status == 204
        assert asker.send("GET", f"/missions/{GUIDS['Home']}").status == status
        assert asker.send("DELETE", f"/missions/{GUIDS['Home']}").status == 404
        assert asker.send("POST", "/mission_queue", {"mission_id": GUIDS["Home"]}).status == 400
        assert asker.state_of(number, after=5) == "Aborted"


def test_built_in_missions_can_only_be_read(aino: Asker) -> None:
    guid = "mirconst-guid-0000-0001-actionlist00"
    mission = aino.get(f"/missions/{guid}")
    assert (mission["hidden"], mission["allowed_methods"]) == (True, ["GET"])
    assert aino.send("DELETE", f"/missions/{guid}").status == 400


def test_the_catalogue_of_actions(aino: Asker) -> None:
    kinds = {action["action_type"] for action in aino.get("/actions")}
    assert {action.type for mission in MISSIONS for action in mission.actions} <= kinds
    assert aino.get("/actions/charging")["parameters"][0]["id"] == "minimum_time"
    assert aino.send("GET", "/actions/dance").status == 404


# ---------------------------------------------------------------------- the world
def test_positions_lie_on_the_map_and_lists_link_to_it(aino: Asker) -> None:
    (map_entry,) = aino.get("/maps")
    listed = aino.get("/positions")
    assert {entry["map"] for entry in listed} == {map_entry["url"]}
    assert aino.get(f"/maps/{map_entry['guid']}/positions") == listed
    charger = next(entry for entry in listed if entry["name"] == "Charger")
    assert aino.get(f"/position_types/{charger['type_id']}")["name"] == "Charging station"
    position = aino.get(f"/positions/{charger['guid']}")
    assert (position["pos_x"], position["pos_y"], position["map"]) == (2.0, 20.0, map_entry["url"])
    (entry,) = aino.get(f"/positions/{charger['guid']}/helper_positions")
    assert entry["name"] == "Charger entry"
    assert [offset["name"] for offset in aino.get(f"/positions/{charger['guid']}/docking_offsets")] == [
        "Charger offset"
    ]


@pytest.mark.parametrize(("software", "field"), [("2.14.7", "map"), ("3.5.4", "base_map")])
def test_the_map_is_a_picture_of_the_floor_plan(software: str, field: str) -> None:
    entry = Asker(software=software).get(f"/maps/{world.MAP_GUID}")
    image = Image.open(BytesIO(base64.b64decode(entry[field])))
    columns, rows = image.size
    assert columns * entry["resolution"] > world.WIDTH
    assert rows * entry["resolution"] > world.HEIGHT
    for station in world.STATIONS:  # every station is on free floor
        x = round((station.pose.x - entry["origin_x"]) / entry["resolution"])
        y = rows - 1 - round((station.pose.y - entry["origin_y"]) / entry["resolution"])
        assert image.getpixel((x, y)) > 200
    assert {shade for _count, shade in image.getcolors()} == {0, 205, 254}


def test_every_way_between_stations_is_free() -> None:
    for start in world.STATIONS:
        for goal in world.STATIONS:
            trip = Trip(start.pose, world.route(start.pose, goal.pose.x, goal.pose.y), goal.pose.orientation)
            for step in range(int(trip.duration) + 1):
                pose = trip.at(step).pose
                assert 0.5 < pose.x < world.WIDTH - 0.5
                assert not any(
                    box.left - 0.4 < pose.x < box.right + 0.4 and box.bottom - 0.4 < pose.y < box.top + 0.4
                    for box in world.OBSTACLES
                ), pose


# ---------------------------------------------------------------------- numbers
def test_registers_hold_integers_and_floats(aino: Asker) -> None:
    assert len(aino.get("/registers")) == 200
    assert aino.send("PUT", "/registers/7", {"value": 3}).json() == {
        "allowed_methods": ["PUT", "GET", "POST"],
        "id": 7,
        "value": 3,
        "label": "PLC Register 7",
    }
    assert aino.send("POST", "/registers/107", {"value": 1.5, "label": "Load"}).status == 201
    assert (aino.get("/registers/107")["value"], aino.get("/registers/107")["label"]) == (1.5, "Load")
    assert aino.send("PUT", "/registers/7", {"value": 3.5}).status == 400
    assert aino.send("PUT", "/registers/201", {"value": 1}).status == 404
    assert aino.send("PUT", "/registers/7", {"label": "x" * 51}).status == 400


def test_metrics_are_openmetrics_text(aino: Asker) -> None:
    aino.run_for(20)
    response = aino.send("GET", "/metrics")
    assert response.headers["Content-Type"].startswith("application/openmetrics-text")
    values = dict(line.rsplit(" ", 1) for line in response.body.decode().splitlines() if not line.startswith("#"))
    status = aino.status()
    assert float(values["mir_robot_position_x_meters"]) == status["position"]["x"]
    assert float(values["mir_robot_distance_moved_meters_total"]) == status["moved"]
    assert int(values["mir_robot_state_id"]) == 5
    assert any('name="Aino"' in name for name in values)
    assert response.body.endswith(b"# EOF\n")


def test_distances_are_cumulative(aino: Asker) -> None:
    aino.run_for(3600)
    metres = [day["distance"] for day in aino.get("/statistics/distance")]
    assert metres == sorted(metres)
    assert metres[-1] == aino.status()["moved"]


def test_the_clock_has_its_zone_offset_and_drift() -> None:
    asker = Asker(timezone="Europe/Helsinki", clock_offset=30.0, clock_drift=10.0)
    assert asker.robot.stamp() == "2026-11-23T08:00:30"
    asker.pass_time(86_400)
    assert asker.robot.stamp() == "2026-11-24T08:00:40"
    assert asker.get("/platform/timezone") == {"value": "Europe/Helsinki"}
    assert asker.send("POST", "/platform/timezone", {"value": "Europe/Paris"}).status == 201
    assert asker.robot.stamp() == "2026-11-24T07:00:40"
    assert asker.send("POST", "/platform/timezone", {"value": "Mars/Crater"}).status == 400


def test_a_name_a_place_and_a_serial_number_can_be_set(aino: Asker) -> None:
    status = aino.put_status(
        name="R7", serial_number="42", position={"x": 10.0, "y": 12.0, "orientation": 45.0}, web_session_id="web"
    )
    assert (status["robot_name"], status["serial_number"], status["joystick_web_session_id"]) == ("R7", "42", "web")
    assert status["position"] == {"x": 10.0, "y": 12.0, "orientation": 45.0}


@pytest.mark.parametrize(
    ("fields", "wrong"),
    [
        ({"state_id": 5}, "state_id"),
        ({"state_id": "3"}, "state_id"),
        ({"state_id": True}, "state_id"),
        ({"mode_id": 4}, "mode_id"),
        ({"clear_error": False}, "clear_error"),
        ({"name": ""}, "name"),
        ({"name": "x" * 21}, "name"),
        ({"map_id": "nowhere"}, "map_id"),
        ({"position": {"x": 1.0}}, "position"),
        ({"position": {"x": 1, "y": 2, "orientation": "north"}}, "position"),
        ({"answer": "Yes"}, "guid"),
        ({"datetime": "yesterday"}, "datetime"),
        ({"datetime": "0001-01-01T00:00:00"}, "datetime"),
        ({"name": "R7", "state_id": 9}, "state_id"),
        ({"name": "", "state_id": 9}, "name, state_id"),
    ],
)
def test_a_wrong_status_changes_nothing(aino: Asker, fields: dict[str, object], wrong: str) -> None:
    before = aino.status()
    response = aino.send("PUT", "/status", fields)
    assert (response.status, response.json()["error_human"]) == (400, f"Argument error: {wrong}")
    assert aino.status() == before


def test_a_robot_that_is_put_elsewhere_while_driving_finds_its_goal_from_there(aino: Asker) -> None:
    number = aino.run_for(12, "Deliver")
    metres = aino.status()["moved"]
    status = aino.put_status(position={"x": 30.0, "y": 12.0, "orientation": 0.0})
    assert status["moved"] == pytest.approx(metres, abs=0.01)
    assert status["distance_to_next_target"] == pytest.approx(28.0, abs=0.01)
    aino.pass_until_done(number)
    assert aino.status()["position"]["y"] == 18.0
