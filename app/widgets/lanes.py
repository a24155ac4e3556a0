"""Robots' time: one lane per robot, a bar per run, the now-line, closed time hatched. A finger drags it along."""

import math
from collections.abc import Iterator

from kivy.clock import Clock
from kivy.metrics import dp
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.widget import Widget

from app.widgets.chart import Chart
from app.widgets.lanes_bars import paint_lifted
from app.widgets.lanes_drawing import Box, Drawing
from app.widgets.lanes_frame import AXIS, LEAST_LANE, Frame
from app.widgets.places import places
from app.widgets.rest import rest
from app.widgets.scrolling import WHEEL, sideways

SLOP = 12  # dp that a finger moves before it drags
MOST_SEATS = 40  # of bars of a lane
LONG = 0.5  # s until a press is a long one
STEP = 1 / 12  # hours between times that fingers choose


class Lanes(Chart):
    """Shows ``hours`` hours from hour ``first`` on; all times are floats in hours from one common instant.

    Of a lane it reads ``key``, ``name``, ``note``, ``icon`` with its ``tone``, ``bars`` and ``overlaps`` [(from, to)];
    or ``line``, words for the lanes that it represents, and whether they are shown (``is_open``): a tap fires
    ``on_lane(key)``. Of a bar ``key``, ``start``, ``end``, ``label``, ``shorter`` (shorter labels, the best first),
    ``state`` (a key of ``lanes_frame.TOKENS``) and ``movable`` (by a finger). bands = [(from, to, words, kind)], which
    are "closed", "folded" (a break of any length) or "held"; ticks = [(hour, label, strong)]. Lanes share the height,
    as far as they need it.

    A tap on a bar (or nearest within a fingertip) fires ``on_bar(key)``; one
    on closed time ``on_fold(hour)``; one on free time ``on_free(lane's key, hour)``; a finger that takes a
    bar to another time ``on_moved(key, hour)``, with ``time_text(hour)`` above it. ``on_window(first)`` is the first
    hour after a finger or a wheel has moved it; ``day_text`` of the first hour that is not folded is above the names. In a
    page that scrolls, ``seen_from`` and ``seen_height`` (px from the top; 0: all) say which lanes need drawing, and
    where the axis is.
    """

    lanes = ListProperty()
    bands = ListProperty()
    ticks = ListProperty()
    hours = NumericProperty(24)
    first = NumericProperty(0)
    now = NumericProperty(-1)
    now_label = StringProperty()
    wanted_height = NumericProperty(0)  # of all lanes at their least; for a timeline that scrolls
    seen_from = NumericProperty(0)
    seen_height = NumericProperty(0)
    time_text = ObjectProperty(str)  # words for an hour
    day_text = ObjectProperty(lambda _hour: "")  # the day of one
    watch = ("lanes", "bands", "ticks", "hours")

    touched = BooleanProperty(False)  # a finger moves it, or a bar, just now
    keeps_drag = property(lambda self: self.touched)  # from a page around it
    stands = True
    meaning = property(lambda self: [lane.key for lane in self.lanes])
    __events__ = ("on_bar", "on_window", "on_fold", "on_free", "on_moved", "on_lane")

    def __init__(self, **kwargs):
        self._touch = self._meant = None  # a finger, and what is under it: an event and its values
        self._was = 0.0  # the first hour when it came down
        self._lifted = None  # a bar under it, and when that would begin now
        self._is_long = Clock.create_trigger(self._press_long, LONG)
        self._drawing: Drawing | None = None
        self._place_soon = Clock.create_trigger(self._place, -1)
        super().__init__(**kwargs)
        places.watch(self, "lanes")
        self.bind(first=self._place_soon, now=self._place_soon, now_label=self._place_soon)
        self.bind(seen_from=self._scrolled, seen_height=self._scrolled)

    def on_lanes(self, *_):
        self.wanted_height = dp(AXIS) + len(self.lanes) * dp(LEAST_LANE)

    # ------------------------------------------------------------------ a finger
    def on_touch_down(self, touch):
        if super().on_touch_down(touch):
            return True  # a button on it
        if self._drawing is None or self._touch or not self.collide_point(*touch.pos):
            return False
        if touch.is_mouse_scrolling:
            return self._turn(sideways(touch))
        if not places.misses(self, touch):
            touch.grab(self)
            self._touch, self._meant, self._was = touch, self._event_at(touch.ox, touch.oy), self.first
            self._is_long()
        return True

    def on_touch_move(self, touch):
        if touch.grab_current is not self or self._drawing is None or places.is_another(self, touch):
            return super().on_touch_move(touch)
        dx, dy = touch.x - touch.ox, touch.y - touch.oy
        if not _is_tap(touch):
            self._is_long.cancel()
        if self._lifted is not None:
            self._lift(dx)
        elif self.touched or abs(dx) >= max(dp(SLOP), abs(dy)):
            self.touched = True
            self._go(self._was, -dx)
        return True

    def on_touch_up(self, touch):
        if touch.grab_current is not self:
            return super().on_touch_up(touch)
        touch.ungrab(self)
        self._is_long.cancel()
        lifted, is_dragged = self._lifted, self.touched and self._lifted is None
        if is_dragged:
            self.dispatch("on_window", self.first)
        self._touch = self._lifted = None
        self.touched = False
        self.canvas.after.clear()
        self._place_soon()  # labels at the edges come whole again
        if places.is_another(self, touch):
            return True
        if lifted is not None and lifted[1] != lifted[0].bar.start:
            self.dispatch("on_moved", lifted[0].bar.key, lifted[1])
        elif self._meant is not None and (lifted is not None or (_is_tap(touch) and not is_dragged)):
            rest.after_moving()  # a second tap at once is the same
            self.dispatch(*self._meant)
        return True

    def _go(self, hour, far):
        """To ``far`` px to the right of where that hour is the first."""
        self.first = self._drawing.frame.hour_at(self._drawing.frame.at(hour) + far)

    def _turn(self, notches) -> bool:
        """A wheel is turned."""
        if notches:
            self._go(self.first, notches * dp(WHEEL))
            self.dispatch("on_window", self.first)
        return bool(notches)

    def _press_long(self, _dt):
        """Lift the bar under the finger, if that may be moved."""
        drawing = self._drawing
        bars = (one for lane in drawing.lanes for one in drawing.placed_of(lane)) if drawing is not None else ()
        one = next((one for one in bars if one.bar.movable and self._meant == ("on_bar", one.bar.key)), None)
        if one is not None and not places.is_another(self, self._touch):
            self.touched = True
            self._lifted = one, one.bar.start
            self._lift(0)

    def _lift(self, dx):
        """Draw the bar as far from its place as the finger is, with the time at which it would begin."""
        frame, (one, _hour) = self._drawing.frame, self._lifted
        was = self.left_of(one.bar.start)
        hour = one.bar.start if abs(dx) < dp(SLOP) else self._time_at(max(frame.left, min(was + dx, frame.right)))
        self._lifted = one, hour
        self.canvas.after.clear()
        with self.canvas.after:
            paint_lifted(frame, one, was, self.left_of(hour), self.time_text(hour))

    # ------------------------------------------------------------------ which time is where
    def left_of(self, hour) -> float:
        """Where an hour is seen."""
        return self._drawing.frame.at(hour) + self._drawing.moved

    def hour_at(self, x) -> float:
        """What is seen there."""
        return self._drawing.frame.hour_at(x - self._drawing.moved)

    def _time_at(self, x) -> float:
        return round(self.hour_at(x) / STEP) * STEP

    # ------------------------------------------------------------------ where bars are
    def boxes(self) -> Iterator[Box]:
        """The places of the bars drawn for the visible part."""
        if self._drawing is not None:
            for lane in self._drawing.lanes:
                yield from self._drawing.boxes(lane)

    def seats(self) -> list[Widget]:
        """Places that keys can reach: visible bars, breaks, lines of several lanes. A lane's first bar that has not
        ended is a tab stop."""
        drawing, wanted = self._drawing, {}
        if drawing is None:
            return []
        frame = drawing.frame
        folds = [
            ("on_fold", start, (self.left_of(start), self.left_of(end)))
            for start, end, _, kind in self.bands
            if kind == "folded"
        ]
        for n in sorted(drawing.lanes):
            lane, bottom = frame.lanes[n], frame.middle(n) - frame.bar_height / 2
            seen = [box for box in drawing.boxes(n) if box[2] > frame.left and box[0] < frame.right]
            bars = [("on_bar", key, (left, right)) for left, _bottom, right, _top, key in seen[:MOST_SEATS]]
            found = [("on_lane", lane.key, (frame.x, frame.right))] if lane.line else bars + folds
            ahead = self.left_of(self.now)
            for event, key, (left, right) in found:
                left, right = max(left, frame.left if event != "on_lane" else frame.x), min(right, frame.right)
                if left < right and (n, event, key) not in wanted:
                    is_stop = right > ahead and event != "on_fold"
                    ahead = math.inf if is_stop else ahead
                    wanted[n, event, key] = (event, key), (left, bottom), (right - left, frame.bar_height), is_stop
        return self.seats_at(wanted)

    def spot_of(self, lane, hour, size) -> tuple[float, float]:
        """Where something of that size stands in the lane of that key, at an hour."""
        n = next((n for n, each in enumerate(self.lanes) if each.key == lane), None)
        if n is None or self._drawing is None:
            return self.pos
        frame = self._drawing.frame
        return max(frame.left, min(self.left_of(hour), frame.right - size[0])), frame.middle(n) - size[1] / 2

    def place_of(self, key) -> Widget:
        """An anchor with a bar's size and visible place, for a card; for a removed bar, the timeline itself."""
        for left, bottom, right, top, other in self.boxes():
            if other == key:
                left, right = max(left, self._drawing.frame.left), min(right, self.right)
                x, y = self.to_window(left, bottom)
                return Widget(pos=(x, y), size=(max(0, right - left), top - bottom))
        return self

    def _event_at(self, x, y):
        """The event of a tap there, or None: on the axis, or nothing. A break is as narrow as a fingertip, and bars may be on both sides of
        it."""
        frame = self._drawing.frame
        if not frame.bottom <= y < frame.bottom_of_axis - self.seen_from:
            return None
        lane = frame.lanes[frame.lane_at(y)]
        if lane.line:
            return "on_lane", lane.key
        hour = self.hour_at(x) if x >= frame.left else math.inf
        closed = next((kind for start, end, _words, kind in self.bands if kind != "held" and start <= hour < end), "")
        if closed != "folded" and (bar := self._bar_near(x, y)) is not None:
            return "on_bar", bar[4]
        if closed:
            return "on_fold", hour
        return ("on_free", lane.key, self._time_at(x)) if x >= frame.left else None

    def _bar_near(self, x, y) -> Box | None:
        """Of the bars within a fingertip the nearest one, the uppermost of several."""
        reach, slack = dp(24), dp(8)
        boxes = (
            box
            for box in reversed([*self.boxes()])
            if box[0] - reach <= x <= box[2] + reach and box[1] - slack <= y <= box[3] + slack
        )
        return min(
            boxes, key=lambda box: (max(box[0] - x, x - box[2], 0), max(box[1] - y, y - box[3], 0)), default=None
        )

    # ------------------------------------------------------------------ drawing
    def _redraw(self, *_):
        """Only the drawing: a button may be on it."""
        if self._drawing is not None:
            self.canvas.remove(self._drawing.canvas)
            self._drawing = None
        if self.lanes and self.width > 4 and self.height > 4:
            day = self._day()
            self._drawing = Drawing(Frame(self, day))
            self.canvas.insert(0, self._drawing.canvas)
            self._drawing.name_day(day)
            self._drawing.draw_axis(self.now, self.now_label)
            self._scrolled()

    def _day(self) -> str:
        """That of the first time that is shown: a break at the left edge is not."""
        ends = (end for start, end, _words, kind in self.bands if kind == "folded" and start <= self.first < end)
        return self.day_text(next(ends, self.first))

    def _place(self, *_):
        """Hour ``first`` at the left."""
        if (drawing := self._drawing) is not None:
            drawing.move(self.first)
            drawing.name_day(self._day())
            if not self.touched:
                drawing.draw_axis(self.now, self.now_label)

    def _scrolled(self, *_):
        """Other lanes are in sight."""
        if self._drawing is not None:
            self._drawing.pin(self.seen_from)
            self._drawing.show_lanes(self.seen_from, self.seen_height)


def _is_tap(touch) -> bool:
    return max(abs(touch.x - touch.ox), abs(touch.y - touch.oy)) < dp(SLOP)
