"""What a timeline looks like: ``Frame`` says what is drawn and where, each function paints a part of it on the open canvas."""
from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import Any, NamedTuple

from kivy.graphics import Color, Mesh
from kivy.metrics import dp, sp
from kivymd.icon_definitions import md_icons

from app.widgets.chart import box, hatch, text, width_of
from app.widgets.time_scale import TimeScale
from app.widgets.tokens import tk

AXIS = 28                # dp, above the lanes
NARROW = 12              # dp; such bars are drawn together
FOLD = 72                # dp of folded time
INSET = 5                # dp of the upper edge of a bar, below which one that begins on it is drawn
OVERLAP = 6              # dp of the lower edge of bars that overlap
LEGIBLE = 20             # dp of the height of a bar that has words
MOMENT = 1 / 3600        # hours that bars may share without overlapping
BEYOND = .5              # of what is seen, drawn on either side of it
ABOUT_EDGE = .22         # of the height of a bar whose robot is a forecast, hatched above and below
PIECES = 10_000          # bars of one mesh, whose indices have 16 bits

Span = tuple[float, float]               # left and right end in px


class Colours(NamedTuple):
    """Of a bar, its text and its border."""
    fill: Any
    ink: Any
    edge: Any


TOKENS = {               # by the look of a bar: its state, or that its length is not known
    "planned": Colours("accent_bg", "accent_on", "accent"), "assumed": Colours("surface", "ink2", "accent"),
    "about": Colours("accent_bg", "accent_on", "accent"),
    "running": Colours("accent", "accent_ink", "accent"), "past": Colours("track", "ink2", "outline"),
    "failed": Colours("fault_solid", "solid_ink", "fault_solid"), "skipped": Colours("surface", "attention", "attention"),
    "held": Colours("surface", "ink2", "ink2"),
}
# in high contrast, where tints are solid
STRONG = {**TOKENS, **dict.fromkeys(("planned", "about"), Colours("accent_soft", "ink", "accent"))}


def colours() -> Mapping[str, Colours]:
    """Of the present theme, by the look of a bar."""
    return {look: Colours(*(getattr(tk, token) for token in tokens)) for look, tokens in (STRONG if tk.strong else TOKENS).items()}


def look_of(bar: Any) -> str:
    return "assumed" if bar.assumed else bar.state


