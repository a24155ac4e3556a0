"""A robot's map as a tablet shows it: cut, reduced, placed, kept; and pictures that are none."""

from __future__ import annotations

import io
import json
import math
import struct
import zlib
from collections.abc import Callable

import pytest
from PIL import Image, ImageDraw

from app.domain.robot import MapPosition, Pose, RobotMap
from app.mir.errors import Unreadable
from app.services.robots.map_picture import (
    LARGEST_DECODED,
    LONGEST_SIDE,
    UNSEEN,
    MapPicture,
    Place,
    from_bytes,
    picture_of,
    to_bytes,
)

ORIGIN = Pose(-10.0, -20.0, 0.0)


def hall(
    mode: str = "L", size: tuple[int, int] = (400, 300), room: tuple[int, int, int, int] = (100, 60, 300, 180)
) -> Image.Image:
    """Unknown ground, and in it a room with walls of one pixel; ``room`` in px from the upper left corner."""
    image = Image.new("L", size, 205)
    ImageDraw.Draw(image).rectangle(room, fill=254, outline=0)
    return image.convert(mode)


def png(image: Image.Image) -> bytes:
    out = io.BytesIO()
    image.save(out, "PNG")
    return out.getvalue()


def floor(image: Image.Image, origin: Pose = ORIGIN, resolution: float = 0.05) -> RobotMap:
    return RobotMap("m", "Hall", png(image), resolution, origin)


def header(width: int, height: int, depth: int = 8, colour: int = 0) -> bytes:
    chunk = b"IHDR" + struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + chunk + struct.pack(">I", zlib.crc32(chunk))


def test_it_is_cut_to_what_the_robot_knows_and_a_margin() -> None:
    picture = picture_of(floor(hall()))
    assert picture.size == (241, 161)  # 201 × 121 px of room, 20 px = 1 m on each side
    assert picture.extent == pytest.approx((241 * 0.05, 161 * 0.05))
    assert (picture.origin.x, picture.origin.y) == pytest.approx((-10 + 80 * 0.05, -20 + 99 * 0.05))
    assert picture.aspect == pytest.approx(161 / 241)


@pytest.mark.parametrize("turn", [0.0, 90.0, -30.0])
def test_points_in_metres_fall_where_they_are_in_the_picture(turn: float) -> None:
    picture = picture_of(floor(hall(), Pose(-10.0, -20.0, turn)))
    corner = picture.origin
    for along, up in ((3.0, 2.0), (12.0, 8.0), (6.0, 4.0)):
        angle = math.radians(turn)
        x = corner.x + along * math.cos(angle) - up * math.sin(angle)
        y = corner.y + along * math.sin(angle) + up * math.cos(angle)
        assert picture.fraction(x, y) == pytest.approx((along / picture.extent[0], up / picture.extent[1]))
    assert picture.heading(turn + 45.0) == pytest.approx(45.0)


def test_outside_of_the_picture_there_is_no_place() -> None:
    picture = picture_of(floor(hall()))
    assert picture.fraction(-100.0, 0.0) is None
    assert picture.fraction(1e308, -1e308) is None
    assert picture.fraction(float("nan"), 0.0) is None


def test_rows_go_from_the_bottom_up_and_distinguish_walls_floor_and_the_unknown() -> None:
    image = hall()
    ImageDraw.Draw(image).rectangle((110, 170, 130, 175), fill=0)  # a rack near the lower wall
    picture = picture_of(floor(image))
    columns, _rows = picture.size

    def shade(x: int, y: int) -> int:
        return picture.shade[y * columns + x]

    assert shade(120, 80) == 0
    assert shade(2, 2) == UNSEEN
    assert shade(40, 27) == 255  # the rack: 30…50 px from the left, 25…30 px from below
    assert shade(40, 130) == 0


