"""The floor plan as a picture: an occupancy map as robots keep it, and the same with stations and robot for people.

Grey PNG, 0.05 m per pixel, white floor, black walls; written with the standard library alone.
"""
from __future__ import annotations

import base64
import struct
import zlib
from functools import lru_cache

from mir_sim import world
from mir_sim.motion import Pose

RESOLUTION = 0.05     # m per pixel
FLOOR, WALL, MARK, ROBOT = 254, 0, 120, 60
WALL_THICKNESS = 0.2


class Picture:
    """A grey picture addressed in metres of the map; y goes up."""

    def __init__(self, width: float, height: float, grey: int) -> None:
        self.columns, self.rows = round(width / RESOLUTION), round(height / RESOLUTION)
        self._pixels = [bytearray([grey]) * self.columns for _ in range(self.rows)]

    def fill(self, box: world.Box, grey: int) -> None:
        left, right = max(0, round(box.left / RESOLUTION)), min(self.columns, round(box.right / RESOLUTION))
        for row in range(max(0, self.rows - round(box.top / RESOLUTION)), min(self.rows, self.rows - round(box.bottom / RESOLUTION))):
            self._pixels[row][left:right] = bytes([grey]) * max(0, right - left)

    def disc(self, x: float, y: float, radius: float, grey: int) -> None:
        steps = round(radius / RESOLUTION)
        for step in range(-steps, steps + 1):
            half = (steps * steps - step * step) ** 0.5 * RESOLUTION
            up = y + step * RESOLUTION
            self.fill(world.Box(x - half, up, x + half, up + RESOLUTION), grey)

    def png(self) -> bytes:
        rows = b"".join(b"\x00" + bytes(row) for row in self._pixels)
        head = struct.pack(">IIBBBBB", self.columns, self.rows, 8, 0, 0, 0, 0)
        return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", head) + _chunk(b"IDAT", zlib.compress(rows, 9)) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _draw() -> Picture:
    picture = Picture(world.WIDTH, world.HEIGHT, WALL)
    edge = WALL_THICKNESS
    picture.fill(world.Box(edge, edge, world.WIDTH - edge, world.HEIGHT - edge), FLOOR)
    for obstacle in world.OBSTACLES:
        picture.fill(obstacle, WALL)
    return picture


@lru_cache(maxsize=1)
def base_map() -> str:
    """The occupancy map, base64 as in /maps/{guid}."""
    return base64.b64encode(_draw().png()).decode()


def live_view(pose: Pose) -> bytes:
    """A PNG of the hall with its stations and the robot where it is."""
    picture = _draw()
    for station in world.STATIONS:
        picture.disc(station.pose.x, station.pose.y, 0.3, MARK)
    picture.disc(pose.x, pose.y, 0.5, ROBOT)
    return picture.png()
