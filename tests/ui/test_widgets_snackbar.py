"""Snackbars: shown, undone, queued."""

from __future__ import annotations

import pytest
from kivy.core.window import Window
from kivy.uix.widget import Widget

from app.screens.common.overlays import Dialogs
from app.widgets.buttons import CommandButton
from app.widgets.snackbar import Message, Snackbar, Snackbars
from app.widgets.text import Txt


@pytest.fixture
def bars(ui):
    bars = Snackbars()
    bars.show("")  # the first one takes a moment to build, by which time would be ahead
    bars.clear()
    ui.advance()
    yield bars
    bars.clear()


def test_a_message_comes_and_goes(ui, bars):
    bars.show("Saved")
    ui.advance(0.3)
    assert "Saved" in ui.texts()
    ui.advance(4)
    assert bars.texts == []
    assert Window.children == []


def test_a_message_stays_in_sight_when_a_dialog_opens_over_it(ui, bars):
    bars.show("Saved")
    menu = Dialogs().menu(Widget(), "Sure?", [], print)
    ui.advance(0.3)
    assert Window.children[0] is bars.stack
    menu.dismiss()
    ui.advance(0.3)


def on_screen(ui) -> list[str]:
    return [bar.text for bar in ui.find_all(Snackbar)]


def test_a_message_on_screen_is_not_repeated(ui, bars):
    bars.show("Kits waits")
    ui.advance(3)
    bars.show("Kits waits")
    ui.advance(3)
    assert bars.texts == ["Kits waits"]  # as long as if it had come the second time only
    ui.advance(1.5)
    assert bars.texts == []


def test_a_repeated_message_becomes_the_newest(ui, bars):
    for text in ("Kits waits", "Saved", "Kits waits"):
        bars.show(text)
    assert bars.texts == ["Saved", "Kits waits"]
    ui.advance(0.3)
    assert on_screen(ui) == ["Kits waits"]


def test_an_outdated_message_is_not_repeated(ui, bars):
    bars.show("Aino pauses", about="aino")
    bars.show("Veikko pauses", about="veikko")
    bars.undo("Deleted", "Undo", lambda: None)
    bars.show("Aino continues", about="aino")
    assert bars.texts == ["Veikko pauses", "Deleted", "Aino continues"]
    bars.show("Aino pauses", about="aino")  # also in the place of the one that is seen
    ui.advance(0.3)
    assert on_screen(ui) == ["Aino pauses"]
    ui.advance(4)
    assert on_screen(ui) == ["Deleted"]


def test_the_same_words_about_something_else_end_what_was_said_about_that(ui, bars):
    bars.show("Veikko is held", about=2)
    bars.show("Released", about=1)
    bars.show("Released", about=2)
    assert bars.texts == ["Released"]
    bars.show("Veikko is held", about=2)
    assert bars.texts == ["Veikko is held"]
    bars.end(1)
    assert bars.texts == ["Veikko is held"]
    bars.end(2)
    assert bars.texts == []


def test_a_message_about_many_ends_when_it_ends_for_one(ui, bars):
    bars.post(Message("Both are held", about=frozenset([1, 2])))
    bars.show("Sampo is held", about=3)
    bars.end(3)
    assert bars.texts == ["Both are held"]
    bars.show("Veikko is released", about=2)
    assert bars.texts == ["Veikko is released"]
    bars.post(Message("Both are held", about=frozenset([1, 2])))
    bars.end(1)
    assert bars.texts == []


def test_a_message_about_nothing_ends_no_other(ui, bars):
    bars.show("Saved")
    bars.show("Copied")
    assert bars.texts == ["Saved", "Copied"]


def test_only_the_newest_is_shown_so_that_nothing_under_the_top_bar_is_covered(ui, bars):
    for n in range(3):
        bars.undo(f"Deleted {n}", "Undo", lambda: None)
        ui.advance(0.3)
    assert on_screen(ui) == ["Deleted 2"]
    assert bars.stack.height <= 64 - 4
    assert bars.stack.below == 2


