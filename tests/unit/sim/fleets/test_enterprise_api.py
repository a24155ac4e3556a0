"""Fleet Enterprise around its orders: keys, refusals, robots, missions, questions, versions."""

from __future__ import annotations

from typing import Any

import pytest

import mir_sim
from mir_sim import Request
from mir_sim.control import apply
from tests.unit.sim.asking import GUIDS
from tests.unit.sim.fleets.enterprise_asking import KEY, EnterpriseAsker, uuid_of


@pytest.mark.parametrize("headers", [{}, {"x-api-key": "mir_wrong"}, {"Authorization": "Basic bWlyOm1pcg=="}])
def test_without_its_key_a_client_learns_only_whether_the_fleet_is_well(
    client: EnterpriseAsker, headers: dict[str, str]
) -> None:
    assert mir_sim.handle(client.fleet, Request.of("GET", "/healthz", headers, b"")).body == b"Healthy"
    refused = client.send("GET", "/system/version", headers=headers)
    assert (refused.status, refused.headers["Content-Type"]) == (401, "application/problem+json")


def test_a_problem_says_what_is_wrong(client: EnterpriseAsker) -> None:
    response = client.send("POST", "/serial-order", {"serial-order": {"id": "x", "phases": [{"mission-id": 7}]}})
    assert response.headers["Content-Type"] == "application/problem+json"
    problem = response.json()
    assert (problem["status"], problem["title"], problem["type"]) == (400, "Bad Request", "/errors/bad-request")
    assert problem["detail"] == "Missing or wrong: $.serial-order.phases[0].mission-id."


def test_some_answers_for_unknown_ids_come_as_plain_text_unless_asked_for_json(client: EnterpriseAsker) -> None:
    path = f"/order/{uuid_of('nothing')}"
    answers = [client.send("GET", path, headers=headers) for headers in ({"x-api-key": "mir_scheduler"}, KEY)]
    assert [one.headers["Content-Type"] for one in answers] == ["text/plain", "application/json"]
    assert [one.json()["status"] for one in answers] == [404, 404]


