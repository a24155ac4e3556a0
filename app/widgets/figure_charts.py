"""Drawings of the page of figures: ranked bars with a cumulative line, a duration day by day in its usual band, two parts of a whole."""
from kivy.graphics import Color, SmoothLine
from kivy.metrics import dp
from kivy.properties import ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.widgets.chart import Chart
from app.widgets.lists import Row
from app.widgets.surfaces import Toned
from app.widgets.tokens import tk


class RankBar(Chart):
    """One bar of a ranking, ``share`` 0..1. ``cumulative`` >= 0 adds the dot and line of the shares down to here; rows that touch make it
    one line, from the neighbours' ``above`` and ``below`` (-1: there is none)."""
    share = NumericProperty(0)
    cumulative = NumericProperty(-1)
    above = NumericProperty(-1)
    below = NumericProperty(-1)
    tone = StringProperty("accent_mid")
    watch = ("share", "cumulative", "above", "below", "tone")

    def draw(self):
        room, height = self.width - dp(8), dp(16)
        self.box(self.x, self.center_y - height / 2, room, height, tk.track, dp(4))
        if self.share > 0:
            self.box(self.x, self.center_y - height / 2, max(dp(4), room * min(1., self.share)), height, getattr(tk, self.tone), dp(4))
        if self.cumulative < 0:
            return
        x = self.x + room * self.cumulative
        points = [x, self.center_y]
        if self.above >= 0:
            points = [self.x + room * (self.above + self.cumulative) / 2, self.top, *points]
        if self.below >= 0:
            points += [self.x + room * (self.below + self.cumulative) / 2, self.y]
        if len(points) > 2:
            Color(*tk.ink)
            SmoothLine(points=points, width=dp(1.1))
        self.box(x - dp(6), self.center_y - dp(6), dp(12), dp(12), tk.surface, dp(6))
        self.box(x - dp(4), self.center_y - dp(4), dp(8), dp(8), tk.ink, dp(4))


class RankRow(Row, BoxLayout):
    """A reason, its bar, how often; ``note`` under the number."""
    label = StringProperty()
    value = StringProperty()
    note = StringProperty()
    share = NumericProperty(0)
    cumulative = NumericProperty(-1)
    above = NumericProperty(-1)
    below = NumericProperty(-1)


class TrendChart(Chart):
    """``points`` have ``place`` (0..1 from left to right) and ``value``; ``band`` has ``low``, ``middle``, ``high`` of what is usual."""
    points = ListProperty()
    band = ObjectProperty(None, allownone=True)
    tone = StringProperty("neutral")
    watch = ("points", "band", "tone")

    def draw(self):
        band = (self.band.low, self.band.middle, self.band.high) if self.band else ()
        values = [*(point.value for point in self.points), *band]
        if not values:
            return
        low, high = min(values), max(values)
        margin = (high - low) * .08 or 1
        low, span = low - margin, high - low + 2 * margin
        pad = dp(6)
        width, height = self.width - 2 * pad, self.height - 2 * pad

        def at(value):
            return self.y + pad + height * (value - low) / span

        if band:
            bottom, middle, top = map(at, band)
            self.box(self.x, bottom, self.width, max(dp(2), top - bottom), tk.accent_soft, dp(4), alpha=.45)
            for edge in (bottom, top):
                self.box(self.x, edge, self.width, 1, tk.accent)
            for start in range(0, int(self.width), int(dp(10))):             # dashed: from before the period
                self.box(self.x + start, middle - 1, min(dp(6), self.width - start), 2, tk.accent)
        points = [(self.x + pad + width * min(1., max(0., point.place)), at(point.value)) for point in self.points]
        if len(points) > 1:
            Color(*tk.ink2)
            SmoothLine(points=[c for point in points for c in point], width=dp(1))
        colour = tk.attention if self.tone == "attention" else tk.ink
        size = dp(7) if len(points) <= 31 else dp(4)
        for x, y in points:
            self.box(x - size / 2, y - size / 2, size, size, colour, size / 2)


class TrendRow(Row, Toned, BoxLayout):
    """A mission: its name, how long it takes now and usually, and a TrendChart."""
    mission = StringProperty()
    value = StringProperty()
    note = StringProperty()
    count = StringProperty()
    icon = StringProperty()
    points = ListProperty()
    band = ObjectProperty(None, allownone=True)


class PartsBar(Chart):
    """A whole of which ``share`` 0..1 is drawn hatched (waiting) and the rest filled (running)."""
    share = NumericProperty(0)
    watch = ("share",)

    def draw(self):
        self.box(*self.pos, *self.size, tk.accent_mid, dp(4))
        wide = self.width * min(1., self.share)
        if wide > 1:
            self.box(*self.pos, wide, self.height, tk.attention_bg, dp(4) if wide > dp(8) else 0)
            self.hatch(*self.pos, wide, self.height, tk.overlap, 6, 2)
            self.box(*self.pos, wide, self.height, tk.attention, dp(4) if wide > dp(8) else 0, ring=1)


class LineKey(Chart):
    """Legend of a drawn line: ``kind`` "line" with its dot, "band" of what is usual."""
    kind = StringProperty("line")
    watch = ("kind",)

    def draw(self):
        if self.kind == "band":
            self.box(*self.pos, *self.size, tk.accent_soft, dp(3), alpha=.45)
            self.box(*self.pos, *self.size, tk.accent, dp(3), ring=1)
            self.box(self.x, self.center_y - 1, self.width, 2, tk.accent)
            return
        self.box(self.x, self.center_y - 1, self.width, 2, tk.ink)
        self.box(self.center_x - dp(4), self.center_y - dp(4), dp(8), dp(8), tk.ink, dp(4))
