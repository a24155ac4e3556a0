"""The names of the bars of a timeline's lane: in the visible part of a bar, or next to it."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from kivy.metrics import dp, sp

from app.widgets.chart import box, text, width_of
from app.widgets.timeline_bars import Placed
from app.widgets.timeline_painting import Frame, Span
from app.widgets.tokens import tk

LEGIBLE = 20  # dp of the height of a bar, for each line of words in it
LEAST = 24  # dp of room, less is too little for a name


class Cluster(NamedTuple):
    """Overlapping bars in drawing order, and the room for their names next to them."""

    bars: Sequence[Placed]
    begins: float
    ends: float


def clusters(frame: Frame, bars: Sequence[Placed]) -> list[Cluster]:
    """Bars with room for a name in them or next to them. ``bars`` as they come from ``placed``."""
    groups: list[list[int]] = []
    reach = -math.inf
    for n in sorted(range(len(bars)), key=lambda n: bars[n].x):
        if bars[n].x < reach - 1:
            groups[-1].append(n)
        else:
            groups.append([n])
        reach = max(reach, bars[n].right)
    edges = sorted(frame.at(start) for start, *_ in frame.bands)
    found = []
    for place, group in enumerate(groups):
        members = [bars[n] for n in sorted(group)]
        n = bisect_left(edges, bars[group[0]].x)
        following = bars[groups[place + 1][0]].x if place + 1 < len(groups) else math.inf
        begins, ends = max(max(one.right, one.late) for one in members), min([following, *edges[n : n + 1]])
        if ends - begins > dp(LEAST) or any(one.x2 - one.x > dp(LEAST) for one in members):
            found.append(Cluster(members, begins, ends))
    return found


def paint_words(frame: Frame, groups: Iterable[Cluster], y: float, seen: Span) -> None:
    """Whole names only: in the visible part of the bar, or next to it if nothing follows too soon (also for several
    overlapping bars); otherwise their number, if any. ``seen``: left and right end of the visible part."""
    lines = [frame.at(hour) for hour, _label, strong in frame.ticks if strong] + [
        frame.at(end) for _start, end, *_ in frame.bands
    ]
    for group in groups:
        unnamed = [
            one
            for n, one in enumerate(group.bars)
            if not _named_inside(frame, one, group.bars[n + 1 :], y, seen) and one.bar.label
        ]
        last = max(one.bar.end for one in group.bars)
        if not any(one.framed or one.bar.end >= last for one in unnamed):
            continue  # it would seem to be the name of another one
        for words in _possible_names(unnamed):
            left, right = group.begins, group.begins + width_of(words) + dp(16)
            if right <= group.ends and not any(left < edge < right for edge in seen):
                if any(left < line < right for line in lines):  # it must not go through them
                    box(left + dp(3), y - sp(10), right - left - dp(10), sp(20), tk.surface)
                text(words, left + dp(6), y, tk.ink2)
                break


def _possible_names(bars: Sequence[Placed]) -> Iterator[str]:
    """The possible names next to them, the best first."""
    if bars:
        yield " · ".join(
            name if n == 1 else f"{n} × {name}" for name, n in Counter(one.bar.label for one in bars).items()
        )
        if all(one.bar.shorter for one in bars):
            yield " · ".join(one.bar.shorter[-1] for one in bars)
        if len(bars) > 1:
            yield f"{bars[-1].bar.label} +{len(bars) - 1}"


def _named_inside(frame: Frame, one: Placed, above: Sequence[Placed], y: float, seen: Span) -> bool:
    """Paint its name into its visible part, if there is room."""
    if one.framed or one.x2 - one.x <= dp(LEAST) or frame.bar_height - one.inset < dp(LEGIBLE):
        return False
    left, right = (
        (max(one.x, seen[0]), min(one.right, seen[1]))
        if one.x < seen[1] and one.right > seen[0]
        else (one.x, one.right)
    )
    left, right = _not_covered(left, right, above)
    hand = dp(14) if one.bar.state == "held" else 0
    room, ink = right - left - dp(16) - hand, frame.colours[one.look].ink
    for words in filter(None, (one.bar.label, *one.bar.shorter)):
        lines = [words] if width_of(words) <= room else _two_lines(words)
        if len(lines) * dp(LEGIBLE) <= frame.bar_height - one.inset and max(map(width_of, lines)) <= room:
            for n, line in enumerate(lines):
                text(line, left + dp(10) + hand, y - one.inset / 2 + sp(17) * ((len(lines) - 1) / 2 - n), ink)
            return True
    return False


def _two_lines(words: str) -> list[str]:
    """As narrow as they can be; one without a space."""
    parts = words.split(" ")
    halves = [[" ".join(parts[:n]), " ".join(parts[n:])] for n in range(1, len(parts))]
    return min(halves, key=lambda lines: max(map(width_of, lines)), default=[words])


def _not_covered(left: float, right: float, above: Iterable[Placed]) -> Span:
    """The widest part of a bar, visible from ``left`` to ``right``, that later bars do not cover, or within their
    frames."""
    parts: list[Span] = []
    for other in sorted(above, key=lambda one: one.x):
        if other.right > left and other.x < right:
            parts.append((left, other.x))
            if other.framed:
                parts.append((max(left, other.x), min(right, other.right)))
            left = other.right
    return max((*parts, (left, right)), key=lambda part: part[1] - part[0])
