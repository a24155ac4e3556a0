"""Rounded shapes with smooth corners on every GL driver: nine-patch textures that are calculated here.

Kivy's RoundedRectangle is jagged without multisampling, which GL drivers of kiosks often lack.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import hypot

from kivy.graphics import BorderImage, Mesh, Rectangle
from kivy.graphics.texture import Texture

Colour = tuple[float, float, float, float]  # red, green, blue, alpha in 0..1
Box = tuple[float, float, float, float]  # left, bottom, width, height in px

PIECES = 4_000  # boxes of one mesh, whose indices have 16 bits
GRIDS = {  # two triangles for each cell of n × n points
    n: [row * n + column + k for row in range(n - 1) for column in range(n - 1) for k in (0, 1, n + 1, 0, n + 1, n)]
    for n in (2, 4)
}


def texture_of(width: int, height: int, data: bytes) -> Texture:
    """``data`` has red, green, blue and alpha of each pixel, a byte each."""

    def fill(texture) -> None:
        texture.blit_buffer(data, colorfmt="rgba", bufferfmt="ubyte")

    texture = Texture.create(size=(width, height), colorfmt="rgba")
    fill(texture)
    texture.add_reload_observer(fill)  # a tablet may lose its graphics while it sleeps
    return texture


def pixel(colour) -> bytes:
    return bytes(int(255 * min(1.0, max(0.0, part)) + 0.5) for part in colour)


def alpha_texture(width: int, height: int, coverage) -> Texture:
    """White texture whose alpha at pixel i, j is ``coverage(i + .5, j + .5)`` in 0..1."""
    return texture_of(
        width,
        height,
        b"".join(pixel((1, 1, 1, coverage(i + 0.5, j + 0.5))) for j in range(height) for i in range(width)),
    )


def over(top: Colour, below: Colour) -> Colour:
    """The visible part of both; empty areas have the colour of ``below``."""
    alpha = top[3] + below[3] * (1 - top[3])
    share = top[3] / alpha if alpha else 0
    red, green, blue = (share * upper + (1 - share) * lower for upper, lower in zip(top[:3], below[:3], strict=True))
    return red, green, blue, alpha


class Corners:
    """A rounded rectangle that is just large enough for its corners: ``radius`` in px top-left, top-right, bottom-right, bottom-left, and a
    border ``ring`` px wide. ``edge`` is the width in px of what must not be stretched."""

    def __init__(self, radius: tuple[int, int, int, int], ring: int) -> None:
        self._radius = radius
        self.edge = max(*radius, ring) + 1
        self._side = 2 * self.edge + 2
        places = [n + 0.5 for n in range(self._side)]
        self._covers = [
            (whole := self._cover(x, y, 0), whole - (self._cover(x, y, ring) if ring else 0))
            for y in places
            for x in places
        ]

    def _cover(self, x: float, y: float, inset: int) -> float:
        """How much of the pixel around x, y lies within the rectangle ``inset`` px smaller on each side."""
        side, middle, radius = self._side, self._side / 2, self._radius
        top, left = y > middle, x < middle
        corner = radius[0] if top and left else radius[1] if top else radius[3] if left else radius[2]
        r = max(0, corner - inset)
        dx = inset + r - x if left else x - (side - inset - r)
        dy = y - (side - inset - r) if top else inset + r - y
        if r and dx > 0 and dy > 0:
            return min(1.0, max(0.0, r - hypot(dx, dy) + 0.5))
        return float(inset <= x <= side - inset and inset <= y <= side - inset)

    def texture(self, colour) -> Texture:
        """``colour(whole, border)`` is the colour of a pixel that the rectangle and its border cover that much. Few
        pixels differ: computing every one would take 5 to 30 ms, in the middle of a frame."""
        pixels = {cover: pixel(colour(*cover)) for cover in set(self._covers)}
        texture = texture_of(self._side, self._side, b"".join(map(pixels.__getitem__, self._covers)))
        texture.wrap = "clamp_to_edge"
        return texture


corners_of = lru_cache(maxsize=64)(Corners)


@lru_cache(maxsize=256)
def patch(radius: tuple[int, int, int, int], ring: int = 0) -> tuple[Texture, int]:
    """White texture of a rounded rectangle, or of its border alone, and its ``Corners.edge``."""
    corners = corners_of(radius, ring)
    return corners.texture(lambda whole, border: (1, 1, 1, border if ring else whole)), corners.edge


@lru_cache(maxsize=256)
def bordered_patch(radius: tuple[int, int, int, int], ring: int, fill: Colour, line: Colour) -> tuple[Texture, int]:
    """Texture of a rounded rectangle in ``fill`` with a border in ``line``, and its ``Corners.edge``."""
    corners = corners_of(radius, ring)
    return corners.texture(
        lambda whole, border: over((*line[:3], line[3] * border), (*fill[:3], fill[3] * whole))
    ), corners.edge


@lru_cache(maxsize=8)
def corner_masks(radius: int, ring: int, outside: Colour, line: Colour) -> tuple[Texture, Texture]:
    """Textures ``radius + 1`` px high that lie over the upper and the lower corners of a rounded rectangle: ``outside`` covers what sticks
    out, and ``line`` is the colour of the border."""
    corners = corners_of((radius,) * 4, ring)
    whole = corners.texture(lambda whole, border: over((*line[:3], line[3] * border), (*outside[:3], 1 - whole)))
    side, edge = whole.width, corners.edge
    return whole.get_region(0, side - edge, side, edge), whole.get_region(0, 0, side, edge)


@lru_cache(maxsize=8)
def pointer(side: int, ring: int, fill: Colour, line: Colour) -> Texture:
    """The tip of a card, ``side`` px high and twice as wide, that points upwards: in ``fill``, with slopes ``ring`` px wide in ``line``."""

    def colour(x: float, y: float) -> Colour:
        inwards = (side - y - abs(side - x)) * 0.7071
        whole, inside = (min(1.0, max(0.0, part + 0.5)) for part in (inwards, inwards - ring))
        return over((*line[:3], line[3] * (whole - inside)), (*fill[:3], fill[3] * whole))

    places = ((x + 0.5, y + 0.5) for y in range(side) for x in range(2 * side))
    return texture_of(2 * side, side, b"".join(pixel(colour(*place)) for place in places))


@lru_cache(maxsize=8)
def hatch_texture(period: int, width: float) -> Texture:
    """Diagonal lines ``width`` px thick, repeating every ``period`` px."""

    def cover(x: float, y: float) -> float:
        across = (x - y) % period
        return width / 2 + 0.5 - min(across, period - across) * 0.7071

    texture = alpha_texture(period, period, cover)
    texture.wrap = "repeat"
    return texture


def rounded(x: float, y: float, w: float, h: float, radius=0, ring: float = 0) -> Rectangle | BorderImage:
    """Add one smooth rounded rectangle to the open canvas, on whole pixels; returns the instruction.

    ``radius``: one number or four (see ``Corners``), cut to half the shorter side. ``ring`` > 0 draws only a border that wide.
    """
    x, y, w, h, corners = _on_pixels(x, y, w, h, radius)
    if not ring and max(corners) == 0:
        return Rectangle(pos=(x, y), size=(w, h))
    return _stretched(x, y, w, h, *patch(corners, int(ring)))


def boxes_of(boxes: Sequence[Box], texture: Texture | None = None, edge: int = 0) -> None:
    """Many boxes as few drawings: plain ones, or with the texture of a ``patch``."""
    share = edge / texture.width if texture else 0.0
    for n in range(0, len(boxes), PIECES):
        vertices: list[float] = []
        indices: list[int] = []
        for x, y, w, h in boxes[n : n + PIECES]:
            across, up = _cuts(round(x), round(x + w), edge, share), _cuts(round(y), round(y + h), edge, share)
            first = len(vertices) // 4
            vertices += [value for y, v in up for x, u in across for value in (x, y, u, v)]
            indices += [first + k for k in GRIDS[len(across)]]
        Mesh(vertices=vertices, indices=indices, mode="triangles", texture=texture)


@lru_cache(maxsize=256)
def _cuts(start: int, end: int, edge: int, share: float) -> tuple[tuple[float, float], ...]:
    """Where a box, at least a px wide, is cut between its corners, and which part of the texture is there."""
    end = max(end, start + 1)
    corner = min(edge, (end - start) / 2)
    inner = ((start + corner, share), (end - corner, 1 - share)) if share else ()
    return (start, 0.0), *inner, (end, 1.0)


def bordered(x: float, y: float, w: float, h: float, radius, ring: float, fill, line) -> BorderImage:
    """``rounded`` in the colour ``fill`` with its border in ``line``, in one draw, under a white Color: where the GPU is software a tile is
    filled once and not twice."""
    x, y, w, h, corners = _on_pixels(x, y, w, h, radius)
    return _stretched(x, y, w, h, *bordered_patch(corners, int(ring), tuple(fill), tuple(line)))


def _on_pixels(x: float, y: float, w: float, h: float, radius) -> tuple[int, int, int, int, tuple[int, ...]]:
    x0, y0 = round(x), round(y)
    w, h = max(1, round(x + w) - x0), max(1, round(y + h) - y0)
    limit = min(w, h) // 2
    return (
        x0,
        y0,
        w,
        h,
        tuple(min(int(r), limit) for r in (radius if isinstance(radius, tuple | list) else (radius,) * 4)),
    )


def _stretched(x: int, y: int, w: int, h: int, texture: Texture, edge: int) -> BorderImage:
    edge = min(edge, w // 2, h // 2) or 1
    return BorderImage(pos=(x, y), size=(w, h), texture=texture, border=(edge,) * 4)
