"""How Home goes from the page of all robots to that of one, and back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kivy.clock import Clock
from kivy.input import MotionEvent
from kivy.properties import StringProperty
from kivy.uix.widget import Widget

from app.screens.common.view_model import ScreenBase

ALL_ROBOTS, NO_ROBOT = "fleet", "empty"
SECOND_TAP = 0.5  # s within which it follows the first


class Pages(ScreenBase):
    """``layout`` is what is shown. All robots and one other layout are both kept, so that either is shown at once, as
    it was left."""

    layout = StringProperty()

    def __init__(self, **kwargs: Any) -> None:
        self._pages: dict[str, Widget] = {}  # by layout
        self._rests_until = 0.0
        super().__init__(**kwargs)

    def turn_to(self, layout: str, build: Callable[[], Widget]) -> None:
        if layout == self.layout:
            return
        if ALL_ROBOTS in (layout, self.layout) and self.layout not in ("", NO_ROBOT):
            self._rests_until = Clock.get_time() + SECOND_TAP
        self.layout = layout
        if layout not in self._pages:
            self._pages = {name: page for name, page in self._pages.items() if ALL_ROBOTS in (name, layout)}
            self._pages[layout] = build()
        self.clear_widgets()
        self.add_widget(self._pages[layout])

    def on_touch_down(self, touch: MotionEvent) -> Any:
        """The second tap on a button that opened another page presses nothing there."""
        return Clock.get_time() < self._rests_until or super().on_touch_down(touch)
