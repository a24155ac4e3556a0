"""Queueing missions, reading and cancelling them."""

from __future__ import annotations

import json
from itertools import pairwise

import pytest

from tests.unit.sim.asking import GUIDS, HEADERS, Asker, credentials
from tests.unit.sim.fleets.classic import FleetAsker

FULL_ITEM = {
    "actions",
    "allowed_methods",
    "control_posid",
    "control_state",
    "created_by",
    "created_by_id",
    "created_by_name",
    "description",
    "finished",
    "fleet_schedule_guid",
    "id",
    "message",
    "mission",
    "mission_id",
    "ordered",
    "parameters",
    "priority",
    "started",
    "state",
}


def test_an_order_is_pending_then_executing_then_done(either: Asker) -> None:
    number = either.order()
    assert either.state_of(number) == "Pending"
    assert either.status()["state_text"] == "Ready"  # right after the POST, as on robots
    assert either.state_of(number, after=2) == "Executing"
    status = either.status()
    assert (status["state_text"], status["mission_queue_id"]) == ("Executing", number)
    assert status["mission_queue_url"] == f"/v2.0.0/mission_queue/{number}"
    either.pass_until_done(number)
    assert either.status()["mission_queue_id"] is None


def test_a_full_item_has_the_recorded_fields_and_nulls(aino: Asker) -> None:
    item = aino.item(aino.order())
    assert set(item) == FULL_ITEM
    assert (item["started"], item["finished"], item["control_posid"], item["parameters"]) == (None, None, "0", [])
    assert item["mission"] == f"/v2.0.0/missions/{GUIDS['Deliver']}"
    assert item["created_by_name"] == "Distributor"


def test_the_list_is_the_whole_history_by_ascending_id(aino: Asker) -> None:
    numbers = [aino.order("Home") for _ in range(3)]
    aino.pass_time(600)
    assert aino.get("/mission_queue") == [
        {"url": f"/v2.0.0/mission_queue/{number}", "state": "Done", "id": number} for number in numbers
    ]


def test_one_at_a_time_in_the_order_of_their_ids_for_any_priority(aino: Asker) -> None:
    first, second = aino.order("Home", priority=0), aino.order("Home", priority=50)
    aino.pass_time(2)
    assert (aino.state_of(first), aino.state_of(second)) == ("Executing", "Pending")
    aino.pass_until_done(second)
    assert aino.item(first)["finished"] <= aino.item(second)["started"]


def test_the_description_comes_back_and_the_message_is_overwritten(aino: Asker) -> None:
    number = aino.order(description="token-1", message="from the app", fleet_schedule_guid="f-1")
    assert aino.item(number)["message"] == "from the app"
    aino.pass_time(5)
    item = aino.item(number)
    assert (item["description"], item["fleet_schedule_guid"], item["message"]) == ("token-1", "f-1", "")


def test_without_a_description_it_has_the_missions(aino: Asker) -> None:
    assert aino.item(aino.order("Deliver"))["description"] == "Warehouse to line 1"


def test_newer_software_answers_an_order_as_defined_and_older_with_the_full_item() -> None:
    body = {"mission_id": GUIDS["Home"]}
    assert set(Asker(software="3.5.4").send("POST", "/mission_queue", body).json()) == {"id", "state", "url"}
    assert set(Asker(software="2.14.7").send("POST", "/mission_queue", body).json()) == FULL_ITEM | {"url"}


@pytest.mark.parametrize(
    ("body", "wrong"),
    [
        ({}, "mission_id"),
        ({"mission_id": "no-such-mission"}, "mission_id"),
        ({"mission_id": 5}, "mission_id"),
        ({"mission_id": GUIDS["Home"], "message": "x" * 201}, "message"),
        ({"mission_id": GUIDS["Home"], "description": "x" * 201}, "description"),
        ({"mission_id": GUIDS["Home"], "fleet_schedule_guid": "x" * 37}, "fleet_schedule_guid"),
        ({"mission_id": GUIDS["Home"], "priority": "high"}, "priority"),
        ({"mission_id": GUIDS["Home"], "parameters": {"a": 1}}, "parameters"),
        ({"mission_id": GUIDS["Go to position"]}, "Position"),
        (
            {"mission_id": GUIDS["Go to position"], "parameters": [{"input_name": "Position", "value": "nowhere"}]},
            "Position",
        ),
    ],
)
def test_a_wrong_order_is_refused_and_leaves_nothing(aino: Asker, body: object, wrong: str) -> None:
    response = aino.send("POST", "/mission_queue", body)
    assert (response.status, response.json()) == (
        400,
        {"error_code": "bad_request", "error_human": f"Argument error: {wrong}"},
    )
    assert aino.get("/mission_queue") == []


