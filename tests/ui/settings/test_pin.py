"""The PIN before Settings by taps: set, asked, wrong, waited for, forgotten on leaving; and nothing else behind it."""

from __future__ import annotations

from datetime import timedelta

import pytest
from kivy.core.window import Window

from app.domain.clock import SystemClock
from app.domain.models import Robot
from app.screens.common.pin_sheet import PinSheet
from app.screens.common.presses import DOUBLE_TAP
from app.screens.settings.gate import LEFT_ALONE_S
from app.screens.settings.robot_sheet import RobotSheet
from app.services.live.access import TRIES, WAIT_S
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.choices import ChoiceSheet
from app.widgets.frame import NavItem
from app.widgets.list_row import ListRow
from app.widgets.number_pad import PadKey
from app.widgets.sheet import AskSheet
from app.widgets.tokens import tk
from tests.ui import checks
from tests.ui.alarms.listed import open_list, row, wait_for_rows
from tests.ui.alarms.listed import press as press_row
from tests.ui.integrator import choose, go, item_of, open_row, page, says, section_row, section_rows, undo

F1, TAB = 282, 9


@pytest.fixture
def first_screen() -> str:
    return "home"


@pytest.fixture(scope="module")
def clock(shared_site) -> list[float]:
    """Seconds by which the tests of this file have moved the clock on. It never goes back, and all of them together stay below the ten
    minutes from which robots would say that it is wrong."""
    real, ahead = SystemClock(), [0.0]
    shared_site.container.clock.now = lambda: real.now() + timedelta(seconds=ahead[0])
    shared_site.container.clock.monotonic = lambda: real.monotonic() + ahead[0]
    return ahead


def press(ui, digits: str) -> PinSheet:
    """Digits, then the key that is done."""
    sheet = ui.find(PinSheet)
    for digit in digits:
        ui.tap(ui.find(PadKey, sheet, text=digit))
    ui.tap(ui.find(PadKey, sheet, icon="check"))
    ui.wait(lambda: not sheet.busy or sheet.parent is None)
    return sheet


def current(app) -> str:
    return app.shell.navigator.current


def unlock(ui, app) -> None:
    press(ui, "4711")
    ui.wait(lambda: section_rows(ui) and not ui.find_all(PinSheet))
    assert current(app) == "settings"


def to_settings(ui) -> None:
    ui.tap(ui.find(NavItem, name="settings"))


# ---------------------------------------------------------------------- setting it
def test_it_is_off_until_it_is_set_twice_the_same(site, app, ui):
    go(ui, "display")
    ui.tap(ui.find(CommandButton, text="Set PIN"))
    press(ui, "123")  # too short: the key does nothing
    assert ui.find(PinSheet).ids.pin_dots.text == "•••"
    ui.tap(ui.find(PadKey, icon="backspace-outline"))
    press(ui, "34")
    assert ui.find(PinSheet).problem.startswith("Easy to guess")
    assert "Enter it again to use it anyway" in ui.texts(ui.find(PinSheet))
    press(ui, "1235")  # or another one
    assert ui.find(PinSheet).problem == "The PINs don't match"
    press(ui, "1234")
    press(ui, "1234")
    ui.wait(lambda: not ui.find_all(PinSheet))
    assert site.container.access.check("1234").is_right
    ui.wait(lambda: ui.find_all(CommandButton, text="Change PIN"))
    assert current(app) == "settings"  # who has just set it is in


def test_a_good_one_is_only_asked_for_again(site, app, ui):
    go(ui, "display")
    ui.tap(ui.find(CommandButton, text="Set PIN"))
    press(ui, "471183")
    assert ui.find(PinSheet).problem == ""
    assert "Enter it again" in ui.texts(ui.find(PinSheet))


def test_it_is_removed(site, app, ui):
    go(ui, "display")
    site.container.access.set_pin("4711")
    ui.wait(lambda: ui.find_all(CommandButton, text="Change PIN"))
    ui.tap(ui.find(CommandButton, text="Remove PIN"))
    sheet = ui.find(AskSheet)
    assert site.container.access.is_set()
    ui.tap(ui.find(CommandButton, sheet, text="Remove PIN"))
    ui.wait(lambda: ui.find_all(CommandButton, text="Set PIN"))
    assert not site.container.access.is_set()


# ---------------------------------------------------------------------- entering
def test_no_key_opens_kivys_own_settings_past_it(site, app, ui):
    before = list(Window.children)
    Window.dispatch("on_keyboard", F1, 0, None, [])
    ui.wait(lambda: ui.find_all(NavItem))
    assert Window.children == before


def test_settings_asks_and_opens_with_the_right_one_only(site, app, ui):
    site.container.access.set_pin("4711")
    to_settings(ui)
    assert current(app) == "home"
    press(ui, "0000")
    assert ui.find(PinSheet).problem == "Wrong PIN, 4 tries left"
    assert ui.find(PinSheet).ids.pin_dots.text == ""
    unlock(ui, app)
    ui.wait(lambda: section_rows(ui))


