"""A backup every day, and an alarm without one."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import DEFAULT, Mock

import pytest

from app.database.errors import DatabaseUnavailable
from app.services.files.daily_backup import AGAIN_AFTER, DailyBackup

DAY = 24 * 3600.0


@pytest.fixture
def backup(container) -> DailyBackup:
    return DailyBackup(container.db, container.clock, container.alarms)


def tick(backup: DailyBackup) -> None:
    """One look, and everything it started to its end."""
    backup.tick()
    if backup._thread:
        backup._thread.join()


def made(container) -> list[str]:
    return sorted(file.name for file in backups_of(container).glob("*.db"))


def backups_of(container) -> Path:
    return container.db.path.parent / "backups"


def test_one_each_day_and_the_oldest_are_dropped(container, backup):
    for _ in range(9):
        tick(backup)
        thread = backup._thread
        tick(backup)
        assert backup._thread is thread
        container.clock.advance(DAY)
    assert made(container) == [f"daily-2026-11-{day}.db" for day in range(25, 31)] + ["daily-2026-12-01.db"]


def test_one_that_fails_is_alarmed_and_tried_again_later(container, backup, monkeypatch):
    backups_of(container).write_text("in the way")
    tick(backup)
    tick(backup)
    (alarm,) = container.alarms.open()
    assert (alarm.code, alarm.cleared_at) == ("backup_failed", None)
    backups_of(container).unlink()
    tick(backup)
    assert made(container) == []  # not at every look
    container.clock.advance(AGAIN_AFTER)
    fails_once = Mock(wraps=container.alarms.clear, side_effect=[DatabaseUnavailable("disk full"), DEFAULT])
    monkeypatch.setattr(container.alarms, "clear", fails_once)
    tick(backup)
    tick(backup)
    assert made(container) == ["daily-2026-11-23.db"]
    (alarm,) = container.alarms.open()
    assert alarm.cleared_at
