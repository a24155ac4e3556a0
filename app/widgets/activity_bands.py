"""What robots did over time: a band per robot. Kinds of activity differ in height and pattern too, never in colour alone."""

from kivy.metrics import dp
from kivy.properties import ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.widgets.chart import Chart
from app.widgets.display import LegendItems
from app.widgets.tokens import tk

MIN_ICON_WIDTH = 22  # dp that an icon in a span needs


class ActivityDrawing(Chart):
    """Draws one span of an activity in a box."""

    def span(self, kind, x, y, w, h):
        """Full height: at work or in trouble; low: idle; a line: nothing was recorded."""
        if kind == "executing":
            self.box(x, y, w, h, tk.accent)
        elif kind == "charging":
            self.box(x, y, w, h, tk.accent_soft)
            self.box(x, y, w, h, tk.accent, ring=1)
        elif kind == "idle":
            self.box(x, y, w, h * 0.4, tk.track)
            self.box(x, y + h * 0.4 - 1, w, 1, tk.outline)
        elif kind == "paused":
            self.box(x, y, w, h, tk.attention_bg)
            self.hatch(x, y, w, h, tk.overlap, 6, 2)
            self.box(x, y, w, h, tk.attention, ring=1)
        elif kind == "error":
            self.box(x, y, w, h, tk.fault_solid)
            if w >= dp(MIN_ICON_WIDTH) and h >= dp(16):
                self.icon("alert", x + w / 2, y + h / 2, tk.solid_ink, 16)
        elif kind == "offline":
            self.box(x, y, w, h, tk.closed)
            self.hatch(x, y, w, h, tk.outline)
            self.box(x, y, w, h, tk.outline, ring=1)
            if w >= dp(MIN_ICON_WIDTH) * 1.6 and h >= dp(16):
                self.box(x + w / 2 - dp(10), y + h / 2 - dp(10), dp(20), dp(20), tk.surface, dp(10))
                self.icon("wifi-off", x + w / 2, y + h / 2, tk.offline, 16)
        else:
            self.box(x, y, w, 1, tk.outline)


class ActivityBands(ActivityDrawing):
    """``lanes`` have ``key``, ``name``, ``note`` and ``spans`` with ``start``, ``end``, ``kind``; ``ticks`` have ``place``, ``label``,
    ``strong``; ``mark`` with ``key``, ``start``, ``end`` draws a frame around a span. Places are fractions 0..1 of the period.

    A tap fires ``on_moment(key, place)``.
    """

    lanes = ListProperty()
    ticks = ListProperty()
    mark = ObjectProperty(None, allownone=True)
    lane_height = NumericProperty("64sp")
    wanted_height = NumericProperty(0)
    watch = ("lanes", "ticks", "mark")

    __events__ = ("on_moment",)
    AXIS = 28  # dp

    def __init__(self, **kwargs):
        self._places: list[tuple[float, float, object]] = []  # bottom, top, key
        self._left, self._room = 0.0, 1.0
        super().__init__(**kwargs)

    def on_moment(self, key, place):
        """A band was tapped there."""

    def on_lanes(self, *_):
        self.wanted_height = dp(self.AXIS) + len(self.lanes) * self.lane_height

    def on_touch_down(self, touch):
        if self.collide_point(*touch.pos) and not touch.is_mouse_scrolling:
            touch.ud[self.uid] = touch.pos
        return super().on_touch_down(touch)

    def on_touch_up(self, touch):
        began = touch.ud.get(self.uid)
        if touch.grab_current is None and began and max(abs(touch.x - began[0]), abs(touch.y - began[1])) < dp(12):
            for bottom, top, key in self._places:
                if bottom <= touch.y <= top and touch.x >= self._left - dp(8):
                    self.dispatch("on_moment", key, min(1.0, max(0.0, (touch.x - self._left) / self._room)))
                    return True
        return super().on_touch_up(touch)

    def draw(self):
        self._places = []
        if not self.lanes:
            return
        names = max(max(self.width_of(lane.name, 16, "RobotoMedium"), self.width_of(lane.note)) for lane in self.lanes)
        self._left = self.x + min(names + dp(16), self.width * 0.35)
        self._room = self.right - self._left
        axis = dp(self.AXIS)
        height = (self.height - axis) / len(self.lanes)
        self._axis(self.height - axis)
        for n, lane in enumerate(self.lanes):
            top = self.top - axis - height * n
            self.box(self.x, top, self.width, 1, tk.line)
            self._places.append((top - height, top, lane.key))
            self._lane(lane, top - height / 2, min(height - dp(20), dp(40)))

    def _axis(self, height):
        y, last = self.top - dp(self.AXIS) / 2 + dp(2), self._left - dp(6)
        for tick in self.ticks:
            x = self._left + self._room * tick.place
            self.box(x, self.y, 1, height, tk.outline if tick.strong else tk.grid)
            width = self.width_of(tick.label)
            left = min(max(x - width / 2, self._left), self.right - width)
            if tick.label and left >= last + dp(6):
                self.text(tick.label, left, y, tk.ink2 if tick.strong else tk.ink3)
                last = left + width

    def _lane(self, lane, y, height):
        self.text(lane.name, self.x, y + (dp(10) if lane.note else 0), tk.ink, 16, font="RobotoMedium")
        self.text(lane.note, self.x, y - dp(11), tk.ink3)
        bottom = y - height / 2
        for span in lane.spans:
            x, x2 = round(self._left + self._room * span.start), round(self._left + self._room * span.end)
            self.span(span.kind, x, bottom, max(dp(2) if span.kind == "error" else 1, x2 - x), height)
        if self.mark is not None and self.mark.key == lane.key:
            x, x2 = self._left + self._room * self.mark.start, self._left + self._room * self.mark.end
            self.box(x - dp(2), bottom - dp(4), max(dp(6), x2 - x + dp(4)), height + dp(8), tk.ink, dp(3), ring=dp(2))


class ActivityKey(ActivityDrawing):
    """The legend's little box of one kind."""

    kind = StringProperty("idle")
    watch = ("kind",)

    def draw(self):
        self.span(self.kind, *self.pos, *self.size)


class ActivityLegend(BoxLayout):
    """A key and its word."""

    kind = StringProperty("idle")
    text = StringProperty()


class LegendFlow(LegendItems):
    """The same of bands."""

    entry = ActivityLegend
