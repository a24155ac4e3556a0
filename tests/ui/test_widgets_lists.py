"""Lists keep the identity of their rows, scroll, rest on whole rows, and tell who was used."""
from __future__ import annotations

from dataclasses import replace
from functools import wraps

import pytest
from kivy.uix.boxlayout import BoxLayout

from app.screens.common.options import Option
from app.screens.home.lists import QueueEntry, RobotSummary
from app.screens.logs.view import RunRow, StepView
from app.screens.scheduler.view import ScheduleItem
from app.widgets.buttons import IconButton, Toggle
from app.widgets.lists import Rows, ScrollRows
from app.widgets.long_list import LongList
from app.widgets.rows import LogRow, OptionRow, QueueRow, RobotChip, ScheduleRow
from app.widgets.text import Txt


def actions_of(rows) -> list[tuple]:
    calls: list[tuple] = []
    rows.bind(on_action=lambda _rows, *values: calls.append(values))
    return calls


def queue(*keys: int) -> list[QueueEntry]:
    return [QueueEntry(key, f"Mission {key}", "Run now", number=str(key)) for key in keys]


def robots(count: int) -> list[RobotSummary]:
    return [RobotSummary(n, f"Robot {n}", "", "", "neutral", "", "", "neutral", False) for n in range(count)]


def test_the_cross_of_a_row_cancels_what_the_row_shows(ui):
    rows = ui.show(ScrollRows(viewclass="QueueRow", data=queue(7, 8)), (400, 300))
    calls = actions_of(rows)
    second = ui.find(QueueRow, key=8)
    ui.tap(ui.find(IconButton, root=second))
    assert calls == [(8, "cancel")]


def test_a_row_without_a_cross_cannot_be_cancelled(ui):
    rows = ui.show(ScrollRows(viewclass="QueueRow", data=[QueueEntry(1, "Dock", "Run now", cancellable=False)]), (400, 300))
    calls = actions_of(rows)
    cross = next(w for w in rows.walk() if isinstance(w, IconButton) and w.icon == "close")
    ui.tap(cross)
    assert calls == []


def test_a_queue_that_moves_under_the_finger_cancels_nothing_else(ui):
    rows = ui.show(ScrollRows(viewclass="QueueRow", data=queue(1, 2, 3)), (400, 300))
    calls = actions_of(rows)
    lift = ui.press(ui.find(IconButton, root=ui.find(QueueRow, key=1)))
    rows.data = queue(2, 3)              # 1 has just ended; 2 now lies under the finger
    lift()
    assert (2, "cancel") not in calls


@pytest.mark.parametrize("kind", [ScrollRows, LongList])
def test_what_slides_under_the_finger_after_a_row_has_gone_is_not_pressed(ui, kind):
    rows = ui.show(kind(viewclass="QueueRow", data=queue(1, 2, 3)), (400, 300))
    happened = actions_of(rows)
    cross = ui.find(IconButton, root=ui.find(QueueRow, key=2))
    place = cross.to_window(*cross.center)
    ui.tap_at(*place)
    rows.data = queue(1, 3)
    ui.advance(.3)
    ui.tap_at(*place)                                         # 3 is there now
    ui.tap(ui.find(IconButton, root=ui.find(QueueRow, key=1)))         # and 1 where it was
    assert happened == [(2, "cancel"), (1, "cancel")]
    ui.advance(1)
    ui.tap_at(*place)
    assert happened == [(2, "cancel"), (1, "cancel"), (3, "cancel")]


@pytest.mark.parametrize("kind", [ScrollRows, LongList])
def test_a_notch_of_the_wheel_is_never_taken_back(ui, kind):
    rows = ui.show(kind(viewclass="QueueRow", data=queue(*range(30))), (400, 300))
    scroll = rows.ids.scroll if kind is ScrollRows else rows
    ui.advance(1)

    def turned(notches: int) -> float:
        """Px above the upper edge when everything has come to rest."""
        ui.wheel(scroll, notches)
        ui.advance(1)
        return round((1 - scroll.scroll_y) * (scroll.children[0].height - scroll.height))

    row = turned(1)
    assert row >= 60
    assert turned(1) == 2 * row                              # each comes to rest on a whole row
    assert turned(-1) == row
    assert turned(-1) == turned(-1) == 0
    end = turned(200)
    assert turned(1) == end
    assert turned(-1) < end - 20
    assert turned(200) == end
    assert turned(-200) == 0


