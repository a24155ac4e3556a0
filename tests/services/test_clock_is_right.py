"""One robot whose clock is an hour ahead, and no window: a command says that this machine's clock is right, and the plan runs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import mir_sim
from tests.support.process import configuration_of, run, running, wait_for, write_configuration

PROBLEM = "The tablet's clock can't be right: the robot's clock is 60 min ahead of it; nothing is sent"
TIME = r"\d{4}-\d\d-\d\d \d\d:\d\d \(.+\)\n"


@pytest.fixture
def fleet() -> Iterator[mir_sim.Fleet]:
    with mir_sim.serve(robots=1, clock_offset=3600.0) as fleet:
        yield fleet


@pytest.fixture
def data(tmp_path, fleet) -> Path:
    data = tmp_path / "data"
    assert (
        run(data, "--import-config", write_configuration(tmp_path / "c.json", configuration_of(fleet))).returncode == 0
    )
    return data


def started(fleet) -> int:
    return len(fleet.robots[0].state()["queue"])


def confirmed(data: Path, sentence: str) -> bool:
    done = run(data, "--clock-is-right")
    return (done.returncode, done.stderr) == (0, "") and re.fullmatch(
        re.escape(sentence) + TIME, done.stdout
    ) is not None


def test_a_running_app_gets_it_and_starts(data, fleet):
    with running(data) as app:
        wait_for(lambda: app.said(PROBLEM))
        assert confirmed(data, "missions start by this clock from now on: ")
        assert run(data, "--run-now", fleet.robots[0].name, "Home").returncode == 0
        assert confirmed(data, "nothing contradicts this clock: ")
    assert started(fleet) == 1


@pytest.mark.long
def test_the_next_app_gets_it_if_none_runs(data, fleet):
    assert confirmed(data, "no app runs; the next one started within a day trusts this clock: ")
    with running(data) as app:
        assert run(data, "--run-now", fleet.robots[0].name, "Home").returncode == 0
        assert not app.said("can't be right")
    assert started(fleet) == 1
