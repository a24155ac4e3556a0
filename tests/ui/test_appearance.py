"""Glove mode and size of texts: switched in Settings, at once and permanently, and every screen stays complete."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from itertools import permutations, product

import pytest
from kivy.core.window import Window
from kivy.metrics import Metrics
from kivy.uix.label import Label

from app.domain.models import Schedule
from app.screens.logs.view import Period
from app.screens.settings.page import SwitchRow
from app.widgets.buttons import CommandButton, Segment, Toggle
from app.widgets.display import Disc
from app.widgets.frame import Banner, Frame, NavItem, TopBar
from app.widgets.scrolling import ScrollPage
from app.widgets.tokens import THEMES, tk
from tests.support.examples import every_fourth
from tests.ui import checks
from tests.ui.integrator import go, settings
from tests.ui.whole_app import shown


def toggle(ui, text: str) -> Toggle:
    return ui.find(Toggle, root=ui.find(SwitchRow, text=text))


# ---------------------------------------------------------------------- switched at once, and stored
@pytest.mark.long
def test_glove_mode_is_switched_at_once_and_the_section_stays_open(site, app, ui):
    """Letters, gaps and targets grow by a quarter, those of a finger by more: the layout is that of a 1024×640 window."""
    go(ui, "display")
    letters = ui.find(Label, ui.find(SwitchRow, text="Glove mode"), text="Glove mode").font_size
    ui.tap(toggle(ui, "Glove mode"))
    ui.wait(lambda: tk.gloves)
    ui.wait(lambda: ui.find_all(SwitchRow, text="Glove mode", active=True))
    assert (tk.h_touch, tk.h_field, tk.h_foot) == (70, 70, 120)
    assert ui.find(Label, ui.find(SwitchRow, text="Glove mode"), text="Glove mode").font_size == 1.25 * letters
    assert (ui.find(Frame).low, ui.find(TopBar).height) == (True, 80)
    assert app.shell.navigator.current == "settings"
    assert app.shell.navigator.screen("settings").vm.current == "display"
    assert ui.find(NavItem, name="home").height >= 70
    ui.tap(ui.find(NavItem, name="home"))
    ui.tap(ui.find(NavItem, name="settings"))
    ui.wait(lambda: ui.find_all(SwitchRow, text="Glove mode", active=True))
    ui.tap(toggle(ui, "Glove mode"))
    ui.wait(lambda: not tk.gloves)
    assert (settings(site).gloves, tk.h_touch, ui.find(TopBar).height) == (False, 48, 64)


@pytest.mark.parametrize(("size", "touch"), [((1280, 800), 70), ((800, 1280), 70), ((1024, 600), 56)])
def test_what_gloves_enlarge_still_has_room(site, ui, size, touch):
    with window(size):
        tk.use("light", gloves=True)
        assert tk.h_touch == touch


def test_gloves_fit_a_window_that_becomes_smaller(site, app, ui):
    site.container.catalogue.change_settings(gloves=True)
    ui.wait(lambda: tk.h_touch == 70)
    with window((1024, 600)):
        ui.wait(lambda: tk.h_touch == 56)
        assert (ui.find(TopBar).height, ui.find(Frame).tall, ui.find(Frame).low) == (64, False, True)
    ui.wait(lambda: tk.h_touch == 70)


def test_a_section_stays_where_it_was_scrolled_to(site, app, ui):
    go(ui, "constraints")
    ui.find(ScrollPage).scroll_y = 0
    ui.advance(0.2)
    site.container.catalogue.change_settings(gloves=True)
    ui.wait(lambda: tk.gloves)
    ui.advance(0.5)
    page = ui.find(ScrollPage)
    assert page.content_height > page.height
    assert page.scroll_y == pytest.approx(0, abs=0.05)


def test_a_section_keeps_its_tab(site, app, ui):
    site.add_robots()
    site.add_missions("Deliver")
    go(ui, "missions")
    old = app.shell.navigator.screen("settings")
    ui.wait(lambda: len(old.tabs) == 2)
    old.choose_tab("places")
    site.container.catalogue.change_settings(font_scale_percent=115)
    ui.wait(lambda: app.shell.navigator.screen("settings") is not old)
    ui.wait(lambda: app.shell.navigator.screen("settings").tab == "places")


def test_the_banner_keeps_its_button_inside_when_glove_mode_is_switched(site, app, ui):
    site.container.holds.hold("Audit")
    ui.wait(lambda: ui.find_all(Banner))
    for gloves in (True, False):
        site.container.catalogue.change_settings(gloves=gloves)
        ui.wait(lambda expected=gloves: tk.gloves is expected)
        ui.advance(0.2)
        banner = ui.find(Banner)
        assert ui.find(CommandButton, banner, text=banner.action).height == tk.h_touch <= banner.height


def test_the_operators_buttons_grow_with_gloves(site, ui):
    site.add_robots()
    site.container.catalogue.change_settings(gloves=True)
    with shown(site.container, ui):
        ui.wait(lambda: ui.find_all(CommandButton, text="Pause"))
        assert ui.find(CommandButton, text="Pause").height == 120


def test_the_size_of_texts_is_switched_at_once_and_ends_with_the_app(site, ui):
    with shown(site.container, ui) as app:
        go(ui, "display")

        def height() -> float:
            return ui.find(Label, ui.find(Segment, text="130 %"), text="130 %").height

        before = height()
        ui.tap(ui.find(Segment, text="130 %"))
        ui.wait(lambda: Metrics.fontscale == pytest.approx(1.3))
        ui.wait(lambda: ui.find_all(Segment, text="130 %", selected=True))
        assert height() > before * 1.2
        assert app.shell.navigator.screen("settings").vm.current == "display"
    assert Metrics.fontscale == 1


def test_a_schedule_that_is_being_edited_survives_a_change_of_the_size_of_texts(site, app, ui):
    robot, *_others = site.add_robots()
    deliver, *_missions = site.add_missions("Deliver")
    start = site.container.clock.now().replace(tzinfo=None, second=0, microsecond=0) + timedelta(hours=2)
    schedule = site.container.catalogue.save_schedule(Schedule("", robot.id, deliver.id, start, "UTC", "FREQ=DAILY"))
    app.shell.go("scheduler", schedule_id=schedule.id)
    old = app.shell.navigator.screen("scheduler")
    ui.wait(lambda: old.vm.form.editing == schedule.id)
    old.vm.form.set(priority=7)
    go(ui, "display")
    site.container.catalogue.change_settings(font_scale_percent=115)
    ui.wait(lambda: app.shell.navigator.screen("scheduler") is not old)
    ui.tap(ui.find(NavItem, name="scheduler"))
    form = app.shell.navigator.screen("scheduler").vm.form
    ui.wait(lambda: app.shell.background.idle)
    assert (form.editing, form.draft.priority) == (schedule.id, 7)


@pytest.mark.parametrize(
    "change", [{"gloves": True}, {"font_scale_percent": 115}, {"language": "fi"}, {"theme": "dark"}]
)
def test_screens_keep_their_content_when_the_appearance_changes(site, app, ui, change):
    """Whether they are built again for it or not: the timeline's zoom, and the part of the Logs with its filters."""

    def model(name: str):
        app.shell.go(name)
        ui.wait(lambda: app.shell.background.idle)
        return app.shell.navigator.screen(name).vm

    plan, logs = model("scheduler"), model("logs")
    plan.show_span(24)
    plan.page(True)
    window = plan._window
    plan.tab = "schedules"
    logs.choose_part("figures")
    logs.set_filters(period=Period.MONTH)
    logs.toggle_search()
    logs.search("kits")
    ui.advance(0.5)
    go(ui, "display")
    site.container.catalogue.change_settings(**change)
    ui.wait(lambda: app._shown == settings(site))
    logs, plan = model("logs"), model("scheduler")
    assert (plan.tab, plan._window) == ("schedules", window)
    plan.tab = "plan"
    ui.wait(lambda: app.shell.background.idle)
    assert (plan.timeline.hours, plan._window.left) == (window.hours, window.left)
    assert (logs.part, logs.query, logs.searching) == ("figures", "kits", True)
    assert (logs.wanted.period, logs.wanted.text) == (Period.MONTH, "kits")