@pytest.mark.parametrize("kind", [ScrollRows, LongList])
def test_what_comes_after_the_last_row_has_gone_can_be_pressed_at_once(ui, kind):
    """Another tab, for example."""
    rows = ui.show(kind(viewclass="QueueRow", data=queue(1)), (400, 300))
    happened = actions_of(rows)
    rows.data = []
    ui.advance(.1)
    rows.data = queue(2, 1)
    ui.advance(.1)
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
    assert calls == []                   # what was pressed is not there any more
    ui.tap(ui.find(IconButton, root=ui.find(QueueRow, key=1001)))
    assert calls == [(1001, "cancel")]
    assert len(before) < 8


def test_rows_are_updated_not_rebuilt(ui):
    rows = Rows(viewclass="QueueRow", orientation="vertical", data=queue(1, 2))
    ui.show(rows, (400, 300))
    first = ui.find(QueueRow, key=1)
    rows.data = [QueueEntry(2, "Two", "Run now"), QueueEntry(1, "One", "Run now", icon="play")]
    assert ui.find(QueueRow, key=1) is first
    assert first.mission == "One"
    assert first.number == ""
    assert [row.key for row in reversed(rows.children)] == [2, 1]


def test_a_row_that_comes_is_shown_by_the_view_of_one_that_has_gone(ui):
    rows = ui.show(Rows(viewclass="QueueRow", orientation="vertical", data=queue(1, 2, 3)), (400, 300))
    views = set(rows.children)
    rows.data = queue(3, 4, 5)
    ui.advance()
    assert set(rows.children) == views
    assert [view.mission for view in reversed(rows.children)] == ["Mission 3", "Mission 4", "Mission 5"]
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


def test_a_short_list_shows_whole_rows_and_scrolls_for_more(ui):
    rows = ui.show(ScrollRows(viewclass="QueueRow", data=queue(*range(20))), (400, 250))
    assert rows.view_height == 3 * 72
    ui.drag(rows, 0, 100)
    scroll = rows.ids.scroll
    above = (1 - scroll.scroll_y) * (20 * 72 - rows.view_height)
    assert above >= 72
    assert above % 72 == pytest.approx(0, abs=1) or above % 72 == pytest.approx(72, abs=1)


def test_a_strip_shares_its_width_or_turns_pages(ui):
    strip = ScrollRows(direction="x", viewclass="RobotChip", spacing=8, data=robots(3))
    ui.show(strip, (600, 64))
    assert not strip.paged
    assert ui.find(RobotChip).width == pytest.approx((600 - 16) / 3)
    calls = actions_of(strip)
    strip.data = robots(20)
    ui.advance()
    assert strip.paged
    ui.tap(ui.find(IconButton, icon="chevron-right"))
    ui.advance(.5)
    assert strip.ids.scroll.scroll_x > 0
    strip.show(15)
    ui.advance(.5)
    ui.tap(ui.find(RobotChip, key=15))
    assert calls == [(15, "choose")]


def drawn(strip) -> set[int]:
    """Keys of the rows that are drawn."""
    return {view.key for view in strip.ids.rows.children if view.canvas in strip.ids.rows.canvas.children}


def seen(strip) -> set[int]:
    """Keys of the rows that lie in the scroll view."""
    scroll = strip.ids.scroll
    left = scroll.to_window(scroll.x, 0)[0]
    return {view.key for view in strip.ids.rows.children
            if left - view.width < view.to_window(view.x, 0)[0] < left + scroll.width}


def test_of_a_strip_only_what_is_seen_is_drawn(ui):
    chips = robots(20)
    strip = ui.show(ScrollRows(direction="x", viewclass="RobotChip", spacing=8, data=chips), (600, 64))
    assert 0 in seen(strip)
    assert drawn(strip) == seen(strip)
    assert len(drawn(strip)) <= 5
    strip.show(15)
    ui.advance(.5)
    assert 15 in seen(strip)
    assert drawn(strip) == seen(strip)
    for data in (chips[::-1], chips[:2], chips):                  # moved, removed, come again
        strip.data = data
        ui.advance(.2)
        assert seen(strip)
        assert drawn(strip) == seen(strip)


