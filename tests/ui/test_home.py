"""Home as an operator uses it: taps and typing, on real services and a simulated robot."""
from __future__ import annotations

from contextlib import contextmanager
from datetime import timedelta
from zoneinfo import ZoneInfo

import pytest

from app.domain.models import Mission, ReasonCode, Schedule, State, Trigger
from app.screens.home.cards import BlockedLine, FinishedRow, PlannedRow, QueueCard, RobotHead
from app.screens.home.run_dialog import RunDialog
from app.widgets.buttons import ChoiceChip, CommandButton, IconButton
from app.widgets.dialogs import ChoiceDialog, ConfirmDialog
from app.widgets.fields import FormField
from app.widgets.frame import AlarmBanner, TopBar
from app.widgets.long_list import LongList
from app.widgets.rows import LogRow, OptionRow, QueueRow, RobotChip, ScheduleRow
from tests.support.stored import Stored
from tests.ui.whole_app import GUIDS, api, begin_anew, plant, shown


@pytest.fixture(scope="module")
def ui(shared_ui):
    return shared_ui


@pytest.fixture(scope="module")
def app(tmp_path_factory, ui):
    """Two robots and three missions, after both robots have answered."""
    with plant(tmp_path_factory.mktemp("plant"), robots=2) as site:
        site.add_robots()
        site.add_missions("Deliver", "Home", "Collect empties")
        with shown(site.container, ui) as app:
            app.site, app.aino, began = site, site.fleet.robots[0], site.container.clock.now()
            ui.wait(lambda: site.is_at_rest(began) and any("Ready" in ui.texts(head) for head in ui.find_all(RobotHead)))
            app.stored, app.root_vm = Stored(site.container), app.shell.navigator.screen("home").vm
            yield app


@pytest.fixture
def home(app, ui):
    """At robots at rest, with no run, alarm or hold behind it."""
    def put_back() -> None:
        app.site.calm_down(ui)
        app.stored.put_back()

    begin_anew(app, ui, put_back)
    app.root_vm.choose_mission(None)
    ui.wait(lambda: "Ready" in ui.texts(ui.find(RobotHead)) and ui.find(TopBar).robot == "Aino" and not ui.find_all(AlarmBanner))
    assert (len(ui.find_all(RobotChip)), rows(ui), ui.find_all(FinishedRow), app.root_vm.busy) == (2, [], [], [])
    return app


def is_shown_running(ui) -> bool:
    """The first of the queue."""
    return any(" · started " in origin for _mission, origin in rows(ui)[:1])


def press(ui, word: str) -> None:
    """The button with that word."""
    ui.tap(ui.find(CommandButton, text=word))


def choose(ui, mission: str) -> None:
    ui.tap(ui.find(ChoiceChip, text=mission))


def rows(ui) -> list[tuple[str, str]]:
    return [(row.mission, row.origin) for row in ui.find_all(QueueRow)]


def loud(ui) -> list[str]:
    """What the filled buttons say that can be pressed."""
    return [button.text for button in ui.find_all(CommandButton, style="filled", disabled=False)]


def visible_rows(ui) -> list[tuple[str, str]]:
    """Those whose middle lies in the list."""
    in_sight = ui.find(LongList, ui.find(QueueCard))
    return [(row.mission, row.origin) for row in in_sight.views
            if in_sight.collide_point(*in_sight.parent.to_widget(*row.to_window(*row.center)))]


def run(ui, mission: str) -> None:
    choose(ui, mission)
    press(ui, "Run on Aino")


def pend(home) -> None:
    """Hold the robot, so that what is sent stays in its queue."""
    home.aino.control({"emergency_stop": True})
    home.aino.control({"emergency_stop": False})              # it is then in Pause


# ---------------------------------------------------------------------- what is seen
def test_both_robots_and_the_selected_one_are_shown(home, ui):
    assert {chip.name for chip in ui.find_all(RobotChip)} == {"Aino", "Veikko"}
    texts = ui.texts()
    assert "90 %" in texts
    assert any(text.startswith("127.0.0.1:") for text in texts)
    assert ui.find(TopBar).robot == "Aino"
    assert ui.find(TopBar).link.startswith("Connected")


