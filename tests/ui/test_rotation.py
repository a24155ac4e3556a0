"""A tablet that is turned while the app runs: the window follows, with what was open in it."""

from __future__ import annotations

import pytest
from kivy.core.window import Window

from app.widgets.fields import SearchField
from app.widgets.frame import Frame, NavItem
from app.widgets.keyboard import DockedKeyboard
from app.widgets.sheet import Sheet
from tests.ui import checks

LANDSCAPE, PORTRAIT = (1280, 800), (800, 1280)
pytestmark = pytest.mark.long


@pytest.fixture
def turn(ui):
    before = tuple(Window.size)

    def turn(size: tuple[int, int]) -> None:
        Window.size = size
        ui.advance(0.5)

    yield turn
    turn(before)


def is_whole(ui) -> bool:
    """The frame fills the window, and its navigation is a rail at the side or a bar below."""
    rows, columns = ({round(getattr(item, axis)) for item in ui.find_all(NavItem)} for axis in ("y", "x"))
    has_bar = len(rows) == 1 and len(columns) == 4
    has_rail = len(columns) == 1 and len(rows) == 4
    frame = ui.find(Frame)
    return tuple(frame.size) == tuple(Window.size) and (has_rail if Window.width > Window.height else has_bar)


@pytest.mark.parametrize("screen", ["home", "scheduler", "logs", "settings"])
def test_each_page_follows_the_display_and_back(site, app, ui, turn, screen):
    site.add_robots()
    for size in (LANDSCAPE, PORTRAIT, LANDSCAPE):
        turn(size)
        ui.tap(ui.find(NavItem, name=screen))
        ui.wait(lambda: app.shell.background.idle)
        ui.advance(0.5)
        assert is_whole(ui)
        turn(size[::-1])
        assert is_whole(ui)
        assert checks.problems(ui.find(Frame)) == []


def test_an_open_sheet_its_text_and_the_keyboard_follow_too(site, app, ui, turn):
    site.container.catalogue.change_settings(keyboard="on")
    turn(LANDSCAPE)
    app.shell.go("settings", section="scheduler")
    ui.wait(lambda: app.shell.background.idle)
    app.shell.navigator.screen("settings").page.pick_timezone()
    ui.advance(0.5)
    ui.type(ui.find(SearchField), "Hels")
    ui.wait(lambda: ui.find_all(DockedKeyboard))
    for size in (PORTRAIT, LANDSCAPE):
        turn(size)
        keyboard, sheet = ui.find(DockedKeyboard), ui.find(Sheet)
        assert (keyboard.y, keyboard.width) == (0, Window.width)
        assert sheet.y >= keyboard.top - 1
        assert sheet.top <= Window.height
        assert ui.find(SearchField).text == "Hels"
