"""The frame around the screens: what it shows, where it leads, and what is left out without room."""

from __future__ import annotations

from dataclasses import replace

import pytest
from kivy.graphics import StencilUse
from kivy.metrics import Metrics

from app.domain.models import THEMES
from app.screens.common.alarms_view import Act
from app.screens.common.view_model import ScreenBase
from app.screens.frame.view import BannerView
from app.widgets.buttons import CommandButton
from app.widgets.frame import Banner, Frame, NavIndicator, NavItem, TopBar
from app.widgets.items import Tab
from app.widgets.tabs import TabButton
from app.widgets.text import Ico
from app.widgets.tokens import apply_theme, tk
from app.window.key_focus import ENTER, ESCAPE, TAB
from tests.ui import checks
from tests.ui.drawing import fired

ITEMS = [("home", "Home", "home-variant-outline", "home-variant"), ("logs", "Logs", "text-box-outline", "text-box")]


def frame(ui, **values) -> Frame:
    window = Frame(items=ITEMS, current="home", **values)
    window.ids.bar.title, window.ids.bar.clock = "Home", "14:38"
    return ui.show(window)


def test_the_frame_navigates(ui):
    window = frame(ui)
    calls = fired(window, "on_go")
    ui.tap(ui.find(NavItem, name="logs"))
    assert calls == [("logs",)]
    assert ui.find(NavItem, name="home").active  # until the navigator is there
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


def test_a_tap_on_the_bar_counts_although_its_text_changes(ui):
    window = frame(ui)
    calls = fired(window, "on_go")
    lift = ui.press(ui.find(NavItem, name="logs"))
    window.items = [
        ("home", "Koti", "home-variant-outline", "home-variant"),
        ("logs", "Loki", "text-box-outline", "text-box"),
    ]
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
    assert [list(icon.color) for icon in marks["logs"].children] == [list(tk.accent_on)]
    assert marks["home"].md_bg_color[3] == 0
    assert [list(icon.color) for icon in marks["home"].children] == [list(tk.ink2)]


def test_the_banner_comes_with_something_to_say_and_goes_with_it(ui):
    window = frame(ui)
    body = window.ids.body
    high = body.height
    window.banner = BannerView("Aino: emergency stop", action="Show")
    ui.advance()
    assert "Aino: emergency stop" in ui.texts()
    assert body.height == high - 64
    solve = fired(window, "on_solve")
    ui.tap_text("Show")
    assert solve == [()]
    window.banner = BannerView()
    ui.wait(lambda: body.height == high)
    assert ui.find_all(Banner) == []


def test_the_banner_follows_the_font_scale_while_it_is_there(ui):
    banner = ui.show(Banner(text="Aino: emergency stop", action="Show"))
    usual, before = Metrics.fontscale, banner.ids.banner_text.font_size
    try:
        Metrics.fontscale = usual * 1.3
        ui.advance()
        assert banner.ids.banner_text.font_size == pytest.approx(before * 1.3)
    finally:
        Metrics.fontscale = usual
    ui.advance()
    assert banner.ids.banner_text.font_size == pytest.approx(before)


def test_a_screen_that_is_added_to_the_frame_goes_beside_the_rail_and_below_the_bar(ui):
    window = frame(ui)
    screen = ScreenBase()
    window.add_widget(screen)
    ui.advance()
    assert screen in window.ids.body.children
    assert screen.top < ui.find(TopBar).y
    assert screen.x > window.ids.nav.right


def test_screens_are_not_cut_off_at_their_edge(ui):
    """kivy's manager clips them, which takes time in each frame."""
    assert StencilUse not in map(type, frame(ui).ids.body.canvas.before.children)


@pytest.mark.parametrize("width", [800, 1024, 1280])
def test_the_bar_has_room_for_long_names(ui, width):
    bar = TopBar(
        tabs=[
            Tab("1", "Kuljetusrobotti hallin 2 eteläpäässä, pakkaamon puolella", "wifi-off", "attention"),
            Tab("2", "Aino"),
        ],
        tab="1",
        clock="14:38",
    )
    ui.show(bar, (width, 64))
    ui.advance()
    assert checks.problems(bar) == []


def test_the_tabs_of_the_present_screen_are_in_the_bar(ui):
    window = frame(ui)
    screen = ScreenBase(tabs=[Tab("open", "Open", count=4), Tab("past", "Past")], tab="open", name="alarms")
    window.add_widget(screen)
    ui.advance()
    assert ui.find(TopBar).ids.bar_title.text == ""
    ui.tap_text("Past")
    assert screen.tab == "past"
    assert [button.tab.key for button in ui.find_all(TabButton) if button.active] == ["past"]


def test_a_screen_with_a_way_back_has_an_arrow_in_front_of_its_tabs_and_obeys_escape(ui):
    window = frame(ui)
    screen, back = ScreenBase(tabs=[Tab("open", "Open")], tab="open", name="alarms", can_go_back=True), []
    screen.go_back = lambda: back.append(1)
    window.add_widget(screen)
    ui.advance()
    ui.tap(ui.find(Ico, icon="arrow-left"))
    ui.key(ESCAPE)
    screen.can_go_back = False
    ui.key(ESCAPE)
    assert back == [1, 1]


@pytest.mark.parametrize(
    ("size", "upright"), [((1280, 800), True), ((1024, 600), True), ((819, 480), True), ((800, 1280), False)]
)
def test_the_screens_are_at_the_side_where_the_window_is_wide(ui, size, upright):
    window = ui.show(Frame(items=ITEMS, current="home"), size)
    ui.advance()
    nav, home = window.ids.nav, ui.find(NavItem, name="home")
    assert (nav.width, nav.height) == ((96, size[1]) if upright else (size[0], 72))
    assert home.width >= 96
    assert home.height >= 72
    assert window.ids.sheets.x == (96 if upright else 0)


@pytest.mark.parametrize("by_key", [False, True])
def test_a_touch_that_holds_one_start_does_not_hold_all(ui, keys, by_key):
    window, late, pressed = frame(ui), BannerView("Late", action="Hold", act=Act.HOLD), []
    window.bind(on_solve=pressed.append)
    window.banner = late
    ui.advance(2)
    if by_key:
        while getattr(keys.target, "text", "") != "Hold":
            ui.key(TAB)
    button = ui.find(CommandButton, text="Hold")

    def press() -> None:
        if by_key:
            ui.key(ENTER)
            ui.advance(0.2)
        else:
            ui.tap_at(*button.to_window(*button.center))

    window.banner = replace(late, action="Hold all")
    press()
    assert pressed == []
    ui.advance(1)
    press()
    assert pressed == [window]
