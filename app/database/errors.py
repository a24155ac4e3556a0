"""Errors of the database, each with one English sentence with the problem and its remedy."""

from __future__ import annotations

import errno
import os
import sqlite3
from pathlib import Path

from app.command import command
from app.domain.message import Message, message, render


class DatabaseError(Exception):
    """Base of all below; ``text`` is one English sentence for people, ``message`` the same without a language."""

    def __init__(self, msgid: str, **params: object) -> None:
        self.message = message(msgid, **params)
        super().__init__(render(self.message))

    @property
    def text(self) -> str:
        return str(self)


class DatabaseUnavailable(DatabaseError):
    """The data is sound, but can't be written or read just now: disk full, read-only, an I/O error, held by another process."""


class DatabaseRefused(DatabaseError):
    """A sound file that this version must not touch: written by a newer version, or not ours."""


class DatabaseDamaged(DatabaseError):
    """The file is not a readable database any more. Nothing is scheduled until a backup is restored.

    ``path`` is where the database belongs, ``kept_as`` where the damaged file is now (None: it was left in place, or there is none),
    ``backup`` the newest good backup (None: there is none).
    """

    def __init__(self, path: Path, problem: Message, kept_as: Path | None = None, backup: Path | None = None) -> None:
        self.path, self.problem, self.kept_as, self.backup = path, problem, kept_as, backup
        kept = message(", kept as {path}", path=kept_as) if kept_as else ""
        mend = (
            message(
                "restore the newest good backup with: {command}",
                command=command("--data-dir", path.parent, "--restore-backup", backup),
            )
            if backup
            else message(
                "there is no good backup in the data directory: restore one from elsewhere with: {command} FILE",
                command=command("--data-dir", path.parent, "--restore-backup"),
            )
        )
        whole = message(
            "The database {path} is damaged ({problem}){kept}, {mend}", path=path, problem=problem, kept=kept, mend=mend
        )
        super().__init__(whole["msgid"], **whole["params"])


SENTENCES = {
    sqlite3.SQLITE_FULL: "The disk is full, so {path} can't be written: free some space",
    sqlite3.SQLITE_READONLY: "{path} can't be written because it is read-only: check the permissions of the data directory",
    sqlite3.SQLITE_PERM: "{path} can't be opened: check the permissions of the data directory",
    sqlite3.SQLITE_CANTOPEN: "{path} can't be opened: check that the data directory exists and is yours",
    sqlite3.SQLITE_IOERR: "The storage reports an error at {path}: check the disk",
    sqlite3.SQLITE_BUSY: "{path} is in use by another program: close that one first",
    sqlite3.SQLITE_LOCKED: "{path} is in use by another program: close that one first",
    sqlite3.SQLITE_NOMEM: "There is not enough memory to work with {path}",
}
_DAMAGE = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)


def primary_code(error: BaseException) -> int:
    """SQLite's primary result code of an error, 0 if it has none."""
    return getattr(error, "sqlite_errorcode", 0) & 0xFF


def translated(error: BaseException, path: Path) -> BaseException:
    """The matching DatabaseError for a failure of the storage; anything else (a broken constraint, a bug) unchanged."""
    code = primary_code(error)
    if code in _DAMAGE:
        return DatabaseDamaged(path, str(error))
    if code == sqlite3.SQLITE_CANTOPEN and _are_too_many_files_open():
        return DatabaseUnavailable(
            "{path} can't be opened because too many files are open: raise the limit (ulimit -n) and start the "
            "app again",
            path=path,
        )
    if msgid := SENTENCES.get(code):
        return DatabaseUnavailable(msgid, path=path)
    return error


def _are_too_many_files_open() -> bool:
    try:
        os.close(os.open(os.devnull, os.O_RDONLY))
    except OSError as error:
        return error.errno in (errno.EMFILE, errno.ENFILE)
    return False
