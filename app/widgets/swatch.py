"""The squares of legends."""

from kivy.metrics import dp
from kivy.properties import OptionProperty

from app.widgets.chart import Chart
from app.widgets.tokens import tk

SWATCHES = (
    "planned",
    "closed",
    "charging",
    "accent",
    "accent_mid",
    "track",
    "attention_solid",
    "fault_solid",
    "neutral_solid",
    "done_solid",
)


class Swatch(Chart):
    """One legend square, drawn like the thing it explains."""

    kind = OptionProperty("accent", options=SWATCHES)
    watch = ("kind",)

    def draw(self):
        area = (*self.pos, *self.size)
        if self.kind == "charging":
            self.box(*area, tk.accent_soft, dp(3))
            self.box(*area, tk.accent, dp(3), ring=1)
        elif self.kind == "planned":
            self.box(*area, tk.accent_bg, dp(3))
            self.box(*area, tk.accent, dp(3), ring=1)
        elif self.kind == "closed":
            self.box(*area, tk.closed)
            self.hatch(*area, tk.hatch)
            self.box(*area, tk.hatch, ring=1)
        else:
            self.box(*area, getattr(tk, self.kind), dp(3))
