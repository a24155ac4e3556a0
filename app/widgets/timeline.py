"""Timeline of the next hours: one lane per robot, a bar per run, the now-line, overlaps and closed time hatched."""
from kivy.metrics import dp
from kivy.properties import ListProperty, NumericProperty, StringProperty

from app.widgets.chart import Chart
from app.widgets.tokens import tk

# state of a bar: (fill, text on it, border)
_BAR_COLOURS = {
    "past": ("track", "ink2", "track"), "failed": ("fault_bg", "fault_on", "fault"),
    "skipped": ("attention_bg", "attention_on", "attention"), "running": ("accent", "accent_ink", "accent"),
    "planned": ("accent_bg", "accent_on", "accent"),
}


class Timeline(Chart):
    """``hours`` hours from the left edge of the axis; all times are floats in hours from there.

    lanes = [{"name", "note", "bars": [{"key", "start", "end", "label", "state"}]}], state: past, failed, skipped, running, planned.
    closed = [(from, to, words)], ticks = [(hour, label, strong)]. Where two bars of one lane overlap, both stay visible and the common
    part is hatched. A tap on a bar (or nearest within a fingertip) fires ``on_bar(key)``.
    """
    lanes = ListProperty()
    closed = ListProperty()
    ticks = ListProperty()
    hours = NumericProperty(24)
    now = NumericProperty(-1)
    now_label = StringProperty()
    lane_height = NumericProperty("44dp")    # least
    wanted_height = NumericProperty(0)       # of all lanes at their least; for a timeline that scrolls
    watch = ("lanes", "closed", "ticks", "now", "now_label", "hours")

    __events__ = ("on_bar",)
    AXIS = 28                                # dp

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self._hits: list[tuple[float, float, float, float, object]] = []

    def on_bar(self, key):
        """A bar was tapped."""

    def on_lanes(self, *_):
        self.wanted_height = dp(self.AXIS) + len(self.lanes) * self.lane_height

    def on_touch_up(self, touch):
        if touch.grab_current is None and self.collide_point(*touch.pos) and not touch.is_mouse_scrolling:
            reach = dp(24)
            near = [(max(x - touch.x, touch.x - x2, 0), key) for x, y, x2, y2, key in self._hits if y - dp(8) <= touch.y <= y2 + dp(8)]
            if near and min(near, key=lambda hit: hit[0])[0] <= reach:
                self.dispatch("on_bar", min(near, key=lambda hit: hit[0])[1])
                return True
        return super().on_touch_up(touch)

    def draw(self):
        self._hits = []
        if not self.lanes:
            return
        names = max(max(self.width_of(lane["name"], 16, "RobotoMedium"), self.width_of(lane.get("note", ""))) for lane in self.lanes)
        self._left = self.x + max(dp(88), min(names + dp(16), self.width * .3))
        self._unit = (self.right - self._left) / self.hours
        axis = dp(self.AXIS)
        height = (self.height - axis) / len(self.lanes)
        self._ground(self.height - axis, height)
        for n, lane in enumerate(self.lanes):
            self._lane(lane, self.top - axis - height * (n + .5), height - dp(16))
        if 0 <= self.now <= self.hours:
            self._now_line()

    def _at(self, hour):
        return self._left + self._unit * min(max(hour, 0), self.hours)

    def _ground(self, height, lane):
        for start, end, _words in self.closed:
            x, width = self._at(start), self._at(end) - self._at(start)
            self.box(x, self.y, width, height, tk.closed)
            self.hatch(x, self.y, width, height, tk.hatch)
        for hour, _label, strong in self.ticks:
            self.box(self._at(hour), self.y, 2 if strong else 1, height, tk.outline if strong else tk.grid)
        self._tick_labels()
        for n in range(len(self.lanes) + 1):
            self.box(self.x, self.y + lane * n, self.width, 1, tk.line)
        for start, end, words in self.closed:
            width = self.width_of(words) + dp(24)
            if words and width <= self._at(end) - self._at(start):
                x, y = (self._at(start) + self._at(end)) / 2, self.y + lane * (len(self.lanes) - .5)
                self.box(x - width / 2, y - dp(13), width, dp(26), tk.surface, dp(13))
                self.text(words, x, y, tk.ink2, ax=.5)

    def _tick_labels(self):
        """As many as fit side by side: the strong ones (a new day) first, and none under the pill of the now-line."""
        y = self.top - dp(self.AXIS) / 2 + dp(2)
        taken = [self._now_pill()] if 0 <= self.now <= self.hours and self.now_label else []
        for hour, label, strong in sorted(self.ticks, key=lambda tick: not tick[2]):
            font = "RobotoMedium" if strong else "Roboto"
            width = self.width_of(label, font=font)
            x = min(max(self._at(hour) - width / 2, self._left), self.right - width)
            if all(x + width + dp(6) <= left or right + dp(6) <= x for left, right in taken):
                taken.append((x, x + width))
                self.text(label, x, y, tk.ink if strong else tk.ink3, font=font)

    def _now_pill(self):
        """Left and right end of the now-line's label."""
        width = self.width_of(self.now_label, 14, "RobotoMedium") + dp(16)
        left = min(max(self._at(self.now) - width / 2, self._left), self.right - width)
        return left, left + width

    def _lane(self, lane, y, height):
        note = lane.get("note", "")
        self.text(lane["name"], self.x, y + (dp(9) if note else 0), tk.ink, 16, font="RobotoMedium")
        self.text(note, self.x, y - dp(10), tk.ink3)
        bars = sorted((bar for bar in lane["bars"] if bar["end"] > 0 and bar["start"] < self.hours), key=lambda bar: bar["start"])
        for bar in bars:
            self._bar(bar, y, height, bars)
        last_end = 0.
        for bar in bars:
            if bar["start"] < last_end:
                x, x2 = self._at(bar["start"]), self._at(min(last_end, bar["end"]))
                self.box(x, y - height / 2, x2 - x, height, tk.attention_bg)
                self.hatch(x, y - height / 2, x2 - x, height, tk.overlap, 6, 2)
                self.box(x, y - height / 2, x2 - x, height, tk.attention, ring=1)
            last_end = max(last_end, bar["end"])

    def _bar(self, bar, y, height, bars):
        x, x2 = self._at(bar["start"]), self._at(bar["end"])
        wide = max(dp(6), x2 - x - 1)
        state = bar.get("state", "planned")
        fill, ink, edge = (getattr(tk, token) for token in _BAR_COLOURS[state])
        bottom = y - height / 2
        self.box(x, bottom, wide, height, fill, dp(4))
        self.box(x, bottom, wide, height, edge, dp(4), ring=1)
        if state == "planned":
            self.box(x, bottom, dp(4), height, tk.accent, (dp(4), 0, 0, dp(4)))
        self._hits.append((x, bottom, x + wide, bottom + height, bar.get("key")))
        label = bar.get("label", "")
        if not label:
            return
        need = self.width_of(label) + dp(16)
        if need <= wide:
            self.text(label, x + dp(10), y, ink)
            return
        follows = [self._at(other["start"]) for other in bars if other["start"] > bar["start"]]
        shut = [self._at(start) for start, *_ in self.closed if self._at(start) > x]
        if x + wide + need <= min([*follows, *shut, self.right]):
            self.text(label, x + wide + dp(6), y, tk.ink2)

    def _now_line(self):
        x = self._at(self.now)
        axis = dp(self.AXIS)
        self.box(x - 1, self.y, 2, self.height - axis, tk.ink)
        if self.now_label:
            left, right = self._now_pill()
            self.box(left, self.top - axis + dp(3), right - left, dp(24), tk.ink, dp(12))
            self.text(self.now_label, (left + right) / 2, self.top - axis / 2 + dp(1), tk.surface, ax=.5, font="RobotoMedium")
