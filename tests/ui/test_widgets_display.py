"""What is looked at: colours and their contrast, states, the frame, charts; and that the test window leaves no trace."""
from __future__ import annotations

import os

import pytest
from kivy.graphics import Color, Mesh, Rectangle, SmoothLine, StencilUse
from kivy.metrics import Metrics, sp
from kivy.tests.common import UnitTestTouch
from kivy.uix.label import Label
from kivymd.icon_definitions import md_icons
from kivymd.uix.screen import MDScreen

from app.domain.models import THEMES
from app.screens.logs.kpi_view import DayBar, RobotBar
from app.screens.scheduler.axis import Band
from app.screens.scheduler.timeline import Bar, Lane
from app.widgets import timeline_painting
from app.widgets.chart import Meter, Sparkline, glyphs, nice_step
from app.widgets.charts import RobotBars, StackedBars
from app.widgets.display import EmptyState, KpiCard, StatusBadge, ValueTile
from app.widgets.frame import AlarmBanner, Frame, NavIndicator, NavItem, TopBar
from app.widgets.robot_map import RobotMap
from app.widgets.surfaces import Tap
from app.widgets.swatch import Swatch
from app.widgets.text import Ico, Txt
from app.widgets.timeline import LONG, Timeline
from app.widgets.timeline_drawing import Drawing
from app.widgets.tokens import COLOURS, TONES, apply_theme, tk
from tests.ui import checks
from tests.ui.headless import COMMON, MOCK


def fired(widget, event: str) -> list[tuple]:
    calls: list[tuple] = []
    widget.bind(**{event: lambda _widget, *values: calls.append(values)})
    return calls


# ---------------------------------------------------------------------- colours
def test_every_text_and_part_has_its_contrast():
    assert checks.contrast_problems() == []


def test_contrast_is_computed_as_wcag_does():
    assert checks.contrast_ratio("#000000", "#FFFFFF") == pytest.approx(21)
    assert checks.contrast_ratio("#767676", "#FFFFFF") == pytest.approx(4.54, abs=.01)


@pytest.mark.parametrize("theme", THEMES)
def test_a_switch_recolours_what_is_on_screen(ui, stage, theme):
    badge = ui.show(StatusBadge(tone="fault", text="Stopped", icon="alert-octagon"))
    apply_theme(stage.theme_cls, theme)
    ui.advance()
    column = THEMES.index(theme)
    assert list(badge.tint) == pytest.approx(list(tk.fault_bg))
    assert list(ui.find(Txt, text="Stopped").color) == list(tk.fault_on)
    assert stage.theme_cls.primaryColor == tk.accent
    assert COLOURS["accent"][column].lower() in str(_hex(tk.accent))


def _hex(colour) -> str:
    return "#" + "".join(f"{round(channel * 255):02x}" for channel in colour[:3])


def test_every_tone_has_all_its_colours():
    for tone in TONES:
        assert {tone, f"{tone}_bg", f"{tone}_on", f"{tone}_solid"} <= COLOURS.keys()


# ---------------------------------------------------------------------- text
def test_an_unknown_icon_is_an_error_not_a_blank(ui):
    with pytest.raises(KeyError):
        Ico(icon="no-such-icon")
    assert Ico(icon="wifi").text == md_icons["wifi"]


def test_text_wraps_and_is_as_high_as_its_lines(ui):
    label = ui.show(Txt(text="Deliver kits to line 2 and bring the empties back", size_hint_x=None, width=120))
    ui.advance()
    narrow = label.height
    label.width = 600
    ui.advance()
    assert label.height < narrow / 2


def test_texts_follow_the_font_scale(ui):
    label = ui.show(Txt(text="Battery", fit=True))
    before = label.width
    Metrics.fontscale = 1.3
    try:
        ui.advance()
        assert label.width == pytest.approx(before * 1.3, rel=.06)
    finally:
        Metrics.fontscale = 1
        ui.advance()
    assert label.width == before


# ---------------------------------------------------------------------- cards
def test_a_stale_value_looks_stale_and_says_since_when(ui):
    tile = ui.show(ValueTile(label="Battery", value="78 %", level=.78, note="2 s ago"), (240, 96))
    value = ui.find(Txt, text="78 %")
    assert list(value.color) == list(tk.ink)
    tile.stale, tile.note = True, "Not seen since 14:02"
    ui.advance()
    assert list(value.color) == list(tk.ink3)
    assert ui.find(Meter).tone == "offline"
    assert "Not seen since 14:02" in ui.texts()


def test_an_empty_state_leads_on(ui):
    state = ui.show(EmptyState(icon="robot", title="Add your first robot", text="Its address is enough.", action="Add robot"))
    calls = fired(state, "on_release")
    ui.tap_text("Add robot")
    assert calls == [()]


