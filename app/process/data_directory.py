"""The directory where everything lives: database, backups, logs, lock, inbox; readable by its owner only."""

from __future__ import annotations

import contextlib
import os
import stat
from dataclasses import dataclass
from pathlib import Path

import platformdirs

from app.container import DATABASE_NAME
from app.failures import BadInput
from app.process.log_file import FILE_NAME as LOG_NAME

_OURS = (DATABASE_NAME, "scheduler.lock")
_DIRECTORIES = ("backups", "inbox", "logs", "maps")


@dataclass(frozen=True)
class DataDirectory:
    """``only_to_read``: it may lie where nothing can be written."""

    path: Path
    only_to_read: bool = False

    @classmethod
    def prepare(cls, path: Path | None, *, only_to_read: bool = False, has_data: bool = False) -> DataDirectory:
        """Make the directory, or take the one there. Raises BadInput for one of another user, for one that is neither empty nor ours, that
        can't be written unless it is ``only_to_read``, or without a database if it ``has_data``: a name mistyped makes no directory."""
        path = path or platformdirs.user_data_path("amr-scheduler", appauthor=False)
        try:
            if has_data and not path.exists():
                raise BadInput(f"there is no data directory {path}; check --data-dir")
            path.mkdir(mode=0o700, parents=True, exist_ok=True)
            _refuse_shared(path)
            if not _is_ours(path):
                raise BadInput(f"{path} holds other files; give an empty directory or one of {DATABASE_NAME}")
            if has_data and not any(entry.name.startswith(DATABASE_NAME) for entry in path.iterdir()):
                raise BadInput(f"{path} holds no data yet; check --data-dir, or start the app there first")
            if not only_to_read:
                path.chmod(0o700)
            elif path.stat().st_mode & 0o077:
                with contextlib.suppress(OSError):
                    path.chmod(path.stat().st_mode & 0o700)
        except FileExistsError:
            raise BadInput(f"{path} is not a directory; give a directory with --data-dir") from None
        except OSError as error:
            raise BadInput(f"{path} can't be used: {error.strerror}; give another directory with --data-dir") from None
        return cls(path.resolve(), only_to_read)

    @property
    def database(self) -> Path:
        return self.path / DATABASE_NAME

    @property
    def logs(self) -> Path:
        return self.path / "logs"


def _refuse_shared(path: Path) -> None:
    """What others can put there would be read as ours, and a link be followed to a file of this user. A directory of root in which nobody
    else can write is none of these: data that was mounted, for one."""
    found = path.stat()
    if os.name != "posix":
        return
    is_closed = not (found.st_mode & 0o022 and os.access(path, os.W_OK))
    if found.st_uid != os.geteuid() and not (found.st_uid == 0 and is_closed):
        raise BadInput(
            f"{path} belongs to another user; give a directory of your own with --data-dir, or run this as that user"
        )
    if found.st_mode & stat.S_ISVTX and found.st_mode & 0o022:
        raise BadInput(
            f"{path} is shared by several users; give a directory of your own with --data-dir, such as one in it"
        )


def _is_ours(path: Path) -> bool:
    """Whether it is empty or holds files of this app; after a command that failed early that is only its log."""
    names = {entry.name for entry in path.iterdir()}
    if names == {"logs"}:
        return all(file.name.startswith(LOG_NAME) for file in (path / "logs").iterdir())
    return not names or any(name.startswith(_OURS) for name in names)


def refuse_own_file(path: Path) -> None:
    """Raises BadInput where an export would take the place of something that the app keeps, in this data directory or any other."""
    for directory in path.parents:
        name = path.relative_to(directory).parts[0]
        if (name.startswith(_OURS) or name in _DIRECTORIES) and any((directory / ours).exists() for ours in _OURS):
            raise BadInput(f"{path} belongs to the data of the app; give another file to write to")