def test_a_large_map_is_reduced_and_thin_walls_survive() -> None:
    picture = picture_of(floor(hall(size=(6000, 3000), room=(500, 500, 5500, 2500))))
    assert max(picture.size) == LONGEST_SIDE
    columns, rows = picture.size
    middle = picture.shade[(rows // 2) * columns : (rows // 2 + 1) * columns]
    assert max(middle[: columns // 2]) > 200  # the left wall, 1 px of 6000
    assert max(middle[columns // 2 :]) > 200


@pytest.mark.parametrize("mode", ["L", "RGB", "P", "RGBA", "LA"])
def test_every_kind_of_png_looks_the_same(mode: str) -> None:
    assert picture_of(floor(hall(mode))).shade == picture_of(floor(hall())).shade


def test_transparent_areas_were_never_seen() -> None:
    image = Image.new("RGBA", (100, 80), (0, 0, 0, 0))
    ImageDraw.Draw(image).rectangle((30, 30, 70, 50), fill=(255, 255, 255, 255), outline=(0, 0, 0, 255))
    assert picture_of(floor(image)).shade[0] == UNSEEN


def test_places_without_name_or_pose_or_outside_the_map_are_omitted() -> None:
    pose = Pose(-2.0, -12.0, 0.0)
    positions = [
        MapPosition("1", "Line 2", 0, "m", pose),
        MapPosition("2", "", 0, "m", pose),
        MapPosition("3", "Dock", 11, "m", None),
        MapPosition("4", "Moon", 0, "m", Pose(500.0, 0.0, 0.0)),
        MapPosition("5", "Charger entry", 21, "m", pose),
    ]
    picture = picture_of(floor(hall()), positions)
    assert [place.name for place in picture.places] == ["Line 2"]
    assert picture.fraction(pose.x, pose.y) == (picture.places[0].x, picture.places[0].y)


@pytest.mark.parametrize(
    "broken",
    [
        lambda good: good[:200],
        lambda good: good[:16],
        lambda good: good[:40] + bytes(200) + good[240:],
        lambda good: header(400, 300),
        lambda _good: b"\x89PNG\r\n\x1a\n" + bytes(40),
        lambda _good: b"",
    ],
)
def test_a_broken_picture_is_unreadable(broken: Callable[[bytes], bytes]) -> None:
    with pytest.raises(Unreadable):
        picture_of(RobotMap("m", "Hall", broken(png(hall()))))


def test_a_picture_that_claims_to_be_huge_is_not_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("PIL.PngImagePlugin.PngImageFile.load", lambda *_args: pytest.fail("it was decoded"))
    for width, height, depth, colour, problem in (
        (8_000, 8_000, 8, 0, "too large"),
        (LARGEST_DECODED // 4 + 1, 1, 16, 6, "too large"),
        (2**31 - 1, 2**31 - 1, 8, 2, "broken"),
    ):
        with pytest.raises(Unreadable, match=problem):
            picture_of(RobotMap("m", "Hall", header(width, height, depth, colour) + b"\0\0\0\1IDAT"))


def test_a_picture_of_nothing_and_an_impossible_scale_are_unreadable() -> None:
    with pytest.raises(Unreadable, match="empty"):
        picture_of(floor(Image.new("L", (50, 50), 205)))
    with pytest.raises(Unreadable, match="resolution"):
        picture_of(floor(hall(), resolution=1e-300))


# ---------------------------------------------------------------------- as a file
def test_a_stored_map_is_read_back_unchanged() -> None:
    picture = picture_of(floor(hall()), [MapPosition("1", "Linja 2 ä", 0, "m", Pose(-2.0, -12.0, 0.0))])
    again = from_bytes(to_bytes(picture))
    assert (again.name, again.shade, again.size, again.origin, again.extent, again.places) == (
        picture.name,
        picture.shade,
        picture.size,
        picture.origin,
        picture.extent,
        picture.places,
    )


@pytest.mark.parametrize(
    "change",
    [
        {"format": 2},
        {"size": [0, 5]},
        {"size": [10**6, 10**6]},
        {"size": "xy"},
        {"extent": [1.0]},
        {"extent": [0, 1]},
        {"extent": ["nan", 1]},
        {"origin": None},
        {"places": [["a", 1]]},
        {"places": 5},
        {"shade": "AAAA"},
        {"shade": 5},
        {"name": None, "shade": ""},
    ],
)
def test_a_file_that_is_none_of_ours_is_refused(change: dict[str, object]) -> None:
    picture = MapPicture("Hall", bytes(6), (3, 2), Pose(0, 0, 0), (3.0, 2.0), (Place("a", 0.5, 0.5),))
    data = json.loads(to_bytes(picture))
    with pytest.raises(ValueError, match=r".+"):
        from_bytes(json.dumps({**data, **change}).encode())


@pytest.mark.parametrize("data", [b"", b"[]", b"\xff\xfe", b"{}", b"null", b"[" * 100_000])
def test_a_stored_map_that_is_no_json_object_is_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match=r".+"):
        from_bytes(data)