def test_an_empty_state_without_a_way_has_no_button(ui):
    state = ui.show(EmptyState(icon="robot", title="Nothing yet"))
    calls = fired(state, "on_release")
    ui.tap(state)
    assert calls == []


def test_a_kpi_card_shows_value_unit_and_count(ui):
    ui.show(KpiCard(label="Success rate", value="98.1[size=18sp] %[/size]", note="405 of 413", history=[97, None, 98]), (260, 104))
    assert {"Success rate", "405 of 413"} <= set(ui.texts())
    assert any(isinstance(w, Label) and w.markup and w.text.startswith("98.1") for w in ui.seen())


# ---------------------------------------------------------------------- frame
ITEMS = [("home", "Home", "home-variant-outline", "home-variant"), ("logs", "Logs", "text-box-outline", "text-box")]


def frame(ui, **values) -> Frame:
    return ui.show(Frame(title="Home", date="Fri 20 Nov 2026", clock="14:38", robot="Aino", link="Connected", link_icon="wifi", items=ITEMS,
                         current="home", **values))


def test_the_frame_navigates(ui):
    window = frame(ui)
    calls = fired(window, "on_go")
    ui.tap(ui.find(NavItem, name="logs"))
    assert calls == [("logs",)]
    assert ui.find(NavItem, name="home").active      # until the navigator has gone there
    window.current = "logs"
    assert ui.find(NavItem, name="logs").active


def test_a_finger_on_a_screen_of_the_bar_shows(ui):
    frame(ui)
    item = ui.find(NavItem, name="logs")
    indicator = ui.find(NavIndicator, root=item)
    lift = ui.press(item)
    assert indicator.state_layer_color[3] > 0
    lift()
    assert indicator.state_layer_color[3] == 0


def test_a_finger_on_the_bar_gets_there_though_its_words_change_meanwhile(ui):
    window = frame(ui)
    calls = fired(window, "on_go")
    lift = ui.press(ui.find(NavItem, name="logs"))
    window.items = [("home", "Koti", "home-variant-outline", "home-variant"), ("logs", "Loki", "text-box-outline", "text-box")]
    lift()
    assert calls == [("logs",)]
    assert {"Koti", "Loki"} <= set(ui.texts())


@pytest.mark.parametrize("theme", THEMES)
def test_the_present_screen_is_marked_in_the_colours_of_the_theme(ui, stage, theme):
    window = frame(ui)
    window.current = "logs"
    apply_theme(stage.theme_cls, theme)
    ui.advance()
    marks = {item.name: ui.find(NavIndicator, root=item) for item in ui.find_all(NavItem)}
    assert list(marks["logs"].md_bg_color) == list(tk.accent_bg)
    assert [list(label.color) for label in marks["logs"].children] == [list(tk.accent_on)] * 2
    assert marks["home"].md_bg_color[3] == 0
    assert [list(label.color) for label in marks["home"].children] == [list(tk.ink2)] * 2


@pytest.mark.parametrize("width", range(640, 1280, 40))
def test_the_date_stays_or_is_gone_however_old_what_is_known_is(ui, width):
    bar = ui.show(TopBar(title="Home", date="Fri 20 Nov 2026", clock="14:38", robot="Aino"), (width, 64))
    narrow = set()
    for age in ("now", "2 s ago", "58 s ago", "59 min ago"):
        bar.link = f"Connected · {age}"
        ui.advance()
        narrow.add(bar.narrow)
    assert len(narrow) == 1


def test_the_robot_in_the_bar_can_be_tapped(ui):
    window = frame(ui)
    calls = fired(window, "on_pick_robot")
    ui.tap(ui.find(Txt, text="Aino"))
    assert calls == [()]


def test_the_banner_comes_with_an_alarm_and_goes_with_it(ui):
    window = frame(ui)
    body = window.ids.body
    high = body.height
    window.alarm, window.alarm_action, window.alarm_others = "Aino is stopped", "Show Aino", "+1 more"
    ui.advance()
    assert "Aino is stopped" in ui.texts()
    assert body.height < high - 70
    solve, others = fired(window, "on_solve"), fired(window, "on_list_alarms")
    ui.tap_text("Show Aino")
    ui.tap(ui.find(Txt, text="+1 more"))
    assert (solve, others) == ([()], [()])
    window.alarm = ""
    ui.advance()
    assert body.height == high
    assert ui.find_all(AlarmBanner) == []


def test_a_screen_that_is_added_to_the_frame_goes_between_bar_and_navigation(ui):
    window = frame(ui)
    screen = MDScreen()
    window.add_widget(screen)
    ui.advance()
    assert screen in window.ids.body.children
    bar = ui.find(TopBar)
    assert screen.top < bar.y
    assert screen.y > ui.find(NavItem).top


