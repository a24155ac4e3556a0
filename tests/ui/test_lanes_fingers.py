"""The timeline under fingers: what a tap hits, how it is dragged, and that this redraws nothing."""

from __future__ import annotations

import pytest
from kivy.core.window import Window
from kivy.metrics import dp, sp
from kivy.uix.widget import Widget

from app.screens.common.overlays import Dialogs
from app.screens.scheduler.axis import Band
from app.screens.scheduler.timeline import Bar, Lane
from app.widgets.chart import glyphs
from app.widgets.lanes import LONG, Lanes
from app.widgets.lanes_drawing import Drawing
from app.widgets.places import STILL
from app.widgets.scrolling import WHEEL
from app.widgets.scrolling import CalmScroll as HoursPage
from tests.ui.drawing import LANES, fingers, fired, instructions, put_down, textures


def test_a_tap_on_a_bar_says_which(ui):
    chart = ui.show(Lanes(lanes=LANES, ticks=[(6, "19:00", False)], now=1.2, now_label="14:12"), (800, 150))
    calls = fired(chart, "on_bar")
    left, width = 88, 800 - 88
    lane = (150 - 36) / 2
    top = chart.top - 36
    ui.tap_at(left + width * 2.5 / 24, top - lane / 2)
    ui.tap_at(left + width * 20.4 / 24, top - lane * 1.5)  # a fingertip next to a thin bar
    ui.tap_at(left + width * 12 / 24, top - lane / 2)  # nothing near
    assert calls == [("b",), ("c",)]


def test_a_tap_where_bars_overlap_says_the_one_that_is_tapped(ui):
    chart = ui.show(Lanes(lanes=[Lane("Aino", bars=(Bar("a", 8, 14), Bar("b", 8, 14)))], hours=24), (800, 160))
    calls = fired(chart, "on_bar")
    for _left, bottom, _right, top, _key in [*chart.boxes()]:
        ui.tap_at(chart.left_of(11), (bottom + top) / 2)
        ui.advance(0.5)
    assert calls == [("a",), ("b",)]


def test_bars_a_minute_apart_are_both_found_at_any_zoom(ui):
    bars = (Bar("a", 10, 10.1), Bar("b", 10.02, 10.1))
    chart = ui.show(Lanes(lanes=[Lane("Aino", bars=bars)], hours=168), (800, 100))
    calls = fired(chart, "on_bar")
    ui.tap_at(chart.left_of(10) - 12, chart.top - 60)  # a fingertip next to them
    assert calls[0][0] in ("a", "b")


def test_a_finger_drags_the_hours_and_a_tap_after_it_still_hits(ui):
    chart = ui.show(Lanes(lanes=LANES, hours=24), (800, 150))
    calls, bars = fired(chart, "on_window"), fired(chart, "on_bar")
    unit = (800 - 88) / 24
    y = chart.top - 36 - (150 - 36) / 4
    fingers(chart, [(500, y), (480, y), (500 - 2 * unit, y)])
    assert calls == [(pytest.approx(2),)]
    assert bars == []  # a drag is not a tap
    ui.advance()
    ui.tap_at(88 + unit * 0.5, y)  # the bar from 1.5 to 3
    assert bars == [("b",)]


@pytest.mark.parametrize("lanes", [2, 20], ids=["a page that fits", "a page that scrolls"])
@pytest.mark.parametrize("with_shift", [False, True], ids=["a sideways wheel", "a wheel with shift"])
def test_a_wheel_that_is_turned_sideways_goes_along_the_hours(ui, monkeypatch, lanes, with_shift):
    rows = [Lane(f"Robot {n}", key=n) for n in range(lanes)]
    chart = Lanes(lanes=rows, hours=24, size_hint_y=None, height=max(300, 60 * lanes))
    page = HoursPage()
    page.add_widget(chart)
    ui.show(page, (800, 300))
    monkeypatch.setattr(Window, "_modifiers", ["shift"] if with_shift else [])
    calls, at = fired(chart, "on_window"), page.scroll_y
    for notches in (2, -1):
        ui.wheel(page, notches, sideways=not with_shift)
    hour = dp(WHEEL) * 24 / (chart.right - chart.left_of(chart.first))
    assert calls == [(pytest.approx(n * hour),) for n in (1, 2, 1)]
    assert (chart.touched, page.scroll_y) == (False, at)


