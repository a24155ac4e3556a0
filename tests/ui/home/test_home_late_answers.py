"""What an operator does on Home between a press and a late answer of the robot: on real services and a simulated robot."""

from __future__ import annotations

from dataclasses import replace
from threading import Event

import pytest

from app.domain.models import Group, InvalidInput
from app.domain.robot import MissionParameter
from app.screens.home.cards import SendTile
from app.screens.home.sending import SendSheet
from app.widgets.buttons import ChoiceChip, CommandButton
from app.widgets.flow import ParameterFields
from app.widgets.sheet import AskSheet
from tests.ui.home.operator import (
    QUEUE,
    choose,
    is_shown_pending,
    is_shown_running,
    items,
    open_robot,
    pend,
    press,
    rows,
    run,
    tap_cancel,
)
from tests.ui.whole_app import GUIDS, api

pytestmark = pytest.mark.long


def open_before_it_is_known_what_is_asked_for(home, ui, mission: str, seconds: float = 4.0) -> None:
    """The button of its sheet is busy until the robot's late answer."""
    home.site.add_missions(mission)
    fault = {"kind": "late", "method": "GET", "path": f"/missions/{GUIDS[mission]}", "count": None, "seconds": seconds}
    home.aino.control({"fault": fault})
    ui.wait(lambda: ui.find_all(SendTile, text=mission))
    ui.tap(ui.find(SendTile, text=mission))
    ui.wait(lambda: ui.find_all(CommandButton, text="Run on Aino", busy=True))


@pytest.fixture
def group(home) -> Group:
    catalogue = home.site.container.catalogue
    return catalogue.save_group(Group("Fleet", tuple(robot.id for robot in catalogue.robots())))


def test_nothing_is_sent_until_it_is_known_what_is_asked_for(home, ui):
    open_before_it_is_known_what_is_asked_for(home, ui, "Charge to 80 %", 2.5)
    ui.advance(0.7)
    assert "Asking Aino …" in ui.texts(ui.find(SendSheet))
    press(ui, "Run on Aino")
    assert not home.site.container.history.open()
    ui.wait(lambda: ui.find_all(CommandButton, text="Run on Aino", busy=False, disabled=False))
    press(ui, "Run on Aino")
    ui.wait(lambda: len(home.site.container.history.open()) == 1)


def leave(home, _ui) -> None:
    home.shell.go("logs")


def go_back_to_all_robots(home, _ui) -> None:
    home.root_vm.fleet.many = True
    home.root_vm.fleet.come_back()


def choose_another_robot(_home, ui) -> None:
    open_robot(ui, "Veikko")


@pytest.mark.parametrize("act", [leave, choose_another_robot, go_back_to_all_robots])
def test_a_sheet_closes_with_the_page_of_its_robot(home, ui, act):
    open_before_it_is_known_what_is_asked_for(home, ui, "Deliver kits to line 2", 0.1)
    act(home, ui)
    ui.wait(lambda: not ui.find_all(SendSheet))
    ui.wait(lambda: home.shell.background.idle)
    assert not home.site.container.history.open()


def test_a_robot_that_stops_turns_the_button_of_the_sheet_off_and_says_why(home, ui):
    open_before_it_is_known_what_is_asked_for(home, ui, "Return to charger", 0.1)
    home.aino.control({"emergency_stop": True})
    ui.wait(lambda: "Not while Aino is stopped" in ui.texts(ui.find(SendSheet)))
    assert ui.find(CommandButton, text="Run on Aino").disabled


def test_what_was_entered_stays_when_the_robot_answers_otherwise(home, ui):
    choose(ui, "Home")
    sheet, pallets = ui.find(SendSheet), MissionParameter("count", "Pallets", "text")
    sheet.take((pallets,))
    ui.advance(0.2)
    ui.find(ParameterFields, sheet).children[0].text = "seven"
    ui.advance(0.2)
    sheet.take((MissionParameter("dock", "Dock", "text", "3"), pallets))
    ui.advance(0.2)
    assert ui.find(ParameterFields, sheet).values() == {"dock": "3", "count": "seven"}
    sheet.draft = False
    home.shell.sheets.close(sheet)


def test_a_position_that_the_robot_does_not_list_is_no_longer_chosen(home, ui):
    choose(ui, "Home")
    sheet, dock = ui.find(SendSheet), MissionParameter("goal", "Goal", choices=(("g-1", "Dock"),), sets="position")
    sheet.take((dock,))
    ui.advance(0.2)
    ui.find(ParameterFields, sheet).children[0].chosen = "g-1"
    ui.wait(lambda: ui.find_all(CommandButton, text="Run on Aino", disabled=False))
    sheet.take((replace(dock, choices=(("g-2", "Press"),)),))
    ui.wait(lambda: ui.find_all(CommandButton, text="Run on Aino", disabled=True))
    assert ui.find(ParameterFields, sheet).values() == {"goal": None}
    sheet.draft = False
    home.shell.sheets.close(sheet)


