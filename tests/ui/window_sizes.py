"""Windows of other sizes than the usual one, with larger texts, in Finnish, or with gloves; and what can be reached in them."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from kivy.core.window import Window
from kivy.metrics import Metrics
from kivy.uix.scrollview import ScrollView
from kivy.uix.widget import Widget

from app.i18n import translator
from app.screens.common.overlays import Dialogs
from app.widgets.frame import Frame
from app.widgets.tokens import tk
from tests.ui import checks
from tests.ui.driver import Driver


class Rig:
    """What tests/screenshots/home.py asks of a studio."""

    def __init__(self, ui: Driver) -> None:
        self.dialogs, self._ui, self.driver = Dialogs(), ui, ui
        self.after: list[Callable[[], object]] = []

    def afterwards(self, close: Callable[[], object]) -> None:
        self.after.append(close)

    def directory(self) -> Path:
        made = TemporaryDirectory(prefix="amr-pictures-")
        self.after.append(made.cleanup)
        return Path(made.name)

    def close(self) -> None:
        """The last one first."""
        while self.after:
            self.after.pop()()

    def show(self, widget: Widget) -> None:
        self._ui.show(widget)


@contextmanager
def window(
    ui: Driver, size: tuple[int, int], scale: float = 1.0, language: str = "en", *, gloves: bool = False
) -> Iterator[Rig]:
    """Everything is built at that size; nothing is resized."""
    before = Window.size
    Window.size, Metrics.fontscale = size, scale
    tk.use("light", gloves=gloves)
    translator.use(language)
    rig = Rig(ui)
    try:
        yield rig
    finally:
        rig.close()
        for child in list(Window.children):
            Window.remove_widget(child)
        ui.skip(1)  # what was to happen to it: that would keep it
        gc.collect()  # or all of it would be laid out again for what follows
        translator.use("en")
        tk.use("light")
        Metrics.fontscale, Window.size = 1.0, before


def reach(ui: Driver, widget: Widget) -> None:
    """Scroll what is around ``widget``; all of it must then be seen, in the window's part for screens."""
    for view in checks.parents(widget):
        if isinstance(view, ScrollView) and view.do_scroll_y:
            view.scroll_to(widget, padding=0, animate=False)
            ui.advance()
    whole, seen = checks.area(widget), checks.visible_area(widget, checks.parents(widget))
    left, bottom, right, top = checks.area(ui.find(Frame).ids.body)
    assert seen == pytest.approx(whole, abs=2), f"{checks.name_of(widget)} can't be reached"
    assert left - 2 <= whole[0] <= whole[2] <= right + 2
    assert bottom - 2 <= whole[1] <= whole[3] <= top + 2
