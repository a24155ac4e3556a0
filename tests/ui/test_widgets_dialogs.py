"""Menus and choices: ways in and out, what they hand over, and that nothing of them stays behind."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Callable

import pytest
from kivy.core.window import Window
from kivy.tests.common import UnitTestTouch

from app.screens.common.overlays import Dialogs
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.items import Option
from app.widgets.long_list import LongList
from app.widgets.menu import Menu
from app.widgets.sheet import Sheet
from app.widgets.text import Txt
from tests.support.examples import at_night

ESCAPE, BACKSPACE, ENTER = 27, 8, 13


@pytest.fixture
def dialogs(ui) -> Dialogs:
    return Dialogs()


def press(ui, word: str) -> None:
    ui.tap(ui.find(CommandButton, text=word))


# ---------------------------------------------------------------------- choose
MISSIONS = [Option(n, f"Mission {n}", note="on Aino only" if n == 7 else "") for n in range(30)]


def test_a_short_list_shows_all_options_also_with_long_notes(ui, dialogs):
    options = [Option(n, f"Mission {n}", note="Another mission of this name is here already " * 3) for n in range(4)]
    dialogs.choose("Missions", options, lambda key: None)
    ui.advance(0.5)
    last, around = ui.find(OptionRow, title="Mission 3"), ui.find(LongList)
    assert last.to_window(*last.pos)[1] >= around.to_window(*around.pos)[1]


def test_choosing_hands_over_the_key_and_closes(ui, dialogs):
    chosen: list[int] = []
    dialogs.choose("Mission", MISSIONS, chosen.append, selected=2)
    ui.advance(0.2)
    assert ui.find(OptionRow, key=2).item.look == "chosen"
    ui.tap(ui.find(Txt, text="Mission 3"))
    ui.advance(0.3)
    assert chosen == [3]
    assert dialogs.top is None


def test_search_narrows_by_all_words_in_text_and_note(ui, dialogs):
    dialog = dialogs.choose("Mission", MISSIONS, lambda key: None)
    ui.advance(0.2)
    dialog.query = "AINO miss"
    ui.advance(0.2)
    assert [row.item.title for row in ui.find_all(OptionRow)] == ["Mission 7"]
    dialog.query = "nothing like it"
    ui.advance(0.2)
    assert "Nothing found" in ui.texts()


def test_ticks_are_confirmed_in_the_options_order(ui, dialogs):
    chosen: list[list[int]] = []
    dialogs.choose_many("Missions", MISSIONS[:4], "Add", chosen.append, selected=[2])
    ui.advance(0.2)
    for word in ("Mission 3", "Mission 0", "Mission 2"):
        ui.tap(ui.find(Txt, text=word))
    press(ui, "Add")
    assert chosen == [[0, 3]]


@pytest.mark.parametrize(("way", "kept"), [("arrow-left", [[0, 3]]), ("close", [])])
def test_the_arrow_takes_ticks_along_to_the_sheet_that_asked_and_the_cross_does_not(ui, dialogs, way, kept):
    below, chosen = dialogs.sheets.show(Sheet(title="Place")), []
    choice = dialogs.choose_many("Missions", MISSIONS[:4], "Set", chosen.append, selected=[0])
    ui.advance(1)
    ui.tap(ui.find(Txt, text="Mission 3"))
    ui.tap(ui.find(IconButton, choice, icon=way))
    assert (chosen, dialogs.sheets.top) == (kept, below)
    dialogs.sheets.close(below)


# ---------------------------------------------------------------------- menu
def test_a_menu_hangs_on_its_widget_inside_the_window(ui, dialogs):
    button = ui.show(CommandButton(text="More"), (200, 64))
    for x, y in ((0, 736), (1080, 0), (600, 400)):
        button.pos = x, y
        ui.advance()
        menu = dialogs.menu(
            button, "Deliver kits", [Option("run", "Run now"), Option("delete", "Delete")], lambda key: None
        )
        ui.advance()
        assert menu.x >= 0
        assert menu.right <= Window.width
        assert menu.y >= 0
        assert menu.top <= Window.height
        assert menu.top <= button.y or menu.y >= button.top
        menu.dismiss()
        ui.advance()


def test_a_card_at_the_left_of_the_page_leaves_the_rail_free(ui, dialogs):
    bar = ui.show(CommandButton(text="06:30"), (80, 48))
    bar.pos = 110, 400
    ui.advance()
    menu = dialogs.menu(bar, "Deliver kits", [Option("edit", "Edit")], lambda key: None)
    ui.advance()
    assert menu.x == bar.x
    menu.dismiss()
    ui.advance()


@pytest.mark.parametrize("x", [300, 900])
def test_a_card_points_at_the_middle_of_what_is_narrow(ui, dialogs, x):
    bar = ui.show(CommandButton(text=""), (6, 48))
    bar.pos = x, 400
    ui.advance()
    card = dialogs.menu(bar, "Deliver kits", [Option("edit", "Edit")], lambda key: None)
    ui.advance()
    assert card.tip == bar.center_x
    card.dismiss()
    ui.advance()


@pytest.mark.parametrize(("y", "is_below"), [(700, True), (40, False)])
def test_a_card_points_at_what_it_is_about(ui, dialogs, y, is_below):
    bar = ui.show(CommandButton(text="06:30"), (80, 48))
    bar.pos = 300, y
    ui.advance()
    card = dialogs.menu(bar, "Deliver kits", [Option("edit", "Edit")], lambda key: None)
    ui.advance()
    assert (card.tip, card.is_below) == (bar.center_x, is_below)
    card.dismiss()
    menu = dialogs.menu(bar, "", [Option("edit", "Edit")], lambda key: None)
    ui.advance()
    assert menu.tip == 0
    menu.dismiss()
    ui.advance()


def test_a_menu_hands_over_its_key_and_says_why_one_is_off(ui, dialogs):
    button = ui.show(CommandButton(text="More"), (200, 64))
    chosen: list[str] = []
    dialogs.menu(
        button, "Deliver kits", [Option("run", "Run now"), Option("delete", "Delete", off="In use")], chosen.append
    )
    ui.advance()
    ui.tap(ui.find(Txt, text="In use"))
    assert chosen == []
    ui.tap(ui.find(Txt, text="Run now"))
    assert chosen == ["run"]
    assert dialogs.top is None


# ---------------------------------------------------------------------- size and memory
def question(dialogs: Dialogs) -> tuple[Sheet, Callable[[], object]]:
    sheet = dialogs.sheets.ask("Sure?", "", "Yes", print, "No")
    return sheet, lambda: dialogs.sheets.close(sheet)


def menu(dialogs: Dialogs) -> tuple[Menu, Callable[[], object]]:
    opened = dialogs.menu(Window.children[0], "", [Option(1, "Run")], print)
    return opened, opened.dismiss


def all_collected(ui, references: list[weakref.ref]) -> bool:
    """A dialog is freed in stages, within half a second: bindings of kv and delayed calls hold it until its children
    are freed."""
    for _stage in range(10):
        ui.advance()
        gc.collect()
        if all(reference() is None for reference in references):
            return True
    return False


@pytest.mark.parametrize("kind", [question, menu])
def test_closed_ones_are_freed(ui, dialogs, kind):
    references = []
    ui.show(CommandButton(text="More"), (200, 64))
    for _n in range(2):
        opened, close = kind(dialogs)
        ui.advance()
        close()
        references.append(weakref.ref(opened))
        del opened, close
    assert all_collected(ui, references)


@pytest.mark.long
def test_eighty_closed_ones_are_all_freed(ui):
    ui.show(CommandButton(text="More"), (200, 64))
    dialogs, behind = Dialogs(), list(Window.children)
    references = []
    for _round in range(40):
        for kind in (question, menu):
            opened, close = kind(dialogs)
            ui.advance(0.15)
            assert opened.opacity == pytest.approx(1)
            close()
            ui.advance(0.15)
            references.append(weakref.ref(opened))
            del opened, close
        gc.collect()
    assert len(references) == 80
    assert Window.children == behind
    assert all_collected(ui, references)


@pytest.mark.parametrize("pause", [0.15, *at_night(0.05)])
def test_the_second_of_two_quick_taps_presses_nothing_in_what_the_first_has_opened(ui, dialogs, pause):
    """And it doesn't close it either."""
    button = ui.show(CommandButton(text="Mission", radius=[0, 0, 0, 0]), (600, 600))
    button.pos_hint, button.center = {}, Window.center
    chosen: list[object] = []

    def open_it(*_args) -> None:
        dialogs.choose("Mission", [Option(n, str(n)) for n in range(7)], chosen.append)

    button.bind(on_release=open_it)
    ui.advance()
    for place in (Window.center, (Window.width / 2 - 290, Window.height / 2 + 290)):
        for _n in range(2):
            touch = UnitTestTouch(*place)
            touch.touch_down()
            ui.advance(0.05)
            touch.touch_up()
            ui.advance(pause)
        ui.advance(1)
        assert (len(ui.find_all(ChoiceSheet)), chosen) == (1, [])
        ui.key(ESCAPE)
        ui.advance(1)
    ui.tap_at(*Window.center)
    ui.tap(ui.find_all(OptionRow)[0])
    assert chosen == [0]


@pytest.mark.long
def test_the_last_option_is_there_whatever_is_searched_for(ui, dialogs):
    chosen: list[object] = []
    dialog = dialogs.choose("Mission", MISSIONS, chosen.append, last=Option("fetch", "Not in the list?"))
    ui.advance(0.2)
    dialog.query = "nothing like it"
    ui.advance(0.2)
    assert ([row.item.title for row in ui.find_all(OptionRow)], dialog.found()) == (["Not in the list?"], [])
    dialog.query = "on aino only"
    assert [choice.key for choice in dialog.found()] == [7]  # Enter chooses the only one
    ui.advance(0.2)
    ui.tap(ui.find(OptionRow, key="fetch"))
    assert chosen == ["fetch"]
