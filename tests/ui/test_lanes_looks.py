"""What the timeline looks like: one colour for one state, whole names and times, few pieces."""

from __future__ import annotations

import pytest
from kivy.graphics import Color, Mesh, Rectangle
from kivy.metrics import sp

from app.domain.models import THEMES
from app.screens.scheduler.axis import Band
from app.screens.scheduler.timeline import Bar, Lane
from app.widgets import lanes_frame
from app.widgets.chart import glyphs
from app.widgets.lanes import Lanes
from app.widgets.lanes_bars import ICONS
from app.widgets.lanes_frame import AXIS
from app.widgets.shapes import bordered_patch, patch
from app.widgets.tokens import apply_theme, tk
from tests.ui import checks
from tests.ui.drawing import LANES, fingers, fired, hex_of, instructions, put_down, textures, words_of

LOOKS = ("planned", "running", "past", "failed", "skipped", "held", "refused")


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize("look", LOOKS)
def test_a_bar_has_one_colour_and_round_corners_at_every_width(ui, stage, theme, look):
    """Wide, narrow, and of a crowd."""
    apply_theme(stage.theme_cls, theme)
    wanted = lanes_frame.colours()[look]
    for hours, bars in (
        (24, [Bar(1, 2, 8, "", look)]),
        (168, [Bar(1, 2, 2.8, "", look)]),
        (24, [Bar(n, n / 10, n / 10 + 0.1, "", look) for n in range(240)]),
    ):
        chart = ui.show(Lanes(lanes=[Lane("Aino", bars=bars)], hours=hours), (800, 100))
        drawn = instructions(chart._drawing._bars)
        (bars,) = (one for one in drawn if isinstance(one, Mesh))
        corners, fill, edge = (6,) * 4, tuple(wanted.fill), tuple(wanted.edge)
        plain, *bordered = patch(corners)[0], *(bordered_patch(corners, ring, fill, edge)[0] for ring in (1, 2))
        assert bars.texture in bordered or (bars.texture is plain and fill == edge)
        assert not [one for one in drawn if isinstance(one, Rectangle) and one.texture is None]


@pytest.mark.parametrize("width", [60, 88, 89])
def test_lanes_no_wider_than_their_names_are_drawn(ui, width):
    """As in a window that is being made smaller: 88 dp are for names."""
    assert ui.show(Lanes(lanes=[Lane("Aino", bars=[Bar(1, 2, 8, "Kits")])], hours=24), (width, 100)).boxes()


@pytest.mark.parametrize("theme", THEMES)
def test_what_has_ended_is_seen_on_a_closed_day(ui, stage, theme):
    apply_theme(stage.theme_cls, theme)
    edge, closed = lanes_frame.colours()["past"].edge, tk.closed
    assert checks.contrast_ratio(hex_of(edge), hex_of(closed)) >= 3


@pytest.mark.parametrize("theme", THEMES)
def test_no_two_kinds_of_bars_look_the_same(ui, stage, theme):
    """What was not run, what is on hold and what would be refused differ by their icons, a draft and what it changes by their dashes."""
    apply_theme(stage.theme_cls, theme)
    looks = lanes_frame.colours()
    plain = [looks[name] for name in ("planned", "running", "past", "failed", "skipped")]
    assert len({(tuple(one.fill), tuple(one.edge)) for one in plain}) == len(plain)
    assert len({ICONS[name] for name in ("skipped", "held", "refused")}) == 3
    for one in looks.values():
        assert checks.contrast_ratio(hex_of(one.ink), hex_of(one.fill)) >= 4.5


def test_bars_that_overlap_are_half_as_high_one_above_the_other_with_an_amber_edge(ui):
    bars = [Bar(1, 1, 3, "Kits"), Bar(2, 2, 4, "Empties"), Bar(3, 5, 6, "Waste")]
    chart = ui.show(Lanes(lanes=[Lane("Aino", bars=bars, overlaps=((2, 3),))], hours=24), (800, 160))
    boxes = {key: (bottom, top) for _left, bottom, _right, top, key in chart.boxes()}
    assert boxes[1][0] > boxes[2][1]
    assert boxes[3][1] - boxes[3][0] > boxes[1][1] - boxes[1][0]
    drawn = instructions(chart._drawing._bars)
    colour = next(n for n, one in enumerate(drawn) if isinstance(one, Color) and tuple(one.rgba) == tuple(tk.overlap))
    amber = next(one for one in drawn[colour:] if isinstance(one, Mesh))
    assert {round(y) for y in amber.vertices[1::4]} == {round(boxes[n][0]) + up for n in (1, 2) for up in (0, 4)}


