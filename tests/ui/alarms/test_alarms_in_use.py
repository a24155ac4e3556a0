"""Alarms while somebody works: all on screen in one press, their looks and sound, and touches meant for something
else."""

from __future__ import annotations

import pytest

from app.screens.frame import alarm_list as frame_alarms
from app.screens.frame import controller
from app.screens.frame.alarm_list import AlarmRow, AlarmsDialog, NoteDialog
from app.screens.settings.page import SwitchRow
from app.widgets import finger
from app.widgets.buttons import CommandButton, IconButton, Toggle
from app.widgets.frame import AlarmBanner, NavItem, TopBar
from app.widgets.rest import rest
from app.widgets.surfaces import Tap
from app.widgets.tokens import tk
from tests.ui import checks
from tests.ui.alarms.listed import open_list, row, silence, tab, wait_for_rows
from tests.ui.integrator import go


# ---------------------------------------------------------------------- all that is on screen
def acknowledge_all(ui, word: str = "Acknowledge all") -> None:
    ui.tap(ui.find(CommandButton, ui.find(AlarmsDialog), text=word))


def unseen(alarms) -> int:
    return sum(alarm.acknowledged_at is None for alarm in alarms.open())


def test_one_press_acknowledges_all_that_is_on_screen(app, alarms, ui):
    silence(alarms, ui, 3)
    alarms.raise_("emergency_stop", "robot:90", robot="Aino")
    alarms.raise_("app_was_off", "app")
    ui.wait(lambda: ui.find(TopBar).bell_count == "3")
    dialog = open_list(ui)
    wait_for_rows(ui, 3)
    assert checks.problems(dialog) == []
    acknowledge_all(ui)
    ui.wait(lambda: not unseen(alarms) and dialog.all_word == "")


def test_alarms_out_of_sight_are_not_acknowledged(app, alarms, ui):
    for number in range(9):
        alarms.raise_("emergency_stop", f"robot:{70 + number}", robot=f"Robot {number}")
    ui.wait(lambda: ui.find(TopBar).bell_count == "9")
    dialog = open_list(ui)
    wait_for_rows(ui, 9)
    page = dialog.ids.alarm_rows
    page.scroll_y = 0.5  # rows are cut off above and below
    ui.advance(0.2)
    shown = [
        each.text
        for each in ui.find_all(AlarmRow)
        if page.to_window(*page.pos)[1] <= each.to_window(*each.pos)[1]
        and each.to_window(0, each.top)[1] <= page.to_window(0, page.top)[1]
    ]
    assert 2 <= len(shown) <= 7
    acknowledge_all(ui, "Acknowledge those shown")
    ui.wait(lambda: unseen(alarms) == 9 - len(shown))
    assert not {
        f"{alarm.details['robot']} is stopped: emergency stop pressed"
        for alarm in alarms.open()
        if alarm.acknowledged_at is None
    } & set(shown)


def test_a_second_tap_acknowledges_nothing_more(app, alarms, ui, monkeypatch):
    monkeypatch.setattr(frame_alarms, "DOUBLE_TAP", 1e3)
    for number in range(9):
        alarms.raise_("emergency_stop", f"robot:{70 + number}", robot=f"Robot {number}")
    ui.wait(lambda: ui.find(TopBar).bell_count == "9")
    dialog = open_list(ui)
    wait_for_rows(ui, 9)
    acknowledge_all(ui, "Acknowledge those shown")
    ui.wait(lambda: unseen(alarms) < 9 and len(dialog.unseen) == unseen(alarms))
    left = unseen(alarms)
    assert left > 1  # above those that are acknowledged, where the first ones were
    acknowledge_all(ui)
    ui.wait(lambda: app.shell.background.idle)
    assert unseen(alarms) == left
    ui.skip(1e3)
    acknowledge_all(ui)
    ui.wait(lambda: unseen(alarms) < left)


