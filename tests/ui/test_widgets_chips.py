"""Chips, switch, progress and messages: what they do otherwise than KivyMD's own."""

from __future__ import annotations

import gc
import weakref

import pytest
from kivy.factory import Factory
from kivy.graphics import BorderImage, SmoothLine
from kivy.uix.widget import Widget
from kivymd.uix.snackbar import MDSnackbar

from app.domain.models import THEMES
from app.widgets.buttons import (
    ChoiceChip,
    CommandButton,
    IconButton,
    MenuChip,
    Segment,
    Segments,
    SwitchFace,
    Toggle,
    ToolRow,
)
from app.widgets.chart import Meter, WorkingRing
from app.widgets.flow import ChipFlow
from app.widgets.items import Option
from app.widgets.snackbar import Snackbar, Snackbars
from app.widgets.text import Ico, Txt
from app.widgets.tokens import apply_theme, tk


def presses(widget) -> list[object]:
    calls: list[object] = []
    widget.bind(on_release=calls.append)
    return calls


# ------------------------------------------------------------------ chips
@pytest.mark.parametrize(
    ("width", "cut"), [(600, []), (426, ["Kaikki robotit"]), (390, ["Kaikki robotit", "Jokin: Hall 1"])]
)
def test_chips_without_room_get_shorter_the_longest_first(ui, width, cut):
    chips = [Factory.ToolChip(text=text) for text in ("8 h", "Kaikki robotit", "Jokin: Hall 1")]
    row = ToolRow(size_hint_x=None, width=width, height=64)
    for tool in (*chips, Widget(), IconButton(icon="plus")):
        row.add_widget(tool)
    ui.show(row, (width, 64))
    ui.advance()
    assert row.children[0].right <= row.right + 1
    assert [chip.text for chip in chips if chip.ids.chip_text._label.text.endswith("…")] == cut
    chips[1].text = "Aino"
    ui.advance()
    assert not chips[1].ids.chip_text._label.text.endswith("…")


def test_a_tap_on_the_icon_of_a_chip_is_one_on_the_chip(ui):
    chip = ui.show(ChoiceChip(text="Collect empties", icon="star"))
    calls = presses(chip)
    ui.tap(ui.find(Ico, chip))
    assert calls == [chip]


def test_the_chip_of_a_short_word_is_as_wide_as_a_fingertip_and_centres_it(ui, stage):
    for gloves in (False, True):
        apply_theme(stage.theme_cls, "light", gloves)
        chip = ui.show(ChoiceChip(text="1"))
        word = ui.find(Txt, chip)
        assert chip.width == tk.h_touch
        assert (word.center_x, word.halign) == (chip.center_x, "center")


def test_whether_a_chip_is_chosen_says_only_who_uses_it(ui):
    chip = ui.show(ChoiceChip(text="Aino", active=True))
    ui.tap(chip)
    assert chip.active


def test_a_double_tap_on_a_chip_that_goes_presses_not_the_one_that_comes_in_its_place(ui):
    flow = ui.show(ChipFlow(data=[Option(key, key) for key in ("Failed", "Sisu", "Aino")]), (400, 100))
    chosen: list[object] = []

    def leave_out(_flow: ChipFlow, key: object) -> None:
        chosen.append(key)
        flow.data = [chip for chip in flow.data if chip.key != key]

    flow.bind(on_choose=leave_out)
    chip = ui.find(ChoiceChip, text="Failed")
    ui.tap_twice(chip.to_window(*chip.center), 0.2)
    assert chosen == ["Failed"]
    ui.advance(1)
    ui.tap(ui.find(ChoiceChip, text="Aino"))
    assert chosen == ["Failed", "Aino"]


def test_a_chip_that_is_chosen_looks_so_at_once_and_stays_so(ui):
    chip = ui.show(ChoiceChip(text="Aino"))
    for chosen, colour in ((True, tk.accent_bg), (False, tk.surface)):
        chip.active = chosen
        for seconds in (0, 1):
            ui.advance(seconds)
            assert list(chip.md_bg_color) == list(colour)


def test_a_chip_holds_icon_text_and_trailing_icon(ui):
    widths = [
        ui.show(chip).width
        for chip in (ChoiceChip(text="Aino"), ChoiceChip(text="Aino", icon="star"), MenuChip(text="Aino"))
    ]
    assert widths == [widths[0], widths[0] + 22, widths[0] + 24]


