"""Lists keep the identity of their rows, scroll, and report the row that was used."""

from __future__ import annotations

from dataclasses import dataclass

import pytest
from kivy.factory import Factory
from kivy.uix.boxlayout import BoxLayout

from app.widgets.buttons import IconButton
from app.widgets.flow import ChipFlow
from app.widgets.items import Item, Option
from app.widgets.lists import KEPT, STILL, Row, Rows
from app.widgets.long_list import LongList
from app.widgets.places import places
from app.widgets.scrolling import ScrollPage
from app.widgets.surfaces import Tap
from app.widgets.text import Txt
from tests.ui.queue_rows import QueueRow, entry, queue


def actions_of(rows) -> list[tuple]:
    calls: list[tuple] = []
    rows.bind(on_action=lambda _rows, key, name, *_rest: calls.append((key, name)))
    return calls


def test_the_cross_of_a_row_cancels_what_the_row_shows(ui):
    rows = ui.show(LongList(viewclass="QueueRow", data=queue(7, 8)), (400, 300))
    calls = actions_of(rows)
    second = ui.find(QueueRow, key=8)
    ui.tap(ui.find(IconButton, root=second))
    assert calls == [(8, "cancel")]


def test_a_row_whose_cross_is_off_cannot_be_cancelled(ui):
    rows = ui.show(LongList(viewclass="QueueRow", data=[entry(1, "Dock", off="Being cancelled")]), (400, 300))
    calls = actions_of(rows)
    ui.tap(ui.find(IconButton, root=ui.find(QueueRow)))
    assert calls == []


def test_a_queue_that_moves_under_the_finger_cancels_nothing_else(ui):
    rows = ui.show(LongList(viewclass="QueueRow", data=queue(1, 2, 3)), (400, 300))
    calls = actions_of(rows)
    lift = ui.press(ui.find(IconButton, root=ui.find(QueueRow, key=1)))
    rows.data = queue(2, 3)  # 1 has just ended; 2 now lies under the finger
    lift()
    assert (2, "cancel") not in calls


def test_a_row_that_slides_under_the_finger_after_a_removal_is_not_pressed(ui):
    rows = ui.show(LongList(viewclass="QueueRow", data=queue(1, 2, 3)), (400, 300))
    happened = actions_of(rows)
    cross = ui.find(IconButton, root=ui.find(QueueRow, key=2))
    place = cross.to_window(*cross.center)
    ui.tap_at(*place)
    rows.data = queue(1, 3)
    ui.advance(0.3)
    ui.tap_at(*place)  # 3 is there now
    ui.tap(ui.find(IconButton, root=ui.find(QueueRow, key=1)))  # and 1 where it was
    assert happened == [(2, "cancel"), (1, "cancel")]
    ui.advance(1)
    ui.tap_at(*place)
    assert happened == [(2, "cancel"), (1, "cancel"), (3, "cancel")]


@pytest.mark.parametrize("after", [(1, 4, 3), (3,), (4, 1, 3)])
def test_a_row_that_slides_under_the_pressing_finger_is_not_pressed(ui, after):
    rows = ui.show(LongList(viewclass="QueueRow", data=queue(1, 2, 3)), (400, 300))
    happened = actions_of(rows)
    cross = ui.find(IconButton, root=ui.find(QueueRow, key=2))
    place = cross.to_window(*cross.center)
    ui.tap_at(*place)
    rows.data = queue(*after)
    ui.advance(0.3)
    first = list(happened)
    ui.tap_at(*place)
    assert (happened, len(first)) == (first, 1)
    ui.advance(1)
    ui.tap(ui.find(IconButton, root=ui.find(QueueRow, key=3)))
    assert happened[1:] == [(3, "cancel")]


@pytest.mark.parametrize("after", [(9, 1, 2, 3), (3,), (4,)], ids=["one comes above", "two go", "all are others"])
def test_an_untouched_row_rests_where_it_has_come(ui, after):
    rows = ui.show(LongList(viewclass="QueueRow", data=queue(1, 2, 3)), (400, 400))
    happened = actions_of(rows)
    cross = ui.find(IconButton, root=ui.find(QueueRow, key=1))
    place = cross.to_window(*cross.center)
    ui.advance(STILL)
    rows.data = queue(*after)
    ui.advance(0.05)
    ui.tap_at(*place)
    assert happened == []
    ui.advance(STILL)
    ui.tap_at(*place)
    assert happened == [(after[0], "cancel")]


