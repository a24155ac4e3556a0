"""Surfaces: a box with a background, one that can be pressed, and tones that colour both."""

from kivy.properties import BooleanProperty, OptionProperty
from kivy.uix.widget import Widget
from kivymd.uix.boxlayout import MDBoxLayout
from kivymd.uix.card import MDCard

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
        self.solid_ink = tk.amber_ink if tone == "attention" else tk.solid_ink


class OnlySeen:
    """Mixin that ignores touches while the widget is invisible, also for its children. In kivy, layouts forward touches
    to invisible children, and disabled widgets consume those on them. What is not ``visible`` keeps its place, unless
    its size says otherwise."""

    visible = BooleanProperty(True)

    def on_visible(self, *_):
        self.opacity = 1 if self.visible else 0
        self.disabled = not self.visible

    @property
    def is_seen(self):
        return self.opacity > 0 and self.width >= 1 and self.height >= 1

    def on_touch_down(self, touch):
        return self.is_seen and super().on_touch_down(touch)


class Surface(OnlySeen, MDBoxLayout):
    """A box with a filled, bordered, rounded background."""


class Tap(OnlySeen, MDCard):
    """A card that can be pressed: ``on_press``, ``on_release``. It shows the press at once, with Material's state layer. Without
    ``can_press`` only what is in it can be."""

    can_press = True

    def on_touch_down(self, touch):
        if self.can_press:
            return super().on_touch_down(touch)
        return self.is_seen and Widget.on_touch_down(self, touch)


class Passive:
    """Mixin of cards that only show something: they leave touches to what is in them."""

    stands = False

    def on_touch_down(self, touch):
        return Widget.on_touch_down(self, touch)


class TonedSurface(Toned, Surface):
    """A surface with a tone."""


class TonedTap(Toned, Tap):
    """A pressable surface with a tone."""
