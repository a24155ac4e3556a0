"""A page or a list shows that it continues below its edge."""

from __future__ import annotations

import pytest
from kivy.core.window import Window
from kivy.uix.widget import Widget

from app.widgets.scrolling import CalmScroll, ScrollPage


def line_of(view: CalmScroll) -> float:
    """How opaque the line at the lower edge is."""
    return next(one.a for one in reversed(view.canvas.after.children) if hasattr(one, "a"))


@pytest.mark.parametrize(
    ("height", "scroll_y", "more"), [(500, 1, True), (500, 0.5, True), (500, 0, False), (200, 1, False)]
)
def test_a_page_has_a_line_where_more_follows(ui, height, scroll_y, more):
    page = ui.show(ScrollPage(), (300, 240))
    page.add_widget(Widget(size_hint_y=None, height=height))
    ui.advance(0.1)
    page.scroll_y = scroll_y
    ui.advance(0.1)
    assert page.more_below is more
    assert (line_of(page) > 0) is more


def test_a_scrolled_page_that_has_room_after_all_lies_at_its_upper_edge(ui):
    page = ScrollPage()
    content = Widget(size_hint_y=None, height=300)
    page.add_widget(content)
    ui.show(page, (300, 200))
    ui.wheel(page, 20)
    assert page.scroll_y == 0
    page.height = 600  # the tablet was turned
    ui.advance(0.1)
    assert content.to_window(0, content.top)[1] == page.to_window(0, page.top)[1]


def test_a_wheel_with_shift_scrolls_a_page_that_has_nothing_sideways(ui, monkeypatch):
    page = ScrollPage()
    page.add_widget(Widget(size_hint_y=None, height=300))
    ui.show(page, (300, 200))
    monkeypatch.setattr(Window, "_modifiers", ["shift"])
    ui.wheel(page, 20)
    assert page.scroll_y == 0
