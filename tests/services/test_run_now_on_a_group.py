"""``--run-now GROUP MISSION`` as a process of its own."""

from __future__ import annotations

import socket
import subprocess

import pytest

import mir_sim
from tests.support.process import configuration_of, prepared, run


@pytest.fixture
def fleet():
    with mir_sim.serve(robots=2) as fleet:
        yield fleet


@pytest.mark.long
def test_a_robot_that_hangs_keeps_run_now_from_no_other_robot_of_its_group(tmp_path, fleet):
    """``--run-now Hall Home`` without a running app starts nothing as long as one robot of the group hangs, though two others are free: it
    looks at one after the other, and has forgotten the first when the last one has timed out. It gives up when the window closes."""
    with socket.create_server(("127.0.0.1", 0)) as hangs:
        configuration = configuration_of(fleet)
        dead = {
            "name": "Zelda",
            "address": f"http://127.0.0.1:{hangs.getsockname()[1]}",
            "username": "distributor",
            "password": "x",
        }
        configuration["robots"].append(dead)
        configuration["groups"] = [{"name": "Hall", "robots": [robot["name"] for robot in configuration["robots"]]}]
        prepared(tmp_path / "data", configuration)
        try:
            done = run(tmp_path / "data", "--run-now", "Hall", "Home", timeout=40)
        except subprocess.TimeoutExpired:
            done = None
    assert sum(len(robot.state()["queue"]) for robot in fleet.robots) == 1
    assert done.returncode == 0, done


def test_robots_that_are_slow_to_answer_end_no_run_now_of_their_group(tmp_path, fleet):
    """They may answer yet; it says that it may still start when it is given up."""
    with socket.create_server(("127.0.0.1", 0)) as first, socket.create_server(("127.0.0.1", 0)) as second:
        configuration = configuration_of(fleet)
        for name, hangs in (("Yara", first), ("Zelda", second)):
            address = f"http://127.0.0.1:{hangs.getsockname()[1]}"
            configuration["robots"].append(
                {"name": name, "address": address, "username": "distributor", "password": "x"}
            )
        configuration["groups"] = [{"name": "Hall", "robots": ["Yara", "Zelda"]}]
        prepared(tmp_path / "data", configuration)
        with pytest.raises(subprocess.TimeoutExpired):
            run(tmp_path / "data", "--run-now", "Hall", "Home", timeout=9)
