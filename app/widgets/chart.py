"""Base of everything drawn on a canvas, and the small pieces: meter, sparkline, working ring.

Values in, drawing out; redrawn only when data, size or theme change, once per frame.
"""

from functools import lru_cache
from math import ceil

from kivy.clock import Clock
from kivy.core.text import Label as CoreLabel
from kivy.graphics import Color, Rectangle, SmoothLine
from kivy.metrics import dp, sp
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, StringProperty
from kivy.uix.behaviors import ButtonBehavior
from kivy.uix.widget import Widget
from kivymd.icon_definitions import md_icons
from kivymd.uix.progressindicator import MDCircularProgressIndicator, MDLinearProgressIndicator

from app.widgets.events import Fires
from app.widgets.shapes import hatch_texture, rounded
from app.widgets.tokens import tk


@lru_cache(maxsize=512)
def glyphs(text: str, size: float, font: str):
    """Texture of one line of white text; charts tint it."""
    label = CoreLabel(text=text, font_size=size, font_name=font, color=(1, 1, 1, 1))
    label.refresh()
    return label.texture


def box(x, y, w, h, colour, radius=0, alpha=1.0, ring=0):
    Color(*colour[:3], colour[3] * alpha)
    rounded(x, y, w, h, radius, ring)


def hatch(x, y, w, h, colour, period=8, width=1.4):
    x, y, w, h = round(x), round(y), round(w), round(h)
    Color(*colour)
    Rectangle(
        pos=(x, y),
        size=(w, h),
        texture=hatch_texture(period, width),
        tex_coords=(0, 0, w / period, 0, w / period, h / period, 0, h / period),
    )


def text(words, x, y, colour, size=14, ax=0.0, ay=0.5, font="Roboto"):
    """Draw ``words`` with their anchor (``ax``, ``ay`` in 0..1) at x, y; returns their width."""
    if not words:
        return 0
    texture = glyphs(words, sp(size), font)
    Color(*colour)
    Rectangle(texture=texture, size=texture.size, pos=(round(x - texture.width * ax), round(y - texture.height * ay)))
    return texture.width


def width_of(words, size=14, font="Roboto"):
    return glyphs(words, sp(size), font).width if words else 0


class KeySeat(ButtonBehavior, Widget):
    """A place on a chart that keys can reach; pressing it sends the ``event``. For fingers the chart itself finds what
    is near."""

    event: tuple[str, object] = ("", None)
    is_tab_stop = stands = False

    def on_touch_down(self, touch):
        return False

    on_touch_move = on_touch_up = on_touch_down

    def on_release(self):
        self.parent.dispatch(*self.event)


class Chart(Fires, Widget):
    """One redraw trigger for the properties in ``watch``; drawing helpers in window px, text sizes in sp."""

    watch: tuple[str, ...] = ()
    box, hatch, text, width_of = staticmethod(box), staticmethod(hatch), staticmethod(text), staticmethod(width_of)

    def __init__(self, **kwargs):
        self._trigger = Clock.create_trigger(self._redraw, -1)
        self._seats = {}
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

    def seats(self) -> list[Widget]:
        """What keys can reach on it."""
        return self.seats_at({})

    def seats_at(self, wanted: dict) -> list[Widget]:
        """A seat for each key of ``wanted``, (event, pos, size, is_tab_stop); the same as before where the key was there."""
        old, self._seats = self._seats, {}
        for key, (event, pos, size, is_tab_stop) in wanted.items():
            seat = self._seats[key] = old.pop(key, None) or KeySeat()
            seat.event, seat.pos, seat.size, seat.is_tab_stop = event, pos, size, is_tab_stop
            if seat.parent is None:
                self.add_widget(seat)
        self.clear_widgets(list(old.values()))
        return list(self._seats.values())

    def icon(self, name, x, y, colour, size=18):
        return self.text(md_icons[name], x, y, colour, size, 0.5, 0.5, "Icons")


class Meter(Chart, MDLinearProgressIndicator):
    """Horizontal bar, ``value`` 0..1."""

    tone = StringProperty("accent")
    watch = ("value", "tone")

    def on_value(self, *_):
        """KivyMD makes 0 a little more, which would be a dot."""

    def draw(self):
        r = self.height / 2
        self.box(self.x, self.y, self.width, self.height, tk.track, r)
        if self.value > 0:
            self.box(
                self.x,
                self.y,
                max(self.height, self.width * self.value_normalized),
                self.height,
                getattr(tk, self.tone),
                r,
            )


class Sparkline(Chart):
    """The history of one figure: ``values`` oldest first, None for days without data; ``before``: as many of the period
    before, grey. It spans ``least_span`` at least; 0: it begins at zero."""

    values = ListProperty()
    before = ListProperty()
    least_span = NumericProperty(0)
    watch = ("values", "before", "least_span")

    def scale(self):
        """The values at its lower and upper edge; None for a single day."""
        known = [value for value in self.values if value is not None]
        if len(known) < 2:
            return None
        known += [value for value in self.before if value is not None]
        if not self.least_span:
            return 0, max(known) or 1
        low, high = min(known), max(known)
        more = max(0.0, self.least_span - (high - low)) / 2
        low = max(0.0, min(low - more, 1 - self.least_span))  # of shares: within 0 and 1
        return low, max(high, low + self.least_span)

    def runs(self, values):
        """Points that are joined, in px: of days without a gap between them."""
        low, high = self.scale()
        pad = dp(4)
        width, base, height = self.width - 2 * pad, self.y + pad, self.height - 2 * pad
        found, last = [[]], max(1, len(values) - 1)
        for n, value in enumerate(values):
            if value is None:
                found.append([])
            else:
                found[-1].append((self.x + pad + width * n / last, base + height * (value - low) / (high - low)))
        return [points for points in found if points]

    def draw(self):
        if self.scale() is None:
            return
        for values, colour, width in ((self.before, tk.outline, 0.6), (self.values, tk.accent, 1.25)):
            for points in self.runs(values):
                if len(points) > 1:
                    Color(*colour)
                    SmoothLine(points=[c for point in points for c in point], width=dp(width))
                else:
                    self.box(points[0][0] - dp(2), points[0][1] - dp(2), dp(4), dp(4), colour, dp(2))


class WorkingRing(MDCircularProgressIndicator):
    """Turns while it is in the window. KivyMD's starts earlier and never ends, so its screen would never be freed."""

    active = BooleanProperty(False)

    def on_parent(self, *_):
        self.active = self.parent is not None

    def _anim_back(self, *args):
        """Half-way round: the screen may have been removed by then."""
        if self.get_root_window() is None:
            self.active = False
        else:
            super()._anim_back(*args)


def nice_step(top: float, steps: int = 4) -> int:
    """Distance of grid lines (1, 2, 5, 10, 20, 25, 50 …) so that at most ``steps`` of them reach ``top``."""
    for power in range(10):
        for base in (1, 2, 2.5, 5):
            step = base * 10**power
            if step == int(step) and top / step < steps:
                return int(step)
    return ceil(top)
