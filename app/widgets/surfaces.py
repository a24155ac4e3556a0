"""Surfaces: a box with a background, one that can be pressed, and tones that colour both."""
from kivy.clock import Clock
from kivy.graphics import Color
from kivy.properties import ColorProperty, NumericProperty, OptionProperty, VariableListProperty
from kivy.uix.behaviors import ButtonBehavior
from kivy.uix.boxlayout import BoxLayout

from app.widgets.shapes import rounded
from app.widgets.tokens import TONES, late_color, tk

CLEAR = (0, 0, 0, 0)


class Toned:
    """Mixin: sets the colours fg, tint, tint_ink, solid and solid_ink from ``tone`` and the theme. Classes with further colours override
    ``retone``."""
    tone = OptionProperty("neutral", options=TONES)
    fg = late_color((0, 0, 0, 1))
    tint = late_color(CLEAR)
    tint_ink = late_color((0, 0, 0, 1))
    solid = late_color((0, 0, 0, 1))
    solid_ink = late_color((1, 1, 1, 1))

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.fbind("tone", self.retone)
        tk.follow(self.retone)
        self.retone()

    def retone(self, *_):
        tone = self.tone
        self.fg = getattr(tk, tone)
        self.tint = getattr(tk, tone + "_bg")
        self.tint_ink = getattr(tk, tone + "_on")
        self.solid = getattr(tk, tone + "_solid")
        self.solid_ink = {"attention": tk.amber_ink, "accent": tk.accent_ink}.get(tone, tk.solid_ink)


class OnlySeen:
    """Mixin that ignores touches while the widget is invisible, for its children as well. In kivy, layouts forward touches to invisible
    children, and disabled widgets consume those on them."""

    @property
    def is_seen(self):
        return self.opacity > 0 and self.width >= 1 and self.height >= 1

    def on_touch_down(self, touch):
        return self.is_seen and super().on_touch_down(touch)


class SeenBox(OnlySeen, BoxLayout):
    """A box that takes touches only while it is visible."""


class Surface(OnlySeen, BoxLayout):
    """A box with a filled, bordered, rounded background; ``veil`` is drawn over the fill (the pressed state)."""
    fill = ColorProperty(CLEAR)
    veil = ColorProperty(CLEAR)
    line = ColorProperty(CLEAR)
    line_w = NumericProperty(0)
    radius = VariableListProperty([0])

    def __init__(self, **kwargs):
        self._paint = Clock.create_trigger(self._draw, -1)
        super().__init__(**kwargs)
        for name in ("pos", "size", "fill", "veil", "line", "line_w", "radius"):
            self.fbind(name, self._paint)
        self._paint()

    def _draw(self, *_):
        canvas = self.canvas.before
        canvas.remove_group("surface")
        if self.width < 2 or self.height < 2:
            return
        box = (*self.pos, *self.size, tuple(self.radius))
        with canvas:
            for colour in (self.fill, self.veil):
                if colour[3]:
                    Color(*colour, group="surface")
                    rounded(*box).group = "surface"
            if self.line_w and self.line[3]:
                Color(*self.line, group="surface")
                rounded(*box, ring=self.line_w).group = "surface"


class Tap(ButtonBehavior, Surface):
    """A surface that can be pressed: ``on_press``, ``on_release``. It shows the press at once, with Material's state layer."""
    min_state_time = NumericProperty(.12)     # a quick tap stays visible

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.fbind("state", self._veil)
        tk.follow(self._veil)
        self._veil()

    def on_touch_down(self, touch):
        return self.is_seen and super().on_touch_down(touch)      # before ButtonBehavior handles it

    def _veil(self, *_):
        self.veil = (*tk.ink[:3], .22 if tk.strong else .12) if self.state == "down" else CLEAR


class TonedSurface(Toned, Surface):
    """A surface with a tone."""


class TonedTap(Toned, Tap):
    """A pressable surface with a tone."""
