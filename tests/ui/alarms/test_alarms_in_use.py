"""Alarms while somebody works: all in one press, their looks and sound, and touches meant for something
else."""

from __future__ import annotations

import pytest
from kivy.core.window import Window

from app.domain.message import message
from app.domain.models import Robot
from app.screens.common.presses import DOUBLE_TAP
from app.screens.frame.alarms import AlarmsScreen, NoteSheet
from app.screens.settings.page import SwitchRow
from app.widgets import finger
from app.widgets.buttons import CommandButton, IconButton, Toggle
from app.widgets.frame import STILL, Banner, Frame, NavItem, TopBar
from app.widgets.menu import MenuRow
from app.widgets.places import places
from app.widgets.rest import rest
from app.widgets.sheet import AskSheet
from app.widgets.tokens import tk
from tests.ui import checks
from tests.ui.alarms.listed import open_list, press, row, silence, tab, wait_for_rows
from tests.ui.integrator import go, undo


# ---------------------------------------------------------------------- all of them
def acknowledge_all(ui) -> None:
    ui.tap(ui.find(CommandButton, ui.find(AlarmsScreen), text="Acknowledge all"))


def unseen(alarms) -> int:
    return sum(alarm.acknowledged_at is None for alarm in alarms.open())


def test_one_press_acknowledges_all(app, alarms, ui):
    silence(alarms, ui, 3)
    alarms.raise_("emergency_stop", "robot:90", robot="Aino")
    alarms.raise_("app_was_off", "app")
    ui.wait(lambda: ui.find(TopBar).bell_count == "3")  # causes, as the page counts them
    dialog = open_list(ui)
    wait_for_rows(ui, 3)
    assert (dialog.vm.head, tab(ui, "open").tab.count) == ("3 new", 3)
    assert checks.problems(dialog) == []
    acknowledge_all(ui)
    ui.wait(lambda: not unseen(alarms) and not dialog.vm.unseen)
    ui.wait(lambda: app.shell.snackbars.texts == ["5 alarms acknowledged"])
    undo(ui)
    ui.wait(lambda: len(dialog.vm.unseen) == unseen(alarms) == 5)


def test_an_alarm_that_just_came_is_not_acknowledged_unread(app, alarms, ui):
    alarms.raise_("app_was_off", "app")
    alarms.raise_("clock_stepped", "clock", seconds=40)
    ui.wait(lambda: ui.find(TopBar).bell_count == "2")
    open_list(ui)
    wait_for_rows(ui, 2)
    ui.advance(1)
    button = ui.find(CommandButton, ui.find(AlarmsScreen), text="Acknowledge all")
    alarms.raise_("emergency_stop", "robot:90", robot="Aino")
    wait_for_rows(ui, 3)
    ui.tap_at(*button.to_window(*button.center))
    ui.wait(lambda: app.shell.background.idle)
    assert unseen(alarms) == 3
    lift = ui.press(button)
    alarms.raise_("executions_missed", "plan", count=4)
    wait_for_rows(ui, 4)
    lift(0)
    ui.wait(lambda: app.shell.background.idle)
    assert unseen(alarms) == 4
    acknowledge_all(ui)
    ui.wait(lambda: not unseen(alarms))


# ---------------------------------------------------------------------- looks
@pytest.mark.parametrize("gloves", [False, True])
def test_nothing_is_clipped_or_too_small(container, app, alarms, ui, gloves):
    container.catalogue.change_settings(gloves=gloves)
    ui.wait(lambda: tk.gloves is gloves)
    alarms.raise_("emergency_stop", "robot:77", robot="A robot with a very long name in the hall of the presses")
    alarms.raise_("executions_missed", "plan", count=4)
    ui.wait(lambda: ui.find(TopBar).bell_count == "2")
    dialog = open_list(ui)
    ui.advance(0.3)
    assert checks.problems(dialog) == []
    ui.tap(ui.find(IconButton, row(ui, "missed"), icon="dots-vertical"))
    top = app.shell.dialogs.top
    assert checks.problems(top) == []
    ui.tap(ui.find(MenuRow, top, text="Acknowledge with a note"))
    assert checks.problems(ui.find(NoteSheet)) == []


# ---------------------------------------------------------------------- what solves it, and the banner
def test_errors_of_a_robot_are_reset_from_its_row_once(container, app, alarms, ui, monkeypatch):
    reset: list[int] = []
    monkeypatch.setattr(container.operator, "reset_errors", reset.append)
    robot = container.catalogue.save_robot(Robot("Aino", "http://127.0.0.1:9", "u"), "p")
    alarms.raise_("robot_error", f"robot:{robot.id}", robot="Aino", problem="Failed to dock")
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    for _tap in range(2):
        press(ui, row(ui, "Can't dock"), "Reset errors")
    ui.wait(lambda: app.shell.snackbars.texts == ["Reset errors was sent to Aino"])
    assert reset == [robot.id]


