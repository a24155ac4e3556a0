"""A robot's map for a tablet: cropped to the known area, scaled down, with walls and unknown ground distinguished.
Pure.

Robots draw their maps for their own screen and their own planner: large, mostly unknown ground, in the greys of an
occupancy map (wall black, floor white, unknown between). Here it becomes one byte per pixel, the amount of wall, so
that a theme can colour it.
"""

from __future__ import annotations

import base64
import io
import json
import math
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from app.domain.message import message
from app.domain.robot import ENTRIES, MapPosition, Pose, RobotMap
from app.mir.errors import Unreadable

LARGEST_DECODED = 48 * 1024 * 1024  # bytes of a picture in memory; about twice that is needed to reduce it
LONGEST_DECODED = 16_384  # px of a side of it: each row costs memory and time of its own, however few pixels are in it
LONGEST_SIDE = 768  # px of the result: about twice a card's, so that thin walls survive scaling
WALL_BELOW, FLOOR_ABOVE = (
    100,
    230,
)  # greys of an occupancy map: 0, 254 and 205 for the unknown (ROS map_server; G for robots' pictures)
UNSEEN_GREY = 205
UNSEEN = 64  # how much of a wall's darkness unknown ground gets, of 255
MARGIN = 1.0  # m kept around what is known
FINEST = 0.001  # m per pixel; robots' maps have 0.05
MOST_PLACES = 200
LONGEST_NAME = 255
_FORMAT = 1


@dataclass(frozen=True)
class Place:
    """A named place, in fractions of the picture from its lower left corner."""

    name: str
    x: float
    y: float


@dataclass(frozen=True, eq=False)
class MapPicture:
    """``shade``: one byte per pixel in rows from the bottom up, 0 floor … 255 wall. ``origin``: pose of the lower left corner on the map,
    its orientation in degrees (G: ROS keeps it in radians, robots give degrees everywhere else). ``extent``: width and height in m."""

    name: str
    shade: bytes = field(repr=False)
    size: tuple[int, int]
    origin: Pose
    extent: tuple[float, float]
    places: tuple[Place, ...] = ()

    @property
    def aspect(self) -> float:
        """Height / width."""
        return self.extent[1] / self.extent[0]

    def fraction(self, x: float, y: float) -> tuple[float, float] | None:
        """A point of the map in m as fractions of the picture; None outside of it."""
        turn = math.radians(-self.origin.orientation)
        dx, dy = x - self.origin.x, y - self.origin.y
        right = (dx * math.cos(turn) - dy * math.sin(turn)) / self.extent[0]
        up = (dx * math.sin(turn) + dy * math.cos(turn)) / self.extent[1]
        return (right, up) if 0 <= right <= 1 and 0 <= up <= 1 else None

    def heading(self, orientation: float) -> float:
        """An orientation on the map as one on the picture, in degrees anticlockwise from the right."""
        return orientation - self.origin.orientation


def picture_of(floor: RobotMap, positions: Iterable[MapPosition] = ()) -> MapPicture:
    """The picture of a robot's map and its places. Raises Unreadable for a picture that can't be decoded or is
    empty."""
    if floor.resolution < FINEST:
        raise Unreadable(problem=message("the map's resolution is impossible"))
    left, bottom, width, height, size, shade = _reduced(floor.png, floor.resolution)
    turn, m = math.radians(floor.origin.orientation), floor.resolution
    origin = Pose(
        floor.origin.x + (left * math.cos(turn) - bottom * math.sin(turn)) * m,
        floor.origin.y + (left * math.sin(turn) + bottom * math.cos(turn)) * m,
        floor.origin.orientation,
    )
    bare = MapPicture(floor.name, shade, size, origin, (width * m, height * m))
    return replace(bare, places=tuple(_places(bare, positions)))


def _places(picture: MapPicture, positions: Iterable[MapPosition]) -> Iterable[Place]:
    for position in list(positions)[:MOST_PLACES]:
        if position.pose is None or not position.name or position.type_id in ENTRIES:
            continue
        if (point := picture.fraction(position.pose.x, position.pose.y)) is not None:
            yield Place(position.name, *point)


def _check_size(image: Any) -> None:
    """Check before decoding: a few bytes may claim to be gigabytes. Pillow uses the last of several headers, and needs
    four bytes per pixel for pictures that are neither grey nor have a palette."""
    is_narrow = image.mode in ("1", "L", "P") and "transparency" not in image.info
    size = image.width * image.height * (1 if is_narrow else 4)
    if not 0 < size <= LARGEST_DECODED or max(image.size) > LONGEST_DECODED:
        raise Unreadable(problem=message("the map's picture is too large"))


