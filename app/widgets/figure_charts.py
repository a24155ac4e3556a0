"""The page of figures: cards that explain themselves when tapped, ranked causes, a duration day by day in its usual band."""

from kivy.graphics import Color, SmoothLine
from kivy.metrics import dp, sp
from kivy.properties import ListProperty, ObjectProperty, StringProperty

from app.widgets.chart import Chart
from app.widgets.lists import Row
from app.widgets.sheet import Sheet
from app.widgets.surfaces import Tap, TonedTap
from app.widgets.tokens import tk


class FigureCard(Row, Tap):
    """A figure (with markup: the unit is smaller), how it has changed, and its history as a small chart."""


class FigureSheet(Sheet):
    """What a figure means, and the numbers behind it: ``rows`` are Items."""

    text = StringProperty()
    rows = ListProperty()


class CauseRow(Row, Tap):
    """How often runs failed for a reason, and a bar."""


class TrendChart(Chart):
    """``points`` have ``place`` (0..1 from left to right), ``value`` and ``joined`` (to the one before); ``band`` has
    ``p10_s``, ``p50_s``, ``p90_s`` of the usual values. ``scale`` has the lowest and the highest value, ``days`` the
    first and the last day."""

    points = ListProperty()
    band = ObjectProperty(None, allownone=True)
    tone = StringProperty("neutral")
    scale = ListProperty(["", ""])
    days = ListProperty(["", ""])
    watch = ("points", "band", "tone", "scale", "days")

    def draw(self):
        band = (self.band.p10_s, self.band.p50_s, self.band.p90_s) if self.band else ()
        values = [*(point.value for point in self.points), *band]
        if not values:
            return
        low, span = min(values), max(values) - min(values)
        pad, line = dp(6), sp(20)
        left = self.x + max(map(self.width_of, self.scale)) + dp(8)
        width, bottom, height = self.right - left, self.y + line + pad, self.height - line - pad - sp(10)

        def at(value):
            return bottom + height * ((value - low) / span if span else 0.5)

        for words, value in zip(self.scale, (low, low + span), strict=True) if span else [(self.scale[0], low)]:
            self.text(words, left - dp(8), at(value), tk.ink3, ax=1)
        for n, words in enumerate(self.days):
            self.text(words, left + width * n, self.y + line / 2, tk.ink3, ax=n)
        if band:
            self._band(left, width, *map(at, band))
        points = [
            (left + pad + (width - 2 * pad) * min(1.0, max(0.0, point.place)), at(point.value)) for point in self.points
        ]
        Color(*tk.ink2)
        for before, after, point in zip(points, points[1:], self.points[1:], strict=False):
            if point.joined:  # gaps stay open
                SmoothLine(points=(*before, *after), width=dp(1))
        colour = tk.attention if self.tone == "attention" else tk.ink
        size = dp(7) if len(points) <= 31 else dp(4)
        for x, y in points:
            self.box(x - size / 2, y - size / 2, size, size, colour, size / 2)

    def _band(self, left, width, bottom, middle, top):
        self.box(left, bottom, width, max(dp(2), top - bottom), tk.accent_soft, dp(4), alpha=0.45)
        for edge in (bottom, top):
            self.box(left, edge, width, 1, tk.accent)
        for start in range(0, int(width), int(dp(10))):  # dashed: from before the period
            self.box(left + start, middle - 1, min(dp(6), width - start), 2, tk.accent)


class TrendRow(Row, TonedTap):
    """A mission: its name, how long it takes, and a TrendChart."""
