"""What a lane of the timeline shows of its bars: names where there is room, what lies on what, and that other lanes don't matter."""

from __future__ import annotations

from collections.abc import Iterator
from types import UnionType

import pytest
from kivy.graphics import BorderImage, Color, Mesh, Rectangle
from kivy.metrics import sp

from app.screens.scheduler.timeline import Bar, Lane
from app.widgets.chart import glyphs
from app.widgets.timeline import Timeline
from app.widgets.tokens import tk

MIDNIGHT = (10, "Sat 21 Nov", True)


def drawn(group, kind: type | UnionType = Rectangle | BorderImage) -> Iterator[tuple[object, object]]:
    """What of that kind is drawn, and in which colour."""
    colour = None
    for one in group.children:
        if isinstance(one, Color):
            colour = tuple(one.rgba)
        elif isinstance(one, kind):
            yield one, colour
        elif hasattr(one, "children"):
            yield from drawn(one, kind)


def names(chart, *words: str) -> dict[str, Rectangle]:
    """Which of these are drawn, and where."""
    textures = {glyphs(one, sp(14), "Roboto"): one for one in words}
    return {textures[one.texture]: one for one, _colour in drawn(chart._drawing._words) if one.texture in textures}


def shown(ui, *lanes: Lane, hours: float = 6, **values) -> Timeline:
    return ui.show(Timeline(lanes=list(lanes), hours=hours, **values), (888, 28 + 44 * len(lanes)))


def test_a_lane_full_of_short_runs_takes_nothing_from_the_others(ui):
    crowd = Lane("Aino", bars=tuple(Bar(n, n / 20, n / 20 + 0.1, "Kits", "running") for n in range(180)))
    calm = Lane("Veikko", bars=tuple(Bar(f"v{n}", n / 2, n / 2 + 0.2, "Go") for n in range(10)))
    chart = shown(ui, crowd, calm, hours=6)
    middle = chart._drawing.frame.middle(1)
    assert [one for one in names(chart, "Go").values() if abs(one.pos[1] - middle) < 20]
    framed = [
        one
        for one, _colour in drawn(chart._drawing._bars)
        if isinstance(one, BorderImage) and abs(one.pos[1] - middle) < 22
    ]
    assert len(framed) >= 2 * len(calm.bars)  # fill and border of each


def test_a_crowded_lane_still_names_what_has_room(ui):
    crowd = tuple(Bar(n, n / 60, n / 60 + 0.01, "Kits") for n in range(240))
    chart = shown(
        ui, Lane("Aino", bars=(*crowd, Bar("long", 4.2, 5.4, "Night count"), Bar("short", 5.5, 5.55, "Waste"))), hours=8
    )
    assert set(names(chart, "Kits", "Night count", "Waste")) == {"Night count", "Waste"}


@pytest.mark.parametrize(("first", "second"), [(0.1, 0.1), (0.2, 0.1), (0.1, 0.2)])
def test_starts_at_one_time_are_both_named_where_there_is_room(ui, first, second):
    bars = Bar("a", 1, 1 + first, "Kits"), Bar("b", 1, 1 + second, "Empties")
    chart = shown(ui, Lane("Aino", bars=bars))
    assert set(names(chart, "Kits · Empties")) == {"Kits · Empties"}
    too_soon = (
        1 + max(first, second) + (glyphs("Kits · Empties", sp(14), "Roboto").width + 10) / chart._drawing.frame.unit
    )
    chart.lanes = [Lane("Aino", bars=(*bars, Bar("c", too_soon, too_soon + 2, "Waste")))]
    ui.advance(0.1)
    assert set(names(chart, "Kits · Empties", "Empties +1", "Waste")) == {"Empties +1", "Waste"}


def test_no_name_stands_next_to_a_bar_it_does_not_belong_to(ui):
    chart = shown(ui, Lane("Aino", bars=(Bar("a", 1, 3, "Deliver kits to line 2"), Bar("b", 1.5, 3.5, "Empties"))))
    assert set(names(chart, "Deliver kits to line 2", "Empties")) == {"Empties"}


@pytest.mark.parametrize("hours", [6, 48])
@pytest.mark.parametrize("length", [0.5, 1.0])
def test_a_skipped_start_is_seen_around_what_is_planned_at_its_time(ui, hours, length):
    skipped, planned = Bar("left out", 2, 2.5, "Not run: Waste", "skipped"), Bar("planned", 2, 2 + length, "Kits")
    chart = shown(ui, Lane("Aino", bars=(skipped, planned)), hours=hours)
    boxes = {key: (left, right) for left, _bottom, right, _top, key in chart.boxes()}
    assert list(boxes) == ["planned", "left out"]  # what a person skipped is drawn last
    calls = []
    chart.bind(on_bar=lambda _chart, *keys: calls.append(keys))
    ui.tap_at(sum(boxes["left out"]) / 2, chart._drawing.frame.middle(0))
    assert calls == [("left out", "planned")]
    if hours == 6:
        frame = next(
            one
            for one, colour in drawn(chart._drawing._bars)
            if colour == tuple(tk.attention) and isinstance(one, BorderImage)
        )
        assert frame.size[1] > chart._drawing.frame.bar_height  # all around it
        fills = [colour for one, colour in drawn(chart._drawing._bars) if one.size[0] > 20]
        assert tuple(tk.surface) not in fills  # which stays in sight
        assert set(names(chart, "Kits", "Not run: Waste")) == {"Kits", "Not run: Waste"}


def test_a_skipped_start_alone_is_an_empty_bar_with_its_name(ui):
    chart = shown(
        ui, Lane("Aino", bars=(Bar("left out", 1, 3, "Not run: Waste", "skipped"), Bar("planned", 4, 5, "Kits")))
    )
    assert set(names(chart, "Not run: Waste", "Kits")) == {"Not run: Waste", "Kits"}
    assert tuple(tk.surface) in [colour for one, colour in drawn(chart._drawing._bars) if one.size[0] > 20]


def test_midnight_does_not_run_through_a_name(ui):
    chart = shown(ui, Lane("Aino", bars=(Bar("a", 9.4, 9.6, "Deliver kits to line 2"),)), first=7, ticks=[MIDNIGHT])
    line = chart._drawing.frame.at(10)
    name = names(chart, "Deliver kits to line 2")["Deliver kits to line 2"]
    assert name.pos[0] < line < name.pos[0] + name.size[0]
    behind = next(one for one, colour in drawn(chart._drawing._words) if colour == tuple(tk.surface))
    assert behind.pos[0] <= name.pos[0]
    assert behind.pos[0] + behind.size[0] >= name.pos[0] + name.size[0]
    assert behind.size[1] >= sp(16)


def test_a_name_that_crosses_nothing_needs_nothing_behind_it(ui):
    chart = shown(ui, Lane("Aino", bars=(Bar("a", 7.4, 7.6, "Kits"),)), first=7, ticks=[MIDNIGHT])
    assert [colour for _one, colour in drawn(chart._drawing._words)] == [tuple(tk.ink2)]


def test_overlaps_of_a_crowd_are_few_drawings(ui):
    bars = tuple(Bar(n, n / 20, n / 20 + 0.1, "Kits", "running") for n in range(180))
    chart = shown(ui, Lane("Aino", bars=bars, overlaps=tuple((n / 5, n / 5 + 0.12) for n in range(45))))
    assert len([*drawn(chart._drawing._bars)]) <= 4
    [(mark, _colour)] = [
        (one, colour) for one, colour in drawn(chart._drawing._bars, Mesh) if colour == tuple(tk.overlap)
    ]
    assert len(mark.indices) == 45 * 6  # each of them is marked
