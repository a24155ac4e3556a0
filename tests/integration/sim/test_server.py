"""The HTTP server: real sockets, real faults, many threads."""

from __future__ import annotations

import http.client
import json
import socket
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from email.utils import parsedate_to_datetime
from typing import Any

import pytest
import requests

import mir_sim
from mir_sim import Fleet, FleetRobot
from tests.unit.sim.asking import GUIDS, HEADERS


@pytest.fixture
def fleet() -> Iterator[Fleet]:
    with mir_sim.serve(robots=2, time_scale=100) as served:
        yield served


@pytest.fixture
def aino(fleet: Fleet) -> FleetRobot:
    return fleet.robots[0]


def ask(robot: FleetRobot, method: str, path: str, body: Any = None, timeout: float = 5.0) -> requests.Response:
    return requests.request(method, f"{robot.url}/api/v2.0.0{path}", json=body, headers=HEADERS, timeout=timeout)


def raw(robot: FleetRobot, data: bytes) -> bytes:
    """All bytes that the robot sends until it closes the connection."""
    with socket.create_connection(("127.0.0.1", robot.port), timeout=5) as connection:
        connection.sendall(data)
        answer = b""
        while more := connection.recv(65536):
            answer += more
    return answer


def test_robots_have_friendly_names_and_ports_of_their_own(fleet: Fleet) -> None:
    assert [robot.name for robot in fleet.robots] == ["Aino", "Veikko"]
    assert [ask(robot, "GET", "/status").json()["robot_name"] for robot in fleet.robots] == ["Aino", "Veikko"]
    assert mir_sim.fleet.robot_name(12) == "Aino-2"


def test_a_connection_is_kept_and_every_body_is_drained(aino: FleetRobot) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", aino.port, timeout=5)
    for method, path, body in (
        ("POST", "/missions", b"x" * 100_000),
        ("PUT", "/status", b"state_id=3"),
        ("DELETE", "/mission_queue", b"{}"),
        ("GET", "/status", None),
    ):
        connection.request(method, f"/api/v2.0.0{path}", body, {"Authorization": HEADERS["Authorization"]})
        response = connection.getresponse()
        content = response.read()
        assert (response.version, response.getheader("Connection")) == (11, "keep-alive")
        assert response.status == 204 or int(response.getheader("Content-Length")) == len(content)
    assert response.status == 200


def test_a_head_request_is_answered_without_a_body(aino: FleetRobot) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", aino.port, timeout=5)
    for method in ("HEAD", "GET"):
        connection.request(method, "/api/v2.0.0/status")
        response = connection.getresponse()
        assert bool(response.read()) == (method == "GET")
    assert response.status == 200


def test_chunked_bodies_and_expectations(aino: FleetRobot) -> None:
    head = (
        "POST /api/v2.0.0/mission_queue HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\n"
        f"Authorization: {HEADERS['Authorization']}\r\n"
    )
    body = json.dumps({"mission_id": GUIDS["Home"]}).encode()
    chunked = (head + "Connection: close\r\nTransfer-Encoding: chunked\r\n\r\n").encode() + b"%x\r\n%b\r\n0\r\n\r\n" % (
        len(body),
        body,
    )
    assert raw(aino, chunked).startswith(b"HTTP/1.1 201 Created")
    expecting = (
        head + f"Connection: close\r\nExpect: 100-continue\r\nContent-Length: {len(body)}\r\n\r\n"
    ).encode() + body
    assert raw(aino, expecting).startswith(b"HTTP/1.1 100 Continue\r\n\r\nHTTP/1.1 201 Created")


@pytest.mark.parametrize(
    "data",
    [
        b"hello\r\n\r\n",
        b"GET /\r\n\r\n",
        b"GET / HTTP/1.1\r\nno colon\r\n\r\n",
        b"GET http://[ HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 20_000 + b"\r\n",
        b"POST / HTTP/1.1\r\nContent-Length: much\r\n\r\n",
        b"POST / HTTP/1.1\r\nContent-Length: -5\r\n\r\n",
        b"POST / HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n",
        b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
    ],
)
def test_an_invalid_request_is_answered_and_closed(aino: FleetRobot, data: bytes) -> None:
    assert raw(aino, data).startswith(b"HTTP/1.1 400 ")
    assert ask(aino, "GET", "/status").status_code == 200


