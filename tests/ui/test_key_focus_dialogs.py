"""Keys and dialogs: the topmost only, its search, and the place that is kept when it closes."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import date, time, timedelta

import pytest
from kivy.core.window import Window

from app.screens.common.overlays import Dialogs
from app.screens.common.sheets import Sheets
from app.widgets.buttons import CommandButton
from app.widgets.choices import ChoiceSheet
from app.widgets.dock import dock
from app.widgets.items import Item, Option
from app.widgets.long_list import LongList
from app.widgets.menu import Menu
from app.widgets.month import MonthDay
from app.widgets.pickers import TimeSheet
from app.widgets.scrolling import ScrollPage
from app.widgets.sheet import Sheet, SheetPlace
from app.window.key_focus import ARROWS, ENTER, ESCAPE, TAB
from tests.ui.ring import page_of, ring_at

UP, DOWN, RIGHT, LEFT = ARROWS


def test_enter_presses_the_ring_also_where_a_sheet_has_a_use_for_it(ui, keys):
    ui.show(page_of("One"), (300, 300))
    picked: list[date] = []
    dialogs, day = Dialogs(), date(2026, 11, 20)
    dialogs.pick_date("Day", day, picked.append, today=day)
    ui.advance(0.5)
    while getattr(keys.target, "icon", "") != "close":
        ui.key(TAB)
    ui.key(ENTER)
    assert (picked, dialogs.top) == ([], None)
    ui.advance(1)
    dialogs.pick_date("Day", day, picked.append, today=day)
    ui.advance(0.5)
    ui.key(ENTER)  # no ring in it: Enter is the sheet's
    assert picked == [day]


def test_after_a_dialog_the_ring_is_where_it_was(ui, keys):
    ui.show(page_of("One", "Two", "Three"), (300, 300))
    ui.key(TAB)
    ui.key(TAB)
    Sheets().ask("Sure?", "It is gone then.", "Delete", print, "Keep")
    ui.advance(0.5)
    ui.key(TAB)
    ui.key(TAB)
    assert keys.target.text == "Keep"
    ui.key(ENTER)
    ui.advance(1)
    assert keys.target.text == "Two"
    ui.key(TAB)
    assert keys.target.text == "Three"


@pytest.mark.parametrize("key", [TAB, DOWN])
def test_the_ring_goes_from_a_row_of_a_long_list_into_its_menu(ui, keys, key):
    rows = LongList(viewclass="OptionRow", data=[Item(n, f"Option {n}", icon="star") for n in range(40)])
    ui.show(rows, (300, 300))
    ui.key(TAB)
    assert keys.target.item.title == "Option 0"
    menu = Menu(anchor=keys.target, items=[Option("edit", "Edit", "pencil"), Option("delete", "Delete", "delete")])
    menu.open()
    ui.advance(0.5)
    ui.key(key)
    assert keys.target.item.text == "Edit"
    ui.key(key)
    assert keys.target.item.text == "Delete"
    menu.dismiss()
    ui.advance(0.5)
    ui.key(key)
    assert keys.target.item.title == "Option 1"


@pytest.fixture
def picker(ui, keys) -> Iterator[tuple[ChoiceSheet, list[object]]]:
    """Whose search field is typed into, and what is chosen in it."""
    ui.show(page_of("Zero", "One", "Two"), (300, 300))
    ui.key(TAB)
    ui.key(TAB)
    dialog, chosen = ChoiceSheet(title="Mission", options=[Option(n, f"Option {n}") for n in range(30)]), []
    Sheets().pick(dialog, chosen.append)
    ui.advance(0.5)
    ui.find(LongList, dialog).scroll_y = 0.2
    ui.advance(0.2)
    while dock.field is None:
        ui.key(TAB)
    Window.dispatch("on_textinput", "2")
    yield dialog, chosen
    close(ui)


@pytest.mark.parametrize("key", [DOWN, ENTER])
def test_from_the_search_field_the_ring_goes_to_the_first_that_is_found(ui, keys, picker, key):
    dialog, chosen = picker
    assert (dialog.query, dock.field is not None) == ("2", True)
    ui.key(key)
    assert (keys.target.item.title, dock.field, chosen) == ("Option 2", None, [])
    ui.key(DOWN)
    assert keys.target.item.title == "Option 12"
    ui.key(ENTER)
    ui.advance(0.5)
    assert (chosen, dialog.parent) == ([12], None)
    assert keys.target.text == "One"


def test_down_goes_to_the_first_of_all_where_nothing_was_typed(ui, keys, picker):
    dialog, _chosen = picker
    dialog.query = ""
    ui.find(LongList, dialog).scroll_y = 0.2
    ui.advance(0.2)
    ui.key(DOWN)
    assert keys.target.item.title == "Option 0"


@pytest.mark.long
def test_enter_chooses_the_only_one_that_is_found(ui, keys, picker):
    dialog, chosen = picker
    Window.dispatch("on_textinput", "7")  # a scanner sends its Enter at once
    ui.key_down(ENTER)
    ui.key(ENTER)
    ui.advance(0.5)
    assert (chosen, dialog.parent, dock.field) == ([27], None, None)
    ui.advance(0.5)
    assert keys.target.text == "One"
    ui.key(TAB)
    assert keys.target.text == "Two"
    ui.key(ENTER)
    assert chosen == [27]


def test_enter_where_nothing_is_found_stays_in_the_search_field(ui, keys, picker):
    dialog, chosen = picker
    Window.dispatch("on_textinput", "x")
    ui.key(ENTER)
    ui.key(DOWN)
    assert (dialog.parent is not None, chosen, dock.field is not None) == (True, [], True)


def test_only_the_topmost_dialog_is_reached_and_what_was_before_it_comes_back(ui, keys):
    ui.show(page_of("One", "Two"), (300, 300))
    ui.key(TAB)
    dialog = Sheets().ask("Sure?", "It is gone then.", "Delete", print, "Keep")
    ui.advance(0.5)
    ui.key(TAB)
    assert [target.text for target in keys.targets()] == ["Delete", "Keep"]
    assert keys.target.text == "Delete"
    ui.key(ESCAPE)
    assert dialog.parent is None
    assert {target.text for target in keys.targets()} == {"One", "Two"}
    ui.advance(0.5)


def opening(*words: str) -> tuple[ScrollPage, list[ChoiceSheet]]:
    """A page whose buttons open a choice, and those that were opened."""
    page, opened = page_of(*words), []

    def choose(*_args) -> None:
        opened.append(ChoiceSheet(title="Choose", options=[Option(n, str(n)) for n in range(9)]))
        Sheets().pick(opened[-1], print)

    for button in page.ids.column.children:
        button.bind(on_release=choose)
    return page, opened


def close(ui) -> None:
    """A field is left by the first Escape."""
    while dock.field is not None or dock.question or any(isinstance(top, Menu) for top in Window.children):
        ui.key(ESCAPE)
    ui.advance(0.5)


@pytest.mark.long
@pytest.mark.parametrize("does", ["nothing", "tabs"])
def test_after_escape_the_ring_continues_where_the_dialog_was_opened(ui, keys, does):
    page, opened = opening("One", "Two", "Three")
    ui.show(page, (300, 300))
    for key in (TAB, TAB, ENTER):
        ui.key(key)
    ui.advance(0.5)
    assert len(opened) == 1
    if does == "tabs":
        ui.key(TAB)
    close(ui)
    assert keys.target.text == "Two"
    ui.key(TAB)
    assert keys.target.text == "Three"


def test_what_replaced_the_opener_has_the_ring(ui, keys):
    page, _opened = opening("One", "Two", "Three")
    ui.show(page, (300, 300))
    for key in (TAB, TAB, ENTER, TAB):
        ui.key(key)
    ui.advance(0.5)
    page.ids.column.remove_widget(next(button for button in page.ids.column.children if button.text == "Two"))
    ui.advance()
    close(ui)
    assert keys.target.text == "Three"


@pytest.mark.long
@pytest.mark.parametrize(
    ("opens", "reached"),
    [
        (lambda row: Menu(anchor=row, items=[Option("edit", "Edit"), Option("delete", "Delete")]).open(), "Edit"),
        (lambda _row: Sheets().ask("Sure?", "It is gone then.", "Delete", print, "Keep"), None),
        (lambda _row: Sheets().pick(TimeSheet(time(15, 0), title="Time"), print), "Set 15:00"),
    ],
    ids=["menu", "question", "time"],
)
def test_the_ring_goes_into_what_enter_opens_but_no_question_and_back(ui, keys, opens, reached):
    page = ui.show(page_of("One", "Two"), (300, 300))
    two = ui.find(CommandButton, page, text="Two")
    two.bind(on_release=opens)
    for key in (TAB, TAB, ENTER):
        ui.key(key)
    ui.advance(1)
    ringed = [getattr(each, "text", "") or each.item.text for each in keys.targets() if each is keys.target]
    assert ringed == ([reached] if reached else [])
    close(ui)
    assert keys.target is two


@pytest.mark.long
def test_the_ring_goes_from_a_menu_into_the_sheet_and_back_through_its_question(ui, keys):
    place = SheetPlace()
    place.add_widget(page_of("Dots", "Two"))
    page, sheets = ui.show(place, (300, 300)), Sheets(place)
    dots, button = ui.find(CommandButton, page, text="Dots"), CommandButton(text="Delete", height=64)
    sheet = Sheet(title="Mission")
    sheet.add_widget(button)
    button.bind(on_release=lambda _button: sheets.ask("Sure?", "It is gone then.", "Delete", print, "Keep"))
    menu = Menu(anchor=dots, items=[Option("edit", "Edit")])
    menu.bind(on_choose=lambda *_args: sheets.show(sheet))
    dots.bind(on_release=lambda _dots: menu.open())
    for key, reached in (
        (TAB, dots),
        (ENTER, None),
        (ENTER, button),
        (ENTER, button),
        (ESCAPE, button),
        (ESCAPE, dots),
    ):
        ui.key(key)
        ui.advance(1)
        assert reached in (None, keys.target)


def test_one_escape_too_many_hides_the_ring(ui, keys):
    ui.show(page_of("One", "Two", "Three"), (300, 300))
    for key in (TAB, TAB, ESCAPE):
        ui.key(key)
    assert keys.target is None
    ui.key(TAB)
    assert keys.target.text == "One"


def test_from_a_menu_through_a_dialog_the_ring_comes_back_to_what_opened_the_menu(ui, keys):
    page = ui.show(page_of("One"), (300, 300))
    dots = page.ids.column.children[0]
    menu = Menu(anchor=dots, items=[Option("edit", "Edit"), Option("rename", "Rename")])
    menu.bind(on_choose=lambda *_args: Sheets().ask("Sure?", "Really", "Yes", print, "No"))
    page.add_widget(CommandButton(text="Other", height=64))
    ui.key(TAB)
    menu.open()
    ui.advance(0.5)
    ui.key(TAB)
    ui.key(TAB)
    ui.key(ENTER)
    ui.advance(0.5)
    ui.key(TAB)
    assert keys.target.text == "Yes"
    close(ui)
    assert keys.target is dots
    assert not keys._openers


def test_dialogs_that_fingers_opened_are_freed(ui, keys):
    page, opened = opening("One")
    ui.show(page, (300, 300))
    ui.tap_text("One")
    ui.advance(0.5)
    opened[0].dispatch("on_close")
    ui.advance(1)
    assert not keys._openers


@pytest.mark.parametrize(("selected", "reached"), [([3], "Option 3"), ([], "Option 0")])
def test_arrows_begin_at_what_is_chosen_in_a_list_and_not_at_the_cross(ui, keys, selected, reached):
    ui.show(page_of("One"), (300, 300))
    options = [Option(n, f"Option {n}") for n in range(5)]
    Sheets().pick(ChoiceSheet(title="Robot", options=options, selected=selected), print)
    ui.advance(0.5)
    ui.key(DOWN)
    ui.advance(0.1)
    assert keys.target.item.title == reached
    close(ui)


def test_enter_confirms_the_day_that_is_chosen_and_arrows_begin_at_it(ui, keys):
    ui.show(page_of("One"), (300, 300))
    dialogs, picked = Dialogs(), []
    dialogs.pick_date("Day", date(2026, 11, 20), picked.append, today=date(2026, 11, 18))
    ui.advance(0.5)
    ui.key(ENTER)
    ui.advance(0.5)
    assert picked == [date(2026, 11, 20)]
    picker = dialogs.pick_date("Day", date(2026, 11, 20), picked.append, today=date(2026, 11, 18))
    ui.advance(0.5)
    ui.key(DOWN)
    assert keys.target.item.day == date(2026, 11, 20)
    ui.key(DOWN)
    ui.key(ENTER)
    ui.advance(0.3)
    assert picker.chosen == date(2026, 11, 27)
    close(ui)


def test_arrows_go_from_month_to_month_as_far_as_days_can_be_chosen_and_tab_leaves_it(ui, keys):
    ui.show(page_of("One"), (300, 300))
    day, first = date(2026, 11, 27), date(2026, 11, 18)
    picker = Dialogs().pick_date("Day", day, print, today=first, first=first)
    ui.advance(0.5)
    ui.key(DOWN)
    week_before, day_before = day - timedelta(7), day - timedelta(8)
    for key, reached in (
        (DOWN, day + timedelta(7)),
        (UP, day),
        (UP, week_before),
        (UP, week_before),
        (LEFT, day_before),
    ):
        ui.key(key)
        ui.advance(0.1)
        assert (keys.target.item.day, picker.month) == (reached, reached.month)
    ui.key(TAB)
    assert not isinstance(keys.target, MonthDay)
    close(ui)


def test_the_ring_of_a_button_that_goes_is_in_the_sheet_that_comes(ui, keys):
    page, sheet, sheets = page_of("New", "Other"), Sheet(title="Schedule", foot="Save"), Sheets()
    sheet.add_widget(CommandButton(text="Mission", height=64))
    ui.show(page, (300, 300))

    def begin(button) -> None:
        button.parent.remove_widget(button)
        sheets.show(sheet)
        sheets.pick(ChoiceSheet(title="Mission", options=[Option(n, f"Option {n}") for n in range(9)]), print)
        rings.append(ring_at())

    rings: list[int] = []
    ui.find(CommandButton, text="New").bind(on_release=begin)
    ui.key(TAB)
    ui.key(ENTER)
    ui.advance(1)
    assert rings == [0]  # none is seen behind the list
    assert keys.target.item.title == "Option 0"
    ui.key(ENTER)
    ui.advance(1)
    assert keys.target.text == "Mission"
    sheets.close(sheet)
