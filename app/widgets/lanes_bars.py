"""The bars of a lane: where each is drawn, and how, on the open canvas."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import Any, NamedTuple

from kivy.graphics import Color
from kivy.metrics import dp
from kivymd.icon_definitions import md_icons

from app.widgets.chart import box, hatch, text, width_of
from app.widgets.lanes_frame import DID, Colours, Frame, kept_in
from app.widgets.shapes import Box, bordered_patch, boxes_of, patch
from app.widgets.tokens import tk

NARROWEST = 12  # dp, where nothing follows too soon
RADIUS = 6  # dp
EDGE = 4  # dp: the amber lower edge of bars that overlap
MOMENT = 1 / 3600  # hours that bars may share without overlapping
CROWD = 100  # bars: a lane with more is a crowd
APART = 4  # dp between two that are seen in it
DASH = 8  # dp, with a gap half as long
ICONS = {  # of the states that a fill alone doesn't say
    "failed": ("alert-circle", "fault"),
    "skipped": ("skip-next-circle-outline", "attention"),
    "held": ("hand-back-right", "attention"),
    "refused": ("alert-circle-outline", "attention"),
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


def placed(frame: Frame, lane: int) -> list[Placed]:
    """Its bars by their beginning. Those that overlap are half as high, one above the other."""
    bars = sorted(frame.lanes[lane].bars, key=lambda bar: bar.start)
    y, found, rows = frame.middle(lane), [], _rows(bars)
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
def paint_bars(frame: Frame, bars: Sequence[Placed]) -> None:
    """Those of one look together; of those that overlap the later one is above, but in a crowd."""
    is_crowd = len(bars) > CROWD
    in_order = sorted(bars, key=lambda one: one.bar.state if one.row < 0 or is_crowd else "")
    for state, alike in groupby(in_order, key=lambda one: one.bar.state):
        paint_look(state, frame.colours[state], _boxes(alike, is_crowd))
    Color(*tk.overlap)
    amber = _boxes((one for one in bars if one.overlaps), is_crowd)
    boxes_of(
        [(x + dp(2), bottom, width - dp(4), dp(EDGE)) for x, bottom, width, _height in amber]
    )  # within the corners
    for one in bars:
        if one.icon_width and one.right - one.x >= one.icon_width + dp(4):
            paint_icon(one, (one.x + one.right) / 2)


def _boxes(bars: Iterable[Placed], is_crowd: bool) -> list[Box]:
    """In a crowd those that are hardly apart are one, so that it can be dragged smoothly."""
    found: list[Box] = []
    for one in sorted(bars, key=lambda one: one.bottom) if is_crowd else bars:
        x, bottom, width, _height = found[-1] if found else (0.0, 0.0, 0.0, 0.0)
        if is_crowd and bottom == one.bottom and x <= one.x <= x + width + dp(APART):
            found[-1] = x, bottom, max(width, one.right - x), one.height
        else:
            found.append((one.x, one.bottom, one.right - one.x, one.height))
    return found


def paint_icon(one: Placed, x: float) -> None:
    """What its state means, in it or next to it."""
    icon, token = ICONS[one.bar.state]
    text(md_icons[icon], x, one.bottom + one.height / 2, getattr(tk, token), ICON, 0.5, 0.5, "Icons")


def paint_look(state: str, look: Colours, boxes: Sequence[Box]) -> None:
    """Bars of one state."""
    corners = (0 if state in DID else int(dp(RADIUS)),) * 4
    is_dashed, ring = state in ("draft", "was"), 2 if state in ("skipped", "held", "refused") else 1
    if look.edge == look.fill or is_dashed:
        Color(*look.fill)
        boxes_of(boxes, *(patch(corners) if any(corners) else ()))
    else:
        Color(1, 1, 1, 1)
        boxes_of(boxes, *bordered_patch(corners, ring, tuple(look.fill), tuple(look.edge)))
    if is_dashed:
        Color(*look.edge)
        boxes_of([dash for one in boxes for dash in _dashes(*one)])
    if state == "offline":
        for one in boxes:
            hatch(*one, look.edge)


def _dashes(x: float, y: float, width: float, height: float) -> Iterator[Box]:
    """Of a border."""
    dash, thick = dp(DASH), dp(2)
    for n in range(math.ceil(width / dash / 1.5)):
        at = n * dash * 1.5
        for edge in (y, y + height - thick):
            yield x + at, edge, min(dash, width - at), thick
    for n in range(math.ceil(height / dash / 1.5)):
        at = n * dash * 1.5
        for edge in (x, x + width - thick):
            yield edge, y + at, thick, min(dash, height - at)


def paint_lifted(frame: Frame, one: Placed, was: float, x: float, words: str) -> None:
    """A bar under a finger at x, dashed where it ``was`` planned, and above it its new start time."""
    width, height, seen = one.right - one.x, one.height, (frame.left, frame.right)
    for state, at in (("was", was), ("draft", x)):
        if at + width > frame.left:
            begins = max(at, frame.left)
            paint_look(state, frame.colours[state], [(begins, one.bottom, at + width - begins, height)])
    if width_of(one.bar.label, 16, "RobotoMedium") + dp(16) <= width:
        text(one.bar.label, x + dp(8), one.bottom + height / 2, tk.accent_on, 16, font="RobotoMedium")
    pill = width_of(words, 16, "RobotoMedium") + dp(24)
    left, y = kept_in(min(max(x + width / 2, seen[0]), seen[1]), pill, seen), one.bottom + height + dp(16)
    box(left, y - dp(15), pill, dp(30), tk.accent, dp(15))
    text(words, left + pill / 2, y, tk.accent_ink, 16, ax=0.5, font="RobotoMedium")
