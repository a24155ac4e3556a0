"""The list of alarms by taps: acknowledge with a note, shelve and unshelve, ended and past ones, and where each
leads."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import Robot
from app.screens.frame import alarm_list as frame_alarms
from app.screens.frame.alarm_list import AlarmRow, AlarmsDialog, NoteDialog
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.dialogs import Menu
from app.widgets.fields import FormField
from app.widgets.frame import AlarmBanner, NavItem, TopBar
from tests.ui import checks
from tests.ui.alarms.listed import menu, open_list, row, silence, tab, wait_for_rows


# ---------------------------------------------------------------------- acknowledging
def test_an_alarm_is_acknowledged_with_a_note_that_is_shown_afterwards(app, alarms, ui):
    alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    assert row(ui, "Aino").state_words == "Active, not acknowledged"
    menu(ui, row(ui, "Aino"), "Acknowledge with a note")
    ui.type(ui.find(FormField, root=ui.find(NoteDialog)), "Access point is off")
    ui.tap(ui.find(CommandButton, ui.find(NoteDialog), text="Acknowledge"))
    ui.wait(lambda: row(ui, "Aino").state_words == "Active, acknowledged")
    assert row(ui, "Aino").answer.endswith(": Access point is off")
    assert row(ui, "Aino").action == ""
    alarms.clear("unreachable", "robot:77")
    wait_for_rows(ui, 0)
    ui.tap(tab(ui, "past"))
    wait_for_rows(ui, 1)
    assert row(ui, "Aino").state_words == "Over, acknowledged"
    assert "Over since" in row(ui, "Aino").note
    assert row(ui, "Aino").answer.endswith(": Access point is off")


def test_a_note_is_optional_and_can_be_left(app, alarms, ui):
    alarms.raise_("clock_stepped", "clock", seconds=40)
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    menu(ui, row(ui, "clock"), "Acknowledge with a note")
    ui.tap(ui.find(CommandButton, ui.find(NoteDialog), text="Cancel"))
    assert alarms.open()
    menu(ui, row(ui, "clock"), "Acknowledge with a note")
    ui.tap(ui.find(CommandButton, ui.find(NoteDialog), text="Acknowledge"))
    wait_for_rows(ui, 0)
    assert not alarms.open()


def test_recovery_is_shown_until_it_is_acknowledged(app, alarms, ui):
    for _n in range(2):
        alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
        alarms.clear("unreachable", "robot:77")
    ui.wait(lambda: ui.find_all(AlarmBanner) and ui.find(AlarmBanner).note.startswith("Over since"))
    open_list(ui)
    assert row(ui, "Aino").state_words == "Over, not acknowledged"
    assert "2 times, last" in row(ui, "Aino").note
    ui.tap(ui.find(CommandButton, row(ui, "Aino"), text="Acknowledge"))
    wait_for_rows(ui, 0)
    assert "No alarms. Everything is as it should be." in ui.texts(ui.find(AlarmsDialog))
    ui.wait(lambda: not ui.find_all(AlarmBanner))


def test_a_robot_that_is_renamed_carries_its_new_name_in_banner_and_list_at_once(container, app, alarms, ui):
    robot = container.catalogue.save_robot(Robot("Aino", "http://127.0.0.1:9", "u"), password="p")
    alarms.raise_("emergency_stop", f"robot:{robot.id}", robot="Aino")
    ui.wait(lambda: ui.find_all(AlarmBanner))
    open_list(ui)
    container.catalogue.save_robot(replace(container.catalogue.robot(robot.id), name="Alma"))
    ui.wait(lambda: ui.find(AlarmBanner).text.startswith("Alma") and row(ui, "emergency stop").text.startswith("Alma"))


# ---------------------------------------------------------------------- shelving
def test_a_shelved_alarm_leaves_the_banner_and_can_be_unshelved(app, alarms, ui):
    alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
    alarms.raise_("clock_stepped", "clock", seconds=40)
    ui.wait(lambda: ui.find_all(AlarmBanner) and ui.find(AlarmBanner).text == "Aino doesn't answer")
    assert ui.find(AlarmBanner).others == "+1 more"
    open_list(ui)
    wait_for_rows(ui, 2)
    menu(ui, row(ui, "Aino"), "Shelve for 4 hours")
    wait_for_rows(ui, 1)
    ui.wait(lambda: "clock" in ui.find(AlarmBanner).text)
    assert ui.find(AlarmBanner).others == "Details"
    assert ui.find(TopBar).bell_count == "1"
    ui.tap(tab(ui, "shelved"))
    assert row(ui, "Aino").state_words.startswith("Shelved until ")
    assert tab(ui, "shelved").text == "Shelved (1)"
    ui.tap(ui.find(CommandButton, row(ui, "Aino"), text="Unshelve"))
    wait_for_rows(ui, 0)
    ui.wait(lambda: ui.find(AlarmBanner).text == "Aino doesn't answer")


def test_a_shelved_alarm_comes_back_by_itself(container, app, alarms, ui):
    alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
    alarms.shelve(alarms.open()[0].id, 1)
    ui.wait(lambda: ui.find(TopBar).bell_icon == "bell-sleep-outline")
    assert not ui.find_all(AlarmBanner)
    container.clock.advance(3601)
    ui.advance(1.1)  # the frame looks once a second
    assert ui.find(AlarmBanner).text == "Aino doesn't answer"
    assert ui.find(TopBar).bell_icon == "bell-ring-outline"


def test_the_bell_forgets_a_shelved_alarm_that_is_over(app, alarms, ui):
    alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
    alarms.shelve(alarms.open()[0].id, 1)
    ui.wait(lambda: ui.find(TopBar).bell_icon == "bell-sleep-outline")
    alarms.clear("unreachable", "robot:77")
    ui.wait(lambda: (ui.find(TopBar).bell_icon, ui.find(TopBar).bell_count) == ("bell-outline", ""))


def test_nothing_is_said_to_be_as_it_should_be_while_an_alarm_is_shelved(app, alarms, ui):
    alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
    alarms.shelve(alarms.open()[0].id, 1)
    ui.wait(lambda: ui.find(TopBar).bell_icon == "bell-sleep-outline")
    dialog = open_list(ui)
    assert dialog.empty == "Nothing else is open. What is shelved comes back by itself."


# ---------------------------------------------------------------------- one cause
def test_robots_that_fall_silent_together_share_one_row_that_lists_them(app, alarms, ui):
    silence(alarms, ui)
    assert ui.find(TopBar).bell_count == "1"
    open_list(ui)
    wait_for_rows(ui, 1)
    ui.tap(ui.find(IconButton, row(ui, "Wi-Fi"), icon="chevron-down"))
    wait_for_rows(ui, 7)
    assert checks.problems(ui.find(AlarmsDialog)) == []
    ui.tap(ui.find(IconButton, row(ui, "Wi-Fi"), icon="chevron-up"))
    wait_for_rows(ui, 1)


def test_the_banner_of_a_group_leads_to_its_robots(app, alarms, ui):
    silence(alarms, ui)
    ui.advance(0.3)
    ui.tap(ui.find(CommandButton, ui.find(AlarmBanner), text="Show all"))
    wait_for_rows(ui, 7)


def test_a_group_is_acknowledged_shelved_and_unshelved_at_once(app, alarms, ui):
    silence(alarms, ui)
    open_list(ui)
    menu(ui, row(ui, "Wi-Fi"), "Shelve for 4 hours")
    wait_for_rows(ui, 0)
    ui.tap(tab(ui, "shelved"))
    wait_for_rows(ui, 1)
    ui.tap(ui.find(CommandButton, row(ui, "Wi-Fi"), text="Unshelve"))
    wait_for_rows(ui, 0)
    ui.tap(tab(ui, "open"))
    wait_for_rows(ui, 1)
    ui.tap(ui.find(CommandButton, row(ui, "Wi-Fi"), text="Acknowledge"))
    ui.wait(lambda: row(ui, "Wi-Fi").state_words == "Active, acknowledged")
    assert all(alarm.acknowledged_at for alarm in alarms.open())


# ---------------------------------------------------------------------- the past
def test_the_past_is_read_page_by_page_as_it_is_scrolled_with_its_count(app, alarms, ui, monkeypatch):
    monkeypatch.setattr(frame_alarms, "PAGE", 12)
    for number in range(30):
        alarms.raise_("app_was_off", str(number))
    for alarm in alarms.open():
        alarms.acknowledge(alarm.id)
    ui.wait(lambda: ui.find(TopBar).bell_count == "")
    dialog = open_list(ui)
    ui.tap(tab(ui, "past"))
    for count, words in ((12, "The newest 12 of 30"), (24, "The newest 24 of 30"), (30, "30 past alarms")):
        ui.wait(lambda count=count: len(dialog.rows) == count)
        ui.advance(1)
        assert (len(dialog.rows), dialog.count) == (count, words)  # no more is read than is looked at
        assert len(ui.find_all(AlarmRow)) < 12
        assert checks.problems(dialog) == []
        dialog.ids.alarm_rows.scroll_y = 0


# ---------------------------------------------------------------------- holds, and the way to where it is solved
def test_a_hold_is_in_the_list_and_is_released_there(container, app, ui):
    container.holds.hold("Fire drill")
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    ui.tap(ui.find(CommandButton, row(ui, "Nothing is sent"), text="Release"))
    wait_for_rows(ui, 0)
    assert not container.holds.active()


@pytest.mark.parametrize(
    ("code", "key", "screen"),
    [
        ("unauthorized", "robot:{robot}", "settings"),
        ("unreachable", "robot:{robot}", "home"),
        ("executions_missed", "plan", "logs"),
        ("execution_failed", "schedule:1", "logs"),
        ("unknown_outcome", "execution:1", "logs"),
        ("backup_failed", "backup", "settings"),
    ],
)
def test_the_banner_leads_to_where_it_is_solved(container, app, alarms, ui, code, key, screen):
    robot = container.catalogue.save_robot(Robot("Aino", "http://127.0.0.1:9", "u", enabled=False), password="p")
    ui.tap(ui.find(NavItem, name="scheduler"))
    alarms.raise_(code, key.format(robot=robot.id), robot="Aino", mission="Home", reason="x", problem="x", count=2)
    ui.wait(lambda: ui.find_all(AlarmBanner))
    ui.advance(0.3)  # it stands where it is tapped
    ui.tap(ui.find(CommandButton, ui.find(AlarmBanner), text=ui.find(AlarmBanner).action))
    ui.wait(lambda: app.shell.navigator.current == screen)
    assert alarms.open()  # going there acknowledges nothing


def test_the_menu_says_which_alarm_it_is_about(app, alarms, ui):
    alarms.raise_("executions_missed", "plan", count=4)
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    about = row(ui, "missed")
    ui.tap(ui.find(IconButton, about, icon="dots-vertical"))
    ui.advance(0.3)
    assert ui.texts(ui.find(Menu))[0] == about.text


def test_the_menu_leads_there_too_and_closes_the_list(app, alarms, ui):
    alarms.raise_("executions_missed", "plan", count=4)
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    menu(ui, row(ui, "missed"), "Show in Logs")
    ui.wait(lambda: app.shell.navigator.current == "logs")
    assert not ui.find_all(AlarmsDialog)
    ui.wait(lambda: ui.find(AlarmBanner).action == "Acknowledge")  # where one is already


def test_when_nothing_can_be_written_the_alarm_says_where_to_look(app, alarms, ui):
    alarms.database_fails("disk full")
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    assert not ui.find_all(IconButton, icon="dots-vertical")
    ui.tap(ui.find(CommandButton, row(ui, "database"), text="Open settings"))
    ui.wait(lambda: app.shell.navigator.current == "settings")
