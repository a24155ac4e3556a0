"""The look of lanes: ``Frame`` says what is drawn and where, each function paints a part of it on the open canvas."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any, NamedTuple

from kivy.metrics import dp, sp
from kivymd.icon_definitions import md_icons

from app.widgets.chart import box, hatch, text, width_of
from app.widgets.time_scale import TimeScale
from app.widgets.tokens import tk

AXIS = 36  # dp, above the lanes
LEAST_LANE, MOST_LANE = 48, 124  # dp: they share the room
BAR = 48  # dp: the greatest height of a bar
TWO_LINES_FROM = 84  # dp of a lane's height
FOLD = 72  # dp of folded time
SEEN = 4  # lanes that are in sight at once
UPPER = 8  # lanes, which are in sight before any are scrolled

Span = tuple[float, float]  # left and right end in px


class Colours(NamedTuple):
    """Of a bar, its text and its border."""

    fill: Any
    ink: Any
    edge: Any


DID = {  # what robots did, without a gap between
    "executing": Colours("accent_solid", "solid_ink", "accent_solid"),
    "charging": Colours("accent_soft", "ink", "accent_soft"),
    "idle": Colours("neutral_bg", "neutral_on", "neutral_bg"),
    "paused": Colours("action_solid", "solid_ink", "action_solid"),
    "error": Colours("fault_solid", "solid_ink", "fault_solid"),
    "offline": Colours("surface", "ink2", "outline"),
    "no_data": Colours("surface", "ink2", "outline"),
}
TOKENS = {  # by the state of a bar
    **DID,
    "planned": Colours("accent_bg", "accent_on", "accent_mid"),
    "draft": Colours("surface", "accent_on", "accent"),
    "was": Colours("surface", "ink2", "outline"),
    "running": Colours("accent_solid", "solid_ink", "accent_solid"),
    "past": Colours("neutral_bg", "ink2", "outline"),
    "failed": Colours("fault_bg", "fault_on", "fault"),
    "skipped": Colours("surface", "ink2", "attention_solid"),
    "held": Colours("surface", "ink2", "attention_solid"),
    "refused": Colours("surface", "ink2", "attention_solid"),
}
# in high contrast, where tints are solid
STRONG = {
    **TOKENS,
    **{state: look._replace(edge="ink") for state, look in DID.items()},
    "no_data": Colours("track", "ink", "ink"),
    "planned": Colours("accent_soft", "ink", "accent"),
    "draft": Colours("surface", "ink", "accent"),
    "failed": Colours("surface", "fault", "fault"),
    "past": Colours("track", "ink", "outline"),
}


def colours() -> Mapping[str, Colours]:
    """Of the present theme, by the look of a bar."""
    return {
        look: Colours(*(getattr(tk, token) for token in tokens))
        for look, tokens in (STRONG if tk.strong else TOKENS).items()
    }


class Frame:
    """What is drawn and where: hours of the timeline, px of the window. ``chart`` is a ``Lanes``, whose first hour's ``day`` stands above
    the names. They take what they need of the width, up to 0.3 of it."""

    def __init__(self, chart: Any, day: str) -> None:
        self.lanes, self.bands, self.ticks = chart.lanes, chart.bands, chart.ticks
        self.x, self.y, self.right, self.top = chart.x, chart.y, chart.right, chart.top
        icons = dp(28) if any(lane.icon for lane in self.lanes) else 0
        names = icons + max(max(width_of(lane.name, 18, "RobotoMedium"), width_of(lane.note)) for lane in self.lanes)
        names = max(dp(88), min(names + dp(24), chart.width * 0.3), width_of(day, font="RobotoMedium") + dp(20))
        self.left = self.x + min(names, chart.width - 1)  # the window may be getting smaller
        self.bottom_of_axis = self.top - dp(AXIS)
        room = (self.bottom_of_axis - self.y) / len(self.lanes)
        self.lane_height = dp(LEAST_LANE) if any(lane.line for lane in self.lanes) else min(dp(MOST_LANE), room)
        self.bottom = self.bottom_of_axis - self.lane_height * len(self.lanes)
        self.bar_height = min(dp(BAR), self.lane_height - dp(16))
        self.half_height = min(dp(BAR) - dp(4), (self.lane_height - dp(10)) / 2)  # of bars that overlap
        self._unit = (self.right - self.left) / chart.hours  # px of an hour
        self._scale = TimeScale([band[:2] for band in self.bands if band[3] == "folded"], dp(FOLD) / self._unit)
        self._begins = self._scale.drawn(chart.first)
        self.colours = colours()

    def at(self, hour: float) -> float:
        """The place of an hour."""
        return self.left + self._unit * (self._scale.drawn(hour) - self._begins)

    def hour_at(self, x: float) -> float:
        """What is drawn there."""
        return self._scale.hour(self._begins + (x - self.left) / self._unit)

    def middle(self, lane: int) -> float:
        return self.bottom_of_axis - self.lane_height * (lane + 0.5)

    def lane_at(self, y: float) -> int:
        """Nearest lane to a height in px."""
        return min(max(int((self.bottom_of_axis - y) / self.lane_height), 0), len(self.lanes) - 1)

    def lanes_in_sight(self, seen_from: float, seen_height: float) -> range:
        """All lanes, or on a page that scrolls the visible ones (px from the top) and one on either side."""
        if not seen_height:
            return range(len(self.lanes))
        above = int((seen_from - dp(AXIS)) / self.lane_height)
        return range(max(0, above - 1), min(len(self.lanes), above + int(seen_height / self.lane_height) + 3))


# ---------------------------------------------------------------------- the background
def paint_background(frame: Frame) -> None:
    """Closed time with its words, held time, and the lines of the ticks."""
    height = frame.bottom_of_axis - frame.y
    bands = [(frame.at(start), frame.at(end), words, kind) for start, end, words, kind in frame.bands]
    for x, x2, words, kind in bands:
        if kind == "held":
            box(x, frame.y, x2 - x, height, tk.attention_bg, alpha=0.3 if tk.strong else 0.6)
            box(x2 - dp(2), frame.y, dp(2), height, tk.attention)
        else:
            box(x, frame.y, x2 - x, height, tk.closed)
            hatch(x, frame.y, x2 - x, height, tk.hatch)
        if kind == "folded":
            _paint_fold(frame, x, x2, words)
    for hour, _label, strong in frame.ticks:
        box(frame.at(hour), frame.y, 2 if strong else 1, height, tk.outline if strong else tk.grid)
    for x, x2, words, kind in bands:
        left, right = max(frame.left, x), min(frame.right, x2)
        width = width_of(words) + dp(24)
        middle = (left + right) / 2
        lane = (
            _free_lane(frame, middle - width / 2, middle + width / 2)
            if kind == "closed" and width <= right - left
            else None
        )
        if lane is not None:
            y = frame.middle(lane)
            box(middle - width / 2, y - dp(13), width, dp(26), tk.surface, dp(13))
            text(words, middle, y, tk.ink2, ax=0.5)


def _free_lane(frame: Frame, left: float, right: float) -> int | None:
    """The first of the upper lanes without a bar in the way of the text."""
    start, end = frame.hour_at(left), frame.hour_at(right)
    return next(
        (
            n
            for n, lane in enumerate(frame.lanes[:UPPER])
            if not lane.line and not any(bar.start < end and bar.end > start for bar in lane.bars)
        ),
        None,
    )


def _paint_fold(frame: Frame, x: float, x2: float, words: str) -> None:
    """A break in the time, with the omitted days, one line each that fits; repeated on each screen of many lanes."""
    for edge in (x, x2 - dp(2)):
        box(edge, frame.y, dp(2), frame.bottom_of_axis - frame.y, tk.outline)
    lines, room, line_height = [""], x2 - x - dp(8), sp(17)
    for word in words.replace("–", "– ").split():
        longer = f"{lines[-1]} {word}".replace("– ", "–").strip()
        is_room = width_of(longer) <= room and not lines[-1].endswith(",")
        lines = [*lines[:-1], longer] if not lines[-1] or is_room else [*lines, word]
    if max(map(width_of, lines)) > room:
        return
    for first, count in stretches(frame.lanes):
        if len(lines) * line_height <= count * frame.lane_height:
            middle = frame.bottom_of_axis - frame.lane_height * (first + count / 2)
            for n, line in enumerate(lines):
                y = middle + line_height * ((len(lines) - 1) / 2 - n)
                box(x + dp(4), y - line_height / 2, room, line_height, tk.surface)
                text(line, (x + x2) / 2, y, tk.ink2, ax=0.5)


def stretches(lanes: Sequence[Any]) -> Iterator[tuple[int, int]]:
    """Successive robots' lanes: the first, and how many, at most as many as are visible at once."""
    for is_line, numbers in groupby(range(len(lanes)), lambda n: bool(lanes[n].line)):
        found = [] if is_line else list(numbers)
        yield from ((found[n], min(SEEN, len(found) - n)) for n in range(0, len(found), SEEN))