def test_screens_are_not_cut_off_at_their_edge(ui):
    """Scroll bars lie in the margin beside them; kivy's manager clips."""
    assert StencilUse not in map(type, frame(ui).ids.body.canvas.before.children)


# ---------------------------------------------------------------------- charts
def test_grid_steps_are_round_and_few():
    assert [nice_step(top) for top in (1, 3, 7, 88, 140, 999, 4200)] == [1, 1, 2, 25, 50, 250, 2000]
    for top in range(1, 3000, 7):
        assert 1 <= top // nice_step(top) + 1 <= 5


LANES = [Lane("Aino", bars=(Bar("a", 1, 2), Bar("b", 1.5, 3, "Empties"))), Lane("Veikko", bars=(Bar("c", 20, 20.1),))]


def test_a_tap_on_a_bar_says_which(ui):
    chart = ui.show(Timeline(lanes=LANES, ticks=[(6, "19:00", False)], now=1.2, now_label="14:12"), (800, 150))
    calls = fired(chart, "on_bar")
    left, width = 88, 800 - 88
    lane = (150 - 28) / 2
    top = chart.top - 28
    ui.tap_at(left + width * 2.5 / 24, top - lane / 2)
    ui.tap_at(left + width * 20.4 / 24, top - lane * 1.5)          # a fingertip beside a thin bar
    ui.tap_at(left + width * 12 / 24, top - lane / 2)              # nothing near
    assert calls == [("b",), ("c",)]


def test_a_tap_where_bars_lie_on_each_other_says_all_of_them_the_uppermost_first(ui):
    bars = (Bar("a", 1, 2), Bar("b", 1.5, 3), Bar("long", 10, 14), Bar("same", 10, 14), Bar("next", 14, 15))
    chart = ui.show(Timeline(lanes=[Lane("Aino", bars=bars)], hours=24), (800, 100))
    calls, y = fired(chart, "on_bar"), chart.top - 60
    for hour in (1.2, 1.7, 2.6, 12, 14.8):
        ui.tap_at(chart.left_of(hour), y)
    assert calls == [("a",), ("b", "a"), ("b",), ("same", "long"), ("next",)]


def test_bars_a_minute_apart_are_both_found_at_any_zoom(ui):
    bars = (Bar("a", 10, 10.1), Bar("b", 10.02, 10.1))
    chart = ui.show(Timeline(lanes=[Lane("Aino", bars=bars)], hours=168), (800, 100))
    calls = fired(chart, "on_bar")
    ui.tap_at(chart.left_of(10) - 12, chart.top - 60)             # a fingertip beside them
    assert sorted(calls[0]) == ["a", "b"]


def test_a_bar_on_another_leaves_an_edge_of_it_in_sight_and_only_its_own_words(ui):
    bars = (Bar("a", 8, 14, "Kits"), Bar("b", 8, 14, "Empties"), Bar("c", 8, 9.9, "C"), Bar("d", 15, 20, "Waste"))
    chart = ui.show(Timeline(lanes=[Lane("Aino", bars=bars)], hours=24), (800, 28 + 44))
    tops = {key: top for _left, _bottom, _right, top, key in chart.boxes()}
    assert tops["a"] == tops["d"] == pytest.approx(tops["b"] + 5) == pytest.approx(tops["c"] + 10)
    assert [texture for _x, texture in words_of(chart)] == [glyphs(words, sp(14), "Roboto") for words in ("Empties", "Waste")]
    assert words_of(chart)[0][0] > chart.left_of(9.9)             # where it is in sight


def fingers(chart, *paths):
    """Touches that move together: a list of points for each."""
    touches = [UnitTestTouch(*path[0]) for path in paths]
    for touch in touches:
        touch.touch_down()
    for step in zip(*(path[1:] for path in paths), strict=True):
        for touch, (x, y) in zip(touches, step, strict=True):
            touch.touch_move(x, y)
    for touch in touches:
        touch.touch_up()


def test_a_finger_drags_the_hours_and_a_tap_after_it_still_hits(ui):
    chart = ui.show(Timeline(lanes=LANES, hours=24), (800, 150))
    calls, bars = fired(chart, "on_window"), fired(chart, "on_bar")
    unit = (800 - 88) / 24
    y = chart.top - 28 - (150 - 28) / 4
    fingers(chart, [(500, y), (480, y), (500 - 2 * unit, y)])
    assert calls == [(pytest.approx(2), 24)]
    assert bars == []                                             # a drag is no tap
    ui.advance()
    ui.tap_at(88 + unit * .5, y)                                  # the bar from 1.5 to 3
    assert bars == [("b",)]