@dataclass(frozen=True)
class Frame:
    """What is drawn and where: hours of the timeline, px of the window. ``lanes``, ``bands`` and ``ticks`` are those of ``Timeline``."""
    lanes: Sequence[Any]
    bands: Sequence[tuple[float, float, str, str]]
    ticks: Sequence[tuple[float, str, bool]]
    first: float         # hour at the left edge
    hours: float         # from the left edge to the right
    low: float           # hours that are drawn: from, to
    high: float
    begins: float        # ``first`` on the scale
    x: float             # names begin here
    left: float          # the bars' left edge
    right: float
    y: float
    top: float
    unit: float          # px of an hour
    scale: TimeScale
    lane_height: float
    colours: Mapping[str, Colours]

    @classmethod
    def of(cls, lanes: Sequence[Any], bands: Sequence[Any], ticks: Sequence[Any], first: float, hours: float,
           pos: tuple[float, float], size: tuple[float, float], day: str = "") -> Frame:
        """The names take what they need of the width, up to a third, and the ``day`` above them what it needs."""
        (x, y), (width, height) = pos, size
        names = max(max(width_of(lane.name, 16, "RobotoMedium"), width_of(lane.note)) for lane in lanes)
        left = x + max(dp(88), min(names + dp(16), width * .3), width_of(day, font="RobotoMedium") + dp(12))
        unit = (x + width - left) / hours
        scale = TimeScale([band[:2] for band in bands if band[3] == "folded"], dp(FOLD) / unit)
        begins = scale.drawn(first)
        return cls(lanes, bands, ticks, first, hours,
                   low=scale.hour(begins - hours * BEYOND), high=scale.hour(begins + hours * (1 + BEYOND)), begins=begins,
                   x=x, left=left, right=x + width, y=y, top=y + height, unit=unit, scale=scale,
                   lane_height=(height - dp(AXIS)) / len(lanes), colours=colours())

    @property
    def bottom_of_axis(self) -> float:
        return self.top - dp(AXIS)

    @property
    def bar_height(self) -> float:
        return self.lane_height - dp(16)

    def at(self, hour: float) -> float:
        """Where an hour is, or the end of what is drawn."""
        return self.left + self.shift(min(max(hour, self.low), self.high))

    def shift(self, hour: float) -> float:
        """Px from the left edge of the drawing to an hour."""
        return self.unit * (self.scale.drawn(hour) - self.begins)

    def hour_at(self, x: float) -> float:
        """What is drawn there."""
        return self.scale.hour(self.begins + (x - self.left) / self.unit)

    def middle(self, lane: int) -> float:
        return self.bottom_of_axis - self.lane_height * (lane + .5)

    def lane_at(self, y: float) -> int:
        """Nearest lane to a height in px."""
        return min(max(int((self.bottom_of_axis - y) / self.lane_height), 0), len(self.lanes) - 1)

    def lanes_in_sight(self, seen_from: float, seen_height: float) -> range:
        """All lanes, or of a page that scrolls those that are seen (px from the top) and one on either side."""
        if not seen_height:
            return range(len(self.lanes))
        above = int((seen_from - dp(AXIS)) / self.lane_height)
        return range(max(0, above - 1), min(len(self.lanes), above + int(seen_height / self.lane_height) + 3))

    def is_drawn(self, start: float, end: float | None = None) -> bool:
        """Whether something of that time is within what is drawn."""
        return (start if end is None else end) > self.low and start < self.high


# ---------------------------------------------------------------------- the background
def paint_background(frame: Frame) -> None:
    """Closed time with its words, held time, and the lines of the ticks."""
    height = frame.bottom_of_axis - frame.y
    bands = [(frame.at(start), frame.at(end), words, kind) for start, end, words, kind in frame.bands if frame.is_drawn(start, end)]
    for x, x2, words, kind in bands:
        if kind == "held":
            box(x, frame.y, x2 - x, height, tk.attention_bg, alpha=.3 if tk.strong else .6)
            box(x2 - dp(2), frame.y, dp(2), height, tk.attention)
        else:
            box(x, frame.y, x2 - x, height, tk.closed)
            hatch(x, frame.y, x2 - x, height, tk.hatch)
        if kind == "folded":
            _paint_fold(frame, x, x2, words)
    for hour, _label, strong in frame.ticks:
        if frame.is_drawn(hour):
            box(frame.at(hour), frame.y, 2 if strong else 1, height, tk.outline if strong else tk.grid)
    for x, x2, words, kind in bands:
        left, right = max(frame.left, x), min(frame.right, x2)
        width = width_of(words) + dp(24)
        if kind == "closed" and width <= right - left:
            middle, y = (left + right) / 2, frame.y + frame.lane_height * (len(frame.lanes) - .5)
            box(middle - width / 2, y - dp(13), width, dp(26), tk.surface, dp(13))
            text(words, middle, y, tk.ink2, ax=.5)


def _paint_fold(frame: Frame, x: float, x2: float, words: str) -> None:
    """A break in the time, and what is left out, a line each that fits; in each screen of many lanes again."""
    for edge in (x, x2 - dp(2)):
        box(edge, frame.y, dp(2), frame.bottom_of_axis - frame.y, tk.outline)
    lines, room, line_height = [""], x2 - x - dp(8), sp(17)
    for word in words.replace("–", "– ").split():
        longer = f"{lines[-1]} {word}".replace("– ", "–").strip()
        is_room = width_of(longer) <= room and not lines[-1].endswith(",")
        lines = [*lines[:-1], longer] if not lines[-1] or is_room else [*lines, word]
    if max(map(width_of, lines)) > room or len(lines) * line_height > min(4, len(frame.lanes)) * frame.lane_height:
        return
    for lane in range(0, len(frame.lanes), 4):
        middle = frame.bottom_of_axis - frame.lane_height * (lane + min(4, len(frame.lanes) - lane) / 2)
        for n, line in enumerate(lines):
            y = middle + line_height * ((len(lines) - 1) / 2 - n)
            box(x + dp(4), y - line_height / 2, room, line_height, tk.surface)
            text(line, (x + x2) / 2, y, tk.ink2, ax=.5)


