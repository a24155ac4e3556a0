"""Buttons: a tap becomes an event, once, and shows at once."""

from __future__ import annotations

import gc
import weakref

import pytest
from kivy.graphics import SmoothLine
from kivy.metrics import Metrics
from kivy.uix.widget import Widget
from kivy.utils import get_hex_from_color

from app.domain.models import THEMES
from app.widgets.buttons import ButtonIcon, ChoiceChip, CommandButton, IconButton, Segments, Toggle
from app.widgets.chart import WorkingRing
from app.widgets.text import Txt
from app.widgets.tokens import tk
from tests.ui import checks
from tests.ui.drawing import fired


def test_a_tap_on_a_button_is_one_release(ui):
    button = ui.show(CommandButton(text="Pause", icon="pause"), (200, 64))
    calls = fired(button, "on_release")
    ui.tap(button)
    assert calls == [()]


def test_a_press_is_visible_in_the_same_frame_and_stays_long_enough_to_be_seen(ui):
    button = ui.show(CommandButton(text="Pause"), (200, 64))
    assert button.state_layer_color[3] == 0
    lift = ui.press(button)
    assert button.state_layer_color[3] > 0
    lift(0)
    assert button.state_layer_color[3] == 0


@pytest.mark.parametrize("theme", THEMES)
def test_a_filled_button_is_no_lamp(ui, theme):
    """Light on a dark screen it would be the brightest area of it."""
    button = ui.show(CommandButton(text="Run on Aino", style="filled"), (200, 64))
    tk.use(theme)
    fill, words = get_hex_from_color(button.back[:3]), get_hex_from_color(button.front[:3])
    assert checks.luminance(fill) < 0.2
    assert checks.contrast_ratio(fill, words) >= 4.5
    assert checks.contrast_ratio(fill, get_hex_from_color(tk.surface[:3])) >= 3


def test_a_disabled_button_says_nothing(ui):
    button = ui.show(CommandButton(text="Reset", disabled=True), (200, 64))
    calls = fired(button, "on_release")
    ui.tap(button)
    assert calls == []
    assert list(button.front) == list(tk.disabled)


def test_a_busy_button_swallows_taps_and_shows_its_work_after_300_ms(ui):
    button = ui.show(CommandButton(text="Test connection", icon="connection"), (240, 64))
    calls = fired(button, "on_release")
    button.busy = True
    ui.tap(button)
    assert calls == []
    ui.advance(0.3)
    [arc] = [part for part in ui.find(WorkingRing).canvas.children if isinstance(part, SmoothLine)]
    before = arc.circle
    ui.advance(0.1)
    assert arc.circle != before
    button.busy = False
    ui.tap(button)
    assert calls == [()]
    assert not ui.find_all(WorkingRing)


def test_a_button_that_is_still_busy_goes_with_its_screen(ui):
    button = weakref.ref(ui.show(CommandButton(text="Test connection", icon="connection", busy=True), (240, 64)))
    ui.advance(0.5)
    assert ui.find_all(WorkingRing)
    ui.show(Widget())
    ui.advance(2)
    gc.collect()
    assert button() is None


def test_an_icon_that_comes_while_a_button_is_busy_is_seen_afterwards(ui):
    button = ui.show(CommandButton(text="Pause", busy=True), (200, 64))
    ui.advance(0.4)
    button.icon = "pause"
    ui.advance()
    assert (button._button_icon.opacity, button._button_text.opacity, len(ui.find_all(WorkingRing))) == (0, 1, 1)
    button.busy = False
    ui.advance()
    assert (ui.find(ButtonIcon).opacity, ui.find_all(WorkingRing)) == (1, [])


def test_quick_work_shows_no_ring(ui):
    button = ui.show(CommandButton(text="Save"), (240, 64))
    button.busy = True
    ui.advance(0.2)
    button.busy = False
    ui.advance(0.5)
    assert ui.find_all(WorkingRing) == []


