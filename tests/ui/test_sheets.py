"""Sheets: where they lie in each window, what closes them, and how a draft comes back."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from kivy.core.window import Window
from kivy.factory import Factory
from kivy.properties import StringProperty
from kivy.uix.label import Label

from app.screens.common.sheets import Sheets
from app.screens.common.view_model import Navigator, ScreenBase, Snackbars
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.dock import dock
from app.widgets.fields import Field
from app.widgets.menu import ESCAPE
from app.widgets.sheet import Sheet, SheetPlace

WIDE, LOW, SMALL, TALL = (1280, 800), (1024, 600), (819, 480), (800, 1280)


class Page(ScreenBase):
    name = StringProperty()


@pytest.fixture
def room(ui):
    """The frame's place with a page in it, two screens, and the sheets."""
    place = SheetPlace()
    frame = ui.show(place)
    manager = Factory.Screens()
    place.add_widget(manager)
    navigator, snackbars = Navigator(manager, dict.fromkeys(("home", "logs"), Page)), Snackbars()
    navigator.go("home")
    yield SimpleNamespace(
        place=frame, navigator=navigator, snackbars=snackbars, sheets=Sheets(place, snackbars, navigator)
    )
    snackbars.clear()


def tall_body(height: float) -> Label:
    return Label(text="x", size_hint_y=None, height=height)


@pytest.mark.parametrize(
    ("size", "values", "expected"),
    [
        (WIDE, {}, (860, 0, 420, 800)),
        (WIDE, {"span": 688}, (592, 0, 688, 800)),
        (WIDE, {"edge": "bottom"}, (0, 0, 1280, 308)),
        (WIDE, {"edge": "full"}, (0, 0, 1280, 800)),
        (LOW, {"keeps": 380}, (380, 0, 644, 600)),
        (SMALL, {}, (399, 0, 420, 480)),
        (TALL, {}, (0, 0, 800, 1280)),
        (TALL, {"tall_edge": "bottom"}, (0, 0, 800, 308)),
    ],
)
def test_a_sheet_lies_where_its_window_has_room(ui, room, size, values, expected, monkeypatch):
    monkeypatch.setattr(Window, "_size", size)
    room.place.size = size
    sheet = Sheet(title="Aino", foot="Save", **values)
    sheet.add_widget(tall_body(124))
    room.sheets.show(sheet)
    ui.advance(0.1)
    assert (*sheet.pos, *sheet.size) == expected


def test_the_page_shrinks_beside_a_sheet_unless_the_sheet_only_covers_it(ui, room):
    room.sheets.show(Sheet())
    assert room.place.taken == 420
    room.sheets.show(Sheet(shrinks=False))
    assert room.place.taken == 0


def test_a_sheet_ends_above_the_keyboard(ui, room):
    sheet = room.sheets.show(Sheet(foot="Save"))
    dock.height = 250
    ui.advance(0.1)
    assert (sheet.y, sheet.top) == (250, Window.height)
    dock.height = 0


@pytest.mark.parametrize("way", ["cross", "escape", "screen", "same screen"])
def test_a_sheet_closes_by_its_cross_by_esc_and_with_its_screen(ui, room, way):
    sheet = room.sheets.show(Sheet())
    ui.advance(1)
    if way == "cross":
        ui.tap(ui.find(IconButton, sheet, icon="close"))
    elif way == "escape":
        ui.key(ESCAPE)
    else:
        room.navigator.go("logs" if way == "screen" else "home")
    assert (sheet.parent, room.sheets.top) == (None, None)
    assert room.snackbars.texts == []


def test_undo_brings_back_what_was_entered_even_from_another_screen(ui, room):
    field = Field(label="Name")
    sheet = Sheet(draft=True)
    sheet.add_widget(field)
    room.sheets.show(sheet)
    field.text = "Aino"
    room.navigator.go("logs")
    ui.advance(1)
    ui.tap_text("Undo")
    assert room.navigator.current == "home"
    assert room.sheets.top is sheet
    assert field.text == "Aino"


def test_what_was_saved_is_not_offered_again(room):
    room.sheets.show(Sheet(draft=True))
    room.sheets.close(room.sheets.top)
    assert room.snackbars.texts == []


def test_what_is_saved_after_its_cross_was_pressed_is_not_offered_any_more(room):
    first, second = (room.sheets.show(Sheet(draft=True)) for _n in range(2))
    room.sheets.dismiss(second)
    assert room.snackbars.texts == ["Not saved", "Not saved"]
    room.sheets.close(second.proxy_ref)
    assert room.snackbars.texts == ["Not saved"]
    room.sheets.close(first)
    assert room.snackbars.texts == []


@pytest.mark.parametrize("way", ["arrow-left", "close", "escape"])
def test_a_sheet_that_lies_over_another_leads_back_to_it(ui, room, way):
    first = room.sheets.show(Sheet(title="New schedule"))
    second = room.sheets.over(Sheet(title="From"))
    ui.advance(1)
    assert first.parent is None
    if way == "escape":
        ui.key(ESCAPE)
    else:
        ui.tap(ui.find(IconButton, second, icon=way))
    assert room.sheets.top is first


@pytest.mark.parametrize(("way", "answers"), [("Clear", ["yes"]), ("Keep", []), ("escape", []), ("another screen", [])])
def test_every_way_out_of_a_question_but_yes_does_nothing(ui, room, way, answers):
    said = []
    room.sheets.ask("Clear the queue?", "", "Clear", lambda: said.append("yes"), "Keep")
    ui.advance(1)
    if way == "escape":
        ui.key(ESCAPE)
    elif way == "another screen":
        room.navigator.go("logs")
    else:
        ui.tap(ui.find(CommandButton, text=way))
    assert (said, room.sheets.top) == (answers, None)


