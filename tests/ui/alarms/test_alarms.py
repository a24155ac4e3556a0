"""The page of alarms by taps: acknowledge with a note, shelve and unshelve, ended and past ones, and where each
leads."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import Robot
from app.screens.common.presses import DOUBLE_TAP
from app.screens.frame import alarms as frame_alarms
from app.screens.frame.alarms import AlarmsScreen, NoteSheet
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.fields import Field
from app.widgets.frame import Banner, TopBar
from app.widgets.list_row import ListRow
from app.widgets.menu import Menu
from app.widgets.places import places
from tests.ui import checks
from tests.ui.alarms.listed import fold, menu, open_list, press, row, silence, tab, wait_for_rows


# ---------------------------------------------------------------------- acknowledging
def test_an_alarm_is_acknowledged_with_a_note_that_is_shown_afterwards(app, alarms, ui):
    alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    assert row(ui, "Aino").item.strong
    menu(ui, row(ui, "Aino"), "Acknowledge with a note")
    ui.type(ui.find(Field, root=ui.find(NoteSheet)), "Access point is off")
    ui.tap(ui.find(CommandButton, ui.find(NoteSheet), text="Acknowledge"))
    ui.wait(lambda: row(ui, "Aino").item.support.endswith(": “Access point is off”"))
    assert not ui.find_all(CommandButton, row(ui, "Aino"), text="Acknowledge")
    alarms.clear("unreachable", "robot:77")
    wait_for_rows(ui, 0)
    ui.tap(tab(ui, "past"))
    wait_for_rows(ui, 1)
    assert row(ui, "Aino").item.support.startswith("Over since")
    assert row(ui, "Aino").item.support.endswith(": “Access point is off”")


def test_a_note_is_optional_and_can_be_left(app, alarms, ui):
    alarms.raise_("clock_stepped", "clock", seconds=40)
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    menu(ui, row(ui, "clock"), "Acknowledge with a note")
    ui.tap(ui.find(IconButton, ui.find(NoteSheet), icon="close"))
    ui.advance(DOUBLE_TAP)
    assert alarms.open()
    menu(ui, row(ui, "clock"), "Acknowledge with a note")
    ui.tap(ui.find(CommandButton, ui.find(NoteSheet), text="Acknowledge"))
    wait_for_rows(ui, 0)
    assert not alarms.open()


def test_recovery_is_shown_until_it_is_acknowledged(app, alarms, ui):
    for _n in range(2):
        alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
        alarms.clear("unreachable", "robot:77")
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    page = open_list(ui)
    assert row(ui, "Aino").item.support.startswith("Over since")
    assert "2 times, last" in row(ui, "Aino").item.support
    press(ui, row(ui, "Aino"), "Acknowledge")
    wait_for_rows(ui, 0)
    assert "No alarms" in ui.texts(page)
    ui.wait(lambda: ui.find(TopBar).bell_count == "")


def test_a_robot_that_is_renamed_carries_its_new_name_at_once(container, app, alarms, ui):
    robot = container.catalogue.save_robot(Robot("Aino", "http://127.0.0.1:9", "u"), password="p")
    alarms.raise_("emergency_stop", f"robot:{robot.id}", robot="Aino")
    open_list(ui)
    wait_for_rows(ui, 1)
    container.catalogue.save_robot(replace(container.catalogue.robot(robot.id), name="Alma"))
    ui.wait(lambda: row(ui, "Emergency stop").item.whole.startswith("Alma"))


# ---------------------------------------------------------------------- shelving
def test_a_shelved_alarm_leaves_the_banner_and_can_be_unshelved(app, alarms, ui):
    app.shell.go("scheduler")
    alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
    ui.wait(lambda: ui.find_all(Banner, text="Aino: no answer"))
    open_list(ui)
    menu(ui, row(ui, "Aino"), "Shelve for 4 hours")
    wait_for_rows(ui, 0)
    assert ui.find(TopBar).bell_count == ""
    ui.tap(tab(ui, "shelved"))
    assert row(ui, "Aino").item.support.startswith("Shelved until ")
    assert tab(ui, "shelved").tab.count == 1
    app.shell.go("scheduler")
    ui.wait(lambda: not ui.find_all(Banner))
    open_list(ui)
    ui.tap(tab(ui, "shelved"))
    press(ui, row(ui, "Aino"), "Unshelve")
    wait_for_rows(ui, 0)
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")


def test_a_shelved_alarm_comes_back_by_itself(container, app, alarms, ui):
    alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
    alarms.shelve(alarms.open()[0].id, 1)
    ui.wait(lambda: ui.find(TopBar).bell_icon == "bell-sleep-outline")
    container.clock.advance(3601)
    ui.advance(1.1)  # the frame looks once a second
    assert (ui.find(TopBar).bell_icon, ui.find(TopBar).bell_count) == ("bell-ring-outline", "1")


def test_the_bell_forgets_a_shelved_alarm_that_is_over(app, alarms, ui):
    alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
    alarms.shelve(alarms.open()[0].id, 1)
    ui.wait(lambda: ui.find(TopBar).bell_icon == "bell-sleep-outline")
    alarms.clear("unreachable", "robot:77")
    ui.wait(lambda: (ui.find(TopBar).bell_icon, ui.find(TopBar).bell_count) == ("bell-outline", ""))


# ---------------------------------------------------------------------- one cause
def test_robots_that_fall_silent_together_share_one_row_that_lists_them(app, alarms, ui):
    silence(alarms, ui)
    page = open_list(ui)
    wait_for_rows(ui, 1)
    fold(ui, row(ui, "6 robots"))
    wait_for_rows(ui, 7)
    assert checks.problems(page) == []
    fold(ui, row(ui, "6 robots"))
    wait_for_rows(ui, 1)


def test_the_banner_of_a_group_leads_to_its_robots(app, alarms, ui):
    app.shell.go("scheduler")
    silence(alarms, ui)
    ui.wait(lambda: ui.find_all(Banner) and not places.has_just_moved(ui.find(Banner)))
    ui.tap(ui.find(CommandButton, ui.find(Banner), text="Show"))
    wait_for_rows(ui, 7)


def test_a_group_is_acknowledged_shelved_and_unshelved_at_once(app, alarms, ui):
    silence(alarms, ui)
    open_list(ui)
    menu(ui, row(ui, "6 robots"), "Shelve for 4 hours")
    wait_for_rows(ui, 0)
    ui.tap(tab(ui, "shelved"))
    wait_for_rows(ui, 1)
    press(ui, row(ui, "6 robots"), "Unshelve")
    wait_for_rows(ui, 0)
    ui.tap(tab(ui, "open"))
    wait_for_rows(ui, 1)
    press(ui, row(ui, "6 robots"), "Acknowledge 6")
    ui.wait(lambda: all(alarm.acknowledged_at for alarm in alarms.open()))
    ui.wait(
        lambda: [each.whole for each in ui.find(AlarmsScreen).vm.rows if not each.strong] == ["6 robots · No answer"]
    )


# ---------------------------------------------------------------------- the past
def test_the_past_is_read_page_by_page_as_it_is_scrolled_with_its_count(app, alarms, ui, monkeypatch):
    monkeypatch.setattr(frame_alarms, "PAGE", 12)
    for number in range(30):
        alarms.raise_("app_was_off", str(number))
    for alarm in alarms.open():
        alarms.acknowledge(alarm.id)
    ui.wait(lambda: ui.find(TopBar).bell_count == "")
    page = open_list(ui)
    ui.tap(tab(ui, "past"))
    for count, words in ((12, "The newest 12 of 30"), (24, "The newest 24 of 30"), (30, "30 past alarms")):
        ui.wait(lambda count=count: len(page.vm.rows) == count)
        ui.advance(1)
        assert (len(page.vm.rows), page.vm.head) == (count, words)  # no more is read than is looked at
        assert len(ui.find_all(ListRow)) < 14
        assert checks.problems(page) == []
        page.ids.alarm_rows.scroll_y = 0


# ---------------------------------------------------------------------- the way to where it is solved
def test_the_arrow_leads_back_to_where_the_bell_was_tapped(app, ui):
    app.shell.go("logs")
    open_list(ui)
    ui.tap(ui.find(TopBar).ids.back)
    assert app.shell.navigator.current == "logs"


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
def test_its_button_leads_to_where_it_is_solved(container, app, alarms, ui, code, key, screen):
    robot = container.catalogue.save_robot(Robot("Aino", "http://127.0.0.1:9", "u", enabled=False), password="p")
    alarms.raise_(code, key.format(robot=robot.id), robot="Aino", mission="Home", reason="x", problem="x", count=2)
    open_list(ui)
    wait_for_rows(ui, 1)
    ui.tap(ui.find_all(CommandButton, ui.find(ListRow))[-1])
    ui.wait(lambda: app.shell.navigator.current == screen)
    assert alarms.open()  # going there acknowledges nothing


def test_the_menu_says_which_alarm_it_is_about(app, alarms, ui):
    alarms.raise_("executions_missed", "plan", count=4)
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    about = row(ui, "missed")
    ui.tap(ui.find(IconButton, about, icon="dots-vertical"))
    ui.advance(0.3)
    assert ui.texts(ui.find(Menu))[0] == about.item.whole


def test_when_nothing_can_be_written_the_alarm_says_where_to_look(app, alarms, ui):
    alarms.database_fails("disk full")
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    assert not ui.find_all(IconButton, icon="dots-vertical")
    press(ui, row(ui, "database"), "Open settings")
    ui.wait(lambda: app.shell.navigator.current == "settings")