def test_an_emergency_stop_shows_within_a_poll_with_banner_and_advice(home, ui):
    home.aino.control({"emergency_stop": True})
    ui.wait(lambda: "Emergency stop" in ui.texts())
    ui.wait(lambda: ui.find_all(AlarmBanner))
    assert ui.find(AlarmBanner).text == "Aino is stopped: emergency stop pressed"
    assert ui.find(CommandButton, text="Resume").disabled
    assert ui.find(CommandButton, text="Aino is stopped").disabled
    home.aino.control({"emergency_stop": False})
    ui.wait(lambda: "Paused" in ui.texts())
    ui.advance(1)
    press(ui, "Resume")
    ui.wait(lambda: "Ready" in ui.texts(ui.find(RobotHead)))


# ---------------------------------------------------------------------- run now
def test_run_now_from_tap_to_just_finished(home, ui):
    run(ui, "Home")
    ui.wait(lambda: "Home is sent to Aino" in ui.texts())
    ui.wait(lambda: any(reason.startswith("Completed in") for reason in ui.texts()), seconds=60)
    execution, = home.site.container.history.last_finished(5)
    assert (execution.trigger, execution.state, execution.mission) == (Trigger.MANUAL, State.COMPLETED, "Home")


def test_run_now_under_a_hold_says_that_it_waits(home, ui):
    home.site.container.holds.hold("shift meeting")
    choose(ui, "Home")
    ui.wait(lambda: ui.find_all(CommandButton, text="Queue, held"))
    press(ui, "Queue, held")
    ui.wait(lambda: home.shell.snackbars.texts)
    told, = home.shell.snackbars.texts
    assert told.startswith("Home is not sent to Aino yet. Held back: shift meeting; waits until ")


def test_run_now_on_a_silent_robot_says_that_it_waits_for_an_answer(home, ui):
    home.aino.control({"reboot_seconds": 60})
    choose(ui, "Home")
    ui.wait(lambda: ui.find_all(CommandButton, text="Send when Aino answers"))
    press(ui, "Send when Aino answers")
    ui.wait(lambda: home.shell.snackbars.texts)
    told, = home.shell.snackbars.texts
    assert told.startswith("Home waits for an answer of Aino, until ")


def test_run_now_that_the_robot_refuses_says_why_and_nothing_else(home, ui):
    home.site.container.catalogue.save_mission(Mission("Removed on the robot", "00000000-0000-0000-0000-000000000000", favourite=True))
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Removed on the robot"))
    run(ui, "Removed on the robot")
    ui.wait(lambda: home.shell.snackbars.texts)
    told, = home.shell.snackbars.texts
    assert told.startswith("Removed on the robot was not started on Aino. The robot has no mission ")


def test_a_mission_in_the_queue_says_that_it_came_from_run_now(home, ui):
    run(ui, "Deliver")
    ui.wait(lambda: any(mission == "Deliver" and origin.startswith("Run now") for mission, origin in rows(ui)))
    ui.wait(lambda: {"Executing", "no earlier run to compare with"} <= set(ui.texts()))


def test_two_taps_start_one_mission(home, ui):
    choose(ui, "Deliver")
    press(ui, "Run on Aino")
    press(ui, "Run on Aino")                                  # a glove that trembles
    ui.wait(lambda: any(mission == "Deliver" for mission, _origin in rows(ui)))
    assert len(home.site.container.history.open()) == 1
    ui.advance(1)
    press(ui, "Run on Aino")                                  # a second wish is a second mission
    ui.wait(lambda: len(home.site.container.history.open()) == 2)


def test_under_the_minimum_the_operator_is_asked_first(home, ui):
    home.site.container.catalogue.change_settings(minimum_battery_percent=50)
    home.aino.control({"battery": 20.0})
    ui.wait(lambda: any(chip.battery == "20 %" for chip in ui.find_all(RobotChip)))
    run(ui, "Home")
    ui.wait(lambda: ui.find_all(ConfirmDialog))              # once it is known that the mission has no parameters
    assert ui.find(ConfirmDialog).text == "The battery of Aino is at 20 %, under the minimum of 50 %."
    assert not home.site.container.history.open()
    press(ui, "Run")
    ui.wait(lambda: home.site.container.history.open() or home.site.container.history.last_finished(1))


