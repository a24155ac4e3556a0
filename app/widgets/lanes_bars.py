"""The bars of a lane: where each is drawn, and how, on the open canvas."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from kivy.graphics import Color, Mesh
from kivy.metrics import dp
from kivymd.icon_definitions import md_icons

from app.widgets.chart import box, hatch, text, width_of
from app.widgets.lanes_frame import DID, Colours, Frame, Span, kept_in
from app.widgets.tokens import tk

NARROWEST = 12  # dp, where nothing follows too soon
RADIUS = 6  # dp
EDGE = 4  # dp: the amber lower edge of bars that overlap
MOMENT = 1 / 3600  # hours that bars may share without overlapping
PIECES = 10_000  # bars of one mesh, whose indices have 16 bits
DASH = 8  # dp, with a gap half as long
ICONS = {  # of the states that a fill alone doesn't say
    "failed": ("alert-circle", "fault"),
    "skipped": ("skip-next-circle-outline", "attention"),
    "held": ("hand-back-right", "attention"),
}
ICON = 20  # dp


class Placed(NamedTuple):
    """A bar and its place in px of the window; ``upper`` and ``lower`` are its halves of the lane's height, both of
    them unless it overlaps with another one."""

    bar: Any
    x: float
    right: float
    bottom: float
    height: float
    row: int  # of bars that overlap: 0 the upper, 1 the lower; -1: alone
    overlaps: bool  # while the robot is needed by two

    @property
    def icon_width(self) -> float:
        return dp(ICON) if self.bar.state in ICONS else 0


def placed(frame: Frame, lane: int, bars: Sequence[Any]) -> list[Placed]:
    """``bars`` by their beginning. Those that overlap are half as high, one above the other."""
    y, found = frame.middle(lane), []
    rows = _rows(bars)
    starts = [frame.at(bar.start) for bar in bars]
    for n, (bar, row) in enumerate(zip(bars, rows, strict=True)):
        x, x2 = starts[n], frame.at(bar.end) - 1
        if x2 - x < dp(NARROWEST):
            follows = next((starts[m] for m in range(n + 1, len(bars)) if rows[m] in (row, -1)), x + 2 * dp(NARROWEST))
            x2 = max(x2, x + dp(3), min(x + dp(NARROWEST), follows - dp(2)))
        half = frame.half_height
        height, bottom = (
            (frame.bar_height, y - frame.bar_height / 2)
            if row < 0
            else (half, y + dp(1) if row == 0 else y - dp(1) - half)
        )
        shared = row >= 0 and any(start < bar.end and bar.start < end for start, end in frame.lanes[lane].overlaps)
        found.append(Placed(bar, x, x2, bottom, height, row, shared))
    return found


def _rows(bars: Sequence[Any]) -> list[int]:
    """Of bars by their beginning: the row of each that shares time with another one, else -1."""
    rows, ends, owners = [-1] * len(bars), [-math.inf, -math.inf], [0, 0]
    for n, bar in enumerate(bars):
        busy = [end > bar.start + MOMENT for end in ends]
        row = 0 if not busy[0] else 1 if not busy[1] else ends.index(min(ends))
        if any(busy):
            rows[n] = row
            for other in (0, 1):
                if busy[other]:
                    rows[owners[other]] = other
        if bar.end > ends[row]:
            ends[row], owners[row] = bar.end, n
    return rows


# ---------------------------------------------------------------------- painting
def paint_bars(frame: Frame, bars: Iterable[Placed]) -> None:
    for one in bars:
        look = frame.colours[one.bar.state]
        paint_look(one.bar.state, look, one.x, one.bottom, one.right - one.x, one.height)
        if one.overlaps:
            box(one.x, one.bottom, one.right - one.x, dp(EDGE), tk.overlap, (0, 0, dp(RADIUS), dp(RADIUS)))
        if one.icon_width and one.right - one.x >= one.icon_width + dp(4):
            paint_icon(one, (one.x + one.right) / 2)


def paint_icon(one: Placed, x: float) -> None:
    """What its state means, in it or next to it."""
    icon, token = ICONS[one.bar.state]
    text(md_icons[icon], x, one.bottom + one.height / 2, getattr(tk, token), ICON, 0.5, 0.5, "Icons")


def paint_bars_together(frame: Frame, bars: Iterable[Placed]) -> None:
    """Too many to draw one by one: only where there are some, in few drawings, so that they can be dragged smoothly."""
    taken: dict[tuple[str, float, float, bool], list[Span]] = {}
    for one in bars:
        key = (one.bar.state, one.bottom, one.height, one.overlaps)
        join(taken.setdefault(key, []), one.x, max(one.right, one.x + 2))
    for (state, bottom, height, overlaps), spans in taken.items():
        look = frame.colours[state]
        _mesh(spans, bottom, height, look.edge)
        if look.fill != look.edge:
            _mesh([(x + 1, max(x2 - 1, x + 2)) for x, x2 in spans], bottom + 1, height - 2, look.fill)
        if state == "offline":
            for x, x2 in spans:
                hatch(x, bottom, x2 - x, height, look.edge)
        if overlaps:
            _mesh(spans, bottom, dp(EDGE), tk.overlap)


def paint_look(state: str, look: Colours, x: float, bottom: float, width: float, height: float) -> None:
    """A bar as wide as it may be."""
    radius = 0 if state in DID else dp(RADIUS)
    box(x, bottom, width, height, look.fill, radius)
    if state == "offline":
        hatch(x, bottom, width, height, look.edge)
    if state in ("draft", "was"):
        paint_dashes(x, bottom, width, height, look.edge)
    elif look.edge != look.fill:
        box(x, bottom, width, height, look.edge, radius, ring=2 if state in ("skipped", "held") else 1)


def paint_dashes(x: float, bottom: float, width: float, height: float, colour: Any) -> None:
    """A dashed border."""
    step, thick = dp(DASH) * 1.5, dp(2)
    for y in (bottom, bottom + height - thick):
        _mesh([*_dashes(x, x + width, step)], y, thick, colour)
    for left in (x, x + width - thick):
        for low, high in _dashes(bottom, bottom + height, step):
            box(left, low, thick, high - low, colour)


def _dashes(start: float, end: float, step: float) -> Iterator[Span]:
    at = start
    while at < end:
        yield at, min(end, at + step / 1.5)
        at += step


def paint_lifted(frame: Frame, bar: Any, place: Sequence[float], x: float, words: str) -> None:
    """A bar under a finger at x, dashed at its planned place, and above it its new start time."""
    left, bottom, right, top = place[:4]
    width, height, seen = right - left, top - bottom, (frame.left, frame.right)
    for state, at in (("was", left), ("draft", x)):
        if at + width > frame.left:
            begins = max(at, frame.left)
            paint_look(state, frame.colours[state], begins, bottom, at + width - begins, height)
    if width_of(bar.label, 16, "RobotoMedium") + dp(16) <= width:
        text(bar.label, x + dp(8), bottom + height / 2, tk.accent_on, 16, font="RobotoMedium")
    pill = width_of(words, 16, "RobotoMedium") + dp(24)
    left, y = kept_in(min(max(x + width / 2, seen[0]), seen[1]), pill, seen), bottom + height + dp(16)
    box(left, y - dp(15), pill, dp(30), tk.accent, dp(15))
    text(words, left + pill / 2, y, tk.accent_ink, 16, ax=0.5, font="RobotoMedium")


def join(spans: list[Span], x: float, x2: float) -> None:
    """Add a span to the earlier ones, merging it if they touch."""
    if spans and x <= spans[-1][1] + 1:
        if x2 > spans[-1][1]:
            spans[-1] = spans[-1][0], x2
    else:
        spans.append((x, x2))


def _mesh(spans: Sequence[Span], bottom: float, height: float, colour: Any) -> None:
    """Many boxes of one height as one drawing, in pieces that its indices can count."""
    Color(*colour)
    low, high = round(bottom), round(bottom + height)
    for n in range(0, len(spans), PIECES):
        vertices: list[float] = []
        indices: list[int] = []
        for at, (left, right) in enumerate(spans[n : n + PIECES]):
            at *= 4
            vertices += (left, low, 0, 0, right, low, 0, 0, right, high, 0, 0, left, high, 0, 0)
            indices += (at, at + 1, at + 2, at, at + 2, at + 3)
        Mesh(vertices=vertices, indices=indices, mode="triangles")
