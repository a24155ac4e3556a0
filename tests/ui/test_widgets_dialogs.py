"""Dialogs: ways in and out, what they hand over, and that nothing of them stays behind."""

from __future__ import annotations

import gc
import weakref

import pytest
from kivy.core.window import Window
from kivy.lang import Builder
from kivy.tests.common import UnitTestTouch
from kivy.uix.widget import Widget
from kivymd.uix.dialog.dialog import MDDialogScrim

from app.screens.common.options import MenuItem, Option
from app.screens.common.overlays import Dialogs
from app.widgets.buttons import CommandButton
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.dialogs import ConfirmDialog, Dialog, Menu
from app.widgets.fields import Field
from app.widgets.long_list import LongList
from app.widgets.rest import DOUBLE_TAP
from app.widgets.text import Txt
from app.widgets.tokens import apply_theme, tk

ESCAPE, BACKSPACE, ENTER = 27, 8, 13


@pytest.fixture
def dialogs(ui) -> Dialogs:
    return Dialogs(animate=False)


def press(ui, word: str) -> None:
    ui.tap(ui.find(CommandButton, text=word))


# ---------------------------------------------------------------------- confirm
def test_yes_is_said_once_and_closes(ui, dialogs):
    said: list[str] = []
    dialogs.confirm(
        "Clear the queue?", "3 missions", "Clear", lambda: said.append("yes"), declined=lambda: said.append("no")
    )
    ui.advance()
    press(ui, "Clear")
    ui.advance(0.3)
    assert said == ["yes"]
    assert dialogs.top is None
    assert Window.children == []


@pytest.mark.parametrize("way_out", ["button", "escape"])
def test_every_other_way_out_is_a_no(ui, dialogs, way_out):
    said: list[str] = []
    dialogs.confirm(
        "Clear the queue?", "3 missions", "Clear", lambda: said.append("yes"), declined=lambda: said.append("no")
    )
    ui.advance()
    if way_out == "button":
        press(ui, "Keep")
    else:
        ui.key(ESCAPE)
    ui.advance(0.3)
    assert said == ["no"]


def test_escape_closes_a_form(ui, dialogs):
    dialog = Dialog(title="Add robot")
    dialog.add_widget(Field(label="Name", text="Aino"))
    dialogs.open(dialog)
    ui.advance()
    ui.key(ESCAPE)
    assert dialogs.top is None


def test_a_tap_outside_a_question_does_not_answer_it(ui, dialogs):
    said: list[str] = []
    dialogs.confirm("Clear?", "", "Clear", lambda: said.append("yes"), declined=lambda: said.append("no"))
    ui.advance()
    ui.tap_at(5, 5)
    assert said == []
    assert isinstance(dialogs.top, ConfirmDialog)


def test_escape_closes_the_topmost_only(ui, dialogs):
    dialogs.choose("Robot", [Option(1, "Aino")], lambda key: None)
    dialogs.confirm("Sure?", "", "Yes", lambda: None)
    ui.advance()
    ui.key(ESCAPE)
    assert isinstance(dialogs.top, ChoiceSheet)
    ui.advance(DOUBLE_TAP)
    ui.key(ESCAPE)
    assert dialogs.top is None


def test_buttons_behind_a_dialog_cannot_be_pressed(ui, dialogs):
    button = ui.show(CommandButton(text="Pause"), (200, 64))
    taps: list[int] = []
    button.bind(on_release=lambda *_: taps.append(1))
    dialogs.confirm("Sure?", "", "Yes", lambda: None)
    ui.advance()
    ui.tap(button)
    assert taps == []


def test_a_finger_on_the_sheet_of_a_dialog_presses_nothing(ui, dialogs):
    dialog = dialogs.confirm("Sure?", "", "Yes", lambda: None)
    ui.advance()
    touch = UnitTestTouch(dialog.x + 4, dialog.center_y)
    touch.touch_down()
    ui.advance()
    assert dialog.state == "normal"
    touch.touch_up()
    assert dialogs.top is dialog


def test_the_scrim_follows_the_theme(ui, dialogs):
    dialogs.confirm("Sure?", "", "Yes", lambda: None)
    ui.advance()
    behind = ui.find(MDDialogScrim)
    for theme in ("dark", "light"):
        apply_theme(ui.app.theme_cls, theme)
        assert [*behind.color[:3], behind.alpha] == list(tk.scrim)


# ---------------------------------------------------------------------- choose
MISSIONS = [Option(n, f"Mission {n}", note="on Aino only" if n == 7 else "") for n in range(30)]