def test_a_keyboard_does_too(site, app, ui):
    site.container.access.set_pin("4711")
    to_settings(ui)
    for character in "47119":
        ui.key(ord(character), character)
    ui.key(8)
    ui.key(13)
    ui.wait(lambda: current(app) == "settings")


def test_closing_the_pin_stays_on_the_screen(site, app, ui):
    site.container.access.set_pin("4711")
    ui.tap(ui.find(NavItem, name="logs"))
    to_settings(ui)
    ui.tap(ui.find(IconButton, root=ui.find(PinSheet), icon="close"))
    assert not ui.find_all(PinSheet)
    assert current(app) == "logs"
    assert ui.find(NavItem, name="logs").active


def test_the_robot_can_be_paused_while_it_is_asked_for(site, app, ui):
    site.add_robots()
    site.container.access.set_pin("4711")
    ui.wait(lambda: "Ready" in ui.texts())
    to_settings(ui)
    press(ui, "47")
    for command, then in (("Pause", "Resume"), ("Resume", "Pause")):
        ui.tap(ui.find(CommandButton, text=command))
        ui.wait(lambda then=then: ui.find_all(CommandButton, text=then, busy=False))
        ui.advance(1)  # the button rests
    assert ui.find(PinSheet).ids.pin_dots.text == "••"


def test_after_five_wrong_ones_half_a_minute_is_counted_down(site, app, ui, clock):
    site.container.access.set_pin("4711")
    to_settings(ui)
    for _n in range(TRIES):
        sheet = press(ui, "0000")
    assert sheet.waiting
    assert sheet.problem.startswith("Too many wrong PINs: wait ")
    assert sheet.text.startswith("Forgotten? The person in charge of this tablet")
    assert "main.py" not in sheet.text
    ui.tap(ui.find(PadKey, sheet, text="4"))
    assert sheet.ids.pin_dots.text == ""
    ui.tap(ui.find(IconButton, root=sheet, icon="close"))  # closing it shortens nothing
    to_settings(ui)
    sheet = ui.find(PinSheet)
    assert sheet.waiting
    clock[0] += WAIT_S
    ui.advance(1.1)
    assert (sheet.waiting, sheet.problem) == (False, "")
    unlock(ui, app)


def test_a_removed_pin_is_not_asked_for(site, app, ui):
    site.container.access.set_pin("4711")
    to_settings(ui)
    assert ui.find_all(PinSheet)
    site.container.access.remove()
    ui.skip(1)
    ui.wait(lambda: app.shell.navigator.current == "settings")
    ui.wait(lambda: not ui.find_all(PinSheet))


# ---------------------------------------------------------------------- how long it stays open
def test_it_is_asked_again_after_another_tab(site, app, ui):
    site.container.access.set_pin("4711")
    to_settings(ui)
    unlock(ui, app)
    ui.tap(ui.find(NavItem, name="home"))
    assert current(app) == "home"
    to_settings(ui)
    assert ui.find_all(PinSheet)


def test_settings_closes_after_two_minutes_without_a_touch(site, app, ui, clock):
    site.container.access.set_pin("4711")
    to_settings(ui)
    unlock(ui, app)
    clock[0] += LEFT_ALONE_S - 10
    ui.tap(section_row(ui, "robots"))  # somebody is there
    clock[0] += 30
    ui.key(TAB)  # and still is
    clock[0] += LEFT_ALONE_S - 10
    ui.advance(1.1)
    assert current(app) == "settings"
    clock[0] += 11
    ui.advance(1.1)
    assert current(app) == "home"
    to_settings(ui)
    assert ui.find_all(PinSheet)


def test_without_a_pin_settings_stays_open(site, app, ui, clock):
    to_settings(ui)
    clock[0] += 2 * LEFT_ALONE_S
    ui.advance(1.1)
    assert current(app) == "settings"


def test_glove_mode_asks_for_nothing_in_between(site, app, ui):
    site.container.access.set_pin("4711")
    to_settings(ui)
    unlock(ui, app)
    site.container.catalogue.change_settings(gloves=True)
    ui.wait(lambda: ui.find(NavItem, name="home").height >= 64)
    assert current(app) == "settings"
    assert not ui.find_all(PinSheet)


