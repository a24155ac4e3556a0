"""An import while the plan changes: repeated where necessary, refused when that never ends, never a long transaction."""

from __future__ import annotations

import threading
from collections.abc import Callable
from sqlite3 import Connection
from typing import Any

import pytest

from app.container import Container
from app.database.connection import Database
from app.database.rehearsal import Rehearsal
from app.domain.models import InvalidInput, State
from app.services.catalogue import catalogue as catalogues
from tests.support.edits import import_file

ROBOTS = [{"name": "R", "address": "h", "idle": {"mission": "M"}}, {"name": "Q", "address": "q"}]
MISSIONS = [{"name": "M", "guid": "g"}]
WAITING = """INSERT INTO executions (trigger, schedule_id, schedule, robot_id, robot, mission, mission_guid, timezone, token, state,
                                     planned_at, closes_at, created_at)
             SELECT 'scheduled', schedules.id, schedules.name, robots.id, robots.name, 'M', 'g', 'UTC', hex(randomblob(16)), 'waiting',
                    strftime('%Y-%m-%dT%H:%M:%f000Z', 'now', (abs(random()) % 10000000) || ' seconds'), '2099-01-01T00:00:00.000000Z',
                    '2026-11-23T06:00:00.000000Z'
             FROM schedules JOIN robots ON robots.id = schedules.robot_id WHERE schedules.name = ?"""
Write = Callable[[Connection], Any]

CHANGED = {
    "a setting": "UPDATE settings SET value = json(value + 1) WHERE name = 'retry_limit'",
    "a robot": "UPDATE robots SET username = username || 'x' WHERE name = 'Q'",
    "an idle rule": "UPDATE idle_rules SET after_minutes = after_minutes + 1",
    "a mission": "UPDATE missions SET guid = guid || 'x'",
    "a schedule": "UPDATE schedules SET priority = priority + 1 WHERE name = 'other'",
    "the schedule that is imported": "UPDATE schedules SET planned_through = '2026-11-25T06:30:00.000000Z' WHERE name = 'mine'",
    "a closed day": "UPDATE calendar_days SET name = name || 'x'",
    "a start left out": "INSERT INTO skips SELECT id, hex(randomblob(4)), 0 FROM schedules WHERE name = 'other'",
    "a start kept back": "INSERT INTO skips SELECT id, hex(randomblob(4)), 1 FROM schedules WHERE name = 'other'",
    "an id that was used": "UPDATE sqlite_sequence SET seq = seq + 1 WHERE name = 'schedules'",
    "what waits of the schedule that is imported": WAITING.replace("?", "'mine'"),
    "what is on its way of it": "UPDATE executions SET state = 'submitting' WHERE schedule = 'mine' AND state = 'waiting'",
}
NOTED = {
    "how far another schedule is planned": "UPDATE schedules SET planned_through = '2027-01-01T00:00:00.000000Z' WHERE name = 'other'",
    "what waits of another schedule": WAITING.replace("?", "'other'"),
    "what waits of it in detail": "UPDATE executions SET wait = 'battery' WHERE schedule = 'other'",
    "what a robot accepted": "UPDATE robots SET idle_queue_id = coalesce(idle_queue_id, 0) + 1",
    "what its runs use": "UPDATE robots SET drain_runs = drain_runs + 1",
    "what it failed": "UPDATE robots SET failures = failures + 1",
    "the history": "UPDATE executions SET robot_delay_s = 1 WHERE state = 'completed'",
}


def take(container: Container, **schedule: Any) -> list[Any]:
    fields = {
        "name": "mine",
        "robot": "R",
        "mission": "M",
        "start": "2026-11-25T06:30",
        "recurrence": "FREQ=DAILY",
        **schedule,
    }
    return import_file(container.catalogue, schedules=[fields])


@pytest.fixture
def container(container: Container) -> Container:
    """With a plan in which everything is there that an import looks at; something of both schedules waits."""
    schedule = {"robot": "R", "mission": "M", "start": "2026-11-25T06:30", "recurrence": "FREQ=DAILY"}
    schedules = [{"name": name, **schedule} for name in ("mine", "other")]
    settings = {"timezone": "UTC", "retry_limit": 1}
    import_file(container.catalogue, settings=settings, robots=ROBOTS, missions=MISSIONS, schedules=schedules)
    container.db.write(lambda c: [c.execute(WAITING, (name,)) for name in ("mine", "other")])
    container.db.write(
        lambda c: c.execute(
            "INSERT INTO calendar_days (name, first_day, last_day, is_working) VALUES ('x', '2026-12-24', "
            "'2026-12-24', 0)"
        )
    )
    return container


