"""Home as an operator uses it: what is seen, which robot it is about, and where its lists lead."""

from __future__ import annotations

import threading
from datetime import timedelta
from zoneinfo import ZoneInfo

from app.database.connection import DatabaseUnavailable
from app.domain.models import Mission, Schedule
from app.screens.home import screen
from app.screens.home.cards import SendTile, TodayRow
from app.screens.home.facts import HomeFacts, read
from app.screens.scheduler.cards import FormSheet
from app.widgets.buttons import CommandButton
from app.widgets.frame import Banner
from tests.support.history import last_ended
from tests.ui.home.operator import items, open_robot, run, step, tab


# ---------------------------------------------------------------------- what is seen
def test_each_robot_has_a_tab_and_the_card_is_of_the_selected_one(home, ui):
    assert [tab(ui, name).active for name in ("Aino", "Veikko")] == [True, False]
    assert {"Aino", "Ready", "90 %", "Send Aino", "Today"} <= set(ui.texts())


def test_an_emergency_stop_shows_within_a_poll_with_advice(home, ui):
    home.aino.control({"emergency_stop": True})
    ui.wait(lambda: "Release the red button. Then press Reset on the robot." in ui.texts())
    assert not ui.find_all(Banner)
    assert ui.find(CommandButton, text="Resume").disabled
    assert "Not while Aino is stopped" in ui.texts()
    assert ui.find(SendTile, text="Home").disabled
    home.aino.control({"emergency_stop": False})
    ui.wait(lambda: "Paused" in ui.texts())
    step(ui, "Resume")
    ui.wait(lambda: "Ready" in ui.texts())


# ---------------------------------------------------------------------- which robot
def test_a_tab_selects_the_robot_for_the_whole_app_before_the_choice_is_stored(home, ui, monkeypatch):
    stored, write = threading.Event(), home.site.container.catalogue.change_settings
    monkeypatch.setattr(
        home.site.container.catalogue, "change_settings", lambda **values: stored.wait(30) and write(**values)
    )
    try:
        open_robot(ui, "Veikko")
        assert (home.root_vm.view.card.name, tab(ui, "Veikko").active) == ("Veikko", True)
        ui.advance(3)
        assert (home.root_vm.view.card.name, tab(ui, "Veikko").active) == ("Veikko", True)
    finally:
        stored.set()
    ui.wait(lambda: home.site.container.settings().selected_robot_id == home.root_vm.facts.robot.id)


def test_missions_of_another_robot_are_not_offered_on_the_one_just_chosen(home, ui):
    """It arrives before the choice is in the database."""
    view, veikko = home.root_vm, next(robot for robot in home.root_vm.facts.robots if robot.name == "Veikko")
    read = view.facts
    view.select_robot(veikko.id)
    view.take(read)
    assert (view.facts.robot, {tile.text for tile in view.view.tiles}) == (veikko, {""})
    ui.wait(lambda: view.facts.missions)
    assert view.facts.robot == veikko


def test_a_reading_that_began_before_a_choice_does_not_undo_it(home, ui, monkeypatch):
    """Even if it arrives late: the other robot would be under a finger about to press Run."""
    view, container, begun, go, seen = home.root_vm, home.site.container, threading.Event(), threading.Event(), []

    def read_late(*args: object) -> HomeFacts:
        facts = read(*args)
        if not begun.is_set():
            begun.set()
            assert go.wait(20)
        return facts

    monkeypatch.setattr(screen, "read", read_late)
    view.open()
    ui.wait(begun.is_set)
    open_robot(ui, "Veikko")
    veikko = view.facts.robot
    ui.wait(lambda: container.settings().selected_robot_id == veikko.id and "robot" not in view.busy)
    go.set()
    ui.wait(lambda: seen.append(view.facts.robot) or (view.facts.missions and len(seen) > 20))
    assert set(seen) == {veikko}


def test_a_plan_that_was_being_read_when_a_command_was_done_is_read_again(home, ui, monkeypatch):
    view, container, begun, go = home.root_vm, home.site.container, threading.Event(), threading.Event()

    def read_late(services: object, known: HomeFacts | None = None, *args: object) -> HomeFacts:
        facts = read(services, known, *args)
        if known is None and not begun.is_set():
            begun.set()
            assert go.wait(20)
        return facts

    monkeypatch.setattr(screen, "read", read_late)
    mission = container.catalogue.save_mission(Mission("Quite new", "00000000-0000-0000-0000-0000000000aa"))
    ui.wait(begun.is_set)
    view.act_once("action", lambda: None)
    ui.wait(lambda: "action" not in view.busy)
    go.set()
    ui.wait(lambda: mission.id in [each.id for each in view.facts.missions], 10)
    container.catalogue.remove_mission(mission.id)


def test_a_choice_of_a_robot_that_can_not_be_written_is_undone(home, ui, monkeypatch):
    def fail(**_changes: object) -> None:
        raise DatabaseUnavailable("the disk is full")

    view, aino = home.root_vm, home.root_vm.facts.robot
    monkeypatch.setattr(home.site.container.catalogue, "change_settings", fail)
    open_robot(ui, "Veikko")
    ui.wait(lambda: home.shell.snackbars.texts)
    ui.wait(lambda: view.facts.robot == aino and view.facts.missions)


# ---------------------------------------------------------------------- where lists lead
def test_an_ended_run_opens_its_story_in_logs(home, ui):
    run(ui, "Home")
    ui.wait(lambda: items(ui, "run"))
    (execution,) = last_ended(home.site.container, 1)
    ui.tap(ui.find(TodayRow, key=("run", execution.id)))
    assert home.shell.navigator.current == "logs"
    ui.wait(lambda: home.shell.navigator.screen("logs").vm.story.words.key == execution.id)


def test_a_planned_start_opens_its_schedule(home, ui):
    robots, missions = home.root_vm.facts.robots, home.root_vm.facts.missions
    tomorrow = home.site.container.clock.now() + timedelta(days=1)
    zone = home.site.container.settings().timezone
    for hour, mission in ((6, missions[0]), (7, missions[1])):
        start = tomorrow.astimezone(ZoneInfo(zone)).replace(hour=hour, minute=0, second=0, microsecond=0, tzinfo=None)
        home.site.container.catalogue.save_schedule(
            Schedule(mission.name, robots[0].id, mission.id, start, zone, "FREQ=DAILY", respect_working_days=False)
        )
    ui.wait(lambda: len({item.title for item in items(ui, "planned")}) == 2)
    row = next(row for row in ui.find_all(TodayRow) if row.item.title == missions[1].name)
    schedule_id = row.key[1]
    ui.tap(row)
    assert home.shell.navigator.current == "scheduler"
    plan = home.shell.navigator.screen("scheduler").vm
    ui.wait(lambda: plan.form.editing == schedule_id)
    assert ui.find_all(FormSheet)
    ui.advance(0.2)  # the form asks for its forecast a moment later: not of an app that has ended
    ui.wait(lambda: home.shell.background.idle)
