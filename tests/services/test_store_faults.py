"""When the disk is full, read-only or broken: no durable intent, no POST; an alarm; and it recovers when the disk does."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from datetime import timedelta
from typing import Any

import pytest

import mir_sim
from app.container import Container
from app.database.connection import DatabaseUnavailable, connect_for_reading
from app.database.writer import ThreadedWriter, Writer
from app.domain.execution import State
from app.domain.models import Mission, Robot, Schedule
from tests.support.network import Fate
from tests.support.process import wait_for

PASSWORD = "distributor"
HOME = next(mission for mission in mir_sim.MISSIONS if mission.name == "Home")


# ---------------------------------------------------------------------- the real threads and a real disk that fails
@pytest.fixture
def robot() -> Iterator[mir_sim.FleetRobot]:
    with mir_sim.serve(robots=1, time_scale=20) as fleet:
        yield fleet.robots[0]


@pytest.fixture
def app(tmp_path, robot) -> Iterator[Container]:
    """The running app with one robot, and one schedule that is not due today."""
    container = Container.open(tmp_path)
    container.catalogue.change_settings(poll_interval_seconds=1)
    known = container.catalogue.save_robot(Robot(robot.name, robot.url, "distributor"), password=PASSWORD)
    mission = container.catalogue.save_mission(Mission(HOME.name, HOME.guid))
    tomorrow = (container.clock.now() + timedelta(days=1)).replace(tzinfo=None, second=0, microsecond=0)
    container.catalogue.save_schedule(
        Schedule("S", known.id, mission.id, tomorrow, "UTC", "FREQ=DAILY", respect_working_days=False)
    )
    container.runner.start()
    wait_for(lambda: container.engine.is_ready)
    yield container
    container.close()


def insert_due(app: Container, seconds: float) -> None:
    """The schedule is due in that many seconds, which is finer than people can plan."""
    schedules = app.repositories.schedules
    schedule = schedules.by_name(app.db.read(), "S")
    app.db.write(lambda c: schedules.advance(c, schedule.id, app.clock.now() + timedelta(seconds=seconds)))
    app.runner.wake()


def make_read_only(app: Container) -> Callable[[], None]:
    return _with_writer(app, ThreadedWriter(lambda: connect_for_reading(app.db.path), app.db.path))


def break_down(app: Container) -> Callable[[], None]:
    """Every write ends in an I/O error of the storage."""
    return _with_writer(app, _Broken())


def _with_writer(app: Container, writer: Writer) -> Callable[[], None]:
    usual, app.db.write = app.db.write, writer.write

    def mend() -> None:
        app.db.write = usual
        writer.close()

    return mend


class _Broken:
    def write(self, work: object, patient: bool = False) -> Any:
        raise DatabaseUnavailable("The storage reports an error: check the disk")

    def close(self) -> None: ...


def fill_up(app: Container) -> Callable[[], None]:
    """No room is left for another page, and the next row is large."""

    def work(c: sqlite3.Connection) -> None:
        c.execute("UPDATE schedules SET name = ?", ("S" * 50_000,))
        c.execute(f"PRAGMA max_page_count = {c.execute('PRAGMA page_count').fetchone()[0]}")

    app.db.write(work)
    return lambda: app.db.write(lambda c: c.execute("PRAGMA max_page_count = 1000000"))


def alarms(app: Container) -> list[str]:
    return [alarm.code for alarm in app.alarms.open()]


@pytest.mark.parametrize("harm", [make_read_only, fill_up, break_down])
def test_nothing_is_sent_while_nothing_can_be_written_and_it_is_sent_once_when_it_can(app, robot, harm):
    insert_due(app, 1.0)
    mend = harm(app)
    wait_for(lambda: "database" in alarms(app), what="the alarm")
    assert robot.state()["queue"] == []
    assert app.db.read().execute("SELECT count(*) FROM executions").fetchone()[0] == 0
    mend()
    wait_for(lambda: len(robot.state()["queue"]) == 1, what="sent after all")
    wait_for(
        lambda: [alarm.cleared_at is not None for alarm in app.alarms.open() if alarm.code == "database"] == [True],
        what="the alarm is over, and waits for a person to see it",
    )
    wait_for(lambda: [row[0] for row in app.db.read().execute("SELECT state FROM executions")] == ["completed"])
    assert len(robot.state()["queue"]) == 1


def test_a_robot_that_took_it_while_the_disk_broke_is_asked_before_anything_is_sent_again(app, robot):
    """The intent is on disk, the POST is under way, and then its outcome can't be noted."""
    robot.control({"fault": {"kind": "delay", "method": "POST", "path": "/mission_queue", "seconds": 1.0}})
    insert_due(app, 0.2)
    wait_for(lambda: [row[0] for row in app.db.read().execute("SELECT state FROM executions")] == ["submitting"])
    mend = break_down(app)
    wait_for(lambda: "database" in alarms(app))
    mend()
    wait_for(lambda: [row[0] for row in app.db.read().execute("SELECT state FROM executions")] == ["completed"])
    assert len(robot.state()["queue"]) == 1


# ---------------------------------------------------------------------- every write in turn
class _FailsOnce:
    """Stands before the writer of a database and lets its n-th write fail."""

    def __init__(self, site, fail_at: int) -> None:
        self.usual, self.left = site.container.db.write, fail_at
        site.container.db.write = self.write

    @property
    def has_failed(self) -> bool:
        return self.left <= 0

    def write(self, work, patient=False):
        self.left -= 1
        if self.left == 0:
            raise DatabaseUnavailable("The disk is full: free some space")
        return self.usual(work, patient)


@pytest.mark.long
@pytest.mark.parametrize("fate", [Fate.ANSWER_LOST, Fate.FINE, Fate.LOST])
def test_whichever_write_fails_the_mission_runs_exactly_once(site, plan, fate):
    """The run is repeated with the first write failing, then the second, and so on, until it is over before the turn comes."""
    fail_at = 0
    while True:
        fail_at += 1
        name = f"run {fail_at}"
        start = site.clock.now().replace(second=0, microsecond=0) + timedelta(minutes=1)
        plan(f"{start:%Y-%m-%dT%H:%M}", name=name)
        if fate is not Fate.FINE:
            site.network.next("POST", "/mission_queue", fate)
        writer = _FailsOnce(site, fail_at)
        site.run(420.0)
        site.container.db.write = writer.usual
        [execution] = [e for e in site.executions() if e.schedule == name]
        copies = [item for item in site.machines["R1"].queue if item.description == execution.token]
        assert (execution.state, len(copies)) == (State.COMPLETED, 1), (fail_at, execution)
        if not writer.has_failed:
            break
    assert fail_at > 5