# ---------------------------------------------------------------------- what is never behind it
def test_everything_of_the_operators_stays_free(site, app, ui):
    robot = site.container.catalogue.save_robot(
        Robot("Aino", site.fleet.robots[0].url, "distributor"), password="distributor"
    )
    site.container.access.set_pin("4711")
    ui.wait(lambda: "Ready" in ui.texts())
    for name in ("scheduler", "logs", "home"):
        ui.tap(ui.find(NavItem, name=name))
        assert current(app) == name
    ui.tap(ui.find(CommandButton, text="Pause"))
    ui.wait(lambda: ui.find_all(CommandButton, text="Resume"))
    site.container.alarms.raise_(
        "app_was_off", "app", start="2026-11-20T08:00:00+00:00", end="2026-11-20T09:00:00+00:00"
    )
    open_list(ui)
    wait_for_rows(ui, 1)
    press_row(ui, row(ui, "off or asleep"), "Acknowledge")
    ui.wait(lambda: not site.container.alarms.open())
    assert not ui.find_all(PinSheet)
    ui.skip(DOUBLE_TAP)
    site.container.alarms.raise_("unauthorized", f"robot:{robot.id}", robot="Aino")
    ui.wait(lambda: any("Wrong password" in row.item.title for row in ui.find_all(ListRow)))
    press_row(ui, row(ui, "Wrong password"), "Open settings")
    unlock(ui, app)  # the intent waits behind the door
    ui.wait(lambda: app.shell.navigator.screen("settings").vm.current == "robots")


# ---------------------------------------------------------------------- looks
@pytest.mark.parametrize("gloves", [False, True])
def test_keys_are_for_gloves(site, app, ui, gloves):
    site.container.catalogue.change_settings(gloves=gloves)
    ui.wait(lambda: tk.gloves == gloves)
    site.container.access.set_pin("4711")
    to_settings(ui)
    press(ui, "0000")
    assert all(min(key.size) >= 64 for key in ui.find_all(PadKey))
    assert checks.problems(ui.find(PinSheet)) == []
    assert says(ui, "Wrong PIN")


# ---------------------------------------------------------------------- what comes after it was left
def test_an_answer_that_comes_late_asks_nothing_on_another_screen(site, app, ui):
    site.container.catalogue.save_robot(Robot("Aino", site.fleet.robots[0].url, "distributor"), "distributor")
    site.container.access.set_pin("4711")
    to_settings(ui)
    unlock(ui, app)
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(CommandButton, icon="download-outline", disabled=False))
    site.fleet.robots[0].control(
        {"fault": {"kind": "delay", "path": "/missions", "method": "GET", "count": None, "seconds": 0.5}}
    )
    ui.tap(ui.find_all(CommandButton, icon="download-outline", disabled=False)[-1])
    ui.tap(ui.find(NavItem, name="home"))
    assert not app.shell.background.idle
    ui.wait(lambda: app.shell.background.idle)
    assert (current(app), ui.find_all(ChoiceSheet)) == ("home", [])


def test_undo_of_a_deletion_in_settings_needs_the_pin(site, app, ui):
    site.container.catalogue.save_robot(Robot("Aino", site.fleet.robots[0].url, "distributor"), "distributor")
    site.container.access.set_pin("4711")
    to_settings(ui)
    unlock(ui, app)
    go(ui, "robots")
    choose(ui, "Delete", open_row(ui, "Aino"))
    ui.wait(lambda: ui.find_all(AskSheet))
    ui.tap(ui.find(CommandButton, ui.find(AskSheet), text="Delete"))
    ui.wait(lambda: app.shell.snackbars.texts == ["Aino deleted"])
    ui.tap(ui.find(NavItem, name="home"))
    undo(ui)
    ui.tap(ui.find(IconButton, root=ui.find(PinSheet), icon="close"))
    ui.advance(0.6)
    assert (site.container.catalogue.robots(), app.shell.snackbars.texts) == ([], ["Aino deleted"])
    undo(ui)
    press(ui, "4711")
    ui.wait(lambda: [robot.name for robot in site.container.catalogue.robots()] == ["Aino"])
    assert (app.shell.snackbars.texts, current(app)) == ([], "home")
    to_settings(ui)
    assert ui.find_all(PinSheet)  # it was for that alone


def test_a_failed_undo_stays_behind_the_pin(site, app, ui):
    aino = Robot("Aino", site.fleet.robots[0].url, "distributor")
    stored = site.container.catalogue.save_robot(aino, "distributor")
    site.container.access.set_pin("4711")
    to_settings(ui)
    unlock(ui, app)
    go(ui, "robots")
    ui.wait(lambda: item_of(ui, "Aino"))
    RobotSheet(page(app).context, stored).remove_at_once()
    ui.wait(lambda: app.shell.snackbars.texts == ["Aino deleted"])
    site.container.catalogue.save_robot(aino, "distributor")  # its name is taken
    ui.tap(ui.find(NavItem, name="home"))
    undo(ui)
    press(ui, "4711")
    ui.wait(lambda: app.shell.snackbars.texts not in ([], ["Aino deleted"]))
    ui.advance(0.6)
    undo(ui)
    assert ui.find_all(PinSheet)


def test_the_person_who_set_the_pin_is_not_asked_for_it(site, app, ui):
    to_settings(ui)
    ui.wait(lambda: section_rows(ui))
    site.container.access.set_pin("4711")
    app.shell.go("settings", section="data")  # as an alarm leads there
    assert not ui.find_all(PinSheet)
    ui.wait(lambda: app.shell.navigator.screen("settings").vm.current == "data")
