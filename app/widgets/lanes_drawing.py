"""One drawing of lanes: the visible part and as much on either side, made once and then only moved. Lanes that come into
sight are added. The axis and the now-line depend on the time and on the edges of the visible part, so they are a separate
layer.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from kivy.graphics import (
    Canvas,
    PopMatrix,
    PushMatrix,
    Rectangle,
    StencilPop,
    StencilPush,
    StencilUnUse,
    StencilUse,
    Translate,
)
from kivy.metrics import dp

from app.widgets.chart import box, text
from app.widgets.lanes_axis import paint_axis, paint_now
from app.widgets.lanes_bars import Placed, paint_bars, paint_bars_together, placed
from app.widgets.lanes_frame import AXIS, Frame, paint_background, paint_name
from app.widgets.lanes_words import Room, paint_words, rooms
from app.widgets.tokens import tk

DETAILED = 160  # visible bars with corners, for all lanes: beyond that a lane's bars are drawn together
LEAST = 8  # of them for each lane, with any number of lanes
NEARLY = 1e-9  # hours: sums of floats

Box = tuple[float, float, float, float, object]  # left, bottom, right, top in px, key of the bar


@contextmanager
def _window(pos: tuple[float, float], size: tuple[float, float]) -> Iterator[None]:
    """Changes until then appear only there."""
    StencilPush()
    Rectangle(pos=pos, size=size)
    StencilUse()
    yield
    StencilUnUse()
    Rectangle(pos=pos, size=size)
    StencilPop()


class Drawing:
    """Of one frame. ``canvas`` holds it; ``show_lanes`` makes the lanes."""

    def __init__(self, frame: Frame, seen_height: float = 0.0) -> None:
        self.frame = frame
        self.moved = 0.0  # px to the right, since it was made
        self._bars_of: dict[int, list[Any]] = {}
        self._placed_of: dict[int, list[Placed]] = {}
        self._rooms_of: dict[int, list[Room]] = {}
        self._now_at = math.inf  # px, of the present time
        self._made: dict[int, tuple[Canvas, Canvas, Canvas]] = {}  # name, bars and their words, of a lane
        self._worded_at = 0.0  # how far it was moved when the words were made
        self._day = ""  # that is named
        self._most = max(
            LEAST, int(DETAILED / min(len(frame.lanes), max(1.0, (seen_height or math.inf) / frame.lane_height)))
        )
        self.canvas = Canvas()
        with self.canvas:
            self._build_layers()

    def _build_layers(self) -> None:
        frame, width = self.frame, self.frame.right - self.frame.left
        for n in range(1, len(frame.lanes) + 1):
            box(frame.x, frame.bottom_of_axis - frame.lane_height * n, frame.right - frame.x, 1, tk.line)
        box(frame.left - 1, frame.y, 1, frame.top - frame.y, tk.line)
        with _window((frame.left, frame.y), (width, frame.bottom_of_axis - frame.y)):
            PushMatrix()
            self._pan = Translate(0, 0)
            paint_background(frame)
            self._bars = Canvas()
            self._words = Canvas()
            self._now = Canvas()
            PopMatrix()
        self._names = Canvas()
        PushMatrix()
        self._pin = Translate(0, 0)
        box(frame.x, frame.bottom_of_axis, frame.right - frame.x, frame.top - frame.bottom_of_axis, tk.surface)
        box(frame.x, frame.bottom_of_axis, frame.right - frame.x, 1, tk.line)
        with _window((frame.left, frame.bottom_of_axis), (width, frame.top - frame.bottom_of_axis)):
            PushMatrix()
            self._axis_pan = Translate(0, 0)
            self._axis = Canvas()
            PopMatrix()
        self._corner = Canvas()
        PopMatrix()

    # ------------------------------------------------------------------ what is drawn
    def bars_of(self, lane: int) -> list[Any]:
        """Those of the drawn time, by their beginning."""
        if lane not in self._bars_of:
            low, high = self.frame.low, self.frame.high
            self._bars_of[lane] = sorted(
                (bar for bar in self.frame.lanes[lane].bars if bar.end > low and bar.start < high),
                key=lambda bar: bar.start,
            )
        return self._bars_of[lane]

    def placed_of(self, lane: int) -> list[Placed]:
        """Those, as they are drawn."""
        if lane not in self._placed_of:
            self._placed_of[lane] = placed(self.frame, lane, self.bars_of(lane))
        return self._placed_of[lane]

    def is_together(self, lane: int) -> bool:
        """Whether it has too much to draw all of it in detail."""
        return len(self.placed_of(lane)) > self._most

    def reaches(self, first: float, margin: float = 0.0) -> bool:
        """Whether it covers everything from hour ``first``, and this many hours around."""
        frame, begins = self.frame, self.frame.scale.drawn(first)
        low, high = frame.scale.drawn(frame.low), frame.scale.drawn(frame.high)
        return (low <= begins - margin + NEARLY and begins + frame.hours + margin <= high + NEARLY) or self._is_whole

    @property
    def _is_whole(self) -> bool:
        """Whether nothing exists beyond the drawing."""
        frame = self.frame
        return all(len(self.bars_of(lane)) == len(frame.lanes[lane].bars) for lane in self._made) and all(
            frame.low - 1 <= hour <= frame.high + 1 for hour, *_ in frame.ticks
        )

    def boxes(self, lane: int) -> Iterator[Box]:
        """Where its bars are seen now."""
        for one in self.placed_of(lane):
            yield one.x + self.moved, one.bottom, one.right + self.moved, one.bottom + one.height, one.bar.key

    # ------------------------------------------------------------------ moving
    def move(self, px: float) -> None:
        """To the right."""
        self.moved += px
        self._pan.x = self._axis_pan.x = round(self.moved)

    def place(self, first: float) -> None:
        """So that hour ``first`` is at the left."""
        self.move(-self.frame.shift(first) - self.moved)

    def pin(self, seen_from: float) -> None:
        """The axis at the top of the visible part of a page that scrolls."""
        self._pin.y = -round(seen_from)

    # ------------------------------------------------------------------ its layers
    @property
    def lanes(self) -> list[int]:
        """Those that are drawn."""
        return list(self._made)

    def show_lanes(self, seen_from: float, seen_height: float) -> None:
        """Add those in sight that are missing; those out of sight leave."""
        in_sight = self.frame.lanes_in_sight(seen_from, seen_height)
        for lane in [lane for lane in self._made if lane not in in_sight]:
            for layer, part in zip((self._names, self._bars, self._words), self._made.pop(lane), strict=True):
                layer.remove(part)
        for lane in in_sight:
            if lane not in self._made:
                self._made[lane] = self._make_lane(lane)

    def _make_lane(self, lane: int) -> tuple[Canvas, Canvas, Canvas]:
        frame, together = self.frame, self.is_together(lane)
        with self._names:
            name = Canvas()
        with name:
            paint_name(frame, lane)
        with self._bars:
            bars = Canvas()
        with bars:
            (paint_bars_together if together else paint_bars)(frame, self.placed_of(lane))
        with self._words:
            words = Canvas()
        self._word_lane(lane, words)
        return name, bars, words

    def _word_lane(self, lane: int, words: Canvas) -> None:
        if lane not in self._rooms_of:
            self._rooms_of[lane] = rooms(self.frame, self.placed_of(lane))
        words.clear()
        with words:
            paint_words(self.frame, self._rooms_of[lane], self._seen, self._now_at)

    @property
    def _seen(self) -> tuple[float, float]:
        """Left and right end of the visible part, as drawn."""
        return self.frame.left - self._pan.x, self.frame.right - self._pan.x

    def draw_axis(self, now: float, now_label: str) -> None:
        """Its labels and those of bars, whole at the edges of the present visible part, and the now-line."""
        now_at = self.frame.at(now)
        if (self._worded_at, self._now_at) != (self._pan.x, now_at):
            self._worded_at, self._now_at = self._pan.x, now_at
            for lane, (_name, _bars, words) in self._made.items():
                self._word_lane(lane, words)
        self._now.clear()
        with self._now:
            paint_now(self.frame, now)
        self._axis.clear()
        with self._axis:
            paint_axis(self.frame, self._seen, now, now_label)

    def name_day(self, day: str) -> None:
        """At the left edge, above the names."""
        if day != self._day:
            self._day = day
            self._corner.clear()
            with self._corner:
                text(day, self.frame.x + dp(12), self.frame.top - dp(AXIS) / 2 + dp(2), tk.ink, font="RobotoMedium")
