"""When touches and keys are ignored after something in front was closed, opened or moved."""

from __future__ import annotations

import pytest
from kivy.core.window import Window
from kivy.tests.common import UnitTestTouch
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.widget import Widget

from app.screens.common.overlays import Dialogs
from app.screens.common.view_model import ScreenBase
from app.widgets.buttons import CommandButton
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.fields import Field, FieldInput
from app.widgets.frame import Frame
from app.widgets.items import Option
from app.widgets.keyboard import DockedKeyboard
from app.widgets.menu import Menu
from app.widgets.rest import DOUBLE_TAP, SETTLES
from app.widgets.scrolling import ScrollPage
from app.widgets.snackbar import Snackbar, Snackbars
from app.window.key_focus import ENTER, ESCAPE, SPACE, TAB
from tests.ui.drawing import put_down
from tests.ui.integrator import key

MIDDLE = 640, 400


@pytest.fixture
def dialogs(ui) -> Dialogs:
    return Dialogs()


def filling(ui, text: str) -> CommandButton:
    """A button as large as the window, and square: a second goes into the pixels of such corners."""
    return ui.show(CommandButton(text=text, radius=[0, 0, 0, 0]), Window.size)


@pytest.fixture
def page(ui) -> CommandButton:
    """One button that fills the window; ``pressed`` is how often it was."""
    button = filling(ui, "Run")
    button.pressed = 0

    def count(_button: CommandButton) -> None:
        button.pressed += 1

    button.bind(on_release=count)
    return button


def opened(ui, dialogs: Dialogs, title: str = "Above") -> Menu:
    menu = dialogs.menu(Widget(), title, [], print)
    ui.advance(2 * DOUBLE_TAP)
    return menu


@pytest.mark.parametrize(("after", "pressed"), [(0.05, 0), (0.3, 0), (0.55, 0), (0.65, 1)])
def test_buttons_behind_a_closed_dialog_take_touches_again_after_a_moment(ui, page, dialogs, after, pressed):
    opened(ui, dialogs).dismiss()
    ui.advance(after)
    ui.tap_at(*MIDDLE)
    assert page.pressed == pressed


def test_a_frame_that_takes_long_to_draw_takes_nothing_of_the_moment(ui, page, dialogs):
    """The second tap was made while it was drawn, and is handed on after it."""
    opened(ui, dialogs).dismiss()
    ui.skip(1.2)
    ui.tap_at(*MIDDLE)
    assert page.pressed == 0
    ui.advance(DOUBLE_TAP)
    ui.tap_at(*MIDDLE)
    assert page.pressed == 1


def test_another_screen_takes_no_second_tap_where_the_finger_was(ui):
    frame = ui.show(Frame(current="home"), Window.size)
    frame.add_widget(screen := ScreenBase(name="home"))
    screen.add_widget(button := CommandButton(text="Save"))
    button.center = 200, 300
    pressed: list[str] = []
    button.bind(on_release=lambda _button: pressed.append("saved"))
    ui.advance(1)
    place = button.to_window(*button.center)
    ui.tap_at(*place)
    frame.current = "scheduler"
    ui.advance(0.3)
    ui.tap_at(*place)
    assert pressed == ["saved"]
    ui.advance(DOUBLE_TAP)
    ui.tap_at(*place)
    assert pressed == ["saved", "saved"]


def test_ignored_touches_do_not_make_it_longer(ui, page, dialogs):
    opened(ui, dialogs).dismiss()
    for _n in range(2):
        ui.tap_at(*MIDDLE)
    assert page.pressed == 0
    ui.tap_at(*MIDDLE)
    assert page.pressed == 1


def test_a_finger_that_came_down_before_and_leaves_after_presses_nothing(ui, page, dialogs):
    dialog = dialogs.menu(page, "Gone soon", [], print)
    dialog.add_widget(button := CommandButton(text="Clear"))
    done: list[str] = []
    button.bind(on_release=lambda _button: done.append("cleared"))
    ui.advance(2 * DOUBLE_TAP)
    touch = put_down(*button.to_window(*button.center))
    ui.advance(0.3)
    assert button.state == "down"
    dialog.dismiss()  # by itself: what it is about has ended
    ui.advance(0.1)
    touch.touch_up()
    ui.advance(1)
    assert (done, page.pressed) == ([], 0)


def test_a_tap_that_a_page_still_has_to_hand_on_is_lost_with_the_dialog(ui, page, dialogs):
    chosen: list[int] = []
    dialogs.choose("Mission", [Option(n, str(n)) for n in range(5)], chosen.append)
    ui.advance(2 * DOUBLE_TAP)
    row = ui.find_all(OptionRow)[0]
    ui.tap_twice(row.to_window(*row.center), 0.15)
    assert (chosen, page.pressed) == ([0], 0)


