"""Rounded shapes with smooth corners on every GL driver: nine-patch textures that are calculated here.

Kivy's RoundedRectangle is jagged without multisampling, which GL drivers of kiosks often lack.
"""
from functools import lru_cache
from math import hypot

from kivy.graphics import BorderImage, Rectangle
from kivy.graphics.texture import Texture


def alpha_texture(width: int, height: int, coverage) -> Texture:
    """White texture whose alpha at pixel i, j is ``coverage(i + .5, j + .5)`` in 0..1."""
    data = bytearray(b"\xff\xff\xff\x00" * (width * height))
    for j in range(height):
        for i in range(width):
            data[(j * width + i) * 4 + 3] = int(255 * min(1., max(0., coverage(i + .5, j + .5))) + .5)
    texture = Texture.create(size=(width, height), colorfmt="rgba")
    texture.blit_buffer(bytes(data), colorfmt="rgba", bufferfmt="ubyte")
    return texture


@lru_cache(maxsize=256)
def patch(radius: tuple[int, int, int, int], ring: int = 0) -> tuple[Texture, int]:
    """Texture of a rounded rectangle, or of its border ``ring`` px wide, and the width in px of the edge that must not be stretched.

    ``radius`` are the corner radii in px: top-left, top-right, bottom-right, bottom-left.
    """
    edge = max(*radius, ring) + 1
    side = 2 * edge + 2
    middle = side / 2

    def cover(x: float, y: float, inset: int) -> float:
        top, left = y > middle, x < middle
        corner = radius[0] if top and left else radius[1] if top else radius[3] if left else radius[2]
        r = max(0, corner - inset)
        dx = inset + r - x if left else x - (side - inset - r)
        dy = y - (side - inset - r) if top else inset + r - y
        if r and dx > 0 and dy > 0:
            return min(1., max(0., r - hypot(dx, dy) + .5))
        return float(inset <= x <= side - inset and inset <= y <= side - inset)

    texture = alpha_texture(side, side, lambda x, y: cover(x, y, 0) - (cover(x, y, ring) if ring else 0))
    texture.wrap = "clamp_to_edge"
    return texture, edge


@lru_cache(maxsize=8)
def hatch_texture(period: int, width: float) -> Texture:
    """Diagonal lines ``width`` px thick, repeating every ``period`` px."""
    def cover(x: float, y: float) -> float:
        across = (x - y) % period
        return width / 2 + .5 - min(across, period - across) * .7071

    texture = alpha_texture(period, period, cover)
    texture.wrap = "repeat"
    return texture


def rounded(x: float, y: float, w: float, h: float, radius=0, ring: float = 0) -> Rectangle | BorderImage:
    """Add one smooth rounded rectangle to the open canvas, on whole pixels; returns the instruction.

    ``radius``: one number or four (see ``patch``), cut to half the shorter side. ``ring`` > 0 draws only a border that wide.
    """
    x0, y0 = round(x), round(y)
    w, h = max(1, round(x + w) - x0), max(1, round(y + h) - y0)
    limit = min(w, h) // 2
    corners = tuple(min(int(r), limit) for r in (radius if isinstance(radius, tuple | list) else (radius,) * 4))
    if not ring and max(corners) == 0:
        return Rectangle(pos=(x0, y0), size=(w, h))
    texture, edge = patch(corners, int(ring))
    edge = min(edge, w // 2, h // 2) or 1
    return BorderImage(pos=(x0, y0), size=(w, h), texture=texture, border=(edge,) * 4)
