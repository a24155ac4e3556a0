"""What is looked at: colours and their contrast, states, the frame, charts; and that the test window leaves no trace."""
from __future__ import annotations

import os

import pytest
from kivy.metrics import Metrics
from kivy.uix.label import Label
from kivymd.icon_definitions import md_icons

from app.widgets.chart import Meter, Sparkline, nice_step
from app.widgets.charts import StackedBars, UtilisationBars
from app.widgets.display import EmptyState, KpiCard, StatusBadge, ValueTile, with_unit
from app.widgets.frame import AlarmBanner, Frame, NavItem, TopBar
from app.widgets.robot_map import RobotMap
from app.widgets.surfaces import Tap
from app.widgets.text import Ico, Txt
from app.widgets.timeline import Timeline
from app.widgets.tokens import COLOURS, THEMES, TONES, apply_theme, tk
from tests.ui import checks
from tests.ui.headless import COMMON, MOCK


def fired(widget, event: str) -> list[tuple]:
    calls: list[tuple] = []
    widget.bind(**{event: lambda _widget, *values: calls.append(values)})
    return calls


# ---------------------------------------------------------------------- colours
def test_every_text_and_part_has_its_contrast():
    assert checks.contrast_problems() == []


def test_contrast_is_computed_as_wcag_does():
    assert checks.contrast_ratio("#000000", "#FFFFFF") == pytest.approx(21)
    assert checks.contrast_ratio("#767676", "#FFFFFF") == pytest.approx(4.54, abs=.01)


@pytest.mark.parametrize("theme", THEMES)
def test_a_switch_recolours_what_is_on_screen(ui, stage, theme):
    badge = ui.show(StatusBadge(tone="fault", text="Stopped", icon="alert-octagon"))
    apply_theme(stage.theme_cls, theme)
    ui.advance()
    column = THEMES.index(theme)
    assert list(badge.tint) == pytest.approx(list(tk.fault_bg))
    assert list(ui.find(Txt, text="Stopped").color) == list(tk.fault_on)
    assert stage.theme_cls.primaryColor == tk.accent
    assert COLOURS["accent"][column].lower() in str(_hex(tk.accent))


def _hex(colour) -> str:
    return "#" + "".join(f"{round(channel * 255):02x}" for channel in colour[:3])


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
        assert label.width == pytest.approx(before * 1.3, rel=.06)
    finally:
        Metrics.fontscale = 1
        ui.advance()
    assert label.width == before


# ---------------------------------------------------------------------- cards
def test_a_stale_value_looks_stale_and_says_since_when(ui):
    tile = ui.show(ValueTile(label="Battery", value="78 %", level=.78, note="2 s ago"), (240, 96))
    value = ui.find(Txt, text="78 %")
    assert list(value.color) == list(tk.ink)
    tile.stale, tile.note = True, "Not seen since 14:02"
    ui.advance()
    assert list(value.color) == list(tk.ink3)
    assert ui.find(Meter).tone == "offline"
    assert "Not seen since 14:02" in ui.texts()


def test_an_empty_state_leads_on(ui):
    state = ui.show(EmptyState(icon="robot", title="Add your first robot", text="Its address is enough.", action="Add robot"))
    calls = fired(state, "on_release")
    ui.tap_text("Add robot")
    assert calls == [()]


def test_an_empty_state_without_a_way_has_no_button(ui):
    state = ui.show(EmptyState(icon="robot", title="Nothing yet"))
    calls = fired(state, "on_release")
    ui.tap(state)
    assert calls == []


def test_a_kpi_card_shows_value_unit_and_count(ui):
    ui.show(KpiCard(label="Success rate", value=with_unit("98.1", "%"), note="405 of 413", history=[97, None, 98]), (260, 104))
    assert {"Success rate", "405 of 413"} <= set(ui.texts())
    assert any(isinstance(w, Label) and w.markup and w.text.startswith("98.1") for w in ui.seen())


# ---------------------------------------------------------------------- frame
ITEMS = [("home", "Home", "home-variant-outline", "home-variant"), ("logs", "Logs", "text-box-outline", "text-box")]


def frame(ui, **values) -> Frame:
    return ui.show(Frame(title="Home", date="Fri 20 Nov 2026", clock="14:38", robot="Aino", link="Connected", link_icon="wifi", items=ITEMS,
                         current="home", **values))


def test_the_frame_navigates(ui):
    window = frame(ui)
    calls = fired(window, "on_go")
    ui.tap(ui.find(NavItem, name="logs"))
    assert calls == [("logs",)]
    assert ui.find(NavItem, name="home").selected      # until the navigator has gone there
    window.current = "logs"
    assert ui.find(NavItem, name="logs").selected