@pytest.mark.parametrize("body", [100, 101, 102.5])
def test_a_dialog_lies_on_whole_pixels(ui, dialogs, body):
    dialog = dialogs.open(Dialog(title="Odd"))
    dialog.add_widget(Widget(size_hint_y=None, height=body))
    ui.advance(0.3)
    assert dialog.pos == [round(dialog.x), round(dialog.y)]
    assert abs(dialog.center_y - Window.height / 2) <= 1


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


# ---------------------------------------------------------------------- menu
def test_a_menu_hangs_on_its_widget_inside_the_window(ui, dialogs):
    button = ui.show(CommandButton(text="More"), (200, 64))
    for x, y in ((0, 736), (1080, 0), (600, 400)):
        button.pos = x, y
        ui.advance()
        menu = dialogs.menu(
            button, "Deliver kits", [MenuItem("run", "Run now"), MenuItem("delete", "Delete")], lambda key: None
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
    bar = ui.show(CommandButton(text="06:30"), (20, 48))
    bar.pos = 110, 400
    ui.advance()
    menu = dialogs.menu(bar, "Deliver kits", [MenuItem("edit", "Edit")], lambda key: None)
    ui.advance()
    assert menu.x == bar.x
    menu.dismiss()
    ui.advance()


def test_a_menu_hands_over_its_key(ui, dialogs):
    button = ui.show(CommandButton(text="More"), (200, 64))
    chosen: list[str] = []
    dialogs.menu(
        button, "Deliver kits", [MenuItem("run", "Run now"), MenuItem("delete", "Delete", disabled=True)], chosen.append
    )
    ui.advance()
    ui.tap(ui.find(Txt, text="Delete"))
    assert chosen == []
    ui.tap(ui.find(Txt, text="Run now"))
    assert chosen == ["run"]
    assert dialogs.top is None


# ---------------------------------------------------------------------- size and memory
class TallDialog(Dialog):
    pass


def test_a_dialog_is_as_high_as_it_needs_and_scrolls_beyond(ui, dialogs):
    Builder.load_string(
        """
<TallDialog>:
    title: "Tall"
    DialogActions:
        CommandButton:
            text: "Close"
""",
        filename="tall-dialog",
    )
    try:
        dialog = dialogs.open(TallDialog())
        for _n in range(3):
            dialog.add_widget(CommandButton(text="x"))
        ui.advance()
        low = dialog.height
        assert low < 500
        for _n in range(30):
            dialog.add_widget(CommandButton(text="x"))
        ui.advance()
        assert dialog.height == Window.height - 32
        assert dialog.ids.page.content_height > dialog.ids.page.height
        close = ui.find(CommandButton, text="Close")
        assert close.to_window(*close.pos)[1] > 0  # its buttons stay in sight
    finally:
        Builder.unload_file("tall-dialog")


KINDS = {
    "confirm": lambda: ConfirmDialog(title="Sure?", confirm="Yes", decline="No"),
    "menu": lambda: Menu(items=[MenuItem(1, "Run")], anchor=Window.children[0]),
}


def all_collected(ui, references: list[weakref.ref]) -> bool:
    """A dialog is freed in stages, within half a second: bindings of kv and delayed calls hold it until its children
    are freed."""
    for _stage in range(10):
        ui.advance()
        gc.collect()
        if all(reference() is None for reference in references):
            return True
    return False


@pytest.mark.parametrize("kind", list(KINDS))
def test_closed_dialogs_are_freed(ui, dialogs, kind):
    references = []
    ui.show(CommandButton(text="More"), (200, 64))
    for _n in range(2):
        dialog = dialogs.open(KINDS[kind]())
        ui.advance()
        dialog.dismiss()
        references.append(weakref.ref(dialog))
        del dialog
    assert all_collected(ui, references)


@pytest.mark.long
def test_eighty_closed_dialogs_are_all_freed(ui):
    ui.show(CommandButton(text="More"), (200, 64))
    dialogs, behind = Dialogs(), list(Window.children)
    references = []
    for _round in range(40):
        for make in KINDS.values():
            dialog = dialogs.open(make())
            ui.advance(0.15)
            assert dialog.opacity == pytest.approx(1)
            dialog.dismiss()
            ui.advance(0.15)
            references.append(weakref.ref(dialog))
            del dialog
        gc.collect()
    assert len(references) == 80
    assert Window.children == behind
    assert all_collected(ui, references)


@pytest.mark.parametrize("pause", [0.05, 0.15])
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