def test_a_missions_parameters_are_asked_for_and_travel_to_the_robot(home, ui):
    mission, = home.site.add_missions("Wait at home")
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Wait at home"))
    choose(ui, "Wait at home")
    ui.wait(lambda: ui.find_all(CommandButton, text="Enter values and run"))
    press(ui, "Enter values and run")
    dialog = ui.find(RunDialog)
    field = ui.find(FormField, dialog)
    assert field.label == "Time"
    field.text = ""
    assert ui.find(CommandButton, dialog, text="Run on Aino").disabled
    field.text = "00:00:05.000000"
    ui.tap(ui.find(CommandButton, dialog, text="Run on Aino"))
    ui.wait(lambda: home.site.container.history.open())
    assert dict(home.site.container.history.open()[0].parameters) == {"Time": "00:00:05.000000"}
    ui.wait(lambda: any(item["mission_id"] == mission.guid for item in home.aino.state()["queue"]))


def test_run_pressed_before_the_robot_has_named_the_parameters_asks_for_them(home, ui):
    mission, = home.site.add_missions("Wait at home")
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Wait at home"))
    home.root_vm.choose_mission(mission.id)
    home.root_vm.run_now()                                    # in the same frame
    ui.wait(lambda: ui.find_all(RunDialog))
    assert not home.site.container.history.open()


def test_run_asks_once_more_for_the_parameters_that_the_robot_did_not_tell(home, ui):
    mission, = home.site.add_missions("Go to position")
    home.aino.control({"fault": {"kind": "status_503", "method": "GET", "path": f"/missions/{mission.guid}", "count": None}})
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Go to position"))
    choose(ui, "Go to position")
    ui.wait(lambda: home.shell.background.idle)
    assert ui.find_all(CommandButton, text="Run on Aino")
    home.aino.control({"fault": None})
    press(ui, "Run on Aino")
    ui.wait(lambda: ui.find_all(RunDialog))
    assert not home.site.container.history.open()


def test_a_mission_can_be_searched_among_many(home, ui):
    home.site.add_missions(*(name for name in GUIDS if name not in ("Deliver", "Home", "Collect empties")), favourite=False)
    ui.wait(lambda: len(home.root_vm.facts.missions) == len(GUIDS))
    home.root_vm.pick_mission()
    ui.advance(.3)
    dialog = home.shell.dialogs.top
    dialog.query = "coils"
    ui.advance(.2)
    assert [option.text for option in dialog.shown] == ["Move coils to press"]
    ui.tap_text("Move coils to press")
    assert home.root_vm.run.mission == "Move coils to press"


def test_what_is_blocked_is_never_below_the_fold(home, ui):
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
    assert visible_rows(ui)[-1][1].startswith("Run now · Held back: Audit; waits until ")


# ---------------------------------------------------------------------- the controls
def test_pause_and_resume_are_one_button_that_says_what_it_will_do(home, ui):
    press(ui, "Pause")
    ui.wait(lambda: "Paused" in ui.texts())
    assert home.aino.state()["state_id"] == 4
    ui.advance(1)
    press(ui, "Resume")
    ui.wait(lambda: "Ready" in ui.texts(ui.find(RobotHead)))
    assert home.aino.state()["state_id"] == 3


def test_two_taps_on_pause_pause(home, ui):
    press(ui, "Pause")
    ui.wait(lambda: ui.find_all(CommandButton, text="Resume") and not home.root_vm.busy)
    press(ui, "Resume")                                       # a glove that trembles: the button has changed under it
    ui.wait(lambda: home.shell.background.idle)
    assert home.aino.state()["state_id"] == 4
    assert home.shell.snackbars.texts == ["Aino pauses"]


def test_pause_does_not_turn_into_resume_under_a_finger(home, ui):
    api(home.aino, "PUT", "/status", state_id=4)              # somebody else is a moment faster
    ui.wait(lambda: ui.find_all(CommandButton, text="Resume"))
    press(ui, "Resume")
    ui.wait(lambda: home.shell.background.idle)
    assert home.aino.state()["state_id"] == 4
    ui.advance(1)
    press(ui, "Resume")
    ui.wait(lambda: home.aino.state()["state_id"] == 3)