WRONG: dict[str, dict[str, Any]] = {
    "mission": {"phase": {"mission-id": uuid_of("nothing")}},
    "fallback mission": {"phase": {"fallback-mission-id": uuid_of("nothing")}},
    "robot": {"robot_id": uuid_of("nothing")},
    "argument": {"phase": {"arguments": [{"name": "Speed", "value": "1"}]}},
    "order id": {"phase": {"order-id": "1"}},
    "priority": {"priority": "Urgent"},
    "start": {"earliest_start_time": "2026-11-23T07:00:00"},
    "id": {"id": "x" * 256},
    "phases": {"phases": []},
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_wrong_order_is_refused(client: EnterpriseAsker, wrong: str) -> None:
    assert client.post(**WRONG[wrong]).status == 400
    assert client.fleet.active == []


def test_two_phases_with_one_order_id_are_refused(client: EnterpriseAsker) -> None:
    assert client.post("one", "Home", "Home", phase={"order-id": uuid_of("same")}).status == 400


def test_a_missing_argument_is_refused_and_a_given_one_reaches_the_robot(client: EnterpriseAsker) -> None:
    assert client.post("one", "Go to position").status == 400
    mission = client.get(f"/site/mission/{GUIDS['Go to position']}")
    assert mission == {
        "name": "Go to position",
        "arguments": [{"name": "Position", "default-value": "", "type": "Position"}],
    }
    positions = {one["name"]: one["id"] for one in client.get("/site/position")["positions"]}
    client.post("one", "Go to position", phase={"arguments": [{"name": "Position", "value": positions["Press"]}]})
    assert client.run_to_end() == "Finished"
    assert client.robot()["runtime-data"]["pose"] == {"x": 35.0, "y": 17.0, "orientation": 90.0}


def test_missions_are_those_that_robots_show(client: EnterpriseAsker) -> None:
    assert {one["name"]: one["id"] for one in client.get("/site/mission")["missions"]} == GUIDS


@pytest.mark.parametrize(
    ("commands", "state", "end_state"),
    [
        ({}, {"idle": {}}, "Idle"),
        ({"emergency_stop": True}, {"not-operational": {"safety-stop": {"e-stop": {}}}}, "Emergency Stop"),
        ({"error": {"code": 7, "description": "Too hot"}}, {"not-operational": {"error": {}}}, "Error"),
    ],
)
def test_a_robots_state_is_an_object_with_one_key_and_a_word(
    client: EnterpriseAsker, commands: dict[str, Any], state: dict[str, Any], end_state: str
) -> None:
    if commands:
        apply(client.aino.robot, commands)
    robot = client.robot()
    assert (robot["robot-state"], robot["robot-end-state"]) == (state, end_state)


def test_a_robot_that_works_is_operational_and_reports_each_second(client: EnterpriseAsker) -> None:
    client.post(robot_id=client.aino.guid, phase={"mission-id": GUIDS["Deliver"]})
    client.pass_time(20.5)
    robot = client.robot()
    assert robot["robot-end-state"] == "Operational"
    runtime = robot["runtime-data"]
    assert (runtime["timestamp"], runtime["velocity-linear"] > 0) == ("2026-11-23T06:00:20Z", True)
    assert 79.0 < runtime["battery-percentage"] < 80.0


def test_of_a_robot_that_is_offline_the_last_is_shown_with_its_time(client: EnterpriseAsker) -> None:
    client.pass_time(10)
    client.aino.robot.reboot(60)
    client.pass_time(30)
    robot = client.robot()
    assert (robot["runtime-data"]["timestamp"], robot["robot-end-state"]) == ("2026-11-23T06:00:11Z", "Shutting Down")
    client.pass_time(20)
    assert client.robot() == robot
    client.pass_time(40)
    assert client.robot()["robot-end-state"] == "Idle"


def test_of_a_robot_that_is_offline_only_its_name_may_be_known() -> None:
    client = EnterpriseAsker(offline_robot="identity")
    client.aino.robot.reboot(60)
    client.pass_time(30)
    assert list(client.robot()) == ["robot-identity"]


def test_pausing_continuing_and_clearing_errors_take_a_while(client: EnterpriseAsker) -> None:
    def change(**fields: Any) -> list[str]:
        before = client.robot()["robot-end-state"]
        body = {name.replace("_", "-"): value for name, value in fields.items()}
        assert client.send("PATCH", f"/robots/{client.aino.guid}", body).status == 202
        same = client.robot()["robot-end-state"]
        client.pass_time(1)
        assert same == before
        return [before, client.robot()["robot-end-state"]]

    assert change(robot_end_state="Paused") == ["Idle", "Paused"]
    assert change(robot_end_state="Operational") == ["Paused", "Idle"]
    apply(client.aino.robot, {"error": {"code": 7, "description": "Too hot"}})
    assert client.robot()["errors"][0]["description"] == "Too hot"
    client.aino.robot.remove_error_causes()
    assert change(errors=[]) == ["Error", "Paused"]
    assert client.robot()["errors"] == []
    assert client.send("PATCH", f"/robots/{client.aino.guid}", {"robot-end-state": "Idle"}).status == 400


def test_a_question_is_answered_by_the_number_of_an_option_from_one(client: EnterpriseAsker) -> None:
    client.post("one", "Ask for release", robot_id=client.aino.guid)
    client.run_until("Executing")
    while not (prompts := client.get("/user-prompt-snapshot")["user-prompt-events"]):
        client.pass_time(1)
    (prompt,) = prompts
    assert (prompt["title"], prompt["options"]) == ("Is the load secured?", ["Yes", "No"])
    assert prompt["roles"] == ["Distributors"]
    assert (prompt["serial-order-id"], prompt["robot-id"]) == (uuid_of("one"), client.aino.guid)
    assert (client.status(), client.events()[0]["state"]) == ("Executing", "WaitingForInput")
    for value, status in ((0, 400), (3, 400), (1, 200), (1, 400)):
        assert client.send("POST", "/user-prompt", {"id": prompt["id"], "value": value}).status == status
    assert client.get("/user-prompt-snapshot") == {"user-prompt-events": []}
    assert client.run_to_end() == "Finished"


def test_older_versions_have_less() -> None:
    paths = {
        "/system/version": "1.3.1",
        "/serial-order-status/snapshot": "1.3.1",
        "/robots": "1.4.2",
        "/order": "1.4.2",
        "/site/mission": "1.4.2",
        "/user-prompt-snapshot": "1.5.0",
    }
    for version in ("1.3.1", "1.4.2", "1.5.0"):
        client = EnterpriseAsker(version=version)
        assert client.get("/system/version") == {"version": version, "fleet-name": "Hall"}
        found = {path for path in paths if client.send("GET", path).status == 200}
        assert found == {path for path, since in paths.items() if since <= version}


def test_the_oldest_version_accepts_an_order_and_drops_a_second_one_with_its_id() -> None:
    client = EnterpriseAsker(version="1.3.1")
    answers = [client.post() for _ in range(2)]
    assert [(one.status, one.json()) for one in answers] == [(202, {"id": uuid_of("one")})] * 2
    assert client.runs(after=60) == 1


def test_version_1_4_2_knows_no_order_ids_of_phases() -> None:
    client = EnterpriseAsker(version="1.4.2")
    assert client.post("one", "Deliver").status == 201
    client.pass_time(5)
    (order,) = client.get("/order")
    assert (order["order-status"], order["order-id"] == uuid_of("one 0")) == ("Executing", False)
    assert client.send("GET", f"/order/{order['order-id']}").status == 404