def rest(ui, x, y):
    """A finger that stays where it was put down until a press is a long one."""
    touch = put_down(x, y)
    ui.advance(LONG + .1)
    return touch


def test_a_finger_that_rests_on_free_time_says_whose_and_when_to_five_minutes(ui):
    lanes = [Lane("Aino", key=1), Lane("Veikko", bars=(Bar("c", 20, 21),), key=2)]
    chart = ui.show(Timeline(lanes=lanes, hours=24), (800, 150))
    free, taps = fired(chart, "on_free"), fired(chart, "on_bar")
    unit = (800 - 88) / 24
    rest(ui, 88 + unit * 7.26, chart.y + 20).touch_up()
    rest(ui, 40, chart.y + 20).touch_up()                         # a name
    rest(ui, 300, chart.top - 5).touch_up()                       # the axis
    moving = put_down(300, chart.y + 20)
    moving.touch_move(280, chart.y + 20)
    ui.advance(LONG + .1)
    moving.touch_up()
    assert free == [(2, pytest.approx(7.25))]
    assert taps == []


def test_a_bar_that_may_be_moved_is_dragged_after_a_long_press_and_says_its_new_time(ui):
    bars = (Bar("a", 2, 4, movable=True), Bar("past", 10, 12))
    chart = ui.show(Timeline(lanes=[Lane("Aino", bars=bars)], hours=24, time_text=lambda hour: f"at {hour:.2f}"), (800, 100))
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
    rest(ui, 88 + unit * 3, y).touch_up()                         # nothing has moved
    past = rest(ui, 88 + unit * 11, y)
    past.touch_move(88 + unit * 13, y)                            # drags the hours
    past.touch_up()
    assert (len(moved), len(windows), taps) == (1, 1, [])


FOLDED = [Band(6, 54, "Sat–Sun, no work", "folded")]


def test_what_is_after_a_break_lies_where_its_time_is_and_a_drag_goes_over_it(ui):
    bars = (Bar("a", 2, 3), Bar("b", 60, 61))
    chart = ui.show(Timeline(lanes=[Lane("Aino", bars=bars)], bands=FOLDED, hours=24, now=58, now_label="14:12"), (800, 150))
    unit, breaks = (800 - 88) / 24, fired(chart, "on_fold")
    places = {key: (left, right) for left, _bottom, right, _top, key in chart.boxes()}
    assert places["b"][0] == pytest.approx(88 + 6 * unit + 72 + 6 * unit)
    assert chart.left_of(58) == pytest.approx(places["b"][0] - 2 * unit)
    y = chart.top - 60
    fingers(chart, [(600, y), (580, y), (600 - 6 * unit - 72, y)])
    assert chart.first == pytest.approx(54)
    ui.advance(.2)
    assert chart.left_of(60) == pytest.approx(88 + 6 * unit)
    fingers(chart, [(300, y), (320, y), (300 + 6 * unit + 72, y)])
    ui.tap_at(88 + 6 * unit + 36, y)
    assert breaks == [(pytest.approx(30, abs=2),)]


def test_two_fingers_zoom_beyond_a_break_around_what_is_under_them(ui):
    chart = ui.show(Timeline(lanes=[Lane("Aino", bars=(Bar("b", 60, 61),))], bands=FOLDED, hours=24), (888, 150))
    middle = chart.left_of(60)
    fingers(chart, *([(middle + side * x, chart.center_y) for x in (50, 75, 100)] for side in (-1, 1)))
    ui.advance(.2)
    assert chart.hours == pytest.approx(12)
    assert chart.left_of(60) == pytest.approx(middle, abs=1)


def textures(group) -> list:
    return [one.texture for one in instructions(group) if isinstance(one, Rectangle)]


@pytest.fixture
def drawn(monkeypatch) -> list[Drawing]:
    """Every drawing that is begun."""
    begun: list[Drawing] = []
    begin = Drawing.__init__
    monkeypatch.setattr(Drawing, "__init__", lambda drawing, *seen: (begun.append(drawing), begin(drawing, *seen))[1])
    return begun


def put_down(x, y):
    touch = UnitTestTouch(x, y)
    touch.touch_down()
    return touch


def instructions(group) -> list:
    return [group, *(one for child in getattr(group, "children", ()) for one in instructions(child))]