def test_of_three_bars_that_overlap_the_latest_lies_above(ui):
    """Their names have room up to where the next one begins."""
    bars = [Bar(1, 1, 4, state="draft"), Bar(2, 2, 5), Bar(3, 3, 6, state="draft"), Bar(4, 8, 9)]
    chart = ui.show(Lanes(lanes=[Lane("Aino", bars=bars)], hours=24), (800, 160))
    looks, corners = lanes_frame.colours(), (6,) * 4
    draft, planned = patch(corners)[0], bordered_patch(corners, 1, *map(tuple, looks["planned"][::2]))[0]
    drawn = [one.texture for one in instructions(chart._drawing._bars) if isinstance(one, Mesh)]
    assert [texture for texture in drawn if texture in (draft, planned)] == [draft, planned, draft, planned]


@pytest.mark.parametrize(("lanes", "height"), [(1, 124), (4, 124), (8, 80), (20, 48)])
def test_lanes_share_the_room_between_48_and_124_dp(ui, lanes, height):
    shown = [Lane(f"R{n}", key=n) for n in range(lanes)]
    chart = Lanes(lanes=shown, hours=24)
    chart = ui.show(chart, (800, max(AXIS + 640, chart.wanted_height)))
    assert chart._drawing.frame.lane_height == pytest.approx(height)


def test_a_crowded_lane_is_drawn_in_few_pieces_and_its_bars_are_still_hit(ui):
    bars = [Bar(n, n / 50, n / 50 + 0.03) for n in range(1000)]
    chart = ui.show(Lanes(lanes=[Lane("Aino", bars=bars)], hours=24), (800, 100))
    assert len([*chart.boxes()]) == 1000
    assert len(chart.canvas.children) < 60
    calls = fired(chart, "on_bar")
    ui.tap_at(88 + (800 - 88) * 10.015 / 24, chart.top - 36 - 32)
    assert abs(calls[0][0] - 500) <= 3  # a bar is less than a px wide


def test_only_lanes_in_sight_are_drawn(ui):
    lanes = [Lane(f"R{n}", bars=[Bar(n, 1, 2)]) for n in range(50)]
    chart = ui.show(Lanes(lanes=lanes, seen_height=200, seen_from=0), (800, 36 + 50 * 48))
    assert len([*chart.boxes()]) <= 8
    chart.seen_from = 20 * 48
    ui.advance()
    assert {key for *_box, key in [*chart.boxes()]} >= {20, 21, 22, 23}
    assert len([*chart.boxes()]) <= 8


def test_the_axis_stays_on_top_and_takes_the_taps_there_while_lanes_scroll(ui):
    lanes = [Lane(f"R{n}", bars=[Bar(n, 1, 5)], key=n) for n in range(50)]
    chart = ui.show(Lanes(lanes=lanes, seen_height=200, hours=24), (800, 36 + 50 * 48))
    chart.top, chart.seen_from = ui.window.height + 480, 480
    ui.advance()
    assert chart._drawing._pin.y == -480
    calls, opened = fired(chart, "on_bar"), fired(chart, "on_lane")
    ui.tap_at(200, ui.window.height - 20)
    assert calls == []
    ui.tap_at(200, ui.window.height - 60)
    assert calls == [(10,)]
    chart.lanes = [Lane("Hall 1", key="hall", line="34 robots"), *lanes]
    chart.seen_from = 0
    chart.top = ui.window.height
    ui.advance(1.1)  # what has just come takes no tap until then
    for x in (20, 400):
        ui.tap_at(x, ui.window.height - 60)
    assert opened == [("hall",), ("hall",)]


