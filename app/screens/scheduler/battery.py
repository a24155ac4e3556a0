"""The dialog that asks for a schedule's minimum battery: the common values as chips, any other by steps."""
from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kivy.properties import ListProperty, NumericProperty, ObjectProperty

from app.i18n import _
from app.screens.common import formats
from app.screens.common.options import Option
from app.widgets.dialogs import FormDialog

CHIPS = (10, 20, 30, 50)                 # %


class BatteryDialog(FormDialog):
    """``chosen`` in %: None as Settings, or the mission, have it (``inherited``), 0 no minimum. ``done(chosen)`` when it is confirmed."""
    chosen = ObjectProperty(None, allownone=True)
    percent = NumericProperty(0)         # that holds
    chips = ListProperty()

    def __init__(self, chosen: float | None, inherited: float | None, done: Callable[[float | None], object], **kwargs: Any) -> None:
        self._inherited, self._done = inherited or 0, done
        super().__init__(chosen=chosen, **kwargs)
        self.fbind("chosen", self._show)
        self._show()

    def _show(self, *_args: object) -> None:
        self.percent = self._inherited if self.chosen is None else self.chosen
        inherited = _("As in Settings: {minimum}").format(minimum=formats.percent(self._inherited) if self._inherited else _("none"))
        self.chips = [Option(None, inherited, selected=self.chosen is None), Option(0, _("No minimum"), selected=self.chosen == 0),
                      *(Option(value, formats.percent(value), selected=self.chosen == value) for value in CHIPS)]

    def set(self) -> None:
        self.dismiss()
        self._done(None if self.chosen is None else float(self.chosen))
