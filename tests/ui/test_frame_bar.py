"""The top bar and the banner as widgets: what must keep its place does, and what has been acknowledged looks so."""
from __future__ import annotations

import pytest
from kivy.uix.boxlayout import BoxLayout

from app.widgets import load_kv
from app.widgets.frame import TopBar
from app.widgets.text import Ico


@pytest.fixture
def bar(ui):
    load_kv("widgets/frame")
    bar = TopBar(title="Scheduler", date="Fri 20 Nov 2026", clock="14:38", robot="Aino", link="Connected · now", icon="wifi")
    ui.show(BoxLayout(), (1280, 600)).add_widget(bar)
    ui.advance()
    return bar


def places(bar, ui) -> list[tuple[float, float]]:
    bell = bar.ids.bell
    return [widget.to_window(*widget.pos) for widget in (bell, ui.find(Ico, bell))]


def test_the_bell_keeps_its_place_whatever_is_counted_and_said_beside_it(bar, ui):
    before, size = places(bar, ui), tuple(bar.ids.bell.size)
    for count in ("1", "12", "128"):
        bar.bell_count, bar.bell_icon = count, "bell-ring-outline"
        bar.link = f"No answer for {count} min"
        ui.advance()
        assert count in ui.texts(bar.ids.bell)
        assert (places(bar, ui), tuple(bar.ids.bell.size)) == (before, size)