# ---------------------------------------------------------------------- lanes
def paint_name(frame: Frame, lane: int) -> None:
    """Of a robot, or across the lane what it stands for."""
    shown, y = frame.lanes[lane], frame.middle(lane)
    if shown.line:
        box(frame.x, y - frame.lane_height / 2 + 1, frame.right - frame.x, frame.lane_height - 1, tk.surface2)
        text(md_icons["chevron-up" if shown.is_open else "chevron-down"], frame.x + dp(12), y, tk.ink2, 20, .5, .5, "Icons")
        text(shown.line, frame.x + dp(28), y, tk.ink2, 16)
    text(shown.name, frame.x, y + (dp(9) if shown.note else 0), tk.ink, 16, font="RobotoMedium")
    text(shown.note, frame.x, y - dp(10), tk.ink3)


def insets(bars: Sequence[Any]) -> list[float]:
    """How much lower than a lane's other bars each ends, px: one that begins on others leaves the upper edges of two of them in sight."""
    found: list[float] = []
    ends: list[float] = []                       # of those that the present one begins on
    for bar in bars:
        ends = [end for end in ends if end > bar.start + MOMENT]
        found.append(dp(INSET) * min(len(ends), 2))
        ends.append(bar.end)
    return found


def paint_bars(frame: Frame, bars: Sequence[Any], y: float) -> None:
    """Each with its whisker, but for narrow ones."""
    narrow: dict[tuple[float, str], list[Span]] = {}
    for bar, inset in zip(bars, insets(bars), strict=True):
        x, x2 = frame.at(bar.start), frame.at(bar.end)
        if x2 - x < dp(NARROW):
            narrow.setdefault((inset, look_of(bar)), []).append((x, x + bar_width(x, x2)))
        else:
            _paint_bar(frame, bar, x, x2, y, inset)
    for (inset, look), spans in sorted(narrow.items()):
        paint_narrow(look, frame.colours[look], spans, y - inset / 2, frame.bar_height - inset)


def paint_bars_together(frame: Frame, bars: Sequence[Any], y: float) -> None:
    """So many that only where there are some can be seen: few drawings, whatever their number, so that a finger can drag them."""
    taken: dict[str, list[Span]] = {}
    for bar in bars:
        x = frame.at(bar.start)
        x2 = max(frame.at(bar.end), x + 2)
        _join(taken.setdefault("assumed" if bar.assumed else bar.state, []), x, x2)
    for look, spans in taken.items():
        paint_narrow(look, frame.colours[look], spans, y, frame.bar_height)


def _paint_bar(frame: Frame, bar: Any, x: float, x2: float, y: float, inset: float) -> None:
    width, height, colours = x2 - x - 1, frame.bar_height - inset, frame.colours[look_of(bar)]
    bottom = y - frame.bar_height / 2
    if (late := _late_end(frame, bar)) > x2 + dp(2):
        box(x2, y - dp(1), late - x2, dp(2), colours.edge)
        box(late - dp(2), y - dp(6), dp(2), dp(12), colours.edge)
    paint_look(look_of(bar), colours, x, bottom, width, height)
    if bar.typed:                                # a frame in the frame
        box(x + dp(3), bottom + dp(3), width - dp(6), height - dp(6), colours.edge, dp(2), ring=1)
    if bar.state == "planned":
        box(x, bottom, dp(4), height, tk.accent, (dp(4), 0, 0, dp(4)))


