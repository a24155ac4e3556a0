"""What something has moved under a finger takes no tap: that was meant for what stood there before."""

from __future__ import annotations

import pytest
from kivy.uix.boxlayout import BoxLayout

from app.widgets.buttons import ChoiceChip, CommandButton, IconButton, Segments
from app.widgets.places import STILL
from app.widgets.scrolling import ScrollPage
from app.widgets.surfaces import Tap
from tests.ui.drawing import fired

KINDS = {
    "CommandButton": lambda: CommandButton(text="Reset"),
    "IconButton": lambda: IconButton(icon="close"),
    "ChoiceChip": lambda: ChoiceChip(text="All"),
    "Tap": Tap,
}
HIGH = 60  # px, of each part of the page


class Page:
    """Two buttons below each other on a page of that kind, and room for a notice above them; ``pressed`` are their numbers."""

    def __init__(self, ui, kind, make=Tap) -> None:
        self.ui, self.pressed = ui, []
        self.page = kind() if kind is ScrollPage else kind(orientation="vertical")
        self.notice, self.rest = BoxLayout(size_hint_y=None, height=0), BoxLayout(height=900)
        self.buttons = [make(), make()]
        for n, button in enumerate(self.buttons):
            button.size_hint, button.size = (None, None), (200, HIGH)
            button.bind(on_release=lambda _button, n=n: self.pressed.append(n))
        for part in (self.notice, *self.buttons, self.rest):
            self.page.add_widget(part)
        if kind is ScrollPage:
            self.page.spacing, self.rest.size_hint_y = 0, None
        ui.show(self.page, (400, 400))
        ui.advance(1)

    def place(self, n: int) -> tuple[float, float]:
        return self.buttons[n].to_window(*self.buttons[n].center)

    def notify(self) -> None:
        """The notice appears, as high as a button."""
        self.notice.height = HIGH


@pytest.mark.parametrize("page", [ScrollPage, BoxLayout])
@pytest.mark.parametrize(
    "kind", [kind if kind == "Tap" else pytest.param(kind, marks=pytest.mark.long) for kind in KINDS]
)
def test_what_has_just_come_under_the_finger_is_not_pressed(ui, page, kind):
    it = Page(ui, page, KINDS[kind])
    place = it.place(1)
    it.notify()
    ui.advance(0.1)
    ui.tap_at(*place)
    assert it.pressed == []
    ui.advance(STILL)
    ui.tap_at(*place)
    assert it.pressed == [0]


@pytest.mark.parametrize("page", [ScrollPage, BoxLayout])
def test_a_button_that_moves_while_a_finger_is_down_passes_the_tap_to_no_other(ui, page):
    """A page that scrolls hands on a tap only after the finger has left."""
    it = Page(ui, page)
    lift = ui.press(it.buttons[1])
    it.notify()
    lift(0.02)
    ui.advance(0.5)
    assert it.pressed in ([], [1])


def test_what_a_finger_has_scrolled_takes_a_tap_at_once(ui):
    it = Page(ui, ScrollPage)
    it.page.scroll_y -= 0.06
    ui.advance()
    ui.tap_at(*it.place(1))
    assert it.pressed == [1]


def test_what_grows_downwards_still_stands(ui):
    it = Page(ui, ScrollPage)
    it.buttons[1].height += HIGH
    ui.advance()
    ui.tap_at(*it.place(1))
    assert it.pressed == [1]


def test_a_new_button_takes_a_tap_at_once(ui):
    it = Page(ui, ScrollPage)
    button = CommandButton(text="Add")
    pressed = fired(button, "on_release")
    it.page.add_widget(button, index=1)
    ui.advance()
    ui.tap_at(*button.to_window(*button.center))
    assert len(pressed) == 1


def test_segments_that_a_notice_has_moved_choose_nothing(ui):
    page, notice = BoxLayout(orientation="vertical"), BoxLayout(size_hint_y=None, height=0)
    rows = [Segments(options=[(key, key)], size_hint_y=None, height=HIGH) for key in "ab"]
    for part in (notice, *rows, BoxLayout()):
        page.add_widget(part)
    ui.show(page, (400, 400))
    ui.advance(1)
    chosen = [fired(row, "on_choose") for row in rows]
    place = rows[1].to_window(*rows[1].center)
    notice.height = HIGH
    ui.advance(0.1)
    ui.tap_at(*place)
    assert chosen == [[], []]
