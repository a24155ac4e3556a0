"""Outcomes per day."""
from kivy.metrics import dp
from kivy.properties import ListProperty

from app.widgets.chart import Chart, nice_step
from app.widgets.tokens import tk

OUTCOME_SERIES = ("accent_mid", "attention_solid", "fault_solid", "neutral_solid")   # completed, skipped, failed, cancelled


class StackedBars(Chart):
    """One column per day: ``days`` = [(label, value, value, …), …], as many values as ``series`` has tokens; the last day is today."""
    days = ListProperty()
    series = ListProperty(OUTCOME_SERIES)
    watch = ("days", "series")

    def draw(self):
        if not self.days:
            return
        top = max(1, *(sum(day[1:]) for day in self.days))
        step = nice_step(top)
        left = self.width_of(str(int(top) // step * step)) + dp(12)
        bottom = dp(22)
        width, height = self.width - left, self.height - bottom - dp(8)
        x0, y0 = self.x + left, self.y + bottom
        for value in range(0, int(top) + 1, step):
            y = y0 + height * value / top
            self.box(x0, y, width, 1, tk.grid)
            self.text(str(value), x0 - dp(8), y, tk.ink3, ax=1)
        slot = width / len(self.days)
        widest = max(self.width_of(day[0], font="RobotoMedium") for day in self.days) + dp(6)
        every = max(1, -int(-widest // slot))           # names of days, as many as fit
        for n, (label, *values) in enumerate(self.days):
            self._column(x0 + slot * n, y0, slot, height / top, values)
            last = n == len(self.days) - 1
            if (len(self.days) - 1 - n) % every == 0:
                self.text(label, x0 + slot * (n + .5), self.y + dp(8), tk.ink if last else tk.ink3, ax=.5,
                          font="RobotoMedium" if last else "Roboto")

    def _column(self, x, y, slot, unit, values):
        width = min(dp(28), slot * .62)
        x += (slot - width) / 2
        parts = [(value, token) for value, token in zip(values, self.series, strict=False) if value]
        for k, (value, token) in enumerate(parts):
            height = max(dp(3), unit * value)
            gap = 1 if k else 0
            corners = (dp(4), dp(4), 0, 0) if k == len(parts) - 1 else 0
            self.box(x, y + gap, width, height - gap, getattr(tk, token), corners)
            if tk.strong:                # amber on white has no edge of its own
                self.box(x, y + gap, width, height - gap, tk.ink, corners, ring=dp(1))
            y += height