def test_a_dialog_behind_another_rests_too(ui, page, dialogs):
    form = dialogs.menu(page, "Schedule", [], print)
    form.add_widget(button := CommandButton(text="Save"))
    saved: list[str] = []
    button.bind(on_release=lambda _button: saved.append("saved"))
    opened(ui, dialogs)
    ui.advance(2 * DOUBLE_TAP)
    dialogs.top.dismiss()
    place = button.to_window(*button.center)
    ui.tap_at(*place)
    assert saved == []
    ui.advance(DOUBLE_TAP)
    ui.tap_at(*place)
    assert saved == ["saved"]


def test_a_dialog_that_another_has_opened_is_used_as_always(ui, page, dialogs):
    chosen: list[int] = []
    options = [Option(n, str(n)) for n in range(5)]
    dialogs.menu(page, "", [Option("next", "Next")], lambda _key: dialogs.choose("Which", options, chosen.append))
    ui.advance(2 * DOUBLE_TAP)
    ui.tap_text("Next")
    place = ui.find(OptionRow, title="3")
    ui.advance(SETTLES)
    ui.tap_at(*place.to_window(*place.center))
    assert chosen == [3]


def test_a_dialog_takes_its_first_touch_later_where_the_finger_was(ui, dialogs):
    """The second tap of a double tap comes down there."""
    page = filling(ui, "Choose")
    page.bind(
        on_release=lambda _button: dialogs.choose("Which", [Option(n, str(n)) for n in range(7)], lambda _key: None)
    )
    ui.tap_at(*MIDDLE)
    ui.advance(SETTLES - 0.25)
    ui.tap_at(*MIDDLE)
    assert ui.find_all(ChoiceSheet)


@pytest.mark.long
def test_a_double_tap_on_a_page_that_scrolls_opens_one_dialog(ui, dialogs):
    page = ScrollPage()
    page.add_widget(button := CommandButton(text="Mission", size_hint_y=None, height=64))
    page.add_widget(BoxLayout(size_hint_y=None, height=2000))
    button.bind(on_release=lambda _button: dialogs.choose("Mission", [Option(1, "One")], lambda _key: None))
    ui.show(page)
    for gap in (0.15, 0.2, 0.3, 0.5):
        ui.tap_twice(button.to_window(*button.center), gap)
        assert len(ui.find_all(ChoiceSheet)) == 1
        dialogs.close_all()
        ui.advance(1)


# ---------------------------------------------------------------------- keys
@pytest.mark.parametrize("code", [ENTER, SPACE])
def test_a_key_that_is_pressed_twice_presses_nothing_behind_what_it_closed(ui, keys, dialogs, page, code):
    ui.key(TAB)
    dialog = opened(ui, dialogs)
    dialog.add_widget(close := CommandButton(text="Close"))
    close.bind(on_release=dialog.dismiss)
    ui.advance()
    ui.key(TAB)
    for _n in range(2):
        ui.key(code)
    assert (dialog.parent, page.pressed) == (None, 0)
    ui.advance(DOUBLE_TAP)
    ui.key(code)
    assert page.pressed == 1


def test_a_key_that_is_held_from_the_moment_on_presses_nothing_afterwards(ui, keys, dialogs, page):
    ui.key(TAB)
    opened(ui, dialogs).dismiss()
    for _n in range(20):
        ui.key_down(ENTER)
        ui.advance(0.1)
    assert page.pressed == 0
    Window.dispatch("on_key_up", ENTER, 0)
    ui.key(ENTER)
    assert page.pressed == 1


def test_a_second_escape_closes_nothing_more(ui, dialogs):
    form, _picker = opened(ui, dialogs, "Schedule"), opened(ui, dialogs, "Time")
    ui.key(ESCAPE)
    ui.key(ESCAPE)
    assert dialogs.top is form
    ui.advance(DOUBLE_TAP)
    ui.key(ESCAPE)
    assert dialogs.top is None


@pytest.mark.parametrize("repeats_after", [0.3, 0.66, 1])
def test_an_escape_that_is_held_closes_one_dialog(ui, dialogs, repeats_after):
    """Some systems begin to repeat a key only after the moment in which keys are ignored."""
    lower, _upper = opened(ui, dialogs, "Schedule"), opened(ui, dialogs, "Time")
    ui.key_down(ESCAPE)
    ui.advance(repeats_after)
    for _n in range(20):
        ui.key_down(ESCAPE)
        ui.advance(0.03)
    assert dialogs.top is lower
    Window.dispatch("on_key_up", ESCAPE, 0)
    ui.key(ESCAPE)
    assert dialogs.top is None


