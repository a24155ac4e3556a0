"""Orders of Fleet Enterprise: their states, one id once, phases, cancelling, changing, and what the fleet forgets."""

from __future__ import annotations

import pytest

from tests.unit.sim.asking import GUIDS
from tests.unit.sim.fleets.enterprise_asking import EnterpriseAsker, uuid_of


def test_an_order_goes_through_its_states(client: EnterpriseAsker) -> None:
    assert (client.post(robot_id=client.veikko.guid).status, client.status()) == (201, "Pending")
    seen = []
    while client.status() != "Finished":
        seen.append(client.status())
        client.pass_time(0.25)
    assert list(dict.fromkeys(seen)) == ["Pending", "Outbound", "Executing"]
    order = client.order()
    assert (order["robot-name"], order["mission-name"], order["api-key-name"]) == ("Veikko", "Home", "Scheduler")
    times = [order[f"order-{name}"] for name in ("created", "started", "finished")]
    assert times == sorted(times)


def test_an_order_is_shown_as_it_was_posted_and_without_a_state(client: EnterpriseAsker) -> None:
    client.post(priority="High", earliest_start_time="2026-11-23T07:00:00Z")
    assert client.get(f"/serial-order/{uuid_of('one')}") == {
        "id": uuid_of("one"),
        "priority": "High",
        "earliest-start-time": "2026-11-23T07:00:00Z",
        "robot-id": None,
        "phases": [
            {
                "mission-id": GUIDS["Home"],
                "arguments": [],
                "fallback-mission-id": None,
                "order-id": uuid_of("one 0"),
            }
        ],
    }


def test_a_known_id_is_refused_and_starts_nothing(client: EnterpriseAsker) -> None:
    assert [client.post().status for _ in range(2)] == [201, 409]
    client.run_to_end()
    assert client.post().status == 409
    assert client.runs(after=60) == 1


def test_an_order_id_of_a_phase_is_not_used_twice(client: EnterpriseAsker) -> None:
    client.post()
    assert client.post("two", phase={"order-id": uuid_of("one 0")}).status == 409


@pytest.mark.parametrize(("kept", "at_end", "later"), [(None, 409, 409), (0.0, 201, 201), (50.0, 409, 201)])
def test_an_id_can_be_used_again_once_it_is_forgotten(kept: float | None, at_end: int, later: int) -> None:
    for seconds, status in ((0, at_end), (60, later)):
        client = EnterpriseAsker(ids_kept=kept)
        client.post()
        client.run_to_end()
        client.pass_time(seconds)
        assert client.post().status == status


def test_an_ended_order_is_not_found_once_it_is_forgotten() -> None:
    client = EnterpriseAsker(orders_kept=30.0)
    client.post()
    client.run_to_end()
    client.pass_time(31)
    paths = (f"/serial-order/{uuid_of('one')}", f"/order/{uuid_of('one 0')}")
    assert [client.send("GET", path).status for path in paths] == [404, 404]
    assert client.get("/order") == []


def test_an_accepted_order_comes_within_five_seconds_and_once() -> None:
    client = EnterpriseAsker(posted="accepted")
    assert [(one.status, one.body) for one in [client.post() for _ in range(2)]] == [(202, b"")] * 2
    assert client.send("GET", f"/serial-order/{uuid_of('one')}").status == 404
    client.pass_time(5)
    assert client.send("GET", f"/serial-order/{uuid_of('one')}").status == 200
    assert client.post().status == 409
    client.run_to_end()
    assert client.runs(after=60) == 1


def test_a_lost_order_never_comes() -> None:
    client = EnterpriseAsker(posted="lost")
    assert client.post().status == 202
    client.pass_time(60)
    assert client.send("GET", f"/serial-order/{uuid_of('one')}").status == 404


def test_any_robot_means_one_that_is_free_and_is_said_once_it_is_chosen(client: EnterpriseAsker) -> None:
    client.aino.robot.pause()
    client.post()
    assert (client.order()["robot-id"], client.events()[None]["robot-id"]) == (None, "")
    client.run_until("Executing")
    assert client.order()["robot-id"] == client.events()[None]["robot-id"] == client.veikko.guid


