"""The bars of a timeline's lane: where each is drawn, and how, on the open canvas."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import Any, NamedTuple

from kivy.graphics import Color, Mesh
from kivy.metrics import dp
from kivymd.icon_definitions import md_icons

from app.widgets.chart import box, hatch, text, width_of
from app.widgets.timeline_painting import Colours, Frame, Span, kept_in
from app.widgets.tokens import tk

NARROW = 12  # dp; such bars are drawn together
INSET = 5  # dp of a bar's upper edge that stay visible above an overlapping bar
AROUND = 2  # dp: the frame of a skipped start is so far around what is planned in its time
ABOUT_EDGE = 0.22  # of the height of a bar whose robot is a forecast, hatched above and below
OVERLAP = 6  # dp of the lower edge of bars that overlap
MOMENT = 1 / 3600  # hours that bars may share without overlapping
PIECES = 10_000  # bars of one mesh, whose indices have 16 bits


class Placed(NamedTuple):
    """A bar and its place in px of the window."""

    bar: Any
    look: str
    x: float
    x2: float
    right: float  # x2, or more of a bar that would be too narrow to be seen
    late: float  # where its whisker ends; x2 without one
    inset: float  # so much lower than others its upper edge is
    framed: bool  # only its frame is drawn, around others

    @property
    def is_narrow(self) -> bool:
        return self.x2 - self.x < dp(NARROW)


def look_of(bar: Any) -> str:
    return "assumed" if bar.assumed else bar.state


def placed(frame: Frame, bars: Sequence[Any]) -> list[Placed]:
    """``bars`` by their beginning, in drawing order: those not run come last, as a frame if others share their time."""
    skipped = [bar for bar in bars if bar.state == "skipped"]
    found = _placed(frame, [bar for bar in bars if bar.state != "skipped"] if skipped else bars)
    if skipped:
        taken: list[Span] = []
        for one in found:
            join(taken, one.x, one.right)
        starts = [span[0] for span in taken]
        for one in _placed(frame, skipped):
            n = bisect_left(starts, one.right)
            found.append(one._replace(framed=n > 0 and taken[n - 1][1] > one.x))
    return found


def _placed(frame: Frame, bars: Sequence[Any]) -> list[Placed]:
    at, found = frame.at, []
    for bar, inset in zip(bars, _insets(bars), strict=True):
        x, x2 = at(bar.start), at(bar.end)
        late = x2 if bar.late is None else at(bar.late)
        found.append(Placed(bar, look_of(bar), x, x2, x + max(dp(6), x2 - x - 1), late, inset, False))  # a gap after it
    return found


def _insets(bars: Sequence[Any]) -> Iterator[float]:
    """One that begins on others leaves the upper edges of two of them in sight."""
    ends: list[float] = []  # of those that the present one begins on
    for bar in bars:
        ends = [end for end in ends if end > bar.start + MOMENT]
        yield dp(INSET) * min(len(ends), 2)
        ends.append(bar.end)


# ---------------------------------------------------------------------- painting
def paint_bars(frame: Frame, bars: Iterable[Placed], y: float) -> None:
    """Each with its whisker, except narrow ones. ``bars`` as they come from ``placed``."""
    narrow: dict[tuple[bool, float, str], list[Span]] = {}
    framed: list[Placed] = []
    for one in bars:
        if one.is_narrow:
            narrow.setdefault((one.framed, one.inset, one.look), []).append((one.x, one.right))
        elif one.framed:
            framed.append(one)
        else:
            _paint_bar(frame, one, y)
    for (is_framed, inset, look), spans in sorted(narrow.items()):
        paint_narrow(look, frame.colours[look], spans, y - inset / 2, frame.bar_height - inset, is_framed)
    for one in framed:
        out, bottom = dp(AROUND), y - frame.bar_height / 2
        box(
            one.x - out,
            bottom - out,
            one.x2 - one.x + 2 * out - 1,
            frame.bar_height - one.inset + 2 * out,
            frame.colours[one.look].edge,
            dp(5),
            ring=dp(2),
        )


def paint_bars_together(frame: Frame, bars: Iterable[Placed], y: float) -> None:
    """Too many to draw one by one: only where there are some, in few drawings, so that they can be dragged smoothly."""
    taken: dict[tuple[str, bool], list[Span]] = {}
    for one in bars:
        join(taken.setdefault((one.look, one.framed), []), one.x, max(one.x2, one.x + 2))
    for (look, is_framed), spans in taken.items():
        paint_narrow(look, frame.colours[look], spans, y, frame.bar_height, is_framed)


def _paint_bar(frame: Frame, one: Placed, y: float) -> None:
    bar, look, x, x2, _right, late, inset, _framed = one
    width, height, colours = x2 - x - 1, frame.bar_height - inset, frame.colours[look]
    bottom = y - frame.bar_height / 2
    if late > x2 + dp(2):
        box(x2, y - dp(1), late - x2, dp(2), colours.edge)
        box(late - dp(2), y - dp(6), dp(2), dp(12), colours.edge)
    paint_look(look, colours, x, bottom, width, height)
    if bar.typed:  # a frame in the frame
        box(x + dp(3), bottom + dp(3), width - dp(6), height - dp(6), colours.edge, dp(2), ring=1)
    if bar.state == "planned":
        box(x, bottom, dp(4), height, tk.accent, (dp(4), 0, 0, dp(4)))


def paint_lifted(frame: Frame, bar: Any, place: Sequence[float], x: float, words: str) -> None:
    """A bar under a finger at x, faded at its planned place, and above it its new start time."""
    left, bottom, right, top = place[:4]
    width, height, seen = right - left, top - bottom, (frame.left, frame.right)
    box(max(left, seen[0]), bottom, right - max(left, seen[0]), height, tk.surface, alpha=0.8)
    box(x, bottom, width, height, tk.accent_bg, dp(4))
    box(x, bottom, width, height, tk.accent, dp(4), ring=dp(2))
    if width_of(bar.label) + dp(16) <= width:
        text(bar.label, x + dp(10), bottom + height / 2, tk.accent_on)
    pill = width_of(words, 16, "RobotoMedium") + dp(24)
    left, y = kept_in(min(max(x + width / 2, seen[0]), seen[1]), pill, seen), bottom + height + dp(16)
    box(left, y - dp(15), pill, dp(30), tk.accent, dp(15))
    text(words, left + pill / 2, y, tk.accent_ink, 16, ax=0.5, font="RobotoMedium")


def paint_look(look: str, colours: Colours, x: float, bottom: float, width: float, height: float) -> None:
    """A bar as wide as it may be, or its key in a legend."""
    box(x, bottom, width, height, colours.fill, dp(4))
    if look == "about":  # along both edges, so that words stay legible
        for edge in (bottom, bottom + height - ABOUT_EDGE * height):
            hatch(x, edge, width, ABOUT_EDGE * height, colours.edge, 6, 1.4)
    box(x, bottom, width, height, colours.edge, dp(4), ring=dp(2) if look in ("skipped", "held") else 1)
    middle, step = bottom + height / 2, dp(8)
    if look == "held":  # dashes
        _mesh(
            [(left, left + step / 2) for left in _steps(x + step / 2, x + width - step / 2, step)],
            middle,
            height,
            colours.fill,
        )
        _mesh([(x, x + width)], middle, step / 2, colours.fill)
        size = 14 if width >= dp(20) else 10
        text(
            md_icons["hand-back-right-outline"],
            x + min(width / 2, dp(14)),
            middle,
            colours.ink,
            size,
            0.5,
            0.5,
            "Icons",
        )
    elif look == "failed":
        _notches([(x, x + width)], bottom + height)


def paint_narrow(
    look: str, colours: Colours, spans: Sequence[Span], y: float, height: float, framed: bool = False
) -> None:
    """Many bars of one look that are too narrow for more: the same fill, border, dashes and notch; or their frames only, around others."""
    inset, out = dp(1.5), dp(AROUND)
    if framed:
        _mesh(
            [*chain(*(((x - out, x - out + inset), (x2 + out - inset, x2 + out)) for x, x2 in spans))],
            y,
            height + 2 * out,
            colours.edge,
        )
        for side in (1, -1):
            _mesh(
                [(x - out, x2 + out) for x, x2 in spans], y + side * (height / 2 + out - inset / 2), inset, colours.edge
            )
        return
    _mesh(spans, y, height, colours.edge)
    if colours.fill != colours.edge:
        _mesh([(x + inset, max(x2 - inset, x + inset + 1)) for x, x2 in spans], y, height - 2 * inset, colours.fill)
    if look == "held":
        for part in (-0.25, 0.25):
            _mesh(spans, y + height * part, dp(4), colours.fill)
    elif look == "about":  # broken in the middle, without room for hatching
        _mesh(spans, y, dp(6), tk.surface)
    elif look == "failed":
        _notches(spans, y + height / 2)


def _notches(spans: Sequence[Span], top: float) -> None:
    """A notch in the upper edge, in the middle of each, so that failed bars are recognised without their colour."""
    _mesh(
        [
            (middle - half, middle + half)
            for x, x2 in spans
            for middle, half in [((x + x2) / 2, min(dp(4), (x2 - x) / 4))]
        ],
        top - dp(3),
        dp(6),
        tk.surface,
    )


def _steps(start: float, end: float, step: float) -> Iterator[float]:
    return (start + step * n for n in range(max(0, int((end - start) / step))))


def paint_overlaps(frame: Frame, lane: int, most: int) -> None:
    """The shared time of two bars, hatched along their lower edge, so that they and their words stay legible; narrow
    ones as plain marks, as are all if there are more than ``most`` others."""
    height, bottom = dp(OVERLAP), frame.middle(lane) - frame.bar_height / 2
    spans = [
        (frame.at(start), frame.at(end)) for start, end in frame.lanes[lane].overlaps if frame.is_drawn(start, end)
    ]
    least = dp(NARROW) if sum(x2 - x >= dp(NARROW) for x, x2 in spans) <= most else math.inf
    marks: list[Span] = []
    for x, x2 in spans:
        if x2 - x < least:
            join(marks, x, max(x2, x + 2))
        else:
            box(x, bottom, x2 - x, height, tk.attention_bg)
            hatch(x, bottom, x2 - x, height, tk.overlap, 6, 2)
            box(x, bottom, x2 - x, height, tk.attention, ring=1)
    _mesh(marks, bottom + height / 2, height, tk.overlap)


def join(spans: list[Span], x: float, x2: float) -> None:
    """Add a span to the earlier ones, merging it if they touch."""
    if spans and x <= spans[-1][1] + 1:
        if x2 > spans[-1][1]:
            spans[-1] = spans[-1][0], x2
    else:
        spans.append((x, x2))


def _mesh(spans: Sequence[Span], y: float, height: float, colour: Any) -> None:
    """Many thin bars as one drawing, in pieces that its indices can count."""
    Color(*colour)
    bottom, top = round(y - height / 2), round(y + height / 2)
    for n in range(0, len(spans), PIECES):
        vertices: list[float] = []
        indices: list[int] = []
        for at, (left, right) in enumerate(spans[n : n + PIECES]):
            at *= 4
            vertices += (left, bottom, 0, 0, right, bottom, 0, 0, right, top, 0, 0, left, top, 0, 0)
            indices += (at, at + 1, at + 2, at, at + 2, at + 3)
        Mesh(vertices=vertices, indices=indices, mode="triangles")
