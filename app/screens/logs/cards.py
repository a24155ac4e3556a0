"""The widgets of the Logs that kv/logs lays out."""

from __future__ import annotations

from typing import Any

from kivy.clock import Clock
from kivy.properties import ObjectProperty

from app.widgets import figure_charts, flow, lanes, list_row  # noqa: F401  (registers kivy classes)
from app.widgets.long_list import LongList


class RunsList(LongList):
    """The runs. The row of ``opened_run`` is scrolled into sight, once it is in the list."""

    opened_run = ObjectProperty(None, allownone=True)

    def __init__(self, **kwargs: Any) -> None:
        self._is_pending = False  # opened, but perhaps not in the list yet: it is still being read
        self._reveal_soon = Clock.create_trigger(self._reveal, 0)
        super().__init__(**kwargs)
        self.bind(opened_run=self._opened, data=self._reveal_soon)

    def _opened(self, *_args: object) -> None:
        self._is_pending = self.opened_run is not None
        self._reveal_soon()

    def _reveal(self, _dt: float) -> None:
        if self._is_pending and any(row.key == self.opened_run for row in self.data):
            self._is_pending = False
            self.reveal(self.opened_run)