def test_an_alarm_that_just_came_is_not_acknowledged_unread(app, alarms, ui, monkeypatch):
    monkeypatch.setattr(frame_alarms, "DOUBLE_TAP", 1e3)
    alarms.raise_("app_was_off", "app")
    alarms.raise_("clock_stepped", "clock", seconds=40)
    ui.wait(lambda: ui.find(TopBar).bell_count == "2")
    open_list(ui)
    wait_for_rows(ui, 2)
    alarms.raise_("emergency_stop", "robot:90", robot="Aino")
    wait_for_rows(ui, 3)
    acknowledge_all(ui)
    wait_for_rows(ui, 1)
    assert [alarm.code for alarm in alarms.open()] == ["emergency_stop"]
    assert unseen(alarms) == 1


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
    ui.tap(next(widget for widget in ui.find_all(Tap, top) if getattr(widget, "text", "") == "Acknowledge with a note"))
    assert checks.problems(ui.find(NoteDialog)) == []


# ---------------------------------------------------------------------- sound
def test_a_new_alarm_sounds_and_again_while_it_is_unacknowledged(container, app, alarms, ui):
    loudspeaker = app.shell.loudspeaker
    before = loudspeaker.played
    alarms.raise_("emergency_stop", "robot:77", robot="Aino")
    ui.wait(lambda: loudspeaker.played == before + 1)
    height = ui.find(AlarmBanner).height
    container.clock.advance(301)
    ui.advance(1.1)
    assert loudspeaker.played == before + 2
    assert ui.find(AlarmBanner).height > height
    assert ui.find(AlarmBanner).note.startswith("Unacknowledged for 5 min")
    assert checks.problems(ui.find(AlarmBanner)) == []
    alarms.acknowledge(alarms.open()[0].id)
    ui.wait(lambda: ui.find(AlarmBanner).calm)
    played = loudspeaker.played
    container.clock.advance(301)
    ui.wait(lambda: ui.find(AlarmBanner).height == height)
    assert loudspeaker.played == played == before + 2


def test_the_sound_is_switched_in_settings_where_it_is_heard(container, app, alarms, ui):
    loudspeaker = app.shell.loudspeaker
    go(ui, "display")
    switch = ui.find(Toggle, root=ui.find(SwitchRow, text="Sound at alarms"))
    ui.tap(switch)
    ui.wait(lambda: not container.settings().alarm_sound)
    before = loudspeaker.played
    alarms.raise_("emergency_stop", "robot:77", robot="Aino")
    ui.wait(lambda: ui.find_all(AlarmBanner))
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
        alarms.raise_("robot_error", f"robot:{number}", robot=f"Robot {number}", problem="no answer")
    ui.wait(lambda: ui.find(TopBar).bell_count == "4")
    open_list(ui)
    wait_for_rows(ui, 4)
    place = tab(ui, "past").to_window(*tab(ui, "past").pos)
    ui.tap(tab(ui, "past"))
    wait_for_rows(ui, 0)
    assert tab(ui, "past").to_window(*tab(ui, "past").pos) == place


# ---------------------------------------------------------------------- fingers
def test_an_alarm_does_not_move_what_a_finger_is_on(app, alarms, ui, monkeypatch):
    monkeypatch.setattr(finger, "LONGEST", 1e6)
    lift = ui.press(ui.find(NavItem, name="settings"))
    alarms.raise_("clock_stepped", "clock", seconds=40)
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    assert ui.find_all(AlarmBanner) == []
    lift()
    assert ui.find(NavItem, name="settings").active
    ui.wait(lambda: ui.find_all(AlarmBanner))


