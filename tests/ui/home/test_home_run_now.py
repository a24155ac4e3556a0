"""Run now, from the tap to what has ended: on real services and a simulated robot."""

from __future__ import annotations

from app.domain.models import Mission, State, Trigger
from app.screens.home.cards import BlockedLine
from app.screens.home.run_dialog import RunDialog
from app.widgets.buttons import ChoiceChip, CommandButton
from app.widgets.dialogs import ChoiceDialog, ConfirmDialog
from app.widgets.fields import FormField
from app.widgets.flow import PositionRow
from app.widgets.frame import AlarmBanner, TopBar
from app.widgets.positions import PositionsMap
from app.widgets.rows import OptionRow, RobotChip
from tests.ui.home.operator import choose, press, rows, run, visible_rows
from tests.ui.whole_app import GUIDS, api


# ---------------------------------------------------------------------- run now
def test_run_now_from_tap_to_just_finished(home, ui):
    run(ui, "Home")
    ui.wait(lambda: "Home is sent to Aino" in ui.texts())
    ui.wait(lambda: any(reason.startswith("Completed in") for reason in ui.texts()), seconds=60)
    (execution,) = home.site.container.history.last_finished(5)
    assert (execution.trigger, execution.state, execution.mission) == (Trigger.MANUAL, State.COMPLETED, "Home")


def test_run_now_under_a_hold_says_that_it_waits(home, ui):
    home.site.container.holds.hold("shift meeting")
    choose(ui, "Home")
    ui.wait(lambda: ui.find_all(CommandButton, text="Queue, held"))
    press(ui, "Queue, held")
    ui.wait(lambda: home.shell.snackbars.texts)
    (message,) = home.shell.snackbars.texts
    assert message.startswith("Home is not sent to Aino yet. On hold: shift meeting; waits until ")


def test_run_now_on_a_silent_robot_says_that_it_waits_for_an_answer(home, ui):
    home.aino.control({"reboot_seconds": 60})
    choose(ui, "Home")
    ui.wait(lambda: ui.find_all(CommandButton, text="Send when Aino answers"))
    press(ui, "Send when Aino answers")
    ui.wait(lambda: home.shell.snackbars.texts)
    (message,) = home.shell.snackbars.texts
    assert message.startswith("Home waits for an answer of Aino, until ")


def test_run_now_that_the_robot_refuses_says_why_and_nothing_else(home, ui):
    home.site.container.catalogue.save_mission(
        Mission("Removed on the robot", "00000000-0000-0000-0000-000000000000", favourite=True)
    )
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Removed on the robot"))
    run(ui, "Removed on the robot")
    ui.wait(lambda: home.shell.snackbars.texts)
    (message,) = home.shell.snackbars.texts
    assert message.startswith("Removed on the robot was not started on Aino. The robot has no mission ")


def test_a_mission_in_the_queue_says_that_it_came_from_run_now(home, ui):
    run(ui, "Deliver")
    ui.wait(lambda: any(mission == "Deliver" and origin.startswith("Run now") for mission, origin in rows(ui)))
    ui.wait(lambda: {"Working", "no earlier run to compare with"} <= set(ui.texts()))


def test_two_taps_start_one_mission(home, ui):
    choose(ui, "Deliver")
    press(ui, "Run on Aino")
    press(ui, "Run on Aino")  # a glove that trembles
    ui.wait(lambda: any(mission == "Deliver" for mission, _origin in rows(ui)))
    assert len(home.site.container.history.open()) == 1
    ui.advance(1)
    press(ui, "Run on Aino")  # a second wish is a second mission
    ui.wait(lambda: len(home.site.container.history.open()) == 2)


def test_under_the_minimum_the_operator_is_asked_first(home, ui):
    home.site.container.catalogue.change_settings(minimum_battery_percent=50)
    home.aino.control({"battery": 20.0})
    ui.wait(lambda: any(chip.battery == "20 %" for chip in ui.find_all(RobotChip)))
    run(ui, "Home")
    ui.wait(lambda: ui.find_all(ConfirmDialog))  # once it is known that the mission has no parameters
    assert ui.find(ConfirmDialog).text == "The battery of Aino is at 20 %, under the minimum of 50 %."
    assert not home.site.container.history.open()
    press(ui, "Run")
    ui.wait(lambda: home.site.container.history.open() or home.site.container.history.last_finished(1))


def test_a_missions_parameters_are_asked_for_and_travel_to_the_robot(home, ui):
    (mission,) = home.site.add_missions("Wait at home")
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Wait at home"))
    choose(ui, "Wait at home")
    ui.wait(lambda: ui.find_all(CommandButton, text="Enter values and run"))
    press(ui, "Enter values and run")
    dialog = ui.find(RunDialog)
    field = ui.find(FormField, dialog)
    assert field.label == "Time"
    field.text = ""
    assert ui.find(CommandButton, dialog, text="Enter Time first").disabled
    field.text = "00:00:05.000000"
    ui.tap(ui.find(CommandButton, dialog, text="Run on Aino"))
    ui.wait(lambda: home.site.container.history.open())
    assert dict(home.site.container.history.open()[0].parameters) == {"Time": "00:00:05.000000"}
    ui.wait(lambda: any(item["mission_id"] == mission.guid for item in home.aino.state()["queue"]))


def test_run_pressed_before_the_robot_has_named_the_parameters_asks_for_them(home, ui):
    (mission,) = home.site.add_missions("Wait at home")
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Wait at home"))
    home.root_vm.choose_mission(mission.id)
    home.root_vm.run_now()  # in the same frame
    ui.wait(lambda: ui.find_all(RunDialog))
    assert not home.site.container.history.open()