# ---------------------------------------------------------------------- lanes
def paint_name(frame: Frame, lane: int) -> None:
    """The name of a robot with the icon of its state, or across the lane, the words of a line."""
    shown, y = frame.lanes[lane], frame.middle(lane)
    if shown.line:
        for height, colour in (
            (frame.lane_height, tk.surface2),
            (1, tk.line),
        ):  # hides the time lines below it
            box(frame.x, y - frame.lane_height / 2, frame.right - frame.x, height, colour)
        icon = md_icons["chevron-down" if shown.is_open else "chevron-right"]
        text(icon, frame.x + dp(24), y, tk.ink2, 24, 0.5, 0.5, "Icons")
        left = frame.x + dp(44)
        left += text(shown.name, left, y, tk.ink, 18, font="RobotoMedium") + (dp(12) if shown.name else 0)
        text(shown.line, left, y, tk.ink2, 16)
        return
    left = frame.x + dp(12)
    if shown.icon:
        text(md_icons[shown.icon], left + dp(10), y, getattr(tk, shown.tone), 20, 0.5, 0.5, "Icons")
        left += dp(28)
    room = frame.left - left - dp(4)
    text(
        cut(shown.name, room, 18, "RobotoMedium"),
        left,
        y + (dp(10) if shown.note else 0),
        tk.ink,
        18,
        font="RobotoMedium",
    )
    text(cut(shown.note, room), left, y - dp(12), tk.ink2)


def cut(words: str, room: float, size: int = 14, font: str = "Roboto") -> str:
    """As much as there is room for, with "…" at its end; empty if that says nothing."""
    if width_of(words, size, font) <= room:
        return words
    most = bisect_right(range(1, len(words)), room, key=lambda n: width_of(words[:n].rstrip() + "…", size, font))
    return words[:most].rstrip() + "…" if most > 2 else ""


def kept_in(x: float, width: float, seen: Span) -> float:
    """Left end of something ``width`` px wide around x, not cut by an edge while x is visible."""
    left, right = seen
    return min(max(x - width / 2, left), right - width) if left <= x <= right else x - width / 2