def test_an_order_waits_for_its_earliest_start(client: EnterpriseAsker) -> None:
    client.post(earliest_start_time="2026-11-23T06:01:00Z")
    client.pass_time(59)
    assert (client.status(), client.events()[None]["state"]) == ("Waiting", "Pending")
    assert client.status(after=3) == "Executing"


def test_phases_run_one_after_the_other_on_one_robot_and_nothing_comes_between(client: EnterpriseAsker) -> None:
    client.post("one", "Deliver", "Wait at home", robot_id=client.aino.guid)
    client.run_until("Executing")
    client.post("two", robot_id=client.aino.guid, priority="High")
    assert [client.status(number=number) for number in (0, 1)] == ["Executing", "Waiting"]
    assert [client.events()[index]["state"] for index in (None, 0, 1)] == ["Executing", "Executing", "Created"]
    assert [client.events()[index]["is-fallback"] for index in (None, 0, 1)] == [None, False, False]
    client.run_until("Executing", number=1)
    assert (client.status(), client.status("two")) == ("Finished", "Pending")
    assert client.run_to_end(number=1) == "Finished"
    assert client.run_to_end("two") == "Finished"
    missions = [item.fleet_schedule_guid for item in client.aino.robot.queue]
    assert missions == [uuid_of("one 0"), uuid_of("one 1"), uuid_of("two 0")]


def test_a_failed_phase_ends_the_order_and_its_robot_says_why(client: EnterpriseAsker) -> None:
    client.aino.robot.fail_next = "Failed to reach goal position 'Home'"
    client.post("one", "Home", "Deliver", robot_id=client.aino.guid)
    assert client.run_to_end() == "Aborted"
    assert client.status(number=1, after=2) == "Aborted"
    last = client.order()["actions"][-1]
    assert (last["action-status"], last["action-text"]) == ("Failed", "Failed to reach goal position 'Home'")


def test_a_cancelled_mission_has_an_aborted_action(client: EnterpriseAsker) -> None:
    client.post("one", "Deliver")
    client.run_until("Executing")
    client.pass_time(15)
    client.send("DELETE", f"/serial-order/{uuid_of('one')}")
    client.run_to_end()
    assert [one["action-status"] for one in client.order()["actions"]] == ["Aborted"]


def test_a_fallback_mission_runs_after_an_aborted_phase(client: EnterpriseAsker) -> None:
    client.post(phase={"fallback-mission-id": GUIDS["Wait at home"]}, robot_id=client.aino.guid)
    client.run_until("Executing")
    client.send("DELETE", f"/serial-order/{uuid_of('one')}")
    client.run_to_end()
    client.pass_time(5)
    assert (client.events()[0]["is-fallback"], client.events()[0]["state"]) == (True, "Executing")
    assert client.events()[None]["state"] == "Aborting"
    assert client.send("DELETE", f"/serial-order/fallback/{uuid_of('one')}").status == 202
    client.pass_time(3)
    assert client.events() == {}
    assert client.send("DELETE", f"/serial-order/fallback/{uuid_of('one')}").status == 400


@pytest.mark.parametrize("status", ["Pending", "Executing"])
def test_cancelling_takes_a_while(client: EnterpriseAsker, status: str) -> None:
    client.post("before", "Wait at home", robot_id=client.aino.guid)
    client.run_until("Executing", name="before")
    client.post(robot_id=client.aino.guid if status == "Pending" else client.veikko.guid)
    client.run_until(status)
    response = client.send("DELETE", f"/serial-order/{uuid_of('one')}")
    assert (response.status, response.json()) == (202, {"id": uuid_of("one")})
    assert (client.status(), client.events()[None]["state"]) == ("Aborting", "Aborting")
    client.pass_time(4)
    assert (client.status(), client.events()) == ("Aborted", {})
    assert client.send("DELETE", f"/serial-order/{uuid_of('one')}").status == 400