def _reduced(png: bytes, resolution: float) -> tuple[int, int, int, int, tuple[int, int], bytes]:
    """Left, bottom, width and height in px of the cropped part, then its reduced size and shade."""
    # Pillow comes with the window; without one no map is shown.
    from PIL import Image, ImageChops

    try:
        with Image.open(io.BytesIO(png), formats=("PNG",)) as image:
            _check_size(image)
            grey = _grey(image)
    except Unreadable:
        raise
    except Exception as error:  # anything that a hostile picture makes the decoder raise
        raise Unreadable(problem=message("the map's picture is broken")) from error
    del image
    box, whole_height = (
        grey.point([255 if v < WALL_BELOW or v > FLOOR_ABOVE else 0 for v in range(256)]).getbbox(),
        grey.height,
    )
    if box is None:
        raise Unreadable(problem=message("the map's picture is empty"))
    spare = math.ceil(MARGIN / resolution)
    left, top = max(0, box[0] - spare), max(0, box[1] - spare)
    right, bottom = min(grey.width, box[2] + spare), min(grey.height, box[3] + spare)
    grey = grey.crop((left, top, right, bottom))
    step = max(1.0, max(grey.size) / LONGEST_SIDE)
    size = max(1, round(grey.width / step)), max(1, round(grey.height / step))
    walls = grey.point([255 if v < WALL_BELOW else 0 for v in range(256)]).resize(size, Image.Resampling.BOX)
    unseen = grey.point([UNSEEN if WALL_BELOW <= v <= FLOOR_ABOVE else 0 for v in range(256)]).resize(
        size, Image.Resampling.BOX
    )
    walls = walls.point([min(255, round(v * step)) for v in range(256)])  # a wall of one pixel stays one
    shade = ImageChops.lighter(walls, unseen).transpose(Image.Transpose.FLIP_TOP_BOTTOM).tobytes()
    return left, whole_height - bottom, right - left, bottom - top, size, shade


def _grey(image: Any) -> Any:
    """In greys; what is transparent was never seen."""
    from PIL import Image

    if image.mode in ("LA", "PA", "RGBA") or "transparency" in image.info:
        image = image.convert("RGBA")
        grey = Image.new("L", image.size, UNSEEN_GREY)
        grey.paste(image.convert("L"), mask=image.getchannel("A"))
        return grey
    image.load()
    return image if image.mode == "L" else image.convert("L")


# ---------------------------------------------------------------------- as a file
def to_bytes(picture: MapPicture) -> bytes:
    """For ``from_bytes``."""
    return json.dumps(
        {
            "format": _FORMAT,
            "name": picture.name,
            "size": picture.size,
            "extent": picture.extent,
            "origin": [picture.origin.x, picture.origin.y, picture.origin.orientation],
            "places": [[place.name, place.x, place.y] for place in picture.places],
            "shade": base64.b64encode(zlib.compress(picture.shade)).decode(),
        }
    ).encode()


def from_bytes(data: bytes) -> MapPicture:
    """Raises ValueError when these are not (any more) the bytes of ``to_bytes``."""
    try:
        found = json.loads(data)
        if found["format"] != _FORMAT:
            raise ValueError("another format")
        width, height = (int(side) for side in found["size"])
        if not (0 < width <= LONGEST_SIDE and 0 < height <= LONGEST_SIDE):
            raise ValueError("an impossible size")
        shade = zlib.decompressobj().decompress(base64.b64decode(found["shade"]), width * height)
        extent = _numbers(found["extent"], 2)
        if len(shade) != width * height or min(extent) <= 0:
            raise ValueError("an incomplete picture")
        places = tuple(
            Place(str(name)[:LONGEST_NAME], *_numbers((x, y), 2)) for name, x, y in found["places"][:MOST_PLACES]
        )
        return MapPicture(
            str(found["name"])[:LONGEST_NAME],
            shade,
            (width, height),
            Pose(*_numbers(found["origin"], 3)),
            (extent[0], extent[1]),
            places,
        )
    except (KeyError, TypeError, AttributeError, IndexError, RecursionError, zlib.error) as error:
        raise ValueError("no kept map") from error


def _numbers(values: Sequence[Any], count: int) -> list[float]:
    found = [float(value) for value in values]
    if len(found) != count or not all(map(math.isfinite, found)):
        raise ValueError("no finite numbers")
    return found
