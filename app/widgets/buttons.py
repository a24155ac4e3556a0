"""Buttons: command button, icon button, chips, segments, switch."""

from kivy.clock import Clock
from kivy.metrics import dp, sp
from kivy.properties import (
    BooleanProperty,
    ColorProperty,
    ListProperty,
    NumericProperty,
    ObjectProperty,
    OptionProperty,
    StringProperty,
)
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.relativelayout import RelativeLayout
from kivymd.icon_definitions import md_icons
from kivymd.uix.button import MDButton, MDButtonIcon, MDButtonText, MDIconButton
from kivymd.uix.chip import MDChip
from kivymd.uix.selectioncontrol import MDSwitch

from app.widgets.chart import WorkingRing
from app.widgets.children import refill
from app.widgets.events import Fires, Late
from app.widgets.surfaces import CLEAR, OnlySeen, Passive, Tap, Toned
from app.widgets.text import BodyStrong, Ico, line_width
from app.widgets.tokens import late_color, tk

PLAIN = ("text", "standard")  # KivyMD's names of the style without fill and border, of a button and of an icon button


class Styled(Toned):
    """Mixin that sets the colours back, front and edge from ``style``, ``tone`` (fault: what destroys) and ``disabled``. ``over_solid``: on
    a solid block of its tone."""

    over_solid = BooleanProperty(False)
    back = late_color(CLEAR)
    front = late_color((0, 0, 0, 1))
    edge = late_color(CLEAR)

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for name in ("style", "disabled", "over_solid"):
            self.fbind(name, self.retone)

    def retone(self, *_):
        super().retone()
        self.back, self.front, self.edge = (
            self._off() if self.disabled else self._over_solid() if self.over_solid else self._on()
        )

    def _off(self):
        faint = (*tk.disabled[:3], 0.45) if tk.strong else tk.line  # a strong line would look as if it could be pressed
        solid = self.over_solid or self.style in ("filled", "tonal")
        return tk.neutral_bg if solid else CLEAR, tk.disabled, CLEAR if self.style in PLAIN and not solid else faint

    def _over_solid(self):
        """The border has a contrast of 3:1 to the block, where the button's fill has less: white on amber, dark on dark red."""
        if self.style in PLAIN:
            return CLEAR, self.tint_ink, CLEAR
        if tk.theme == "dark":
            return tk.surface, tk.ink, tk.ink
        return tk.surface, self.fg, tk.amber_ink if self.tone == "attention" else tk.surface

    def _on(self):
        if self.style == "filled":
            return tk.accent_solid, tk.solid_ink, tk.accent_solid
        if self.style == "tonal":
            return tk.accent_bg, tk.accent_on, tk.accent if tk.strong else tk.accent_bg
        if self.style in PLAIN:
            return CLEAR, tk.accent if self.style == "text" else tk.ink2, CLEAR
        if self.tone == "attention":
            return self.tint, self.tint_ink, self.fg
        return (tk.surface, self.fg, self.fg) if self.tone in ("fault", "action") else (tk.surface, tk.ink, tk.outline)


class ButtonIcon(Ico, MDButtonIcon):
    """The icon of a command button, which places it."""

    pos_hint = ObjectProperty({})


class ButtonText(BodyStrong, MDButtonText):
    """The text of a command button, which places it."""

    pos_hint = ObjectProperty({})


