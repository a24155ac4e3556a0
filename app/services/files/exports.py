"""Files that people carry in and out of the tablet: configuration, history, backups. Every path is checked before
anything is written.

Errors are raised as InvalidInput("path", …) with one sentence; an export never overwrites an existing file.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator, Sequence
from itertools import count
from pathlib import Path
from typing import TextIO

import platformdirs

from app.database.backups import BACKUPS, CHECK_UP_LEFT, NOT_RESTORED, back_up, backups_of, problem_of
from app.database.check_ups import CheckUpRepository
from app.database.connection import Database
from app.database.errors import DatabaseError
from app.database.execution_history import ExecutionFilter
from app.domain.clock import Clock
from app.domain.message import Message, message_of_system
from app.domain.models import InvalidInput
from app.services.catalogue import configuration
from app.services.catalogue.catalogue import Catalogue
from app.services.catalogue.configuration.importing import DeletesRuns
from app.services.catalogue.database_check import find_problem
from app.services.files.file_access import draft_of, read_file, without_links
from app.services.files.history_export import write_history
from app.services.files.places import FoundFile, Place, PlaceKind, mounted


class DataFiles:
    """``documents`` is the people's directory for files; without it, the data directory's ``exports`` is used."""

    def __init__(self, db: Database, catalogue: Catalogue, clock: Clock, documents: Path | None = None) -> None:
        self._db, self._catalogue, self._clock = db, catalogue, clock
        self._documents = documents

    # ------------------------------------------------------------------ where files go
    @property
    def data_directory(self) -> Path:
        return self._db.path.parent

    @property
    def directory(self) -> Path:
        """The default directory of exports."""
        documents = self._documents or platformdirs.user_documents_path()
        return documents if os.access(documents, os.W_OK) else self.data_directory / "exports"

    def places(self) -> list[Place]:
        """``directory``, then the present sticks and shares."""
        own = self.data_directory in self.directory.parents
        return [Place(PlaceKind.TABLET if own else PlaceKind.DOCUMENTS, self.directory), *mounted()]

    def suggested(self, stem: str, suffix: str, directory: Path | None = None) -> Path:
        """A file that doesn't exist yet, named after today (UTC): ``amr-scheduler-log-2026-11-20.csv``, then ``…-2.csv``."""
        return _free_path(directory or self.directory, f"{stem}-{self._clock.now():%Y-%m-%d}", suffix)

    # ------------------------------------------------------------------ out
    def export_configuration(self, path: str) -> Path:
        """Write the configuration, without secrets. Returns the file."""
        with self._new_file(path, ".json") as (target, file):
            file.write(configuration.export_configuration(self._db.read()))
        return target

    def export_history(self, path: str, *, for_excel: bool = False) -> Path:
        """Write every execution as CSV. Returns the file."""
        with self._new_file(path, ".csv") as (target, file):
            write_history(self._db.read(), file, for_excel=for_excel)
        return target

    def export_runs(
        self, wanted: ExecutionFilter, directory: Path | None = None, *, for_excel: bool = False
    ) -> tuple[Path, int]:
        """Write the executions that a filter lets through as CSV. Returns the new file and how many it has."""
        with self._new_file(str(self.suggested("amr-scheduler-log", ".csv", directory)), ".csv") as (target, file):
            return target, write_history(self._db.read(), file, wanted, for_excel=for_excel)

    def write_text(self, text: str, name: str, suffix: str, directory: Path | None = None) -> Path:
        """Write a new file, named after the words of ``name``. Returns it."""
        stem = "-".join(["amr-scheduler", *re.findall(r"\w+", name.lower())])  # a name is not a path
        with self._new_file(str(self.suggested(stem, suffix, directory)), suffix) as (target, file):
            file.write(text.encode("utf-8", "replace").decode())
        return target

    # ------------------------------------------------------------------ in
    def import_configuration(self, path: str, *, may_delete: bool = False) -> Sequence[Message]:
        """Import a configuration file, completely or not at all. Returns what was added or changed, one sentence each.
        Raises DeletesRuns where that has to be confirmed first."""
        content = read_file(self._resolved(path))
        return configuration.import_configuration(self._catalogue, content, may_delete=may_delete)

    def preview_import(self, path: str) -> tuple[Sequence[Message], DeletesRuns | None]:
        """What an import would add or change, and which runs it would delete; nothing is changed."""
        return configuration.preview(self._catalogue, read_file(self._resolved(path)))

    # ------------------------------------------------------------------ backups
    def backups(self) -> list[FoundFile]:
        """Newest first."""
        found = []
        for path in backups_of(self._db.path):
            with contextlib.suppress(FileNotFoundError):  # the oldest may just have been deleted
                found.append(FoundFile.at(path))
        return found

    def backup_places(self) -> list[Place]:
        """Where backups may be: this tablet's own directory, then the present sticks and shares."""
        return [Place(PlaceKind.TABLET, self.data_directory / BACKUPS), *mounted()]

    def back_up_now(self, stem: str = "manual") -> FoundFile:
        """A copy of the database as it is now, whole and verified, in this tablet's own directory."""
        return self._back_up(
            _free_path(self.data_directory / BACKUPS, f"{stem}-{self._clock.now():%Y-%m-%dT%H%M%SZ}", ".db")
        )

    def back_up_to(self, path: str) -> FoundFile:
        """The same into a new file, in a directory that exists or in this tablet's own."""
        target = self._resolved(path).with_suffix(".db")
        if target.exists():
            raise InvalidInput("path", "{path} exists already: choose another name", path=target)
        if not target.parent.is_dir() and target.parent != self.data_directory / BACKUPS:
            raise InvalidInput("path", "there is no directory {path}", path=target.parent)
        return self._back_up(target)

    def _back_up(self, path: Path) -> FoundFile:
        try:
            back_up(self._db.path, path)
        except DatabaseError as error:
            raise InvalidInput("path", "the backup could not be made: {problem}", problem=error) from error
        return FoundFile.at(path)

    def check_backup(self, path: Path) -> None:
        """Raises InvalidInput when this file can't be restored, or none can now."""
        if names := CheckUpRepository().names_left(self._db.read()):
            raise InvalidInput("path", CHECK_UP_LEFT, robots=", ".join(names))
        if problem := problem_of(path, check=find_problem):
            raise InvalidInput("path", NOT_RESTORED, path=path, problem=problem)

    # ------------------------------------------------------------------ inside
    def _resolved(self, text: str) -> Path:
        """The absolute path: ``~`` is the user's home, a bare name is in ``directory``."""
        if not text.strip():
            raise InvalidInput("path", "enter the name of a file")
        if "\0" in text:
            raise InvalidInput("path", "{path} is not the name of a file", path=repr(text))
        return (self.directory / Path(text.strip()).expanduser()).absolute()

    @contextlib.contextmanager
    def _new_file(self, text: str, suffix: str) -> Iterator[tuple[Path, TextIO]]:
        """A file that appears under its name only when it is whole; its owner alone can read it."""
        target = self._resolved(text)
        if target.is_dir():
            raise InvalidInput("path", "{path} is a directory: add the name of a file", path=target)
        if not target.suffix:
            target = target.with_suffix(suffix)
        found = without_links(target)
        if found.exists():
            raise InvalidInput("path", "{path} exists already: choose another name", path=target)
        if target.parent == self.directory:
            with contextlib.suppress(OSError):
                target.parent.mkdir(mode=0o700, exist_ok=True)
        try:
            with draft_of(found) as file:
                yield target, file
        except FileNotFoundError:
            raise InvalidInput("path", "there is no directory {path}", path=target.parent) from None
        except OSError as error:
            raise InvalidInput(
                "path", "{path} can't be written: {problem}", path=target, problem=message_of_system(error)
            ) from None


def _free_path(directory: Path, stem: str, suffix: str) -> Path:
    """The first of ``stem``, ``stem-2``, ``stem-3`` … that does not exist."""
    paths = (directory / f"{stem}{f'-{number}' if number > 1 else ''}{suffix}" for number in count(1))
    return next(path for path in paths if not path.exists())