def test_reset_errors_never_moves_the_robot_and_resume_lights_up_after_it(home, ui):
    home.aino.control({"error": {"code": 10120, "description": "Failed to reach goal position 'Line 1'"}})
    ui.wait(lambda: "Failed to reach goal position 'Line 1'" in ui.texts())
    assert ui.find(CommandButton, text="Resume").disabled
    assert loud(ui) == ["Reset errors"]
    home.aino.control({"error": None})
    press(ui, "Reset errors")
    ui.wait(lambda: "Paused" in ui.texts())
    assert ui.find(CommandButton, text="Reset errors").disabled
    assert not ui.find(CommandButton, text="Resume").disabled
    choose(ui, "Deliver")
    assert loud(ui) == ["Resume"]


def test_reset_errors_says_that_they_are_gone_only_when_they_are(home, ui):
    home.aino.control({"error": {"code": 10120, "description": "Failed to reach goal position 'Line 1'"}})
    ui.wait(lambda: "Failed to reach goal position 'Line 1'" in ui.texts())
    press(ui, "Reset errors")                                 # its cause is still there
    ui.wait(lambda: home.shell.snackbars.texts)
    assert home.shell.snackbars.texts == ["Aino has got Reset errors, but its error stands"]
    home.aino.control({"error": None})
    home.shell.snackbars.clear()
    press(ui, "Reset errors")
    ui.wait(lambda: home.shell.snackbars.texts)
    assert home.shell.snackbars.texts == ["The errors of Aino are reset; press Resume to continue"]


def test_clear_queue_says_how_many_and_ends_them_all(home, ui):
    pend(home)
    run(ui, "Deliver")
    ui.wait(lambda: len(rows(ui)) == 1)
    api(home.aino, "POST", "/mission_queue", mission_id=GUIDS["Home"])
    ui.wait(lambda: len(rows(ui)) == 2)
    press(ui, "Clear queue")
    dialog = ui.find(ConfirmDialog)
    assert dialog.title == "Clear 2 missions from the queue of Aino?"
    ui.tap(ui.find(CommandButton, dialog, text="Clear queue"))
    ui.wait(lambda: not rows(ui))
    ui.wait(lambda: not home.site.container.history.open())
    execution, = home.site.container.history.last_finished(5)
    assert execution.reason.code is ReasonCode.QUEUE_CLEARED


def test_one_of_ours_can_be_cancelled(home, ui):
    pend(home)
    run(ui, "Deliver")
    ui.wait(lambda: any(run.queue_id for run in home.site.container.history.open()) and rows(ui))
    ui.tap(ui.find(IconButton, ui.find(QueueRow)))
    ui.wait(lambda: home.site.container.history.last_finished(1))
    execution, = home.site.container.history.last_finished(1)
    assert execution.reason.code is ReasonCode.USER_CANCELLED
    ui.wait(lambda: not rows(ui))


def test_what_runs_is_stopped_only_after_a_question(home, ui):
    run(ui, "Deliver")
    ui.wait(lambda: is_shown_running(ui))
    ui.tap(ui.find(IconButton, ui.find(QueueRow)))
    assert "Stop Deliver?" in ui.texts()
    press(ui, "Let it run")
    ui.wait(lambda: home.shell.dialogs.top is None)
    assert home.aino.state()["queue"][-1]["state"] == "Executing"
    ui.tap(ui.find(IconButton, ui.find(QueueRow)))
    press(ui, "Stop it")
    ui.wait(lambda: home.site.container.history.last_finished(1))
    execution, = home.site.container.history.last_finished(1)
    assert execution.reason.code is ReasonCode.USER_CANCELLED


def test_what_the_robot_could_not_be_told_is_not_cancelled_yet(home, ui):
    pend(home)
    run(ui, "Deliver")
    ui.wait(lambda: any(run.queue_id for run in home.site.container.history.open()) and rows(ui))
    number = home.site.container.history.open()[0].queue_id
    home.aino.control({"fault": {"kind": "drop_request", "method": "DELETE", "path": f"/mission_queue/{number}", "count": None}})
    ui.wait(lambda: home.shell.snackbars.texts == ["Deliver is sent to Aino"])
    ui.tap(ui.find(IconButton, ui.find(QueueRow)))
    ui.wait(lambda: len(home.shell.snackbars.texts) == 2)
    assert home.shell.snackbars.texts[-1] == "Deliver is being cancelled"
    home.aino.control({"fault": None})
    ui.wait(lambda: not rows(ui))


