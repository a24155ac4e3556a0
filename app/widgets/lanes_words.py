"""The names of the bars of a lane: in the visible part of a bar, or next to it, never over another one."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence

from kivy.metrics import dp, sp

from app.widgets.chart import box, text, width_of
from app.widgets.lanes_bars import Placed, paint_icon
from app.widgets.lanes_frame import TWO_LINES_FROM, Frame, Span, cut
from app.widgets.tokens import tk

LETTERS = 6  # fewer of a name that is cut don't name anything
LINE = 19  # sp between two lines
SIZE = 16  # sp
IN, BESIDE = "RobotoMedium", "Roboto"  # fonts


def paint_words(frame: Frame, bars: Sequence[Placed], seen: Span, now: float) -> None:
    """``bars`` as they come from ``placed``; ``seen``: left and right end of the visible part; a name of the past ends at the line of
    ``now`` (px)."""
    most = 2 if frame.lane_height >= dp(TWO_LINES_FROM) else 1
    strong = [frame.at(hour) for hour, _label, is_strong in frame.ticks if is_strong]
    for one, covered_at, ends in _rooms(frame, bars):
        if one.right <= seen[0] or one.x >= seen[1]:
            continue
        left, right = max(one.x, seen[0]), min(covered_at, seen[1])
        begins = one.right + dp(6)
        if one.icon_width and one.right - one.x < one.icon_width + dp(4):
            if min(ends, seen[1]) - begins < one.icon_width:
                continue
            paint_icon(one, begins + one.icon_width / 2)
            begins += one.icon_width + dp(6)
        if now > one.right:
            ends = min(ends, now)
        hidden = one.icon_width if one.right - one.x >= one.icon_width + dp(4) else 0
        inside = 0 if hidden else right - left - dp(16)
        _paint_name(frame, one, left + dp(8), inside, begins, min(ends, seen[1]) - begins - dp(4), most, strong)


def _rooms(frame: Frame, bars: Sequence[Placed]) -> Iterator[tuple[Placed, float, float]]:
    """Each with a name or an icon, where what is seen of it ends, and where the room to its right does: at the next one, or at closed
    time."""
    edges = sorted(frame.at(start) for start, *_ in frame.bands)
    starts = [one.x for one in bars]
    for n, one in enumerate(bars):
        if one.bar.label or one.icon_width:
            first = bisect_left(starts, one.x, n + 1)
            follows = next((m.x for m in bars[first:] if one.row < 0 or m.row in (one.row, -1)), math.inf)
            at = bisect_left(edges, one.x)
            yield one, min(one.right, follows), min([follows, *edges[at : at + 1]])


def _paint_name(
    frame: Frame,
    one: Placed,
    left: float,
    inside: float,
    begins: float,
    beside: float,
    most: int,
    lines_at: list[float],
) -> None:
    """Whole in it, whole next to it, or as much as there is room for at the wider place."""
    y = one.bottom + one.height / 2
    if one.row >= 0:  # another name is above or below it
        most = min(most, max(1, int(frame.lane_height / 2 / sp(LINE + 1))))
    lines_in = min(2, int(one.height / sp(LINE + 1)))
    for words in filter(None, (one.bar.label, *one.bar.shorter)):
        for room, font, lines, x in ((inside, IN, lines_in, left), (beside, BESIDE, most, begins)):
            if room > 0 and (found := wrapped(words, room, lines, font)) and not found[-1].endswith("…"):
                return _paint_lines(frame, found, x, y, font, one, lines_at)
    if "" in one.bar.shorter:
        return None
    for room, font, lines, x in ((beside, BESIDE, most, begins), (inside, IN, lines_in, left)):
        if room > 0 and (room >= inside or font is IN):
            found = wrapped(one.bar.label, room, lines, font)
            if sum(map(str.isalpha, "".join(found))) >= LETTERS:
                return _paint_lines(frame, found, x, y, font, one, lines_at)
    return None


def _paint_lines(
    frame: Frame, lines: Sequence[str], x: float, y: float, font: str, one: Placed, lines_at: Iterable[float]
) -> None:
    ink = frame.colours[one.bar.state].ink if font is IN else tk.ink2
    for n, words in enumerate(lines):
        middle = y + sp(LINE) * ((len(lines) - 1) / 2 - n)
        width = width_of(words, SIZE, font)
        if font is BESIDE and any(x < line < x + width for line in lines_at):  # midnight must not go through it
            box(x - dp(3), middle - sp(10), width + dp(6), sp(20), tk.surface)
        text(words, x, middle, ink, SIZE, font=font)


def wrapped(words: str, room: float, most: int, font: str) -> list[str]:
    """In at most so many lines, the last of them cut if need be; empty if there is no room for anything."""
    lines: list[str] = []
    left = words.split(" ")
    while left and len(lines) < most:
        n = next((n for n in range(len(left), 0, -1) if width_of(" ".join(left[:n]), SIZE, font) <= room), 0)
        if not n or (len(lines) == most - 1 and n < len(left)):
            return [*lines, last] if (last := cut(" ".join(left), room, SIZE, font)) else []
        lines.append(" ".join(left[:n]))
        left = left[n:]
    return lines