def test_http_1_0_is_closed_after_the_answer(aino: FleetRobot) -> None:
    assert b"Connection: close" in raw(aino, b"GET /api/v2.0.0/status HTTP/1.0\r\n\r\n")


def test_the_date_is_the_robots_and_does_not_race_with_the_time_scale() -> None:
    with mir_sim.serve(robots=1, time_scale=1000, clock_offset=-3600) as fleet:
        date = parsedate_to_datetime(ask(fleet.robots[0], "GET", "/status").headers["Date"])
        assert abs(date.timestamp() - time.time() + 3600) < 10


# ---------------------------------------------------------------------- faults
def test_noise_in_place_of_no_body_leaves_the_connection_usable(aino: FleetRobot) -> None:
    session = requests.Session()
    aino.control({"fault": {"kind": "garbage"}})
    assert session.delete(f"{aino.url}/api/v2.0.0/mission_queue", headers=HEADERS, timeout=5).status_code == 200
    assert session.get(f"{aino.url}/api/v2.0.0/status", timeout=5).json()["robot_name"] == "Aino"


# ---------------------------------------------------------------------- control
def test_control_needs_no_credentials_and_shows_the_truth(aino: FleetRobot) -> None:
    state = requests.post(f"{aino.url}/sim", json={"battery": 12.5, "emergency_stop": True}, timeout=5).json()
    assert (state["name"], state["battery"], state["state_id"], state["queue"], state["faults"]) == (
        "Aino",
        12.5,
        10,
        [],
        [],
    )
    assert ask(aino, "GET", "/status").json()["battery_percentage"] == -1.0
    assert requests.get(f"{aino.url}/sim/", timeout=5).json()["state_id"] == 10
    refused = requests.post(f"{aino.url}/sim", json={"battery": "x"}, timeout=5)
    assert (refused.status_code, refused.json()["error_human"]) == (400, "battery must be a number from 0 to 100.")
    assert requests.post(f"{aino.url}/sim", data="{", timeout=5).status_code == 400
    assert requests.delete(f"{aino.url}/sim", timeout=5).status_code == 405


def test_faults_do_not_touch_control(aino: FleetRobot) -> None:
    aino.control({"fault": {"kind": "hang", "count": None}})
    assert requests.get(f"{aino.url}/sim", timeout=5).json()["faults"][0]["kind"] == "hang"


def test_the_live_picture_shows_where_the_robot_is(aino: FleetRobot) -> None:
    first = requests.get(f"{aino.url}/sim/map.png", timeout=5)
    assert (first.headers["Content-Type"], first.content[:4]) == ("image/png", b"\x89PNG")
    ask(aino, "PUT", "/status", {"position": {"x": 20.0, "y": 12.0, "orientation": 0.0}})
    assert requests.get(f"{aino.url}/sim/map.png", timeout=5).content != first.content


# ---------------------------------------------------------------------- many at once
def test_orders_from_many_threads_are_all_there_once(aino: FleetRobot) -> None:
    numbers: list[int] = []

    def work(worker: int) -> None:
        for turn in range(10):
            body = {"mission_id": GUIDS["Home"], "description": f"{worker}-{turn}"}
            numbers.append(ask(aino, "POST", "/mission_queue", body).json()["id"])
            aino.state()

    with ThreadPoolExecutor(6) as pool:
        list(pool.map(work, range(6)))
    assert sorted(numbers) == list(range(1, 61))
    assert len({item.description for item in aino.model.queue}) == 60


def test_fleets_do_not_know_each_other_and_leave_nothing_behind() -> None:
    before = threading.active_count()
    with mir_sim.serve(robots=1) as one, mir_sim.serve(robots=1) as other:
        one.robots[0].control({"battery": 10})
        assert other.robots[0].state()["battery"] > 10
        port = one.robots[0].port
    assert threading.active_count() <= before
    with pytest.raises(OSError, match=r".*"):
        socket.create_connection(("127.0.0.1", port), timeout=1)


def test_a_taken_port_is_an_error_and_no_port_stays_open(fleet: Fleet) -> None:
    with pytest.raises(OSError, match=r".*"), mir_sim.serve(robots=1, port=fleet.robots[0].port):
        pass