def rest(ui, x, y):
    """A finger that stays where it was put down until a press is a long one."""
    touch = put_down(x, y)
    ui.advance(LONG + 0.1)
    return touch


@pytest.mark.parametrize("hour", [10.5, 18], ids=["a bar that was lifted", "free time"])
def test_a_dialog_that_opens_by_itself_takes_the_finger_off_the_timeline(ui, hour):
    chart = ui.show(
        Lanes(lanes=[Lane("Aino", bars=(Bar("planned", 10, 11, movable=True),), key=1)], hours=24), (800, 100)
    )
    fires, y = [fired(chart, name) for name in ("on_bar", "on_moved", "on_free")], chart.y + 30
    touch = put_down(chart.left_of(hour), y)
    ui.advance(LONG + 0.1 if hour == 10.5 else 0.2)
    menu = Dialogs().menu(chart, "Late starts", [], print)
    if hour == 10.5:
        touch.touch_move(chart.left_of(hour + 3), y)
    ui.advance(LONG + 0.1)
    touch.touch_up()
    assert (fires, chart.touched) == ([[], [], []], False)
    menu.dismiss()
    ui.advance(1)
    ui.tap_at(chart.left_of(10.5), y)
    assert fires[0] == [("planned",)]


def test_a_finger_may_rest_next_to_a_bar_that_does_not_move(ui):
    """Next to one that can be moved it lifts that."""
    chart = ui.show(
        Lanes(
            lanes=[Lane("Aino", bars=(Bar("ended", 2, 3, state="past"), Bar("planned", 10, 11, movable=True)))],
            hours=24,
        ),
        (800, 100),
    )
    free, moved, windows = (fired(chart, name) for name in ("on_free", "on_moved", "on_window"))
    for hour in (11, 3):
        touch = rest(ui, chart.left_of(hour) + 14, chart.y + 30)
        touch.touch_move(chart.left_of(hour + 5), chart.y + 30)
        touch.touch_up()
    assert [key for key, _hour in moved] == ["planned"]
    assert len(windows) == 1  # the other one is dragged over with the hours
    assert free == []


def test_a_finger_that_rests_on_free_time_says_whose_and_when_to_five_minutes(ui):
    lanes = [Lane("Aino", key=1), Lane("Veikko", bars=(Bar("c", 20, 21),), key=2)]
    chart = ui.show(Lanes(lanes=lanes, hours=24), (800, 150))
    free, taps = fired(chart, "on_free"), fired(chart, "on_bar")
    unit = (800 - 88) / 24
    rest(ui, 88 + unit * 7.26, chart.y + 20).touch_up()
    rest(ui, 40, chart.y + 20).touch_up()  # a name
    rest(ui, 300, chart.top - 5).touch_up()  # the axis
    moving = put_down(300, chart.y + 20)
    moving.touch_move(280, chart.y + 20)
    ui.advance(LONG + 0.1)
    moving.touch_up()
    assert free == [(2, pytest.approx(7.25))]
    assert taps == []


def test_a_movable_bar_is_dragged_after_a_long_press_and_says_its_new_time(ui):
    bars = (Bar("a", 2, 4, movable=True), Bar("past", 10, 12))
    chart = ui.show(
        Lanes(lanes=[Lane("Aino", bars=bars)], hours=24, time_text=lambda hour: f"at {hour:.2f}"), (800, 100)
    )
    moved, windows, taps = fired(chart, "on_moved"), fired(chart, "on_window"), fired(chart, "on_bar")
    unit, y = (800 - 88) / 24, chart.y + 30
    touch = rest(ui, 88 + unit * 3, y)
    assert chart.touched
    assert glyphs("at 2.00", sp(16), "RobotoMedium") in textures(chart.canvas.after)
    touch.touch_move(88 + unit * 6.02, y)
    assert glyphs("at 5.00", sp(16), "RobotoMedium") in textures(chart.canvas.after)
    touch.touch_up()
    assert (moved, windows, chart.first, chart.touched) == ([("a", pytest.approx(5))], [], 0, False)
    assert not chart.canvas.after.children
    assert taps == []
    rest(ui, 88 + unit * 3, y).touch_up()  # nothing has moved: a slow tap
    assert taps == [("a",)]
    past = rest(ui, 88 + unit * 11, y)
    past.touch_move(88 + unit * 13, y)  # drags the hours
    past.touch_up()
    assert (len(moved), len(windows), taps) == (1, 1, [("a",)])