def test_the_robot_in_the_bar_can_be_tapped(ui):
    window = frame(ui)
    calls = fired(window, "on_pick_robot")
    ui.tap(ui.find(Txt, text="Aino"))
    assert calls == [()]


def test_the_banner_comes_with_an_alarm_and_goes_with_it(ui):
    window = frame(ui)
    body = window.ids.body
    high = body.height
    window.alarm, window.alarm_action, window.alarm_others = "Aino stands still", "Show Aino", "+1 more"
    ui.advance()
    assert "Aino stands still" in ui.texts()
    assert body.height < high - 70
    solve, others = fired(window, "on_solve"), fired(window, "on_list_alarms")
    ui.tap_text("Show Aino")
    ui.tap(ui.find(Txt, text="+1 more"))
    assert (solve, others) == ([()], [()])
    window.alarm = ""
    ui.advance()
    assert body.height == high
    assert ui.find_all(AlarmBanner) == []


def test_what_is_added_to_the_frame_goes_between_bar_and_navigation(ui):
    window = frame(ui)
    label = Label(text="content")
    window.add_widget(label)
    ui.advance()
    assert label in window.ids.body.children
    bar = ui.find(TopBar)
    assert label.top < bar.y
    assert label.y > ui.find(NavItem).top


# ---------------------------------------------------------------------- charts
def test_grid_steps_are_round_and_few():
    assert [nice_step(top) for top in (1, 3, 7, 88, 140, 999, 4200)] == [1, 1, 2, 25, 50, 250, 2000]
    for top in range(1, 3000, 7):
        assert 1 <= top // nice_step(top) + 1 <= 5


LANES = [{"name": "Aino", "bars": [{"key": "a", "start": 1, "end": 2}, {"key": "b", "start": 1.5, "end": 3, "label": "Empties"}]},
         {"name": "Veikko", "bars": [{"key": "c", "start": 20, "end": 20.1}]}]


def test_a_tap_on_a_bar_tells_which(ui):
    chart = ui.show(Timeline(lanes=LANES, ticks=[(6, "19:00", False)], now=1.2, now_label="14:12"), (800, 150))
    calls = fired(chart, "on_bar")
    left, width = 88, 800 - 88
    lane = (150 - 28) / 2
    top = chart.top - 28
    ui.tap_at(left + width * 2.5 / 24, top - lane / 2)
    ui.tap_at(left + width * 20.4 / 24, top - lane * 1.5)          # a fingertip beside a thin bar
    ui.tap_at(left + width * 12 / 24, top - lane / 2)              # nothing near
    assert calls == [("b",), ("c",)]


@pytest.mark.parametrize("chart", [
    lambda: Timeline(), lambda: Timeline(lanes=[{"name": "Aino", "bars": []}]),
    lambda: StackedBars(), lambda: StackedBars(days=[("Mo", 0, 0)]),
    lambda: UtilisationBars(), lambda: UtilisationBars(rows=[("Aino", "0 %", 0, 0), ("Sisu", "100 %", 1, .5)]),
    lambda: Sparkline(), lambda: Sparkline(values=[None, None]), lambda: Sparkline(values=[5]), lambda: Sparkline(values=[5, 5, None, 5]),
    lambda: RobotMap(), lambda: RobotMap(at=[.5, .5], path=[(.5, .5), (.5, .5)])])
def test_charts_draw_whatever_there_is(ui, chart):
    widget = ui.show(chart(), (400, 120))
    drawn = len(widget.canvas.children)
    widget.size = 2, 2
    ui.advance()
    assert len(widget.canvas.children) <= drawn


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


@pytest.mark.parametrize("width", [800, 1024, 1280])
def test_the_bar_has_room_for_long_names(ui, width):
    bar = TopBar(title="Scheduler", date="Wed 30 Sep 2026", clock="14:38", robot="Kuljetusrobotti hallin 2 eteläpäässä, pakkaamon puolella",
                 link="Not seen since 14:02", icon="wifi-off", tone="attention")
    ui.show(bar, (width, 64))
    ui.advance()
    assert checks.problems(bar) == []


def test_the_date_gives_way_where_there_is_no_room(ui):
    bar = TopBar(title="Home", date="Fri 20 Nov 2026", clock="14:38", robot="Aino", link="Connected · 2 s ago", icon="wifi")
    ui.show(bar, (800, 64))
    ui.advance()
    assert "Fri 20 Nov 2026" in ui.texts()
    bar.width = 560
    ui.advance()
    assert "Fri 20 Nov 2026" not in ui.texts()