def test_while_it_is_dragged_and_when_it_is_let_go_nothing_is_drawn_anew(ui, drawn):
    chart = ui.show(Timeline(lanes=LANES, hours=24, ticks=[(n, str(n), False) for n in range(0, 24, 2)]), (800, 150))
    before, [drawing] = instructions(drawn[0]._bars), drawn
    touch = put_down(600, chart.center_y)
    for x in range(590, 100, -10):
        touch.touch_move(x, chart.center_y)
        ui.advance()
    assert drawing.moved == pytest.approx(100 - 600, abs=12)      # far beyond its margin: there is nothing that it lacks
    touch.touch_up()
    ui.advance(.2)
    chart.now, chart.now_label = 10, "23:00"                      # nor does the time
    ui.advance(.2)
    assert drawn == [drawing]
    assert instructions(drawing._bars) == before


def test_a_drag_towards_what_is_not_drawn_yet_draws_it_before_it_comes_into_sight(ui, drawn):
    far = Lane("Sisu", bars=[Bar(n, n, n + .5) for n in range(100)])
    chart = ui.show(Timeline(lanes=[far], hours=24), (800, 150))
    touch = put_down(700, chart.center_y)
    for x in range(690, 100, -10):
        touch.touch_move(x, chart.center_y)
        ui.advance()
        assert chart._drawing.reaches(chart.first)
    assert 2 <= len(drawn) <= 3
    touch.touch_up()


def test_a_crowd_is_drawn_over_several_frames_and_then_seen_at_once(ui, monkeypatch):
    bars = [Bar(n, n / 50, n / 50 + .03) for n in range(1000)]
    chart = ui.show(Timeline(lanes=[Lane("Aino")], hours=24), (800, 600))
    old, show_lanes, frames = chart._drawing, Drawing.show_lanes, []

    def one_frame(drawing, *seen):
        done = show_lanes(drawing, *seen)
        frames.append((len(drawing.lanes), chart._drawing is old))
        return done

    monkeypatch.setattr(Drawing, "show_lanes", one_frame)
    chart.lanes = [Lane(f"R{lane}", bars=bars) for lane in range(8)]
    ui.advance(.3)
    assert frames == [(2, True), (4, True), (6, True), (8, True)]
    assert chart._drawing.lanes == list(range(8))
    assert old.canvas not in chart.canvas.children


def test_two_fingers_zoom_and_keep_what_is_under_them(ui):
    chart = ui.show(Timeline(lanes=LANES, hours=24), (888, 150))
    calls = fired(chart, "on_window")
    middle = 88 + 400                                             # hour 12
    fingers(chart, *([(middle + side * x, chart.center_y) for x in (100, 150, 200)] for side in (-1, 1)))
    [(first, hours)] = calls
    assert hours == pytest.approx(12)
    assert first + hours / 2 == pytest.approx(12)
    fingers(chart, *([(middle + side * x, chart.center_y) for x in (10, 350)] for side in (-1, 1)))
    assert calls[-1][1] == 6                                      # not nearer


LOOKS = ("planned", "about", "assumed", "running", "past", "failed", "skipped", "held")


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize("look", LOOKS)
def test_a_bar_has_one_colour_at_every_width_and_in_the_legend(ui, stage, theme, look):
    """Wide, narrow, of a crowd, and as the key that explains it."""
    apply_theme(stage.theme_cls, theme)
    state, assumed = ("planned", True) if look == "assumed" else (look, False)

    def colours_of(widget, root) -> list[tuple]:
        """Fill and border, as far as they are drawn."""
        wanted = timeline_painting.colours()[look]
        drawn = {tuple(one.rgba) for one in instructions(root) if isinstance(one, Color)}
        return [tuple(colour) in drawn for colour in (wanted.fill, wanted.edge)]

    for hours, bars in ((24, [Bar(1, 2, 8, "", state, assumed=assumed)]), (168, [Bar(1, 2, 2.8, "", state, assumed=assumed)]),
                        (24, [Bar(n, n / 10, n / 10 + .1, "", state, assumed=assumed) for n in range(240)])):
        chart = ui.show(Timeline(lanes=[Lane("Aino", bars=bars)], hours=hours), (800, 100))
        assert colours_of(chart, chart._drawing._bars) == [True, True]
    key = ui.show(Swatch(kind=look), (14, 14))
    assert colours_of(key, key.canvas) == [True, True]


@pytest.mark.parametrize("theme", THEMES)
def test_no_two_kinds_of_bars_look_the_same(ui, stage, theme):
    apply_theme(stage.theme_cls, theme)
    looks = timeline_painting.colours()
    assert looks["about"] == looks["planned"]                # that one is told by its shape
    assert len({(tuple(one.fill), tuple(one.edge)) for one in looks.values()}) == len(looks) - 1 == len(LOOKS) - 1
    for one in looks.values():
        assert checks.contrast_ratio(_hex(one.ink), _hex(one.fill)) >= 4.5


