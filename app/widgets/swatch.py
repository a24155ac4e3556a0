"""The squares of legends."""

from kivy.metrics import dp
from kivy.properties import OptionProperty

from app.widgets.chart import Chart
from app.widgets.timeline_bars import paint_look
from app.widgets.timeline_painting import TOKENS, colours
from app.widgets.tokens import tk

SWATCHES = (
    *TOKENS,
    "typed",
    "charging",
    "overlap",
    "closed",
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

    kind = OptionProperty("planned", options=SWATCHES)
    watch = ("kind",)

    def draw(self):
        area = (*self.pos, *self.size)
        if self.kind in TOKENS or self.kind == "typed":
            look = "planned" if self.kind == "typed" else self.kind
            paint_look(look, colours()[look], *area)
            if self.kind == "typed":
                self.box(
                    self.x + dp(3), self.y + dp(3), self.width - dp(6), self.height - dp(6), tk.accent, dp(1), ring=1
                )
        elif self.kind == "charging":
            self.box(*area, tk.accent_soft, dp(3))
            self.box(*area, tk.accent, dp(3), ring=1)
        elif self.kind == "overlap":
            self.box(*area, tk.attention_bg)
            self.hatch(*area, tk.overlap, 6, 2)
            self.box(*area, tk.attention, ring=1)
        elif self.kind == "closed":
            self.box(*area, tk.closed)
            self.hatch(*area, tk.hatch)
            self.box(*area, tk.hatch, ring=1)
        else:
            self.box(*area, getattr(tk, self.kind), dp(3))
