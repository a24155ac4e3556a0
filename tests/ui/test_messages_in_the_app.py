"""A message lies where nobody presses anything, whatever the screen and the window."""
from __future__ import annotations

import pytest
from kivy.core.window import Window
from kivy.uix.widget import Widget

from app.widgets.snackbar import SnackbarStack
from app.window.key_focus import KeyFocus, parents
from tests.ui import checks
from tests.ui.whole_app import shown


def below(stack: SnackbarStack) -> list[Widget]:
    """What can be pressed, or typed into, and is under a message."""
    left, bottom, right, top = checks.area(stack)
    found = []
    for target in KeyFocus().targets():
        seen = checks.visible_area(target, checks.parents(target))
        if stack not in parents(target) and seen and seen[0] < right and left < seen[2] and seen[1] < top and bottom < seen[3]:
            found.append(target)
    return found


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
                ui.advance(.5)
                app.shell.snackbars.undo("Schedule deleted: Waste to compactor", "Undo", lambda: None)
                ui.advance(.5)
                stack = ui.find(SnackbarStack)
                assert [checks.name_of(target) for target in below(stack)] == [], screen
                assert checks.problems(stack) == []
                app.shell.snackbars.clear()
    finally:
        Window.size = before
