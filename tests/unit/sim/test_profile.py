"""Profiles: what they can say, what is wrong with one in a sentence, and what each of their keys does."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import mir_sim
from mir_sim import DEVIANTS, deviant
from mir_sim.checks import WrongValue
from mir_sim.profile import FAITHFUL, KEYS, REPORT, profile_of, read
from mir_sim.state import ModeId, StateId
from tests.unit.sim.asking import Asker

PAGE = (Path(__file__).parents[3] / "docs" / "simulator.md").read_text(encoding="utf-8")
SOURCES = "".join(path.read_text(encoding="utf-8") for path in Path(mir_sim.__file__).parent.rglob("*.py"))


def asker(**document: Any) -> Asker:
    return Asker(profile=profile_of(document))


@pytest.mark.parametrize(
    ("document", "says"),
    [
        ([], "A profile must be an object."),
        ({"sotfware": "3.5.4"}, "A profile has no 'sotfware'; known are about, software,"),
        ({"about": 1}, "about must be a text."),
        ({"software": "9.9"}, "software must be one of 2.14.7, 3.5.4, 3.8.1."),
        ({"software": 3.5}, "software must be one of 2.14.7, 3.5.4, 3.8.1."),
        ({"ignores": [["sort_by"]]}, "each of ignores must be one of whitelist, sort_by, limit, offset, filters."),
        ({"timezone": "Mars/Crater"}, "timezone must be a time zone such as Europe/Helsinki, not 'Mars/Crater'."),
        ({"timezone": ["x"]}, "timezone must be a text."),
        ({"clock_offset": "late"}, "clock_offset must be a number from -1000000 to 1000000."),
        ({"clock_drift": float("nan")}, "clock_drift must be a number from -3600 to 3600."),
        ({"search": "no"}, "search must be true or false."),
        ({"ignores": "sort_by"}, "ignores must be a list of names."),
        ({"ignores": ["sort"]}, "each of ignores must be one of whitelist, sort_by, limit, offset, filters."),
        ({"page_limit": 0}, "page_limit must be a whole number from 1."),
        ({"page_limit": True}, "page_limit must be a whole number from 1."),
        ({"fields": {"page": []}}, "fields has no 'page'; known are list, search, item, order, status."),
        ({"fields": {"list": ["colour"]}}, "each of fields.list must be one of actions,"),
        ({"fields": {"status": ["colour"]}}, "each of fields.status must be one of allowed_methods,"),
        ({"order_status": 500}, "order_status must be a whole number from 200 to 299."),
        ({"description_field": "state"}, "description_field must not be 'state', which items have already."),
        ({"description_field": ""}, "description_field must be a text."),
        (
            {"description_text": None, "texts": ["a"]},
            "texts must be an object of phrases and what is said instead of each.",
        ),
        ({"texts": {"": "x"}}, "texts must be an object of phrases and what is said instead of each."),
        ({"texts": {"Ready": 3}}, "texts['Ready'] must be a text."),
        (
            {"item_states": {"Starting": "x"}},
            "item_states has no 'Starting'; known are Pending, Executing, Abort, Done, Aborted, Cancelled.",
        ),
        ({"latency": 3}, "latency must be a list of the least and the most seconds."),
        ({"latency": [9, 3]}, "latency must begin with the smaller number."),
        ({"latency": [-1, 3]}, "each of latency must be a number from 0 to 3600."),
        ({"reboots": {"requests": 3}}, "reboots lacks within_seconds, offline_seconds."),
        (
            {"reboots": {"requests": 0.5, "within_seconds": 1, "offline_seconds": 1}},
            "reboots.requests must be a whole number from 1.",
        ),
        ({"fleet": {"mission": "Fly", "every_seconds": 60}}, "fleet.mission must be one of Deliver, Home,"),
        ({"fleet": {"mission": "Home", "every_seconds": 0}}, "fleet.every_seconds must be a number from 1 to 1000000."),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(document: Any, says: str) -> None:
    with pytest.raises(WrongValue) as wrong:
        profile_of(document)
    assert str(wrong.value).startswith(says)
    assert str(wrong.value).endswith(".")


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"{", " is not JSON: "),
        (b"\xff", " is not UTF-8."),
        (None, " cannot be read: "),
        (b"[" * 100_000, " is not JSON: "),
        (b'{"latency": 3}', ": latency must be"),
    ],
)
def test_a_file_that_is_no_profile(tmp_path: Path, content: bytes | None, says: str) -> None:
    path = tmp_path / "odd.json"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(WrongValue) as wrong:
        read(path)
    assert str(wrong.value).startswith(f"{path}{says}")
    assert "\n" not in str(wrong.value)


def test_what_is_omitted_or_null_is_faithful() -> None:
    assert profile_of({}) == FAITHFUL
    assert profile_of(dict.fromkeys(KEYS)) == FAITHFUL
    assert set(KEYS) == {*FAITHFUL.__dataclass_fields__, REPORT}


@pytest.mark.parametrize("report", ["found", 17, ["a"], {"findings": [{"level": "red"}]}])
def test_other_findings_of_a_client_do_not_change_the_robot(report: object) -> None:
    assert profile_of({"report": report}) == FAITHFUL


@pytest.mark.parametrize("name", DEVIANTS)
def test_each_deviant_and_its_sentence_are_on_the_page(name: str) -> None:
    assert f"| `{name}` | {deviant(name).about} |" in PAGE


def test_the_page_names_every_key_and_its_example_is_a_profile() -> None:
    assert all(f"| `{key}` |" in PAGE for key in KEYS)
    example = PAGE.split("```json\n")[1].split("```")[0]
    shown = Asker(profile=profile_of(json.loads(example))).status()
    assert (shown["state_text"], shown["robot_model"]) == ("Klar", "MiR100")


def test_what_the_caller_says_wins_over_the_profile() -> None:
    robot = asker(software="2.14.7", timezone="Asia/Tokyo", clock_offset=60, model="MiR100").robot
    assert (robot.software, robot.clock.zone, robot.clock.offset, robot.model) == (
        "2.14.7",
        "Asia/Tokyo",
        60.0,
        "MiR100",
    )
    other = Asker(profile=robot.profile, software="3.8.1", timezone="UTC", clock_offset=0.0, clock_drift=1.0).robot
    assert (other.software, other.clock.zone, other.clock.offset, other.clock.drift, other.model) == (
        "3.8.1",
        "UTC",
        0.0,
        1.0,
        "MiR100",
    )


# ---------------------------------------------------------------------- what each key does
def test_the_fields_of_each_kind_of_answer() -> None:
    robot = asker(
        fields={
            "list": ["id", "mission_id"],
            "search": ["id"],
            "item": ["state"],
            "order": ["id", "priority"],
            "status": ["state_id", "state_text"],
        }
    )
    made = robot.send("POST", "/mission_queue", {"mission_id": mir_sim.MISSIONS[0].guid}).json()
    assert made == {"id": 1, "priority": 0}
    assert robot.get("/mission_queue") == [{"id": 1, "mission_id": mir_sim.MISSIONS[0].guid}]
    assert robot.get("/mission_queue?whitelist=id,state,url") == [{"id": 1}]
    assert robot.item(1) == {"state": "Pending"}
    assert set(robot.put_status(state_id=4)) == set(robot.status()) == {"state_id", "state_text"}
    ready = [{"fieldname": "state", "operator": "=", "value": "Pending"}]
    assert robot.send("POST", "/mission_queue/search", {"filters": ready}).json() == [
        {"id": 1}
    ]  # by a field that isn't shown


@pytest.mark.parametrize(
    ("ignored", "path", "ids"),
    [
        ("sort_by", "?sort_by=id,desc", [1, 2, 3]),
        ("limit", "?limit=1", [1, 2, 3]),
        ("offset", "?offset=2", [1, 2, 3]),
        ("whitelist", "?whitelist=state", [1, 2, 3]),
        ("filters", "/search", [1, 2, 3]),
    ],
)
def test_parameters_of_lists_that_are_ignored(ignored: str, path: str, ids: list[int]) -> None:
    robot = asker(ignores=[ignored])
    for _ in range(3):
        robot.order()
    answer = (
        robot.send(
            "POST", f"/mission_queue{path}", {"filters": [{"fieldname": "id", "operator": "=", "value": 2}]}
        ).json()
        if "search" in path
        else robot.get(f"/mission_queue{path}")
    )
    assert [one["id"] for one in answer] == ids


def test_what_a_post_answers() -> None:
    response = asker(order_status=200).send("POST", "/mission_queue", {"mission_id": mir_sim.MISSIONS[0].guid})
    assert (response.status, set(response.json())) == (200, {"id", "state", "url"})


def test_a_description_may_be_listed_inside_a_longer_text() -> None:
    robot = asker(description_text="{mission}: {description}", description_field="name")
    robot.order(description="{mission}")
    assert robot.item(1)["name"] == "Deliver: {mission}"
    assert "description" not in robot.item(1)
    assert robot.get("/mission_queue?sort_by=description,desc") == robot.get("/mission_queue")
    assert robot.robot.snapshot()["queue"][0]["description"] == "{mission}"  # /sim shows what was sent


def test_words_of_items_are_those_that_searches_find() -> None:
    robot = asker(item_states={"Pending": "Jonossa"})
    robot.order()
    found = [
        robot.send(
            "POST", "/mission_queue/search", {"filters": [{"fieldname": "state", "operator": "=", "value": word}]}
        ).json()
        for word in ("Jonossa", "Pending")
    ]
    assert [len(one) for one in found] == [1, 0]
    assert robot.send("PUT", "/mission_queue/1", {"priority": 1}).json()["state"] == robot.state_of(1) == "Jonossa"


def test_a_phrase_is_replaced_once_and_the_longest_that_fits() -> None:
    profile = profile_of({"texts": {"Ready": "Pause", "Pause": "Ready", "Ready to go": "Los"}})
    assert profile.text("Ready, Pause, Ready to go") == "Pause, Ready, Los"


def test_a_failure_is_described_in_the_robots_words() -> None:
    robot = Asker(profile=deviant("german-texts"))
    robot.control(fail_next_mission="Failed to reach goal position 'Line 1'")
    number = robot.order()
    robot.pass_until(lambda: robot.state_of(number) == "Aborted")
    action = robot.get(f"/mission_queue/{number}/actions")[-1]["id"]
    status = robot.status()
    texts = [
        robot.item(number)["message"],
        robot.get(f"/mission_queue/{number}/actions/{action}")["message"],
        status["mission_text"],
        status["errors"][0]["description"],
        robot.get("/log/error_reports/1")["description"],
    ]
    assert texts == ["Zielposition nicht erreicht: 'Line 1'"] * 5
    assert robot.put_status(mode_id=int(ModeId.MAPPING))["mode_text"] == "Kartierung"


def test_the_german_robot_says_nothing_in_english() -> None:
    texts = deviant("german-texts").texts
    assert {state.text for state in StateId} <= texts.keys()
    names = {state.text for state in StateId} | {mode.text for mode in ModeId}
    assert [
        phrase for phrase in texts if phrase not in SOURCES and phrase not in names
    ] == []  # else a text was changed since


def test_latency_is_drawn_by_the_seed_and_gives_way_to_other_faults() -> None:
    waits = [
        [robot.exchange("GET", "/status").seconds for _ in range(5)]
        for robot in (asker(latency=[1, 2]), asker(latency=[1, 2]))
    ]
    assert waits[0] == waits[1]
    assert all(1 <= wait <= 2 for wait in waits[0])
    robot = asker(latency=[1, 2])
    robot.control(fault={"kind": "drop_request"})
    assert robot.exchange("GET", "/status").seconds == 0.0
    assert robot.robot.snapshot()["faults"] == []


def test_a_fleet_sends_nothing_to_a_robot_that_is_offline() -> None:
    robot = asker(fleet={"mission": "Home", "every_seconds": 60})
    robot.control(reboot_seconds=200)
    robot.pass_time(190)
    assert len(robot.robot.queue) == 0
    robot.pass_time(60)
    assert [item.mission_id for item in robot.robot.queue] == [mir_sim.MISSIONS[1].guid]
