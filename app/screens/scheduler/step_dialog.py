"""The dialog that asks for a number of a schedule: the common values as chips, any other by steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kivy.properties import ListProperty, NumericProperty, ObjectProperty

from app.screens.common.options import Option
from app.screens.scheduler.form_view import Steps
from app.widgets.dialogs import FormDialog


class StepDialog(FormDialog):
    """``chosen`` is a number or the key of a chip; ``done(chosen)`` when it is confirmed."""

    steps = ObjectProperty(None, rebind=True)
    chosen = ObjectProperty(None, allownone=True)
    number = NumericProperty(0)  # that holds
    chips = ListProperty()

    def __init__(self, steps: Steps, chosen: float | None, done: Callable[[Any], object], **kwargs: Any) -> None:
        self._done = done
        super().__init__(steps=steps, chosen=chosen, **kwargs)
        self.fbind("chosen", self._show)
        self._show()

    def _show(self, *_args: object) -> None:
        self.number = self.steps.number(self.chosen)
        self.chips = [Option(key, text, selected=self.chosen == key) for key, text in self.steps.chips]

    def typed(self, text: str) -> None:
        """Every number within the range is chosen at once."""
        if text.isdecimal() and self.steps.minimum <= int(text) <= self.steps.maximum:
            self.chosen = int(text)

    def choose(self, chosen: float | None) -> None:
        """A chip takes the place of what was typed."""
        self.chosen = chosen
        self.ids.number.show()

    def set(self) -> None:
        """Not while the field holds no number of the range, as it shows."""
        if self.ids.number.outside:
            return
        self.dismiss()
        self._done(self.chosen)