@pytest.mark.parametrize(("hours", "bars"), [(24, [(2., 8.)]), (168, [(2., 2.8)]), (24, [(n / 10, n / 10 + .1) for n in range(240)])])
def test_a_bar_whose_robot_is_a_forecast_is_told_by_its_shape_at_every_width(ui, hours, bars):
    def shapes(state: str) -> int:
        lane = Lane("Aino", bars=[Bar(n, *span, "", state) for n, span in enumerate(bars)])
        chart = ui.show(Timeline(lanes=[lane], hours=hours), (800, 100))
        return sum(isinstance(one, Rectangle | Mesh) for one in instructions(chart._drawing._bars))
    assert shapes("about") > shapes("skipped")               # which is but a box


@pytest.mark.parametrize("hours", [6, 24, 168])
def test_an_overlap_is_marked_below_the_words_of_its_bars_at_every_zoom(ui, hours):
    chart = ui.show(Timeline(lanes=[Lane("Aino", bars=[Bar(1, 1, 3, "Kits"), Bar(2, 2, 4, "Empties")])], hours=hours), (800, 100))
    before = len(instructions(chart._drawing._bars))
    chart.lanes = [chart.lanes[0]._replace(overlaps=((2, 3),))]
    ui.advance(.1)
    marks = instructions(chart._drawing._bars)[before:]
    assert marks
    y, height = chart._drawing.frame.middle(0), chart._drawing.frame.bar_height
    tops = [mark.pos[1] + mark.size[1] for mark in marks if isinstance(mark, Rectangle)]
    tops += [max(mark.vertices[1::4]) for mark in marks if isinstance(mark, Mesh)]
    assert tops
    assert max(tops) <= y - height / 6


def test_a_crowded_lane_is_drawn_in_few_pieces_and_its_bars_are_still_hit(ui):
    bars = [Bar(n, n / 50, n / 50 + .03) for n in range(1000)]
    chart = ui.show(Timeline(lanes=[Lane("Aino", bars=bars)], hours=24), (800, 100))
    assert len([*chart.boxes()]) == 1000
    assert len(chart.canvas.children) < 60
    calls = fired(chart, "on_bar")
    ui.tap_at(88 + (800 - 88) * 10.015 / 24, chart.top - 28 - 36)
    assert abs(calls[0][0] - 500) <= 3                            # a bar is less than a px wide


def test_of_many_lanes_only_those_in_sight_are_drawn(ui):
    lanes = [Lane(f"R{n}", bars=[Bar(n, 1, 2)]) for n in range(50)]
    chart = ui.show(Timeline(lanes=lanes, seen_height=200, seen_from=0), (800, 28 + 50 * 44))
    assert len([*chart.boxes()]) <= 8
    chart.seen_from = 20 * 44
    ui.advance()
    assert {key for *_box, key in [*chart.boxes()]} >= {20, 21, 22, 23}
    assert len([*chart.boxes()]) <= 8


def test_the_axis_stays_on_top_and_takes_the_taps_there_while_lanes_scroll(ui):
    lanes = [Lane(f"R{n}", bars=[Bar(n, 1, 5)], key=n) for n in range(50)]
    chart = ui.show(Timeline(lanes=lanes, seen_height=200, hours=24), (800, 28 + 50 * 44))
    chart.top, chart.seen_from = ui.window.height + 440, 440
    ui.advance()
    assert chart._drawing._pin.y == -440
    calls, opened = fired(chart, "on_bar"), fired(chart, "on_lane")
    ui.tap_at(200, ui.window.height - 20)
    assert calls == []
    ui.tap_at(200, ui.window.height - 40)
    assert calls == [(10,)]
    chart.lanes = [Lane("", key="idle", line="34 robots with nothing planned"), *lanes]
    chart.seen_from = 0
    chart.top = ui.window.height
    ui.advance(.1)
    for x in (20, 400):
        ui.tap_at(x, ui.window.height - 50)
    assert opened == [("idle",), ("idle",)]


def words_of(chart) -> list[tuple[float, object]]:
    """Where names of bars are seen to begin, and which."""
    return [(one.pos[0] + chart._drawing.moved, one.texture) for one in instructions(chart._drawing._words) if isinstance(one, Rectangle)]


