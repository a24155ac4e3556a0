"""The top bar and the banner as widgets: fixed parts keep their places, and acknowledged alarms look so."""

from __future__ import annotations

import pytest
from kivy.uix.boxlayout import BoxLayout

from app.widgets import load_kv
from app.widgets.buttons import CommandButton
from app.widgets.frame import Banner, TopBar
from app.widgets.text import Ico
from app.widgets.tokens import tk


@pytest.fixture
def bar(ui):
    load_kv("widgets/frame")
    bar = TopBar(title="Scheduler", clock="14:38")
    ui.show(BoxLayout(), (1280, 600)).add_widget(bar)
    ui.advance()
    return bar


def places(bar, ui) -> list[tuple[float, float]]:
    bell = bar.ids.bell
    return [widget.to_window(*widget.pos) for widget in (bell, ui.find(Ico, bell))]


def test_the_bell_keeps_its_position_whatever_is_next_to_it(bar, ui):
    before, size = places(bar, ui), tuple(bar.ids.bell.size)
    for count in ("1", "12", "128"):
        bar.bell_count, bar.bell_icon = count, "bell-ring-outline"
        bar.clock = f"{count}:38"
        ui.advance()
        assert count in ui.texts(bar.ids.bell)
        assert (places(bar, ui), tuple(bar.ids.bell.size)) == (before, size)


@pytest.mark.parametrize("theme", ["dark", "contrast", "light"])
def test_the_number_can_be_read_in_every_theme(bar, ui, theme):
    bar.bell_count = "7"
    tk.theme = theme
    ui.advance()
    number = ui.find(bar.ids.bell_count.__class__, bar.ids.bell, text="7")
    assert tuple(number.color) == tuple(tk.snack_ink) != tuple(number.parent.md_bg_color) == tuple(tk.snack)


@pytest.mark.parametrize("tone", ["fault", "attention", "neutral"])
def test_only_a_fault_is_a_red_block(ui, tone):
    load_kv("widgets/frame")
    banner = ui.show(Banner(tone=tone, icon="alert-octagon", text="Aino: emergency stop", action="Show"), (1280, 64))
    ui.advance()
    fill = tk.fault_solid if tone == "fault" else getattr(tk, f"{tone}_bg")
    assert tuple(banner.md_bg_color) == tuple(fill)
    assert ui.find(CommandButton, banner).over_solid == (tone == "fault")
