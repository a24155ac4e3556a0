"""The simulator's /sim: not for web pages, and from other machines only with the key."""

from __future__ import annotations

import asyncio

import pytest
import requests

import mir_sim
from mir_sim import Request
from mir_sim.control import refusal
from tests.unit.sim.asking import HEADERS


def post(url: str, **headers: str) -> int:
    return requests.post(f"{url}/sim", json={"battery": 12.5}, headers=headers, timeout=5).status_code


def test_a_web_page_moves_nothing():
    with mir_sim.serve(robots=1) as fleet:
        [robot] = fleet.robots
        assert post(robot.url, Origin="http://evil.example", **{"Content-Type": "text/plain"}) == 403
        assert post(robot.url, Origin="null") == 403
        assert robot.state()["battery"] > 13
        assert requests.get(f"{robot.url}/sim", headers={"Origin": "http://evil.example"}, timeout=5).status_code == 403
        assert (
            requests.get(f"{robot.url}/api/v2.0.0/status", headers={**HEADERS, "Origin": "x"}, timeout=5).status_code
            == 200
        )
        assert post(robot.url) == 200
        assert robot.state()["battery"] < 13


@pytest.mark.parametrize(
    ("peer", "key", "status"),
    [
        ("127.0.0.1", "", None),
        ("127.5.0.1", "", None),
        ("::1", "", None),
        ("::ffff:127.0.0.1", "", None),
        ("10.0.0.7", "", 401),
        ("10.0.0.7", "wrong", 401),
        ("10.0.0.7", "schlüssel", 401),
        ("10.0.0.7", "right", None),
        ("fe80::1%eth0", "", 401),
        ("", "", 401),
    ],
)
def test_other_machines_need_the_key(peer, key, status):
    for path in ("/sim", "/sim//", "/%73im", "/sim?x", "/sim/map.png"):
        refused = refusal(Request.of("POST", path, {"X-Sim-Key": key} if key else {}, b"{}"), peer, "right")
        assert (refused and refused.status) == status
    assert refusal(Request.of("GET", "/api/v2.0.0/status"), peer, "right") is None


@pytest.mark.parametrize("peer", ["10.0.0.7", "127.0.0.1"])
def test_the_machine_that_asks_is_that_of_the_connection(monkeypatch, peer):
    """Over a socket of this machine that pretends to come from elsewhere."""
    real = asyncio.StreamWriter.get_extra_info
    monkeypatch.setattr(
        asyncio.StreamWriter,
        "get_extra_info",
        lambda writer, name, default=None: (peer, 50_000) if name == "peername" else real(writer, name, default),
    )
    is_here = peer == "127.0.0.1"
    with mir_sim.serve(robots=1) as fleet:
        [robot] = fleet.robots
        assert post(robot.url) == (200 if is_here else 401)
        assert (robot.state()["battery"] < 13) is is_here
        assert requests.get(f"{robot.url}/sim", timeout=5).status_code == (200 if is_here else 401)
        assert post(robot.url, **{"X-Sim-Key": fleet.key}) == 200
        assert robot.state()["battery"] < 13
        assert requests.get(f"{robot.url}/api/v2.0.0/status", headers=HEADERS, timeout=5).status_code == 200


def test_the_key_can_be_chosen():
    keys = []
    for chosen_key in ("mine", "", ""):
        fleet = mir_sim.Fleet([], key=chosen_key)
        keys.append(fleet.key)
        fleet.stop()
    assert keys[0] == "mine"
    assert keys[1] != keys[2]
    assert len(keys[1]) >= 12
