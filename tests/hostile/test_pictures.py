"""Maps whose pictures are not what they claim: judged before they are decoded, in bounded memory."""

from __future__ import annotations

import resource
import struct
import subprocess
import sys
import zlib
from functools import cache
from pathlib import Path

import pytest

from app.domain.robot import RobotMap
from app.mir.errors import Unreadable
from app.services.robots.map_picture import picture_of

pytestmark = pytest.mark.filterwarnings("ignore::PIL.Image.DecompressionBombWarning")
ROOT = Path(__file__).parents[2]
GREY, RGBA, PALETTE = 0, 6, 3


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def header(width: int, height: int, colour: int, depth: int = 8) -> bytes:
    return chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0))


def rows(width: int, height: int, channels: int = 1) -> bytes:
    packer = zlib.compressobj(1)
    row = bytes(1 + width * channels)
    return chunk(b"IDAT", b"".join(packer.compress(row) for _ in range(height)) + packer.flush())


def one_colour(width: int, height: int) -> bytes:
    """As ``rows``, but quickly made: zeros, as pixels and as beginnings of rows."""
    packer, left = zlib.compressobj(1), (width + 1) * height
    parts = [packer.compress(bytes(min(2**20, left - done))) for done in range(0, left, 2**20)]
    return chunk(b"IDAT", b"".join(parts) + packer.flush())


def png(*chunks: bytes) -> RobotMap:
    return RobotMap("g", "Hall", b"\x89PNG\r\n\x1a\n" + b"".join(chunks) + chunk(b"IEND", b""))


@pytest.mark.parametrize(
    "extra", [header(13_000, 13_000, RGBA), header(10_000, 10_000, RGBA, 16), header(60_000, 60_000, GREY)]
)
def test_the_second_header_of_a_picture_is_judged_too(extra):
    with pytest.raises(Unreadable):
        picture_of(png(header(10, 10, GREY), extra, rows(10, 10)))


@pytest.mark.parametrize("size", [(1, 50_331_648), (50_331_648, 1), (3, 16_385), (16_385, 3)])
def test_a_picture_of_one_endless_side_is_not_decoded(size, monkeypatch):
    monkeypatch.setattr("PIL.PngImagePlugin.PngImageFile.load", lambda *_args: pytest.fail("it was decoded"))
    with pytest.raises(Unreadable, match="too large"):
        picture_of(png(header(*size, GREY), one_colour(*size)))
    with pytest.raises(Unreadable, match="too large"):
        picture_of(png(header(3, 3, GREY), header(*size, GREY), one_colour(*size)))


def test_the_longest_sides_that_are_decoded():
    for width, height in ((1, 16_384), (16_384, 1)):
        assert max(picture_of(png(header(width, height, GREY), rows(width, height))).size) == 768


@pytest.mark.parametrize(
    ("picture", "most"),
    [
        ("png(header(6900, 6900, GREY), rows(6900, 6900))", 130),
        (
            "png(header(6900, 6900, PALETTE), chunk(b'PLTE', bytes(768)), chunk(b'tRNS', bytes(256)), rows(6900, 6900))",
            130,
        ),
        ("png(header(3400, 3400, RGBA), rows(3400, 3400, 4))", 130),
        pytest.param("png(header(1, 50_331_648, GREY), one_colour(1, 50_331_648))", 5, marks=pytest.mark.long),
        pytest.param(
            "png(header(10, 10, GREY), header(13_000, 13_000, RGBA), rows(13_000, 13_000, 4))",
            20,
            marks=pytest.mark.long,
        ),
    ],
    ids=[
        "the largest grey one",
        "the largest of a palette",
        "the largest of colours",
        "one endless side",
        "two headers",
    ],
)
def test_a_picture_takes_bounded_memory(picture, most):
    assert megabytes_for(picture) < most


def megabytes_for(picture: str) -> int:
    """How much more memory a separate process needs to show it than to show a small one."""
    return (_peak(picture) - _peak("png(header(10, 10, GREY), rows(10, 10))")) // 1024


@cache
def _peak(picture: str) -> int:
    program = (
        f"from tests.hostile.test_pictures import *\nmap_ = {picture}\nbefore = peak()\n"
        "try:\n    picture_of(map_)\nexcept Unreadable:\n    pass\nprint(peak() - before)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, check=True)
    return int(done.stdout)


def peak() -> int:
    """KiB that this process has had in memory at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