def test_a_tap_on_what_the_banner_has_just_moved_presses_nothing(app, alarms, ui):
    def at(button: CommandButton) -> tuple[float, float]:
        return button.to_window(*button.center)

    def tap_at_once(button: CommandButton) -> None:
        """Without looking first."""
        ui.tap_at(*at(button))
        ui.wait(lambda: app.shell.background.idle)

    button = ui.find(CommandButton, text="Add robot")
    place = at(button)
    alarms.raise_("app_was_off", "app")
    ui.wait(lambda: ui.find_all(AlarmBanner))
    acknowledge = ui.find(CommandButton, ui.find(AlarmBanner), text="Acknowledge")
    assert at(button) != place
    tap_at_once(acknowledge)
    assert alarms.open()
    ui.advance(1)
    ui.tap(acknowledge)
    ui.wait(lambda: not ui.find_all(AlarmBanner))
    assert at(button) == place  # it has moved back
    tap_at_once(button)
    assert app.shell.navigator.current == "home"
    ui.tap(button)
    assert app.shell.navigator.current == "settings"


def test_a_finger_on_its_way_to_one_banner_presses_nothing_of_the_next(container, app, alarms, ui):
    """Who wants to hold what starts in a moment must not release a hold whose message appears as it starts."""
    alarms.raise_("app_was_off", "app")
    ui.wait(lambda: ui.find_all(AlarmBanner))
    ui.advance(2)
    container.holds.hold("Audit")
    ui.wait(lambda: ui.find(AlarmBanner).action == "Release")
    ui.advance()
    button = ui.find(CommandButton, ui.find(AlarmBanner), text="Release")
    ui.tap_at(*button.to_window(*button.center))
    ui.wait(lambda: app.shell.background.idle)
    assert len(container.holds.current()) == 1
    ui.advance(1)
    ui.tap(button)
    ui.wait(lambda: not container.holds.current())


def test_the_second_tap_on_the_banner_is_the_same_press(app, alarms, ui, monkeypatch):
    """It says something else by then, which has not been read."""
    monkeypatch.setattr(controller, "DOUBLE_TAP", 1e3)
    for seconds in (40, 50):
        alarms.raise_("app_was_off", str(seconds))
    ui.wait(lambda: ui.find_all(AlarmBanner) and ui.find(TopBar).bell_count == "2")
    ui.advance(0.5)
    button = ui.find(CommandButton, ui.find(AlarmBanner), text="Acknowledge")
    place = button.to_window(*button.center)
    ui.tap_at(*place)
    ui.wait(lambda: len(alarms.open()) == 1 and ui.find(AlarmBanner).others == "Details")
    ui.tap_at(*place)
    ui.wait(lambda: app.shell.background.idle)
    assert len(alarms.open()) == 1
    ui.skip(1e3)
    ui.tap_at(*place)
    ui.wait(lambda: not alarms.open())


def test_a_hand_that_rests_on_the_screen_keeps_no_alarm_away(app, alarms, ui):
    lift = ui.press(ui.find(NavItem, name="settings"))
    alarms.raise_("clock_stepped", "clock", seconds=40)
    ui.wait(lambda: ui.find_all(AlarmBanner))
    lift()


def test_a_second_tap_after_releasing_a_hold_presses_nothing(container, app, alarms, ui):
    """Late starts are reported together with everything else."""
    for number in range(3):
        alarms.raise_("emergency_stop", f"robot:{70 + number}", robot=f"Robot {number}")
        alarms.acknowledge(alarms.open()[-1].id)
    container.holds.hold("cleaning", None)
    alarms.raise_("app_was_off", "app")
    ui.wait(lambda: ui.find(TopBar).bell_count == "5")
    open_list(ui)
    wait_for_rows(ui, 5)
    ui.wait(lambda: not rest.is_on)
    release = ui.find(CommandButton, ui.find(AlarmsDialog), text="Release")
    place = release.to_window(release.x + 20, release.center_y)  # where other rows have Acknowledge
    ui.tap_at(*place)
    alarms.raise_("executions_missed", "plan", count=4)
    ui.wait(
        lambda: container.holds.active() is None and any("missed" in row.text for row in ui.find(AlarmsDialog).rows)
    )
    ui.advance(0.1)
    before = {alarm.id: alarm.acknowledged_at for alarm in alarms.open()}
    ui.tap_at(*place)
    ui.wait(lambda: app.shell.background.idle)
    assert {alarm.id: alarm.acknowledged_at for alarm in alarms.open()} == before
