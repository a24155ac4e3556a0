"""A backup every day, and an alarm without one."""

from __future__ import annotations

import pytest

from app.services.files.daily_backup import AGAIN_AFTER, DailyBackup

DAY = 24 * 3600.0


@pytest.fixture
def backup(site) -> DailyBackup:
    c = site.container
    return DailyBackup(c.db, c.clock, c.alarms)


def tick(backup: DailyBackup) -> None:
    """One look, and everything it started to its end."""
    backup.tick()
    if backup._thread:
        backup._thread.join()


def made(site) -> list[str]:
    return sorted(file.name for file in (site.directory / "backups").glob("*.db"))


def test_one_each_day_and_the_oldest_are_dropped(site, backup):
    for _ in range(9):
        tick(backup)
        thread = backup._thread
        tick(backup)
        assert backup._thread is thread
        site.clock.advance(DAY)
    assert made(site) == [f"daily-2026-11-{day}.db" for day in range(25, 31)] + ["daily-2026-12-01.db"]


def test_one_that_fails_is_alarmed_and_tried_again_later(site, backup):
    (site.directory / "backups").write_text("in the way")
    tick(backup)
    tick(backup)
    (alarm,) = site.container.alarms.open()
    assert (alarm.code, alarm.cleared_at) == ("backup_failed", None)
    (site.directory / "backups").unlink()
    tick(backup)
    assert made(site) == []  # not at every look
    site.clock.advance(AGAIN_AFTER)
    tick(backup)
    tick(backup)
    assert made(site) == ["daily-2026-11-23.db"]
    (alarm,) = site.container.alarms.open()
    assert alarm.cleared_at
