"""A configuration file that would delete the history: nothing is deleted before somebody has confirmed it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.container import Container
from app.services.catalogue.configuration import import_configuration
from app.services.catalogue.configuration.importing import DeletesRuns
from tests.support.history import add_runs
from tests.support.process import is_one_line, run, running

RUNS = 30


@pytest.fixture
def data(tmp_path) -> Path:
    """A data directory with some history."""
    container = Container.open(tmp_path / "data")
    add_runs(container, RUNS)
    container.close()
    return tmp_path / "data"


def file(data: Path, limit: int | None) -> Path:
    path = data.with_name("limit.json")
    path.write_text(
        json.dumps({"format": "amr-scheduler/1", "settings": {"history_limit": limit, "retry_limit": 3}}),
        encoding="utf-8",
    )
    return path


def kept(data: Path) -> int:
    return run(data, "--export-log", "-").stdout.count("R1,Deliver")


@pytest.mark.long
def test_the_command_asks_for_yes(data):
    refused = run(data, "--import-config", file(data, 1))
    assert refused.returncode == 2
    assert is_one_line(
        refused.stderr, "keeping 1 deletes 29 runs of the history; to confirm that, add --yes; nothing was changed"
    )
    assert '"retry_limit": 10' in run(data, "--export-config", "-").stdout
    confirmed = run(data, "--import-config", file(data, 1), "--yes")
    assert (confirmed.returncode, confirmed.stderr) == (0, "")
    assert "Runs kept: 100,000 → 1" in confirmed.stdout
    again = run(data, "--import-config", file(data, 1))  # no lower than it is
    assert (again.returncode, again.stdout) == (0, "nothing changed\n")


@pytest.mark.long
def test_a_running_app_needs_confirmation_to_lower_the_limit(data):
    with running(data):
        assert run(data, "--import-config", file(data, 1)).returncode == 2
        assert kept(data) == RUNS
        assert run(data, "--import-config", file(data, 1), "--yes").returncode == 0


@pytest.mark.parametrize("limit", [RUNS, 100_000, 200_000, None])
def test_a_limit_that_deletes_nothing_needs_no_confirmation(data, limit):
    container = Container.open(data)
    import_configuration(container.catalogue, file(data, limit).read_bytes())
    with pytest.raises(DeletesRuns):
        import_configuration(container.catalogue, file(data, RUNS - 1).read_bytes())
    assert container.settings().history_limit == limit
    container.close()


def test_yes_belongs_to_an_import(data):
    refused = run(data, "--export-log", "-", "--yes")
    assert refused.returncode == 2
    assert is_one_line(refused.stderr)
