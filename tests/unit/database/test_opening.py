"""Opening: settings of the connection, permissions, identity, migrations."""

from __future__ import annotations

import sqlite3
import stat

import pytest

from app.database import connection
from app.database.backups import BACKUPS, problem_of
from app.database.connection import Database, DatabaseRefused, DatabaseUnavailable
from app.database.schema import (
    _NO_DECISION_READS_HISTORY,
    _SKIPPED_AHEAD,
    APPLICATION_ID,
    MIGRATIONS,
)
from app.database.settings import SettingsRepository
from tests.support.modes import is_private
from tests.support.new_database import migrate_really

ADD_A_TABLE = "CREATE TABLE extra (id INTEGER PRIMARY KEY) STRICT;"


@pytest.fixture(autouse=True)
def every_step(monkeypatch) -> None:
    """New databases are copies elsewhere."""
    monkeypatch.setattr(connection, "migrate", migrate_really)


@pytest.fixture
def db(start):
    """Opened as the app does it."""
    return start()


def mode(path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def pragma(c: sqlite3.Connection, name: str) -> object:
    return c.execute(f"PRAGMA {name}").fetchone()[0]


def test_no_committed_row_can_be_lost_and_only_the_writer_writes_back(db):
    wanted = {
        "journal_mode": "wal",
        "synchronous": 2,
        "foreign_keys": 1,
        "busy_timeout": 5000,
        "trusted_schema": 0,
        "cell_size_check": 1,
        "wal_autocheckpoint": 0,
        "temp_store": 2,
        "application_id": APPLICATION_ID,
        "user_version": len(MIGRATIONS),
    }
    assert db.write(lambda c: {name: pragma(c, name) for name in wanted}) == wanted


def test_thirty_readers_keep_no_more_of_a_large_file_than_four_would(db):
    usual = -pragma(sqlite3.connect(":memory:"), "cache_size")
    assert -30 * pragma(db.read(), "cache_size") <= 4 * usual


def test_everything_is_readable_by_its_owner_only(path, db):
    db.write(lambda c: SettingsRepository().put(c, "a", 1))
    db.read()
    assert mode(path.parent) == 0o700
    assert {file.name: mode(file) for file in path.parent.iterdir()} == {
        path.name: 0o600,
        f"{path.name}-wal": 0o600,
        f"{path.name}-shm": 0o600,
    }


def test_permissions_that_were_too_open_are_tightened(path, start):
    start()
    path.parent.chmod(0o755)
    path.chmod(0o644)
    start()
    assert (mode(path.parent), mode(path)) == (0o700, 0o600)


def test_a_newer_database_is_refused_and_left_alone(path, start):
    start(migrations=(*MIGRATIONS, ADD_A_TABLE)).close()
    before = path.read_bytes()
    with pytest.raises(DatabaseRefused, match="newer version"):
        start()
    assert path.read_bytes() == before


def test_another_programs_database_is_refused_and_left_alone(path, start):
    path.parent.mkdir()
    other = sqlite3.connect(path)
    other.execute("CREATE TABLE t (a)")
    other.commit()
    other.close()
    before = path.read_bytes()
    with pytest.raises(DatabaseRefused, match="another program"):
        start()
    assert path.read_bytes() == before


def test_a_place_that_cannot_be_a_directory_is_reported(tmp_path, clock):
    (tmp_path / "file").write_text("")
    with pytest.raises(DatabaseUnavailable, match="can't be used"):
        Database.open(tmp_path / "file" / "x.db", clock=clock)


# ---------------------------------------------------------------------- migrations
def test_a_migration_leaves_a_verified_backup_of_what_there_was_before(path, start):
    db = start()
    db.write(lambda c: SettingsRepository().put(c, "a", 1))
    db = start(migrations=(*MIGRATIONS, ADD_A_TABLE))
    assert pragma(db.read(), "user_version") == len(MIGRATIONS) + 1
    assert SettingsRepository().get(db.read(), "a") == 1
    [backup] = (path.parent / BACKUPS).iterdir()
    assert problem_of(backup) is None
    assert is_private(backup, backup.parent)
    copy = sqlite3.connect(backup)
    assert pragma(copy, "user_version") == len(MIGRATIONS)
    copy.close()


def test_a_migration_that_fails_changes_nothing(start):
    start()
    with pytest.raises(sqlite3.OperationalError):
        start(migrations=(*MIGRATIONS, f"{ADD_A_TABLE} CREATE TABLE settings (a) STRICT;"))
    db = start()
    assert pragma(db.read(), "user_version") == len(MIGRATIONS)
    assert not db.read().execute("SELECT 1 FROM sqlite_schema WHERE name = 'extra'").fetchone()


def test_steps_are_taken_one_after_another(path, start):
    start()
    steps = (*MIGRATIONS, ADD_A_TABLE, "INSERT INTO extra VALUES (7);")
    assert start(migrations=steps).read().execute("SELECT id FROM extra").fetchone()[0] == 7
    assert len(list((path.parent / BACKUPS).iterdir())) == 2


# ---------------------------------------------------------------------- for reading
def test_an_export_reads_while_the_app_runs_and_cannot_write(path, db):
    reader = Database.open_for_reading(path)
    db.write(lambda c: SettingsRepository().put(c, "a", 1))
    assert SettingsRepository().get(reader.read(), "a") == 1
    with pytest.raises(DatabaseUnavailable, match="reading only"):
        reader.write(lambda c: None)
    reader.close()


def test_reading_needs_a_database(path):
    with pytest.raises(DatabaseUnavailable, match="no database"):
        Database.open_for_reading(path)
    assert not path.parent.exists()


def test_reading_leaves_an_older_database_to_the_app(path, monkeypatch, start):
    start().close()
    monkeypatch.setattr("app.database.connection.MIGRATIONS", (*MIGRATIONS, ADD_A_TABLE))
    with pytest.raises(DatabaseRefused, match="older version"):
        Database.open_for_reading(path)


HISTORY = """
INSERT INTO robots (id, name, address) VALUES (1, 'Aino', 'http://a'), (2, 'Toivo', 'http://b');
INSERT INTO missions (id, name, guid) VALUES (1, 'Deliver', 'guid-1');
INSERT INTO schedules (id, name, robot_id, mission_id, start, timezone, changed_at, next_at) VALUES
    (1, 'runs', 1, 1, 'x', 'UTC', 'x', '2026-11-25'), (2, 'skipped', 1, 1, 'x', 'UTC', 'x', '2026-11-26'),
    (3, 'new', 1, 1, 'x', 'UTC', 'x', '2026-11-25'), (4, 'skipped once', 1, 1, 'x', 'UTC', 'x', NULL);
"""
ROW = """INSERT INTO executions (trigger, schedule_id, robot_id, robot, mission, mission_guid, timezone, token, closes_at, created_at,
                                 planned_at, state, reason_code, ended_at, queue_floor, queue_id)
         VALUES (?1, ?2, 1, 'Aino', 'Deliver', 'guid-1', 'UTC', ?3, 'x', 'x', ?3, ?4, ?5, ?6, ?7, ?8)"""
ROWS = [  # trigger, schedule, planned_at (and token), state, reason, ended_at, queue floor, queue id
    ("scheduled", 1, "2026-11-23T01", "completed", None, "2026-11-23T02", 10, 11),
    ("scheduled", 1, "2026-11-24T01", "missed", "app_down", "2026-11-24T02", None, None),
    ("scheduled", 2, "2026-11-23T03", "skipped", "hold", "2026-11-23T03", None, None),  # of a pause, when it fell due
    ("scheduled", 2, "2026-11-25T03", "skipped", "hold", "2026-11-23T04", None, None),  # by a person, in advance
    ("scheduled", 4, "2026-11-25T04", "skipped", "hold", "2026-11-23T05", None, None),
    ("idle", None, "2026-11-23T06", "completed", None, "2026-11-23T07", 11, 12),
    ("idle", None, "2026-11-23T08", "failed", "retry_limit", "2026-11-23T09", 14, None),
]


def with_history(start, step: str) -> Database:
    """Written by the version before this step."""
    old = start(migrations=MIGRATIONS[: MIGRATIONS.index(step)])
    old.write(lambda c: [c.execute(statement) for statement in HISTORY.split(";")] and c.executemany(ROW, ROWS))
    return start()


def test_the_migration_stores_what_decisions_read_from_the_history(start):
    db = with_history(start, _NO_DECISION_READS_HISTORY)
    c = db.read()
    plan = c.execute("SELECT planned_through, started_through FROM schedules ORDER BY id").fetchall()
    assert [tuple(row) for row in plan] == [
        ("2026-11-24T01", "2026-11-23T01"),
        ("2026-11-23T03", None),
        (None, None),
        (None, None),
    ]
    skips = c.execute("SELECT schedule_id, planned_at FROM skips ORDER BY 1, 2").fetchall()
    assert [tuple(row) for row in skips] == [(2, "2026-11-25T03"), (4, "2026-11-25T04")]
    robots = c.execute("SELECT last_queue_id, last_token, idle_queue_id FROM robots ORDER BY id").fetchall()
    assert [tuple(row) for row in robots] == [(12, "2026-11-23T06", 14), (None, None, None)]
    assert [row[0] for row in c.execute("SELECT DISTINCT revoked FROM executions")] == [None]


def test_a_start_skipped_beforehand_counts_on_its_day_and_says_when_it_was_skipped(start):
    db = with_history(start, _SKIPPED_AHEAD)
    rows = (
        db.read()
        .execute("""SELECT planned_at, ended_at, json_extract(reason_details, '$.skipped_at') FROM executions
                                WHERE state = 'skipped' ORDER BY id""")
        .fetchall()
    )
    assert [tuple(row) for row in rows] == [
        ("2026-11-23T03", "2026-11-23T03", None),
        ("2026-11-25T03", "2026-11-25T03", "2026-11-23T04"),
        ("2026-11-25T04", "2026-11-25T04", "2026-11-23T05"),
    ]
    days = db.read().execute("SELECT day, number FROM ended_days WHERE state = 'skipped' ORDER BY 1").fetchall()
    assert [tuple(row) for row in days] == [("2026-11-23", 1), ("2026-11-25", 2)]
