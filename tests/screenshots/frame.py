"""What is around a screen: navigation, top bar, clock."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from kivy.factory import Factory

from app.screens.common import formats
from app.screens.common.sheets import Sheets
from app.screens.frame.controller import NAVIGATION, screen_word
from tests.support import home_facts as sample

if TYPE_CHECKING:
    from app.widgets.frame import Frame


def framed(name: str) -> Frame:
    """An empty frame, as it is with the screen of that name."""
    frame: Frame = Factory.Frame()
    frame.items = [(key, screen_word(key), icon, selected) for key, icon, selected in NAVIGATION]
    frame.current, frame.ids.bar.title = name, screen_word(name)
    frame.ids.bar.clock = formats.clock_time(sample.NOW, sample.SETTINGS.timezone)
    return frame


def sheets_of(studio: Any, frame: Frame) -> Sheets:
    """Those that lie in ``frame``, for the dialogs too, until the picture is cleared away."""
    before = studio.dialogs.sheets
    studio.afterwards(lambda: setattr(studio.dialogs, "sheets", before))
    studio.dialogs.sheets = Sheets(frame.ids.sheets.__self__)
    sheets: Sheets = studio.dialogs.sheets
    return sheets
