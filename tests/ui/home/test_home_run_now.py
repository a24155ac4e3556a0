"""Sending the robot, from the tap to what has ended: on real services and a simulated robot."""

from __future__ import annotations

import pytest
from kivy.core.window import Window

from app.domain.execution import State, Trigger
from app.domain.models import Group, Mission
from app.screens.common.mission_names import NOTHING_KNOWN
from app.screens.home.cards import SendTile
from app.screens.home.sending import AllMissionsSheet, SendSheet
from app.widgets.buttons import ChoiceChip, CommandButton
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.dock import dock
from app.widgets.fields import SearchField
from app.widgets.flow import ChoiceField
from app.widgets.list_row import ListRow
from app.widgets.snackbar import Snackbar
from tests.support.history import last_ended
from tests.ui.home.operator import choose, items, open_robot, press, rows, run
from tests.ui.test_widgets_fields import ENTER
from tests.ui.whole_app import GUIDS, api


def sheet(ui) -> SendSheet:
    return ui.find(SendSheet)


def open_sheet(home, ui, mission: str) -> None:
    """Of a mission that was not entered before, when it is known what it asks for."""
    home.site.add_missions(mission)
    ui.wait(lambda: ui.find_all(SendTile, text=mission))
    choose(ui, mission)
    ui.advance(0.7)


def test_sending_a_robot_takes_two_taps_and_shows_what_became_of_it(home, ui):
    run(ui, "Home")
    ui.wait(lambda: "Home is sent to Aino" in ui.texts())
    ui.wait(lambda: items(ui, "run"), seconds=60)
    (execution,) = last_ended(home.site.container, 5)
    assert (execution.trigger, execution.state, execution.mission) == (Trigger.MANUAL, State.COMPLETED, "Home")


def test_a_sheet_had_back_sends_its_own_mission_to_its_own_robot(home, ui):
    open_sheet(home, ui, "Go to position")
    first = sheet(ui)
    first.draft = True
    choose(ui, "Home")
    open_robot(ui, "Veikko")
    ui.wait(lambda: home.root_vm.view.card.name == "Veikko" and ui.find_all(SendTile, text="Home"))
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    ui.wait(lambda: home.root_vm.view.card.name == "Aino" and not home.root_vm.facts.is_new)
    assert (home.shell.sheets.top, first.title, first.foot) == (first, "Go to position", "Run on Aino")
    first.draft = False
    home.shell.sheets.close(first)


def test_a_sheet_had_back_from_another_page_sends(home, ui):
    choose(ui, "Home")
    sheet(ui).draft = True
    home.shell.go("logs")
    ui.advance(1)
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    ui.advance(1)
    press(ui, "Run on Aino")
    ui.wait(lambda: "Home is sent to Aino" in home.shell.snackbars.texts)


def test_under_a_hold_the_sheet_and_the_message_say_that_it_waits(home, ui):
    home.site.container.holds.hold("shift meeting")
    ui.wait(lambda: home.root_vm.view.card.send_note)
    choose(ui, "Home")
    assert any(text.startswith("On hold, not run from ") for text in ui.texts(sheet(ui)))
    ui.advance(0.7)
    press(ui, "Run on Aino")
    ui.wait(lambda: home.shell.snackbars.texts)
    (message,) = home.shell.snackbars.texts
    assert message.startswith("Home is not sent to Aino yet. On hold: shift meeting, waits until ")


def test_to_a_silent_robot_it_is_sent_when_it_answers(home, ui):
    home.aino.control({"reboot_seconds": 60})
    ui.wait(lambda: home.root_vm.view.card.old)
    choose(ui, "Home")
    assert "Sent when Aino answers" in ui.texts(sheet(ui))
    ui.advance(0.7)
    press(ui, "Run on Aino")
    ui.wait(
        lambda: (
            [text.startswith("Home is not sent to Aino yet. Attempt ") for text in home.shell.snackbars.texts] == [True]
        )
    )


def test_what_was_entered_for_a_mission_and_closed_is_not_sent(home, ui):
    choose(ui, "Home")
    sheet(ui).draft = True
    home.shell.sheets.dismiss(sheet(ui))
    assert home.shell.snackbars.texts == ["Not sent"]