def test_both_survive_a_restart(site, ui):
    with shown(site.container, ui):
        go(ui, "display")
        ui.tap(ui.find(Segment, text="115 %"))
        ui.wait(lambda: Metrics.fontscale == pytest.approx(1.15))
        ui.wait(lambda: ui.find_all(Segment, text="115 %", selected=True))
        ui.tap(toggle(ui, "Glove mode"))
        ui.wait(lambda: settings(site).gloves)
    tk.use("light", gloves=False)
    with shown(site.container, ui):
        assert tk.gloves
        assert Metrics.fontscale == pytest.approx(1.15)


def test_a_change_of_anything_else_rebuilds_nothing(site, app, ui):
    screen = app.shell.navigator.screen("home")
    site.container.catalogue.change_settings(theme="dark", retry_limit=3)
    ui.wait(lambda: tk.theme == "dark")
    assert app.shell.navigator.screen("home") is screen


@pytest.mark.parametrize(("before", "after"), every_fourth(permutations(THEMES, 2)))
def test_a_switch_of_the_theme_leaves_the_colours_that_the_theme_has(ui, before, after):
    """White ink that stays white is not taken over by the ink of the new theme's cards."""

    def pieces():
        return [
            Banner(text="Aino: emergency stop", action="Show", tone="fault"),
            Banner(text="All robots on hold", tone="attention"),
            CommandButton(style="filled", text="Run", icon="play"),
            Disc(icon="alert", tone="fault", loud=True),
        ]

    def inks(shown):
        return [[tuple(label.color) for label in piece.walk() if isinstance(label, Label)] for piece in shown]

    tk.use(before)
    switched = pieces()
    tk.use(after)
    assert inks(switched) == inks(pieces())


