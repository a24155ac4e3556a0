"""Pages with lists in them: a touch belongs to the list under the finger, else to the page around it."""

from __future__ import annotations

import pytest
from kivy.factory import Factory
from kivy.metrics import dp
from kivy.uix.boxlayout import BoxLayout

from app.widgets import load_kv
from app.widgets.buttons import Segment
from app.widgets.pages import LowColumn, LowPage


def tall(count: int, height: float = 60.0) -> list[Segment]:
    return [Segment(text=str(n), size_hint_y=None, height=dp(height)) for n in range(count)]


@pytest.fixture
def page(ui):
    """A page 300 px high with a button above a column: 600 px of content; 300 of them are the column's window on 1200
    px."""
    load_kv("widgets/slots")
    content = BoxLayout(orientation="vertical", size_hint_y=None, height=600)
    button = Segment(text="above", size_hint_y=None, height=300)
    column = LowColumn(size_hint_y=None, height=300)
    for widget in tall(20):
        column.add_widget(widget)
    content.add_widget(button)
    content.add_widget(column)
    page = LowPage(do_scroll_x=False)
    page.add_widget(content)
    ui.show(page, (400, 300))
    page.button, page.column = button, column
    return page


def test_a_tap_inside_and_one_outside_the_inner_column_press_once(page, ui):
    pressed = []
    page.button.bind(on_release=lambda _button: pressed.append("above"))
    ui.tap(page.button)
    ui.advance(0.5)
    page.scroll_y = 0
    ui.advance(0.3)
    first = next(widget for widget in page.column.walk() if isinstance(widget, Segment) and widget.text == "0")
    first.bind(on_release=lambda _button: pressed.append("0"))
    ui.tap(first)
    ui.advance(0.5)
    assert pressed == ["above", "0"]


def test_a_drag_in_the_column_scrolls_the_column_and_one_outside_it_the_page(page, ui):
    ui.drag(page.button, 0, 120)
    assert page.scroll_y < 1
    assert page.column.scroll_y == 1
    page.scroll_y = 0
    ui.advance(0.3)
    ui.drag(page.column, 0, 150)
    assert page.column.scroll_y < 1
    assert page.scroll_y == 0


def test_a_column_in_which_everything_fits_leaves_the_drag_to_the_page(page, ui):
    page.column.clear_widgets()
    page.column.add_widget(tall(1)[0])
    page.scroll_y = 0
    ui.advance(0.3)
    assert page.column.is_still
    ui.drag(page.column, 0, -120)
    assert page.scroll_y > 0


def test_a_page_in_which_everything_fits_is_not_in_the_way(ui):
    load_kv("widgets/slots")
    page, column = LowPage(do_scroll_x=False, do_scroll_y=False), LowColumn()
    box = Factory.RelativeLayout(size_hint_y=None, height=300)
    box.add_widget(column)
    page.add_widget(box)
    for widget in tall(20):
        column.add_widget(widget)
    ui.show(page, (400, 300))
    pressed = []
    button = next(widget for widget in column.walk() if isinstance(widget, Segment) and widget.text == "1")
    button.bind(on_release=lambda _button: pressed.append(1))
    ui.tap(button)
    ui.advance(0.5)
    assert pressed == [1]
    ui.drag(column, 0, 100)
    assert column.scroll_y < 1


def test_a_drag_continues_with_the_page_at_the_end_of_the_column(page, ui):
    page.scroll_y, page.column.scroll_y = 0, 1
    ui.advance(0.3)
    ui.drag(page.column, 0, -120)  # from the top of the column: only the page can continue
    assert page.scroll_y > 0.2
    assert page.column.scroll_y == 1


def test_one_drag_scrolls_the_column_to_its_end_and_then_the_page(page, ui):
    page.scroll_y, page.column.scroll_y = 0, 1 - 60 / 900
    ui.advance(0.3)
    ui.drag(page.column, 0, -140)
    assert page.column.scroll_y == 1
    assert 0.1 < page.scroll_y < 0.4


def test_a_tap_after_a_drag_that_continued_with_the_page_presses_once(page, ui):
    pressed = []
    page.scroll_y, page.column.scroll_y = 0, 1
    ui.advance(0.3)
    ui.drag(page.column, 0, -60)
    first = next(widget for widget in page.column.walk() if isinstance(widget, Segment) and widget.text == "0")
    for widget in page.column.walk():
        if isinstance(widget, Segment):
            widget.bind(on_release=lambda button: pressed.append(button.text))
    ui.advance(0.5)
    assert pressed == []
    ui.tap(first)
    ui.advance(0.5)
    assert pressed == ["0"]
