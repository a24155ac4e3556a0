"""What an operator does on Home between a press and a late answer of the robot: on real services and a simulated robot."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import Group, InvalidInput
from app.screens.home.run_dialog import RunDialog
from app.widgets.buttons import ChoiceChip, CommandButton, IconButton
from app.widgets.dialogs import ConfirmDialog
from app.widgets.rows import QueueRow, RobotChip
from tests.ui.home.operator import choose, is_shown_pending, is_shown_running, pend, press, run
from tests.ui.whole_app import GUIDS, api

pytestmark = pytest.mark.long

NOT_KNOWN = "was not started on Aino. The values that it asks for were not known yet"


def press_run_before_it_is_known_what_is_asked_for(home, ui, mission: str, seconds: float = 4.0) -> None:
    """The button is busy until the robot's late answer."""
    home.site.add_missions(mission)
    fault = {"kind": "late", "method": "GET", "path": f"/missions/{GUIDS[mission]}", "count": None, "seconds": seconds}
    home.aino.control({"fault": fault})
    ui.wait(lambda: ui.find_all(ChoiceChip, text=mission))
    run(ui, mission)
    assert ui.find(CommandButton, text="Run on Aino").busy


@pytest.fixture
def group(home) -> Group:
    catalogue = home.site.container.catalogue
    return catalogue.save_group(Group("Fleet", tuple(robot.id for robot in catalogue.robots())))


def test_run_is_busy_until_it_is_known_that_nothing_is_asked_for(home, ui):
    press_run_before_it_is_known_what_is_asked_for(home, ui, "Charge to 80 %", 2.5)
    ui.tap(ui.find(CommandButton, text="Run on Aino"))
    ui.wait(lambda: home.site.container.history.open() and home.root_vm.busy == [])
    assert len(home.site.container.history.open()) == 1


def leave(home, ui) -> None:
    """And come back before the robot answers."""
    home.shell.go("logs")
    ui.advance()
    home.shell.go("home")


def go_back_to_all_robots(home, _ui) -> None:
    home.root_vm.fleet.many = True
    home.root_vm.fleet.come_back()


def choose_another_robot(_home, ui) -> None:
    ui.tap(ui.find(RobotChip, name="Veikko"))


def choose_another_mission(_home, ui) -> None:
    choose(ui, "Deliver")


@pytest.mark.parametrize(
    ("act", "mission"),
    [
        (leave, "Deliver kits to line 2"),
        (choose_another_robot, "Bring pallet to dock"),
        (choose_another_mission, "Waste to compactor"),
        (go_back_to_all_robots, "Wait at home"),
    ],
)
def test_run_waiting_for_the_robot_ends_with_a_message_when_the_choice_changes(home, ui, act, mission):
    press_run_before_it_is_known_what_is_asked_for(home, ui, mission)
    act(home, ui)
    ui.wait(lambda: f"{mission} {NOT_KNOWN}" in home.shell.snackbars.texts)
    assert "run" not in home.root_vm.busy
    ui.wait(lambda: home.shell.background.idle)
    assert not home.site.container.history.open()


def test_run_waiting_for_the_robot_starts_nothing_on_a_group_chosen_later(home, ui, group):
    press_run_before_it_is_known_what_is_asked_for(home, ui, "Move coils to press")
    ui.tap(ui.find(ChoiceChip, text="Any of Fleet"))
    ui.wait(lambda: f"Move coils to press {NOT_KNOWN}" in home.shell.snackbars.texts)
    ui.wait(lambda: home.shell.background.idle)
    assert not home.site.container.history.open()


def test_run_waiting_for_a_robot_says_when_the_robot_is_stopped(home, ui):
    press_run_before_it_is_known_what_is_asked_for(home, ui, "Return to charger")
    home.aino.control({"emergency_stop": True})
    ui.wait(lambda: "Return to charger was not started on Aino. Aino is stopped" in home.shell.snackbars.texts)
    assert not home.site.container.history.open()


