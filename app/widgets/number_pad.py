"""Digits for gloved fingers: a telephone's keypad with backspace and done."""
from kivy.properties import BooleanProperty
from kivy.uix.gridlayout import GridLayout

from app.widgets.buttons import CommandButton

BACKSPACE, DONE = "backspace", "done"


class PadKey(CommandButton):
    """One key, at least 64 dp."""


class NumberPad(GridLayout):
    """Fires ``on_digit(digit)``, ``on_backspace`` and ``on_done``."""
    ready = BooleanProperty(True)        # whether enough was entered: enables and highlights the done key

    __events__ = ("on_digit", "on_backspace", "on_done")

    def __init__(self, **kwargs):
        super().__init__(cols=3, **kwargs)
        for key in (*"123456789", BACKSPACE, "0", DONE):
            button = PadKey(text=key if key.isdigit() else "", icon={BACKSPACE: "backspace-outline", DONE: "check"}.get(key, ""))
            button.bind(on_release=lambda _button, key=key: self._pressed(key))
            self.add_widget(button)
            if key == DONE:
                self._done = button
        self.fbind("ready", self._light)
        self._light()

    def on_digit(self, digit):
        """A digit was pressed."""

    def on_backspace(self):
        """The last digit is to be removed."""

    def on_done(self):
        """The done key was pressed."""

    def _light(self, *_):
        self._done.style, self._done.disabled = ("filled", False) if self.ready else ("outlined", True)

    def _pressed(self, key):
        if key.isdigit():
            self.dispatch("on_digit", key)
        else:
            self.dispatch(f"on_{key}")