def test_names_of_bars_are_whole_in_what_is_seen_of_them_also_after_a_drag(ui):
    chart = ui.show(Timeline(lanes=[Lane("Aino", bars=(Bar("a", 2, 12, "Kits"), Bar("b", 20, 20.2, "Empties")))], hours=24), (800, 100))
    y = chart.center_y
    unit, kits, empties = (800 - 88) / 24, glyphs("Kits", sp(14), "Roboto"), glyphs("Empties", sp(14), "Roboto")
    assert words_of(chart) == [(pytest.approx(88 + 2 * unit + 10, abs=1), kits), (pytest.approx(88 + 20 * unit + 12, abs=1), empties)]
    fingers(chart, [(500, y), (480, y), (500 - 4 * unit, y)])     # the long one begins out of sight
    ui.advance(.2)
    assert words_of(chart) == [(pytest.approx(98, abs=1), kits), (pytest.approx(88 + 16 * unit + 12, abs=1), empties)]
    fingers(chart, [(500, y), (480, y), (500 - 7.6 * unit, y)])      # too little of it is left: beside it
    ui.advance(.2)
    assert words_of(chart)[0] == (pytest.approx(88 + .4 * unit + 6, abs=1), kits)
    fingers(chart, [(500, y), (480, y), (500 - 9.6 * unit, y)])      # the name beside the other would be cut
    ui.advance(.2)
    assert empties not in [texture for _x, texture in words_of(chart)]


def test_times_at_the_edges_of_the_axis_are_whole_or_not_there(ui):
    ticks = [(hour, f"{n:02d}:00", False) for n, hour in enumerate((-.3, *range(2, 23, 2), 24.3))]
    chart = ui.show(Timeline(lanes=[Lane("Aino")], hours=24, ticks=ticks), (800, 100))
    seen = {glyphs(label, sp(14), "Roboto"): (hour, label) for hour, label, _strong in ticks}
    drawn = [one for one in instructions(chart._drawing._axis) if isinstance(one, Rectangle) and one.texture in seen]
    assert len(drawn) > 8
    assert not [seen[one.texture] for one in drawn if any(one.pos[0] < edge < one.pos[0] + one.size[0] for edge in (88, 800))]


def day_of(hour: float) -> str:
    return f"Day {int(hour // 24)}"


def test_the_day_at_the_left_edge_is_named_beside_the_axis_also_while_it_is_dragged(ui):
    chart = ui.show(Timeline(lanes=LANES, hours=6, first=44, day_text=day_of), (800, 150))

    def named() -> list:
        return [n for n in range(5) if glyphs(f"Day {n}", sp(14), "RobotoMedium") in textures(chart.canvas)]

    assert named() == [1]
    day = glyphs("Day 1", sp(14), "RobotoMedium")
    where = next(one for one in instructions(chart.canvas) if isinstance(one, Rectangle) and one.texture == day)
    assert where.pos[0] + where.size[0] < chart.left_of(44)
    assert where.pos[1] > chart.top - 28
    touch = put_down(700, chart.center_y)
    for x in range(690, 600, -10):
        touch.touch_move(x, chart.center_y)
    ui.advance()
    assert named() == [1]
    for x in range(600, 100, -10):
        touch.touch_move(x, chart.center_y)
    ui.advance()
    assert (round(chart.first), named()) == (49, [2])
    touch.touch_up()
    chart.first = 0
    ui.advance(.1)
    assert named() == [0]


def test_a_long_name_of_a_day_moves_the_hours_rather_than_lie_on_them(ui):
    day = "Keskiviikko 25.11. ja vielä vähän"
    chart = ui.show(Timeline(lanes=LANES, hours=6, first=40, day_text=lambda _hour: day), (800, 150))
    assert chart.left_of(40) > glyphs(day, sp(14), "RobotoMedium").width


@pytest.mark.parametrize("now", [23.8, 24.0, 24.2])
def test_the_day_that_begins_near_now_is_named_beside_the_time(ui, now):
    ticks = [*((n, f"{n % 24:02d}:00", False) for n in range(18, 36) if n != 24), (24, "Tue 24 Nov", True)]
    chart = ui.show(Timeline(lanes=LANES, hours=6, first=21, ticks=ticks, now=now, now_label="23:48"), (800, 150))
    drawn = {one.texture: one.pos[0] for one in instructions(chart._drawing._axis) if isinstance(one, Rectangle) and one.texture}
    day, time = (glyphs(words, sp(14), "RobotoMedium") for words in ("Tue 24 Nov", "23:48"))
    left, clock = drawn[day], drawn[time]
    assert left + day.width + 6 <= clock - 8 or clock + time.width + 8 + 6 <= left + 1
    assert abs(left - chart.left_of(24)) < 120


def test_a_block_too_narrow_for_its_words_says_its_number(ui):
    crowd = [Bar(n, n, n + .1) for n in range(10)]
    chart = ui.show(Timeline(lanes=[Lane("Aino", bars=(Bar("a", 2, 3.2, "39 runs", short="39"), Bar("b", 3.3, 4)))], hours=24), (800, 100))
    assert [texture for _x, texture in words_of(chart)] == [glyphs("39", sp(14), "Roboto")]
    chart.lanes = [Lane(f"R{n}", bars=(Bar("a", 2, 6, "39 runs", short="39"), *crowd)) for n in range(20)]
    chart.height = 28 + 20 * 44
    ui.advance(.2)
    assert chart._drawing.is_crowded
    assert {texture for _x, texture in words_of(chart)} == {glyphs("39 runs", sp(14), "Roboto")}