class CommandButton(OnlySeen, Styled, MDButton):
    """A button with text and icon; ``large``: 24 sp. A text that is too long wraps.

    While ``busy`` it ignores presses, and after 300 ms a spinner takes the place of the icon, or of the text if there
    is none. ``fit``: as wide as its text, at least ``least_width``, and without width while it is not ``visible``.
    ``natural_height`` is that of icon and text.
    """

    style = OptionProperty("outlined", options=("filled", "tonal", "outlined", "text"))
    icon = StringProperty()
    text = StringProperty()
    large = BooleanProperty(False)
    busy = BooleanProperty(False)
    fit = BooleanProperty(False)
    least_width = NumericProperty(0)
    natural_height = NumericProperty(0)

    def __init__(self, **kwargs):
        self._patience = Clock.create_trigger(self._show_work, 0.3)
        self._arrange = Clock.create_trigger(self._place, -1)
        self._ring = None
        super().__init__(**kwargs)

    def on_icon(self, *_):
        """Many have no text, and need no label for it."""
        if self.icon and self._button_icon is None and self._button_text is not None:
            mark = ButtonIcon(icon=self.icon)
            self.add_widget(mark)
            mark.color = self.front  # KivyMD has given it one of its own
            mark.opacity = 0 if self._ring is not None else 1
            self.fbind("icon", mark.setter("icon"))
            self.fbind("front", mark.setter("color"))

    def on_kv_post(self, _base):
        self.on_icon()  # set before there was anything to add it to
        self._button_text.fbind("size", self._arrange)
        for name in ("pos", "size", "icon", "text", "fit", "least_width", "visible"):
            self.fbind(name, self._arrange)
        self._place()

    def adjust_width(self, *_):
        """KivyMD does this 0.2 s late."""

    adjust_pos = adjust_width

    def _place(self, *_):
        """Icon and text side by side, centred."""
        icon, word = self._button_icon, self._button_text
        side = dp(24) if self.icon else 0
        offset = side + (dp(8) if self.icon and self.text else 0)
        word.opacity = 0 if self._ring is not None and not self.icon else 1
        word.max_width = 0 if self.fit else max(dp(24), self.width - dp(16) - (dp(32) if side else 0))
        self.natural_height = max(side, word.height) + dp(16)
        if self.fit:
            self.size_hint_x = None
            self.width = max(self.least_width, offset + word.width + dp(32)) if self.visible else 0
        x, y = self.x - round(self.x), self.y - round(self.y) + self.height / 2  # drawing begins at a whole pixel
        x += (self.width - offset - word.width) / 2
        if icon is not None:
            icon.pos = x, y - side / 2
        word.pos = x + offset, y - word.height / 2
        if self._ring is not None:
            self._ring.center = icon.center if self.icon else word.center

    def on_busy(self, *_):
        self._patience.cancel()
        if self.busy:
            self._patience()
        elif self._ring is not None:
            self.remove_widget(self._ring)
            self._ring = None
            self._show_icon(1)
            self._place()

    def _show_work(self, _dt):
        if self._ring is None:
            self._ring = WorkingRing(size_hint=(None, None), size=(dp(20), dp(20)), color=self.front)
            RelativeLayout.add_widget(self, self._ring)
            self._show_icon(0)
            self._place()

    def _show_icon(self, opacity):
        if self._button_icon is not None:
            self._button_icon.opacity = opacity

    def on_front(self, *_):
        if self._ring is not None:
            self._ring.color = self.front

    def on_touch_down(self, touch):
        if self.busy and self.is_seen and self.collide_point(*touch.pos):
            return True
        return super().on_touch_down(touch)


class IconButton(OnlySeen, Styled, MDIconButton):
    """A button with an icon only, where that needs no text (close, back, search, menu)."""

    icon = StringProperty()
    font_name = StringProperty("Icons")
    font_size = NumericProperty("24dp")

    def on_icon(self, *_):
        self.text = md_icons[self.icon] if self.icon else ""


class ChoiceChip(OnlySeen, MDChip):
    """A text that can be chosen, with an ``icon`` of its ``tone`` before it; ``active`` if chosen. Beyond ``limit`` px (0: never) it
    wraps, and ends with "…" after ``most_lines`` (0: any number)."""

    text = StringProperty()
    icon = StringProperty()
    tone = StringProperty("neutral")
    limit = NumericProperty(0)
    most_lines = NumericProperty(0)
    after = NumericProperty(0)  # px, of what follows the text

    @property
    def wanted(self) -> float:
        """Width in px with the text on one line."""
        icon = dp(22) if self.icon else 0
        return max(tk.h_touch, line_width(self.text, "RobotoMedium", sp(16)) + icon + dp(25) + self.after)

    def add_widget(self, *args, **kwargs):
        """KivyMD adds parts a frame later, and its icons keep the touch from the chip."""
        super(MDChip, self).add_widget(*args, **kwargs)

    def icon_ink(self, tone, *_theme):
        return getattr(tk, tone)

    def on_press(self):
        """KivyMD ends ``active`` here."""

    def on_active(self, *_):
        """KivyMD animates the colours, half a second later."""