def paint_lifted(frame: Frame, bar: Any, place: Sequence[float], x: float, words: str) -> None:
    """A bar under a finger at x, faded where it is planned, and above it the time at which it would begin."""
    left, bottom, right, top = place[:4]
    width, height, seen = right - left, top - bottom, (frame.left, frame.right)
    box(max(left, seen[0]), bottom, right - max(left, seen[0]), height, tk.surface, alpha=.8)
    box(x, bottom, width, height, tk.accent_bg, dp(4))
    box(x, bottom, width, height, tk.accent, dp(4), ring=dp(2))
    if width_of(bar.label) + dp(16) <= width:
        text(bar.label, x + dp(10), bottom + height / 2, tk.accent_on)
    pill = width_of(words, 16, "RobotoMedium") + dp(24)
    left, y = kept_in(min(max(x + width / 2, seen[0]), seen[1]), pill, seen), bottom + height + dp(16)
    box(left, y - dp(15), pill, dp(30), tk.accent, dp(15))
    text(words, left + pill / 2, y, tk.accent_ink, 16, ax=.5, font="RobotoMedium")


def paint_look(look: str, colours: Colours, x: float, bottom: float, width: float, height: float) -> None:
    """A bar as wide as it may be, or its key in a legend."""
    box(x, bottom, width, height, colours.fill, dp(4))
    if look == "about":                          # along both edges, so that words stay legible
        for edge in (bottom, bottom + height - ABOUT_EDGE * height):
            hatch(x, edge, width, ABOUT_EDGE * height, colours.edge, 6, 1.4)
    box(x, bottom, width, height, colours.edge, dp(4), ring=dp(2) if look in ("skipped", "held") else 1)
    middle, step = bottom + height / 2, dp(8)
    if look == "held":                           # dashes
        _mesh([(left, left + step / 2) for left in _steps(x + step / 2, x + width - step / 2, step)], middle, height, colours.fill)
        _mesh([(x, x + width)], middle, step / 2, colours.fill)
        size = 14 if width >= dp(20) else 10
        text(md_icons["hand-back-right-outline"], x + min(width / 2, dp(14)), middle, colours.ink, size, .5, .5, "Icons")
    elif look == "failed":
        _notches([(x, x + width)], bottom + height)


def paint_narrow(look: str, colours: Colours, spans: Sequence[Span], y: float, height: float) -> None:
    """Many bars of one look that are too narrow for more: the same fill, border, dashes and notch."""
    _mesh(spans, y, height, colours.edge)
    if colours.fill != colours.edge:
        inset = dp(1.5)
        _mesh([(x + inset, max(x2 - inset, x + inset + 1)) for x, x2 in spans], y, height - 2 * inset, colours.fill)
    if look == "held":
        for part in (-.25, .25):
            _mesh(spans, y + height * part, dp(4), colours.fill)
    elif look == "about":                        # broken in the middle: there is no room for hatching
        _mesh(spans, y, dp(6), tk.surface)
    elif look == "failed":
        _notches(spans, y + height / 2)


def _notches(spans: Sequence[Span], top: float) -> None:
    """Cut out of the upper edge, in the middle of each, so that failed bars are told without their colour."""
    _mesh([(middle - half, middle + half) for x, x2 in spans for middle, half in [((x + x2) / 2, min(dp(4), (x2 - x) / 4))]],
          top - dp(3), dp(6), tk.surface)


def _steps(start: float, end: float, step: float) -> Iterator[float]:
    return (start + step * n for n in range(max(0, int((end - start) / step))))


