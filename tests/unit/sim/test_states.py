"""Pause, error, emergency stop, manual control, reboot, battery: what holds the queue and what releases it."""

from __future__ import annotations

import json
from typing import Any

import pytest

from mir_sim import Fate
from tests.unit.sim.asking import Asker


def test_pause_freezes_the_running_mission_and_holds_the_queue(aino: Asker) -> None:
    running, waiting = aino.order(), aino.order()
    aino.pass_time(8)
    status = aino.put_status(state_id=4)
    assert (status["state_id"], status["state_text"], status["velocity"]["linear"]) == (4, "Pause", 0.0)
    place, metres = status["position"], status["moved"]
    aino.pass_time(3600)
    status = aino.status()
    assert (status["position"], status["moved"], status["mission_queue_id"]) == (place, metres, running)
    assert (aino.state_of(running), aino.state_of(waiting)) == ("Executing", "Pending")
    assert aino.put_status(state_id=3)["state_text"] == "Executing"
    aino.pass_until_done(waiting)


def test_a_paused_mission_takes_as_much_longer_as_the_pause_was() -> None:
    def minutes(pause: float) -> float:
        asker = Asker()
        number = asker.order("Deliver")
        asker.pass_time(20)
        asker.put_status(state_id=4)
        asker.pass_time(pause)
        asker.put_status(state_id=3)
        asker.pass_until_done(number)
        return asker.robot.now

    assert minutes(100) - minutes(0) == pytest.approx(100, abs=0.6)


def test_continue_without_a_mission_is_ready(aino: Asker) -> None:
    aino.put_status(state_id=4)
    assert aino.put_status(state_id=3)["state_text"] == "Ready"


@pytest.mark.parametrize(
    ("fields", "shown"),
    [({"state_id": 11}, ("state_text", "ManualControl")), ({"mode_id": 3}, ("mode_text", "Mapping"))],
)
def test_under_manual_control_and_while_mapping_nothing_starts(
    aino: Asker, fields: dict[str, object], shown: tuple[str, str]
) -> None:
    assert shown in aino.put_status(**fields).items()
    number = aino.run_for(60, "Home")
    assert aino.state_of(number) == "Pending"
    aino.put_status(state_id=3, mode_id=7)
    aino.pass_until_done(number)


# ---------------------------------------------------------------------- errors
def test_a_failed_mission_is_aborted_with_its_text_and_the_robot_is_in_error(aino: Asker) -> None:
    aino.control(fail_next_mission="Failed to reach goal position 'Line 1'")
    failed, next_one = aino.order(), aino.order()
    aino.pass_time(120)
    item, status = aino.item(failed), aino.status()
    assert (item["state"], item["message"]) == ("Aborted", "Failed to reach goal position 'Line 1'")
    assert (status["state_id"], status["errors"][0]["code"], status["mission_text"]) == (12, 10120, item["message"])
    assert aino.state_of(next_one) == "Pending"
    assert aino.put_status(state_id=3)["state_id"] == 12  # not without clearing
    assert aino.put_status(clear_error=True)["state_text"] == "Pause"  # never straight to Ready
    assert aino.state_of(next_one, after=60) == "Pending"
    aino.put_status(state_id=3)
    aino.pass_until_done(next_one)


def test_only_the_next_mission_fails(aino: Asker) -> None:
    first = aino.run_for(3, "Home")
    aino.control(fail_next_mission="Blocked")
    second = aino.run_for(120, "Home")
    assert (aino.state_of(first), aino.state_of(second)) == ("Done", "Aborted")
    aino.put_status(clear_error=True, state_id=3)
    assert aino.state_of(aino.run_for(60, "Home")) == "Done"


def test_an_error_lasts_until_its_cause_ended_and_the_client_has_cleared_it(aino: Asker) -> None:
    number = aino.run_for(5)
    aino.control(error={"code": 701, "description": "Left motor too hot"})
    assert aino.status()["errors"] == [
        {"code": 701, "description": "Left motor too hot", "module": "MissionController", "non_resettable": False}
    ]
    assert aino.put_status(clear_error=True)["state_id"] == 12
    aino.control(error=None)
    assert aino.status()["state_id"] == 12
    assert aino.put_status(clear_error=True)["state_id"] == 4
    assert aino.state_of(number) == "Executing"  # held, not ended
    aino.put_status(state_id=3)
    aino.pass_until_done(number)


