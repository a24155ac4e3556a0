"""Digits for gloved fingers: a telephone's keypad with backspace and done."""

from kivy.properties import BooleanProperty
from kivy.uix.gridlayout import GridLayout

from app.widgets.buttons import CommandButton
from app.widgets.events import Fires

BACKSPACE, DONE = "backspace", "done"
ICONS = {BACKSPACE: "backspace-outline", DONE: "check"}


class PadKey(CommandButton):
    """One key, at least 64 dp."""


class NumberPad(Fires, GridLayout):
    """Fires ``on_digit(digit)``, ``on_backspace`` and ``on_done``."""

    KEYS = (*"123456789", BACKSPACE, "0", DONE)
    ready = BooleanProperty(True)  # whether enough was entered: enables and highlights the done key

    __events__ = ("on_digit", "on_backspace", "on_done")

    def __init__(self, **kwargs):
        super().__init__(cols=3, **kwargs)
        for key in self.KEYS:
            self.add_widget(self._key(key))
        self.on_ready()

    def _key(self, key):
        button = PadKey(icon=ICONS[key]) if key in ICONS else PadKey(text=key)
        button.bind(on_release=lambda _button: self._pressed(key))
        return button

    def on_ready(self, *_):
        for button in self.children:
            if getattr(button, "icon", "") == ICONS[DONE]:
                button.style, button.disabled = ("filled", False) if self.ready else ("outlined", True)

    def _pressed(self, key):
        if key.isdigit():
            self.dispatch("on_digit", key)
        else:
            self.dispatch(f"on_{key}")