def test_a_long_word_wraps_inside_its_button(ui):
    button = ui.show(CommandButton(text="Kuittaa kaikki virheilmoitukset", icon="restore-alert"), (180, 96))
    ui.advance()
    label = ui.find(Txt, text="Kuittaa kaikki virheilmoitukset")
    assert label.width <= 180
    assert label.height > 30
    button.width = 400
    ui.advance()
    assert label.height < 30


def test_a_button_that_fits_its_text_never_wraps_it(ui):
    button = ui.show(CommandButton(text="Hold", icon="hand-back-right-outline", fit=True), (0, 48))
    button.text = "Held · Release everything"
    ui.advance()
    assert ui.find(Txt, text=button.text).lines == 1
    assert checks.problems(button) == []


def test_a_button_without_an_icon_has_no_label_for_one_and_gets_it_with_the_icon(ui):
    button = ui.show(CommandButton(text="Pause", disabled=True), (200, 64))
    assert ui.find_all(ButtonIcon) == []
    button.icon = "pause"
    ui.advance()
    mark = ui.find(ButtonIcon)
    assert (mark.icon, list(mark.color)) == ("pause", list(tk.disabled))
    assert button.x < mark.x < mark.right < button._button_text.x < button.right
    button.icon, button.disabled = "play", False
    ui.advance()
    assert (ui.find(ButtonIcon), mark.icon, list(mark.color)) == (mark, "play", list(button.front))
    button.icon = ""
    ui.advance()
    assert mark.text == ""
    assert button._button_text.center_x == pytest.approx(button.center_x, abs=1)


def test_segments_choose_one(ui):
    segments = ui.show(Segments(options=[("once", "Once"), ("daily", "Daily")], selected="once"), (300, 48))
    calls = fired(segments, "on_choose")
    ui.tap_text("Daily")
    assert calls == [("daily",)]
    assert segments.selected == "daily"
    assert [s.text for s in segments.children if s.selected] == ["Daily"]


def test_segments_follow_the_view_model(ui):
    segments = ui.show(Segments(options=[("a", "A"), ("b", "B")], selected="a"), (300, 48))
    segments.selected = "b"
    assert [s.text for s in segments.children if s.selected] == ["B"]
    segments.options = [("b", "Bee"), ("c", "Cee")]
    assert [s.text for s in segments.children if s.selected] == ["Bee"]


@pytest.mark.parametrize("scale", [1, 1.3])
def test_words_of_segments_keep_off_their_borders_however_little_room_there_is(ui, scale):
    Metrics.fontscale = scale
    try:
        segments = ui.show(Segments(options=[("7", "7 päivää"), ("30", "30 päivää"), ("all", "Kaikki")]), (10, 48))
        for segment in segments.children:
            word = ui.find(Txt, root=segment)
            assert word.x - segment.x >= 5
            assert segment.right - word.right >= 5
    finally:
        Metrics.fontscale = 1


def test_a_toggle_says_what_is_wanted_and_waits_until_it_is_so(ui):
    toggle = ui.show(Toggle(), (56, 48))
    calls = fired(toggle, "on_switch")
    ui.tap(toggle)
    assert (calls, toggle.active) == ([(True,)], False)
    toggle.active = True
    ui.tap(toggle)
    assert (calls, toggle.active) == ([(True,), (False,)], True)


def test_targets_grow_with_gloves(ui):
    icon, chip, button = IconButton(icon="close"), ChoiceChip(text="All robots"), CommandButton(text="Pause")
    for widget in (icon, chip, button):
        ui.show(widget)
    assert (icon.height, chip.height, button.height) == (48, 48, 56)
    tk.use("light", gloves=True)
    ui.advance()
    assert (icon.height, icon.width, chip.height, button.height) == (70, 70, 70, 70)


def test_the_ring_of_a_busy_button_without_an_icon_covers_no_text(ui):
    button = ui.show(CommandButton(text="Restore", busy=True), (200, 64))
    ui.advance(0.5)
    ring, word = ui.find(WorkingRing), button._button_text
    assert word.opacity == 0
    assert ring.center == word.center
    button.busy = False
    ui.advance()
    assert ui.texts() == ["Restore"]