# ---------------------------------------------------------------------- parameters
def test_a_user_parameter_may_be_named_by_input_name_or_by_id(aino: Asker) -> None:
    goal = next(position["guid"] for position in aino.get("/positions") if position["name"] == "Press")
    by_input_name = aino.order("Go to position", parameters=[{"input_name": "Position", "value": goal}])
    by_id = aino.order("Go to position", parameters=[{"id": "Position", "value": goal, "label": "Press"}])
    aino.pass_until_done(by_id)
    assert aino.state_of(by_input_name) == "Done"
    assert aino.status()["position"] == {"x": 35.0, "y": 17.0, "orientation": 90.0}


def test_a_parameter_with_a_default_is_optional(aino: Asker) -> None:
    assert aino.order("Wait at home")


def test_an_unknown_parameter_is_a_server_error_as_reported(aino: Asker) -> None:
    response = aino.send(
        "POST", "/mission_queue", {"mission_id": GUIDS["Home"], "parameters": [{"input_name": "Speed", "value": 1}]}
    )
    assert response.status == 500


# ---------------------------------------------------------------------- cancelling
def test_cancelling_a_waiting_item_leaves_it_in_the_list_as_aborted(aino: Asker) -> None:
    running, waiting = aino.order(), aino.order()
    aino.pass_time(5)
    response = aino.send("DELETE", f"/mission_queue/{waiting}")
    assert (response.status, response.body) == (204, b"")
    item = aino.item(waiting)
    assert (item["state"], item["message"], item["started"]) == ("Aborted", "Aborted - User Request", None)
    assert aino.state_of(running) == "Executing"


def test_cancelling_the_running_item_stops_the_robot_where_it_is(aino: Asker) -> None:
    number = aino.run_for(8)
    before = aino.status()
    aino.send("DELETE", f"/mission_queue/{number}")
    after = aino.status()
    assert (after["state_text"], after["velocity"]["linear"], after["position"]) == ("Aborted", 0.0, before["position"])
    aino.pass_time(1)
    assert aino.status()["state_text"] == "Ready"


@pytest.mark.parametrize("path", ["/mission_queue/1", "/mission_queue"])
def test_a_cancelled_running_item_is_in_abort_for_a_moment(either: Asker, path: str) -> None:
    number = either.run_for(8)
    either.send("DELETE", path)
    item = either.item(number)
    assert (item["state"], item["finished"], item["message"]) == ("Abort", None, "")
    body = {"filters": [{"fieldname": "state", "operator": "IN", "value": ["Pending", "Executing"]}]}
    assert either.send("POST", "/mission_queue/search", body).json() == []
    assert either.send("DELETE", path).status == 204  # again: changes nothing
    assert either.item(number) == item
    either.pass_time(0.5)
    ended = either.item(number)
    assert (ended["state"], ended["message"]) == ("Aborted", "Aborted - User Request")
    assert ended["finished"] is not None
    action = either.get(f"/mission_queue/{number}/actions")[0]["id"]
    assert either.get(f"/mission_queue/{number}/actions/{action}")["finished"] is not None


def test_the_next_item_starts_after_the_cancelled_one_has_ended(aino: Asker) -> None:
    cancelled, following = aino.order(), aino.order("Home")
    aino.pass_time(8)
    aino.send("DELETE", f"/mission_queue/{cancelled}")
    seen = []
    for _ in range(20):
        seen.append((aino.state_of(cancelled), aino.state_of(following)))
        aino.pass_time(0.125)
    assert list(dict.fromkeys(seen)) == [("Abort", "Pending"), ("Aborted", "Pending"), ("Aborted", "Executing")]


