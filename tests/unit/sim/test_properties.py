"""Invariants under any sequence of requests, commands, faults and pauses, drawn by hypothesis."""

from __future__ import annotations

from typing import Any

from hypothesis import HealthCheck
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from mir_sim import Fate
from mir_sim.definition import SOFTWARE
from tests.support.examples import examples
from tests.unit.sim.asking import GUIDS, Asker

ENDED = ("Done", "Aborted")
PATHS = st.sampled_from(
    ["/status", "/missions", "/mission_queue", "/mission_queue/1", "/registers/1", "/nothing", "/users/me", "/maps"]
)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=6,
)
STATUS_FIELDS = st.sampled_from(
    ["state_id", "mode_id", "clear_error", "position", "name", "map_id", "answer", "guid", "datetime"]
)
FAULTS = st.sampled_from(
    ["drop_request", "drop_response", "delay", "late", "hang", "status_503", "html", "truncate", "garbage"]
)


class RobotMachine(RuleBasedStateMachine):
    """A robot and a client that sends anything."""

    @initialize(software=st.sampled_from(SOFTWARE), seed=st.integers(0, 5), battery=st.sampled_from([0.4, 30.0, 95.0]))
    def switch_on(self, software: str, seed: int, battery: float) -> None:
        self.asker = Asker(software=software, seed=seed, battery=battery, failure_rate=0.2, history=3)
        self.items: dict[int, dict[str, Any]] = {}
        self.aborting: dict[int, float] = {}
        self.metres = 0.0
        self.tokens = 0

    # What may happen

    @rule(mission=st.sampled_from(sorted(GUIDS)), priority=st.integers(-5, 5))
    def order(self, mission: str, priority: int) -> None:
        self.tokens += 1
        body = {"mission_id": GUIDS[mission], "priority": priority, "description": f"token {self.tokens}"}
        answer = self.asker.exchange("POST", "/mission_queue", body)
        if answer.fate is Fate.ANSWERED and answer.response is not None and answer.response.status == 201:
            with_token = [item for item in self.asker.robot.queue if item.description == f"token {self.tokens}"]
            assert len(with_token) == 1

    @rule(seconds=st.floats(0, 400))
    def pass_time(self, seconds: float) -> None:
        self.asker.pass_time(seconds)

    @rule(number=st.integers(-1, 12))
    def cancel(self, number: int) -> None:
        item = self.asker.robot.queue.get(number)
        ended = item is not None and item.state in ENDED
        before, run = item.full() if item is not None else None, self.asker.robot.run
        answer = self.asker.exchange("DELETE", f"/mission_queue/{number}")
        if (
            item is not None
            and answer.fate is Fate.ANSWERED
            and answer.response is not None
            and answer.response.status == 204
        ):
            assert item.state in ("Abort", "Aborted") or ended
            assert not ended or item.full() == before
            assert self.asker.robot.run is run or (run is not None and run.item is item)

    @rule()
    def cancel_all(self) -> None:
        answer = self.asker.send("DELETE", "/mission_queue")
        assert answer.status != 204 or all(item.state == "Abort" for item in self.open_items())

    @rule(state=st.sampled_from([3, 4, 11]), mode=st.sampled_from([3, 7, 7, 7]), clear=st.booleans())
    def put_status(self, state: int, mode: int, clear: bool) -> None:
        self.asker.send(
            "PUT", "/status", {"state_id": state, "mode_id": mode, **({"clear_error": True} if clear else {})}
        )

    @rule(
        commands=st.sampled_from(
            [
                {"battery": 5},
                {"battery": 90},
                {"emergency_stop": True},
                {"emergency_stop": False},
                {"error": {"code": 10120, "description": "Blocked"}},
                {"error": {"code": 1, "description": "Hot"}},
                {"error": None},
                {"fail_next_mission": "Blocked"},
                {"reboot_seconds": 15},
                {"user_prompt": {"question": "?", "timeout": 30}},
                {"fault": None},
            ]
        )
    )
    def control(self, commands: dict[str, Any]) -> None:
        self.asker.control(**commands)

    @rule(kind=FAULTS, count=st.sampled_from([1, 2, None]), seconds=st.floats(0, 60))
    def inject_fault(self, kind: str, count: int | None, seconds: float) -> None:
        self.asker.control(fault={"kind": kind, "count": count, "seconds": seconds})

    @rule(
        method=st.sampled_from(["GET", "PUT", "POST", "DELETE"]),
        path=PATHS,
        body=JSON | st.dictionaries(STATUS_FIELDS, JSON, max_size=3),
    )
    def ask_anything(self, method: str, path: str, body: Any) -> None:
        response = self.asker.send(method, path, body)
        assert response.status in (200, 201, 204, 400, 404, 409, 410, 500, 503)
        if response.status >= 400:
            assert set(response.json()) == {"error_code", "error_human"}

    # What always holds

    def open_items(self) -> list[Any]:
        return [item for item in self.asker.robot.queue if item.state not in ENDED]

    @invariant()
    def at_most_one_item_executes_or_aborts_and_what_executes_is_the_robots_run(self) -> None:
        busy = [item for item in self.asker.robot.queue if item.state in ("Executing", "Abort")]
        run = self.asker.robot.run
        assert len(busy) <= 1
        assert [item for item in busy if item.state == "Executing"] == ([run.item] if run is not None else [])

    @invariant()
    def an_abort_is_short_and_ends_as_cancelled_by_the_user(self) -> None:
        for item in self.asker.robot.queue:
            before = self.aborting.pop(item.id, None)
            if item.state == "Abort":
                since = self.aborting[item.id] = self.asker.robot.now if before is None else before
                assert self.asker.robot.now < since + 0.5
            elif before is not None:
                assert (item.state, item.message) == ("Aborted", "Aborted - User Request")

    @invariant()
    def ids_ascend_and_no_item_vanishes(self) -> None:
        numbers = [item.id for item in self.asker.robot.queue]
        assert numbers == sorted(set(numbers))
        assert set(self.items) <= set(numbers)

    @invariant()
    def what_has_ended_stays_as_it_is(self) -> None:
        for item in self.asker.robot.queue:
            now, before = item.full(), self.items.get(item.id)
            if before is not None:
                assert before["state"] not in ENDED or now == before
                assert now["mission_id"] == before["mission_id"] or before["state"] == "Pending"
                assert (now["description"], now["ordered"]) == (before["description"], before["ordered"])
                assert now["state"] != "Pending" or before["state"] == "Pending"
                assert before["state"] != "Abort" or now["state"] in ("Abort", "Aborted")
            self.items[item.id] = now

    @invariant()
    def times_of_an_item_follow_its_state(self) -> None:
        for item in self.asker.robot.queue:
            assert (item.finished is not None) == (item.state in ENDED)
            assert (item.started is not None) or item.state in ("Pending", "Aborted")
            assert item.state != "Pending" or item.started is None

    @invariant()
    def the_odometer_never_falls_and_the_battery_keeps_its_bounds(self) -> None:
        robot = self.asker.robot
        assert robot.controller.odometer >= self.metres - 1e-6
        self.metres = robot.controller.odometer
        assert 0.0 <= robot.battery.at(robot.now) <= 100.0

    @invariant()
    def a_held_robot_stands(self) -> None:
        robot = self.asker.robot
        if robot.state not in (5, 9):
            assert (robot.motion.linear, robot.motion.angular) == (0.0, 0.0)

    @invariant()
    def the_status_is_whole_and_means_the_state(self) -> None:
        status = self.asker.send("GET", "/status")
        if status.status == 200:
            shown = status.json()
            assert shown["state_id"] == self.asker.robot.state
            assert (shown["mission_queue_id"] is None) == (self.asker.robot.run is None)


RobotMachine.TestCase.settings = examples(60, stateful_step_count=40, suppress_health_check=list(HealthCheck))
TestRobotMachine = RobotMachine.TestCase