def test_a_clock_in_doubt_is_amber_and_right_only_by_a_risky_answer(container, app, alarms, ui, monkeypatch):
    said: list[bool] = []
    monkeypatch.setattr(container.holds, "confirm_clock", lambda: said.append(True))
    alarms.raise_("clock_implausible", "clock", problem=message("most robots' clocks are {time} behind it", time="3 h"))
    ui.wait(lambda: ui.find(TopBar).clock_in_doubt)
    clock = ui.find(TopBar).ids.bar_clock
    assert tuple(clock.color) == tuple(tk.attention)
    for answer in ("No, send nothing", "This clock is right"):
        ui.tap(ui.find(CommandButton, ui.find(Banner), text="Decide"))
        ui.advance(DOUBLE_TAP)
        question = ui.find(AskSheet)
        assert [(button.text, button.style, button.tone) for button in ui.find_all(CommandButton, question)] == [
            ("This clock is right", "outlined", "fault"),
            ("No, send nothing", "filled", "neutral"),
        ]
        assert "3 h behind it" in " ".join(ui.texts(question))
        ui.tap(ui.find(CommandButton, question, text=answer))
        ui.wait(lambda: app.shell.background.idle)
        ui.advance(DOUBLE_TAP)
    assert said == [True]
    alarms.clear("clock_implausible", "clock")
    ui.wait(lambda: not ui.find(TopBar).clock_in_doubt)


def test_no_room_is_left_where_the_next_screen_has_no_banner(app, alarms, ui):
    alarms.raise_("emergency_stop", "robot:77", robot="Aino")
    ui.tap(ui.find(NavItem, name="logs"))
    ui.wait(lambda: ui.find_all(Banner))
    ui.tap(ui.find(NavItem, name="home"))
    assert not ui.find(Frame).has_banner


# ---------------------------------------------------------------------- sound
def test_a_new_alarm_sounds_and_again_while_it_is_unacknowledged(container, app, alarms, ui):
    loudspeaker = app.shell.loudspeaker
    before = loudspeaker.played
    alarms.raise_("emergency_stop", "robot:77", robot="Aino")
    ui.wait(lambda: loudspeaker.played == before + 1)
    container.clock.advance(301)
    ui.advance(1.1)
    assert loudspeaker.played == before + 2
    alarms.acknowledge(alarms.open()[0].id)
    ui.wait(lambda: ui.find(TopBar).bell_count == "")
    played = loudspeaker.played
    container.clock.advance(301)
    ui.advance(1.1)
    assert loudspeaker.played == played == before + 2


def test_the_sound_is_switched_in_settings_where_it_is_heard(container, app, alarms, ui):
    loudspeaker = app.shell.loudspeaker
    go(ui, "display")
    switch = ui.find(Toggle, root=ui.find(SwitchRow, text="Sound at alarms"))
    ui.tap(switch)
    ui.wait(lambda: not container.settings().alarm_sound)
    before = loudspeaker.played
    alarms.raise_("emergency_stop", "robot:77", robot="Aino")
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    assert loudspeaker.played == before
    ui.wait(lambda: not ui.find(SwitchRow, text="Sound at alarms").active)
    ui.tap(ui.find(Toggle, root=ui.find(SwitchRow, text="Sound at alarms")))
    ui.wait(lambda: container.settings().alarm_sound)
    assert loudspeaker.played == before + 1


def test_an_alarm_is_heard_again_though_the_clock_was_set_back(container, app, alarms, ui):
    loudspeaker = app.shell.loudspeaker
    before = loudspeaker.played
    alarms.raise_("emergency_stop", "robot:77", robot="Aino")
    ui.wait(lambda: loudspeaker.played == before + 1)
    container.clock.step(-3600)
    container.clock.advance(301)
    ui.advance(1.1)
    assert loudspeaker.played == before + 2


# ---------------------------------------------------------------------- its place
def test_the_tabs_stay_where_the_finger_is(app, alarms, ui):
    for number in range(4):
        alarms.raise_("robot_error", f"robot:{number}", robot=f"Robot {number}", problem=f"Error {number}")
    ui.wait(lambda: ui.find(TopBar).bell_count == "4")
    open_list(ui)
    wait_for_rows(ui, 4)
    place = tab(ui, "past").to_window(*tab(ui, "past").pos)
    ui.tap(tab(ui, "past"))
    wait_for_rows(ui, 0)
    assert tab(ui, "past").to_window(*tab(ui, "past").pos) == place