def test_a_sheet_that_is_shown_again_stays_below_what_lies_over_it(room):
    first = room.sheets.show(Sheet())
    asked = room.sheets.ask("Release?", "", "Release", lambda: None, "Keep")
    room.sheets.show(first)
    assert room.sheets.top is asked


def test_a_sheet_that_is_done_takes_no_other_with_it(room):
    first = room.sheets.show(Sheet())
    asked = room.sheets.ask("Release?", "", "Release", lambda: None)
    room.sheets.close(first)
    assert room.sheets.top is asked
    asked.dispatch("on_done")
    assert room.sheets.top is None
    another = room.sheets.show(Sheet(draft=True))
    room.sheets.close(first)
    assert room.sheets.top is another


def test_undo_of_one_draft_offers_the_other_one(ui, room):
    first, second = (room.sheets.show(Sheet(draft=True)) for _n in range(2))
    for brought_back in (first, second):
        ui.advance(1)
        ui.tap_text("Undo")
        assert room.sheets.top is brought_back
    assert room.snackbars.texts == ["Not saved"]


def test_undo_waits_for_the_guard_of_the_screen_and_is_offered_until_it_lets_pass(ui, room):
    sheet, asked = room.sheets.show(Sheet(draft=True)), []
    room.navigator.go("logs")
    room.navigator.guard = lambda _screen, proceed: asked.append(proceed)
    ui.advance(1)
    ui.tap_text("Undo")
    assert (room.sheets.top, room.snackbars.texts) == (None, ["Not saved"])
    asked.pop()()
    assert (room.navigator.current, room.sheets.top, room.snackbars.texts) == ("home", sheet, [])
    assert not asked  # once is enough


def test_a_second_tap_presses_neither_the_sheet_that_came_nor_the_page_after_it_went(ui, room):
    pressed = []
    below = CommandButton(text="Below", size_hint=(None, None), size=(400, 72), pos=(870, 12))
    below.bind(on_release=lambda *_args: pressed.append("page"))
    room.place.add_widget(below)
    sheet = Sheet(foot="Run on Aino")
    sheet.bind(on_done=lambda *_args: pressed.append("foot"))
    ui.advance(1)
    room.sheets.show(sheet)
    ui.tap_at(1000, 40)
    assert pressed == []
    ui.advance(1)
    ui.tap_at(1000, 40)
    room.sheets.close(room.sheets.top)
    for _n in range(2):  # the button was pressed five times within a second
        ui.tap_twice((1000, 40), 0.2)
    assert pressed == ["foot"]
    ui.advance(1)
    ui.tap_at(1000, 40)
    assert pressed == ["foot", "page"]


def test_the_button_at_the_foot_takes_the_room_of_one_that_went(ui, room):
    sheet = Sheet(title="Check-up", foot="Run trial", second="Check again")
    room.sheets.show(sheet)
    ui.advance(0.1)
    sheet.second = ""
    ui.advance(0.1)
    assert ui.find(CommandButton, sheet, text="Run trial").width > 300


def test_a_sheet_lets_no_tap_through_and_says_why_its_button_is_off(ui, room):
    pressed = []
    room.place.add_widget(CommandButton(text="Below", on_release=lambda *_args: pressed.append("page")))
    sheet = room.sheets.show(Sheet(foot="Run on Aino", foot_off="Reset errors first"))
    sheet.bind(on_done=lambda *_args: pressed.append("foot"))
    ui.advance(1)
    ui.tap(sheet)
    ui.tap_text("Run on Aino")
    assert pressed == []
    assert "Reset errors first" in ui.texts()


def test_a_double_tap_asks_once(ui, room):
    below, done = room.sheets.show(Sheet()), []
    for number in range(2):
        sheet = room.sheets.ask(
            "Cancel Deliver?", "", "Cancel mission", lambda number=number: done.append(number), "Keep"
        )
    sheet.dispatch("on_other")
    assert done == [1]
    assert room.sheets.top is below


def test_a_late_tap_at_the_foot_does_not_press_what_has_come_there(ui, room):
    sheet, pressed = room.sheets.show(Sheet(foot="Save", second="Test")), []
    sheet.bind(on_done=lambda *_args: pressed.append(sheet.foot), on_other=lambda *_args: pressed.append(sheet.second))
    ui.advance(1)
    test = ui.find(CommandButton, text="Test")
    ui.tap(test)
    ui.advance(1.2)
    sheet.foot, sheet.second = "Test", "Save anyway"
    ui.advance(0.1)
    ui.tap(test)
    assert pressed == ["Test"]
    ui.advance(1)
    ui.tap(test)
    assert pressed == ["Test", "Save anyway"]


def test_a_foot_that_changes_by_a_tap_elsewhere_takes_the_next_press(ui, room):
    body, pressed = tall_body(300), []
    sheet = Sheet(foot="Set 06:00", on_done=pressed.append)
    sheet.add_widget(body)
    room.sheets.show(sheet)
    ui.advance(1)
    ui.tap(body)
    sheet.foot = "Set 07:00"
    ui.tap(ui.find(CommandButton, text="Set 07:00"))
    assert pressed == [sheet]


def test_the_foot_alone_fills_the_place_of_both(ui, room):
    sheet = room.sheets.show(Sheet(foot="Check up", second="Run trial"))
    ui.advance(0.1)
    sheet.foot, sheet.second = "Stop", ""
    ui.advance(0.1)
    stop = ui.find(CommandButton, text="Stop")
    assert (stop.x, stop.right) == (sheet.x + 20, sheet.right - 20)
