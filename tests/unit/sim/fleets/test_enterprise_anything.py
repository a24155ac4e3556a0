"""Whatever clients, robots and the network do, an order of Fleet Enterprise runs once and its end stays."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mir_sim.checks import WrongValue
from mir_sim.control import apply
from mir_sim.mission_queue import ItemState
from tests.support.examples import examples
from tests.unit.sim.asking import GUIDS
from tests.unit.sim.fleets.anything import happen, queued
from tests.unit.sim.fleets.enterprise_asking import EnterpriseAsker, uuid_of

NAMES = ("a", "b", "c")
ENDS = ("Finished", "Aborted", "Invalid")
STEPS = st.one_of(
    st.tuples(
        st.just("post"), st.sampled_from(NAMES), st.sampled_from([("Home",), ("Home", "Wait at home"), ("Deliver",)])
    ),
    st.tuples(st.just("delete"), st.sampled_from(NAMES)),
    st.tuples(st.just("move"), st.sampled_from(NAMES), st.sampled_from([0, 1])),
    st.tuples(st.just("pass"), st.floats(0.1, 90)),
    st.tuples(
        st.just("knobs"), st.sampled_from([{"posted": "accepted"}, {"posted": "created"}, {"abort_seconds": 20}])
    ),
    st.tuples(st.just("fleet"), st.sampled_from([True, False])),
    st.tuples(
        st.just("robot"),
        st.sampled_from([0, 1]),
        st.sampled_from(["pause", "resume", "reboot", "fail", "clear_errors"]),
    ),
)


class Hall(EnterpriseAsker):
    def do(self, what: str, *values: object) -> None:
        match (what, *values):
            case ("post", str(name), (*missions,)):
                self.post(
                    name, *map(str, missions), phase={"fallback-mission-id": GUIDS["Home"]} if name == "c" else None
                )
            case ("delete", str(name)):
                self.send("DELETE", f"/serial-order/{uuid_of(name)}")
            case ("move", str(name), int(number)):
                change = {"serial-order-id": uuid_of(name), "robot-id": self.fleet.vehicles[number].guid}
                self.send("PATCH", "/serial-order", change)
            case ("pass", float(seconds)):
                self.pass_time(seconds)
            case ("knobs", dict(knobs)):
                apply(self.fleet, {"knobs": knobs})
            case ("fleet", bool(forgets)):
                self.fleet.restart(10, forgets_waiting=forgets)
            case ("robot", int(number), str(event)):
                happen(self.fleet.vehicles[number].robot, event)
            case other:
                raise WrongValue(f"{other}")


@examples(200)
@given(steps=st.lists(STEPS, max_size=25))
def test_an_order_runs_once_and_its_end_stays(steps: list[tuple[str, ...]]) -> None:
    hall = Hall()
    ended: dict[str, str] = {}
    for step in steps:
        hall.do(*step)
        assert max(queued(hall.fleet).values(), default=0) <= 1
        orders = {one["order-id"]: one["order-status"] for one in hall.fleet.snapshot()["orders"]}
        assert {order_id: orders[order_id] for order_id in ended} == ended
        ended |= {order_id: status for order_id, status in orders.items() if status in ENDS}
        assert [one for one in hall.fleet.active if one.ended is not None] == []
    for vehicle in hall.fleet.vehicles:
        for event in ("clear_errors", "resume"):
            happen(vehicle.robot, event)
    hall.pass_time(3600)
    shown = {one["order-id"]: one["order-status"] for one in hall.fleet.snapshot()["orders"]}
    assert set(shown.values()) <= set(ENDS)
    assert hall.fleet.active == []
    done = [
        item.fleet_schedule_guid
        for one in hall.fleet.vehicles
        for item in one.robot.queue
        if item.state is ItemState.DONE
    ]
    finished = [order_id for order_id, status in shown.items() if status == "Finished"]
    assert sorted(set(done) & set(shown)) == sorted(finished)
