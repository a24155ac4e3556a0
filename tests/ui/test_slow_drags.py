"""A finger that rests before it drags, as one in a glove does: what it rests on is not pressed, and the page follows it."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from kivy.metrics import dp
from kivy.uix.widget import Widget

from app.screens.scheduler.timeline import Bar, Lane
from app.widgets.buttons import ChoiceChip, IconButton, Segment, Toggle
from app.widgets.fields import Field, FieldInput
from app.widgets.lanes import LONG, Lanes
from app.widgets.long_list import LongList
from app.widgets.scrolling import ScrollPage
from tests.ui.drawing import fired, put_down
from tests.ui.queue_rows import queue


def slow_drag(ui, widget: Widget, dx: float, dy: float, rest: float = 0.3) -> None:
    """From the middle of ``widget`` by that many px, after a rest of so many seconds."""
    x, y = widget.to_window(*widget.center)
    touch = put_down(x, y)
    ui.advance(rest)
    for n in range(1, 11):
        touch.touch_move(x + dx * n / 10, y + dy * n / 10)
        ui.advance()
    ui.advance(0.5)
    touch.touch_up()
    ui.advance(1)


def page_of(ui, *widgets: Widget):
    """A page 300 px high with those widgets at its top, and 1,200 px below them."""
    page = ScrollPage()
    for widget in (*widgets, Widget(size_hint_y=None, height=1200)):
        page.add_widget(widget)
    return ui.show(page, (400, 300))


def back_to_top(ui, page) -> None:
    page.scroll_y = 1
    ui.advance(0.2)


def pressed(widget) -> list[str]:
    happened: list[str] = []
    widget.bind(on_release=lambda *_: happened.append("pressed"))
    return happened


@pytest.mark.parametrize("rest", [0.2, 0.4, 1.5])
@pytest.mark.parametrize(
    "make",
    [lambda: Segment(text="one", size_hint_y=None, height=dp(56)), lambda: ChoiceChip(text="one")],
    ids=["segment", "chip"],
)
def test_buttons_can_be_scrolled_however_long_the_finger_rested(ui, make: Callable[[], Widget], rest):
    page = page_of(
        ui,
        button := make(),
    )
    happened = pressed(button)
    slow_drag(ui, button, 0, 120, rest)
    assert page.scroll_y == pytest.approx(
        1 - 108 / (page.viewport_size[1] - 300), abs=0.02
    )  # the first 12 px are not a drag
    assert (happened, button.state) == ([], "normal")
    back_to_top(ui, page)
    ui.tap(button, hold=0.4)
    assert happened == ["pressed"]


def test_a_field_is_scrolled_and_not_entered(ui):
    page = page_of(ui, field := Field(label="Name"))
    slow_drag(ui, ui.find(FieldInput), 0, 120)
    assert page.scroll_y < 0.95
    assert not field.focus
    back_to_top(ui, page)
    ui.tap(ui.find(FieldInput), hold=0.4)
    assert field.focus
    slow_drag(ui, ui.find(FieldInput), 0, 120)
    assert page.scroll_y < 0.95
    assert field.focus  # a scroll ends no typing
    back_to_top(ui, page)
    field.focus = False
    ui.tap(ui.find(FieldInput))
    assert field.focus


def test_a_switch_stays_as_it_is(ui):
    page = page_of(ui, toggle := Toggle(size_hint_y=None, height=dp(56)))
    slow_drag(ui, toggle, 0, 120)
    assert page.scroll_y < 0.95
    assert not toggle.active


def test_a_row_is_scrolled(ui):
    rows = ui.show(LongList(viewclass="QueueRow", spacing=8, data=queue(*range(30))), (400, 300))
    scroll = rows
    happened = fired(rows, "on_action")
    ui.advance(0.5)
    slow_drag(ui, ui.find_all(IconButton)[0], 0, 120)
    assert scroll.scroll_y < 1
    assert happened == []


def test_where_nothing_scrolls_a_finger_may_slip_on_a_button(ui):
    page = ScrollPage()
    page.add_widget(button := Segment(text="one", size_hint_y=None, height=100))
    ui.show(page, (400, 300))
    happened = pressed(button)
    slow_drag(ui, button, 0, 20)
    assert happened == ["pressed"]


@pytest.fixture
def chart(ui) -> Lanes:
    """In a page that scrolls."""
    bars = (Bar("a", 2, 4, movable=True),)
    chart = Lanes(lanes=[Lane("Aino", bars=bars, key=1)], hours=24, size_hint_y=None, height=100)
    page_of(ui, chart)
    ui.advance(0.2)
    return chart


@pytest.mark.parametrize("hour", [3, 12])
def test_a_timeline_leaves_upright_drags_to_the_page(ui, chart, hour):
    calls = [fired(chart, name) for name in ("on_bar", "on_free", "on_moved", "on_window")]
    page = chart.parent.parent
    x, y = chart.to_window(chart.left_of(hour), chart.y + 30)
    slow_drag(ui, Widget(pos=(x, y), size=(0, 0)), 3, 120)
    assert page.scroll_y < 0.95
    assert calls == [[], [], [], []]
    assert chart._touch is None
    ui.advance(2 * LONG)
    assert calls == [[], [], [], []]


def test_a_bar_that_is_lifted_keeps_the_finger(ui, chart):
    moved = fired(chart, "on_moved")
    unit = chart.left_of(1) - chart.left_of(0)
    x, y = chart.to_window(chart.left_of(3), chart.y + 30)
    slow_drag(ui, Widget(pos=(x, y), size=(0, 0)), 2 * unit, 40, rest=LONG + 0.3)
    assert chart.parent.parent.scroll_y == 1
    assert moved == [("a", pytest.approx(4, abs=0.1))]