# ---------------------------------------------------------------------- fingers
def test_a_banner_does_not_move_what_a_finger_is_on(container, app, ui, monkeypatch):
    monkeypatch.setattr(finger, "LONGEST", 1e6)
    lift = ui.press(ui.find(NavItem, name="settings"))
    container.holds.hold("Audit")
    ui.wait(lambda: ui.find(Frame).banner.action == "Release")
    ui.advance(3)
    assert not ui.find(Frame).has_banner
    lift()
    assert ui.find(NavItem, name="settings").active
    ui.wait(lambda: ui.find_all(Banner))


def test_a_banner_waits_until_the_hand_has_left(container, app, ui):
    ui.wait(lambda: not rest.is_on)
    button = ui.find(CommandButton, text="Add robot")
    ui.tap_at(2, 2)
    container.holds.hold("Audit")
    ui.wait(lambda: ui.find(Frame).banner.action == "Release")
    place = button.to_window(*button.center)
    ui.advance(STILL - 0.5)
    assert button.to_window(*button.center) == place
    ui.wait(lambda: ui.find_all(Banner))
    assert button.to_window(*button.center) != place
    release = ui.find(CommandButton, ui.find(Banner), text="Release")
    for widget in (button, release):
        ui.tap_at(*widget.to_window(*widget.center))  # without having looked
    ui.wait(lambda: app.shell.background.idle)
    assert (app.shell.navigator.current, len(container.holds.current())) == ("home", 1)


def test_the_room_of_a_released_hold_stays_under_the_finger(container, app, ui):
    container.holds.hold("Audit")
    ui.wait(lambda: ui.find_all(Banner) and not places.has_just_moved(ui.find(Banner)))
    ui.tap(ui.find(CommandButton, ui.find(Banner), text="Release"))
    ui.wait(lambda: not container.holds.current() and not ui.find_all(Banner))
    assert ui.find(Frame).has_banner
    ui.wait(lambda: not ui.find(Frame).has_banner)


def test_a_finger_on_its_way_to_one_banner_presses_nothing_of_the_next(container, app, alarms, ui):
    """Who wants to hold what starts in a moment must not release a hold whose message appears as it starts."""
    alarms.database_fails("disk full")
    ui.wait(lambda: ui.find_all(Banner, action="Open settings"))
    ui.advance(2)
    alarms.database_works()
    container.holds.hold("Audit")
    ui.wait(lambda: ui.find(Banner).action == "Release")
    ui.advance()
    button = ui.find(CommandButton, ui.find(Banner), text="Release")
    ui.tap_at(*button.to_window(*button.center))
    ui.wait(lambda: app.shell.background.idle)
    assert len(container.holds.current()) == 1
    ui.advance(1)
    ui.tap(button)
    ui.wait(lambda: not container.holds.current())


def test_a_hand_that_rests_on_the_screen_keeps_no_banner_away(container, app, ui):
    lift = ui.press(ui.find(NavItem, name="settings"))
    container.holds.hold("Audit")
    ui.wait(lambda: ui.find_all(Banner))
    lift()


def test_a_second_tap_on_the_banner_releases_no_other_hold(container, app, ui, monkeypatch):
    robot = container.catalogue.save_robot(Robot("Aino", "http://127.0.0.1:9", "u", enabled=False), password="p")
    container.holds.hold("Audit")
    container.holds.hold("Wheel", robot_id=robot.id)
    ui.wait(lambda: ui.find_all(Banner, action="Release") and not places.has_just_moved(ui.find(Banner)))
    monkeypatch.setattr(Banner, "still", 1e3)
    button = ui.find(CommandButton, ui.find(Banner), text="Release")
    ui.tap(button)
    ui.wait(lambda: len(container.holds.current()) == 1)
    ui.advance(2)
    ui.tap_at(*button.to_window(*button.center))
    ui.wait(lambda: app.shell.background.idle)
    assert len(container.holds.current()) == 1


def test_the_buttons_of_a_row_are_beside_its_words_again_when_a_tall_window_was_turned(app, ui, monkeypatch):
    monkeypatch.setattr(Window, "size", (800, 1280))
    app.shell.go("alarms")
    ui.advance()
    assert app.models["alarms"].below
    app.shell.go("home")
    app.shell.navigator.rebuild()
    Window.size = 1280, 800
    app.shell.go("alarms")
    ui.advance()
    assert not app.models["alarms"].below
