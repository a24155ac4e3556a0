"""One drawing of a timeline's window and of what lies beside it: made once, then only moved.

It is made lane by lane, so that a crowded one can be spread over several frames, and lanes that come into sight are added to it. What the
time moves (the now-line) and what depends on the edges (labels of the axis) is a layer of its own.
"""
from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from kivy.graphics import (
    Canvas,
    Color,
    Mesh,
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

from app.widgets.tokens import tk

if TYPE_CHECKING:
    from app.widgets.timeline import Timeline

# state of a bar: (fill, text on it, border)
_BAR_COLOURS = {
    "past": ("track", "ink2", "track"), "failed": ("fault_bg", "fault_on", "fault"),
    "skipped": ("attention_bg", "attention_on", "attention"), "running": ("accent", "accent_ink", "accent"),
    "planned": ("accent_bg", "accent_on", "accent"),
}
_SOLID = {"past": "ink3", "failed": "fault", "skipped": "attention", "running": "accent", "planned": "accent"}
AXIS = 28                # dp, above the lanes
NARROW = 12              # dp; such bars have no border and are drawn together
DETAILED = 160           # bars in sight with border, label and whisker; of more, those of busy lanes are drawn together
BUSY = 8                 # bars of a lane
BEYOND = .5              # of what is seen, drawn on either side of it
PIECES = 10_000          # bars of one mesh, whose indices have 16 bits

Box = tuple[float, float, float, float, object]      # left, bottom, right, top in px, key of the bar


class Drawing:
    """Of ``chart`` as it is now. ``canvas`` holds it; ``add_lanes`` makes the lanes."""

    def __init__(self, chart: Timeline) -> None:
        self._chart, self._workers, self._closed, self._ticks = chart, chart.lanes, chart.closed, chart.ticks
        self.first, self.hours = chart.first, chart.hours
        self.low, self.high = self.first - self.hours * BEYOND, self.first + self.hours * (1 + BEYOND)     # hours drawn: from, to
        self.x, self.y, self.right, self.top = chart.x, chart.y, chart.right, chart.top
        names = max(max(chart.width_of(lane["name"], 16, "RobotoMedium"), chart.width_of(lane.get("note", ""))) for lane in self._workers)
        self.left = self.x + max(dp(88), min(names + dp(16), chart.width * .3))
        self.unit = (self.right - self.left) / self.hours                                                   # px of an hour
        self.lane_height = (chart.height - dp(AXIS)) / len(self._workers)
        self.moved = 0.                                                                                     # px, since it was made
        self._reach: dict[int, list[dict]] = {}
        self._made: dict[int, tuple[Canvas, Canvas]] = {}                                                   # name and bars of a lane
        self.is_crowded = self.would_be_crowded(chart.seen_from, chart.seen_height)
        self.canvas = Canvas()
        with self.canvas:
            self._draw()

    def _draw(self):
        chart = self._chart
        for n in range(len(self._workers) + 1):
            chart.box(self.x, self.y + self.lane_height * n, self.right - self.x, 1, tk.line)
        self._names = Canvas()
        window = {"pos": (self.left, self.y), "size": (self.right - self.left, self.top - self.y)}
        StencilPush()
        Rectangle(**window)
        StencilUse()
        PushMatrix()
        self._pan = Translate(0, 0)
        self._ground()
        self._bars = Canvas()
        self._axis = Canvas()
        PopMatrix()
        StencilUnUse()
        Rectangle(**window)
        StencilPop()

    # ------------------------------------------------------------------ what is where
    def at(self, hour: float) -> float:
        """Where an hour lies before it is moved, or the end of what is drawn."""
        return self.left + self.unit * (min(max(hour, self.low), self.high) - self.first)

    def is_in_reach(self, start: float, end: float | None = None) -> bool:
        return (start if end is None else end) > self.low and start < self.high

    def bars_of(self, lane: int) -> list[dict]:
        """Those in reach, by their beginning."""
        if lane not in self._reach:
            low, high = self.low, self.high
            self._reach[lane] = sorted((bar for bar in self._workers[lane]["bars"] if bar["end"] > low and bar["start"] < high),
                                       key=lambda bar: bar["start"])
        return self._reach[lane]

    def in_sight(self, seen_from: float, seen_height: float) -> range:
        """All lanes, or of a page that scrolls those that are seen (px from the top) and one on either side."""
        if not seen_height:
            return range(len(self._workers))
        above = int((seen_from - dp(AXIS)) / self.lane_height)
        return range(max(0, above - 1), min(len(self._workers), above + int(seen_height / self.lane_height) + 3))

    def would_be_crowded(self, seen_from: float, seen_height: float) -> bool:
        """Whether there is too much in sight to draw all of it in detail."""
        count = 0
        for lane in self.in_sight(seen_from, seen_height):
            count += len(self.bars_of(lane))
            if count > DETAILED:
                return True
        return False

    def reaches(self, first: float, margin: float = 0.) -> bool:
        """Whether it shows everything that there is from hour ``first`` on, and so many hours around."""
        return (self.low <= first - margin and first + self.hours + margin <= self.high) or self._is_whole

    @property
    def _is_whole(self) -> bool:
        """Whether nothing lies beyond what is drawn."""
        return all(len(self.bars_of(lane)) == len(self._workers[lane]["bars"]) for lane in self._made) and \
            all(self.low - 1 <= hour <= self.high + 1 for hour, *_ in self._ticks)

    def boxes(self, lane: int) -> Iterator[Box]:
        """Where its bars are seen now."""
        y, height, bars = self._middle(lane), self._bar_height, self.bars_of(lane)
        crowd = self._is_crowd(bars)
        for bar in bars:
            x, x2 = self.at(bar["start"]), self.at(bar["end"])
            x2 = max(x2, x + 2) if crowd else x + (max(dp(6), x2 - x - 1) if x2 - x < dp(NARROW) else x2 - x - 1)
            yield x + self.moved, y - height / 2, x2 + self.moved, y + height / 2, bar.get("key")

    def lane_at(self, y: float) -> int:
        """Nearest lane to a height in px."""
        return min(max(int((self.top - dp(AXIS) - y) / self.lane_height), 0), len(self._workers) - 1)

    @property
    def _bar_height(self) -> float:
        return self.lane_height - dp(16)

    def _middle(self, lane: int) -> float:
        return self.top - dp(AXIS) - self.lane_height * (lane + .5)

    def _is_crowd(self, bars: list[dict]) -> bool:
        return self.is_crowded and len(bars) > BUSY

    # ------------------------------------------------------------------ moving
    def move(self, px: float) -> None:
        """To the right."""
        self.moved += px
        self._pan.x = round(self.moved)

    def place(self, first: float) -> None:
        """So that hour ``first`` is at the left."""
        self.move((self.first - first) * self.unit - self.moved)

    # ------------------------------------------------------------------ the lanes
    @property
    def lanes(self) -> list[int]:
        """Those that are drawn."""
        return list(self._made)

    def show_lanes(self, seen_from: float, seen_height: float, most: int) -> bool:
        """Add those in sight that are missing, until ``most`` bars are drawn; those out of sight leave. Returns whether all are there."""
        in_sight = self.in_sight(seen_from, seen_height)
        for lane in [lane for lane in self._made if lane not in in_sight]:
            for layer, part in zip((self._names, self._bars), self._made.pop(lane), strict=True):
                layer.remove(part)
        drawn = 0
        for lane in in_sight:
            if lane not in self._made:
                if drawn >= most:
                    return False
                self._made[lane] = self._lane(lane)
                drawn += len(self.bars_of(lane))
        return True

    def _lane(self, lane: int) -> tuple[Canvas, Canvas]:
        with self._names:
            name = Canvas()
        with name:
            self._name(self._workers[lane], self._middle(lane))
        with self._bars:
            bars = Canvas()
        with bars:
            self._draw_bars(self.bars_of(lane), self._middle(lane), self._bar_height)
        return name, bars

    def _name(self, lane, y):
        note = lane.get("note", "")
        self._chart.text(lane["name"], self.x, y + (dp(9) if note else 0), tk.ink, 16, font="RobotoMedium")
        self._chart.text(note, self.x, y - dp(10), tk.ink3)

    def _draw_bars(self, bars, y, height):
        if self._is_crowd(bars):
            self._crowd(bars, y, height)
            return
        narrow: dict[str, list[tuple[float, float]]] = {}
        hollow: list[tuple[float, float]] = []
        starts = [self.at(bar["start"]) for bar in bars]
        shut = [self.at(start) for start, *_ in self._closed]
        for n, bar in enumerate(bars):
            x, x2 = starts[n], self.at(bar["end"])
            if x2 - x < dp(NARROW):
                wide = max(dp(6), x2 - x - 1)
                narrow.setdefault(bar.get("state", "planned"), []).append((x, x + wide))
                if bar.get("assumed"):
                    hollow.append((x + dp(1.5), x + wide - dp(1.5)))
            else:
                wide = self._wide_bar(bar, x, x2, y, height)
            if not bar.get("label"):
                continue
            ends = max(x + wide, self.at(bar.get("late", bar["end"])))
            following = min((start for start in starts[n + 1:n + 2] if start > x), default=self.at(1e9))
            self._label(bar, x, wide, ends, y, min([following, *(left for left in shut if left > x)]))
        for state, spans in narrow.items():
            _mesh(spans, y, height, getattr(tk, _SOLID[state]))
        _mesh(hollow, y, height - dp(3), tk.surface)
        self._overlaps(bars, y, height)

    def _crowd(self, bars, y, height):
        """So many that only where there are some can be seen: few drawings, whatever their number, so that a finger can drag them."""
        taken: dict[str, list[tuple[float, float]]] = {}
        shared: list[tuple[float, float]] = []
        origin, unit, low, high = self.left - self.unit * self.first, self.unit, self.low, self.high
        last_end = None
        for bar in bars:
            start, end = bar["start"], bar["end"]
            x = origin + unit * (start if start > low else low)
            x2 = max(origin + unit * (end if end < high else high), x + 2)
            _join(taken.setdefault(bar.get("state", "planned"), []), x, x2)
            if last_end is not None and x < last_end - 1:
                _join(shared, x, min(x2, last_end))
            elif bar.get("overlaps"):
                _join(shared, x, x2)
            if last_end is None or x2 > last_end:
                last_end = x2
        for state, spans in taken.items():
            _mesh(spans, y, height, getattr(tk, _SOLID[state]))
        _mesh(shared, y, height / 2, tk.overlap)

    def _wide_bar(self, bar, x, x2, y, height):
        chart, wide, bottom = self._chart, x2 - x - 1, y - height / 2
        state = bar.get("state", "planned")
        fill, ink, edge = (getattr(tk, token) for token in _BAR_COLOURS[state])
        if (late := self.at(bar.get("late", bar["end"]))) > x2 + dp(2):
            chart.box(x2, y - dp(1), late - x2, dp(2), edge)
            chart.box(late - dp(2), y - dp(6), dp(2), dp(12), edge)
        chart.box(x, bottom, wide, height, tk.surface if bar.get("assumed") else fill, dp(4))
        chart.box(x, bottom, wide, height, edge, dp(4), ring=1)
        if bar.get("typed"):                     # a frame in the frame; fills are solid in high contrast
            chart.box(x + dp(3), bottom + dp(3), wide - dp(6), height - dp(6), ink if tk.strong else edge, dp(2), ring=1)
        if state == "planned":
            chart.box(x, bottom, dp(4), height, tk.accent, (dp(4), 0, 0, dp(4)))
        return wide

    def _label(self, bar, x, wide, ends, y, room_ends):
        """In the bar, or beside it where nothing follows too soon."""
        label = bar["label"]
        need = self._chart.width_of(label) + dp(16)
        if need <= wide:
            ink = tk.ink2 if bar.get("assumed") else getattr(tk, _BAR_COLOURS[bar.get("state", "planned")][1])
            self._chart.text(label, x + dp(10), y, ink)
        elif ends + need <= min(room_ends, self.right if self.first <= bar["start"] <= self.first + self.hours else 1e9):
            self._chart.text(label, ends + dp(6), y, tk.ink2)

    def _overlaps(self, bars, y, height):
        chart, last_end = self._chart, None
        for bar in bars:
            if bar.get("overlaps"):
                x, x2 = self.at(bar["start"]), self.at(bar["end"])
                chart.hatch(x, y - height / 2, x2 - x, height, tk.overlap, 6, 2)
            if last_end is not None and bar["start"] < last_end:
                x, x2 = self.at(bar["start"]), self.at(min(last_end, bar["end"]))
                if x2 - x >= 2:
                    chart.box(x, y - height / 2, x2 - x, height, tk.attention_bg)
                    chart.hatch(x, y - height / 2, x2 - x, height, tk.overlap, 6, 2)
                    chart.box(x, y - height / 2, x2 - x, height, tk.attention, ring=1)
            last_end = bar["end"] if last_end is None else max(last_end, bar["end"])

    # ------------------------------------------------------------------ what is behind them
    def _ground(self):
        chart, height = self._chart, self.top - dp(AXIS) - self.y
        closed = [span for span in self._closed if self.is_in_reach(*span[:2])]
        for start, end, _words in closed:
            x, width = self.at(start), self.at(end) - self.at(start)
            chart.box(x, self.y, width, height, tk.closed)
            chart.hatch(x, self.y, width, height, tk.hatch)
        for hour, _label, strong in self._ticks:
            if self.is_in_reach(hour):
                chart.box(self.at(hour), self.y, 2 if strong else 1, height, tk.outline if strong else tk.grid)
        for start, end, words in closed:
            left, right = max(self.left, self.at(start)), min(self.right, self.at(end))
            width = chart.width_of(words) + dp(24)
            if words and width <= right - left:
                x, y = (left + right) / 2, self.y + self.lane_height * (len(self._workers) - .5)
                chart.box(x - width / 2, y - dp(13), width, dp(26), tk.surface, dp(13))
                chart.text(words, x, y, tk.ink2, ax=.5)

    # ------------------------------------------------------------------ the axis and the time
    def draw_axis(self, now: float, now_label: str) -> None:
        """Its labels, whole at the edges of what is seen now, and the now-line."""
        self._axis.clear()
        seen = self.left - self._pan.x, self.right - self._pan.x
        pill = self._pill(now, now_label, seen) if self.is_in_reach(now) and now_label else None
        with self._axis:
            self._tick_labels(seen, pill)
            if self.is_in_reach(now):
                self._now_line(self.at(now), pill, now_label)

    def _tick_labels(self, seen, pill):
        """As many as fit side by side: the strong ones (a new day) first, and none under the pill of the now-line. Those that are seen stay
        whole at the ends."""
        chart, y = self._chart, self.top - dp(AXIS) / 2 + dp(2)
        taken = [pill] if pill else []
        for hour, label, strong in sorted(self._ticks, key=lambda tick: not tick[2]):
            if not label or not self.is_in_reach(hour):
                continue
            font = "RobotoMedium" if strong else "Roboto"
            width = chart.width_of(label, font=font)
            left = _kept_in(self.at(hour), width, seen)
            if all(left + width + dp(6) <= begins or ends + dp(6) <= left for begins, ends in taken):
                taken.append((left, left + width))
                chart.text(label, left, y, tk.ink if strong else tk.ink3, font=font)

    def _pill(self, now, now_label, seen):
        """Left and right end of the now-line's label."""
        width = self._chart.width_of(now_label, 14, "RobotoMedium") + dp(16)
        left = _kept_in(self.at(now), width, seen)
        return left, left + width

    def _now_line(self, x, pill, now_label):
        chart = self._chart
        chart.box(x - 1, self.y, 2, self.top - dp(AXIS) - self.y, tk.ink)
        if pill:
            left, right = pill
            chart.box(left, self.top - dp(AXIS) + dp(3), right - left, dp(24), tk.ink, dp(12))
            chart.text(now_label, (left + right) / 2, self.top - dp(AXIS) / 2 + dp(1), tk.surface, ax=.5, font="RobotoMedium")


def _kept_in(x: float, width: float, seen: tuple[float, float]) -> float:
    """Left end of something ``width`` px wide around x, which is not cut by an edge as long as x is seen."""
    left, right = seen
    return min(max(x - width / 2, left), right - width) if left <= x <= right else x - width / 2


def _join(spans, x, x2):
    """Add a span to those before it, which it may touch."""
    if spans and x <= spans[-1][1] + 1:
        if x2 > spans[-1][1]:
            spans[-1] = spans[-1][0], x2
    else:
        spans.append((x, x2))


def _mesh(spans, y, height, colour):
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