def test_an_order_that_ends_before_it_is_cancelled_has_finished() -> None:
    client = EnterpriseAsker(abort_seconds=60.0)
    client.post()
    client.run_until("Executing")
    assert client.send("DELETE", f"/serial-order/{uuid_of('one')}").status == 202
    assert client.run_to_end() == "Finished"
    assert client.status(after=60) == "Finished"


def test_a_waiting_order_can_be_changed(client: EnterpriseAsker) -> None:
    for vehicle in client.fleet.vehicles:
        vehicle.robot.pause()
    client.post()
    changes = {"serial-order-id": uuid_of("one"), "priority": "Low", "robot-id": client.veikko.guid}
    assert client.send("PATCH", "/serial-order", changes).status == 202
    shown = client.get(f"/serial-order/{uuid_of('one')}")
    assert (shown["priority"], shown["robot-id"]) == ("Low", client.veikko.guid)
    phase = {"mission-id": GUIDS["Deliver"]}
    body = {"serial-order-id": uuid_of("one"), "index": 0, "phase": phase}
    assert client.send("PUT", "/serial-order/phase", body).status == 202
    for vehicle in client.fleet.vehicles:
        vehicle.robot.resume()
    client.run_until("Executing")
    assert (client.order()["robot-name"], client.order()["mission-name"]) == ("Veikko", "Deliver")
    assert client.send("PATCH", "/serial-order", changes).status == 400
    assert client.send("PUT", "/serial-order/phase", body).status == 400


def test_a_change_of_an_unknown_order_or_to_an_unknown_robot_is_refused(client: EnterpriseAsker) -> None:
    client.post(earliest_start_time="2026-11-23T07:00:00Z")
    for order, robot in (("nothing", client.aino.guid), ("one", uuid_of("nothing"))):
        body = {"serial-order-id": uuid_of(order), "robot-id": robot}
        assert client.send("PATCH", "/serial-order", body).status == 400


def test_orders_come_by_their_priority(client: EnterpriseAsker) -> None:
    client.post("first", "Wait at home", robot_id=client.aino.guid)
    client.run_until("Executing", name="first")
    for priority in ("Low", "Medium", "High"):
        client.post(priority, robot_id=client.aino.guid, priority=priority)
    client.run_to_end("Low")
    queue = [item.fleet_schedule_guid for item in client.aino.robot.queue]
    assert queue[1:] == [uuid_of(f"{priority} 0") for priority in ("High", "Medium", "Low")]


def test_while_its_fallback_runs_the_snapshot_says_why_a_phase_failed(client: EnterpriseAsker) -> None:
    client.aino.robot.fail_next = "Failed to reach goal position 'Home'"
    client.post(phase={"fallback-mission-id": GUIDS["Deliver"]}, robot_id=client.aino.guid)
    client.run_to_end()
    events = client.get("/serial-order-status/snapshot")["serial-order-status-events"]
    assert [(one["mission-id"], one["state"], one["message"]) for one in events] == [
        (GUIDS["Home"], "Aborting", None),
        (GUIDS["Home"], "Aborted", "Failed to reach goal position 'Home'"),
        (GUIDS["Deliver"], "Pending", None),
    ]


def test_a_phase_without_mission_waits_for_one(client: EnterpriseAsker) -> None:
    client.post(phase={"mission-id": None})
    client.pass_time(5)
    event = client.events()[0]
    assert (event["state"], event["message"]) == ("WaitingForInput", "Missing MissionId")
    body = {"serial-order-id": uuid_of("one"), "index": 0, "phase": {"mission-id": GUIDS["Home"]}}
    assert client.send("PUT", "/serial-order/phase", body).status == 202
    assert client.events()[0]["state"] == "Pending"
    assert client.send("PUT", "/serial-order/phase", {**body, "phase": {}}).status == 400
    assert client.run_to_end() == "Finished"