def test_a_start_that_already_runs_is_stopped_only_after_the_question(home, ui):
    catalogue = home.site.container.catalogue
    pend(home)
    run(ui, "Deliver")
    ui.wait(lambda: is_shown_pending(ui))
    ui.tap(ui.find(IconButton, ui.find(QueueRow)))
    ui.wait(lambda: ui.find_all(ConfirmDialog))
    catalogue.save_robot(replace(home.root_vm.facts.robot, name="Aino 2"))
    api(home.aino, "PUT", "/status", state_id=3)
    ui.wait(lambda: is_shown_running(ui) and home.root_vm.facts.robot.name == "Aino 2")
    press(ui, "Cancel it")
    assert "Stop Deliver?" in ui.texts()
    press(ui, "Let it run")
    assert home.aino.state()["queue"][-1]["state"] == "Executing"


def test_a_cancellation_is_reported_although_a_start_with_that_number_failed(home, ui, monkeypatch):
    def fail(_execution_id: int) -> None:
        raise InvalidInput("execution", "it has ended")

    pend(home)
    number = api(home.aino, "POST", "/mission_queue", mission_id=GUIDS["Home"]).json()["id"]
    ui.wait(lambda: [row.key for row in ui.find_all(QueueRow)] == [("item", number)])
    home.aino.control(
        {"fault": {"kind": "late", "path": f"/mission_queue/{number}", "method": "DELETE", "count": 1, "seconds": 6.0}}
    )
    ui.tap(ui.find(IconButton, ui.find(QueueRow)))
    press(ui, "Cancel it")
    ui.wait(lambda: "Being cancelled" in ui.texts(ui.find(QueueRow)))
    monkeypatch.setattr(home.site.container.operator, "cancel_execution", fail)
    home.root_vm._cancel(home.root_vm.facts.robot, ("execution", number), "Deliver")
    ui.wait(lambda: ("execution", number) not in home.root_vm.busy)
    home.root_vm.take(home.root_vm.facts)  # as when it is read again
    ui.advance()
    assert "Being cancelled" in ui.texts(ui.find(QueueRow))


def test_choosing_a_group_again_clears_start_first(home, ui, group):
    vm = home.root_vm
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Any of Fleet"))
    choose(ui, "Any of Fleet")
    vm.go_first(True)
    choose(ui, "Aino")
    choose(ui, "Any of Fleet")
    assert (vm.run.can_be_first, vm.goes_first) == (True, False)


def test_run_is_aimed_at_the_named_robot_when_the_group_was_deleted(home, ui, group):
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Any of Fleet"))
    choose(ui, "Any of Fleet")
    home.site.container.catalogue.remove_group(group.id)
    ui.wait(lambda: not ui.find_all(ChoiceChip, text="Any of Fleet"))
    run(ui, "Home")
    ui.wait(lambda: home.shell.snackbars.texts)
    assert home.shell.snackbars.texts == ["Home is sent to Aino"]


def test_values_that_were_entered_for_a_deleted_group_run_on_no_robot(home, ui, group):
    home.site.add_missions("Wait at home")
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Any of Fleet") and ui.find_all(ChoiceChip, text="Wait at home"))
    choose(ui, "Wait at home")
    choose(ui, "Any of Fleet")
    ui.wait(lambda: ui.find_all(CommandButton, text="Enter values and run"))
    press(ui, "Enter values and run")
    dialog = ui.find(RunDialog)
    home.site.container.catalogue.remove_group(group.id)
    ui.wait(lambda: not home.root_vm.facts.groups)
    dialog.run({"Time": "00:00:05.000000"})
    assert home.shell.snackbars.texts == [
        "Wait at home was not started on Fleet. Robot, group or mission has changed since then"
    ]
    ui.wait(lambda: home.shell.background.idle)
    assert not home.site.container.history.open()


def test_a_cross_of_a_row_removed_in_the_same_frame_does_nothing(home, ui):
    home.root_vm.cancel(("item", 999_999))
    ui.wait(lambda: home.shell.background.idle)
    assert home.shell.snackbars.texts == []
