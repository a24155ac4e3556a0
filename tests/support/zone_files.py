"""Files of time zone data, as a system has them."""

from __future__ import annotations

import struct
from importlib.resources import files
from pathlib import Path


def zone_file(name: str) -> bytes:
    """A file of the app's own zone data."""
    return files("tzdata").joinpath("zoneinfo", name).read_bytes()


def file_of_rule(rule: str) -> bytes:
    """A zone that has always had this POSIX rule, such as EET-2EEST,M3.5.0/3,M10.5.0/4 (RFC 9636)."""

    def block(version: bytes) -> bytes:
        return (
            b"TZif"
            + version
            + bytes(15)
            + struct.pack(">6l", 0, 0, 0, 0, 1, 4)
            + struct.pack(">lBB", 0, 0, 0)
            + b"UTC\0"
        )

    return block(b"2") + block(b"2") + b"\n" + rule.encode("ascii") + b"\n"


def put(root: Path, path: str, content: bytes | str) -> Path:
    """Write a file below ``root``, with the directories that it needs."""
    file = root / path.lstrip("/")
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(content.encode("ascii") if isinstance(content, str) else content)
    return file
