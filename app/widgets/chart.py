"""Base of everything drawn on a canvas, and the small pieces: meter, sparkline, working ring, legend swatch, robot glyph.

Values in, drawing out; redrawn only when data, size or theme change, once per frame.
"""
from functools import lru_cache
from math import ceil

from kivy.clock import Clock
from kivy.core.text import Label as CoreLabel
from kivy.graphics import Color, Mesh, Rectangle, SmoothLine
from kivy.metrics import dp, sp
from kivy.properties import BooleanProperty, ColorProperty, ListProperty, NumericProperty, OptionProperty, StringProperty
from kivy.uix.widget import Widget
from kivymd.icon_definitions import md_icons
from kivymd.uix.progressindicator import MDCircularProgressIndicator, MDLinearProgressIndicator

from app.widgets.shapes import hatch_texture, rounded
from app.widgets.tokens import tk


@lru_cache(maxsize=512)
def glyphs(text: str, size: float, font: str):
    """Texture of one line of white text; charts tint it."""
    label = CoreLabel(text=text, font_size=size, font_name=font, font_hinting="light", color=(1, 1, 1, 1))
    label.refresh()
    return label.texture


def box(x, y, w, h, colour, radius=0, alpha=1., ring=0):
    Color(*colour[:3], colour[3] * alpha)
    rounded(x, y, w, h, radius, ring)


def hatch(x, y, w, h, colour, period=8, width=1.4):
    x, y, w, h = round(x), round(y), round(w), round(h)
    Color(*colour)
    Rectangle(pos=(x, y), size=(w, h), texture=hatch_texture(period, width),
              tex_coords=(0, 0, w / period, 0, w / period, h / period, 0, h / period))


def text(words, x, y, colour, size=14, ax=0., ay=.5, font="Roboto"):
    """Draw ``words`` with their anchor (``ax``, ``ay`` in 0..1) at x, y; returns their width."""
    if not words:
        return 0
    texture = glyphs(words, sp(size), font)
    Color(*colour)
    Rectangle(texture=texture, size=texture.size, pos=(round(x - texture.width * ax), round(y - texture.height * ay)))
    return texture.width


def width_of(words, size=14, font="Roboto"):
    return glyphs(words, sp(size), font).width if words else 0


class Chart(Widget):
    """One redraw trigger for the properties in ``watch``; drawing helpers in window px, text sizes in sp."""
    watch: tuple[str, ...] = ()
    box, hatch, text, width_of = staticmethod(box), staticmethod(hatch), staticmethod(text), staticmethod(width_of)

    def __init__(self, **kwargs):
        self._trigger = Clock.create_trigger(self._redraw, -1)
        super().__init__(**kwargs)
        for name in ("pos", "size", *self.watch):
            self.fbind(name, self._trigger)
        tk.follow(self._look_changed)
        self._trigger()

    def _look_changed(self, *_):
        self._trigger()

    def _redraw(self, *_):
        self.canvas.clear()
        if self.width > 4 and self.height > 4:
            with self.canvas:
                self.draw()

    def draw(self):
        raise NotImplementedError

    def icon(self, name, x, y, colour, size=18):
        return self.text(md_icons[name], x, y, colour, size, .5, .5, "Icons")


class Meter(Chart, MDLinearProgressIndicator):
    """Horizontal bar, ``value`` 0..1; ``mark`` >= 0 draws a tick (the usual value, the minimum)."""
    mark = NumericProperty(-1)
    tone = StringProperty("accent")
    watch = ("value", "mark", "tone")

    def on_value(self, *_):
        """KivyMD makes 0 a little more, which would be a dot."""

    def draw(self):
        r = self.height / 2
        self.box(self.x, self.y, self.width, self.height, tk.track, r)
        if self.value > 0:
            self.box(self.x, self.y, max(self.height, self.width * self.value_normalized), self.height, getattr(tk, self.tone), r)
        if self.mark >= 0:
            self.box(self.x + self.width * min(1., self.mark) - dp(1), self.y - dp(3), dp(2), self.height + dp(6), tk.ink2)


