from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from app.database.connection import Database
from app.domain.execution import Execution, Trigger
from tests.support.clock import VirtualClock

NOON = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock(NOON)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "data" / "amr-scheduler.db"


@pytest.fixture
def db(path: Path, clock: VirtualClock) -> Iterator[Database]:
    database = Database.open(path, clock=clock, threaded=False, durable=False)
    yield database
    database.close()


@pytest.fixture
def start(path: Path, clock: VirtualClock) -> Iterator[Callable[..., Database]]:
    """Open the database as the next process does: the one before is closed."""
    last: list[Database] = []

    def start(**options: Any) -> Database:
        stop()
        last.append(Database.open(path, clock=clock, **options))
        return last[-1]

    def stop() -> None:
        while last:
            last.pop().close()

    yield start
    stop()


@pytest.fixture
def row():
    """Executions, each with a token of its own; planned one minute apart."""
    made = iter(range(1, 1_000_000))

    def make(**values) -> Execution:
        number = next(made)
        planned = values.pop("planned_at", NOON + timedelta(minutes=number))
        return replace(
            Execution(
                Trigger.SCHEDULED,
                1,
                "Aino",
                "Deliver",
                "guid",
                planned,
                planned + timedelta(minutes=15),
                planned,
                f"token-{number}",
                "UTC",
                schedule_id=1,
                schedule="S",
            ),
            **values,
        )

    return make
