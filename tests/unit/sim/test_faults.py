"""Faults between request and answer, on demand and at random, without a network."""

from __future__ import annotations

import json
from collections import Counter

import pytest

from mir_sim import Fate
from mir_sim.checks import WrongValue
from mir_sim.control import apply
from tests.unit.sim.asking import GUIDS, Asker
from tests.unit.sim.fleets.classic import FleetAsker

ORDER = {"mission_id": GUIDS["Home"]}


def arm(asker: Asker, kind: str, path: str = "/mission_queue", **more: object) -> None:
    asker.control(fault={"kind": kind, "method": "POST", "path": path, **more})


def orders(asker: Asker) -> int:
    return len(asker.get("/mission_queue"))


@pytest.mark.parametrize(("make", "path"), [(Asker, "/mission_queue"), (FleetAsker, "/mission_scheduler")])
@pytest.mark.parametrize(
    ("kind", "handled", "fate"),
    [
        ("drop_request", 0, Fate.CLOSED),
        ("drop_response", 1, Fate.CLOSED),
        ("delay", 1, Fate.ANSWERED),
        ("hang", 0, Fate.HELD),
        ("status_503", 0, Fate.ANSWERED),
        ("html", 1, Fate.ANSWERED),
        ("truncate", 1, Fate.CUT),
        ("garbage", 1, Fate.ANSWERED),
        ("twice", 2, Fate.ANSWERED),
    ],
)
def test_each_fault_handles_or_does_not(
    make: type[Asker | FleetAsker], path: str, kind: str, handled: int, fate: Fate
) -> None:
    asker = make()
    arm(asker, kind, path)
    assert asker.exchange("POST", path, ORDER).fate is fate
    assert len(asker.get(path)) == handled
    assert asker.exchange("POST", path, ORDER).response is not None  # one hit, then all is well
    assert len(asker.get(path)) == handled + 1


def test_what_the_client_gets_to_see(aino: Asker) -> None:
    seen = {}
    for kind in ("delay", "status_503", "html", "truncate", "garbage"):
        arm(aino, kind, seconds=3)
        seen[kind] = aino.exchange("POST", "/mission_queue", ORDER)
    assert (seen["delay"].seconds, seen["delay"].response.status) == (3.0, 201)
    assert (seen["status_503"].response.status, seen["status_503"].response.json()["error_code"]) == (
        503,
        "service_unavailable",
    )
    assert seen["html"].response.body.startswith(b"<!DOCTYPE html>")
    whole = aino.send("POST", "/mission_queue", ORDER).body
    assert len(seen["truncate"].response.body) == len(whole) // 2
    assert seen["truncate"].full_length == len(whole)
    with pytest.raises(ValueError, match=r".*"):
        json.loads(seen["garbage"].response.body)


def test_a_late_request_is_handled_when_its_time_has_come() -> None:
    asker = Asker(time_scale=10)
    arm(asker, "late", seconds=4)
    late = asker.exchange("POST", "/mission_queue", ORDER)
    assert (late.pending, late.response, late.seconds) == (True, None, 4.0)
    asker.pass_time(39)
    assert orders(asker) == 0
    asker.pass_time(1)
    assert orders(asker) == 1
    assert late.response.status == 201
    assert asker.item(1)["ordered"] == "2026-11-23T07:00:40"


def test_a_fault_meets_only_its_requests_and_only_so_often(aino: Asker) -> None:
    aino.control(fault={"kind": "status_503", "path": "/status", "method": "get", "count": 2})
    assert [aino.exchange("GET", path).response.status for path in ("/missions", "/status", "/status/", "/status")] == [
        200,
        503,
        503,
        200,
    ]


def test_a_fault_without_count_lasts_until_it_is_removed(aino: Asker) -> None:
    aino.control(fault={"kind": "hang", "count": None})
    assert [aino.exchange("GET", "/status").fate for _ in range(5)] == [Fate.HELD] * 5
    assert aino.robot.snapshot()["faults"] == [
        {"kind": "hang", "method": "*", "path": "*", "count": None, "seconds": 5.0}
    ]
    aino.control(fault=None)
    assert aino.exchange("GET", "/status").fate is Fate.ANSWERED


def test_chance_hits_a_share_of_the_requests_and_the_same_ones_for_the_same_seed() -> None:
    def life(seed: int) -> list[tuple[Fate, float]]:
        asker = Asker(chaos=0.3, seed=seed)
        return [(answer.fate, answer.seconds) for answer in (asker.exchange("GET", "/status") for _ in range(1000))]

    fates = Counter(fate for fate, _ in life(1))
    assert 60 < 1000 - fates[Fate.ANSWERED] < 300
    assert life(1) == life(1) != life(2)


def test_chaos_does_not_change_what_the_robot_does() -> None:
    calm, wild = Asker(failure_rate=0.5), Asker(failure_rate=0.5, chaos=1.0)
    for asker in (calm, wild):
        for _ in range(20):
            asker.exchange("GET", "/status")
        asker.order("Deliver")
        asker.pass_time(300)
    assert calm.item(1) == wild.item(1)


# ---------------------------------------------------------------------- control
@pytest.mark.parametrize(
    "commands",
    [
        {},
        [],
        {"battery": 101},
        {"battery": "full"},
        {"battery": float("nan")},
        {"battery": 10**400},
        {"battery": True},
        {"emergency_stop": 1},
        {"error": {"code": "x"}},
        {"error": {"code": 1}},
        {"error": []},
        {"fail_next_mission": ""},
        {"reboot_seconds": -1},
        {"reboot_seconds": None},
        {"user_prompt": {}},
        {"user_prompt": {"question": "?", "options": [1]}},
        {"user_prompt": "?"},
        {"fault": {"kind": "flood"}},
        {"fault": {}},
        {"fault": {"kind": "hang", "count": 0}},
        {"fault": {"kind": "hang", "path": "status"}},
        {"fault": {"kind": "delay", "seconds": -1}},
        {"fault": {"kind": "hang", "times": 3}},
        {"fly": True},
        {"battery": 50, "fly": True},
    ],
)
def test_wrong_commands_are_refused_with_a_sentence_and_none_is_executed(aino: Asker, commands: object) -> None:
    before = aino.robot.snapshot()
    with pytest.raises(WrongValue, match=r"\.$"):
        apply(aino.robot, commands)
    assert aino.robot.snapshot() == before


def test_several_commands_at_once(aino: Asker) -> None:
    aino.control(battery=12.5, emergency_stop=True, fault={"kind": "delay"})
    state = aino.robot.snapshot()
    assert (state["battery"], state["state_id"], state["faults"][0]["seconds"]) == (12.5, 10, 5.0)
