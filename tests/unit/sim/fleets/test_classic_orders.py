"""/mission_scheduler of a classic fleet: orders, the list of them, and their end."""

from __future__ import annotations

from typing import Any

import pytest

from mir_sim import SimulatedRobot
from mir_sim.fleets.classic import ClassicFleet
from tests.unit.sim.asking import GUIDS, HEADERS, credentials
from tests.unit.sim.fleets.classic import FleetAsker

NOT_YET = "1970-01-01T00:00:00"


def test_an_order_for_any_robot_has_none_until_it_is_given_to_one(fleet: FleetAsker) -> None:
    number = fleet.order(description="A 1")
    waiting = fleet.item(number)
    assert (waiting["state"], waiting["robot_id"], waiting["description"]) == ("Pending", 0, "A 1")
    assert waiting["order_time"] == waiting["earliest_start_time"] == "2026-11-23T07:00:00"
    assert (waiting["start_time"], waiting["finish_time"]) == (NOT_YET, NOT_YET)
    seen = []
    while fleet.state_of(number) != "Done":
        seen.append((fleet.state_of(number), fleet.item(number)["robot_id"]))
        fleet.pass_time(0.5)
    assert list(dict.fromkeys(seen)) == [("Pending", 0), ("Outbound", 1), ("Executing", 1)]
    done = fleet.item(number)
    assert NOT_YET < done["order_time"] < done["start_time"] < done["finish_time"]


def test_the_bare_list_is_short_whole_and_newest_first(fleet: FleetAsker) -> None:
    numbers = [fleet.order("Home") for _ in range(3)]
    fleet.pass_until_done(numbers[2])
    waiting = fleet.order(earliest_start_time="2026-11-24T07:00:00")
    assert fleet.get("/mission_scheduler") == [
        {"url": f"/v2.0.0/mission_scheduler/{number}", "state": state, "id": number}
        for number, state in ((waiting, "Pending"), *((number, "Done") for number in reversed(numbers)))
    ]


@pytest.mark.parametrize(
    ("query", "found"),
    [
        ("limit=2", [5, 4]),
        ("limit=2&offset=1", [4, 3]),
        ("offset=3", [2, 1]),
        ("sort_by=id", [1, 2, 3, 4, 5]),
        ("sort_by=id,desc&limit=1", [5]),
        ("sort_by=priority,asc&limit=2", [5, 4]),
    ],
)
def test_pieces_of_the_list(fleet: FleetAsker, query: str, found: list[int]) -> None:
    for number in range(1, 6):
        fleet.order(priority=-number)
    assert [one["id"] for one in fleet.get(f"/mission_scheduler?{query}")] == found


def test_a_whitelist_chooses_fields_and_all_gives_them_all(fleet: FleetAsker) -> None:
    number = fleet.order(description="A 1")
    assert fleet.get("/mission_scheduler?whitelist=id,description,robot_id") == [
        {"id": number, "description": "A 1", "robot_id": 0}
    ]
    assert fleet.get("/mission_scheduler?whitelist=all") == [fleet.item(number)]
    assert fleet.send("GET", "/mission_scheduler?whitelist=colour").status == 400


def test_ids_are_shared_by_all_clients(fleet: FleetAsker) -> None:
    first = fleet.order()
    other = {**HEADERS, "Authorization": credentials("admin", "admin")}
    answer = fleet.send("POST", "/mission_scheduler", {"mission_id": GUIDS["Home"]}, other)
    assert answer.json()["id"] == first + 1
    assert fleet.order() == first + 2
    assert fleet.item(first + 1)["created_by_id"] == "mirconst-guid-0000-0005-users0000000"


def test_the_robots_item_has_the_guid_of_the_order_and_an_id_of_its_own(fleet: FleetAsker) -> None:
    fleet.order("Home", robot_id=1)
    number = fleet.order("Home", robot_id=2)
    fleet.pass_time(2)
    (item,) = fleet.robots[1].queue
    assert (item.id, item.fleet_schedule_guid) == (1, fleet.item(number)["fleet_schedule_guid"])
    assert item.description == "Back to the home position"


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"mission_id": "none"}, "Argument error: mission_id"),
        ({"robot_id": 9}, "Argument error: robot_id"),
        ({"robot_id": None}, "Argument error: robot_id"),
        ({"earliest_start_time": None}, "Argument error: earliest_start_time"),
        ({"earliest_start_time": "soon"}, "Argument error: earliest_start_time"),
        ({"description": "x" * 201}, "Argument error: description"),
        ({"created_by_id": "none"}, "Argument error: created_by_id"),
        ({"mission_id": GUIDS["Go to position"]}, "Argument error: Position"),
    ],
)
def test_what_can_not_be_ordered(fleet: FleetAsker, fields: dict[str, Any], says: str) -> None:
    answer = fleet.send("POST", "/mission_scheduler", {"mission_id": GUIDS["Home"], **fields})
    assert (answer.status, answer.json()["error_human"]) == (400, says)
    assert fleet.get("/mission_scheduler") == []


