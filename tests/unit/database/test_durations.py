"""How long missions usually take: stored with the robots, independent of the history."""

from __future__ import annotations

from datetime import timedelta

import pytest

from app.database.execution_history import ExecutionHistory
from app.database.executions import ExecutionRepository
from app.database.missions import DurationRepository
from app.database.robots import RobotRepository
from app.database.schema import _RUN_DURATIONS
from app.domain.execution import OPEN_STATES, State
from app.domain.models import Robot
from tests.support.stored import bring_over, brought_up_to_date
from tests.unit.database.conftest import NOON

DURATIONS, ROBOTS = DurationRepository(), RobotRepository()
EXECUTIONS, HISTORY = ExecutionRepository(), ExecutionHistory()


@pytest.fixture
def ran(db, row):
    """A run of that length on robot 1, completed by the ledger so many minutes after noon; ``values`` are the row's before that."""
    for name in ("Aino", "Toivo"):
        db.write(lambda c, name=name: ROBOTS.add(c, Robot(name, f"http://{name}")))

    def run(seconds, minutes=0, state=State.COMPLETED, **values):
        def work(c):
            [begun] = EXECUTIONS.add_each_once(c, [row(state=State.EXECUTING, **values)])
            EXECUTIONS.change(
                c, begun, OPEN_STATES, state=state, ended_at=NOON + timedelta(minutes=minutes), duration_s=seconds
            )

        db.write(work)

    return run


def usual(db, robot_id=1, guid="guid"):
    found = DURATIONS.usual(db.read(), robot_id, guid)
    return found and found.samples_s


def test_only_the_newest_twenty_durations_are_kept(db, ran):
    assert usual(db) is None
    for minutes in range(25):
        ran(float(minutes), minutes)
    for seconds, state in (
        (9999.0, State.FAILED),
        (9999.0, State.CANCELLED),
        (None, State.COMPLETED),
        (86_401.0, State.COMPLETED),
    ):
        ran(seconds, 99, state)
    ran(7.0, robot_id=2)
    ran(8.0, mission_guid="other")
    ran(9.0, robot_id=3)  # which has been removed
    assert usual(db) == tuple(float(minutes) for minutes in range(5, 25))
    assert DURATIONS.usual_of_all(db.read()) == {"guid": 14.0, "other": 8.0}
    assert (DURATIONS.usual(db.read(), 1, "guid").median_s, DURATIONS.usual(db.read(), 1, "guid").slow_s) == (
        14.5,
        22.0,
    )
    assert (usual(db, 2), usual(db, 1, "other"), usual(db, 3)) == ((7.0,), (8.0,), None)


def test_simultaneous_and_late_runs_are_all_counted(db, ran):
    for seconds in range(30, 10, -1):
        ran(float(seconds), 5)
    assert usual(db) == tuple(float(seconds) for seconds in range(11, 31))
    ran(99.0, 4)
    assert usual(db) == tuple(float(seconds) for seconds in range(11, 31))


def test_durations_outlive_the_history_and_count_each_run_once(db, ran):
    ran(60.0)
    (row,) = HISTORY.stream(db.read())
    db.write(lambda c: EXECUTIONS.change(c, row, [State.COMPLETED], state=State.COMPLETED, robot="Another name"))
    db.write(lambda c: HISTORY.drop_oldest(c, HISTORY.surplus(c, 0)))
    assert (EXECUTIONS.get(db.read(), row.id), usual(db)) == (None, (60.0,))
    db.write(lambda c: EXECUTIONS.add_each_once(c, [row])[0])
    assert usual(db) == (60.0,)


def test_durations_of_imported_history_count_too(db, ran, row):
    rows = [row(state=State.COMPLETED, ended_at=NOON, duration_s=float(seconds)) for seconds in range(40)]
    db.write(lambda c: EXECUTIONS.add_many(c, rows))
    assert usual(db) == tuple(float(seconds) for seconds in range(20, 40))


def test_durations_are_deleted_and_restored_with_their_robot(db, ran):
    ran(60.0)
    ran(70.0, 1)
    db.write(lambda c: (ROBOTS.remove(c, 1, NOON), ROBOTS.put_back(c, 1, NOON)))
    assert usual(db) == (60.0, 70.0)
    db.write(lambda c: (ROBOTS.remove(c, 1, NOON), ROBOTS.purge(c)))
    assert usual(db) is None


def test_an_older_database_takes_durations_from_its_history(tmp_path, clock, row, db):
    runs = [
        row(state=State.COMPLETED, ended_at=NOON + timedelta(minutes=n), duration_s=float(n), robot_id=robot_id)
        for robot_id in (1, 3)
        for n in range(25)
    ]
    others = [
        row(state=State.FAILED, ended_at=NOON + timedelta(days=1), duration_s=1.0),
        row(),
        *(row(state=State.COMPLETED, ended_at=NOON + timedelta(days=1), duration_s=each) for each in (None, 86_401.0)),
        row(state=State.COMPLETED, ended_at=NOON, duration_s=86_400.0, robot_id=2),
    ]
    db.write(lambda c: EXECUTIONS.add_many(c, [*runs, *others]))

    def fill(old):
        old.write(
            lambda c: c.execute(
                "INSERT INTO robots (id, name, address) VALUES (1, 'Aino', 'http://a'), (2, 'Toivo', 'http://b')"
            )
        )
        bring_over(db, old)

    new = brought_up_to_date(tmp_path / "a.db", clock, _RUN_DURATIONS, fill)
    assert usual(new) == tuple(float(n) for n in range(5, 25))
    assert (usual(new, 2), usual(new, 3)) == ((86_400.0,), None)
    new.close()


def test_reading_them_reads_no_more_than_them(db, ran):
    ran(60.0)
    asked = []

    def work(c):
        c.set_trace_callback(asked.append)
        DURATIONS.usual(c, 1, "guid")
        c.set_trace_callback(None)
        return [plan["detail"] for sql in asked for plan in c.execute(f"EXPLAIN QUERY PLAN {sql}")]

    assert {plan.partition(" (")[0] for plan in db.write(work)} == {"SEARCH run_durations USING PRIMARY KEY"}