def test_a_covered_message_returns_for_the_rest_of_its_time_unless_it_was_read(ui, bars):
    bars.undo("Deleted", "Undo", lambda: None)
    ui.advance(3)
    bars.show("Read")
    ui.advance(2.5)  # more than half of its time
    bars.show("Unread")
    ui.advance(1)
    bars.show("Saved")
    ui.advance(4.2)
    assert on_screen(ui) == ["Unread"]
    ui.advance(3.2)
    assert on_screen(ui) == ["Deleted"]
    assert bars.stack.below == 0
    ui.advance(4.2)
    assert on_screen(ui) == ["Deleted"]
    ui.advance(0.8)
    assert on_screen(ui) == []


def test_a_finger_does_not_press_a_button_that_has_just_replaced_another(ui, bars):
    undone: list[str] = []
    bars.undo("Deleted A", "Undo", lambda: undone.append("A"))
    ui.advance(1)
    lift = ui.press(ui.find(Txt, text="Undo"))
    bars.undo("Deleted B", "Undo", lambda: undone.append("B"))
    ui.advance(0.1)
    lift()  # what was shown when the finger came down
    word = ui.find(Txt, text="Undo")
    ui.tap_at(*word.to_window(*word.center))  # too soon after B has come
    ui.advance(0.2)
    assert undone == ["A"]
    ui.tap_text("Undo")
    assert undone == ["A", "B"]


def test_undo_lasts_eight_seconds_and_runs_once(ui, bars):
    calls: list[str] = []
    bars.undo("Schedule deleted", "Undo", lambda: calls.append("undo"))
    ui.advance(7.5)
    ui.tap_text("Undo")
    assert calls == ["undo"]
    ui.advance(10)
    assert calls == ["undo"]
    assert "Schedule deleted" not in ui.texts()


def test_an_undo_that_is_not_pressed_ends(ui, bars):
    bars.undo("Robot deleted", "Undo", lambda: None)
    ui.advance(8.2)
    assert bars.texts == []


def test_each_of_two_deletions_keeps_its_own_undo(ui, bars):
    undone: list[str] = []
    bars.undo("Deleted A", "Undo A", lambda: undone.append("A"))
    ui.advance(5)
    bars.undo("Deleted B", "Undo B", lambda: undone.append("B"))
    ui.advance(5)
    ui.tap_text("Undo B")
    ui.advance(1)
    ui.tap_text("Undo A")
    assert undone == ["B", "A"]


def test_what_is_next_to_a_message_can_be_pressed(ui, bars):
    button = ui.show(CommandButton(text="Pause"), (200, 64))
    taps: list[int] = []
    button.bind(on_release=lambda *_: taps.append(1))
    bars.show("Saved")
    ui.advance(0.3)
    ui.tap(button)
    assert taps == [1]


def test_clearing_ends_every_message(ui, bars):
    for n in range(5):
        bars.undo(f"Deleted {n}", "Undo", lambda: None)
    bars.clear()
    ui.advance()
    assert (bars.texts, ui.texts()) == ([], [])


def test_built_again_for_other_sizes_an_undo_still_works(ui, bars):
    undone: list[str] = []
    for name in ("A", "B"):
        bars.undo(f"Deleted {name}", f"Undo {name}", lambda name=name: undone.append(name))
    ui.advance(1)
    old = ui.find(Snackbar)
    bars.rebuild()
    ui.advance(1)
    assert ui.find(Snackbar) is not old
    for name in ("B", "A"):
        ui.tap_text(f"Undo {name}")
        ui.advance(1)
    assert (undone, bars.texts) == (["B", "A"], [])


def test_undo_is_pressed_by_a_tap_near_its_text(ui, bars):
    undone: list[str] = []
    for x in (-27, 27):
        bars.undo("Schedule deleted", "Undo", lambda: undone.append("undo"))
        ui.advance(1)
        word = ui.find(Txt, text="Undo")
        left, y = word.to_window(word.x, word.center_y)
        ui.tap_at(left + x if x < 0 else left + word.width + x, y)
    assert undone == ["undo"] * 2