@pytest.mark.parametrize("earliest", ["2026-11-23T07:01:00.00", "2026-11-23T06:01:00Z"])
def test_an_earliest_start_is_local_time_unless_it_has_a_zone(fleet: FleetAsker, earliest: str) -> None:
    number = fleet.order(earliest_start_time=earliest)
    assert fleet.item(number)["earliest_start_time"] == "2026-11-23T07:01:00"
    assert fleet.state_of(number, after=59) == "Pending"
    assert fleet.state_of(number, after=2) != "Pending"


def test_urgent_orders_come_before_important_ones(fleet: FleetAsker) -> None:
    first = [fleet.order("Home", robot_id=1, **one) for one in ({}, {"priority": 3}, {"high_priority": True})]
    ended: list[int] = []
    while len(ended) < 3:
        fleet.pass_time(1)
        ended += [number for number in first if number not in ended and fleet.state_of(number) == "Done"]
    assert ended == [3, 2, 1]


def test_a_waiting_order_can_be_changed(fleet: FleetAsker) -> None:
    number = fleet.order(earliest_start_time="2026-11-24T07:00:00")
    changes = {"mission_id": GUIDS["Home"], "robot_id": 2, "earliest_start_time": "2026-11-23T07:00:00"}
    changed = fleet.send("PUT", f"/mission_scheduler/{number}", changes)
    assert (changed.status, changed.json()["mission_name"], changed.json()["robot_id"]) == (200, "Home", 2)
    fleet.pass_until_done(number)
    assert fleet.send("PUT", f"/mission_scheduler/{number}", {"priority": 1}).status == 400


@pytest.mark.parametrize("after", [0, 1, 8])
def test_a_deleted_order_is_aborted_and_stays_in_the_list(fleet: FleetAsker, after: float) -> None:
    number = fleet.order()
    fleet.pass_time(after)
    answer = fleet.send("DELETE", f"/mission_scheduler/{number}")
    assert (answer.status, answer.body) == (204, b"")
    fleet.pass_time(2)
    assert fleet.get("/mission_scheduler?whitelist=id,state") == [{"id": number, "state": "Aborted"}]
    assert fleet.item(number)["finish_time"] != NOT_YET
    assert fleet.robots[0].run is None


def test_deleting_the_collection_ends_what_waits_of_all_clients_and_nothing_else(fleet: FleetAsker) -> None:
    running, waiting = fleet.order(robot_id=1), fleet.order(robot_id=1)
    fleet.pass_time(5)
    assert fleet.send("DELETE", "/mission_scheduler").status == 204
    assert [fleet.state_of(number) for number in (running, waiting)] == ["Executing", "Aborted"]


def test_a_failed_order_is_aborted_without_a_message(fleet: FleetAsker) -> None:
    fleet.robots[0].fail_next = "Failed to reach goal"
    number = fleet.order(robot_id=1)
    fleet.pass_until(lambda: fleet.state_of(number) == "Aborted")
    assert "message" not in fleet.item(number)
    (item,) = fleet.robots[0].queue
    assert item.message == "Failed to reach goal"


def test_in_maintenance_orders_wait(fleet: FleetAsker) -> None:
    fleet.put_status(state="maintenance")
    number = fleet.order("Home")
    fleet.pass_time(60)
    assert (fleet.status()["state"], fleet.state_of(number)) == ("maintenance", "Pending")
    fleet.put_status(state="normal")
    fleet.pass_until_done(number)


def test_a_long_past_can_be_asked_for_in_pieces() -> None:
    robots = [SimulatedRobot(name, software="2.14.7") for name in ("Aino", "Veikko")]
    fleet = FleetAsker()
    fleet.machine = ClassicFleet("Fleet", robots, history=5_000)
    assert len(fleet.get("/mission_scheduler")) == 5_000
    newest = fleet.get("/mission_scheduler?sort_by=id,desc&limit=2&whitelist=id,state,finish_time")
    assert [one["id"] for one in newest] == [5_000, 4_999]
    assert all(NOT_YET < one["finish_time"] < "2026-11-23T07:00:00" for one in newest)
    assert fleet.search("state", "=", "Pending").json() == []
    assert fleet.order() == 5_001
    assert [one["id"] for one in fleet.search("id", ">", 4_999).json()] == [5_001, 5_000]