def test_an_error_of_the_mission_controller_ends_the_running_mission(aino: Asker) -> None:
    number = aino.run_for(5)
    aino.control(error={"code": 10120, "description": "Failed to reach goal position 'Line 1'"})
    assert (aino.item(number)["state"], aino.item(number)["message"]) == (
        "Aborted",
        "Failed to reach goal position 'Line 1'",
    )


def test_errors_are_reported_in_the_log(aino: Asker) -> None:
    aino.control(error={"code": 10201, "description": "Localization failed"})
    listed = aino.get("/log/error_reports")
    assert [set(entry) for entry in listed] == [{"id", "url"}]
    report = aino.get(listed[0]["url"].removeprefix("/v2.0.0"))
    assert (report["description"], report["ready"]) == ("Localization failed", True)


def test_missions_that_fail_by_chance_have_template_texts_on_the_older_software() -> None:
    for software, is_template in (("2.14.7", True), ("3.5.4", False)):
        asker = Asker(software=software, failure_rate=1.0)
        number = asker.order()
        asker.pass_time(60)
        text = asker.item(number)["message"]
        assert text.startswith("{") is is_template
        if is_template:
            template = json.loads(text)
            assert (
                template["message"] % template["args"]
                == f"Failed to reach goal position '{template['args']['position_name']}'"
            )


# ---------------------------------------------------------------------- emergency stop
def test_emergency_stop_cuts_the_battery_monitor_and_cannot_be_left_through_the_api(aino: Asker) -> None:
    number = aino.run_for(5)
    aino.control(emergency_stop=True)
    status = aino.status()
    assert (status["state_id"], status["state_text"]) == (10, "EmergencyStop")
    assert (status["battery_percentage"], status["battery_time_remaining"], status["errors"]) == (-1.0, -1, [])
    for fields in ({"state_id": 3}, {"state_id": 4}, {"state_id": 11}, {"clear_error": True}):
        assert aino.put_status(**fields)["state_id"] == 10
    assert aino.state_of(number, after=600) == "Executing"
    aino.control(emergency_stop=False)
    status = aino.status()
    assert (status["state_id"], status["battery_percentage"] > 70) == (4, True)
    aino.put_status(state_id=3)
    aino.pass_until_done(number)


def test_setting_the_clock_restarts_the_api_and_stops_the_robot(aino: Asker) -> None:
    assert aino.exchange("PUT", "/status", {"datetime": "2027-01-01T12:00:00"}).fate is Fate.HELD
    assert aino.send("GET", "/status").status == 503
    aino.pass_time(6)
    assert aino.status()["state_text"] == "EmergencyStop"
    assert aino.robot.stamp().startswith("2027-01-01T12:00:0")


# ---------------------------------------------------------------------- while aborting
@pytest.mark.parametrize(
    ("commands", "fields"),
    [
        ({}, {"state_id": 4}),
        ({}, {"state_id": 11}),
        ({}, {"mode_id": 3}),
        ({"emergency_stop": True}, {}),
        ({"error": {"code": 10120, "description": "Blocked"}}, {}),
        ({"error": {"code": 701, "description": "Hot"}}, {}),
        ({"reboot_seconds": 5}, {}),
    ],
)
def test_whatever_happens_an_abort_comes_to_its_end(
    aino: Asker, commands: dict[str, object], fields: dict[str, object]
) -> None:
    number = aino.run_for(8)
    aino.send("DELETE", f"/mission_queue/{number}")
    assert aino.state_of(number) == "Abort"
    if commands:
        aino.control(**commands)
    if fields:
        aino.put_status(**fields)
    aino.pass_time(10)
    item = aino.item(number)
    assert (item["state"], item["message"]) == ("Aborted", "Aborted - User Request")
    assert item["finished"] is not None


def test_a_held_item_can_still_be_cancelled(aino: Asker) -> None:
    number = aino.run_for(8)
    aino.put_status(state_id=4)
    aino.send("DELETE", f"/mission_queue/{number}")
    assert (aino.state_of(number), aino.status()["state_text"]) == ("Abort", "Pause")
    aino.pass_time(1)
    assert (aino.state_of(number), aino.status()["state_text"]) == ("Aborted", "Pause")