def test_run_asks_again_for_parameters_without_an_answer(home, ui):
    (mission,) = home.site.add_missions("Go to position")
    home.aino.control(
        {"fault": {"kind": "status_503", "method": "GET", "path": f"/missions/{mission.guid}", "count": None}}
    )
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Go to position"))
    choose(ui, "Go to position")
    ui.wait(lambda: home.shell.background.idle)
    assert ui.find_all(CommandButton, text="Run on Aino")
    home.aino.control({"fault": None})
    press(ui, "Run on Aino")
    ui.wait(lambda: ui.find_all(RunDialog))
    assert not home.site.container.history.open()


def test_parameters_known_from_another_robot_are_asked_for_at_a_silent_one(home, ui):
    """It would be queued without its parameters and refused once the robot answers."""
    home.site.add_missions("Go to position")
    ui.tap(ui.find(RobotChip, name="Veikko"))
    ui.wait(lambda: ui.find(TopBar).robot == "Veikko" and ui.find_all(ChoiceChip, text="Go to position"))
    choose(ui, "Go to position")
    ui.wait(lambda: home.shell.background.idle)
    home.aino.control({"reboot_seconds": 60})
    ui.wait(lambda: ui.find_all(AlarmBanner))
    ui.advance(1)  # it has moved what is below it
    ui.tap(ui.find(RobotChip, name="Aino"))
    ui.wait(
        lambda: (
            ui.find(TopBar).robot == "Aino"
            and "No answer" in ui.texts()
            and ui.find_all(ChoiceChip, text="Go to position")
        )
    )
    choose(ui, "Go to position")
    ui.wait(lambda: home.shell.background.idle)
    assert ui.find(CommandButton, text="Enter values").icon == "timer-sand"
    press(ui, "Enter values")
    ui.wait(lambda: ui.find_all(RunDialog))
    assert not home.site.container.history.open()


def test_a_mission_can_be_searched_among_many(home, ui):
    home.site.add_missions(
        *(name for name in GUIDS if name not in ("Deliver", "Home", "Collect empties")), favourite=False
    )
    ui.wait(lambda: len(home.root_vm.facts.missions) == len(GUIDS))
    home.root_vm.pick_mission()
    ui.advance(0.3)
    dialog = home.shell.dialogs.top
    dialog.query = "coils"
    ui.advance(0.2)
    assert [option.text for option in dialog.shown] == ["Move coils to press"]
    ui.tap_text("Move coils to press")
    assert home.root_vm.run.mission == "Move coils to press"


def test_the_blocked_start_is_never_below_the_fold(home, ui):
    for _n in range(8):
        api(home.aino, "POST", "/mission_queue", mission_id=GUIDS["Deliver"])
    ui.wait(lambda: len(home.root_vm.queue) == 8)
    home.site.container.holds.hold("Audit")
    choose(ui, "Home")
    ui.wait(lambda: ui.find_all(CommandButton, text="Queue, held"))
    press(ui, "Queue, held")
    ui.wait(lambda: "1 blocked: held" in ui.texts())
    assert "Home" not in [mission for mission, _origin in visible_rows(ui)]
    ui.tap(ui.find(BlockedLine))
    assert visible_rows(ui)[-1][1].startswith("Run now · On hold: Audit; skipped at ")


def test_a_position_is_chosen_on_the_map_of_the_robot(home, ui):
    home.site.add_missions("Go to position")
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Go to position") and home.root_vm.map.picture is not None)
    choose(ui, "Go to position")
    ui.wait(lambda: ui.find_all(CommandButton, text="Enter values and run"))
    press(ui, "Enter values and run")
    dialog = ui.find(RunDialog)
    press(ui, "On the map")
    ui.advance(0.3)
    chart = ui.find(PositionsMap)
    press_spot = next(spot for spot in chart.places if spot.name == "Press")
    ui.tap_at(*chart.to_window(*chart._point(press_spot.x, press_spot.y)))
    press(ui, "Choose Press")
    ui.tap(ui.find(CommandButton, dialog, text="Run on Aino"))
    ui.wait(lambda: home.site.container.history.open())
    assert list(home.site.container.history.open()[0].parameters.values()) == [press_spot.key]


def test_the_opened_run_shows_its_destination_by_name(home, ui):
    home.site.add_missions("Go to position")
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Go to position"))
    choose(ui, "Go to position")
    ui.wait(lambda: ui.find_all(CommandButton, text="Enter values and run"))
    press(ui, "Enter values and run")
    ui.find(PositionRow).chosen = next(guid for guid, name in ui.find(PositionRow).options if name == "Press")
    ui.tap(ui.find(CommandButton, ui.find(RunDialog), text="Run on Aino"))
    ui.wait(lambda: "Go to position · Press is sent to Aino" in home.shell.snackbars.texts)
    ui.wait(lambda: any(mission == "Go to position · Press" for mission, _origin in rows(ui)))
    (execution,) = home.site.container.history.open()
    home.shell.go("logs", execution_id=execution.id)
    ui.wait(lambda: home.shell.navigator.screen("logs").vm.story.note == "Position: Press")


def test_a_mission_that_is_not_in_the_list_is_fetched_from_a_robot(home, ui, monkeypatch):
    asked: list[int] = []
    monkeypatch.setattr(home.site.container.operator, "fetch_missions", lambda robot_id: asked.append(robot_id) or ())
    home.root_vm.pick_mission()
    ui.advance(1)
    ui.tap(ui.find(OptionRow, text="Not in the list? Fetch it from a robot"))
    ui.wait(lambda: ui.find_all(ChoiceDialog, title="Fetch missions from"))
    ui.advance(1)
    ui.tap(ui.find(OptionRow, text="Veikko"))
    ui.wait(lambda: asked)
    assert home.shell.navigator.current == "settings"
    assert home.root_vm.run.mission_id is None
