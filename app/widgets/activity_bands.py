"""What robots did over time: a lane for each, of equal height, with the word in each band that has room for it."""

from kivy.metrics import dp, sp
from kivy.properties import ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.widgets.chart import Chart
from app.widgets.charts import PressedChart
from app.widgets.display import LegendItems
from app.widgets.tokens import tk

LEAST_WORD = 80  # dp that a band with a word in it has
LEAST_ICON = 22
# kind: (fill, ink); a hatched one has none
BANDS = {
    "executing": ("accent_mid", "solid_ink"),
    "charging": ("accent_soft", "ink"),
    "idle": ("neutral_bg", "neutral_on"),
    "paused": ("action_solid", "solid_ink"),
    "error": ("fault_solid", "solid_ink"),
}


class ActivityDrawing(Chart):
    """Draws one band."""

    def band(self, kind, x, y, w, h, words=""):
        """What was not seen is hatched; a line: nothing was recorded."""
        fill, ink = BANDS.get(kind, ("surface", "ink2"))
        has_word = words and w >= max(dp(LEAST_WORD), self.width_of(words, 16, "RobotoMedium") + dp(12))
        if kind in BANDS:
            self.box(x, y, w, h, getattr(tk, fill))
            if tk.strong:  # fills alone differ too little there
                self.box(x, y, w, h, tk.ink, ring=1)
        elif kind == "offline":
            self.box(x, y, w, h, tk.surface)
            self.hatch(x, y, w, h, tk.outline)
            self.box(x, y, w, h, tk.outline, ring=1)
            if has_word:
                wide = self.width_of(words, 16, "RobotoMedium") + dp(12)
                self.box(x + (w - wide) / 2, y + h / 2 - sp(12), wide, sp(24), tk.surface)
        else:
            self.box(x, y + h / 2, w, 1, tk.outline)
        if has_word:
            self.text(words, x + w / 2, y + h / 2, getattr(tk, ink), 16, 0.5, font="RobotoMedium")
        elif kind == "error" and w >= dp(LEAST_ICON) and h >= dp(20):
            self.icon("alert", x + w / 2, y + h / 2, tk.solid_ink, 16)


class ActivityBands(PressedChart, ActivityDrawing):
    """``lanes`` have ``key``, ``name``, ``note``, ``spans`` with ``start``, ``end``, ``kind``, ``text``, and ``is_open``: not
    None for the head of a group. ``ticks`` have ``place``, ``strong``. ``mark`` (key of a lane, start, end) frames a band.
    Places are fractions 0..1 of the time.

    A tap on a lane fires ``on_moment(key, place)``, one on a head ``on_head(key)``. They are as high as ``room`` px allows.
    """

    lanes = ListProperty()
    ticks = ListProperty()
    mark = ObjectProperty(None, allownone=True)
    room = NumericProperty(0)
    lane_height = NumericProperty("48sp")
    names_width = NumericProperty(0)  # px that the names take
    wanted_height = NumericProperty(0)
    watch = ("lanes", "ticks", "mark", "lane_height")

    __events__ = ("on_moment", "on_head")

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for name in ("lanes", "room", "width"):
            self.fbind(name, self._measure)

    def on_moment(self, key, place):
        """A lane was tapped there."""

    def on_head(self, key):
        """The head of a group was tapped."""

    def _measure(self, *_):
        has_heads = any(lane.is_open is not None for lane in self.lanes)
        share = self.room / max(1, len(self.lanes))
        self.lane_height = sp(48) if has_heads else min(sp(104), max(sp(60), share))
        self.wanted_height = len(self.lanes) * self.lane_height
        names = [
            max(self.width_of(lane.name, 18, "RobotoMedium"), self.width_of(lane.note, 16))
            for lane in self.lanes
            if lane.is_open is None
        ]
        self.names_width = min(max(names, default=0) + dp(20), self.width * 0.35)

    def pressed(self, part, touch):
        lane, left = part[4], self.x + self.names_width
        if lane.is_open is not None:
            self.dispatch("on_head", lane.key)
        elif touch.x >= left - dp(8):
            place = (touch.x - left) / (self.right - left)
            self.dispatch("on_moment", lane.key, min(1.0, max(0.0, place)))

    def draw(self):
        self.boxes = []
        left, high = self.x + self.names_width, self.lane_height
        for tick in self.ticks:
            x = left + (self.right - left) * tick.place
            self.box(x, self.y, 1, self.height, tk.outline if tick.strong else tk.grid)
        for n, lane in enumerate(self.lanes):
            y = self.top - high * (n + 1)
            self._head(lane, y) if lane.is_open is not None else self._lane(lane, y, left)
            self.box(self.x, y, self.width, 1, tk.line)
            self.boxes.append((self.x, y, self.width, high, lane))

    def event_of(self, lane):
        return None if lane.is_open is None else ("on_head", lane.key)

    def _head(self, lane, y):
        high = self.lane_height
        self.box(self.x, y, self.width, high, tk.surface2)
        self.icon("chevron-down" if lane.is_open else "chevron-right", self.x + dp(12), y + high / 2, tk.ink2, 20)
        self.text(lane.name, self.x + dp(28), y + high / 2, tk.ink, 18, font="RobotoMedium")
        self.text(lane.note, self.right, y + high / 2, tk.ink2, 16, 1)

    def _lane(self, lane, y, left):
        high, middle = self.lane_height, y + self.lane_height / 2
        band = min(dp(56), high - dp(16))
        self.text(lane.name, self.x, middle + (sp(11) if lane.note else 0), tk.ink, 18, font="RobotoMedium")
        self.text(lane.note, self.x, middle - sp(12), tk.ink2, 16)
        for span in lane.spans:
            x, x2 = (round(left + (self.right - left) * place) for place in (span.start, span.end))
            least = dp(2) if span.kind == "error" else 1
            self.band(span.kind, x, middle - band / 2, max(least, x2 - x), band, span.text)
        if self.mark is not None and self.mark[0] == lane.key:
            x, x2 = (left + (self.right - left) * place for place in self.mark[1:])
            self.box(
                x - dp(2),
                middle - band / 2 - dp(4),
                max(dp(6), x2 - x + dp(4)),
                band + dp(8),
                tk.ink,
                dp(3),
                ring=dp(2),
            )


class ActivityAxis(Chart):
    """The names of the ``ticks`` above the lanes, which begin ``left`` px from its edge."""

    ticks = ListProperty()
    left = NumericProperty(0)
    watch = ("ticks", "left")

    def draw(self):
        x0, last = self.x + self.left, 0
        for tick in self.ticks:
            width = self.width_of(tick.label, 16)
            x = min(max(x0 + (self.right - x0) * tick.place - width / 2, x0), self.right - width)
            if tick.label and x >= last:
                self.text(tick.label, x, self.center_y, tk.ink2, 16)
                last = x + width + dp(12)


class ActivityKey(ActivityDrawing):
    """The legend's little box of one kind."""

    kind = StringProperty("idle")
    watch = ("kind",)

    def draw(self):
        self.band(self.kind, *self.pos, *self.size)


class ActivityLegend(BoxLayout):
    """A key and its word."""

    kind = StringProperty("idle")
    text = StringProperty()


class LegendFlow(LegendItems):
    """The same of bands."""

    entry = ActivityLegend