def test_a_chip_wraps_within_its_limit(ui):
    chip = ui.show(ChoiceChip(text="Deliver full pallets to dispatch and return to the charger", limit=200))
    assert chip.width <= 200
    assert chip.height > tk.h_touch


def test_the_text_of_a_chip_of_one_line_ends_where_there_is_no_room_for_more(ui):
    chip = ui.show(
        MenuChip(
            text="Deliver full pallets to dispatch and return to the charger", icon="star", limit=200, most_lines=1
        )
    )
    assert (ui.find(Txt, chip).lines, chip.height) == (1, tk.h_touch)
    assert 170 < chip.width <= 200


# ------------------------------------------------------------------ switch
def test_the_switch_of_a_toggle_is_there_in_the_frame_of_the_tap(ui):
    toggle = ui.show(Toggle(), (56, 48))
    face = ui.find(SwitchFace)
    assert ui.find(Ico, toggle).icon == "minus"
    toggle.active = True
    ui.advance()
    assert ui.find(Ico, toggle).icon == "check"
    assert face.ids.thumb.right == face.right - 4


def test_a_disabled_toggle_is_faint_and_deaf(ui):
    toggle = ui.show(Toggle(disabled=True), (56, 48))
    ui.tap(toggle)
    assert not toggle.active
    assert toggle.opacity < 1
    assert ui.find(SwitchFace).state_layer_color[3] == 0


def test_disabled_segments_are_faint(ui):
    segments = ui.show(Segments(options=[(1, "One"), (2, "Two")], selected=1), (200, 48))
    assert {segment.opacity for segment in ui.find_all(Segment)} == {1}
    segments.disabled = True
    assert all(segment.opacity < 1 for segment in ui.find_all(Segment))


@pytest.mark.parametrize("width", [200, 600])
@pytest.mark.parametrize(("several", "selected"), [(False, 2), (True, [1, 2]), (True, [1, 2, 3]), (True, [])])
def test_what_is_selected_has_a_shape_of_its_own_at_any_width(ui, width, several, selected):
    ui.show(Segments(options=[(1, "Ma"), (2, "Ti"), (3, "Ke")], several=several, selected=selected), (width, 48))
    for segment in ui.find_all(Segment):
        assert (set(segment.radius) == {24}) == segment.selected


# ------------------------------------------------------------------ progress
def bars_of(meter: Meter) -> list[float]:
    return [part.size[0] for part in meter.canvas.children if isinstance(part, BorderImage)]


def test_a_meter_is_as_long_as_its_value_and_none_has_no_dot(ui):
    meter = ui.show(Meter(value=0.5), (200, 8))
    assert bars_of(meter) == [200, 100]
    meter.value = 0
    ui.advance()
    assert bars_of(meter) == [200]


def arc(ring) -> tuple:
    [line] = [part for part in ring.canvas.children if isinstance(part, SmoothLine)]
    return tuple(line.circle)


def test_a_ring_turns_in_the_window_and_is_freed_after_it(ui):
    ring = weakref.ref(ui.show(WorkingRing(), (20, 20)))
    before = arc(ring())
    ui.advance(0.2)
    assert arc(ring()) != before
    ui.show(Widget())
    ui.advance(2)
    gc.collect()
    assert ring() is None


def test_a_ring_has_the_colour_of_its_button_in_every_theme(ui):
    button = ui.show(CommandButton(text="Save", icon="check", style="filled", busy=True), (200, 64))
    ui.advance(0.5)
    for theme in THEMES:
        tk.use(theme)
        assert list(ui.find(WorkingRing).color) == list(button.front) == list(tk.solid_ink)


# ------------------------------------------------------------------ messages
def test_a_long_message_wraps_next_to_its_button(ui):
    bars = Snackbars()
    bars.undo(
        "Schedule deleted: deliver full pallets to dispatch and return to the charger, on all robots, every Monday",
        "Undo",
        list,
    )
    ui.advance(0.3)
    bar = ui.find(Snackbar)
    text, action = ui.find(Txt, text=bar.text), ui.find(Txt, text="Undo")
    assert text.right <= action.to_window(*action.pos)[0]
    assert text.height <= bar.height
    assert isinstance(bar, MDSnackbar)
    bars.clear()
