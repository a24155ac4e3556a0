"""Whatever clients, robots and the fleet do, an order of a classic fleet runs at most once, on one robot, and its end stays."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from tests.support.examples import examples
from tests.unit.sim.fleets.anything import happen, queued
from tests.unit.sim.fleets.classic import FleetAsker

ENDS = ("Done", "Aborted", "Invalid")
ROBOTS = st.sampled_from([1, 2])
ORDERS = st.integers(1, 6)
STEPS = st.one_of(
    st.tuples(st.just("order"), st.sampled_from(["Home", "Deliver"]), st.sampled_from([0, 1, 2])),
    st.tuples(st.just("delete"), ORDERS),
    st.tuples(st.just("delete waiting")),
    st.tuples(st.just("move"), ORDERS, ROBOTS),
    st.tuples(st.just("pass"), st.floats(0.1, 90)),
    st.tuples(st.just("reboot"), st.sampled_from(["kept", "lost"])),
    st.tuples(st.just("state"), st.sampled_from(["normal", "maintenance"])),
    st.tuples(st.just("turn"), st.sampled_from(["charging_below", "staging_after"]), st.sampled_from([None, 20, 90])),
    st.tuples(st.just("cut off"), st.sampled_from([[], ["Aino"], ["Aino", "Veikko"]])),
    st.tuples(st.just("active"), ROBOTS, st.booleans()),
    st.tuples(st.just("robot"), ROBOTS, st.sampled_from(["pause", "resume", "clear_errors", "reboot", "fail"])),
)


class Hall(FleetAsker):
    def do(self, what: str, *values: Any) -> None:
        match what:
            case "order":
                self.order(values[0], robot_id=values[1])
            case "delete":
                self.send("DELETE", f"/mission_scheduler/{values[0]}")
            case "delete waiting":
                self.send("DELETE", "/mission_scheduler")
            case "move":
                self.send("PUT", f"/mission_scheduler/{values[0]}", {"robot_id": values[1]})
            case "pass":
                self.pass_time(values[0])
            case "reboot":
                self.control(knobs={"waiting_after_reboot": values[0]}, reboot_seconds=10)
                self.pass_time(10)
            case "state":
                self.send("PUT", "/status", {"state": values[0]})
            case "turn":
                self.control(knobs={values[0]: values[1]})
            case "cut off":
                self.control(out_of_contact=values[0])
            case "active":
                self.send("PUT", f"/robots/{values[0]}", {"active": values[1]})
            case "robot":
                happen(self.robots[values[0] - 1], values[1])

    def orders(self) -> dict[str, Any]:
        return {one["fleet_schedule_guid"]: one for one in self.get("/mission_scheduler?whitelist=all")}


@examples(200)
@given(steps=st.lists(STEPS, max_size=25))
def test_an_order_runs_at_most_once_and_its_end_stays(steps: list[tuple[Any, ...]]) -> None:
    hall = Hall()
    ended: dict[str, str] = {}
    robots: dict[str, int] = {}
    for step in steps:
        hall.do(*step)
        assert max(queued(hall.fleet).values(), default=0) <= 1
        orders = hall.orders()
        assert {guid: orders[guid]["state"] for guid in ended} == ended
        ended |= {guid: one["state"] for guid, one in orders.items() if one["state"] in ENDS}
        given_out = {guid: one["robot_id"] for guid, one in orders.items() if one["state"] in ("Outbound", "Executing")}
        assert all(robots.get(guid, number) == number for guid, number in given_out.items())
        robots |= given_out
        numbers = [one["id"] for one in orders.values()]
        assert numbers == sorted(set(numbers), reverse=True)
    everything_ends(hall)


def everything_ends(hall: Hall) -> None:
    """Once nothing is in the way, all orders end, as their robots say."""
    hall.do("state", "normal")
    hall.do("turn", "charging_below", None)
    hall.do("turn", "staging_after", None)
    hall.do("cut off", [])
    for number in (1, 2):
        hall.do("active", number, True)
    for _ in range(2):  # also of a robot that was offline
        for robot in hall.robots:
            happen(robot, "clear_errors")
            happen(robot, "resume")
        hall.pass_time(60)
    hall.pass_time(3600)
    orders = hall.orders()
    charging = [one for one in orders.values() if one["mission_name"] == "Return to charger"]
    assert {one["state"] for one in orders.values() if one not in charging} <= set(ENDS)
    items = {item.fleet_schedule_guid: str(item.state) for robot in hall.robots for item in robot.queue}
    assert all(items.get(guid, "Done") == "Done" for guid, one in orders.items() if one["state"] == "Done")
    assert all(orders[guid]["state"] == state for guid, state in items.items() if state in ENDS and guid in orders)