def test_a_schedule_row_asks_and_shows_what_is_true(ui):
    rows = ui.show(ScrollRows(viewclass="ScheduleRow", data=[ScheduleItem(5, True, "Deliver", "Daily", "Tomorrow")]), (400, 200))
    calls = actions_of(rows)
    ui.tap(ui.find(Toggle))
    assert calls == [(5, "switch", False)]
    assert ui.find(Toggle).active            # until the service has agreed
    rows.data = [ScheduleItem(5, False, "Deliver", "Daily", "Tomorrow")]
    assert not ui.find(Toggle).active
    ui.tap(ui.find(Txt, text="Deliver"))
    dots = ui.find(IconButton, root=ui.find(ScheduleRow))
    ui.tap(dots)
    assert calls[1:] == [(5, "edit"), (5, "menu", dots)]


def place(widget) -> float:
    """Its lower edge in the window, px."""
    return widget.to_window(*widget.pos)[1]


PLANNED = StepView("Planned", "13:30", "", "neutral", False)


def run(key: object, mission: str = "") -> RunRow:
    return RunRow(key, "", "neutral", "", mission or f"Mission {key}", "as usual", "", "", "", "", False, False)


def runs(n: int) -> list[RunRow]:
    return [run(key) for key in range(n)]


def test_thousands_of_runs_need_a_dozen_rows(ui):
    rows = LongList(viewclass="LogRow", data=runs(5000))
    ui.show(rows, (800, 600))
    assert 5 < len(rows.views) < 20
    assert "Mission 0" in ui.texts()
    rows.scroll_y = 0
    ui.advance(.5)
    assert "Mission 4999" in ui.texts()
    assert len(rows.views) < 20


def calls_of(monkeypatch, kind: type, name: str) -> list:
    """The widgets whose method is called from now on."""
    called, method = [], getattr(kind, name)

    @wraps(method)                           # kivy's clock finds methods by their names
    def noted(widget, *args):
        called.append(widget)
        return method(widget, *args)

    monkeypatch.setattr(kind, name, noted)
    return called


def test_scrolling_lays_out_and_writes_only_what_comes_into_sight(ui, monkeypatch):
    laid_out, written = calls_of(monkeypatch, BoxLayout, "do_layout"), calls_of(monkeypatch, Txt, "texture_update")
    rows = ui.show(LongList(viewclass="LogRow", data=runs(5000)), (800, 250))
    rows.show(100)
    ui.advance(.5)
    assert laid_out
    before = {view.key for view in rows.views}
    laid_out.clear()
    written.clear()
    rows.scroll_y -= rows.views[0].height / (rows._content.height - rows.height)
    ui.advance()
    new = [view for view in rows.views if view.key not in before]
    assert 1 <= len(new) <= 2
    assert {text.text for text in written} == {view.mission for view in new}        # all else reads as in the rows whose views they were
    assert laid_out == []


def test_rows_of_a_long_list_take_their_own_height_and_do_not_overlap(ui):
    data = runs(200)
    data[1] = replace(data[1], reason="The robot stood still for four minutes before a pallet that nobody had announced. " * 3)
    data[3] = replace(data[3], opened=True, steps=(PLANNED,), message="Robot: blocked")
    rows = LongList(viewclass="LogRow", data=data)
    ui.show(rows, (700, 450))
    views = {view.key: view for view in rows.views}
    bottoms = {key: place(view) for key, view in views.items()}
    assert views[1].height > views[0].height
    assert views[3].height > views[1].height
    for n in range(4):
        assert bottoms[n] - (bottoms[n + 1] + views[n + 1].height) == pytest.approx(8, abs=1)
    lowest = place(rows) - 1
    assert all(bottoms[view.key] >= lowest for view in rows.views if view.to_window(0, 0)[0] < rows.right)      # no row cut in two


def test_a_row_opens_and_the_others_make_room(ui):
    data = runs(50)
    rows = LongList(viewclass="LogRow", data=data)
    ui.show(rows, (700, 250))
    calls = actions_of(rows)
    ui.tap(ui.find(Txt, text="Mission 1"))
    assert calls == [(1, "open")]
    before = place(ui.find(LogRow, key=2))
    rows.data = [replace(row, opened=row.key == 1, steps=(PLANNED,)) for row in data]
    ui.advance(.1)
    assert place(ui.find(LogRow, key=2)) < before - 40
    assert "13:30" in ui.texts()


