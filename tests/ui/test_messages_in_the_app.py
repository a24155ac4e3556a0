"""A message never covers a tab, the foot button or a screen of the bar; in the top bar, which is wherever it fits, nothing at all."""

from __future__ import annotations

from itertools import product

import pytest
from kivy.core.window import Window
from kivy.uix.widget import Widget

from app.widgets.list_row import ListRow, RowPress
from app.widgets.snackbar import Snackbars, SnackbarStack
from app.widgets.surfaces import Tap
from app.widgets.tabs import TabButton
from app.window.key_focus import KeyFocus, parents
from tests.screenshots.planning import Stand
from tests.ui import checks
from tests.ui.whole_app import shown
from tests.ui.window_sizes import window

LONG = "Veikko · Reset errors: the robot doesn't answer: is it switched on and on this network?"


def below(stack: SnackbarStack) -> list[Widget]:
    """What can be pressed, or typed into, and is under a message; at the foot of the page rows may be, for its seconds."""
    left, bottom, right, top = checks.area(stack)
    found = []
    for target in KeyFocus().targets():
        if stack.low and isinstance(target, ListRow | RowPress | Tap) and not isinstance(target, TabButton):
            continue
        seen = checks.visible_area(target, checks.parents(target))
        if (
            stack not in parents(target)
            and seen
            and seen[0] < right
            and left < seen[2]
            and seen[1] < top
            and bottom < seen[3]
        ):
            found.append(target)
    return found


@pytest.mark.parametrize(
    ("size", "percent"), [((1280, 800), 130), *product(((1024, 600), (600, 480)), (100, 130)), ((800, 480), 100)]
)
def test_a_long_message_covers_no_tab_and_no_button(ui, size, percent):
    with window(ui, size, percent / 100) as rig:
        Stand(rig, "logs")
        bars = Snackbars()
        bars.undo(LONG, "Undo", lambda: None)
        ui.advance(0.5)
        stack = ui.find(SnackbarStack)
        assert [checks.name_of(target) for target in below(stack)] == []
        assert checks.problems(stack) == []
        bars.clear()


@pytest.mark.parametrize("size", [(1280, 800), (800, 1280), (1024, 600)])
@pytest.mark.parametrize("percent", [100, 130])
def test_a_message_covers_nothing_that_is_pressed(container, ui, size, percent):
    before = Window.size
    Window.size = size
    container.catalogue.change_settings(font_scale_percent=percent)
    try:
        with shown(container, ui) as app:
            for screen in ("home", "scheduler", "logs", "settings"):
                app.shell.go(screen)
                ui.wait(lambda: app.shell.background.idle)
                ui.advance(0.5)
                app.shell.snackbars.undo("Schedule deleted: Waste to compactor", "Undo", lambda: None)
                ui.advance(0.5)
                stack = ui.find(SnackbarStack)
                assert [checks.name_of(target) for target in below(stack)] == [], screen
                assert checks.problems(stack) == []
                app.shell.snackbars.clear()
    finally:
        Window.size = before
