"""Reading the files that people bring in, and writing where others may write too, such as in /tmp: a link put there by
someone else must not decide which file an export replaces.

To write, links that no one else can have made are followed first; the rest is opened without following links.
"""

from __future__ import annotations

import contextlib
import errno
import os
import stat
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from app.domain.message import message_of_system
from app.domain.models import InvalidInput
from app.services.catalogue.configuration.document import LARGEST_FILE


def read_file(source: Path, *, may_be_pipe: bool = False) -> bytes:
    """The bytes of a file to import, at most 5 MiB. Raises InvalidInput("path", …).

    A pipe may never end, so only a command, which can be interrupted, reads one.
    """
    if not may_be_pipe and source.exists() and not (source.is_file() or source.is_dir()):
        raise InvalidInput("path", "{path} is not a plain file", path=source)
    try:
        with source.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise InvalidInput("path", "there is no file {path}", path=source) from None
    except OSError as error:
        raise InvalidInput(
            "path", "{path} can't be read: {problem}", path=source, problem=message_of_system(error)
        ) from None
    if len(content) > LARGEST_FILE:
        raise InvalidInput("path", "{path} is larger than 5 MiB", path=source)
    return content


MOST_LINKS = 40  # that lead from one to the other, as the system has it
_HAS_DIRECTORY_FD = os.open in os.supports_dir_fd
_DIRECTORY = getattr(os, "O_PATH", os.O_RDONLY) | getattr(os, "O_DIRECTORY", 0)
_NO_LINK = getattr(os, "O_NOFOLLOW", 0)
_KERNEL = Path("/proc")  # where links such as /proc/self/fd/1 lead to pipes without a path


def without_links(path: Path) -> Path:
    """The path of the same file without links, whether or not it exists; only the kernel's own to a pipe stays.

    Raises InvalidInput("path", …) if somebody else may have made a link on the way, or the pipe at its end.
    """
    path = path.absolute()
    here, rest, links = Path(path.anchor), [*reversed(path.parts[1:])], 0
    while rest:
        part = rest.pop()
        place = here.parent if part == ".." else here / part
        if _could_be_planted(place):
            raise InvalidInput(
                "path",
                "{path} is a link or a pipe that somebody else may have put there: choose another place",
                path=place,
            )
        if not place.is_symlink():
            here = place
            continue
        target = here / os.readlink(place)
        if _KERNEL in place.parents and not target.exists():
            return place.joinpath(*reversed(rest))
        if (links := links + 1) > MOST_LINKS:
            raise InvalidInput("path", "{path} is a link that leads nowhere", path=path)
        here, rest = Path(target.anchor), [*rest, *reversed(target.parts[1:])]
    return here


def _could_be_planted(place: Path) -> bool:
    if os.name != "posix":
        return False
    try:
        found, parent = place.lstat(), place.parent.stat()
    except OSError:
        return False
    return (stat.S_ISLNK(found.st_mode) or stat.S_ISFIFO(found.st_mode)) and (
        found.st_uid not in (os.geteuid(), 0) or bool(parent.st_mode & stat.S_IWOTH)
    )


@contextlib.contextmanager
def draft_of(target: Path) -> Iterator[TextIO]:
    """A file that replaces ``target``, a path ``without_links``, only when it is complete; only its owner can read it.
    Raises OSError, also if a directory on the way has become a link since."""
    with _directory(target.parent) as (fd, base):
        draft = base / f".{target.name}.{uuid.uuid4().hex[:8]}"
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | _NO_LINK | getattr(os, "O_BINARY", 0)
        descriptor = os.open(draft, flags, 0o600, dir_fd=fd)
        try:
            with os.fdopen(descriptor, "w", encoding="utf-8", newline="") as file:
                yield file
            os.replace(draft, base / target.name, src_dir_fd=fd, dst_dir_fd=fd)
        except BaseException:
            with contextlib.suppress(FileNotFoundError):
                os.unlink(draft, dir_fd=fd)
            raise


def open_in_place(target: Path) -> TextIO:
    """A pipe or a device, a path ``without_links``, to be written into. Raises OSError, also where it has become a file since."""
    with _directory(target.parent) as (fd, base):
        descriptor = os.open(
            base / target.name, os.O_WRONLY | (0 if _KERNEL in target.parents else _NO_LINK), dir_fd=fd
        )
    if stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))
    return os.fdopen(descriptor, "w", encoding="utf-8", newline="")


@contextlib.contextmanager
def _directory(path: Path) -> Iterator[tuple[int | None, Path]]:
    """A directory without links as a descriptor, if the system can have that, and how paths in it begin."""
    if not _HAS_DIRECTORY_FD:
        yield None, path
        return
    fd = os.open(path.anchor, _DIRECTORY)
    try:
        for part in path.parts[1:]:
            inner = os.open(part, _DIRECTORY | _NO_LINK, dir_fd=fd)
            os.close(fd)
            fd = inner
        yield fd, Path()
    finally:
        os.close(fd)