def test_a_start_that_already_runs_is_stopped_only_after_the_question(home, ui):
    catalogue = home.site.container.catalogue
    pend(home)
    run(ui, "Deliver")
    ui.wait(lambda: is_shown_pending(ui))
    tap_cancel(ui)
    ui.wait(lambda: ui.find_all(AskSheet))
    catalogue.save_robot(replace(home.root_vm.facts.robot, name="Aino 2"))
    api(home.aino, "PUT", "/status", state_id=3)
    ui.wait(lambda: is_shown_running(ui) and home.root_vm.facts.robot.name == "Aino 2")
    press(ui, "Cancel mission")
    assert "Cancel Deliver?" in ui.texts()
    press(ui, "Keep")
    assert home.aino.state()["queue"][-1]["state"] == "Executing"


def test_a_cancellation_is_reported_although_a_start_with_that_number_failed(home, ui, monkeypatch):
    def fail(_execution_id: int) -> None:
        raise InvalidInput("execution", "it has ended")

    pend(home)
    number = api(home.aino, "POST", "/mission_queue", mission_id=GUIDS["Home"]).json()["id"]
    ui.wait(lambda: [item.key for item in items(ui, *QUEUE)] == [("item", number)])
    home.aino.control(
        {"fault": {"kind": "late", "path": f"/mission_queue/{number}", "method": "DELETE", "count": 1, "seconds": 6.0}}
    )
    tap_cancel(ui)
    press(ui, "Cancel mission")
    ui.wait(lambda: "Being cancelled" in dict(rows(ui)).values())
    monkeypatch.setattr(home.site.container.operator, "cancel_execution", fail)
    home.root_vm._cancel(home.root_vm.facts.robot, ("execution", number), "Deliver")
    ui.wait(lambda: ("execution", number) not in home.root_vm.busy)
    home.root_vm.take(home.root_vm.facts)  # as when it is read again
    ui.advance()
    assert "Being cancelled" in dict(rows(ui)).values()


def test_a_sheet_is_for_the_robot_when_the_group_was_deleted(home, ui, group):
    ui.wait(lambda: home.root_vm.facts.groups)
    choose(ui, "Home")
    ui.tap(ui.find(ChoiceChip, text="Any of Fleet"))
    home.site.container.catalogue.remove_group(group.id)
    ui.wait(lambda: ui.find_all(CommandButton, text="Run on Aino"))
    assert not ui.find_all(ChoiceChip, text="Any of Fleet")
    ui.advance(0.7)
    press(ui, "Run on Aino")
    ui.wait(lambda: home.shell.snackbars.texts)
    assert home.shell.snackbars.texts == ["Home is sent to Aino"]


def test_a_cross_of_a_row_removed_in_the_same_frame_does_nothing(home, ui):
    home.root_vm.cancel(("item", 999_999))
    ui.wait(lambda: home.shell.background.idle)
    assert home.shell.snackbars.texts == []


def test_a_mission_for_another_robot_is_sent_while_one_is_still_being_stored(home, ui, monkeypatch):
    operator, goes_on, run_now = home.site.container.operator, Event(), home.site.container.operator.run_now

    def late(*args: object) -> object:
        goes_on.wait(30)
        return run_now(*args)

    monkeypatch.setattr(operator, "run_now", late)
    try:
        run(ui, "Deliver")
        choose(ui, "Deliver")
        ui.advance(0.7)
        press(ui, "Run on Aino")  # the same one: nothing is sent, and the sheet stays
        ui.advance(0.7)
        assert ui.find_all(SendSheet)
        open_robot(ui, "Veikko")
        ui.wait(lambda: home.root_vm.view.card.name == "Veikko" and ui.find_all(SendTile, text="Deliver"))
        ui.tap(ui.find(SendTile, text="Deliver"))
        ui.wait(lambda: ui.find_all(CommandButton, text="Run on Veikko", busy=False))
        ui.advance(0.7)
        press(ui, "Run on Veikko")
        assert not ui.find_all(SendSheet)
    finally:
        goes_on.set()
    ui.wait(lambda: sorted(run.robot for run in home.site.container.history.open()) == ["Aino", "Veikko"])
