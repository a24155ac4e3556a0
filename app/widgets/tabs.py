"""Tabs: words side by side, a line below the chosen one. Those of the present screen are in the top bar; a card may have its own."""

from kivy.metrics import dp, sp
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty
from kivy.uix.boxlayout import BoxLayout

from app.widgets.children import refill
from app.widgets.events import Fires, Late
from app.widgets.items import Tab
from app.widgets.surfaces import TonedTap
from app.widgets.text import line_width
from app.widgets.tokens import tk

AROUND = 26  # dp: the margins of a word
ICON = 32  # dp, with the gap after it


class TabButton(TonedTap):
    """One tab, as wide as ``Tabs`` says."""

    tab = ObjectProperty(Tab("", ""), rebind=True)
    active = BooleanProperty(False)

    @property
    def wanted(self) -> float:
        """Width in px with the word on one line."""
        around = dp(AROUND + (ICON if self.tab.icon else 0))
        count = line_width(f"  {self.tab.count}", "RobotoMedium", sp(18)) if self.tab.count else 0
        return around + count + line_width(self.tab.text, "RobotoMedium", sp(18))


class Tabs(Fires, Late, BoxLayout):
    """``tabs`` are ``Tab``s, ``selected`` is the key of the chosen one; a tap on another one fires ``on_choose(key)``.

    They are as wide as their words, or with ``fill`` share the width. Without enough room the longest wrap. ``used`` is the width in px
    that they take.
    """

    tabs = ListProperty()
    selected = ObjectProperty(None, allownone=True)
    fill = BooleanProperty(False)
    used = NumericProperty(0)

    __events__ = ("on_choose",)

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        tk.follow(self.on_width)

    def _pressed(self, button):
        if button.tab.key != self.selected:
            self.dispatch("on_choose", button.tab.key)

    def on_tabs(self, *_):
        buttons = refill(self, [tab.key for tab in self.tabs], lambda _key: TabButton(on_release=self._pressed))
        for button, tab in zip(buttons, self.tabs, strict=True):
            button.tab = tab
        self.on_selected()
        self.on_width()

    def on_selected(self, *_):
        for button in self.children:
            button.active = button.tab.key == self.selected

    def on_width(self, *_):
        """The shortest get what they want first."""
        left = len(self.children)
        gaps = self.spacing * max(0, left - 1)
        room = self.width - gaps
        for button in sorted(self.children, key=lambda button: button.wanted):
            share = room / left
            button.width = share if self.fill else min(button.wanted, share)
            room, left = room - button.width, left - 1
        self.used = gaps + sum(button.width for button in self.children)

    on_spacing = on_fill = on_width
