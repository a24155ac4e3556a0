"""The files of the data directory: readable by their owner only, written whole or not at all, and a damaged database never overwritten."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from datetime import datetime
from pathlib import Path

from app.database.errors import DatabaseUnavailable
from app.domain.message import message_of_system

DIRECTORY_MODE, FILE_MODE = 0o700, 0o600
NO_LINK = getattr(os, "O_NOFOLLOW", 0)  # for opening: someone else's link there would decide which file is written
SIDES = ("", "-wal", "-shm")  # the files that make up one SQLite database
_CAN_SET_MODES = os.name == "posix"


def make_directory(path: Path) -> None:
    """Create it, or tighten the permissions of an existing one."""
    try:
        path.mkdir(mode=DIRECTORY_MODE, parents=True, exist_ok=True)
        if _CAN_SET_MODES and path.stat().st_mode & 0o077:
            path.chmod(DIRECTORY_MODE)
    except OSError as error:
        raise DatabaseUnavailable(
            "The data directory {path} can't be used: {problem}", path=path, problem=message_of_system(error)
        ) from error


def make_private(path: Path) -> None:
    """Create an empty file if there is none; either way only its owner can read it."""
    try:
        is_new = not path.exists()
        os.close(os.open(path, os.O_CREAT | os.O_WRONLY | NO_LINK, FILE_MODE))
        if is_new:
            sync_directory(path.parent)
        for side in SIDES:
            with contextlib.suppress(FileNotFoundError):
                side_file = sibling(path, side)
                if _CAN_SET_MODES and side_file.stat().st_mode & 0o077:
                    side_file.chmod(FILE_MODE)
    except OSError as error:
        raise DatabaseUnavailable(
            "{path} can't be written: {problem}", path=path, problem=message_of_system(error)
        ) from error


def write_whole(path: Path, content: bytes) -> None:
    """Whole or not at all, readable by its owner only; of several threads the last one counts. Raises OSError."""
    descriptor, draft = tempfile.mkstemp(".draft", f"{path.stem}.", path.parent)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
        os.replace(draft, path)
    except OSError:
        Path(draft).unlink(missing_ok=True)
        raise


def sibling(path: Path, ending: str) -> Path:
    return path.with_name(path.name + ending)


def size_of(path: Path) -> int:
    """Size in bytes, 0 if the file does not exist."""
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0


def sync_directory(path: Path) -> None:
    """Make renames in it survive a power cut."""
    if os.name != "posix":
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def sync_file(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def copy_private(source: Path, target: Path) -> None:
    """A copy that only the owner can read, on disk when this returns."""
    with contextlib.suppress(FileNotFoundError):
        target.unlink()
    make_private(target)
    shutil.copyfile(source, target)
    sync_file(target)


def set_aside(path: Path, label: str, now: datetime) -> Path | None:
    """Rename the database and what belongs to it to ``<name>.<label>-<time>``; nothing is ever deleted. None when there is no file."""
    stem = f"{path.name}.{label}-{now:%Y%m%dT%H%M%SZ}"
    target, number = path.with_name(stem), 1
    while any(
        sibling(target, side).exists() and sibling(path, side).exists() for side in SIDES
    ):  # else it is being carried on
        number += 1
        target = path.with_name(f"{stem}-{number}")
    moved = False
    for side in SIDES:
        with contextlib.suppress(FileNotFoundError):
            sibling(path, side).rename(sibling(target, side))
            moved = True
    sync_directory(path.parent)
    return target if moved else None


# ---------------------------------------------------------------------- the mark of a damaged database
def _mark(path: Path) -> Path:
    return sibling(path, ".damaged")


_NOTHING = "-"


def put_aside(path: Path, label: str, now: datetime) -> Path | None:
    """``set_aside`` with a mark, so that later starts refuse too: a damaged database is never replaced by an empty one.

    The mark exists before the rename and is empty until that is done, so that a crash in between can be distinguished
    from a restore.
    """
    _write_mark(path, "")
    kept = set_aside(path, label, now)
    _write_mark(path, kept.name if kept else _NOTHING)
    return kept


def _write_mark(path: Path, text: str) -> None:
    mark = _mark(path)
    make_private(mark)
    mark.write_text(text, encoding="utf-8")
    sync_file(mark)


def is_marked_damaged(path: Path) -> bool:
    return _mark(path).exists()


def is_aside(path: Path) -> bool:
    """Whether the marked rename was done: if a database exists again, it was restored."""
    return bool(_mark(path).read_text(encoding="utf-8").strip())


def kept_as(path: Path) -> Path | None:
    """Where the damaged file was put."""
    name = _mark(path).read_text(encoding="utf-8").strip()
    return path.with_name(name) if name not in ("", _NOTHING) else None


def clear_mark(path: Path) -> None:
    _mark(path).unlink(missing_ok=True)
    sync_directory(path.parent)