def test_no_line_of_the_time_is_seen_in_a_lane_that_stands_for_several(ui):
    lanes = [Lane("Aino", key=1), Lane("Hall 1", key="hall", line="34 robots")]
    chart = ui.show(Lanes(lanes=lanes, hours=24), (800, 117))
    lane = chart._drawing.frame
    boxes = [
        (one.pos[1], one.pos[1] + one.size[1])
        for one in instructions(chart._drawing._names)
        if isinstance(one, Rectangle)
    ]
    assert any(bottom <= lane.bottom and top >= lane.bottom + lane.lane_height for bottom, top in boxes)
    assert any(
        (bottom, top) == pytest.approx((lane.bottom, lane.bottom + 1)) for bottom, top in boxes
    )  # its own edge is


@pytest.mark.parametrize(
    ("lines", "found"),
    [("", []), ("RR", [(0, 2)]), ("RRRRRRL", [(0, 4), (4, 2)]), ("LLRRRL", [(2, 3)]), ("RLLRR", [(0, 1), (3, 2)])],
)
def test_a_break_is_labelled_where_no_combined_lane_covers_it(lines, found):
    lanes = [Lane("", line="Hall 1") if kind == "L" else Lane("Aino") for kind in lines]
    assert list(lanes_frame.stretches(lanes)) == found


def test_names_of_bars_are_in_what_is_seen_of_them_also_after_a_drag(ui):
    bars = (Bar("a", 2, 12, "Kits"), Bar("b", 20, 20.2, "Empties"))
    chart = ui.show(Lanes(lanes=[Lane("Aino", bars=bars)], hours=24), (800, 100))
    y = chart.center_y
    unit, kits, empties = (800 - 88) / 24, glyphs("Kits", sp(16), "RobotoMedium"), glyphs("Empties", sp(16), "Roboto")
    assert words_of(chart) == [
        (pytest.approx(88 + 2 * unit + 8, abs=1), kits),
        (pytest.approx(88 + 20 * unit + 18, abs=1), empties),
    ]
    fingers(chart, [(500, y), (480, y), (500 - 4 * unit, y)])  # the long one begins out of sight
    ui.advance(0.2)
    assert words_of(chart) == [(pytest.approx(96, abs=1), kits), (pytest.approx(88 + 16 * unit + 18, abs=1), empties)]


def test_times_at_the_edges_of_the_axis_are_whole_or_not_there(ui):
    ticks = [(hour, f"{n:02d}:00", False) for n, hour in enumerate((-0.3, *range(2, 23, 2), 24.3))]
    chart = ui.show(Lanes(lanes=[Lane("Aino")], hours=24, ticks=ticks), (800, 100))
    seen = {glyphs(label, sp(16), "Roboto"): (hour, label) for hour, label, _strong in ticks}
    drawn = [one for one in instructions(chart._drawing._axis) if isinstance(one, Rectangle) and one.texture in seen]
    assert len(drawn) > 8
    assert not [
        seen[one.texture] for one in drawn if any(one.pos[0] < edge < one.pos[0] + one.size[0] for edge in (88, 800))
    ]


@pytest.mark.parametrize(("words", "is_named"), [("Held", True), ("Held until released · Maintenance", False)])
def test_a_new_day_is_named_at_its_line_or_not_at_all(ui, words, is_named):
    """A hold takes the room above it: named at two in the morning, the day seemed to begin there."""
    ticks = [(0, "Fri 27 Nov", True), *((hour, f"{hour:02d}:00", False) for hour in range(1, 10))]
    chart = ui.show(
        Lanes(lanes=[Lane("Aino")], hours=12, first=-3, ticks=ticks, bands=[Band(-1, 12, words, "held")]),
        (1200, 150),
    )
    day = glyphs("Fri 27 Nov", sp(16), "RobotoMedium")
    named = [
        one.pos[0] for one in instructions(chart._drawing._axis) if isinstance(one, Rectangle) and one.texture == day
    ]
    assert bool(named) == is_named
    assert all(abs(left - chart.left_of(0)) <= day.width for left in named)


def day_of(hour: float) -> str:
    return f"Day {int(hour // 24)}"