FOLDED = [Band(6, 54, "Sat–Sun, days off", "folded")]


def test_bars_after_a_break_lie_at_their_time_and_a_drag_crosses_it(ui):
    bars = (Bar("a", 2, 3), Bar("b", 60, 61))
    chart = ui.show(
        Lanes(lanes=[Lane("Aino", bars=bars)], bands=FOLDED, hours=24, now=58, now_label="14:12"), (800, 150)
    )
    unit, breaks = (800 - 88) / 24, fired(chart, "on_fold")
    places = {key: (left, right) for left, _bottom, right, _top, key in chart.boxes()}
    assert places["b"][0] == pytest.approx(88 + 6 * unit + 72 + 6 * unit)
    assert chart.left_of(58) == pytest.approx(places["b"][0] - 2 * unit)
    y = chart.top - 60
    fingers(chart, [(600, y), (580, y), (600 - 6 * unit - 72, y)])
    assert chart.first == pytest.approx(54)
    ui.advance(0.2)
    assert chart.left_of(60) == pytest.approx(88 + 6 * unit)
    fingers(chart, [(300, y), (320, y), (300 + 6 * unit + 72, y)])
    ui.advance()
    ui.tap_at(88 + 6 * unit + 36, y)
    assert breaks == [(pytest.approx(30, abs=2),)]


@pytest.fixture
def drawn(monkeypatch) -> list[Drawing]:
    """Every drawing that is begun."""
    begun: list[Drawing] = []
    begin = Drawing.__init__
    monkeypatch.setattr(Drawing, "__init__", lambda drawing, *seen: (begun.append(drawing), begin(drawing, *seen))[1])
    return begun


def test_dragging_and_letting_go_redraw_nothing(ui, drawn):
    chart = ui.show(Lanes(lanes=LANES, hours=24, ticks=[(n, str(n), False) for n in range(0, 24, 2)]), (800, 150))
    before, [drawing] = instructions(drawn[0]._bars), drawn
    touch = put_down(600, chart.center_y)
    for x in range(590, 100, -10):
        touch.touch_move(x, chart.center_y)
        ui.advance()
    assert drawing.moved == pytest.approx(100 - 600, abs=12)
    touch.touch_up()
    ui.advance(0.2)
    chart.now, chart.now_label = 10, "23:00"  # nor does the time
    ui.advance(0.2)
    assert drawn == [drawing]
    assert instructions(drawing._bars) == before


def test_a_button_on_the_lanes_is_still_seen_when_there_are_other_bars(ui):
    chart = ui.show(Lanes(lanes=LANES, hours=24), (800, 150))
    chart.add_widget(button := Widget())
    chart.lanes = LANES[:1]
    ui.advance(0.1)
    assert chart.canvas.indexof(button.canvas) > chart.canvas.indexof(chart._drawing.canvas) >= 0


@pytest.fixture
def lanes(ui) -> Lanes:
    """Three, and all fit."""
    bars = [Lane(name, bars=(Bar(name, 2, 8, movable=True),), key=name) for name in ("Aino", "Veikko", "Sisu")]
    return ui.show(Lanes(lanes=bars, hours=24), (888, 36 + 3 * 48))


def everything(chart) -> list[list[tuple]]:
    return [fired(chart, name) for name in ("on_bar", "on_free", "on_moved", "on_window", "on_fold", "on_lane")]


def test_a_finger_that_goes_to_another_lane_taps_nothing_there(ui, lanes):
    calls, x = everything(lanes), lanes.left_of(5)
    fingers(lanes, [(x, lanes.y + 20), (x, lanes.y + 40), (x + 3, lanes.y + 110)])
    assert calls == [[]] * 6


