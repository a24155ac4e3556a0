"""One robot whose clock is an hour ahead, and no window: a command says that this machine's clock is right, and the plan runs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import mir_sim
from tests.support.process import answer, configuration_of, prepared, running, wait_for

PROBLEM = "Nothing is sent, the tablet's clock can't be right: the robot's clock is 60 min ahead of it"
TIME = r"\d{4}-\d\d-\d\d \d\d:\d\d \(.+\)\n"


@pytest.fixture
def fleet() -> Iterator[mir_sim.Fleet]:
    with mir_sim.serve(robots=1, clock_offset=3600.0) as fleet:
        yield fleet


@pytest.fixture
def data(tmp_path, fleet) -> Path:
    prepared(tmp_path / "data", configuration_of(fleet))
    return tmp_path / "data"


def started(fleet) -> int:
    return len(fleet.robots[0].state()["queue"])


def confirmed(data: Path, sentence: str) -> bool:
    return re.fullmatch(re.escape(sentence) + TIME, answer(data, "--clock-is-right")) is not None


def test_a_running_app_gets_it_and_starts(data, fleet):
    with running(data) as app:
        wait_for(lambda: app.said(PROBLEM))
        assert confirmed(data, "missions start by this clock from now on: ")
        answer(data, "--run-now", fleet.robots[0].name, "Home")
        assert confirmed(data, "nothing contradicts this clock: ")
    assert started(fleet) == 1


@pytest.mark.long
def test_the_next_app_gets_it_if_none_runs(data, fleet):
    assert confirmed(data, "no app runs; the next one started within a day trusts this clock: ")
    with running(data) as app:
        answer(data, "--run-now", fleet.robots[0].name, "Home")
        assert not app.said("can't be right")
    assert started(fleet) == 1
