"""What a client of Fleet Enterprise sees of lost, late and repeated requests, of reboots, and of knobs that are turned."""

from __future__ import annotations

from typing import Any

import pytest

from mir_sim import Fate
from mir_sim.checks import WrongValue
from mir_sim.control import apply
from tests.unit.sim.fleets.enterprise_asking import EnterpriseAsker, uuid_of

ORDER = f"/serial-order/{uuid_of('one')}"


def fault(client: EnterpriseAsker, kind: str, seconds: float = 5) -> None:
    what = {"kind": kind, "method": "POST", "path": "/serial-order", "seconds": seconds}
    apply(client.fleet, {"fault": what})


@pytest.mark.parametrize(("kind", "status"), [("drop_response", 200), ("drop_request", 404), ("hang", 404)])
def test_after_no_answer_the_order_is_there_or_not(client: EnterpriseAsker, kind: str, status: int) -> None:
    fault(client, kind)
    assert client.exchange_order().response is None
    assert client.send("GET", ORDER).status == status
    assert client.post().status == (409 if status == 200 else 201)


def test_an_order_that_something_on_the_way_repeats_runs_once(client: EnterpriseAsker) -> None:
    fault(client, "twice")
    assert (client.exchange_order().response.status, client.run_to_end()) == (409, "Finished")
    assert client.runs(after=60) == 1


def test_a_fleet_that_is_busy_says_so_in_a_problem(client: EnterpriseAsker) -> None:
    fault(client, "status_503")
    response = client.exchange_order().response
    assert (response.status, response.headers["Content-Type"]) == (503, "application/problem+json")
    assert client.send("GET", ORDER).status == 404


@pytest.mark.parametrize(("waiting", "status"), [("kept", 200), ("lost", 404)])
def test_a_reboot_refuses_connections_and_keeps_or_loses_what_waits(
    client: EnterpriseAsker, waiting: str, status: int
) -> None:
    apply(client.fleet, {"knobs": {"waiting_after_reboot": waiting}})
    client.post(earliest_start_time="2026-11-23T08:00:00Z")
    apply(client.fleet, {"reboot_seconds": 20})
    assert client.exchange_order().fate is Fate.REFUSED
    client.pass_time(20)
    assert client.send("GET", ORDER).status == status


def test_a_robot_with_a_low_battery_charges_until_there_is_an_order_for_it(client: EnterpriseAsker) -> None:
    client.aino.robot.set_battery(15)
    apply(client.fleet, {"knobs": {"charging_below": 20}})
    client.pass_time(120)
    (charging,) = client.get("/order")
    assert (charging["order-type"], charging["order-status"], charging["robot-name"]) == (
        "Charging",
        "Executing",
        "Aino",
    )
    client.post(robot_id=client.aino.guid)
    client.run_until("Executing")
    assert client.order()["robot-name"] == "Aino"
    assert client.get(f"/order/{charging['order-id']}")["order-status"] == "Finished"


WRONG: list[dict[str, Any]] = [
    {"version": "1.6.0"},
    {"posted": "later"},
    {"appears_seconds": [5, 0]},
    {"abort_seconds": None},
    {"ids_kept": -1},
    {"search": 200},
]


@pytest.mark.parametrize("wrong", WRONG)
def test_a_knob_has_only_its_positions(client: EnterpriseAsker, wrong: dict[str, Any]) -> None:
    before = client.fleet.knobs
    with pytest.raises(WrongValue):
        apply(client.fleet, {"knobs": wrong})
    assert client.fleet.knobs == before


def test_the_state_of_the_model_shows_all_orders_and_knobs(client: EnterpriseAsker) -> None:
    apply(client.fleet, {"knobs": {"orders_kept": 0, "version": "1.4.2"}})
    client.post()
    client.pass_time(60)
    shown = client.fleet.snapshot()
    assert client.get("/order") == []
    assert [order["order-status"] for order in shown["orders"]] == ["Finished"]
    assert (shown["knobs"]["version"], shown["online"]) == ("1.4.2", True)
