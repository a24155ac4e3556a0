"""Lists of thousands of rows; only visible ones exist."""

from __future__ import annotations

from dataclasses import replace
from functools import wraps
from itertools import accumulate

import pytest
from kivy.uix.boxlayout import BoxLayout

from app.widgets import long_list
from app.widgets.choices import OptionRow
from app.widgets.items import Item
from app.widgets.list_row import ListRow
from app.widgets.lists import Rows
from app.widgets.long_list import LongList
from app.widgets.text import Txt
from tests.ui.checks import whole_rows
from tests.ui.test_widgets_lists import actions_of


def place(widget) -> float:
    """Its lower edge in the window, px."""
    return widget.to_window(*widget.pos)[1]


def run(key: object, mission: str = "") -> Item:
    return Item(key, mission or f"Mission {key}", "as usual")


def runs(n: int) -> list[Item]:
    return [run(key) for key in range(n)]


def test_thousands_of_runs_need_a_dozen_rows(ui):
    rows = LongList(viewclass="ListRow", data=runs(5000))
    ui.show(rows, (800, 600))
    assert 5 < len(rows.views) < 20
    assert "Mission 0" in ui.texts()
    rows.scroll_y = 0
    ui.advance(0.5)
    assert "Mission 4999" in ui.texts()
    assert len(rows.views) < 20


@pytest.mark.long
def test_rows_that_only_a_larger_window_had_room_for_are_not_kept(ui):
    rows = ui.show(LongList(viewclass="ListRow", data=runs(5000)), (800, 1600))
    many = len(rows.views)
    rows.height = 250
    ui.advance(0.5)
    assert many > 15
    assert len(rows.views) + len(rows._spare) < 10


@pytest.mark.long
def test_rows_that_a_search_hides_are_at_hand_when_it_ends(ui):
    rows = ui.show(LongList(viewclass="ListRow", data=runs(50)), (800, 600))
    views = set(rows.views)
    rows.data = []
    ui.advance(0.5)
    rows.data = runs(50)
    ui.advance(0.5)
    assert set(rows.views) == views


def calls_of(monkeypatch, kind: type, name: str) -> list:
    """The widgets whose method is called from now on."""
    called, method = [], getattr(kind, name)

    @wraps(method)  # kivy's clock finds methods by their names
    def noted(widget, *args):
        called.append(widget)
        return method(widget, *args)

    monkeypatch.setattr(kind, name, noted)
    return called


def test_scrolling_lays_out_and_writes_only_what_comes_into_sight(ui, monkeypatch):
    laid_out, written = calls_of(monkeypatch, BoxLayout, "do_layout"), calls_of(monkeypatch, Txt, "texture_update")
    rows = ui.show(LongList(viewclass="ListRow", data=runs(5000)), (800, 250))
    for top in (99.5, 100):  # there is a view more while a row is partly visible
        rows.scroll_y = 1 - top * 56 / (rows._content.height - rows.height)
        ui.advance(0.5)
    assert laid_out
    before = {view.key for view in rows.views}
    laid_out.clear()
    written.clear()
    rows.scroll_y -= rows.views[0].height / (rows._content.height - rows.height)
    ui.advance()
    new = [view for view in rows.views if view.key not in before]
    assert 1 <= len(new) <= 2
    assert {text.text for text in written} == {
        view.item.title for view in new
    }  # all else reads as in the rows whose views they were
    assert laid_out == []


def test_only_the_rows_below_one_that_grows_are_added_up_again(ui, monkeypatch):
    rows = ui.show(LongList(viewclass="ListRow", data=runs(5000)), (800, 250))
    rows.show(4900)
    ui.advance(0.5)
    added: list[float] = []

    def noted(heights, initial: float):
        added.extend(heights := list(heights))
        return accumulate(heights, initial=initial)

    monkeypatch.setattr(long_list, "accumulate", noted)
    whole, row = rows.content_height, whole_rows(rows)[0]
    row.least += 40
    ui.advance(0.5)
    assert rows.content_height == whole + 40
    assert 0 < len(added) <= 200


def test_rows_of_a_long_list_take_their_own_height_and_do_not_overlap(ui):
    data = runs(200)
    data[1] = replace(
        data[1], support="The robot stood still for four minutes before a pallet that nobody had announced. " * 3
    )
    data[3] = replace(data[1], key=3, note="Robot: blocked")
    rows = LongList(viewclass="ListRow", data=data, spacing=8)
    ui.show(rows, (700, 450))
    views = {view.key: view for view in rows.views}
    bottoms = {key: place(view) for key, view in views.items()}
    assert views[1].height > views[0].height
    assert views[3].height > views[1].height
    for n in range(4):
        assert bottoms[n] - (bottoms[n + 1] + views[n + 1].height) == pytest.approx(8, abs=1)
    assert bottoms[5] < place(rows) < bottoms[5] + views[5].height  # a part of it shows that there is more