def test_somebody_elses_item_shows_its_creator_and_can_be_cancelled(home, ui):
    pend(home)
    number = api(home.aino, "POST", "/mission_queue", mission_id=GUIDS["Home"]).json()["id"]
    ui.wait(lambda: rows(ui))
    mission, origin = rows(ui)[0]
    assert mission == "Home"
    assert origin.startswith(api(home.aino, "GET", f"/mission_queue/{number}").json()["created_by_name"])
    ui.tap(ui.find(IconButton, ui.find(QueueRow)))
    ui.wait(lambda: not rows(ui))
    assert api(home.aino, "GET", f"/mission_queue/{number}").json()["state"] == "Aborted"


@contextmanager
def screen_behind(home):
    """The robot goes on, but nothing it says of its queue reaches the tablet: the screen shows what is over."""
    number = home.root_vm.facts.snapshot.queue[0].id
    for method, path in (("GET", "/mission_queue"), ("POST", "/mission_queue/search"), ("GET", f"/mission_queue/{number}")):
        home.aino.control({"fault": {"kind": "status_503", "method": method, "path": path, "count": None}})
    yield
    home.aino.control({"fault": None})


def test_cancelling_what_somebody_else_has_just_cancelled_is_no_error(home, ui):
    pend(home)
    number = api(home.aino, "POST", "/mission_queue", mission_id=GUIDS["Home"]).json()["id"]
    ui.wait(lambda: rows(ui))
    with screen_behind(home):
        api(home.aino, "DELETE", f"/mission_queue/{number}")
        ui.tap(ui.find(IconButton, ui.find(QueueRow)))
        ui.wait(lambda: home.root_vm.busy == [])
        assert "Home is cancelled" in home.shell.snackbars.texts
    ui.wait(lambda: not rows(ui))


def test_cancelling_one_of_ours_that_has_just_ended_keeps_how_it_ended(home, ui):
    run(ui, "Home")
    ui.wait(lambda: is_shown_running(ui))
    with screen_behind(home):
        ui.wait(lambda: home.aino.state()["queue"][-1]["state"] == "Done")
        ui.tap(ui.find(IconButton, ui.find(QueueRow)))
        press(ui, "Stop it")
        ui.wait(lambda: home.root_vm.busy == [])
    ui.wait(lambda: home.site.container.history.last_finished(1))
    execution, = home.site.container.history.last_finished(1)
    assert execution.state is State.COMPLETED
    ui.wait(lambda: not rows(ui))


def test_an_item_that_the_robot_does_not_know_any_more_had_ended(home, ui):
    home.root_vm.cancel(("item", 999999))
    ui.wait(lambda: any("had already ended" in text for text in ui.texts()))


def test_a_robot_that_is_gone_while_pausing_is_reported_in_one_sentence(home, ui):
    """It was there when the finger came down; the press itself meets a dead line."""
    home.aino.control({"fault": {"kind": "drop_request", "method": "PUT", "path": "/status", "count": None}})
    press(ui, "Pause")
    ui.wait(lambda: "pause" not in home.root_vm.busy)
    told, = home.shell.snackbars.texts
    assert "127.0.0.1" in told
    assert not ui.find(CommandButton, text="Pause").disabled  # it can be tried again at once
    home.aino.control({"fault": None})
    press(ui, "Pause")
    ui.wait(lambda: "Paused" in ui.texts())


def test_pause_can_be_pressed_although_the_robot_is_known_to_be_gone(home, ui):
    home.aino.control({"reboot_seconds": 60})
    ui.wait(lambda: "No connection" in ui.texts())
    press(ui, "Pause")
    ui.wait(lambda: any("127.0.0.1" in text for text in home.shell.snackbars.texts), seconds=20)
    assert "pause" not in home.root_vm.busy


