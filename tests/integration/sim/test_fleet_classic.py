"""A classic fleet over HTTP, as a client reaches it, and the command that serves it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import requests

import mir_sim
from mir_sim.__main__ import main
from tests.integration.sim.test_command import started
from tests.support.process import wait_for
from tests.unit.sim.asking import HEADERS

BOUND = 60.0


def test_a_fleet_that_restarts_refuses_connections_and_its_robots_do_not() -> None:
    with mir_sim.serve(robots=1, fleet="classic") as served:
        served.above.control({"reboot_seconds": 3.0})  # long enough to be met
        url = f"{served.above.url}/api/v2.0.0/status"

        def is_reached() -> bool:
            try:
                return requests.get(url, timeout=BOUND).status_code == 200
            except requests.ConnectionError:
                return False

        wait_for(lambda: not is_reached())
        assert requests.get(f"{served.robots[0].url}/api/v2.0.0/status", timeout=BOUND).status_code == 200
        wait_for(is_reached)


def test_the_command_serves_a_fleet_before_its_robots(tmp_path: Path) -> None:
    knobs = tmp_path / "knobs.json"
    knobs.write_text(json.dumps({"status": "list"}), encoding="utf-8")
    options = ("--port", "0", "--seed", "1", "--fleet", "classic", "--knobs", str(knobs), "--history", "3")
    with started(*options, robots=1) as (process, [[_ready, name, url]]):
        assert (name, process.poll()) == ("Fleet", None)
        assert requests.get(f"{url}/api/v2.0.0/status", timeout=BOUND).json()[0]["state"] == "normal"
        listed = requests.get(f"{url}/api/v2.0.0/mission_scheduler", headers=HEADERS, timeout=BOUND).json()
        assert [one["id"] for one in listed] == [3, 2, 1]
        _ready, robot, address = process.stdout.readline().split()
        status = requests.get(f"{address}/api/v2.0.0/status", timeout=BOUND)
        assert (robot, status.headers["Robot-Version"]) == ("Aino", "2.14.7")


@pytest.mark.parametrize(
    ("content", "options", "says"),
    [
        ('{"search": 500}', ("--fleet", "classic"), "search must be one of 200, 201, 404."),
        ("{", ("--fleet", "classic"), "is not JSON"),
        ('{"search": 404}', (), "--knobs needs --fleet"),
    ],
)
def test_wrong_knobs_are_an_error_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str, options: tuple[str, ...], says: str
) -> None:
    knobs = tmp_path / "knobs.json"
    knobs.write_text(content, encoding="utf-8")
    with pytest.raises(SystemExit) as ended:
        main([*options, "--knobs", str(knobs)])
    error = capsys.readouterr().err
    assert (ended.value.code, says in error, error.count("\n")) == (2, True, 1)
