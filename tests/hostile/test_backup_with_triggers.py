"""Backups that hold more than data: triggers, views, tables and indexes that the app did not make."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

import pytest

from app.database import backups, files
from app.database.connection import Database, DatabaseRefused
from app.database.schema import APPLICATION_ID, MIGRATIONS
from app.domain.message import render
from app.services.catalogue.database_check import find_problem

NOW = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)
HOSTILE = {
    "a trigger that changes addresses": """CREATE TRIGGER t AFTER INSERT ON executions BEGIN
                                               UPDATE robots SET address = 'http://evil.example'; END""",
    "a trigger that blocks writes": "CREATE TRIGGER t BEFORE UPDATE ON settings BEGIN SELECT raise(ABORT, 'no'); END",
    "a view": "CREATE VIEW v AS WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT x FROM n",
    "a view in the place of a table": """DROP TABLE settings; CREATE VIEW settings AS
                                         WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x FROM n) SELECT x AS name, x AS value FROM n""",
    "another table": "CREATE TABLE more (x)",
    "an index with an expression": "CREATE INDEX i ON robots (abs(-9223372036854775807 - length(name)))",
    "a column with a default": "ALTER TABLE robots ADD COLUMN proxy TEXT DEFAULT 'http://evil.example'",
    "a missing trigger": "DROP TRIGGER ended_days_add",
    "a missing index": "DROP INDEX schedules_due",
    "a definition that was rewritten": """PRAGMA writable_schema = ON;
        UPDATE sqlite_schema SET sql = replace(sql, 'DEFAULT 1', 'DEFAULT 0') WHERE name = 'robots'""",
}


@pytest.fixture
def backup(tmp_path) -> Path:
    db = Database.open(tmp_path / "data" / "amr-scheduler.db", durable=False)
    backups.back_up(db.path, path := tmp_path / "backup.db")
    db.close()
    return path


def spoil(path: Path, script: str) -> None:
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript(script)


@pytest.mark.parametrize("script", HOSTILE.values(), ids=HOSTILE.keys())
def test_another_schema_is_not_restored(backup, tmp_path, script):
    spoil(backup, script)
    target = tmp_path / "data" / "amr-scheduler.db"
    before = target.read_bytes()
    with pytest.raises(DatabaseRefused, match="were not made by this app"):
        backups.restore(backup, target, NOW)
    assert target.read_bytes() == before
    assert [path.name for path in target.parent.iterdir() if "restore" in path.name] == []


def test_the_checked_copy_is_installed(backup, tmp_path, monkeypatch):
    """A medium that reads differently the second time, or a file that is changed between the reads."""

    def copied_late(source: Path, target: Path) -> None:
        spoil(source, HOSTILE["a trigger that changes addresses"])
        copy(source, target)

    copy = files.copy_private
    monkeypatch.setattr(files, "copy_private", copied_late)
    target = tmp_path / "data" / "amr-scheduler.db"
    before = target.read_bytes()
    with pytest.raises(DatabaseRefused, match="were not made by this app"):
        backups.restore(backup, target, NOW)
    assert target.read_bytes() == before
    assert not list(target.parent.glob("*restore*"))


@pytest.mark.parametrize(
    ("kind", "name", "sql"),
    [
        (
            "trigger",
            "sqlite_t",
            "CREATE TRIGGER sqlite_t AFTER INSERT ON alarms BEGIN UPDATE robots SET address = 'http://evil.example'; END",
        ),
        (
            "trigger",
            "sqlite_sequence",
            "CREATE TRIGGER sqlite_sequence BEFORE DELETE ON alarms BEGIN SELECT raise(ABORT, 'no'); END",
        ),
        ("view", "sqlite_v", "CREATE VIEW sqlite_v AS SELECT 1"),
    ],
)
def test_nor_is_it_hidden_behind_a_name_of_sqlite_itself(backup, kind, name, sql):
    with closing(sqlite3.connect(backup)) as connection, connection:
        connection.execute("PRAGMA writable_schema = ON")
        connection.execute(
            "INSERT INTO sqlite_schema (type, name, tbl_name, rootpage, sql) VALUES (?, ?, 'alarms', 0, ?)",
            (kind, name, sql),
        )
    assert backups.problem_of(backup) is not None


@pytest.mark.parametrize("version", [-1, 0, 2**31 - 1])
def test_nor_one_of_a_version_that_never_was(backup, version):
    spoil(backup, f"PRAGMA user_version = {version}")
    assert backups.problem_of(backup) is not None


@pytest.mark.parametrize(
    "version", [1, *(pytest.param(version, marks=pytest.mark.long) for version in range(2, len(MIGRATIONS) + 1))]
)
def test_every_version_of_this_app_is_restored(tmp_path, version):
    old, target = tmp_path / "old.db", tmp_path / "data" / "amr-scheduler.db"
    spoil(
        old,
        "".join(MIGRATIONS[:version]) + f"PRAGMA application_id = {APPLICATION_ID}; PRAGMA user_version = {version};",
    )
    spoil(old, "INSERT INTO robots (name, address) VALUES ('R', 'http://127.0.0.1:9')")
    spoil(old, "INSERT INTO settings VALUES ('poll_interval_seconds', '0')")
    assert "table settings" in render(backups.problem_of(old, check=find_problem))
    spoil(old, "UPDATE settings SET value = '30'")
    assert backups.problem_of(old, check=find_problem) is None
    backups.restore(old, target, NOW, find_problem)
    db = Database.open(target, durable=False)
    assert [row["name"] for row in db.read().execute("SELECT name FROM robots")] == ["R"]
    db.close()


FIRST_CHECK_UPS = next(number for number, step in enumerate(MIGRATIONS, 1) if "CREATE TABLE check_ups" in step)


@pytest.mark.parametrize(
    "version",
    [
        FIRST_CHECK_UPS,
        *(pytest.param(each, marks=pytest.mark.long) for each in range(FIRST_CHECK_UPS + 1, len(MIGRATIONS) + 1)),
    ],
)
def test_no_backup_replaces_what_a_check_up_of_an_older_version_has_to_undo(tmp_path, version):
    old, backup = tmp_path / "amr-scheduler.db", tmp_path / "backup.db"
    spoil(
        old,
        "".join(MIGRATIONS[:version]) + f"PRAGMA application_id = {APPLICATION_ID}; PRAGMA user_version = {version};",
    )
    spoil(old, "INSERT INTO robots (name, address) VALUES ('R', 'http://127.0.0.1:9')")
    shutil.copy(old, backup)
    spoil(old, """INSERT INTO check_ups (robot_id, left_behind) VALUES (1, '{"serial_number": "S1"}')""")
    with pytest.raises(DatabaseRefused, match="the check-up of R is not over"):
        backups.restore(backup, old, NOW, find_problem)


def test_connections_trust_no_schema_and_leave_nothing_that_was_deleted(tmp_path):
    db = Database.open(tmp_path / "amr-scheduler.db", durable=False)
    asked = [
        lambda c, name=name: c.execute(f"PRAGMA {name}").fetchone()[0] for name in ("trusted_schema", "secure_delete")
    ]
    assert [db.write(ask) for ask in asked] == [0, 1]
    assert asked[0](db.read()) == 0
    db.write(
        lambda c: c.execute(
            "INSERT INTO robots (name, address, token) VALUES ('R', 'http://h', 'Basic c2VjcmV0LXRva2Vu')"
        )
    )
    db.write(lambda c: c.execute("DELETE FROM robots"))
    db.close()
    assert b"c2VjcmV0LXRva2Vu" not in db.path.read_bytes()
