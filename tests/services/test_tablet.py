"""A data directory that was copied from another tablet, as commands and a headless app see it."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.database.connection import DATABASE_NAME, Database
from app.database.settings import SettingsRepository
from tests.support.process import configuration_of, run, running, write_configuration


@pytest.fixture
def copied(tmp_path, fleet) -> Path:
    """A data directory that lives on another machine."""
    data = tmp_path / "data"
    assert (
        run(data, "--import-config", write_configuration(tmp_path / "c.json", configuration_of(fleet))).returncode == 0
    )
    db = Database.open(data / DATABASE_NAME)
    db.write(lambda c: SettingsRepository().put(c, "machine", "another tablet"))
    db.close()
    return data


def is_refused(done) -> bool:
    return done.returncode == 2 and "--move-here" in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.long
def test_nothing_is_sent_from_a_copy_until_it_moves_here(copied, fleet):
    robot = fleet.robots[0]
    assert is_refused(run(copied, "--run-now", robot.name, "Home"))
    with running(copied) as app:
        assert app.said("copied from another tablet")
        assert is_refused(run(copied, "--run-now", robot.name, "Home"))
        assert robot.state()["queue"] == []
        assert run(copied, "--move-here").stdout == "this machine starts the missions from now on\n"
        assert run(copied, "--run-now", robot.name, "Home").returncode == 0
    assert len(robot.state()["queue"]) == 1
    assert run(copied, "--move-here").stdout == "this machine starts the missions already\n"


def test_it_moves_without_a_running_app_too(copied, fleet):
    assert run(copied, "--move-here").stdout == "this machine starts the missions from now on\n"
    assert run(copied, "--run-now", fleet.robots[0].name, "Home").returncode == 0
