"""The one row of all lists: what it shows, what a tap on each of its parts is, and how it changes in a list."""

from __future__ import annotations

from dataclasses import replace

import pytest
from kivy.lang import Builder

from app.widgets.buttons import Toggle
from app.widgets.items import Action, Item
from app.widgets.list_row import ListRow, RowButton, RowIcon
from app.widgets.lists import Rows
from app.widgets.long_list import LongList
from app.widgets.tokens import tk

CANCEL = Action("cancel", icon="close")
WAITING = Item(
    1, "Bring pallet to dock", "Veikko on hold", lead="14:35", icon="timer-sand", tone="attention", look="tint"
)


def listed(ui, *items: Item, kind=LongList, width: float = 600, viewclass: str = "ListRow"):
    """A list of the items, and the actions that come from it."""
    rows, calls = ui.show(kind(viewclass=viewclass, data=list(items)), (width, 500)), []
    rows.bind(on_action=lambda _rows, key, name, *values: calls.append((key, name, *values)))
    return rows, calls


def row(ui, key) -> ListRow:
    return ui.find(ListRow, key=key)


@pytest.mark.parametrize("kind", [Rows, LongList])
def test_a_row_shows_its_item_in_each_kind_of_list(ui, kind):
    listed(ui, replace(WAITING, meta="19 %", aside="any of Hall 1", note="since 14:00"), kind=kind)
    assert set(ui.texts()) == {
        "14:35",
        "Bring pallet to dock",
        "any of Hall 1",
        "Veikko on hold",
        "19 %",
        "since 14:00",
    }


def test_a_tap_on_the_row_opens_it_and_one_on_a_button_does_what_the_button_says(ui):
    _, calls = listed(ui, Item(1, "Collect empties", actions=(CANCEL, Action("run", "Run here"))))
    ui.tap_text("Collect empties")
    ui.tap_text("Run here")
    cross = ui.find(RowIcon)
    ui.tap(cross)
    assert [call[:2] for call in calls] == [(1, "open"), (1, "run"), (1, "cancel")]
    assert calls[2][2] is cross, "a menu needs a widget to hang on"


def test_a_switch_shows_what_is_and_asks_for_what_is_wanted(ui):
    _, calls = listed(ui, Item(1, "Coils to store", on=True))
    ui.tap(ui.find(Toggle))
    assert calls == [(1, "switch", False)]
    assert ui.find(Toggle).active


def test_a_row_that_does_not_open_leaves_taps_alone(ui):
    _, calls = listed(ui, Item(1, "Tomorrow", look="head"), Item(2, "Robots answer", opens=False))
    ui.tap_text("Tomorrow")
    ui.tap_text("Robots answer")
    assert calls == []


def test_a_button_that_is_off_does_nothing_and_the_row_says_why(ui):
    _, calls = listed(ui, Item(1, "Dock 3", opens=False, actions=(Action("more", icon="plus", off="Only 3 robots"),)))
    ui.tap(ui.find(RowIcon))
    assert calls == []
    assert "Only 3 robots" in ui.texts()


def test_buttons_stay_while_only_their_words_change(ui):
    rows, _ = listed(ui, Item(1, "Now", actions=(Action("cancel", "Cancel"),)))
    button = ui.find(RowButton)
    rows.data = [Item(1, "Now", actions=(Action("cancel", "Cancel 2"),))]
    assert ui.find(RowButton) is button
    assert button.text == "Cancel 2"


def test_answers_share_a_line_of_their_own_below_the_question(ui):
    answers = tuple(Action(word, word, tone="action") for word in ("Yes", "No"))
    listed(ui, Item(1, "Robot 7", "Is the pallet loaded?", actions=answers, below=True))
    yes, no = ui.find_all(RowButton)
    assert yes.width == no.width > 250
    assert yes.top <= ui.find(text="Is the pallet loaded?").y


def test_answers_that_wrap_are_as_high_as_their_words(ui):
    answers = (Action("a", "Loaded, go on"), Action("b", "Skip this stop"))
    listed(ui, Item(1, "Robot 7", actions=answers, below=True), width=230)
    buttons = ui.find_all(RowButton)
    assert [button.height >= button.natural_height > tk.h_touch for button in buttons] == [True, True]
    assert row(ui, 1).y <= min(button.y for button in buttons)


def test_columns_begin_at_the_same_place_in_all_rows(ui):
    Builder.load_string(
        "<TryColumns@ListRow>:\n    lead_width: sp(92)\n    place_width: sp(90)\n    meta_width: sp(160)\n"
    )
    listed(
        ui,
        Item(1, "Deliver kits", lead="15:00", place="Aino", meta="14:05", meta_icon="check", on=True),
        Item(2, "Spare run to press", lead="–", place="Onni", meta="Battery 12 %", meta_icon="check", on=True),
        width=1000,
        viewclass="TryColumns",
    )
    for one, other in (("Deliver kits", "Spare run to press"), ("Aino", "Onni"), ("14:05", "Battery 12 %")):
        assert ui.find(text=one).x == ui.find(text=other).x


def test_a_folded_row_says_place_and_meta_below_its_title(ui):
    Builder.load_string("<TryFolded@ListRow>:\n    place_width: sp(90)\n    folded: True\n")
    listed(ui, Item(1, "Deliver kits", "Hourly", place="Aino", meta="6 min"), viewclass="TryFolded")
    assert set(ui.texts()) == {"Deliver kits", "Aino · Hourly · 6 min"}


def test_a_title_is_as_wide_as_its_row_when_nothing_stands_beside_it_any_more(ui):
    rows, _ = listed(ui, Item(1, "Robot 17"))
    usual = ui.find(text="Robot 17").width
    for aside in ("since 14:00", ""):
        rows.data = [Item(1, "Robot 17", aside=aside)]
        ui.advance(0.1)
    assert ui.find(text="Robot 17").width == usual


@pytest.mark.parametrize("icon", ["", "hand-back-right-outline"])
def test_a_long_meta_wraps_and_leaves_room_for_the_title(ui, icon):
    meta = "on hold, will not run after 14:50, and neither will the next one"
    listed(ui, Item(1, "Waste to compactor", meta=meta, meta_icon=icon, actions=(CANCEL,)), width=472)
    title, said = ui.find(text="Waste to compactor"), ui.find(text=meta)
    assert said.lines > 1
    assert title.right <= said.x
    assert title.width > 150
    assert said.height < row(ui, 1).height


def test_a_tinted_row_has_the_colours_of_its_tone_also_after_a_switch_of_the_theme(ui):
    listed(ui, WAITING, Item(2, "Late", tone="fault", support="x", support_tone="attention"))
    for theme in ("light", "dark", "contrast"):
        tk.use(theme)
        assert row(ui, 1).md_bg_color == tk.attention_bg
        assert ui.find(text="Bring pallet to dock").color == tk.attention_on
        assert ui.find(text="Late").color == tk.ink
        assert ui.find(text="x").color == tk.attention


def test_rows_are_at_least_56_high_and_grow_with_their_texts(ui):
    listed(ui, Item(1, "One"), Item(2, "Two", "with a support that is so long that it needs more than one line " * 3))
    assert row(ui, 1).height == 56
    assert row(ui, 2).height > 88