@pytest.mark.parametrize("kind", ["LongList", "RowColumn"])
def test_a_row_that_slides_under_the_finger_as_another_one_grows_is_not_pressed(ui, kind):
    rows, page = Factory.get(kind)(viewclass="QueueRow", data=queue(1, 2, 3)), ScrollPage()
    if kind == "LongList":
        ui.show(rows, (400, 400))
    else:
        page.add_widget(rows)
        ui.show(page, (400, 400))
    happened = actions_of(rows)
    ui.advance(STILL)
    cross = ui.find(IconButton, root=ui.find(QueueRow, key=2))
    first = ui.find(QueueRow, key=1)
    first.least += 40  # as if its text had got a line more
    ui.advance(0.1)
    place = cross.to_window(*cross.center)
    ui.tap_at(*place)
    assert happened == []
    ui.advance(STILL)
    ui.tap_at(*place)
    assert happened == [(2, "cancel")]


def under_chips(ui, kind: str) -> tuple:
    """A list of that kind below chips that come and go; and the chips."""
    rows, chips = Factory.get(kind)(viewclass="QueueRow", data=queue(1, 2, 3)), ChipFlow()
    page = ScrollPage() if kind == "RowColumn" else BoxLayout(orientation="vertical")
    page.add_widget(chips)
    page.add_widget(rows)
    ui.show(page, (400, 400))
    ui.advance(STILL)
    return rows, chips


@pytest.mark.parametrize("kind", ["LongList", "RowColumn"])
@pytest.mark.parametrize("come", [True, False])
def test_a_row_that_slides_under_the_finger_as_chips_come_or_go_is_not_pressed(ui, kind, come):
    rows, chips = under_chips(ui, kind)
    shown = [Option("failed", "4 failed")]
    chips.data = [] if come else shown
    ui.advance(2 * STILL)
    happened = actions_of(rows)
    chips.data = shown if come else []
    ui.advance(0.1)
    cross = ui.find(IconButton, root=ui.find(QueueRow, key=2))
    place = cross.to_window(*cross.center)
    ui.tap_at(*place)
    assert happened == []
    ui.advance(STILL)
    ui.tap_at(*place)
    assert happened == [(2, "cancel")]


@pytest.mark.parametrize("kind", ["LongList", "RowColumn"])
def test_chips_that_come_while_a_finger_is_down_make_it_press_no_other_row(ui, kind):
    rows, chips = under_chips(ui, kind)
    happened = actions_of(rows)
    lift = ui.press(ui.find(IconButton, root=ui.find(QueueRow, key=2)))
    chips.data = [Option("failed", "4 failed")]
    lift()
    assert (1, "cancel") not in happened


@dataclass(frozen=True)
class Words:
    text: str


class WordsRow(Row, Tap):
    """As of a list whose data have no key."""


def test_of_rows_without_a_key_those_that_stand_still_can_be_pressed(ui):
    rows, page = Factory.RowColumn(viewclass="WordsRow", data=[Words(text) for text in "abc"]), ScrollPage()
    page.add_widget(rows)
    ui.show(page, (400, 400))
    views = rows.children[::-1]
    for view in views:
        view.size_hint_y, view.height = None, 60
    ui.advance(2 * STILL)
    views[1].height += 40
    ui.advance(0.1)
    assert [places.has_just_moved(view) for view in views] == [False, False, True]


def test_rows_that_scrolling_has_brought_can_be_pressed_at_once(ui):
    """They find their heights in several frames."""
    data = [Item(n, f"Mission {n}", "Why it did not start, in more words than fit " * (1 + n % 3)) for n in range(60)]
    rows = ui.show(LongList(viewclass="QueueRow", data=data), (400, 400))
    for n in range(10):
        ui.advance(0.2)
        assert [view.key for view in rows.views if places.has_just_moved(view)] == []
        rows.scroll_y = 0.9 - n / 10


def test_impatient_taps_never_reach_the_row_that_comes_next(ui):
    rows = ui.show(LongList(viewclass="QueueRow", data=queue(1, 2, 3)), (400, 400))
    happened = actions_of(rows)
    cross = ui.find(IconButton, root=ui.find(QueueRow, key=1))
    place = cross.to_window(*cross.center)
    ui.tap_at(*place)
    rows.data = queue(2, 3)
    for n in range(4):
        ui.advance(0.25)
        ui.tap_at(*place)
        rows.data = queue(2, 3, *range(10, 10 + n))  # what comes below doesn't end it
    assert happened == [(1, "cancel")]
    ui.advance(STILL)
    ui.tap_at(*place)
    assert happened == [(1, "cancel"), (2, "cancel")]


def test_a_notch_of_the_wheel_moves_a_list_by_a_row(ui):
    rows = ui.show(LongList(viewclass="QueueRow", data=queue(*range(30))), (400, 300))
    ui.advance(1)
    ui.wheel(rows, 1)
    ui.advance(1)
    moved = (1 - rows.scroll_y) * (rows.content_height - rows.height)
    assert moved == pytest.approx(ui.find(QueueRow).height, rel=0.2)


def test_what_appears_after_the_last_row_was_removed_can_be_pressed_at_once(ui):
    """Another tab, for example."""
    rows = ui.show(LongList(viewclass="QueueRow", data=queue(1)), (400, 300))
    happened = actions_of(rows)
    rows.data = []
    ui.advance(0.1)
    rows.data = queue(2, 1)
    ui.advance(0.1)
    ui.tap(ui.find(IconButton, root=ui.find(QueueRow, key=1)))
    assert happened == [(1, "cancel")]