def test_what_the_robot_refuses_says_why_and_nothing_else(home, ui):
    home.site.container.catalogue.save_mission(
        Mission("Removed on the robot", "00000000-0000-0000-0000-000000000000", favourite=True)
    )
    ui.wait(lambda: ui.find_all(SendTile, text="Removed on the robot"))
    run(ui, "Removed on the robot")
    ui.wait(lambda: home.shell.snackbars.texts)
    (message,) = home.shell.snackbars.texts
    assert message.startswith("Removed on the robot was not started on Aino. There is no mission ")


def test_two_taps_start_one_mission(home, ui):
    choose(ui, "Deliver")
    ui.advance(0.7)
    button = ui.find(CommandButton, text="Run on Aino")
    ui.tap(button)
    ui.tap_at(*button.center)  # a glove that trembles
    ui.wait(lambda: any(mission == "Deliver" for mission, _meta in rows(ui)))
    assert len(home.site.container.history.open()) == 1
    run(ui, "Deliver")  # a second wish is a second mission
    ui.wait(lambda: len(home.site.container.history.open()) == 2)


def test_under_the_minimum_the_sheet_says_so_before_it_runs(home, ui):
    home.site.container.catalogue.change_settings(minimum_battery_percent=50)
    home.aino.control({"battery": 20.0})
    ui.wait(lambda: home.root_vm.view.card.battery.text == "20 %")
    ui.tap(ui.find(SendTile, text="Home"))
    ui.wait(lambda: ui.find_all(CommandButton, text="Run anyway on Aino", busy=False))
    assert "Battery 20 %, minimum 50 %." in ui.texts(sheet(ui))
    assert not home.site.container.history.open()
    ui.advance(0.7)
    press(ui, "Run anyway on Aino")
    ui.wait(lambda: home.site.container.history.open() or last_ended(home.site.container, 1))


def test_a_missions_parameters_are_asked_for_and_travel_to_the_robot(home, ui):
    open_sheet(home, ui, "Wait at home")
    fields = sheet(ui).ids.parameters
    [field] = fields.children
    assert field.label == "Time"
    field.text = ""
    assert ui.find(CommandButton, text="Run on Aino").disabled
    assert "Enter Time first" in ui.texts(sheet(ui))
    field.text = "00:00:05.000000"
    press(ui, "Run on Aino")
    ui.wait(lambda: home.site.container.history.open())
    assert dict(home.site.container.history.open()[0].parameters) == {"Time": "00:00:05.000000"}
    ui.wait(lambda: any(item["mission_id"] == GUIDS["Wait at home"] for item in home.aino.state()["queue"]))


@pytest.mark.parametrize("is_restarted", [False, True])
def test_parameters_known_from_another_robot_are_asked_for_at_a_silent_one(home, ui, is_restarted):
    """It would be queued without its parameters and refused once the robot answers."""
    home.site.add_missions("Go to position")
    open_robot(ui, "Veikko")
    ui.wait(lambda: home.root_vm.view.card.name == "Veikko" and ui.find_all(SendTile, text="Go to position"))
    ui.tap(ui.find(SendTile, text="Go to position"))
    ui.wait(lambda: ui.find_all(ChoiceField))
    home.aino.control({"reboot_seconds": 60})
    home.root_vm.select_robot(next(robot.id for robot in home.root_vm.facts.robots if robot.name == "Aino"))
    ui.wait(lambda: home.root_vm.view.card.old and ui.find_all(SendTile, text="Go to position"))
    if is_restarted:
        home.shell.mission_names.known = NOTHING_KNOWN
    ui.tap(ui.find(SendTile, text="Go to position"))
    ui.wait(lambda: ui.find_all(ChoiceField))
    assert not ui.find(CommandButton, text="Run on Aino").busy
    ui.tap(ui.find(ChoiceField))
    ui.advance(0.7)  # no touch where the sheet below was
    ui.tap(ui.find(OptionRow, title="Press"))
    ui.wait(lambda: home.shell.background.idle)  # it has not answered
    assert ui.find(ChoiceField).value == "Press"


