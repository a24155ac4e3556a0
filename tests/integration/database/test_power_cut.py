"""The plug is pulled in the middle of a write: what was committed is there, and the file is sound.

With ``synchronous=FULL`` a commit returns after its frames are on the disk, so a cut leaves the log at least as long as it was at the last
commit; everything behind may be missing or be noise. While the log is written back, any of the file's pages may be old, new or torn.
"""

from __future__ import annotations

import random
import shutil
from pathlib import Path

import pytest

from app.database.connection import Database
from app.database.writer import WRITE_BACK_EVERY
from tests.support.examples import at_night

COMMITS = 40
NOISE = 300


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> tuple[Path, list[int]]:
    """A database as a cut leaves it, log and all, and how long the log was after each commit."""
    directory, aside = tmp_path_factory.mktemp("whole"), tmp_path_factory.mktemp("aside")
    path = directory / "amr-scheduler.db"
    db = _opened(path)
    db._writer._writing.checkpoint()
    lengths = []
    for number in range(COMMITS):
        _note(db, number)
        lengths.append(_log(path).stat().st_size)
    for name in (path, _log(path)):
        shutil.copy(name, aside / name.name)
    db.close()
    return aside / path.name, lengths


def _opened(path: Path) -> Database:
    db = Database.open(path, threaded=False)
    db.write(lambda c: c.execute("CREATE TABLE intents (number INTEGER PRIMARY KEY, text TEXT)"))
    return db


def _note(db: Database, number: int) -> None:
    db.write(lambda c: c.execute("INSERT INTO intents VALUES (?, ?)", (number, f"{number}" * 300)))


def _log(path: Path) -> Path:
    return path.with_name(f"{path.name}-wal")


def _intents(path: Path) -> list[int]:
    """Opening checks the file; what is in it."""
    db = Database.open(path, threaded=False)
    try:
        return [row[0] for row in db.read().execute("SELECT number FROM intents ORDER BY number")]
    finally:
        db.close()


def _copy(written: Path, directory: Path, cut: int) -> Path:
    directory.mkdir()
    path = directory / written.name
    shutil.copy(written, path)
    _log(path).write_bytes(_log(written).read_bytes()[:cut])
    return path


@pytest.mark.parametrize("torn", [True, *at_night(False)])
def test_wherever_the_log_ends_every_commit_before_it_is_there(written, tmp_path, torn):
    path, lengths = written
    chance = random.Random(7)
    for number in range(120):
        cut = chance.randrange(lengths[0], lengths[-1])
        copy = _copy(path, tmp_path / str(number), cut)
        if torn:
            with _log(copy).open("ab") as log:
                log.write(chance.randbytes(NOISE))
        committed = sum(length <= cut for length in lengths)
        assert _intents(copy) == list(range(committed))


def test_a_cut_while_the_log_is_written_back_loses_nothing(written, tmp_path):
    path, lengths = written
    chance = random.Random(8)
    whole = _copy(path, tmp_path / "whole", lengths[-1])
    _intents(whole)  # closing wrote the log back: the file as it is to become
    old, new, page = path.read_bytes(), whole.read_bytes(), 4096
    for number in range(60):
        copy = _copy(path, tmp_path / str(number), lengths[-1])
        mixed = bytearray(old.ljust(len(new), b"\0"))
        for at in range(0, len(new), page):
            ends = at + chance.choice((0, page, chance.randrange(page)))  # old, new, torn
            mixed[at:ends] = new[at:ends]
        copy.write_bytes(mixed)
        assert _intents(copy) == list(range(COMMITS))


def test_a_cut_while_the_log_starts_again_over_itself_loses_nothing(tmp_path):
    """After a checkpoint the log is overwritten from its head: a cut leaves new frames before old ones."""
    path = tmp_path / "running" / "amr-scheduler.db"
    path.parent.mkdir()
    db = _opened(path)
    for number in range(WRITE_BACK_EVERY):
        _note(db, number)
    chance, logs, file = random.Random(9), [_log(path).read_bytes()], path.read_bytes()
    for number in range(WRITE_BACK_EVERY, WRITE_BACK_EVERY + COMMITS):
        _note(db, number)
        logs.append(_log(path).read_bytes())
    db.close()
    assert len(logs[0]) == len(logs[-1]), "it grew instead"
    for number in range(60):
        commit = chance.randrange(COMMITS)
        cut = chance.randrange(len(logs[0]))
        copy = tmp_path / str(number) / path.name
        copy.parent.mkdir()
        copy.write_bytes(file)
        _log(copy).write_bytes(logs[commit + 1][:cut] + logs[commit][cut:])
        assert WRITE_BACK_EVERY + commit <= len(_intents(copy)) <= WRITE_BACK_EVERY + commit + 1
