"""Tabs: what a tap on them does, and where long words stay."""

from __future__ import annotations

import pytest

from app.widgets.items import Tab
from app.widgets.tabs import TabButton, Tabs
from tests.ui import checks
from tests.ui.drawing import fired

ROBOTS = [Tab(1, "Aino", "play-circle-outline"), Tab(2, "Veikko", "alert-octagon", "fault"), Tab(3, "Sisu", "flash")]


def show(ui, tabs, width=1000, **values) -> Tabs:
    return ui.show(Tabs(tabs=tabs, selected=tabs[0].key, **values), (width, 64))


def test_a_tap_on_another_tab_asks_for_it(ui):
    tabs = show(ui, ROBOTS)
    calls = fired(tabs, "on_choose")
    ui.tap_text("Veikko")
    ui.tap_text("Aino")
    assert calls == [(2,)]
    assert [button.active for button in reversed(tabs.children)] == [True, False, False]  # its owner decides


def test_a_tap_counts_although_the_words_change_under_the_finger(ui):
    tabs = show(ui, ROBOTS)
    calls = fired(tabs, "on_choose")
    lift = ui.press(next(button for button in ui.find_all(TabButton) if button.tab.key == 2))
    tabs.tabs = [Tab(tab.key, tab.text, "help", count=2) for tab in ROBOTS]
    lift()
    assert calls == [(2,)]


def test_a_count_is_shown_and_none_without(ui):
    tabs = show(ui, [Tab("open", "Open", count=4), Tab("past", "Past")])
    assert [text.strip() for text in ui.texts(tabs)] == ["Open", "4", "Past"]


@pytest.mark.parametrize("width", [300, 420, 700])
def test_long_words_wrap_and_the_short_ones_stay_on_one_line(ui, width):
    tabs = show(ui, [Tab(1, "Aino"), Tab(2, "Kuljetusrobotti hallin päässä"), Tab(3, "Sisu")], width)
    assert checks.problems(tabs) == []
    assert tabs.used <= width
    assert [button.ids.tab_text.lines for button in reversed(tabs.children)][::2] == [1, 1]


def test_those_of_a_card_share_its_width(ui):
    tabs = show(ui, [Tab("today", "Today"), Tab("send", "Send")], 600, fill=True)
    assert [button.width for button in tabs.children] == [296, 296]