def test_a_mission_is_searched_among_all_of_them(home, ui):
    home.site.add_missions(
        *(name for name in GUIDS if name not in ("Deliver", "Home", "Collect empties")), favourite=False
    )
    ui.wait(lambda: len(home.root_vm.facts.missions) == len(GUIDS))
    ui.tap(ui.find(SendTile, text="All missions"))
    ui.wait(lambda: ui.find_all(AllMissionsSheet))
    ui.advance(0.7)
    ui.tap(ui.find(SearchField, ui.find(AllMissionsSheet)))
    Window.dispatch("on_textinput", "c")
    ui.key(ENTER)
    assert dock.field is None  # it goes to the first of several
    ui.find(SearchField, ui.find(AllMissionsSheet)).text = ""
    ui.tap(ui.find(SearchField, ui.find(AllMissionsSheet)))
    Window.dispatch("on_textinput", "coils")
    ui.advance(0.7)
    assert [row.item.title for row in ui.find_all(ListRow, ui.find(AllMissionsSheet))][:1] == ["Move coils to press"]
    ui.key(ENTER)
    ui.wait(lambda: ui.find_all(SendSheet) and sheet(ui).title == "Move coils to press")


def test_the_blocked_start_is_never_below_the_fold(home, ui):
    for _n in range(8):
        api(home.aino, "POST", "/mission_queue", mission_id=GUIDS["Deliver"])
    ui.wait(lambda: len(home.root_vm.facts.snapshot.queue) == 8)
    home.site.container.holds.hold("Audit")
    ui.wait(lambda: home.root_vm.view.card.send_note)
    run(ui, "Home")
    ui.wait(lambda: any(meta.startswith("on hold, not run from ") for _mission, meta in rows(ui)[:2]))


def test_a_position_is_chosen_by_its_name_and_named_in_logs(home, ui):
    open_sheet(home, ui, "Go to position")
    ui.wait(lambda: ui.find_all(ChoiceField))
    ui.tap(ui.find(ChoiceField))
    ui.advance(0.7)  # no touch where the sheet below was
    row = ui.find(OptionRow, title="Dock")
    ui.tap(row)
    ui.wait(lambda: ui.find_all(CommandButton, text="Run on Aino"))
    ui.advance(0.7)
    press(ui, "Run on Aino")
    ui.wait(lambda: "Go to position · Dock is sent to Aino" in home.shell.snackbars.texts)
    (execution,) = home.site.container.history.open()
    assert list(execution.parameters.values()) == [row.item.key]
    home.shell.go("logs", execution_id=execution.id)
    ui.wait(lambda: home.shell.navigator.screen("logs").vm.story.words.note == "Position: Dock")


def test_a_mission_that_is_not_in_the_list_is_fetched_from_a_robot(home, ui, monkeypatch):
    asked: list[int] = []
    monkeypatch.setattr(home.site.container.operator, "fetch_missions", lambda robot_id: asked.append(robot_id) or ())
    ui.tap(ui.find(SendTile, text="All missions"))
    ui.wait(lambda: ui.find_all(AllMissionsSheet))
    ui.advance(1)
    ui.tap(next(row for row in ui.find_all(ListRow) if row.item.key == "fetch"))
    ui.wait(lambda: ui.find_all(ChoiceSheet, title="Fetch missions from"))
    ui.advance(1)
    ui.tap(ui.find(OptionRow, title="Veikko"))
    ui.wait(lambda: asked)
    assert home.shell.navigator.current == "settings"


def test_a_mission_runs_on_any_robot_of_a_group_from_its_sheet(home, ui):
    members = tuple(robot.id for robot in home.root_vm.facts.robots)
    group = home.site.container.catalogue.save_group(Group("Hall 1", members))
    try:
        ui.wait(lambda: home.root_vm.facts.groups)
        choose(ui, "Home")
        ui.tap(ui.find(ChoiceChip, text="Any of Hall 1"))
        ui.advance(0.7)
        press(ui, "Run on any of Hall 1")
        ui.wait(lambda: home.site.container.history.open() or last_ended(home.site.container, 1))
    finally:
        ui.wait(lambda: not home.site.container.history.open())
        home.site.container.catalogue.remove_group(group.id)
