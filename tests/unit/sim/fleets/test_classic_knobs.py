"""Knobs of a classic fleet: each turns what no one has seen, or what differs between fleets."""

from __future__ import annotations

from typing import Any

import pytest

from mir_sim.checks import WrongValue
from mir_sim.fleets.knobs import ClassicKnobs, changed
from tests.unit.sim.asking import GUIDS
from tests.unit.sim.fleets.classic import FleetAsker


@pytest.mark.parametrize(
    ("document", "says"),
    [
        ([], "knobs must be an object."),
        ({"colour": 1}, "There is no knob 'colour'; known are description, description_on_robot,"),
        ({"description": "lost"}, "description must be one of posted, mission, none."),
        ({"search": True}, "search must be one of 200, 201, 404."),
        ({"outbound": 1}, "outbound must be true or false."),
        ({"charging_below": 101}, "charging_below must be a number from 0 to 100."),
        ({"state_words": ["Pending"]}, "state_words must be an object of states and the words for them."),
        ({"state_words": {"Waiting": "x"}}, "each key of state_words must be one of Pending, Outbound,"),
        ({"state_words": {"Pending": 1}}, "state_words.Pending must be a text."),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(document: Any, says: str) -> None:
    with pytest.raises(WrongValue) as wrong:
        changed(ClassicKnobs(), document)
    assert str(wrong.value).startswith(says)


@pytest.mark.parametrize(("kind", "shown"), [("posted", "A 1"), ("mission", "Warehouse to line 1"), ("none", "")])
def test_the_description(kind: str, shown: str) -> None:
    fleet = FleetAsker(description=kind, description_on_robot=kind)
    number = fleet.order(description="A 1")
    fleet.pass_time(2)
    (item,) = fleet.robots[0].queue
    assert (fleet.item(number)["description"], item.description) == (shown, shown)


@pytest.mark.parametrize("kind", ["short", "whole"])
def test_the_answer_to_a_post(kind: str) -> None:
    fleet = FleetAsker(answer=kind)
    answer = fleet.send("POST", "/mission_scheduler", {"mission_id": GUIDS["Home"], "robot_id": 2}).json()
    assert {name: answer[name] for name in ("id", "state", "url")} == {
        "id": 1,
        "state": "Pending",
        "url": "/v2.0.0/mission_scheduler/1",
    }
    assert answer.get("robot_id") == (2 if kind == "whole" else None)


def test_words_for_states_are_shown_and_found() -> None:
    fleet = FleetAsker(outbound=False, state_words={"Pending": "QUEUED", "Done": "done"})
    number = fleet.order("Home")
    assert fleet.state_of(number, after=1.5) == "QUEUED"
    fleet.pass_until(lambda: fleet.state_of(number) == "done")
    assert fleet.search("state", "=", "done").json() != []


@pytest.mark.parametrize(
    ("kind", "sent", "shown"),
    [
        ("local", "2026-11-23T09:00:00", "2026-11-23T09:00:00"),
        ("utc", "2026-11-23T09:00:00", "2026-11-23T10:00:00"),
        ("utc", "2026-11-23T09:00:00+02:00", "2026-11-23T08:00:00"),
        ("ignored", "2026-11-23T09:00:00", "2026-11-23T07:00:00"),
    ],
)
def test_the_earliest_start(kind: str, sent: str, shown: str) -> None:
    fleet = FleetAsker(earliest_start=kind)
    number = fleet.order("Home", earliest_start_time=sent)
    assert fleet.item(number)["earliest_start_time"] == shown
    fleet.pass_time(2)
    assert (fleet.state_of(number) == "Pending") == (kind != "ignored")


@pytest.mark.parametrize(("kind", "of"), [("object", dict), ("list", list), ("none", type(None))])
def test_the_parameters_of_an_order(kind: str, of: type) -> None:
    fleet = FleetAsker(parameters=kind)
    value = {"input_name": "Time", "value": "00:00:20"}
    shown = fleet.item(fleet.order("Wait at home", parameters=[value]))["parameters"]
    assert isinstance(shown, of)
    assert shown in ({"data": [value]}, [value], None)


@pytest.mark.parametrize("status", [204, 404, 400])
def test_the_status_of_deleting_what_has_ended(status: int) -> None:
    fleet = FleetAsker(delete_ended=status)
    number = fleet.order("Home")
    fleet.pass_until_done(number)
    assert fleet.send("DELETE", f"/mission_scheduler/{number}").status == status
    assert fleet.state_of(number) == "Done"


@pytest.mark.parametrize(
    ("knobs", "left", "following"),
    [
        ({}, [3, 2, 1], 4),
        ({"waiting_after_reboot": "lost"}, [1], 4),
        ({"waiting_after_reboot": "lost", "ids_after_reboot": "reused"}, [1], 2),
    ],
)
def test_what_a_reboot_leaves(knobs: dict[str, Any], left: list[int], following: int) -> None:
    fleet = FleetAsker(**knobs)
    for _ in range(3):
        fleet.order(robot_id=1)
    fleet.pass_time(3)
    fleet.control(reboot_seconds=10)
    assert str(fleet.exchange("GET", "/robots").fate) == "Fate.REFUSED"
    fleet.pass_time(11)
    assert [one["id"] for one in fleet.get("/mission_scheduler")] == left
    assert fleet.order() == following


@pytest.mark.parametrize("kind", ["kept", "changed"])
def test_the_order_of_robots_after_a_reboot(kind: str) -> None:
    fleet = FleetAsker(order_of_robots=kind)
    fleet.control(reboot_seconds=1)
    fleet.pass_time(2)
    assert [one["id"] for one in fleet.get("/robots")] == ([1, 2] if kind == "kept" else [2, 1])


@pytest.mark.parametrize(
    ("knobs", "ask", "shown"),
    [
        *(
            ({"search": code}, lambda fleet: fleet.search("state", "=", "Done").status, code)
            for code in (200, 201, 404)
        ),
        ({"status": "list"}, lambda fleet: fleet.status(), [FleetAsker().status()]),
        ({"robots": "short"}, lambda fleet: fleet.get("/robots")[0], {"id": 1, "url": "/v2.0.0/robots/1"}),
        ({"serial_numbers": False}, lambda fleet: fleet.vehicle()["serial_number"], ""),
        ({"demands_language": True}, lambda fleet: fleet.send("GET", "/status", headers={}).status, 400),
        (
            {"demands_language": True},
            lambda fleet: fleet.send("GET", "/status", headers={"Accept-Language": "en_US"}).status,
            200,
        ),
    ],
    ids=lambda value: str(value) if isinstance(value, dict) else "",
)
def test_an_answer_is_as_its_knob_says(knobs: dict[str, Any], ask: Any, shown: Any) -> None:
    assert ask(FleetAsker(**knobs)) == shown


def test_robots_are_sent_to_the_charger() -> None:
    fleet = FleetAsker(charging_below=30)
    fleet.robots[1].set_battery(20)
    fleet.pass_until(lambda: fleet.vehicle(2)["fleet_state"] == 12)
    (order,) = fleet.get("/mission_scheduler?whitelist=mission_name,robot_id,created_by_id")
    assert order == {
        "mission_name": "Return to charger",
        "robot_id": 2,
        "created_by_id": "mirconst-guid-0000-0005-users0000000",
    }
    fleet.pass_until_done(fleet.order("Home", robot_id=2))


def test_idle_robots_are_sent_home_and_give_that_up_for_an_order() -> None:
    fleet = FleetAsker(staging_after=20)
    fleet.pass_until_done(fleet.order("Deliver", robot_id=1))
    fleet.pass_until(lambda: fleet.vehicle()["fleet_state"] == 13)
    staging = fleet.get("/mission_scheduler?limit=1&whitelist=id,mission_name,robot_id")[0]
    assert (staging["mission_name"], staging["robot_id"]) == ("Home", 1)
    number = fleet.order("Deliver", robot_id=1)
    fleet.pass_until(lambda: fleet.state_of(number) == "Executing")
    assert (fleet.state_of(staging["id"]), fleet.vehicle()["fleet_state"]) == ("Aborted", 15)
    fleet.pass_until_done(number)
    fleet.pass_time(300)
    assert [one["state"] for one in fleet.get("/mission_scheduler")] == ["Done", "Done", "Aborted", "Done"]


def test_a_box_on_the_way_answers_in_place_of_the_fleet_until_it_is_removed() -> None:
    fleet = FleetAsker()
    fleet.control(knobs={"box": 470})
    answer = fleet.send("GET", "/status")
    assert (answer.status, answer.headers["Content-Type"]) == (470, "text/html")
    fleet.control(knobs={"box": None})
    assert fleet.send("GET", "/status").status == 200