class MenuChip(ChoiceChip):
    """A chip that opens something: ``trailing`` icon after its text."""

    trailing = StringProperty("chevron-down")
    after = NumericProperty("24dp")


class ToolRow(BoxLayout):
    """Chips and buttons above a list, on one line: what has no room makes the longest chips shorter."""

    def add_widget(self, widget, *args, **kwargs):
        super().add_widget(widget, *args, **kwargs)
        widget.fbind("width", self.on_width)
        if isinstance(widget, ChoiceChip):
            widget.fbind("text", self.on_width)

    def on_width(self, *_):
        """The shortest get what they want first."""
        chips = [tool for tool in self.children if isinstance(tool, ChoiceChip) and tool.text]
        others = [tool for tool in self.children if tool not in chips]
        left, room = len(chips), self.width - self.padding[0] - self.padding[2]
        room -= self.spacing * (len(self.children) - 1)
        room -= sum(tool.width if tool.size_hint_x is None else tool.size_hint_min_x or 0 for tool in others)
        for chip in sorted(chips, key=lambda chip: chip.wanted):
            chip.limit = min(chip.wanted, room / left)
            room, left = room - chip.limit, left - 1


class Segment(Tap):
    """One choice of a few that are all visible (``Segments`` builds a row of them); also a day chip."""

    key = ObjectProperty(None, allownone=True)
    text = StringProperty()
    selected = BooleanProperty(False)


class Toggle(Fires, Tap):
    """On or off; the tick says "on" without colour. A tap fires ``on_switch(wanted)``; ``active`` is set once a service has
    accepted it."""

    active = BooleanProperty(False)

    __events__ = ("on_switch",)

    def on_release(self):
        self.dispatch("on_switch", not self.active)


class SwitchFace(Passive, MDSwitch):
    """The visible part of a ``Toggle``: smaller than a fingertip, so the toggle around it takes the touches."""

    md_bg_color_disabled = ColorProperty(CLEAR)  # KivyMD's veil; the toggle fades as a whole

    def on_active(self, *_):
        """KivyMD moves the thumb for 0.2 s, and changes its icon afterwards; here the kv rule does both at once."""

    set_icon = on_active


class Segments(Fires, Late, BoxLayout):
    """A row of connected segments, one of them ``selected`` by its key, or ``several`` (a list): ``options`` = [(key, label), …]. A tap
    fires ``on_choose(key)``."""

    options = ListProperty()
    selected = ObjectProperty(None, allownone=True)
    several = BooleanProperty(False)

    __events__ = ("on_choose",)

    def on_options(self, *_):
        segments = refill(self, dict(self.options), lambda key: Segment(key=key, on_release=self._tapped))
        for segment, (_key, label) in zip(segments, self.options, strict=True):
            segment.text = label
        self.on_selected()

    def on_selected(self, *_):
        """What is selected is round, which tells it without colour; of one choice, the outer corners are round, too."""
        end, last = self.height / 2, len(self.children) - 1
        for n, segment in enumerate(reversed(self.children)):
            segment.selected = segment.key in (self.selected or ()) if self.several else segment.key == self.selected
            left, right = (
                end if segment.selected or (n == edge and not self.several) else dp(12 if self.several else 8)
                for edge in (0, last)
            )
            segment.radius = [left, right, right, left]

    on_several = on_height = on_selected

    def _tapped(self, segment):
        if self.several:
            chosen = list(self.selected or ())
            self.selected = [key for key in chosen if key != segment.key] + [segment.key] * (segment.key not in chosen)
        else:
            self.selected = segment.key
        self.dispatch("on_choose", segment.key)