def test_cancelling_all_ends_everything_open_and_what_waits_at_once(aino: Asker) -> None:
    done = aino.run_for(60, "Home")
    numbers = [aino.order() for _ in range(3)]
    aino.pass_time(5)
    assert aino.send("DELETE", "/mission_queue").status == 204
    assert [aino.state_of(number) for number in numbers] == ["Abort", "Aborted", "Aborted"]
    aino.pass_time(1)
    assert [aino.state_of(number) for number in numbers] == ["Aborted"] * 3
    assert aino.state_of(done) == "Done"


def test_cancelling_an_ended_item_changes_nothing(aino: Asker) -> None:
    number = aino.run_for(60, "Home")
    before = aino.item(number)
    running = aino.run_for(5)
    assert aino.send("DELETE", f"/mission_queue/{number}").status == 204
    assert aino.item(number) == before
    assert aino.state_of(running) == "Executing"


@pytest.mark.parametrize(("asker", "path"), [(Asker, "/mission_queue"), (FleetAsker, "/mission_scheduler")])
@pytest.mark.parametrize("key", ["99", "0", "-1", "x", "9" * 30])
def test_an_unknown_item_is_not_found(asker: type[Asker], path: str, key: str) -> None:
    for method, body in (("GET", None), ("PUT", {"priority": 1}), ("DELETE", None)):
        assert asker().send(method, f"{path}/{key}", body).status == 404


def test_changing_a_waiting_item(aino: Asker) -> None:
    aino.put_status(state_id=4)
    number = aino.order("Home")
    changed = aino.send("PUT", f"/mission_queue/{number}", {"priority": 7, "mission_id": GUIDS["Deliver"]})
    assert changed.status == 200
    assert (changed.json()["priority"], changed.json()["mission_id"]) == (7, GUIDS["Deliver"])


# ---------------------------------------------------------------------- actions
def test_actions_appear_as_they_begin(aino: Asker) -> None:
    number = aino.order("Deliver")
    assert aino.get(f"/mission_queue/{number}/actions") == []
    aino.pass_time(5)
    actions = aino.get(f"/mission_queue/{number}/actions")
    assert [set(action) for action in actions] == [{"id", "url"}]
    action = aino.get(f"/mission_queue/{number}/actions/{actions[0]['id']}")
    assert (action["action_type"], action["finished"], action["mission_queue_id"]) == ("move", None, number)
    aino.pass_time(600)
    assert len(aino.get(f"/mission_queue/{number}/actions")) == 4
    assert aino.get(f"/mission_queue/{number}/actions/{actions[0]['id']}")["finished"] is not None


def test_the_user_who_ordered_is_in_the_item(aino: Asker) -> None:
    headers = {**HEADERS, "Authorization": credentials("admin", "admin")}
    answer = aino.send("POST", "/mission_queue", {"mission_id": GUIDS["Home"]}, headers)
    assert aino.item(answer.json()["id"])["created_by_name"] == "Administrator"


# ---------------------------------------------------------------------- history
def test_a_long_past_can_be_asked_for_in_pieces() -> None:
    veteran = Asker(history=6_000)
    assert len(veteran.get("/mission_queue")) == 6_000
    newest = veteran.get("/mission_queue?sort_by=id,desc&limit=2&whitelist=id,state,finished")
    assert [item["id"] for item in newest] == [6_000, 5_999]
    assert all(item["finished"] for item in newest)
    body = {"filters": [{"fieldname": "state", "operator": "IN", "value": ["Pending", "Executing"]}]}
    assert veteran.send("POST", "/mission_queue/search", body).json() == []
    number = veteran.order("Home")
    assert number == 6_001
    assert [item["id"] for item in veteran.send("POST", "/mission_queue/search", body).json()] == [number]


def test_history_goes_back_in_time_without_overlap() -> None:
    items = Asker(history=50).get("/mission_queue?whitelist=all")
    assert all(earlier["finished"] <= later["started"] for earlier, later in pairwise(items))
    assert json.dumps(items)
    assert {item["state"] for item in items} <= {"Done", "Aborted"}
