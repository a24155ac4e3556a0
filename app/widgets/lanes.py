"""Robots' time: one lane per robot, a bar per run, the now-line, closed time hatched.

A finger drags it along, two fingers zoom. The ``Drawing`` extends beyond the visible part and is only moved while it
covers it.
"""

import math
from collections.abc import Iterator

from kivy.clock import Clock
from kivy.metrics import dp
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.widget import Widget

from app.widgets.chart import Chart, KeySeat
from app.widgets.lanes_bars import paint_lifted
from app.widgets.lanes_drawing import Box, Drawing
from app.widgets.lanes_frame import AXIS, FOLD, LEAST_LANE, Frame
from app.widgets.places import places

NEAR_END = 0.15  # of the visible part: this close to the end of a drawing a new one is begun
SLOP = 12  # dp that a finger moves before it drags
MOST_SEATS = 40  # of bars of a lane
LONG = 0.5  # s until a press is a long one
SECOND_TAP = 0.28  # s after a tap in which another counts as the same: the finger is then on what it opened or moved
STEP = 1 / 12  # hours between times that fingers choose
LEAST_HOURS, MOST_HOURS = 6, 168


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
    bar to another time ``on_moved(key, hour)``, with ``time_text(hour)`` above it. ``on_window(first, hours)`` is the
    visible part after fingers have moved it; ``day_text`` of the first hour that is not folded is above the names. In a
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

    touched = BooleanProperty(False)  # fingers move it just now
    takes_at_once = True  # of a page that scrolls: one of two fingers would come late
    stands = True
    meaning = property(lambda self: [lane.key for lane in self.lanes])
    __events__ = ("on_bar", "on_window", "on_fold", "on_free", "on_moved", "on_lane")

    def __init__(self, **kwargs):
        self._fingers: dict[object, tuple[float, float]] = {}  # uid of a touch: where it is
        self._moved = self._may_tap = False  # a single finger that has not moved
        self._meant = None  # what is under it: an event and its values
        self._answered = -SECOND_TAP  # when a tap was
        self._lifted = None  # a bar under a finger, where it was, and when it would begin now
        self._is_long = Clock.create_trigger(self._press_long, LONG)
        self._drawing: Drawing | None = None
        self._place_soon = Clock.create_trigger(self._place, -1)
        super().__init__(**kwargs)
        places.watch(self, "lanes")
        self.bind(first=self._place_soon, now=self._place_soon, now_label=self._place_soon)
        self.bind(seen_from=self._scrolled, seen_height=self._scrolled)

    def on_lanes(self, *_):
        self.wanted_height = dp(AXIS) + len(self.lanes) * dp(LEAST_LANE)

    # ------------------------------------------------------------------ fingers
    @property
    def keeps_drag(self) -> bool:
        """A vertical drag belongs to the page around it, unless fingers are already in use here."""
        return self._moved or len(self._fingers) > 1

    def on_touch_down(self, touch):
        if any(child.collide_point(*touch.pos) for child in self.children if not isinstance(child, KeySeat)):
            return super().on_touch_down(touch)
        if (
            self.collide_point(*touch.pos)
            and not touch.is_mouse_scrolling
            and len(self._fingers) < (1 if self._lifted else 2)
            and not places.misses(self, touch)
        ):
            self._is_long.cancel()
            self._may_tap = not self._fingers and Clock.get_time() - self._answered >= SECOND_TAP
            if not self._fingers:
                self._moved = False
                self._meant = self._event_at(*touch.pos)
                self._is_long()
            self._fingers[touch.uid] = touch.pos
            touch.grab(self)
        return super().on_touch_down(touch)

    def on_touch_move(self, touch):
        if touch.grab_current is not self or touch.uid not in self._fingers:
            return super().on_touch_move(touch)
        if self._lifted is not None:
            self._lift(touch.x - touch.ox)
            return True
        if abs(touch.y - touch.oy) >= dp(SLOP):
            self._may_tap = False
            self._is_long.cancel()
        before = dict(self._fingers)
        if not self._moved and abs(touch.x - touch.ox) < max(dp(SLOP), abs(touch.y - touch.oy)):
            return True
        self._is_long.cancel()
        self._moved = self.touched = True
        self._fingers[touch.uid] = touch.pos
        if len(before) == 2:
            self._pinch(
                *(position[0] for position in before.values()), *(position[0] for position in self._fingers.values())
            )
        else:
            self._drag(touch.x - before[touch.uid][0])
        return True

    def on_touch_up(self, touch):
        if touch.grab_current is self:
            touch.ungrab(self)
            self._is_long.cancel()
            self._fingers.pop(touch.uid, None)
            if self._lifted is not None and not self._fingers:
                self._put_down(touch)
            elif not self._fingers:
                self._end_drag()
            return True
        is_tap = touch.grab_current is None and touch.uid in self._fingers and self._may_tap and not self._moved
        if is_tap and self.collide_point(*touch.pos) and self._meant:
            self._answer(*self._meant)
            return True
        return super().on_touch_up(touch)

    def let_go(self, touch):
        """The finger is for something in front now: it neither taps nor rests here, and a bar that it has lifted is where it was."""
        touch.ungrab(self)
        self._is_long.cancel()
        self._fingers.pop(touch.uid, None)
        if self._lifted is not None:
            self._lifted = None
            self.canvas.after.clear()
            self.touched = False
        elif not self._fingers:
            self._end_drag()

    def _end_drag(self):
        """No finger moves the hours now."""
        if self.touched:
            self.dispatch("on_window", self.first, self.hours)
            self.touched = False
            self._place_soon()  # labels at the edges come whole again

    def _answer(self, *event):
        """A tap."""
        self._answered = Clock.get_time()
        self.dispatch(*event)

    # ------------------------------------------------------------------ a finger that rests
    def _press_long(self, _dt):
        """Lift the bar under the touch, if that may be moved."""
        event, key = (self._meant or ("", None))[:2]
        bar = next(
            (bar for lane in self.lanes for bar in lane.bars if event == "on_bar" and bar.key == key and bar.movable),
            None,
        )
        place = next((box for box in self.boxes() if bar is not None and box[4] == bar.key), None)
        if place is not None:
            self._moved = self.touched = True
            self._lifted = bar, place, bar.start
            self._lift(0)

    def _time_at(self, x) -> float:
        return round(self._drawing.frame.hour_at(x - self._drawing.moved) / STEP) * STEP

    def _lift(self, dx):
        """Draw the bar as far from its place as the finger is, with the time at which it would begin."""
        frame, (bar, place, _hour) = self._drawing.frame, self._lifted
        hour = bar.start if abs(dx) < dp(SLOP) else self._time_at(max(frame.left, min(place[0] + dx, frame.right)))
        self._lifted = bar, place, hour
        self.canvas.after.clear()
        with self.canvas.after:
            paint_lifted(frame, bar, place, self.left_of(hour), self.time_text(hour))

    def _put_down(self, touch):
        """Where it was: a slow tap."""
        (bar, _place, hour), self._lifted = self._lifted, None
        self.canvas.after.clear()
        self.touched = False
        if hour != bar.start:
            self.dispatch("on_moved", bar.key, hour)
        elif abs(touch.x - touch.ox) < dp(SLOP):
            self._answer(*self._meant)

    # ------------------------------------------------------------------ where bars are
    def boxes(self) -> Iterator[Box]:
        """The places of the bars drawn for the visible part."""
        if self._drawing is not None:
            for lane in self._drawing.lanes:
                yield from self._drawing.boxes(lane)

    def left_of(self, hour) -> float:
        """Where an hour is seen."""
        return self._drawing.frame.at(hour) + self._drawing.moved

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
            seen = sorted(
                (box for box in drawing.boxes(n) if box[2] > frame.left and box[0] < frame.right),
                key=lambda box: box[0],
            )
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
        """The event of a tap there, or None. A break is as narrow as a fingertip, and bars may be on both sides of
        it."""
        if (lane := self._lane_at(y)) is None:
            return None
        if lane.line:
            return "on_lane", lane.key
        frame = self._drawing.frame
        hour = frame.hour_at(x - self._drawing.moved) if x >= frame.left else math.inf
        closed = next((kind for start, end, _words, kind in self.bands if kind != "held" and start <= hour < end), "")
        if closed != "folded" and (bar := self._bar_near(x, y)) is not None:
            return "on_bar", bar[4]
        if closed:
            return "on_fold", hour
        return ("on_free", lane.key, self._time_at(x)) if x >= frame.left else None

    def _lane_at(self, y):
        """None: the axis, or nothing."""
        frame = self._drawing.frame if self._drawing is not None else None
        if frame is None or not frame.bottom <= y < frame.bottom_of_axis - self.seen_from:
            return None
        return frame.lanes[frame.lane_at(y)]

    def _bar_near(self, x, y) -> Box | None:
        """Of the bars within a fingertip the nearest one, the uppermost of several."""
        reach, slack = dp(24), dp(8)
        lanes = {self._drawing.frame.lane_at(y + slack), self._drawing.frame.lane_at(y - slack)}
        boxes = (
            box
            for lane in lanes
            for box in reversed([*self._drawing.boxes(lane)])
            if box[0] - reach <= x <= box[2] + reach and box[1] - slack <= y <= box[3] + slack
        )
        return min(
            boxes, key=lambda box: (max(box[0] - x, x - box[2], 0), max(box[1] - y, y - box[3], 0)), default=None
        )

    def _drag(self, dx):
        """Move what is drawn; ``first`` follows at once."""
        if self._drawing is None:
            return
        scale = self._drawing.frame.scale
        self.first = scale.hour(scale.drawn(self.first) - dx / self._drawing.frame.unit)
        self._drawing.move(dx)
        if not self._drawing.reaches(self.first, self.hours * NEAR_END):
            self._trigger()

    def _pinch(self, a0, b0, a, b):
        """What was under the fingers stays under them."""
        if self._drawing is None or abs(b0 - a0) < 1 or abs(b - a) < dp(24):
            return
        hours = min(MOST_HOURS, max(LEAST_HOURS, self.hours * abs(b0 - a0) / abs(b - a)))
        frame = self._drawing.frame
        left, width = frame.left, frame.right - frame.left
        before, after = (frame.scale.at(dp(FOLD) * seen / width) for seen in (self.hours, hours))
        held = before.hour(before.drawn(self.first) + ((a0 + b0) / 2 - left) / width * self.hours)
        self.first = after.hour(after.drawn(held) - ((a + b) / 2 - left) / width * hours)
        self.hours = hours

    # ------------------------------------------------------------------ drawing
    def _redraw(self, *_):
        """Only the drawing: a button may be on it."""
        if self._drawing is not None:
            self.canvas.remove(self._drawing.canvas)
            self._drawing = None
        if self.lanes and self.width > 4 and self.height > 4:
            self.draw()

    def draw(self):
        frame = Frame.of(self.lanes, self.bands, self.ticks, self.first, self.hours, self.pos, self.size, self._day())
        self._drawing = Drawing(frame, self.seen_height)
        self.canvas.insert(0, self._drawing.canvas)
        self._scrolled()
        self._drawing.name_day(self._day())
        self._drawing.draw_axis(self.now, self.now_label)

    def _day(self) -> str:
        """That of the first time that is shown: a break at the left edge is not."""
        ends = (end for start, end, _words, kind in self.bands if kind == "folded" and start <= self.first < end)
        return self.day_text(next(ends, self.first))

    def _place(self, *_):
        """Hour ``first`` at the left, unless a new drawing will be made."""
        drawing = self._drawing
        if drawing is None or self._trigger.is_triggered:
            return
        if not drawing.reaches(self.first):
            self._trigger()
            return
        drawing.place(self.first)
        drawing.name_day(self._day())
        if not self.touched:
            drawing.draw_axis(self.now, self.now_label)

    def _scrolled(self, *_):
        """Other lanes are in sight."""
        if self._drawing is not None:
            self._drawing.pin(self.seen_from)
            self._drawing.show_lanes(self.seen_from, self.seen_height)
