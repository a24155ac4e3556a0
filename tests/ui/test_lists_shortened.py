"""Lists that were scrolled down and then have fewer rows scroll back to the remaining ones."""

from __future__ import annotations

import pytest
from kivy.tests.common import UnitTestTouch

from app.widgets.choices import OptionRow
from app.widgets.items import Item
from app.widgets.long_list import LongList
from tests.ui.checks import whole_rows


def lines(count: int) -> list[Item]:
    return [Item(n, f"Row {n}") for n in range(count)]


def in_sight(ui, shown) -> set[str]:
    bottom, top = shown.to_window(0, shown.y)[1], shown.to_window(0, shown.top)[1]
    left = shown.to_window(shown.x, 0)[0]
    return {
        row.item.title
        for row in ui.find_all(OptionRow)
        for y in [row.to_window(0, row.center_y)[1]]
        if bottom <= y <= top and row.to_window(row.x, 0)[0] < left + shown.width
    }


@pytest.mark.parametrize("left", [2, 8])
def test_a_list_that_is_scrolled_down_and_shortened_shows_what_there_is(ui, left):
    shown = ui.show(LongList(viewclass="OptionRow", data=lines(40)), (400, 300))
    ui.advance(0.3)
    for _drag in range(12):
        ui.drag(shown, 0, 250)
    ui.advance(1)
    assert "Row 39" in in_sight(ui, shown)
    shown.data = lines(left)
    ui.advance(1)
    seen = in_sight(ui, shown)
    assert len(seen) >= min(left, 4), seen
    if left == 2:
        assert seen == {"Row 0", "Row 1"}
    else:
        assert seen <= {line.title for line in lines(left)}


@pytest.mark.long
def test_while_a_finger_still_moves_it_too(ui):
    shown = ui.show(LongList(viewclass="OptionRow", data=lines(40)), (400, 300))
    ui.advance(0.3)
    for _drag in range(12):
        ui.drag(shown, 0, 280)
        if _drag == 10:
            shown.data = lines(3)
    ui.advance(2)
    assert in_sight(ui, shown) == {"Row 0", "Row 1", "Row 2"}


@pytest.mark.parametrize("left", [0, *(pytest.param(left, marks=pytest.mark.long) for left in (3, 6, 12))])
@pytest.mark.parametrize("pull", [pytest.param(250, marks=pytest.mark.long), 600])
def test_while_it_flies_on_too(ui, left, pull):
    shown = ui.show(LongList(viewclass="OptionRow", data=lines(60)), (400, 300))
    ui.advance(0.3)
    for _fling in range(8):
        x, y = shown.to_window(*shown.center)
        touch = UnitTestTouch(x, y - 100)
        touch.touch_down()
        ui.advance()
        for n in range(1, 6):
            touch.touch_move(x, y - 100 + pull * n / 5)
            ui.advance()
        touch.touch_up()
        if _fling == 7:
            shown.data = lines(left)
        ui.advance(0.1)
    ui.advance(2)
    seen = in_sight(ui, shown)
    assert len(seen) >= min(left, 4), seen


def test_when_the_first_row_in_sight_goes_the_others_stay(ui):
    shown = ui.show(LongList(viewclass="OptionRow", data=lines(40)), (400, 300))
    ui.advance(0.3)
    shown.show(10)
    ui.advance(0.5)
    shown.data = [line for line in lines(40) if line.key != 10]
    ui.advance(0.5)
    assert whole_rows(shown)[0].key == 11
