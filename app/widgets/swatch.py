"""The squares of legends."""

from kivy.properties import StringProperty

from app.widgets.chart import Chart
from app.widgets.lanes_bars import paint_look
from app.widgets.lanes_frame import colours
from app.widgets.tokens import tk


class Swatch(Chart):
    """One legend square, drawn like the thing it explains: the state of a bar of lanes, closed time, or a colour."""

    kind = StringProperty("accent")
    watch = ("kind",)

    def draw(self):
        if (look := colours().get(self.kind)) is not None:
            paint_look(self.kind, look, *self.pos, *self.size)
        elif self.kind == "closed":
            self.box(*self.pos, *self.size, tk.closed)
            self.hatch(*self.pos, *self.size, tk.hatch)
            self.box(*self.pos, *self.size, tk.hatch, ring=1)
        else:
            self.box(*self.pos, *self.size, getattr(tk, self.kind))
