"""What a lane shows of its bars' names: in them or beside them, never over each other, in one line or two."""

from __future__ import annotations

import pytest
from kivy.graphics import Color, Rectangle
from kivy.metrics import sp

from app.screens.scheduler.timeline import Bar, Lane
from app.widgets import lanes_words
from app.widgets.chart import glyphs
from app.widgets.lanes import Lanes
from app.widgets.lanes_frame import AXIS, cut
from app.widgets.lanes_words import LETTERS, wrapped
from app.widgets.tokens import tk
from tests.ui.drawing import instructions

KITS = "Deliver kits to line 2"


def shown(ui, *bars: Bar, height: float = 100, hours: float = 8, **values) -> Lanes:
    return ui.show(Lanes(lanes=[Lane("Aino", bars=bars)], hours=hours, **values), (1112, AXIS + height))


def named(chart) -> list[tuple[float, float]]:
    """Left and right end of each line of words."""
    return [
        (one.pos[0], one.pos[0] + one.size[0])
        for one in instructions(chart._drawing._words)
        if isinstance(one, Rectangle) and one.texture
    ]


def test_a_name_is_in_its_bar_where_it_fits_and_else_beside_it(ui):
    chart = shown(ui, Bar("long", 1, 3, KITS), Bar("short", 5, 5.1, KITS))
    (inside, _right), (beside, _end) = named(chart)
    assert inside == pytest.approx(chart.left_of(1) + 8, abs=1)
    assert beside >= chart.left_of(5.1)


@pytest.mark.parametrize("gap", [0.3, 0.6, 1.0, 1.5])
def test_no_name_lies_on_another_bar(ui, gap):
    bars = [Bar(n, 1 + gap * n, 1 + gap * n + 0.1, KITS) for n in range(5)]
    chart = shown(ui, *bars)
    boxes = [(left, right) for left, _bottom, right, _top, _key in chart.boxes()]
    assert not [(name, box) for name in named(chart) for box in boxes if name[0] < box[1] - 1 and name[1] > box[0] + 1]


def test_two_lines_are_used_only_in_lanes_with_room_for_them(ui):
    bars = Bar("a", 1, 1.1, KITS), Bar("b", 2.1, 3, "Waste")
    high, low = (len(named(shown(ui, *bars, height=height))) for height in (100, 48))
    assert (high, low) == (3, 2)


def test_a_name_of_the_past_ends_at_the_line_of_the_present(ui):
    chart = shown(ui, Bar("a", 1, 1.1, KITS, "running"), now=2.2, now_label="14:38")
    assert all(right <= chart.left_of(2.2) for _left, right in named(chart))


def test_a_state_with_an_icon_says_it_in_its_bar_or_beside_it(ui):
    for width in (1.0, 0.1):
        chart = shown(ui, Bar("a", 1, 1 + width, "", "failed"))
        colours = [
            tuple(one.rgba) for part in chart._drawing._made[0] for one in instructions(part) if isinstance(one, Color)
        ]
        assert tuple(tk.fault) in colours


@pytest.mark.parametrize(
    ("words", "most", "lines"),
    [(KITS, 1, 1), (KITS, 2, 2), ("Kits", 2, 1), ("Unbreakablenameofamission", 2, 1)],
)
def test_words_are_wrapped_and_the_last_line_cut(ui, words, most, lines):
    found = wrapped(words, 100, most, "Roboto")
    assert len(found) == lines
    assert all(glyphs(line, sp(16), "Roboto").width <= 100 for line in found)


def test_what_has_no_room_at_all_is_left_out(ui):
    assert (cut("Waste", 4), wrapped("Waste", 4, 2, "Roboto")) == ("", [])


@pytest.mark.parametrize("name", [KITS, f"≈\N{NO-BREAK SPACE}{KITS}"])
@pytest.mark.parametrize("gap", [0.2, 0.3, 0.4, 0.5, 0.7])
def test_a_name_without_room_is_left_out_rather_than_shown_in_scraps(ui, monkeypatch, name, gap):
    drawn: list[str] = []
    monkeypatch.setattr(lanes_words, "text", lambda words, *_args, **_named: drawn.append(words))
    bars = [Bar(n, 1 + gap * n, 1 + gap * n + 0.1, name) for n in range(4)]
    shown(ui, *bars, Bar("last", 1 + gap * 4, 8, "Waste"), height=48)
    assert "Waste" in drawn
    assert [words for words in drawn if words != "Waste" and len(words) <= LETTERS] == []
