"""The app as it is used: results come back, errors are survived, settings and alarms show at once, every screen is reached."""

from __future__ import annotations

import pytest
from kivy.clock import Clock

from app.i18n import translator
from app.widgets.buttons import CommandButton
from app.widgets.frame import Banner, NavItem, TopBar
from app.widgets.lists import STILL
from app.widgets.tokens import tk
from tests.support.stored import Stored
from tests.ui.alarms.listed import open_list, press, row, wait_for_rows
from tests.ui.whole_app import plant, restart, shown, tab_shown


@pytest.fixture(scope="module")
def ui(shared_ui):
    return shared_ui


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """One robot that answers."""
    with plant(tmp_path_factory.mktemp("plant")) as site:
        site.add_robots()
        yield site


@pytest.fixture(scope="module")
def shared_app(site, ui):
    with shown(site.container, ui) as app:
        ui.wait(lambda: "Ready" in ui.texts())
        app.stored = Stored(site.container)
        yield app


@pytest.fixture
def app(shared_app, site, ui):
    """On Home, with its robot at rest."""

    def put_back() -> None:
        site.calm_down(ui)
        shared_app.stored.put_back()

    restart(shared_app, ui, put_back)
    ui.wait(lambda: "Ready" in ui.texts() and not ui.find_all(Banner))
    assert (tk.theme, translator.language, tab_shown(ui)) == ("light", "en", "Aino")
    return shared_app


# ---------------------------------------------------------------------- polling
def test_results_of_a_cycle_come_back_to_the_screen(app, site, ui):
    (robot,) = site.container.catalogue.robots()
    site.container.snapshots.update(robot.id, queue=())
    site.fleet.robots[0].control({"battery": 41.0})
    ui.wait(lambda: "41 %" in ui.texts())


def test_the_robot_on_screen_is_watched(app, site, ui):
    (robot,) = site.container.catalogue.robots()
    ui.wait(lambda: site.container.engine._watched == robot.id)


# ---------------------------------------------------------------------- survival
def test_a_handler_that_fails_is_logged_reported_and_survived(app, site, ui, caplog):
    def broken(_dt):
        raise RuntimeError("a bug")

    Clock.schedule_once(broken, 0)
    ui.wait(lambda: app.shell.snackbars.texts)
    assert app.shell.snackbars.texts == ["Something unexpected went wrong. The log file has the details"]
    assert "a bug" in caplog.text
    ui.tap(ui.find(NavItem, name="logs"))
    assert app.shell.navigator.current == "logs"


# ---------------------------------------------------------------------- settings and screens
def test_theme_and_language_follow_the_settings_live(app, site, ui):
    assert tk.theme == "light"
    site.container.catalogue.change_settings(theme="dark")
    ui.wait(lambda: tk.theme == "dark")
    site.container.catalogue.change_settings(language="fi")
    ui.wait(lambda: translator.language == "fi")
    site.container.catalogue.change_settings(language="en", theme="contrast")
    ui.wait(lambda: translator.language == "en" and tk.theme == "contrast")


def test_a_message_of_the_old_language_is_closed(app, site, ui):
    app.shell.snackbars.undo("Not saved", "Undo", lambda: None)
    site.container.catalogue.change_settings(language="fi")
    ui.wait(lambda: translator.language == "fi")
    assert app.shell.snackbars.texts == []
    site.container.catalogue.change_settings(language="en")
    ui.wait(lambda: translator.language == "en")


def test_navigation_goes_everywhere_and_builds_each_screen_once(app, site, ui):
    app.shell.navigator.rebuild()  # as after a start: without those that other tests have shown
    for name in ("scheduler", "logs", "settings", "home", "scheduler"):
        ui.tap(ui.find(NavItem, name=name))
        assert app.shell.navigator.current == name
        assert ui.find(TopBar).title == ui.find(NavItem, name=name).text
    assert app.shell.navigator.built == ["home", "scheduler", "logs", "settings"]


# ---------------------------------------------------------------------- alarms
def test_an_alarm_stays_until_it_is_acknowledged_and_over(app, site, ui):
    app.shell.go("logs")
    site.fleet.robots[0].control({"emergency_stop": True})
    ui.wait(lambda: ui.find_all(Banner, action="Show"))
    site.fleet.robots[0].control({"emergency_stop": False})
    ui.wait(lambda: not ui.find_all(Banner))
    open_list(ui)
    press(ui, row(ui, "Emergency stop"), "Acknowledge")
    wait_for_rows(ui, 0)
    assert not site.container.alarms.open()


def test_the_page_of_alarms_acknowledges_each(app, site, ui):
    site.container.alarms.raise_("clock_stepped", "clock", seconds=40)
    site.container.alarms.raise_(
        "app_was_off", "app", start="2026-11-20T08:00:00+00:00", end="2026-11-20T09:00:00+00:00"
    )
    page = open_list(ui)
    wait_for_rows(ui, 2)
    for left in (1, 0):
        ui.tap(ui.find(CommandButton, page, text="Acknowledge"))
        wait_for_rows(ui, left)
        ui.skip(STILL)  # the next one has slid under the finger
    assert "No alarms" in ui.texts(page)


# ---------------------------------------------------------------------- no robot
def test_without_a_robot_home_invites_to_add_the_first(app, site, ui):
    (robot,) = site.container.catalogue.robots()
    site.container.catalogue.remove_robot(robot.id)
    ui.wait(lambda: "No robots yet" in ui.texts())
    ui.tap(ui.find(CommandButton, text="Add robot"))
    assert app.shell.navigator.current == "settings"
