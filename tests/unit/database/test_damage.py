"""A damaged database is renamed and kept, never replaced by an empty one, and only restored from a backup."""

from __future__ import annotations

import contextlib
import itertools
import os
import re
import shutil
from pathlib import Path

import pytest

from app.command import quote
from app.database import files
from app.database.backups import BACKUPS, back_up, daily_backup, newest_good_backup, problem_of, restore
from app.database.connection import Database, DatabaseDamaged, DatabaseRefused, DatabaseUnavailable
from app.database.settings import WRONG_PINS, SettingsRepository
from tests.support.errors import raises
from tests.support.modes import is_private

SETTINGS = SettingsRepository()


def garbage(path):
    path.write_bytes(b"this is no database " * 1000)


def zeros_in_the_middle(path):
    content = bytearray(path.read_bytes())
    content[4096 : 3 * 4096] = bytes(2 * 4096)
    path.write_bytes(content)


def torn_off(path):
    path.write_bytes(path.read_bytes()[:9000])


def emptied(path):
    path.write_bytes(b"")


def deleted(path):
    path.unlink()


@pytest.fixture
def backed_up(path, clock, start):
    """A database with one setting and a backup, closed."""
    db = start()
    db.write(lambda c: SETTINGS.put(c, "a", 1))
    db.write(SETTINGS.install_id)
    daily_backup(path, clock.now())
    db.write(lambda c: SETTINGS.put(c, "a", 2))
    db.close()
    return path


@pytest.fixture
def restored(path, clock, start):
    """Restore the newest backup, and start the app on it."""

    def restored():
        restore(newest_good_backup(path), path, clock.now())
        return start()

    return restored


def damage_of(start) -> DatabaseDamaged:
    """What the next start says of it."""
    with pytest.raises(DatabaseDamaged) as caught:
        start()
    return caught.value


@pytest.mark.parametrize("damage", [garbage, zeros_in_the_middle, torn_off, emptied, deleted])
def test_it_is_refused_now_and_at_later_starts_and_the_backup_is_named(backed_up, damage, start):
    damage(backed_up)
    broken = backed_up.read_bytes() if backed_up.exists() else None
    for _ in range(2):
        error = damage_of(start)
        assert error.path == backed_up
        assert error.backup == backed_up.parent / BACKUPS / "daily-2026-11-23.db"
        assert f"--restore-backup {quote(str(error.backup))}" in error.text
        assert "\n" not in error.text
        assert not backed_up.exists()
        if broken is not None:
            assert error.kept_as.name == "amr-scheduler.db.damaged-20261123T120000Z"
            assert error.kept_as.read_bytes() == broken
    with pytest.raises(DatabaseDamaged):
        Database.open_for_reading(backed_up)


def test_restoring_brings_back_the_backup_and_keeps_everything_else(backed_up, clock, start):
    garbage(backed_up)
    damage = damage_of(start)
    restore(damage.backup, backed_up, clock.now())
    db = start()
    assert SETTINGS.get(db.read(), "a") == 1
    assert SETTINGS.restored_at(db.read()) == clock.now()
    assert SETTINGS.former_ran_until(db.read()) is None  # it can't be read
    assert damage.kept_as.exists()
    assert damage.backup.exists()
    assert is_private(backed_up)


def test_the_installations_id_comes_back_with_the_backup(path, clock, start, restored):
    db = start()
    install_id = db.write(SETTINGS.install_id)
    daily_backup(path, clock.now())
    db.close()
    db = restored()
    assert db.write(SETTINGS.install_id) == install_id


def test_ids_used_after_the_backup_are_not_reused(path, clock, start, restored):
    def add(c):
        return c.execute("INSERT INTO missions (name, guid) VALUES (hex(randomblob(8)), 'g') RETURNING id").fetchone()[
            0
        ]

    db = start()
    db.write(add)
    daily_backup(path, clock.now())
    later = db.write(add)
    db.close()
    db = restored()
    assert db.write(add) > later


def test_a_file_that_is_no_backup_is_refused_and_nothing_changes(backed_up, clock, tmp_path):
    before = backed_up.read_bytes()
    other = tmp_path / "other.db"
    garbage(other)
    broken = tmp_path / "broken.db"
    shutil.copyfile(newest_good_backup(backed_up), broken)
    zeros_in_the_middle(broken)
    for bad, problem in (
        (other, "it is not a database of this app"),
        (broken, "it is damaged"),
        (tmp_path / "nowhere.db", "there is no such file"),
    ):
        with pytest.raises(
            DatabaseRefused,
            match=rf"{re.escape(str(bad))} can't be restored \({problem}\)\. Nothing was changed, so choose another one",
        ):
            restore(bad, backed_up, clock.now())
    assert backed_up.read_bytes() == before
    assert sorted(file.name for file in backed_up.parent.iterdir()) == [backed_up.name, BACKUPS]


