"""Displays: colours and their contrast, texts, cards; and that the test window leaves no trace."""

from __future__ import annotations

import os

import pytest
from kivy.metrics import Metrics
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.label import Label
from kivymd.icon_definitions import md_icons

from app.domain.models import THEMES
from app.screens.common.overlays import Dialogs
from app.widgets import shapes
from app.widgets.display import Disc, EmptyState
from app.widgets.fields import Field
from app.widgets.items import Option
from app.widgets.scrolling import ScrollPage
from app.widgets.shapes import texture_of
from app.widgets.surfaces import Tap
from app.widgets.text import Ico, Txt
from app.widgets.tokens import COLOURS, TONES, apply_theme, tk
from tests.ui import checks, looks
from tests.ui.drawing import fired, hex_of
from tests.ui.headless import COMMON, MOCK


# ---------------------------------------------------------------------- colours
def test_contrast_is_computed_as_wcag_does():
    assert checks.contrast_ratio("#000000", "#FFFFFF") == pytest.approx(21)
    assert checks.contrast_ratio("#767676", "#FFFFFF") == pytest.approx(4.54, abs=0.01)


@pytest.mark.parametrize("theme", THEMES)
def test_a_switch_recolours_what_is_on_screen(ui, stage, theme):
    badge = ui.show(Disc(tone="fault", text="4"))
    apply_theme(stage.theme_cls, theme)
    ui.advance()
    column = THEMES.index(theme)
    assert list(badge.tint) == pytest.approx(list(tk.fault_bg))
    assert list(ui.find(Txt, text="4").color) == list(tk.fault_on)
    assert stage.theme_cls.primaryColor == tk.accent
    assert COLOURS["accent"][column].lower() in str(hex_of(tk.accent))


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
        assert label.width == pytest.approx(before * 1.3, rel=0.06)
    finally:
        Metrics.fontscale = 1
        ui.advance()
    assert label.width == before


# ---------------------------------------------------------------------- cards
def test_nothing_sticks_out_of_the_round_corners_of_a_card_with_rows(monkeypatch):
    """The mask covers what lies outside of them, and shows the border and what is inside."""
    drawn: list[tuple[int, bytes]] = []

    def noted(width: int, height: int, data: bytes):
        drawn.append((width, data))
        return texture_of(width, height, data)

    monkeypatch.setattr(shapes, "texture_of", noted)
    upper, lower = shapes.corner_masks.__wrapped__(12, 1, (0.5, 0.5, 0.5, 1.0), (0.0, 0.0, 0.0, 1.0))
    [(side, data)] = drawn
    corner, edge, middle = (tuple(data[4 * n : 4 * n + 4]) for n in (0, side // 2, side * side // 2 + side // 2))
    assert (corner, edge, middle[3]) == ((128, 128, 128, 255), (0, 0, 0, 255), 0)
    assert upper.height == lower.height == 13


def test_lines_on_a_page_are_on_whole_pixels(ui):
    page = ScrollPage()
    page.add_widget(Field(label="Name"))
    page.add_widget(BoxLayout(size_hint_y=None, height=2000.5))
    ui.show(page, (400, 300))
    page.scroll_y = 0.37
    ui.advance()
    assert [place % 1 for place in page.g_translate.xy] == [0, 0]


def test_an_empty_state_leads_on(ui):
    state = ui.show(
        EmptyState(icon="robot", title="Add your first robot", text="Its address is enough.", action="Add robot")
    )
    calls = fired(state, "on_release")
    ui.tap_text("Add robot")
    assert calls == [()]


def test_the_way_out_of_an_empty_state_is_not_filled_beside_a_sheet(ui):
    state, dialogs = ui.show(EmptyState(title="No missions yet", action="Fetch from robot")), Dialogs()
    assert looks.filled(state) == ["Fetch from robot"]
    dialogs.choose_many("Missions of Aino", [Option(1, "Dock")], "Add chosen", print, can_all=True)
    ui.advance(0.1)
    assert looks.filled(state) + looks.filled(dialogs.top) == ["Add chosen"]
    dialogs.close_all()
    assert looks.filled(state) == ["Fetch from robot"]


def test_an_empty_state_without_a_way_has_no_button(ui):
    state = ui.show(EmptyState(icon="robot", title="Nothing yet"))
    calls = fired(state, "on_release")
    ui.tap(state)
    assert calls == []


def test_an_empty_state_shows_its_icon_where_there_is_room_for_more_than_words(ui):
    words = {
        "title": "No missions yet",
        "text": "Fetch the list of missions from a robot.",
        "action": "Fetch from robot",
    }
    seen = [
        [
            type(widget)
            for widget in ui.show(EmptyState(icon="flag-outline", **words), (700, height)).walk()
            if isinstance(widget, Ico) and widget.height and widget.icon == "flag-outline"
        ]
        for height in (210, 400)
    ]
    assert seen == [[], [Ico]]
    assert checks.problems(ui.show(EmptyState(icon="flag-outline", **words), (700, 210))) == []


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
