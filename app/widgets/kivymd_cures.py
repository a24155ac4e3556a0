"""Cures for defects of the pinned KivyMD 2.0.0, and of kivy. With them its components cost 4 to
30 times less, have smooth corners on every GL driver, and are freed. tests/ui/test_kivymd_cures.py says that each
works.

Figures: processor time and memory of one widget as it comes and cured, drawn in software.
"""

import weakref
from copy import copy
from functools import partial

from kivy.clock import Clock
from kivy.core.text import LabelBase
from kivy.graphics import Canvas, Color
from kivy.input.motionevent import MotionEvent
from kivy.lang import Builder, builder
from kivy.lang.parser import global_idmap
from kivy.uix.label import Label
from kivy.uix.relativelayout import RelativeLayout

from app.widgets.places import places
from app.widgets.shapes import bordered, rounded
from app.widgets.tokens import set_roles, tk

KIVYMD_VERSION = "2.0.0"
_MOVE, _DISPATCH_DONE = MotionEvent.move, MotionEvent.dispatch_done
CLEAR, WHITE = (0, 0, 0, 0), (1, 1, 1, 1)
# of kivy's labels, never changed here
LEFT_AT_DEFAULTS = frozenset(
    {
        "font_direction",
        "italic",
        "underline",
        "strikethrough",
        "font_family",
        "outline_width",
        "outline_color",
        "disabled_outline_color",
        "mipmap",
        "strip",
        "ellipsis_options",
        "unicode_errors",
        "font_kerning",
        "font_blended",
        "font_context",
        "font_features",
        "base_direction",
        "text_language",
        "limit_render_to_text_bbox",
    }
)


def apply() -> None:
    """Install all of them, before the first KivyMD widget is made. A second call changes nothing."""
    for cure in (
        touches,
        moves,
        hover,
        ripple,
        shadow,
        background,
        state_layer,
        scheme,
        text_properties,
        text_textures,
        names_in_kv,
        values_in_kv,
        buttons,
    ):
        cure()


def _nothing(self, *_args, **_kwargs):
    """In the place of what is not wanted."""


def _drop_rule(name: str) -> None:
    """Take the kv rule of one of KivyMD's behaviours away."""
    Builder.rules[:] = [rule for rule in Builder.rules if rule[0].key != name.lower()]
    Builder._clear_matchcache()


def touches() -> None:
    """A touch that scrolled a page and ends above something else stays registered for ever as one that keeps the focus.
    It holds the label on which it began, as KivyMD's labels wait for a long touch, and so the whole screen."""
    from kivy.uix.behaviors import FocusBehavior

    class Touches(weakref.WeakSet):
        append = weakref.WeakSet.add  # kivy's is a list

    if isinstance(FocusBehavior.ignored_touch, list):
        FocusBehavior.ignored_touch = Touches()


def moves() -> None:
    """A touch that moves in the frame in which it begins would begin where it has moved to: a swipe pressed what it
    ended on. Of these moves the last is made when the touch has begun."""

    def move(touch, args):
        if touch.is_touch and not touch._first_dispatch_done:
            touch.moved_to = args
        else:
            _MOVE(touch, args)

    def dispatch_done(touch):
        _DISPATCH_DONE(touch)
        if (args := touch.__dict__.pop("moved_to", None)) is not None:
            _MOVE(touch, args)

    MotionEvent.move, MotionEvent.dispatch_done = move, dispatch_done


def hover() -> None:
    """Every widget, even a label, follows the mouse, and leaves an entry in the window that only a moving mouse
    removes. So hovering is removed: fingers don't hover."""
    from kivymd.uix.behaviors.hover_behavior import HoverBehavior

    def __init__(self, *args, **kwargs):
        super(HoverBehavior, self).__init__(*args, **kwargs)

    HoverBehavior.__init__ = __init__


def ripple() -> None:
    """A ripple needs a frame buffer and a shader per widget, raises on a widget without area, begins 33 ms after the
    touch and costs 100 ms of processor time. So there is none; the state layer shows a touch."""
    from kivymd.uix.behaviors.ripple_behavior import M3CommonRipple

    for method in ("init_fbos", "call_ripple_animation_methods", "finish_ripple"):
        setattr(M3CommonRipple, method, _nothing)


def shadow() -> None:
    """A frame buffer and a shader for each card, button, chip and bar, also at elevation 0. With ``background`` and ``hover``: MDCard
    1.06 → 0.22 ms, 526 → 40 KB; MDButton 6.4 → 1.3 ms, 757 → 230 KB."""
    from kivymd.uix.behaviors import elevation  # noqa: F401

    _drop_rule("CommonElevationBehavior")


def background() -> None:
    """Fill and border are jagged where the GL driver doesn't multisample, and are drawn although most widgets have
    none; a label has two fills. Here they are nine-patches, drawn once per frame, with the state layer between them,
    under the text."""
    from kivymd.uix.behaviors.backgroundcolor_behavior import BackgroundColorBehavior as Background
    from kivymd.uix.label import MDLabel

    _drop_rule("BackgroundColorBehavior")
    MDLabel.on_md_bg_color = Background.on_md_bg_color

    def __init__(self, **kwargs):
        super(Background, self).__init__(**kwargs)
        self._draws_background = False  # arguments are set before the canvas exists
        watch = self._watch_background  # one method for all: each access makes another
        for name in ("_md_bg_color", "line_color", "state_layer_color"):
            self.fbind(name, watch)
        self._watch_background()

    for method in (__init__, _watch_background, _draw_background):
        setattr(Background, method.__name__, method)