def test_a_share_that_hardly_changes_draws_no_mountain_and_is_not_filled(ui):
    line = ui.show(Sparkline(values=[.97, .98, .96, .97], least_span=.1), (64, 50))
    low, high = line.scale()
    assert high - low == pytest.approx(.1)
    assert 0 <= low <= .96 <= .98 <= high <= 1.0001
    assert not [one for one in instructions(line.canvas) if isinstance(one, Mesh)]
    [points] = line.runs()
    assert max(y for _x, y in points) - min(y for _x, y in points) < 10


def test_what_is_filled_begins_at_zero_and_gaps_stay_open(ui):
    line = ui.show(Sparkline(values=[20, 21, None, 19, 20, 9]), (64, 50))
    assert line.scale() == (0, 21)
    first, second = line.runs()
    assert (len(first), len(second)) == (2, 3)
    assert len([one for one in instructions(line.canvas) if isinstance(one, Mesh)]) == 2      # and nothing below today's


def test_today_has_not_ended_and_a_single_day_is_no_line(ui):
    line = ui.show(Sparkline(values=[5, 6, 2]), (64, 50))
    solid, *dashes = [one for one in instructions(line.canvas) if isinstance(one, SmoothLine)]
    assert (len(solid.points), len(dashes)) == (4, 3)
    assert dashes[0].points[:2] == solid.points[-2:]
    line.values = [None, None, 6]
    ui.advance()
    assert not line.canvas.children


@pytest.mark.parametrize("value", ["95.6", "26 min 56 s", "1"])
def test_every_figure_has_its_line_at_the_same_width(ui, value):
    card = ui.show(KpiCard(label="Figure", value=value, history=[1, 2, 3]), (320, 120))
    assert ui.find(Sparkline, card).width == 64


@pytest.mark.parametrize("chart", [
    lambda: Timeline(), lambda: Timeline(lanes=[Lane("Aino")]),
    lambda: StackedBars(), lambda: StackedBars(days=[DayBar("Mo", 0, 0, 0, 0)]),
    lambda: RobotBars(), lambda: RobotBars(rows=[RobotBar("Aino", "0 %", "0 min", 0, 0), RobotBar("Sisu", "100 %", "8 h", 1, .5)]),
    lambda: Sparkline(), lambda: Sparkline(values=[None, None]), lambda: Sparkline(values=[5]), lambda: Sparkline(values=[5, 5, None, 5]),
    lambda: RobotMap(), lambda: RobotMap(at=[.5, .5], path=[(.5, .5), (.5, .5)])])
def test_charts_draw_whatever_there_is(ui, chart):
    widget = ui.show(chart(), (400, 120))
    drawn = len(widget.canvas.children)
    widget.size = 2, 2
    ui.advance()
    assert len(widget.canvas.children) <= drawn


# ---------------------------------------------------------------------- the checks themselves
def test_the_checks_see_a_small_target_and_a_clipped_text(ui):
    ui.show(Tap(), (30, 30))
    assert any("small target" in line for line in checks.problems(ui.window.children[0]))
    label = Label(text="A text far too long for its box", font_size=10, size_hint=(None, None), size=(40, 10))
    ui.show(label)
    found = " ".join(checks.problems(label))
    assert "small text" in found
    assert "clipped" in found


def test_the_window_of_the_tests_leaves_the_environment_alone():
    assert not (COMMON.keys() | MOCK.keys()) & os.environ.keys()


@pytest.mark.parametrize("width", [800, 1024, 1280])
def test_the_bar_has_room_for_long_names(ui, width):
    bar = TopBar(title="Scheduler", date="Wed 30 Sep 2026", clock="14:38", robot="Kuljetusrobotti hallin 2 eteläpäässä, pakkaamon puolella",
                 link="Not seen since 14:02", icon="wifi-off", tone="attention")
    ui.show(bar, (width, 64))
    ui.advance()
    assert checks.problems(bar) == []


def test_the_date_gives_way_where_there_is_no_room(ui):
    bar = TopBar(title="Home", date="Fri 20 Nov 2026", clock="14:38", robot="Aino", link="Connected · now", icon="wifi")
    ui.show(bar, (800, 64))
    ui.advance()
    assert "Fri 20 Nov 2026" in ui.texts()
    bar.width = 560
    ui.advance()
    assert "Fri 20 Nov 2026" not in ui.texts()