def test_a_row_opens_and_the_others_make_room(ui):
    data = runs(50)
    rows = LongList(viewclass="ListRow", data=data)
    ui.show(rows, (700, 250))
    calls = actions_of(rows)
    ui.tap(ui.find(Txt, text="Mission 1"))
    assert calls == [(1, "open")]
    before = place(ui.find(ListRow, key=2))
    rows.data = [replace(row, note="Planned\n13:30" if row.key == 1 else "") for row in data]
    ui.advance(0.1)
    assert place(ui.find(ListRow, key=2)) < before - 20


def test_a_list_at_rest_draws_nothing(ui):
    rows = ui.show(LongList(viewclass="ListRow", data=runs(300)), (700, 250))
    rows.scroll_y = 0.5
    ui.advance(0.4)  # it has come to rest
    assert ui.frames_drawn(2) == 0


def test_new_rows_at_the_top_leave_what_is_read_where_it_is(ui):
    rows = LongList(viewclass="ListRow", data=runs(300))
    ui.show(rows, (700, 250))
    rows.show(100)
    ui.advance(0.5)
    top = ui.find(ListRow, key=100)
    place = top.to_window(*top.pos)
    rows.data = [run(f"new {n}", "New") for n in range(5)] + runs(300)
    ui.advance(0.1)
    top = ui.find(ListRow, key=100)
    assert top.to_window(*top.pos) == pytest.approx(place, abs=1.5)


def test_at_the_top_the_newest_is_seen(ui):
    rows = LongList(viewclass="ListRow", data=runs(300))
    ui.show(rows, (700, 250))
    rows.data = [run("new", "Brand new"), *runs(300)]
    ui.advance(0.1)
    assert "Brand new" in ui.texts()


def test_the_end_of_a_long_list_asks_for_more(ui):
    rows = LongList(viewclass="ListRow", data=runs(60))
    asked: list[int] = []
    rows.bind(on_end=lambda _rows: asked.append(1))
    ui.show(rows, (700, 250))
    assert not asked
    rows.scroll_y = 0
    ui.advance(0.5)
    assert asked


def test_a_row_that_became_another_while_pressed_does_nothing(ui):
    row = OptionRow(key=1, item=Item(1, "One"))
    row.host = Rows()
    calls = actions_of(row.host)
    ui.show(row, (400, 64))
    lift = ui.press(row)
    row.take(Item(2, "Two"))
    lift()
    assert calls == []
    ui.tap(row)
    assert calls == [(2, "open")]


def test_a_long_list_says_when_it_is_empty(ui):
    rows = LongList(viewclass="ListRow", empty_text="No run matches")
    ui.show(rows, (500, 400))
    assert ui.texts() == ["No run matches"]
    rows.data = runs(2)
    ui.advance(0.1)
    assert "No run matches" not in ui.texts()


def test_an_empty_list_shows_all_lines_of_a_long_text(ui):
    rows = LongList(viewclass="ListRow", empty_text="Nothing")
    ui.show(rows, (300, 400))
    rows.empty_text = "Missions from a schedule, from Run now or from the robot's own screen appear here. " * 3
    ui.advance(0.5)
    label = ui.find(Txt)
    assert label.lines > 3
    assert label.to_window(label.x, label.top)[1] <= rows.top
    assert rows.content_height >= label.height


def test_the_text_of_an_empty_list_ends_where_rows_do(ui):
    rows = ui.show(LongList(viewclass="ListRow", empty_text="Nothing is waiting " * 9), (300, 400))
    ui.advance(0.5)
    assert ui.find(Txt).right <= rows.right - 12


def test_a_row_comes_into_sight_by_the_least_scrolling_to_a_row_edge(ui):
    rows = ui.show(
        LongList(viewclass="OptionRow", data=[Item(n, f"Option {n}", icon="star") for n in range(40)]), (400, 300)
    )
    whole = [row.key for row in whole_rows(rows)]
    rows.reveal(whole[-1] + 1)
    ui.advance(0.5)
    assert [row.key for row in whole_rows(rows)] == [key + 1 for key in whole]
    rows.reveal(whole[1])
    ui.advance(0.5)
    assert [row.key for row in whole_rows(rows)] == [key + 1 for key in whole]  # it is in sight
    rows.reveal(whole[0])
    ui.advance(0.5)
    assert [row.key for row in whole_rows(rows)] == whole