def test_a_question_of_the_robot_is_answered_from_the_tablet(home, ui):
    home.aino.control({"user_prompt": {"question": "Is the load secured?", "options": ["Yes", "No"], "timeout": 60}})
    ui.wait(lambda: "Is the load secured?" in ui.texts())
    press(ui, "Yes")
    ui.wait(lambda: "Is the load secured?" not in ui.texts())
    assert any("Answer sent to Aino: Yes" in text for text in home.shell.snackbars.texts)


def test_a_question_is_an_alarm_that_is_answered_where_it_is_shown(home, ui):
    home.shell.go("scheduler")
    home.aino.control({"user_prompt": {"question": "Is the load secured?", "options": ["Yes", "No"], "timeout": 600}})
    ui.wait(lambda: ui.find_all(AlarmBanner, text="Aino asks: Is the load secured?"))
    assert "answers: Yes / No" in ui.find(AlarmBanner).note
    press(ui, "Answer")
    assert ui.find(ChoiceDialog).title == "Aino asks: Is the load secured?"
    ui.tap(ui.find(OptionRow, ui.find(ChoiceDialog), text="Yes"))
    ui.wait(lambda: any("Answer sent to Aino: Yes" in text for text in home.shell.snackbars.texts))
    ui.wait(lambda: all(alarm.cleared_at for alarm in home.site.container.alarms.open() if alarm.code == "question"))


# ---------------------------------------------------------------------- which robot
def test_a_chip_selects_the_robot_for_the_whole_app(home, ui):
    ui.tap(ui.find(RobotChip, name="Veikko"))
    assert home.root_vm.facts.robot.name == "Veikko"        # at once, before the database knows
    ui.wait(lambda: ui.find(TopBar).robot == "Veikko")
    ui.wait(lambda: home.site.container.settings().selected_robot_id == home.root_vm.facts.robot.id)


def test_the_top_bar_switches_robots_from_anywhere(home, ui):
    home.shell.go("scheduler")
    ui.advance(.3)
    ui.tap(ui.find(root=ui.find(TopBar), text="Aino"))
    ui.tap(ui.find(OptionRow, home.shell.dialogs.top, text="Veikko"))
    ui.wait(lambda: ui.find(TopBar).robot == "Veikko")
    ui.tap_text("Home")
    ui.wait(lambda: ui.find_all(CommandButton, text="Run on Veikko") or ui.find_all(RobotChip, name="Veikko", selected=True))


# ---------------------------------------------------------------------- where lists lead
def test_an_ended_run_opens_its_story_in_logs(home, ui):
    run(ui, "Home")
    ui.wait(lambda: ui.find_all(FinishedRow))
    execution, = home.site.container.history.last_finished(1)
    ui.tap(ui.find(FinishedRow))
    assert home.shell.navigator.current == "logs"
    ui.wait(lambda: ui.find_all(LogRow, opened=True))
    assert ui.find(LogRow, opened=True).key == execution.id


def test_a_planned_start_opens_its_schedule(home, ui):
    robots, missions = home.root_vm.facts.robots, home.root_vm.facts.missions
    tomorrow = home.site.container.clock.now() + timedelta(days=1)
    zone = home.site.container.settings().timezone
    for hour, mission in ((6, missions[0]), (7, missions[1])):
        start = tomorrow.astimezone(ZoneInfo(zone)).replace(hour=hour, minute=0, second=0, microsecond=0, tzinfo=None)
        home.site.container.catalogue.save_schedule(
            Schedule(mission.name, robots[0].id, mission.id, start, zone, "FREQ=DAILY", respect_working_days=False))
    ui.wait(lambda: len({row.mission for row in ui.find_all(PlannedRow)}) == 2)
    row = ui.find(PlannedRow, mission=missions[1].name)
    schedule_id = row.key[0]
    ui.tap(row)
    assert home.shell.navigator.current == "scheduler"
    form = home.shell.navigator.screen("scheduler").vm.form
    ui.wait(lambda: form.editing == schedule_id)
    assert ui.find(ScheduleRow, selected=True).key == schedule_id
    ui.advance(.2)                                            # the form asks for its forecast a moment later: not of an app that has ended
    ui.wait(lambda: home.shell.background.idle)
