"""One drawing of lanes: everything that was read, made once and then only moved. Lanes that come into sight are added. The axis, the
now-line and the names of bars depend on the time and on the edges of the visible part, so they are drawn apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

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
from app.widgets.lanes_bars import Placed, paint_bars, placed
from app.widgets.lanes_frame import AXIS, Frame, paint_background, paint_name
from app.widgets.lanes_words import paint_words
from app.widgets.tokens import tk

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

    def __init__(self, frame: Frame) -> None:
        self.frame, self.moved = frame, 0.0  # px to the right, since it was made
        self._made: dict[
            int, tuple[list[Placed], Canvas, Canvas, Canvas]
        ] = {}  # of a lane: its bars; name, bars and words as drawn
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

    # ------------------------------------------------------------------ what is where
    def move(self, first: float) -> None:
        """So that hour ``first`` is at the left."""
        self.moved = self.frame.left - self.frame.at(first)
        self._pan.x = self._axis_pan.x = round(self.moved)

    def pin(self, seen_from: float) -> None:
        """The axis at the top of the visible part of a page that scrolls."""
        self._pin.y = -round(seen_from)

    def placed_of(self, lane: int) -> list[Placed]:
        """Its bars, as they are drawn."""
        return self._made[lane][0]

    def boxes(self, lane: int) -> Iterator[Box]:
        """Where its bars are seen now."""
        for one in self.placed_of(lane):
            yield one.x + self.moved, one.bottom, one.right + self.moved, one.bottom + one.height, one.bar.key

    # ------------------------------------------------------------------ its layers
    @property
    def lanes(self) -> list[int]:
        """Those that are drawn."""
        return list(self._made)

    def show_lanes(self, seen_from: float, seen_height: float) -> None:
        """Add those in sight that are missing; those out of sight leave."""
        in_sight = self.frame.lanes_in_sight(seen_from, seen_height)
        layers = self._names, self._bars, self._words
        for lane in self._made.keys() - set(in_sight):
            for layer, part in zip(layers, self._made.pop(lane)[1:], strict=True):
                layer.remove(part)
        for lane in in_sight:
            if lane not in self._made:
                found = placed(self.frame, lane)
                name, bars, words = Canvas(), Canvas(), Canvas()
                self._made[lane] = found, name, bars, words
                for layer, part in zip(layers, (name, bars, words), strict=True):
                    layer.add(part)
                with name:
                    paint_name(self.frame, lane)
                with bars:
                    paint_bars(self.frame, found)
                self._word_lane(lane)

    def _word_lane(self, lane: int) -> None:
        bars, *_drawn, words = self._made[lane]
        words.clear()
        with words:
            paint_words(self.frame, bars, self._seen, self._now_at)

    @property
    def _seen(self) -> tuple[float, float]:
        """Left and right end of the visible part, as drawn."""
        return self.frame.left - self.moved, self.frame.right - self.moved

    def draw_axis(self, now: float, now_label: str) -> None:
        """Its labels and those of bars, whole at the edges of the present visible part, and the now-line."""
        self._now_at = self.frame.at(now)
        for lane in self._made:
            self._word_lane(lane)
        for layer in (self._now, self._axis):
            layer.clear()
        with self._now:
            paint_now(self.frame, now, now_label)
        with self._axis:
            paint_axis(self.frame, self._seen, now, now_label)

    def name_day(self, day: str) -> None:
        """At the left edge, above the names."""
        self._corner.clear()
        with self._corner:
            text(day, self.frame.x + dp(12), self.frame.top - dp(AXIS) / 2 + dp(2), tk.ink, font="RobotoMedium")
