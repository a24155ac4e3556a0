"""A PIN entered by taps, or on a keyboard where there is one: to open Settings, and to set it."""

from __future__ import annotations

from typing import Any

from kivy.properties import BooleanProperty, StringProperty

from app.services.live.access import LONGEST, SHORTEST
from app.widgets import load_kv
from app.widgets.sheet import Sheet

BACKSPACE, ENTER, KEYPAD_ENTER = 8, 13, 271


class PinSheet(Sheet):
    """Digits as dots; ``on_entered(pin)`` when they are complete. While ``busy`` or ``waiting`` none are accepted."""

    is_question = True

    text = StringProperty()
    pin = StringProperty()
    problem = StringProperty()
    ready = BooleanProperty(False)
    waiting = BooleanProperty(False)  # after too many wrong ones
    side_by_side = BooleanProperty(False)  # the dots next to the keys

    __events__ = ("on_entered",)

    def __init__(self, **kwargs: Any) -> None:
        load_kv("common/pin")
        super().__init__(**kwargs)

    def on_pin(self, *_args: Any) -> None:
        self.ready = len(self.pin) >= SHORTEST

    def add_digit(self, digit: str) -> None:
        if not (self.busy or self.waiting) and len(self.pin) < LONGEST:
            self.pin, self.problem = self.pin + digit, ""

    def backspace(self) -> None:
        if not (self.busy or self.waiting):
            self.pin = self.pin[:-1]

    def done(self) -> None:
        if self.ready and not (self.busy or self.waiting):
            self.dispatch("on_entered", self.pin)

    def ask_again(self, problem: str = "", text: str = "") -> None:
        """Empty the digits and say why."""
        self.pin, self.problem, self.busy = "", problem, False
        self.text = text or self.text

    def takes_key(self, key: int, text: str) -> bool:
        if text.isascii() and text.isdecimal():
            self.add_digit(text)
        elif key == BACKSPACE:
            self.backspace()
        elif key in (ENTER, KEYPAD_ENTER):
            self.done()
        else:
            return False
        return True