def test_a_second_finger_does_nothing(ui, lanes):
    calls = everything(lanes)
    one, other = put_down(lanes.left_of(3), lanes.y + 20), put_down(lanes.left_of(12), lanes.y + 60)
    other.touch_move(lanes.left_of(16), lanes.y + 60)
    other.touch_up()
    assert calls == [[]] * 6
    one.touch_up()
    assert calls[0] == [("Sisu",)]


def test_a_bar_whose_lane_has_just_come_under_the_finger_is_not_opened(ui, lanes):
    ui.advance(1)
    opened, place = fired(lanes, "on_bar"), (lanes.left_of(5), lanes.y + 20)
    lanes.lanes = [lanes.lanes[2], *lanes.lanes[:2]]
    ui.advance(0.1)
    ui.tap_at(*place)
    assert opened == []
    ui.advance(STILL)
    ui.tap_at(*place)
    assert len(opened) == 1


@pytest.mark.parametrize("held", [0.1, LONG + 0.1])
def test_a_finger_opens_or_moves_nothing_when_lanes_have_moved_under_it(ui, lanes, held):
    opened, moved = fired(lanes, "on_bar"), fired(lanes, "on_moved")
    touch = put_down(lanes.left_of(5), lanes.y + 20)
    lanes.lanes = [lanes.lanes[2], *lanes.lanes[:2]]
    ui.advance(held)
    if held > LONG:
        touch.touch_move(lanes.left_of(9), lanes.y + 20)
    touch.touch_up()
    assert (opened, moved) == ([], [])


def test_a_second_tap_at_once_is_the_same_as_the_first(ui):
    """A tap on several shows more of them, and others are under the finger then."""
    many = Lane("Aino", bars=(Bar(("zoom", 5, 1), 4, 6), Bar("a", 10, 11)), key=1)
    chart = ui.show(Lanes(lanes=[many, Lane("", line="40 robots", key="idle")], hours=24), (888, 36 + 2 * 48))
    bars, lines, x, y = fired(chart, "on_bar"), fired(chart, "on_lane"), chart.left_of(5), chart.top - 50
    chart.bind(
        on_bar=lambda *_args: setattr(chart, "lanes", [Lane("Aino", bars=(Bar("b", 4, 6),), key=1), chart.lanes[1]])
    )
    for _n in range(2):
        put_down(x, y).touch_up()
        ui.advance(0.1)
    assert bars == [(("zoom", 5, 1),)]
    ui.advance(1)
    for _n in range(2):
        put_down(x, chart.y + 20).touch_up()
        ui.advance(0.1)
    assert lines == [("idle",)]
    ui.tap_at(x, y)
    assert bars[1:] == [("b",)]


def scrolled(ui) -> tuple[HoursPage, Lanes]:
    """Twenty lanes, a third of them visible."""
    lanes = [Lane(f"R{n}", bars=(Bar(n, 2, 22),), key=n) for n in range(20)]
    chart = Lanes(lanes=lanes, hours=24, size_hint_y=None, height=36 + 20 * 48)
    page = HoursPage(do_scroll_x=False)
    page.add_widget(chart)
    ui.show(page, (888, 300))
    ui.advance(0.2)
    return page, chart


def test_a_quick_drag_sideways_moves_the_hours_of_lanes_that_scroll(ui):
    page, chart = scrolled(ui)
    touch = put_down(600, page.top - 150)
    for n in range(1, 11):
        touch.touch_move(600 - 20 * n, page.top - 150 + 4 * n)
        ui.advance()
    touch.touch_up()
    assert (page.scroll_y, chart.first) == (1, pytest.approx(6))


def test_a_second_finger_does_nothing_while_the_first_scrolls(ui):
    page, chart = scrolled(ui)
    calls = everything(chart)
    one = put_down(400, page.top - 250)
    for n in range(1, 6):
        one.touch_move(400, page.top - 250 + 10 * n)
        ui.advance()
    other = put_down(600, page.top - 150)
    ui.advance(0.1)
    other.touch_up()
    ui.advance(0.4)
    one.touch_up()
    ui.advance(1)
    assert page.scroll_y < 1
    assert calls == [[]] * 6
