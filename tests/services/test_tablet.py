"""A data directory that was copied from another tablet, or on this one, as commands and a headless app see it."""

from __future__ import annotations

from pathlib import Path
from shutil import copytree

import pytest

from app.database.connection import DATABASE_NAME, Database
from app.database.settings import SettingsRepository
from tests.support.process import answer, configuration_of, prepared, refusal, running


@pytest.fixture(params=[pytest.param("another tablet", marks=pytest.mark.long), "here"])
def copied(request, tmp_path, fleet) -> Path:
    """A data directory that lives on another machine, or in another place on this one."""
    data = tmp_path / "data"
    prepared(data, configuration_of(fleet))
    if request.param == "here":
        return copytree(data, tmp_path / "copy")
    db = Database.open(data / DATABASE_NAME)
    db.write(lambda c: SettingsRepository().put(c, "machine", "another tablet"))
    db.close()
    return data


@pytest.mark.long
def test_nothing_is_sent_from_a_copy_until_it_moves_here(copied, fleet):
    robot = fleet.robots[0]
    assert "--move-here" in refusal(copied, "--run-now", robot.name, "Home")
    with running(copied) as app:
        assert app.said("is a copy: nothing is sent from here")
        assert "--move-here" in refusal(copied, "--run-now", robot.name, "Home")
        assert robot.state()["queue"] == []
        assert answer(copied, "--move-here") == "this machine starts the missions from now on\n"
        answer(copied, "--run-now", robot.name, "Home")
    assert len(robot.state()["queue"]) == 1
    assert answer(copied, "--move-here") == "this machine starts the missions already\n"


def test_it_moves_without_a_running_app_too(copied, fleet):
    assert answer(copied, "--move-here") == "this machine starts the missions from now on\n"
    assert answer(copied, "--run-now", fleet.robots[0].name, "Home").strip().isdecimal()


@pytest.mark.long
def test_it_does_not_move_while_an_app_runs_on_the_original(tmp_path, fleet):
    original = tmp_path / "data"
    prepared(original, configuration_of(fleet))
    copy = copytree(original, tmp_path / "copy")
    with running(original):
        assert f"an app still runs on {original}, from which this data was copied" in refusal(copy, "--move-here")
        with running(copy):
            assert "an app still runs on" in refusal(copy, "--move-here")
    assert answer(copy, "--move-here") == "this machine starts the missions from now on\n"
