"""An import while starts fall due: it is one transaction, after which they are made."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from app.container import Container
from tests.support.clock import VirtualClock
from tests.support.edits import import_file
from tests.support.planner import insert_due

MANY = 300


@pytest.fixture
def container(tmp_path: Path) -> Iterator[Container]:
    container = Container.open(tmp_path, VirtualClock(datetime(2026, 11, 25, 6, 29, tzinfo=UTC)))
    robots, missions = [{"name": "R", "address": "h"}], [{"name": "M", "guid": "g"}]
    import_file(container.catalogue, settings={"timezone": "UTC"}, robots=robots, missions=missions)
    yield container
    container.close()


def take(container: Container, **values: Any) -> None:
    """A file of many schedules, all due at 06:30."""
    rule = {"robot": "R", "mission": "M", "start": "2026-11-25T06:30", "recurrence": "FREQ=DAILY", **values}
    import_file(container.catalogue, schedules=[{"name": f"S{number}", **rule} for number in range(MANY)])


@pytest.mark.long
def test_starts_that_fall_due_during_imports_are_made_once(container):
    take(container)
    ends = threading.Event()

    def plan() -> None:
        while not ends.wait(0.002):
            container.clock.advance(1)
            insert_due(container)

    planner = threading.Thread(target=plan)
    planner.start()
    for priority in range(1, 11):
        take(container, priority=priority)
    ends.set()
    planner.join()
    container.clock.advance(60)
    insert_due(container)
    rows = container.db.read().execute("SELECT schedule, planned_at FROM executions").fetchall()
    assert len(rows) == len(set(map(tuple, rows))) == MANY
    assert {row["planned_at"] for row in rows} == {"2026-11-25T06:30:00.000000Z"}
    assert {schedule.priority for schedule in container.catalogue.schedules()} == {10}