def test_without_a_good_backup_the_sentence_says_so(path, start):
    start().close()
    garbage(path)
    with raises(DatabaseDamaged, "no good backup", backup=None):
        start()


@pytest.mark.parametrize("renamed", [False, True])
def test_a_crash_while_it_was_put_aside_does_not_let_an_empty_one_in(backed_up, renamed, monkeypatch, start):
    garbage(backed_up)
    calls = []

    def crash(*arguments):
        calls.append(arguments)
        if len(calls) == (2 if renamed else 1):
            raise KeyboardInterrupt
        return real(*arguments)

    name = "_write_mark" if renamed else "set_aside"
    real = getattr(__import__("app.database.files", fromlist=[name]), name)
    monkeypatch.setattr(f"app.database.files.{name}", crash)
    with pytest.raises(KeyboardInterrupt):
        start()
    monkeypatch.undo()
    with pytest.raises(DatabaseDamaged):
        start()
    assert not backed_up.exists()


@pytest.mark.parametrize("is_damaged", [False, True])
@pytest.mark.parametrize("is_done", [False, True])
def test_a_restore_that_ends_anywhere_is_finished_or_was_never_begun(
    backed_up, clock, monkeypatch, tmp_path, is_damaged, is_done, start
):
    """The process dies before (or after) each step that changes a file: nothing sound is called damaged, and nothing is lost."""
    backup, before, seen = newest_good_backup(backed_up), backed_up.read_bytes(), set()
    files.sibling(backed_up, "-wal").write_bytes(b"")
    if is_damaged:
        garbage(backed_up)
        with pytest.raises(DatabaseDamaged):
            start()
    data, spare = backed_up.parent, tmp_path / "spare"
    shutil.copytree(data, spare)
    for left in itertools.count():
        shutil.rmtree(data)
        shutil.copytree(spare, data)
        with monkeypatch.context() as patched:
            die_after(patched, left, is_done)
            with contextlib.suppress(KeyboardInterrupt):
                restore(backup, backed_up, clock.now())
                break  # it has no more steps
        kept = None
        try:
            db = start()
        except DatabaseDamaged as damage:
            assert is_damaged
            kept = damage.kept_as
            found = "damaged"
        else:
            found = "backup" if SETTINGS.restored_at(db.read()) else "former"
            db.close()
            assert not files.sibling(backed_up, ".restore").exists()
            kept = data / "amr-scheduler.db.before-restore-20261123T120000Z"
        seen.add(found)
        if found != "former":
            assert is_damaged or kept.read_bytes() == before
    assert seen == {"damaged" if is_damaged else "former", "backup"}


def die_after(patched: pytest.MonkeyPatch, left: int, is_done: bool) -> None:
    """Before or after the next but so many calls that change a file."""
    calls = itertools.count()

    def dying(real):
        def call(*arguments, **options):
            is_last = next(calls) == left
            if is_last and not is_done:
                raise KeyboardInterrupt
            result = real(*arguments, **options)
            if is_last:
                raise KeyboardInterrupt
            return result

        return call

    for owner, name in (
        (Path, "rename"),
        (Path, "replace"),
        (os, "fsync"),
        (os, "utime"),
        (os, "open"),
        (shutil, "copyfile"),
    ):
        patched.setattr(owner, name, dying(getattr(owner, name)))


def test_an_export_during_an_interrupted_restore_says_so(backed_up):
    files.copy_private(newest_good_backup(backed_up), files.sibling(backed_up, ".to-restore"))
    with pytest.raises(DatabaseUnavailable, match=r"A restore was interrupted .*: start the app once"):
        Database.open_for_reading(backed_up)


@pytest.mark.parametrize("heartbeat", [None, "yesterday", "9999-12-31T23:59:59+00:00", 7])
def test_wrong_pins_stay_counted(backed_up, start, restored, heartbeat):
    db = start()
    db.write(lambda c: SETTINGS.put(c, WRONG_PINS, 12))
    db.write(lambda c: SETTINGS.put(c, "heartbeat", heartbeat))
    db.close()
    db = restored()
    assert SETTINGS.get(db.read(), WRONG_PINS) == 12


def test_a_half_made_first_database_is_simply_begun(path, start):
    path.parent.mkdir()
    path.write_bytes(b"")
    assert SETTINGS.load(start().read()).retry_limit == 10


# ---------------------------------------------------------------------- backups
def test_a_backup_made_during_writes_is_one_private_file(path, start):
    start().write(lambda c: SETTINGS.put(c, "a", 1))
    target = path.parent / BACKUPS / "manual.db"
    back_up(path, target)
    assert problem_of(target) is None
    assert [file.name for file in target.parent.iterdir()] == ["manual.db"]
    assert is_private(target)


def test_the_newest_good_backup_is_found_behind_a_bad_one(backed_up):
    good = newest_good_backup(backed_up)
    garbage(backed_up.parent / BACKUPS / "daily-2026-11-24.db")
    assert newest_good_backup(backed_up) == good
