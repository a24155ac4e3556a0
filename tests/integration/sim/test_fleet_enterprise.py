"""A Fleet Enterprise over HTTP and HTTPS, as a client reaches it."""

from __future__ import annotations

import time
import uuid

import pytest
import requests

import mir_sim
from tests.integration.mir.servers import CERTIFICATES, FIELD
from tests.integration.sim.test_command import started
from tests.unit.sim.asking import GUIDS

BOUND = 60.0
KEY = {"x-api-key": "mir_scheduler"}


def test_an_order_is_run_by_a_robot_that_shows_it_in_its_own_queue() -> None:
    order, phase = str(uuid.uuid4()), str(uuid.uuid4())
    with mir_sim.serve(robots=2, fleet="enterprise", time_scale=100) as served:
        assert served.above is not None
        base = f"{served.above.url}/api/v1"
        body = {"serial-order": {"id": order, "phases": [{"mission-id": GUIDS["Home"], "order-id": phase}]}}
        assert requests.post(f"{base}/serial-order", json=body, headers=KEY, timeout=BOUND).status_code == 201
        ends = time.monotonic() + BOUND
        while (shown := requests.get(f"{base}/order/{phase}", headers=KEY, timeout=BOUND).json())[
            "order-finished"
        ] is None:
            assert time.monotonic() < ends
        robots = requests.get(f"{base}/robots", headers=KEY, timeout=BOUND).json()["robots"]
        assert [one["ip"] for one in robots] == [robot.url.removeprefix("http://") for robot in served.robots]
        robot = next(one for one in served.robots if one.name == shown["robot-name"])
        assert [item["fleet_schedule_guid"] for item in robot.state()["queue"]] == [phase]


@pytest.mark.filterwarnings("ignore:Unverified HTTPS request")  # it is self-signed
def test_with_a_certificate_it_is_reached_by_https() -> None:
    options = ("--port", "0", "--seed", "1", "--fleet", "enterprise", "--certificate", str(CERTIFICATES / FIELD))
    with started(*options) as (_process, [[_ready, name, url]]):
        assert (name, url.startswith("https://127.0.0.1:")) == ("Fleet", True)
        version = requests.get(f"{url}/api/v1/system/version", headers=KEY, timeout=BOUND, verify=False)
        assert version.json() == {"version": "1.5.0", "fleet-name": "Fleet"}