def _watch_background(self, *_args):
    """Nothing is bound for a widget before it has something to draw."""
    layer = getattr(self, "state_layer_color", CLEAR)
    if self._draws_background or not any(color and color[3] for color in (self._md_bg_color, self.line_color, layer)):
        return
    self._draws_background = True
    self._background = Canvas()
    place = 1 if self.canvas.has_before else 0  # outside a RelativeLayout's translation otherwise
    self.canvas.insert(place, self._background)
    self._paint_background = Clock.create_trigger(self._draw_background, -1)
    for name in ("pos", "size", "radius", "_md_bg_color", "line_color", "line_width", "state_layer_color"):
        self.fbind(name, self._paint_background)
    self._paint_background()


def _draw_background(self, _dt):
    self._background.clear()
    if self.width < 2 or self.height < 2:
        return
    line, layer = round(self.line_width), getattr(self, "state_layer_color", CLEAR)
    fill, edge = self._md_bg_color, self.line_color
    with self._background:
        if line and all(color and color[3] for color in (fill, edge)) and not layer[3]:
            _draw_shape(self, WHITE, partial(bordered, ring=line, fill=fill, line=edge))
            return
        for color in (fill, layer):
            _draw_shape(self, color)
        if line:
            _draw_shape(self, edge, partial(rounded, ring=line))


def _draw_shape(widget, color, draw=rounded) -> None:
    if color and color[3]:
        Color(*color)
        shape = draw(*widget.pos, *widget.size, tuple(widget.radius))
        if isinstance(widget, RelativeLayout):  # moves its drawing to its place
            shape.pos = shape.pos[0] - round(widget.x), shape.pos[1] - round(widget.y)


def state_layer() -> None:
    """KivyMD's stays tinted after a tap without a mouse, covers the text, also covers disabled widgets, and on Android
    resets a card to an old colour. Here it follows the finger."""
    from kivymd.uix.behaviors.state_layer_behavior import StateLayerBehavior
    from kivymd.uix.button import MDButton
    from kivymd.uix.card import MDCard

    _drop_rule("StateLayerBehavior")

    def on_state(self, *_args):
        pressed = self.state == "down" and not self.disabled
        self.state_layer_color = (*tk.ink[:3], 0.22 if tk.strong else 0.12) if pressed else CLEAR

    def on_disabled(self, *_args):
        self.state_layer_color = CLEAR

    StateLayerBehavior.on_state, StateLayerBehavior.on_disabled = on_state, on_disabled
    for method in ("_on_press", "_on_release", "on_enter", "on_leave", "set_properties_widget"):
        setattr(StateLayerBehavior, method, _nothing)
    MDButton.set_properties_widget = MDCard.set_properties_widget = _nothing


def scheme() -> None:
    """KivyMD computes a scheme of colours from one, 45–70 ms, three times at the start and at each switch. Here roles are tokens."""
    from kivymd.theming import ThemeManager

    def set_colors(self, *_args):  # kivy finds what is bound by its name
        set_roles(self)

    ThemeManager.set_colors = set_colors


def text_properties() -> None:
    """A label waits for a change of any of 37 properties, a third of the memory it takes, and half of a window are labels."""
    Label._font_properties = tuple(name for name in Label._font_properties if name not in LEFT_AT_DEFAULTS)


def text_textures() -> None:
    """A changed text of the same size is written over the texture that the frame before is still being drawn with, and waits until it is:
    a frame of scrolling runs (p95, drawn in software) 218 → 47 ms. So each text has a texture of its own."""
    if LabelBase.refresh.__module__ == __name__:
        return
    draw_again = LabelBase.refresh

    def refresh(self):
        self.texture = None
        draw_again(self)

    LabelBase.refresh = refresh


class Names(dict):
    """The names in one kv expression; those with one meaning everywhere are looked up in kivy's table."""

    __missing__ = staticmethod(global_idmap.__getitem__)

    def get(self, name, default=None):
        try:
            return self[name]
        except KeyError:
            return default

    def update(self, names):
        if names is not global_idmap:
            super().update(names)


def names_in_kv() -> None:
    """Each expression has a copy of all names that kv knows, 0.8 KB, and there are five in a label. MDLabel 0.22 → 0.18
    ms; MenuChip 219 → 196 KB. An id goes before a common name with the same spelling (kivy does the opposite; no such
    names exist)."""

    def own_names(names):
        if names is global_idmap:
            return Names()
        return Names(names) if isinstance(names, dict) and "root" in names else copy(names)

    builder.copy = own_names


def values_in_kv() -> None:
    """For an unused trace, each value of an expression is written out: 1 ms for a list of 200 robots."""

    def call_fn(args, _instance, _value):
        element, key, expression, rule, names = args
        rule.count += 1
        try:
            setattr(element, key, eval(expression, names))  # noqa: S307  (as kivy does; kv is our own)
        except ReferenceError:
            return  # its root is removed and no longer visible

    builder.call_fn = call_fn


def buttons() -> None:
    """A button takes a tap that was meant for what stood in its place a moment ago, or that began when it meant something else; here it
    takes neither (``places``)."""
    from kivy.uix.behaviors import ButtonBehavior

    if hasattr(ButtonBehavior, "stands"):
        return
    begin, touch_down, touch_up = ButtonBehavior.__init__, ButtonBehavior.on_touch_down, ButtonBehavior.on_touch_up

    def __init__(self, **kwargs):
        begin(self, **kwargs)
        places.watch(self)

    def on_touch_down(self, touch):
        if places.misses(self, touch):
            return super(ButtonBehavior, self).on_touch_down(touch) or True
        return touch_down(self, touch)

    def on_touch_up(self, touch):
        if touch.grab_current is self and places.is_another(self, touch):
            touch.ungrab(self)
            self.state = "normal"
            return True
        return touch_up(self, touch)

    ButtonBehavior.stands = True
    for method in (__init__, on_touch_down, on_touch_up):
        setattr(ButtonBehavior, method.__name__, method)