def disturb(monkeypatch: pytest.MonkeyPatch, db: Database, statement: str, times: int) -> list[Rehearsal]:
    """Somebody writes this during the first so many rehearsals. Returns the rehearsals."""
    made: list[Rehearsal] = []

    class Disturbed(Rehearsal):
        def __init__(self, c: Connection) -> None:
            super().__init__(c)
            made.append(self)
            if len(made) <= times:
                assert db.write(lambda c: c.execute(statement).rowcount) > 0

    monkeypatch.setattr(catalogues, "Rehearsal", Disturbed)
    return made


def priority(container: Container) -> int:
    return next(schedule.priority for schedule in container.catalogue.schedules() if schedule.name == "mine")


@pytest.mark.parametrize("statement", CHANGED.values(), ids=CHANGED.keys())
def test_an_import_is_repeated_when_its_basis_changed(container, monkeypatch, statement):
    made = disturb(monkeypatch, container.db, statement, times=1)
    assert len(take(container, priority=7)) == 1
    assert (len(made), priority(container)) == (2, 7)


@pytest.mark.parametrize("statement", NOTED.values(), ids=NOTED.keys())
def test_what_starting_missions_writes_does_not_restart_the_import(container, monkeypatch, statement):
    container.db.write(lambda c: c.execute(WAITING, ("other",)))
    container.db.write(
        lambda c: c.execute("UPDATE executions SET state = 'completed', ended_at = created_at WHERE id = 3")
    )
    made = disturb(monkeypatch, container.db, statement, times=1)
    assert len(take(container, priority=7, start="2026-11-25T07:30")) == 1
    assert (len(made), priority(container)) == (1, 7)


def test_a_plan_that_changes_all_the_time_is_not_imported(container, monkeypatch):
    made = disturb(monkeypatch, container.db, CHANGED["a setting"], times=1000)
    with pytest.raises(InvalidInput, match="the plan keeps changing: try again"):
        take(container, priority=7)
    assert (len(made), priority(container)) == (catalogues.REHEARSALS, 0)


def test_switching_a_robot_off_withdraws_what_became_due_during_the_import(container, monkeypatch):
    container.db.write(lambda c: c.execute("UPDATE robots SET token = 'Basic eDp5', enabled = 1, needs_password = 0"))
    made = disturb(monkeypatch, container.db, WAITING.replace("?", "'other'"), times=1)
    robots = [{"name": "R", "address": "h", "enabled": False}]
    import_file(container.catalogue, robots=robots)
    assert len(made) == 2
    rows = container.db.read().execute("SELECT DISTINCT state FROM executions").fetchall()
    assert [row[0] for row in rows] == [State.CANCELLED]


def test_what_falls_due_during_the_import_is_not_planned_twice(container, monkeypatch):
    """The planner notes how far a schedule has been planned; an import that changes another one leaves that."""
    disturb(monkeypatch, container.db, NOTED["how far another schedule is planned"], times=1)
    take(container, priority=1)
    assert container.catalogue.schedules()[1].planned_through.year == 2027
    take(container, name="other", priority=2)
    assert container.catalogue.schedules()[1].planned_through.year == 2027


def test_somebody_who_plans_all_the_time_neither_stops_an_import_nor_waits_for_it(container):
    """The importer holds the writer no longer than it takes to repeat what was rehearsed."""
    ends, wrote = threading.Event(), []

    def plan() -> None:
        while not ends.wait(0.002):
            wrote.append(container.db.write(lambda c: c.execute(WAITING, ("other",)).rowcount))

    planner = threading.Thread(target=plan)
    planner.start()
    try:
        for number in range(1, 21):
            take(container, priority=number)
    finally:
        ends.set()
        planner.join()
    assert priority(container) == 20
    assert len(wrote) >= 20


def test_every_way_to_write_is_repeated_or_refused(container):
    rehearsal = Rehearsal(container.db.read())
    rehearsal.copy.executemany("UPDATE missions SET guid = guid || ?", [("a",), ("b",)])
    rehearsal.copy.execute("UPDATE missions SET guid = guid || 'c'")
    with pytest.raises(NotImplementedError):
        rehearsal.copy.executescript("DELETE FROM missions")
    rehearsal.close()
    assert container.db.write(rehearsal.repeat)
    assert [mission.guid for mission in container.catalogue.missions()] == ["gabc"]