def test_the_day_at_the_left_edge_is_named_at_the_axis_also_while_dragging(ui):
    chart = ui.show(Lanes(lanes=LANES, hours=6, first=44, day_text=day_of), (800, 150))

    def named() -> list:
        return [n for n in range(5) if glyphs(f"Day {n}", sp(14), "RobotoMedium") in textures(chart.canvas)]

    assert named() == [1]
    day = glyphs("Day 1", sp(14), "RobotoMedium")
    where = next(one for one in instructions(chart.canvas) if isinstance(one, Rectangle) and one.texture == day)
    assert where.pos[0] + where.size[0] < chart.left_of(44)
    assert where.pos[1] > chart.top - 36
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
    ui.advance(0.1)
    assert named() == [0]


def test_the_day_after_a_break_at_the_left_edge_is_named(ui):
    chart = ui.show(
        Lanes(lanes=LANES, hours=6, first=20, bands=[(20, 50, "Closed", "folded")], day_text=day_of), (800, 150)
    )
    assert glyphs("Day 2", sp(14), "RobotoMedium") in textures(chart.canvas)
    assert glyphs("Day 0", sp(14), "RobotoMedium") not in textures(chart.canvas)


def test_a_long_name_of_a_day_moves_the_hours_rather_than_lie_on_them(ui):
    day = "Keskiviikko 25.11. ja vielä vähän"
    chart = ui.show(Lanes(lanes=LANES, hours=6, first=40, day_text=lambda _hour: day), (800, 150))
    assert chart.left_of(40) > glyphs(day, sp(14), "RobotoMedium").width


@pytest.mark.parametrize("now", [23.8, 24.0, 24.2])
def test_the_day_that_begins_near_now_is_named_next_to_the_time(ui, now):
    ticks = [*((n, f"{n % 24:02d}:00", False) for n in range(18, 36) if n != 24), (24, "Tue 24 Nov", True)]
    chart = ui.show(Lanes(lanes=LANES, hours=6, first=21, ticks=ticks, now=now, now_label="23:48"), (800, 150))
    drawn = {
        one.texture: one.pos[0]
        for one in instructions(chart._drawing._axis)
        if isinstance(one, Rectangle) and one.texture
    }
    day, time = (glyphs(words, sp(16), "RobotoMedium") for words in ("Tue 24 Nov", "23:48"))
    left, clock = drawn[day], drawn[time]
    assert left + day.width + 6 <= clock - 8 or clock + time.width + 8 + 6 <= left + 1
    assert abs(left - chart.left_of(24)) < 120


@pytest.mark.parametrize(
    ("until", "words"),
    [(12, "Kits · every 5 min · 57 runs"), (7, "every 5 min · 57 runs"), (4.8, "57 runs"), (3.4, "57")],
)
def test_a_block_says_as_much_as_it_has_room_for(ui, until, words):
    block = Bar("a", 2, until, "Kits · every 5 min · 57 runs", shorter=("every 5 min · 57 runs", "57 runs", "57"))
    bars = (block, Bar("b", until + 0.1, until + 1))
    chart = ui.show(Lanes(lanes=[Lane("Aino", bars=bars)], hours=24), (1000, 36 + 48))
    assert [texture for _x, texture in words_of(chart)] == [glyphs(words, sp(16), "RobotoMedium")]


def test_why_a_day_is_closed_is_written_where_no_bar_covers_it_or_not_at_all(ui, monkeypatch):
    written = []
    monkeypatch.setattr(lanes_frame, "text", lambda words, x, y, *_args, **_kw: written.append((words, y)))
    why, full = "Saturday: day off", [Bar(n, n, n + 0.5) for n in range(24)]

    def where(*lanes: list[Bar]) -> list[int]:
        written.clear()
        named = [Lane(f"R{n}", bars=bars) for n, bars in enumerate(lanes)]
        chart = ui.show(Lanes(lanes=named, hours=24, bands=[Band(8, 20, why, "closed")]), (1200, 200))
        return [chart._drawing.frame.lane_at(y) for words, y in written if words == why]

    assert where([], full) == [0]
    assert where(full, [Bar(1, 2, 7)], full) == [1]
    assert where(full, full) == []