def paint_words(frame: Frame, bars: Sequence[Any], y: float, seen: Span) -> None:
    """Whole names only: in what is seen of the bar, or beside it where nothing follows too soon; else a number, where there is one.
    ``seen``: left and right end of what is seen."""
    ends = [frame.at(start) for start, *_ in frame.bands]
    for n, (bar, inset) in enumerate(zip(bars, insets(bars), strict=True)):
        x, hand = frame.at(bar.start), dp(14) if bar.state == "held" else 0
        x2 = x + bar_width(x, frame.at(bar.end))
        room_ends = min((start for start in (*[frame.at(next_bar.start) for next_bar in bars[n + 1:n + 2]], *ends) if start >= x),
                        default=math.inf)
        left, right = (max(x, seen[0]), min(x2, seen[1])) if x < seen[1] and x2 > seen[0] else (x, x2)
        left, right = _not_covered(frame, left, right, takewhile(lambda other, end=bar.end: other.start < end, bars[n + 1:]))
        is_on_another = any(other.end > bar.end for other in bars[:n])
        for words in filter(None, (bar.label, bar.short)):
            need, beside = width_of(words) + dp(16) + hand, max(x2, _late_end(frame, bar))
            if need <= right - left and frame.bar_height - inset >= dp(LEGIBLE):
                text(words, left + dp(10) + hand, y - inset / 2, frame.colours[look_of(bar)].ink)
                break
            is_cut = any(beside < edge < beside + need for edge in seen)
            if beside + need <= room_ends and not is_cut and not is_on_another:
                text(words, beside + dp(6), y, tk.ink2)
                break


def _not_covered(frame: Frame, left: float, right: float, above: Iterable[Any]) -> Span:
    """The widest part of a bar, seen from ``left`` to ``right``, that those drawn above it leave in sight."""
    parts: list[Span] = []
    for other in above:                          # by their beginning
        x = frame.at(other.start)
        x2 = x + bar_width(x, frame.at(other.end))
        if x2 > left and x < right:
            parts.append((left, x))
            left = x2
    return max((*parts, (left, right)), key=lambda part: part[1] - part[0])


def paint_overlaps(frame: Frame, lane: int) -> None:
    """What two bars share, hatched along their lower edge, so that they and their words stay legible; narrow ones as plain marks."""
    height, bottom = dp(OVERLAP), frame.middle(lane) - frame.bar_height / 2
    narrow: list[Span] = []
    for start, end in frame.lanes[lane].overlaps:
        if not frame.is_drawn(start, end):
            continue
        x, x2 = frame.at(start), frame.at(end)
        if x2 - x < dp(NARROW):
            _join(narrow, x, max(x2, x + 2))
        else:
            box(x, bottom, x2 - x, height, tk.attention_bg)
            hatch(x, bottom, x2 - x, height, tk.overlap, 6, 2)
            box(x, bottom, x2 - x, height, tk.attention, ring=1)
    _mesh(narrow, bottom + height / 2, height, tk.overlap)


def _late_end(frame: Frame, bar: Any) -> float:
    """Where its whisker ends."""
    return frame.at(bar.end if bar.late is None else bar.late)


def bar_width(x: float, x2: float) -> float:
    """Of a bar from x to x2: a gap after it, and wide enough to be seen."""
    return max(dp(6), x2 - x - 1)


def _join(spans: list[Span], x: float, x2: float) -> None:
    """Add a span to those before it, which it may touch."""
    if spans and x <= spans[-1][1] + 1:
        if x2 > spans[-1][1]:
            spans[-1] = spans[-1][0], x2
    else:
        spans.append((x, x2))


def _mesh(spans: list[Span], y: float, height: float, colour: Any) -> None:
    """Many thin bars as one drawing, in pieces that its indices can count."""
    Color(*colour)
    bottom, top = round(y - height / 2), round(y + height / 2)
    for n in range(0, len(spans), PIECES):
        vertices: list[float] = []
        indices: list[int] = []
        for at, (left, right) in enumerate(spans[n:n + PIECES]):
            at *= 4
            vertices += (left, bottom, 0, 0, right, bottom, 0, 0, right, top, 0, 0, left, top, 0, 0)
            indices += (at, at + 1, at + 2, at, at + 2, at + 3)
        Mesh(vertices=vertices, indices=indices, mode="triangles")


def kept_in(x: float, width: float, seen: Span) -> float:
    """Left end of something ``width`` px wide around x, which is not cut by an edge as long as x is seen."""
    left, right = seen
    return min(max(x - width / 2, left), right - width) if left <= x <= right else x - width / 2
