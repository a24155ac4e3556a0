"""The floor plan as a picture: the occupancy map that the API gives, and a view with stations and robot.

Greyscale PNG, 0.05 m per pixel, in the shades of an occupancy map: white floor, black where the scanners hit something, grey what they
cannot see, inside racks and outside the hall. Needs only the standard library.
"""

from __future__ import annotations

import base64
import struct
import zlib
from functools import lru_cache

from mir_sim import world
from mir_sim.motion import Pose

RESOLUTION = 0.05  # m per pixel
FLOOR, UNSEEN, WALL, MARK, ROBOT = 254, 205, 0, 120, 60
WALL_THICKNESS = 0.2
EDGE_THICKNESS = 0.15  # of racks and machines
SEEN = 4.0  # m around the robot
MARGIN = 2.0  # m of unseen area around the hall
PLAN = world.Box(-MARGIN, -MARGIN, world.WIDTH + MARGIN, world.HEIGHT + MARGIN)  # what the picture shows


class Picture:
    """A greyscale picture of a part of the map, addressed in metres; y points up."""

    def __init__(self, part: world.Box, grey: int) -> None:
        self._left, self._bottom = part.left, part.bottom
        self.columns, self.rows = (
            round((part.right - part.left) / RESOLUTION),
            round((part.top - part.bottom) / RESOLUTION),
        )
        self._pixels = [bytearray([grey]) * self.columns for _ in range(self.rows)]

    def fill(self, box: world.Box, grey: int) -> None:
        left = max(0, self._pixel(box.left - self._left))
        right = max(left, min(self.columns, self._pixel(box.right - self._left)))
        bottom, top = self._pixel(box.bottom - self._bottom), self._pixel(box.top - self._bottom)
        for row in range(max(0, self.rows - top), min(self.rows, self.rows - bottom)):
            self._pixels[row][left:right] = bytes([grey]) * (right - left)

    @staticmethod
    def _pixel(metres: float) -> int:
        return round(metres / RESOLUTION)

    def disc(self, x: float, y: float, radius: float, grey: int) -> None:
        steps = round(radius / RESOLUTION)
        for step in range(-steps, steps + 1):
            half = (steps * steps - step * step) ** 0.5 * RESOLUTION
            up = y + step * RESOLUTION
            self.fill(world.Box(x - half, up, x + half, up + RESOLUTION), grey)

    def png(self) -> bytes:
        rows = b"".join(b"\x00" + bytes(row) for row in self._pixels)
        head = struct.pack(">IIBBBBB", self.columns, self.rows, 8, 0, 0, 0, 0)
        return (
            b"\x89PNG\r\n\x1a\n"
            + _chunk(b"IHDR", head)
            + _chunk(b"IDAT", zlib.compress(rows, 9))
            + _chunk(b"IEND", b"")
        )


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _draw(part: world.Box = PLAN) -> Picture:
    picture, hall = Picture(part, UNSEEN), world.Box(0.0, 0.0, world.WIDTH, world.HEIGHT)
    picture.fill(hall, WALL)
    picture.fill(_grown(hall, -WALL_THICKNESS), FLOOR)
    for obstacle in world.OBSTACLES:
        picture.fill(obstacle, WALL)
        picture.fill(_grown(obstacle, -EDGE_THICKNESS), UNSEEN)
    return picture


def _grown(box: world.Box, by: float) -> world.Box:
    return world.Box(box.left - by, box.bottom - by, box.right + by, box.top + by)


@lru_cache(maxsize=1)
def base_map() -> str:
    """The occupancy map, base64 as in /maps/{guid}."""
    return base64.b64encode(_draw().png()).decode()


def scan(pose: Pose) -> bytes:
    """A PNG of what the scanners see around the robot, which is in the middle."""
    picture = _draw(world.Box(pose.x - SEEN, pose.y - SEEN, pose.x + SEEN, pose.y + SEEN))
    picture.disc(pose.x, pose.y, 0.5, ROBOT)
    return picture.png()


def live_view(pose: Pose) -> bytes:
    """A PNG of the hall with its stations and the robot at its present pose."""
    picture = _draw()
    for station in world.STATIONS:
        picture.disc(station.pose.x, station.pose.y, 0.3, MARK)
    picture.disc(pose.x, pose.y, 0.5, ROBOT)
    return picture.png()