# ---------------------------------------------------------------------- reboot
def test_a_robot_that_reboots_shows_that_it_shuts_down_and_keeps_its_queue(aino: Asker) -> None:
    done = aino.run_for(60, "Home")
    running, waiting = aino.order(), aino.order("Home")
    aino.pass_time(5)
    aino.control(reboot_seconds=20)
    status = aino.status()
    assert (status["state_id"], status["state_text"]) == (2, "ShuttingDown")
    assert aino.put_status(state_id=3)["state_id"] == 2
    aino.control(reboot_seconds=3600)  # being sent already
    aino.pass_time(1)
    assert aino.exchange("GET", "/status").fate is Fate.REFUSED
    aino.pass_time(21)
    status = aino.status()
    assert (status["state_id"], status["state_text"], status["uptime"]) == (1, "Starting", 1)
    assert [aino.state_of(number) for number in (done, running, waiting)] == ["Done", "Aborted", "Pending"]
    aino.pass_until_done(waiting)


def test_the_seconds_of_a_reboot_are_real_ones() -> None:
    asker = Asker(time_scale=100)
    asker.control(reboot_seconds=2)
    asker.pass_time(1)  # shutting down
    assert not asker.robot.online
    asker.pass_time(199)
    assert not asker.robot.online
    asker.pass_time(2)
    assert asker.robot.online


# ---------------------------------------------------------------------- battery
def test_standing_driving_and_charging_change_the_battery(aino: Asker) -> None:
    aino.pass_time(3600)
    assert 75 < aino.status()["battery_percentage"] < 80
    aino.pass_until_done(aino.order("Charge to 80 %"))
    assert aino.status()["battery_percentage"] == pytest.approx(80, abs=0.1)


def test_an_empty_battery_is_an_error_until_it_is_charged(aino: Asker) -> None:
    aino.control(battery=0.05)
    aino.pass_time(3600)
    status = aino.status()
    assert (status["battery_percentage"], status["state_id"]) == (0.0, 12)
    aino.control(battery=50)
    assert aino.put_status(clear_error=True)["state_id"] == 4


def test_a_charging_mission_lasts_until_the_next_item_comes(aino: Asker) -> None:
    charging = aino.order("Return to charger")
    aino.pass_until(lambda: aino.status()["mission_text"].startswith("Charging"))
    assert aino.status()["state_text"] == "Docked"
    aino.pass_time(10)
    assert aino.status()["state_text"] == "Executing"
    assert aino.status()["mission_text"].startswith("Charging until battery reaches 95% (Current: ")
    aino.pass_time(8 * 3600)
    assert (aino.state_of(charging), aino.status()["battery_percentage"]) == ("Executing", 100.0)
    assert aino.status()["mission_text"] == "Charging... Waiting for new mission..."
    following = aino.run_for(3, "Home")
    assert (aino.state_of(charging), aino.state_of(following)) == ("Done", "Executing")


def test_a_robot_held_on_its_charger_still_charges(aino: Asker) -> None:
    aino.order("Return to charger")
    aino.pass_until(lambda: aino.status()["mission_text"].startswith("Charging"))
    aino.put_status(state_id=4)
    before = aino.status()["battery_percentage"]
    aino.pass_time(600)
    assert aino.status()["battery_percentage"] > before + 5


# ---------------------------------------------------------------------- prompts
def asked(aino: Asker) -> tuple[int, Any]:
    """A mission that asks, and what it asks."""
    number = aino.order("Ask for release")
    aino.pass_until(lambda: aino.status()["user_prompt"] is not None)
    return number, aino.status()["user_prompt"]


def test_a_mission_asks_and_continues_when_answered(aino: Asker) -> None:
    number, prompt = asked(aino)
    assert (prompt["question"], prompt["options"], prompt["timeout"]) == ("Is the load secured?", ["Yes", "No"], 120.0)
    assert aino.send("PUT", "/status", {"answer": "Yes", "guid": "another"}).status == 400
    assert aino.put_status(answer="Yes", guid=prompt["guid"])["user_prompt"] is None
    aino.pass_until_done(number, 200)


def test_a_prompt_ends_with_its_time_or_its_mission(aino: Asker) -> None:
    number, _prompt = asked(aino)
    aino.pass_time(121)
    assert aino.status()["user_prompt"] is None
    aino.pass_until_done(number)
    number, _prompt = asked(aino)
    aino.send("DELETE", f"/mission_queue/{number}")
    assert aino.status()["user_prompt"] is None


def test_a_prompt_from_outside_holds_the_mission(aino: Asker) -> None:
    number = aino.order("Home")
    aino.control(user_prompt={"question": "Is the aisle free?", "options": ["Yes", "No"], "timeout": 60})
    assert aino.state_of(number, after=30) == "Pending"
    prompt = aino.status()["user_prompt"]
    assert prompt["timeout"] == 60
    aino.put_status(answer="Yes", guid=prompt["guid"])
    assert aino.state_of(number, after=60) == "Done"