def test_an_enter_that_is_held_answers_nothing_in_what_it_has_opened(ui, keys, dialogs):
    picked: list[object] = []
    page = filling(ui, "At")
    page.bind(on_release=lambda _button: dialogs.pick_time("At", None, picked.append))
    ui.key(TAB)
    ui.key_down(ENTER)
    ui.advance(0.66)
    for _n in range(20):
        ui.key_down(ENTER)
        ui.advance(0.03)
    Window.dispatch("on_key_up", ENTER, 0)
    assert (picked, dialogs.top is None) == ([], False)


def test_a_second_enter_is_not_for_what_the_first_has_opened(ui, keys, dialogs):
    picked: list[object] = []
    page = filling(ui, "At")
    page.bind(on_release=lambda _button: dialogs.pick_time("At", None, picked.append))
    ui.key(TAB)
    ui.key(ENTER)
    ui.key(ENTER)
    assert (picked, dialogs.top is None) == ([], False)
    ui.advance(SETTLES)
    ui.key(ENTER)
    assert [str(at) for at in picked] == ["00:00:00"]


# ---------------------------------------------------------------------- messages and the on-screen keyboard
@pytest.fixture
def bars(ui):
    bars = Snackbars()
    yield bars
    bars.clear()


@pytest.mark.parametrize("by", ["its button", "its time"])
def test_only_what_was_under_a_closed_message_ignores_touches(ui, page, bars, by):
    bars.undo("Schedule deleted", "Undo", lambda: None)
    ui.advance(1)
    place = ui.find(Snackbar).ids.snack_button.center
    if by == "its button":
        ui.tap_at(*place)
    else:
        bars.clear()
    ui.tap_at(*place)
    assert (bars.texts, page.pressed) == ([], 0)
    ui.tap_at(*MIDDLE)
    assert page.pressed == 1


@pytest.fixture
def board(ui):
    board = DockedKeyboard(lambda: True)
    board.start()
    yield board
    board.stop()


def test_the_key_that_closes_the_keyboard_leaves_nothing_to_a_second_tap(ui, board, page):
    column = ui.show(BoxLayout(orientation="vertical"))
    column.add_widget(field := Field(label="Name", size_hint_y=None))
    page.size_hint = 1, 1
    column.add_widget(page)
    ui.advance()
    ui.tap(ui.find(FieldInput))
    ui.advance(DOUBLE_TAP)
    done = key(ui, "done")
    ui.tap_twice(done.to_window(*done.center), 0.3)
    assert (field.focus, board.parent, page.pressed) == (False, None, 0)
    ui.advance(DOUBLE_TAP)
    ui.tap_at(*page.center)
    assert page.pressed == 1


def test_a_field_away_from_where_the_keyboard_was_takes_the_next_touch(ui, board):
    column = ui.show(BoxLayout(orientation="vertical"))
    column.add_widget(first := Field(label="Name", size_hint_y=None))
    column.add_widget(second := Field(label="Note", size_hint_y=None))
    column.add_widget(BoxLayout())
    ui.advance()
    ui.tap(ui.find(FieldInput, first))
    ui.advance(DOUBLE_TAP)
    ui.tap_at(*key(ui, "done").center)
    inside = ui.find(FieldInput, second)
    ui.tap_at(*inside.to_window(*inside.center))
    assert second.focus


def test_a_double_tap_on_a_field_types_nothing_on_the_keyboard_that_comes(ui, board):
    column = ui.show(BoxLayout(orientation="vertical"))
    column.add_widget(BoxLayout())
    column.add_widget(field := Field(label="Name", size_hint_y=None))
    inside = ui.find(FieldInput)
    ui.advance()
    for gap in (0.15, 0.3, 0.45, 0.58):
        ui.tap_twice(inside.to_window(*inside.center), gap)
        assert (field.text, board.parent is not None) == ("", True)
        inside.focus = False
        ui.advance(1)


def test_a_touch_that_is_ignored_ends_without_a_trace(ui, page, dialogs):
    opened(ui, dialogs).dismiss()
    touch = UnitTestTouch(*MIDDLE)
    touch.touch_down()
    ui.advance(DOUBLE_TAP)
    touch.touch_move(650, 400)
    touch.touch_up()
    ui.advance(0.3)
    assert (page.state, page.pressed) == ("normal", 0)