class Sparkline(Chart):
    """The history of one figure: ``values`` oldest first, None where there was nothing to count."""
    values = ListProperty()
    watch = ("values",)

    def draw(self):
        known = [value for value in self.values if value is not None]
        if not known or self.width < dp(20):     # a line so steep says nothing
            return
        low, high = min(known), max(known)
        span = (high - low) or 1
        pad = dp(5)
        width, base, height = self.width - pad, self.y + pad, self.height - 2 * pad
        last = max(1, len(self.values) - 1)
        points = [(self.x + width * i / last, base + height * ((value - low) / span if high > low else .5))
                  for i, value in enumerate(self.values) if value is not None]
        if len(points) > 1:
            mesh = [c for x, y in points for c in (x, self.y, 0, 0, x, y, 0, 0)]
            Color(*tk.accent[:3], .10)
            Mesh(vertices=mesh, indices=list(range(2 * len(points))), mode="triangle_strip")
            Color(*tk.accent)
            SmoothLine(points=[c for point in points for c in point], width=dp(1.25))
        x, y = points[-1]
        self.box(x - dp(5), y - dp(5), dp(10), dp(10), tk.surface, dp(5))
        self.box(x - dp(4), y - dp(4), dp(8), dp(8), tk.accent, dp(4))


class WorkingRing(MDCircularProgressIndicator):
    """Turns while it is in the window. KivyMD's begins before that and never ends, so nothing of its screen would be freed."""
    active = BooleanProperty(False)

    def on_parent(self, *_):
        self.active = self.parent is not None

    def _anim_back(self, *args):
        """Half-way round: meanwhile the screen may have been taken away."""
        if self.get_root_window() is None:
            self.active = False
        else:
            super()._anim_back(*args)


SWATCHES = ("planned", "assumed", "typed", "charging", "overlap", "closed", "accent", "accent_mid", "track", "attention_solid",
            "fault_solid", "neutral_solid", "done_solid")


class Swatch(Chart):
    """One legend square, drawn like the thing it explains."""
    kind = OptionProperty("planned", options=SWATCHES)
    watch = ("kind",)

    def draw(self):
        box = (*self.pos, *self.size)
        if self.kind in ("planned", "assumed", "typed", "charging"):
            self.box(*box, {"assumed": tk.surface, "charging": tk.accent_soft}.get(self.kind, tk.accent_bg), dp(3))
            self.box(*box, tk.accent, dp(3), ring=1)
            if self.kind == "typed":
                frame = tk.accent_on if tk.strong else tk.accent
                self.box(self.x + dp(3), self.y + dp(3), self.width - dp(6), self.height - dp(6), frame, dp(1), ring=1)
        elif self.kind == "overlap":
            self.box(*box, tk.attention_bg)
            self.hatch(*box, tk.overlap, 6, 2)
            self.box(*box, tk.attention, ring=1)
        elif self.kind == "closed":
            self.box(*box, tk.closed)
            self.hatch(*box, tk.hatch)
            self.box(*box, tk.hatch, ring=1)
        else:
            self.box(*box, getattr(tk, self.kind), dp(3))


class AmrGlyph(Chart):
    """A mobile robot from the side: deck, body with the scanner slot, two wheels. The icon font has none."""
    colour = ColorProperty((0, 0, 0, 1))
    back = ColorProperty((1, 1, 1, 1))
    watch = ("colour", "back")

    # x, y, width, height, radius in 24ths of the side; True: cut out
    PARTS = ((5, 17.6, 14, 1.8, .9, False), (1.5, 7.4, 21, 9.2, 3, False), (4.2, 12.2, 15.6, 1.5, .7, True),
             (4.6, 3.6, 6.4, 6.4, 3.2, True), (13, 3.6, 6.4, 6.4, 3.2, True),
             (5.5, 4.5, 4.6, 4.6, 2.3, False), (13.9, 4.5, 4.6, 4.6, 2.3, False))

    def draw(self):
        unit = min(self.width, self.height) / 24
        left, bottom = self.center_x - 12 * unit, self.center_y - 12 * unit
        for x, y, w, h, r, cut in self.PARTS:
            self.box(left + x * unit, bottom + y * unit, w * unit, h * unit, self.back if cut else self.colour, r * unit)


def nice_step(top: float, steps: int = 4) -> int:
    """Distance of grid lines (1, 2, 5, 10, 20, 25, 50 …) so that at most ``steps`` of them reach ``top``."""
    for power in range(10):
        for base in (1, 2, 2.5, 5):
            step = base * 10 ** power
            if step == int(step) and top / step < steps:
                return int(step)
    return ceil(top)
