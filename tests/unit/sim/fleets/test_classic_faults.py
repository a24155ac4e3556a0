"""Faults and control of a classic fleet, by the same machinery as those of robots."""

from __future__ import annotations

import pytest

from mir_sim import Fate, handle
from mir_sim.checks import WrongValue
from mir_sim.messages import Request
from tests.unit.sim.fleets.classic import FleetAsker

PATH = "/mission_scheduler"


def test_the_state_of_the_model_is_shown(fleet: FleetAsker) -> None:
    number = fleet.order(description="A 1")
    state = fleet.fleet.snapshot()
    assert (state["kind"], state["online"], state["knobs"]["answer"]) == ("classic", True, "short")
    assert [(one["id"], one["description"]) for one in state["orders"]] == [(number, "A 1")]
    assert state["robots"][1] == {"id": 2, "name": "Veikko", "ip": "192.0.2.2"}


def test_a_fleet_has_no_battery_and_no_picture(fleet: FleetAsker) -> None:
    with pytest.raises(
        WrongValue, match="There is no command 'battery'; known are knobs, out_of_contact, reboot_seconds, fault"
    ):
        fleet.control(battery=3)
    assert handle(fleet.fleet, Request.of("GET", "/sim/map.png")).status == 404


def test_wrong_knobs_change_nothing(fleet: FleetAsker) -> None:
    with pytest.raises(WrongValue, match="There is no knob 'colour'"):
        fleet.control(knobs={"search": 404, "colour": 1})
    assert fleet.search("state", "=", "Done").status == 200


def test_the_same_requests_get_the_same_answers_also_with_others_between() -> None:
    answers = []
    for reads in (0, 7):
        fleet = FleetAsker()
        fleet.order("Deliver")
        fleet.order("Deliver", robot_id=1)
        for _ in range(40):
            fleet.pass_time(10)
            for _ in range(reads):
                fleet.get("/robots")
                fleet.robots[0].catch_up()
        answers.append([fleet.send("GET", path).body for path in (f"{PATH}?whitelist=all", "/robots")])
    assert answers[0] == answers[1]


def test_a_fleet_restarts_when_it_is_asked_to(fleet: FleetAsker) -> None:
    assert fleet.send("POST", "/restart").status == 201
    fleet.pass_time(2)
    assert fleet.exchange("GET", "/status").fate is Fate.REFUSED
    fleet.pass_time(30)
    assert fleet.exchange("GET", "/status").fate is Fate.ANSWERED