def test_a_long_queue_is_only_the_rows_in_sight_also_when_all_of_it_changes(ui):
    rows = ui.show(LongList(viewclass="QueueRow", data=queue(*range(200))), (400, 300))
    calls = actions_of(rows)
    before = set(ui.find_all(QueueRow))
    lift = ui.press(ui.find(IconButton, root=ui.find(QueueRow, key=0)))
    rows.data = queue(*range(1000, 1200))
    ui.advance()
    assert set(ui.find_all(QueueRow)) == before
    assert sorted(row.key for row in before) == [1000 + n for n in range(len(before))]
    lift()
    assert calls == []  # what was pressed is not there any more
    ui.tap(ui.find(IconButton, root=ui.find(QueueRow, key=1001)))
    assert calls == [(1001, "cancel")]
    assert len(before) < 8


def test_rows_are_updated_not_rebuilt(ui):
    rows = Rows(viewclass="QueueRow", orientation="vertical", data=queue(1, 2))
    ui.show(rows, (400, 300))
    first = ui.find(QueueRow, key=1)
    rows.data = [entry(2, "Two"), entry(1, "One")]
    assert ui.find(QueueRow, key=1) is first
    assert (first.item.title, first.item.number) == ("One", "")
    assert [row.key for row in reversed(rows.children)] == [2, 1]


def test_a_new_row_reuses_the_view_of_a_removed_one(ui):
    rows = ui.show(Rows(viewclass="QueueRow", orientation="vertical", data=queue(1, 2, 3)), (400, 300))
    views = set(rows.children)
    rows.data = queue(3, 4, 5)
    ui.advance()
    assert set(rows.children) == views
    assert [view.item.title for view in reversed(rows.children)] == ["Mission 3", "Mission 4", "Mission 5"]
    rows.data = []
    rows.data = queue(6)
    assert set(rows.children) <= views


def test_a_row_whose_view_was_another_one_when_pressed_cancels_nothing(ui):
    rows = ui.show(Rows(viewclass="QueueRow", orientation="vertical", data=queue(1, 2, 3)), (400, 300))
    calls, pressed = actions_of(rows), ui.find(QueueRow, key=1)
    lift = ui.press(ui.find(IconButton, root=pressed))
    rows.data = queue(4, 2, 3)
    assert ui.find(QueueRow, key=4) is pressed
    lift()
    assert calls == []


def test_two_rows_with_one_key_are_refused(ui):
    rows = Rows(viewclass="QueueRow")
    with pytest.raises(ValueError, match="two rows"):
        rows.data = queue(1, 1)


# ---------------------------------------------------------------------- rows keep their order under a finger
def shown_keys(ui) -> list[int]:
    return [row.key for row in sorted(ui.find_all(QueueRow), key=lambda row: -row.to_window(0, row.y)[1])]


def test_after_a_touch_no_row_changes_places_for_a_while(ui):
    rows = ui.show(LongList(viewclass="QueueRow", data=queue(1, 2, 3)), (400, 400))
    ui.tap(ui.find(Txt, text="Mission 2"))
    rows.data = queue(3, 2, 1)
    ui.advance(0.2)
    assert shown_keys(ui) == [1, 2, 3]
    rows.data = queue(3, 4, 1)  # what comes and goes does so at once
    ui.advance(0.2)
    assert shown_keys(ui) == [1, 4, 3]
    ui.skip(KEPT)
    assert shown_keys(ui) == [3, 4, 1]
    rows.data = queue(1, 4, 3)
    ui.advance(0.2)
    assert shown_keys(ui) == [1, 4, 3]


def test_a_row_that_slides_under_the_finger_by_sorting_is_not_pressed(ui):
    rows = ui.show(LongList(viewclass="QueueRow", data=queue(1, 2, 3)), (400, 400))
    happened = actions_of(rows)
    crosses = {key: ui.find(IconButton, root=ui.find(QueueRow, key=key)) for key in (1, 2, 3)}
    place = crosses[1].to_window(*crosses[1].center)
    rows.data = queue(3, 2, 1)
    ui.advance()
    ui.tap_at(*place)
    assert happened == []
    ui.advance(STILL)
    ui.tap_at(*place)
    assert happened == [(3, "cancel")]


def test_a_long_list_is_in_another_order_as_soon_as_somebody_asks_for_it(ui):
    rows = ui.show(LongList(viewclass="QueueRow", data=queue(1, 2, 3), order="time"), (400, 400))
    ui.tap(ui.find(Txt, text="Mission 2"))
    rows.data = queue(3, 2, 1)
    rows.order = "name"
    ui.advance(0.2)
    assert shown_keys(ui) == [3, 2, 1]
