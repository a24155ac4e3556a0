"""What a classic fleet says of its robots, and who of them may get an order."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from mir_sim.checks import WrongValue
from mir_sim.missions import DEFAULT_GROUP
from mir_sim.state import RobotError
from tests.unit.sim.asking import GUIDS, HEADERS, credentials
from tests.unit.sim.fleets.classic import FleetAsker

RECORDED_STATUS = json.loads((Path(__file__).parent / "recorded_status.json").read_text(encoding="utf-8"))


def shape(value: Any) -> Any:
    """The names and kinds of the fields; numbers are of one kind."""
    if isinstance(value, dict):
        return {name: shape(inner) for name, inner in value.items()}
    return "number" if type(value) in (int, float) else type(value).__name__


def test_the_status_has_the_shape_that_was_recorded(fleet: FleetAsker) -> None:
    assert shape(fleet.vehicle()["status"]) == shape(RECORDED_STATUS)


def test_the_list_has_a_name_and_the_state_besides_what_the_robot_alone_has(fleet: FleetAsker) -> None:
    one = fleet.vehicle()
    listed = fleet.get("/robots?whitelist=all")[0]
    assert listed == {**one, "name": "Aino", "url": "/v2.0.0/robots/1", "state_id": 3}
    chosen = fleet.get("/robots?whitelist=id,ip,fleet_state,fleet_state_text")
    assert chosen == [
        {"id": number, "ip": f"192.0.2.{number}", "fleet_state": 11, "fleet_state_text": "ready"} for number in (1, 2)
    ]


def test_running_an_order_is_something_else_than_running_an_own_mission(fleet: FleetAsker) -> None:
    fleet.order(robot_id=1)
    user = fleet.fleet.site.table("/users").get("mirconst-guid-0000-0005-users0000000")
    fleet.robots[1].order(GUIDS["Deliver"], user)
    fleet.pass_time(8)
    assert [one["fleet_state"] for one in fleet.get("/robots?whitelist=fleet_state")] == [15, 14]
    status = fleet.vehicle(1)["status"]
    assert (status["mission_queue_id"], status["state_id"]) == (1, 5)


@pytest.mark.parametrize(
    ("happens", "state", "text"),
    [
        (lambda robot: robot.pause(), 9, "pause"),
        (lambda robot: robot.take_over(), 8, "manual control"),
        (lambda robot: robot.press_emergency_stop(True), 4, "emergency stop"),
        (lambda robot: robot.raise_error(RobotError(701, "Too hot"), lasting=False), 5, "error"),
        (lambda robot: robot.set_battery(5), 10, "low battery"),
        (lambda robot: robot.reboot(60), 1, "unavailable"),
    ],
)
def test_fleet_states(fleet: FleetAsker, happens: Any, state: int, text: str) -> None:
    happens(fleet.robots[0])
    fleet.pass_time(2)
    vehicle = fleet.vehicle()
    assert (vehicle["fleet_state"], vehicle["fleet_state_text"]) == (state, text)


def test_a_robot_that_charges_until_it_is_needed_takes_an_order(fleet: FleetAsker) -> None:
    charges = fleet.order("Return to charger", robot_id=1)
    fleet.pass_until(lambda: fleet.vehicle()["fleet_state"] == 12)
    fleet.pass_until_done(fleet.order("Home", robot_id=1))
    assert fleet.state_of(charges) == "Done"


def test_an_unavailable_robot_keeps_its_last_status(fleet: FleetAsker) -> None:
    fleet.robots[0].set_battery(55)
    fleet.robots[0].reboot(600)
    fleet.pass_time(1.0)
    last = fleet.vehicle()["status"]
    fleet.pass_time(500)
    vehicle = fleet.vehicle()
    assert (vehicle["fleet_state"], vehicle["status"]) == (1, last)
    assert vehicle["status"]["battery_percentage"] == pytest.approx(55, abs=0.1)
    fleet.pass_time(200)
    assert fleet.vehicle()["status"]["uptime"] < 200


def test_what_a_robot_does_out_of_contact_is_seen_afterwards(fleet: FleetAsker) -> None:
    number, waits = fleet.order("Home", robot_id=1), fleet.order("Home", robot_id=1)
    fleet.pass_time(3)
    fleet.control(out_of_contact=["Aino"])
    last = fleet.vehicle()["status"]
    fleet.pass_time(60)
    assert [str(item.state) for item in fleet.robots[0].queue] == ["Done"]
    assert (fleet.state_of(number), fleet.state_of(waits)) == ("Executing", "Pending")
    assert (fleet.vehicle()["fleet_state"], fleet.vehicle()["status"]) == (1, last)
    assert fleet.vehicle(2)["fleet_state"] == 11
    fleet.control(out_of_contact=[])
    fleet.pass_until_done(waits)
    assert fleet.state_of(number) == "Done"


def test_an_order_that_is_deleted_out_of_contact_ends_when_the_robot_is_reached(fleet: FleetAsker) -> None:
    number = fleet.order("Deliver", robot_id=1)
    fleet.pass_time(5)
    fleet.control(out_of_contact=["Aino"])
    assert fleet.send("DELETE", f"/mission_scheduler/{number}").status == 204
    assert fleet.state_of(number, after=10) == "Executing"
    fleet.control(out_of_contact=[])
    assert fleet.state_of(number, after=2) == "Aborted"


@pytest.mark.parametrize(
    ("value", "says"),
    [("Aino", "must be a list of names of robots."), (["Eve"], "each of out_of_contact must be one of Aino, Veikko.")],
)
def test_contact_is_lost_with_robots_that_there_are(fleet: FleetAsker, value: Any, says: str) -> None:
    with pytest.raises(WrongValue, match=says):
        fleet.control(out_of_contact=value)


def test_a_deactivated_robot_gets_nothing(fleet: FleetAsker) -> None:
    changed = fleet.send("PUT", "/robots/1", {"active": False, "description": "In repair"})
    assert (changed.status, changed.json()["fleet_state"], changed.json()["description"]) == (200, 25, "In repair")
    named, anyone = fleet.order("Home", robot_id=1), fleet.order("Home")
    fleet.pass_until_done(anyone)
    assert (fleet.item(anyone)["robot_id"], fleet.state_of(named)) == (2, "Pending")


def test_groups_decide_who_is_qualified(fleet: FleetAsker) -> None:
    group = fleet.send("POST", "/robot_groups", {"name": "Heavy", "allow_all_mission_groups": False}).json()["id"]
    assert fleet.send("PUT", "/robots/1", {"robot_group_id": group}).status == 200
    mission = GUIDS["Home"]
    assert fleet.get(f"/missions/{mission}/qualified_robots") == [{"name": "Veikko", "url": "/v2.0.0/robots/2"}]
    numbers = [fleet.order("Home") for _ in range(2)]
    for number in numbers:
        fleet.pass_until_done(number)
    assert [fleet.item(number)["robot_id"] for number in numbers] == [2, 2]

    path = f"/robot_groups/{group}/mission_groups"
    assert fleet.send("POST", path, {"mission_group_id": DEFAULT_GROUP}).status == 201
    assert fleet.send("POST", path, {"mission_group_id": DEFAULT_GROUP}).status == 409
    assert [one["name"] for one in fleet.get(f"/missions/{mission}/qualified_robots")] == ["Aino", "Veikko"]
    assert fleet.send("DELETE", f"{path}/{DEFAULT_GROUP}").status == 204
    assert fleet.get(path) == []


def test_a_robot_that_is_named_needs_no_qualification(fleet: FleetAsker) -> None:
    group = fleet.send("POST", "/robot_groups", {"name": "Heavy"}).json()["id"]
    fleet.send("PUT", "/robots/1", {"robot_group_id": group})
    fleet.pass_until_done(fleet.order("Home", robot_id=1))


def test_a_removed_robot_gets_nothing_until_it_is_added_again(fleet: FleetAsker) -> None:
    assert fleet.send("DELETE", "/robots/1").status == 204
    assert [one["id"] for one in fleet.get("/robots?whitelist=id")] == [2]
    assert fleet.get("/robots/scan/192.0.2.1")["already_exists"] is False
    body = {"ip": "192.0.2.1", "robot_group_id": 1}
    assert fleet.send("POST", "/robots", body).status == 201
    assert fleet.send("POST", "/robots", body).status == 409
    assert fleet.send("POST", "/robots", {**body, "ip": "192.0.2.9"}).status == 400
    fleet.pass_until_done(fleet.order("Home", robot_id=1))


def test_a_question_of_a_robot_is_answered_at_the_fleet(fleet: FleetAsker) -> None:
    number = fleet.order("Ask for release", robot_id=2)
    fleet.pass_until(lambda: fleet.get("/prompt"))
    (asked,) = fleet.get("/prompt")
    assert (asked["robot_id"], asked["question"]) == (2, "Is the load secured?")
    assert fleet.vehicle(2)["status"]["user_prompt"]["guid"] == asked["guid"]
    assert fleet.send("PUT", f"/prompt/{asked['guid']}", {"answer": "Yes"}).status == 200
    assert fleet.get("/prompt") == []
    assert fleet.send("PUT", f"/prompt/{asked['guid']}", {"answer": "Yes"}).status == 404
    fleet.pass_until_done(number)


def test_during_an_evacuation_no_order_is_given(fleet: FleetAsker) -> None:
    assert fleet.send("POST", "/evacuations", {"evacuation_activated": True, "note": "Test"}).status == 201
    number = fleet.order("Home")
    fleet.pass_time(30)
    assert (fleet.state_of(number), fleet.vehicle()["fleet_state"]) == ("Pending", 21)
    fleet.send("POST", "/evacuations", {"evacuation_activated": False})
    fleet.pass_until_done(number)


def test_missions_and_users_are_the_same_on_the_fleet_and_its_robots(fleet: FleetAsker) -> None:
    group = fleet.get("/user_groups")[0]["guid"]
    user = {"username": "eve", "name": "Eve", "password": "secret", "user_group_id": group}
    assert fleet.send("POST", "/users", user).status == 201
    assert fleet.send("POST", "/missions", {"name": "New", "group_id": DEFAULT_GROUP}).status == 201
    headers = {**HEADERS, "Authorization": credentials("eve", "secret")}
    for machine in (fleet.fleet, *fleet.robots):
        fleet.machine = machine
        answer = fleet.send("GET", "/missions?whitelist=name", headers=headers)
        assert (answer.status, {"name": "New"} in answer.json()) == (200, True)


def test_who_has_few_rights_may_only_read(fleet: FleetAsker) -> None:
    group = fleet.send("POST", "/user_groups", {"name": "Guests"}).json()["guid"]
    fleet.send("POST", "/users", {"username": "eve", "name": "Eve", "password": "secret", "user_group_id": group})
    guest = fleet.send("GET", "/robots/1", headers={"Authorization": credentials("eve", "secret")})
    assert (guest.json()["allowed_methods"], fleet.vehicle()["allowed_methods"]) == (["GET"], ["PUT", "GET", "DELETE"])


@pytest.mark.parametrize("path", ["/mission_queue", "/registers/1", "/statistics/distance", "/wifi/networks"])
def test_a_fleet_has_not_all_that_robots_have(fleet: FleetAsker, path: str) -> None:
    assert fleet.send("GET", path).status == 404
