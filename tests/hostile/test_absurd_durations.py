"""A robot whose clock stood still says that a mission took decades, or thousands of years: nothing is planned by that."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import pytest

from app.container import Container
from app.domain import rules
from app.domain.execution import State, Trigger
from app.domain.models import Mission, Robot, Schedule
from app.mir import parse
from app.services.dispatch.tracking import seconds_between
from app.services.executions import transitions
from tests.support.steps import steps

DAY_S, MOST_STEPS = 86_400.0, 200_000
CLOCKS = [
    ("1970-01-01T00:00:05", "2099-12-31T23:59:59"),
    ("1970-01-01T00:00:05", "2026-11-23T06:00:00"),
    ("2026-11-22T06:00:00", "2026-11-24T06:00:01"),
]


def ran(container: Container, duration_s: float) -> tuple[Robot, Mission]:
    """A robot with a mission that has run once, one that runs now, and a schedule of another one every minute."""
    now = datetime.now(UTC)
    robot = container.catalogue.save_robot(Robot("R", "http://127.0.0.1:9", "distributor"), "secret")
    mission, other = (container.catalogue.save_mission(Mission(name, name)) for name in "MN")
    for number, state in enumerate((State.QUEUED, State.EXECUTING)):
        row = container.ledger.add(
            rules.one_off(Trigger.MANUAL, robot, mission, container.settings(), now, f"token {number}")
        )
        container.db.write(
            lambda c, row=row, state=state: container.repositories.executions.change(  # type: ignore[misc]
                c, row, (State.WAITING,), state=state, queue_id=row.id, submitted_at=now
            )
        )
        if state is State.QUEUED:
            container.ledger.apply([transitions.complete(container.ledger.get(row.id), now, duration_s, None)])
    for one, rule in ((other, "FREQ=MINUTELY"), (mission, "FREQ=DAILY")):
        start = (datetime.now() + timedelta(hours=1)).replace(second=0, microsecond=0)
        container.catalogue.save_schedule(Schedule(one.name, robot.id, one.id, start, "UTC", rule))
    return robot, mission


@pytest.mark.parametrize(("started", "finished"), CLOCKS)
def test_its_durations_are_not_learned(container: Container, started: str, finished: str) -> None:
    duration = seconds_between(parse.instant(started), parse.instant(finished))
    assert duration > DAY_S
    robot, mission = ran(container, duration)
    draft = Schedule("D", robot.id, mission.id, datetime(2199, 1, 1, 6), "UTC", None)
    assert steps(lambda: container.forecasts.of(draft), MOST_STEPS) > 0
    assert container.history.expected(robot.id, mission.guid) is None


@pytest.mark.parametrize("duration", [60.0, DAY_S])
def test_a_run_of_a_day_counts(container: Container, duration: float) -> None:
    robot, mission = ran(container, duration)
    assert container.history.expected(robot.id, mission.guid).median_s == duration


def test_hundreds_of_such_runs_in_a_day_still_end(container: Container) -> None:
    """The sum of their microseconds has to fit into 64 bits: with thousands of years each, the 37th could not be written."""
    robot, mission = ran(container, 60.0)
    longest = seconds_between(parse.instant("1970-01-01T00:00:01"), parse.instant("2099-12-31T23:59:59"))
    for number in range(40):
        row = container.ledger.add(
            rules.one_off(Trigger.IDLE, robot, mission, container.settings(), datetime.now(UTC), f"t{number}")
        )
        container.db.write(
            lambda c, row=row: container.repositories.executions.change(  # type: ignore[misc]
                c, row, (State.WAITING,), state=State.EXECUTING, submitted_at=row.planned_at
            )
        )
        run = container.ledger.get(row.id)
        container.ledger.apply([transitions.complete(run, row.planned_at, longest, None)])
        assert container.ledger.get(row.id).state is State.COMPLETED