def test_new_rows_at_the_top_leave_what_is_read_where_it_is(ui):
    rows = LongList(viewclass="LogRow", data=runs(300))
    ui.show(rows, (700, 250))
    rows.show(100)
    ui.advance(.5)
    top = ui.find(LogRow, key=100)
    place = top.to_window(*top.pos)
    rows.data = [run(f"new {n}", "New") for n in range(5)] + runs(300)
    ui.advance(.1)
    top = ui.find(LogRow, key=100)
    assert top.to_window(*top.pos) == pytest.approx(place, abs=1.5)


def test_at_the_top_the_newest_is_seen(ui):
    rows = LongList(viewclass="LogRow", data=runs(300))
    ui.show(rows, (700, 250))
    rows.data = [run("new", "Brand new"), *runs(300)]
    ui.advance(.1)
    assert "Brand new" in ui.texts()


def test_the_end_of_a_long_list_asks_for_more(ui):
    rows = LongList(viewclass="LogRow", data=runs(60))
    asked: list[int] = []
    rows.bind(on_end=lambda _rows: asked.append(1))
    ui.show(rows, (700, 250))
    assert not asked
    rows.scroll_y = 0
    ui.advance(.5)
    assert asked


def test_a_row_that_became_another_while_pressed_does_nothing(ui):
    row = OptionRow(key=1, text="One")
    calls: list[tuple] = []

    class Host:
        def dispatch(self, _event, *values):
            calls.append(values)

    row.host = Host()
    ui.show(row, (400, 64))
    lift = ui.press(row)
    row.take(Option(2, "Two"))
    lift()
    assert calls == []
    ui.tap(row)
    assert calls == [(2, "choose")]


def test_a_long_list_says_when_it_is_empty(ui):
    rows = LongList(viewclass="LogRow", empty_text="No run matches")
    ui.show(rows, (500, 400))
    assert ui.texts() == ["No run matches"]
    rows.data = runs(2)
    ui.advance(.1)
    assert "No run matches" not in ui.texts()


def test_an_empty_list_shows_all_lines_of_a_long_text(ui):
    rows = LongList(viewclass="LogRow", empty_text="Nothing")
    ui.show(rows, (300, 400))
    rows.empty_text = "Missions from a schedule, from Run now or from the robot's own screen appear here. " * 3
    ui.advance(.5)
    label = ui.find(Txt)
    assert label.lines > 3
    assert label.to_window(label.x, label.top)[1] <= rows.top
    assert rows.content_height >= label.height


def test_the_text_of_an_empty_list_ends_where_rows_do(ui):
    rows = ui.show(LongList(viewclass="LogRow", empty_text="Nothing is waiting " * 9), (300, 400))
    ui.advance(.5)
    assert ui.find(Txt).right <= rows.right - 12


@pytest.mark.parametrize("width", [300, 352, 480, 600])
def test_no_chip_of_a_strip_is_cut_wherever_its_arrows_lead(ui, width):
    strip = ui.show(ScrollRows(direction="x", viewclass="RobotChip", spacing=8, data=robots(7)), (width, 72))
    for _n in range(7):
        left = strip.ids.scroll.to_window(strip.ids.scroll.x, 0)[0]
        right = left + strip.ids.scroll.width
        edges = [(chip.to_window(chip.x, 0)[0], chip.to_window(chip.right, 0)[0]) for chip in strip.ids.rows.children]
        assert not [edge for edge in edges if edge[0] < left - 1 < edge[1] - 2 or edge[0] + 2 < right + 1 < edge[1]]
        ui.tap(ui.find_all(IconButton)[-1])
        ui.advance(.5)


def test_three_robots_have_room_on_a_small_strip(ui):
    strip = ui.show(ScrollRows(direction="x", viewclass="SmallRobotChip", spacing=8, data=robots(3)), (352, 72))
    assert not strip.paged
    for chip in ui.find_all(RobotChip):
        for label in (widget for widget in chip.walk(restrict=True) if isinstance(widget, Txt) and widget.text):
            assert label.to_window(label.right, 0)[0] <= chip.to_window(chip.right, 0)[0]
            assert label.texture_size[0] <= label.width + 1