def test_the_list_has_what_runs_and_what_ended_within_the_hour(client: EnterpriseAsker) -> None:
    client.post("first", robot_id=client.aino.guid)
    client.run_to_end("first")
    client.pass_time(3000)
    client.post("second", "Deliver", robot_id=client.aino.guid)
    client.pass_time(10)
    client.post("third", robot_id=client.aino.guid)

    def listed(query: str = "") -> list[str]:
        names = {uuid_of(f"{name} 0"): name for name in ("first", "second", "third")}
        return [names[one["order-id"]] for one in client.get(f"/order{query}")]

    assert listed() == ["first", "second"]
    assert listed("?orderStatuses=Pending&orderStatuses=Executing") == ["second", "third"]
    assert listed("?createdAfter=2026-11-23T06:30:00Z") == ["second"]
    client.run_to_end("third")
    client.pass_time(1000)
    assert listed() == ["second", "third"]
    assert listed("?terminatedAfter=2026-11-23T06:00:00Z") == ["first", "second", "third"]
    assert client.send("GET", "/order?createdAfter=yesterday").status == 400


def test_orders_of_others_are_in_the_list_too(client: EnterpriseAsker) -> None:
    client.fleet.order_of_somebody(GUIDS["Deliver"])
    client.fleet.order_of_somebody(GUIDS["Charge to 80 %"], client.veikko, "Charging")
    client.pass_time(5)
    listed = [(one["order-type"], one["user-name"], one["api-key-name"]) for one in client.get("/order")]
    assert listed == [("User", "Operator", None), ("Charging", None, None)]
    events = client.get("/serial-order-status/snapshot")["serial-order-status-events"]
    assert [one["order-type"] for one in events if one["phase-index"] is None] == ["Ui", "Autocharging"]


def test_events_say_since_when_a_state_is_so(client: EnterpriseAsker) -> None:
    client.post("one", "Deliver", robot_id=client.aino.guid)
    client.run_until("Executing")
    since = client.events()[0]["state-change-timestamp"]
    client.pass_time(10)
    assert client.events()[0]["state-change-timestamp"] == since
    client.aino.robot.pause()
    client.pass_time(2)
    event = client.events()[0]
    assert event["state"] == "Paused"
    assert event["state-change-timestamp"] > since
    assert client.status() == "Executing"


def test_a_restart_keeps_or_forgets_what_no_robot_has(client: EnterpriseAsker) -> None:
    for name in ("one", "two"):
        client.post(name, "Deliver", robot_id=client.aino.guid)
    client.run_until("Executing")
    client.fleet.restart(5)
    client.pass_time(10)
    assert (client.status(), client.status("two")) == ("Executing", "Pending")
    client.fleet.restart(5, forgets_waiting=True)
    client.pass_time(10)
    assert client.send("GET", f"/serial-order/{uuid_of('two')}").status == 404
    assert client.events("two") == {}
    assert client.run_to_end() == "Finished"
    assert {one["action-status"] for one in client.order()["actions"]} == {"Succeeded"}
    assert client.post("two").status == 201


def test_a_change_that_comes_due_while_the_fleet_is_off_happens_when_it_is_back() -> None:
    client = EnterpriseAsker(posted="accepted", abort_seconds=3.0)
    client.post("one", "Deliver")
    client.fleet.restart(30)
    client.pass_time(29)
    assert client.fleet.active == []
    assert client.status(after=10) == "Executing"
    client.send("DELETE", f"/serial-order/{uuid_of('one')}")
    client.fleet.restart(30)
    client.pass_time(29)
    assert client.aino.robot.run is not None
    assert client.status(after=10) == "Aborted"


def test_the_same_requests_give_the_same_answers_whatever_is_read_between() -> None:
    answers = []
    for reads in (False, True):
        client = EnterpriseAsker(posted="accepted")
        client.post("one", "Deliver", phase={"order-id": None})
        seen = []
        for second in range(400):
            client.pass_time(0.25)
            if second == 99:
                client.aino.robot.pause()
            if reads or second % 50 == 49:
                read = [client.get(path) for path in ("/order", "/serial-order-status/snapshot")]
                seen += [read] if second % 50 == 49 else []
        answers.append(seen)
    assert answers[0] == answers[1]
    assert {order["order-status"] for orders, _ in answers[0] for order in orders} == {"Executing"}