# ---------------------------------------------------------------------- every screen stays whole
MODES = {
    "gloves": {"gloves": True},
    "large-text": {"font_scale_percent": 130},
    "both": {"gloves": True, "font_scale_percent": 130},
}
WINDOWS = {"landscape": (1280, 800), "portrait": (800, 1280), "small": (1024, 600)}
SECTIONS = ("robots", "missions", "constraints", "idle", "scheduler", "display", "data", "about")


@contextmanager
def window(size: tuple[int, int]) -> Iterator[None]:
    before = Window.size
    Window.size = size
    try:
        yield
    finally:
        Window.size = before


@pytest.mark.parametrize(
    ("mode", "size"),
    [
        ("both", "small"),
        *(pytest.param(*way, marks=pytest.mark.long) for way in product(MODES, WINDOWS) if way != ("both", "small")),
    ],
)
def test_nothing_is_clipped_overlaps_or_is_too_small(site, ui, mode, size):
    container = site.container
    robot, _other = site.add_robots()
    deliver, _home = site.add_missions("Deliver", "Home")
    start = container.clock.now().replace(tzinfo=None, second=0, microsecond=0) + timedelta(hours=2)
    container.catalogue.save_schedule(
        Schedule("", robot.id, deliver.id, start, "UTC", "FREQ=DAILY", respect_working_days=False)
    )
    container.alarms.raise_("clock_stepped", "clock", seconds=40)
    container.catalogue.change_settings(**MODES[mode])
    found = []
    with window(WINDOWS[size]), shown(container, ui) as app:
        for name in ("home", "scheduler", "logs"):
            ui.tap(ui.find(NavItem, name=name))
            found += problems(ui, app, name)
        for section in SECTIONS:
            app.shell.go("settings", section=section)
            screen = app.shell.navigator.screen("settings")
            ui.wait(lambda screen=screen, section=section: app.shell.background.idle and screen.vm.current == section)
            found += problems(ui, app, section)
    assert "\n".join(found) == ""


def problems(ui, app, name: str) -> list[str]:
    """What stays wrong: a robot's answer of the last instant is laid out in the frame after it."""
    for _look in range(3):
        ui.wait(lambda: app.shell.background.idle)
        ui.advance(0.5)
        if not (found := checks.problems(ui.find(Frame))):
            break
    return [f"{name}: {line}" for line in found]
