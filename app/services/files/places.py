"""Places for people's files: the Documents folder, and mounted sticks and network shares."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum
from itertools import chain, islice
from pathlib import Path

from app.services.live import windows

MOUNTS = Path("/proc/self/mounts")
MEDIA = (Path("/media"), Path("/run/media"))
# file systems of the network
SHARES = frozenset({"cifs", "smb3", "smbfs", "nfs", "nfs4", "fuse.sshfs", "davfs", "fuse.davfs2"})
MOST_FILES = 200  # that are listed
MOST_SEEN = 5000  # that are looked at


class PlaceKind(StrEnum):
    DOCUMENTS = "documents"
    USB = "usb"
    SHARE = "share"
    TABLET = "tablet"  # the app's own


@dataclass(frozen=True)
class Place:
    """A directory; ``name`` is that of the stick or share."""

    kind: PlaceKind
    path: Path
    name: str = ""


DRIVES = {windows.REMOVABLE: PlaceKind.USB, windows.REMOTE: PlaceKind.SHARE}


@dataclass(frozen=True)
class FoundFile:
    """``changed_at`` is UTC, ``size`` in bytes."""

    path: Path
    changed_at: datetime
    size: int

    @classmethod
    def at(cls, path: Path) -> FoundFile:
        """Raises OSError; ValueError or OverflowError for a time that no calendar has."""
        stat = path.stat()
        return cls(path, datetime.fromtimestamp(stat.st_mtime, UTC), stat.st_size)


def mounted() -> Iterator[Place]:
    """Sticks, then shares, by name. Asks the table of mounts only, or Windows for its drives: a share whose server is off
    would not answer."""
    found = [*_in_table_of_mounts(), *_drives()]
    yield from sorted(found, key=lambda place: (place.kind is PlaceKind.SHARE, place.name.casefold()))


def _in_table_of_mounts() -> Iterator[Place]:
    with contextlib.suppress(OSError):
        lines = (line.split() for line in MOUNTS.read_text(encoding="utf-8", errors="replace").splitlines())
        yield from (
            place for fields in lines if len(fields) > 2 and (place := _place(Path(_plain(fields[1])), fields[2]))
        )


def _place(path: Path, system: str) -> Place | None:
    if system in SHARES:
        return Place(PlaceKind.SHARE, path, path.name)
    return Place(PlaceKind.USB, path, path.name) if any(media in path.parents for media in MEDIA) else None


def _drives() -> Iterator[Place]:
    """Named as in Windows' Explorer: KINGSTON (E:)."""
    for root, kind, label in windows.drives():
        if kind in DRIVES and label is not None:
            letter = root.rstrip("\\")
            yield Place(DRIVES[kind], Path(root), f"{label} ({letter})" if label else letter)


def _plain(field: str) -> str:
    """As the table writes it, a space is ``\\040``."""
    return re.sub(r"\\([0-7]{3})", lambda octal: chr(int(octal[1], 8)), field)


def found_in(directory: Path, suffix: str) -> list[FoundFile]:
    """The files of that kind in a directory and its subdirectories, newest first, without hidden ones. ``suffix`` is in
    lower case, a file's may be in capitals."""
    found: list[FoundFile] = []
    for path in islice(_named(directory, suffix), MOST_SEEN):
        with contextlib.suppress(OSError, ValueError, OverflowError):  # deleted, or of a day that no calendar has
            if path.is_file() and os.access(path, os.R_OK):
                found.append(FoundFile.at(path))
    return sorted(found, key=lambda file: (file.changed_at, file.path), reverse=True)[:MOST_FILES]


def _named(directory: Path, suffix: str) -> Iterator[Path]:
    here = _entries(directory)
    inside = chain.from_iterable(_entries(path) for path in here if path.is_dir())
    return (path for path in chain(here, inside) if path.name.lower().endswith(suffix))


def _entries(directory: Path) -> list[Path]:
    """Without hidden or unreadable ones, and those with a name in an unknown encoding."""
    try:
        names = [name for name in os.listdir(directory) if not name.startswith(".")]
        return [directory / name for name in names if name.encode(errors="ignore").decode() == name]
    except OSError:
        return []
