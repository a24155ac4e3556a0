"""Pause, Resume, Reset errors, Clear queue and cancelling: on real services and a simulated robot."""

from __future__ import annotations

from contextlib import contextmanager

import pytest

from app.domain.execution import ReasonCode, State
from app.domain.models import InvalidInput
from app.mir.errors import Unreachable
from app.screens.home.cards import SendTile
from app.widgets.buttons import CommandButton
from app.widgets.sheet import AskSheet
from tests.support.history import last_ended
from tests.ui.home.operator import (
    QUEUE,
    clear_queue,
    is_shown_pending,
    is_shown_running,
    items,
    loud,
    open_robot,
    pend,
    press,
    rows,
    run,
    step,
    tab,
    tap_cancel,
)
from tests.ui.whole_app import GUIDS, api

ERROR = "Failed to reach goal position 'Line 1' (10120)"
STANDS = f"Still there: {ERROR}. Remove its cause at Aino, then reset again"


# ---------------------------------------------------------------------- the controls
def test_pause_and_resume_are_one_button_that_says_what_it_will_do(home, ui):
    press(ui, "Pause")
    ui.wait(lambda: "Paused" in ui.texts())
    assert home.aino.state()["state_id"] == 4
    assert ui.find(CommandButton, text="Resume").busy  # a second tap on Pause resumes nothing, and it is seen why
    ui.wait(lambda: not ui.find(CommandButton, text="Resume").busy)
    press(ui, "Resume")
    ui.wait(lambda: home.root_vm.view.card.state == "Ready")
    assert home.aino.state()["state_id"] == 3


def test_progress_stops_while_the_robot_is_paused(home, ui):
    run(ui, "Deliver")
    ui.wait(lambda: is_shown_running(ui))
    press(ui, "Pause")
    ui.wait(lambda: home.root_vm.facts.activities and home.root_vm.facts.activities[-1].activity == "paused")
    ui.advance(1)
    began, shown = home.site.container.clock.now(), home.root_vm.view.card.progress
    ui.wait(lambda: (home.site.container.clock.now() - began).total_seconds() > 3)
    ui.advance(1)
    assert home.root_vm.view.card.progress == shown


def test_a_failed_command_names_robot_and_command(home, ui):
    """Somebody may look at another robot by then, and knows no addresses."""
    home.aino.control({"fault": {"kind": "status_503", "path": "/status", "method": "PUT", "count": 1}})
    press(ui, "Pause")
    ui.wait(lambda: home.shell.snackbars.texts)
    assert home.shell.snackbars.texts == ["Pause: Aino is busy just now (status 503)"]
    assert home.aino.state()["state_id"] == 3


@pytest.mark.parametrize(
    ("problem", "said"),
    [  # made in the test: one that was raised keeps the window it was raised in
        (lambda: InvalidInput("robot", "this robot has been removed"), "Aino · Pause: This robot has been removed"),
        (
            lambda: Unreachable(code="unknown_name", host="mir7.plant"),
            "Aino · Pause: The name mir7.plant is not known on this network: check it or enter the IP address",
        ),
    ],
)
def test_a_problem_that_names_no_robot_is_said_with_that(home, ui, monkeypatch, problem, said):
    def fail(_robot_id: int) -> None:
        raise problem()

    monkeypatch.setattr(home.site.container.operator, "pause", fail)
    press(ui, "Pause")
    ui.wait(lambda: home.shell.snackbars.texts)
    assert home.shell.snackbars.texts == [said]


def test_two_taps_on_pause_pause(home, ui):
    press(ui, "Pause")
    ui.wait(lambda: home.shell.snackbars.texts == ["Aino pauses"])
    ui.wait(lambda: ui.find_all(CommandButton, text="Resume") and not home.root_vm.busy)
    press(ui, "Resume")  # a glove that trembles: the button has changed under it
    ui.wait(lambda: home.shell.background.idle)
    assert home.aino.state()["state_id"] == 4
    assert "Aino continues" not in home.shell.snackbars.texts


def test_pause_does_not_turn_into_resume_under_a_finger(home, ui):
    api(home.aino, "PUT", "/status", state_id=4)  # somebody else was faster
    ui.wait(lambda: ui.find_all(CommandButton, text="Resume"))
    assert ui.find(CommandButton, text="Resume").busy  # a second tap on Pause resumes nothing, and it is seen why
    press(ui, "Resume")
    ui.wait(lambda: home.shell.background.idle)
    assert home.aino.state()["state_id"] == 4
    ui.wait(lambda: not ui.find(CommandButton, text="Resume").busy)
    press(ui, "Resume")
    ui.wait(lambda: home.aino.state()["state_id"] == 3)


def test_resume_of_another_robot_is_ready_at_once(home, ui):
    """It was paused long before: no tap on Pause can be under way."""
    api(home.site.fleet.robots[1], "PUT", "/status", state_id=4)
    ui.wait(lambda: tab(ui, "Veikko").tab.tone == "action")
    open_robot(ui, "Veikko")
    ui.wait(lambda: ui.find_all(CommandButton, text="Resume"))
    assert not ui.find(CommandButton, text="Resume").busy
    ui.wait(lambda: not home.root_vm.busy)
    open_robot(ui, "Aino")
    ui.wait(lambda: ui.find_all(CommandButton, text="Pause"))
    ui.wait(lambda: not home.root_vm.busy)


def test_reset_errors_never_moves_the_robot_and_resume_lights_up_after_it(home, ui):
    home.aino.control({"error": {"code": 10120, "description": "Failed to reach goal position 'Line 1'"}})
    ui.wait(lambda: f"“{ERROR}”" in ui.texts())
    assert "Can't reach Line 1" in ui.texts()
    assert ui.find(SendTile, text="Deliver").disabled
    assert loud(ui) == ["Reset errors"]
    home.aino.control({"error": None})
    step(ui, "Reset errors")
    ui.wait(lambda: "Paused" in ui.texts())
    assert loud(ui) == ["Resume"]
    press(ui, "Resume")  # at once: the tap belongs to the press before
    ui.wait(lambda: home.shell.background.idle)
    assert home.aino.state()["state_id"] == 4


def test_reset_errors_says_so_when_it_did_not_help(home, ui):
    home.aino.control({"error": {"code": 10120, "description": "Failed to reach goal position 'Line 1'"}})
    ui.wait(lambda: f"“{ERROR}”" in ui.texts())
    step(ui, "Reset errors")  # its cause is still there
    ui.wait(lambda: home.shell.snackbars.texts == [STANDS])
    home.aino.control({"error": None})
    home.shell.snackbars.clear()
    step(ui, "Reset errors")
    ui.wait(lambda: "Paused" in ui.texts())
    ui.skip(6)
    assert home.shell.snackbars.texts == []


def test_clear_queue_says_how_many_and_ends_them_all(home, ui):
    pend(home)
    run(ui, "Deliver")
    ui.wait(lambda: len(rows(ui)) == 1)
    api(home.aino, "POST", "/mission_queue", mission_id=GUIDS["Home"])
    ui.wait(lambda: len(rows(ui)) == 2)
    clear_queue(ui)
    assert ui.find(AskSheet).title == "Clear 2 missions from the queue of Aino?"
    press(ui, "Clear queue")
    ui.wait(lambda: not rows(ui))
    ui.wait(lambda: not home.site.container.history.open())
    (execution,) = last_ended(home.site.container, 5)
    assert execution.reason.code is ReasonCode.QUEUE_CLEARED


def test_a_queue_is_shown_as_being_cleared_until_the_robot_answers(home, ui):
    pend(home)
    run(ui, "Deliver")
    ui.wait(lambda: len(rows(ui)) == 1)
    home.aino.control(
        {"fault": {"kind": "late", "path": "/mission_queue", "method": "DELETE", "count": 1, "seconds": 1.0}}
    )
    clear_queue(ui)
    ui.tap(ui.find(CommandButton, ui.find(AskSheet), text="Clear queue"))
    ui.wait(lambda: "Being cancelled" in dict(rows(ui)).values())
    assert "clear" in home.root_vm.busy
    assert not any(item.actions for item in items(ui, *QUEUE))
    ui.wait(lambda: not rows(ui))


def test_a_clear_without_an_answer_says_its_outcome(home, ui):
    """It may have been done: the message names no address and no failure."""
    pend(home)
    run(ui, "Deliver")
    ui.wait(lambda: len(rows(ui)) == 1)
    home.shell.snackbars.clear()
    home.aino.control({"fault": {"kind": "drop_request", "path": "/mission_queue", "method": "DELETE", "count": 1}})
    clear_queue(ui)
    ui.tap(ui.find(CommandButton, ui.find(AskSheet), text="Clear queue"))
    ui.wait(lambda: any("answered" in text for text in home.shell.snackbars.texts))
    assert (
        "Aino has not answered yet: missions sent from here are cancelled as soon as it does"
        in home.shell.snackbars.texts
    )
    ui.wait(lambda: last_ended(home.site.container, 1))
    (execution,) = last_ended(home.site.container, 1)
    assert execution.reason.code is ReasonCode.QUEUE_CLEARED


def test_clearing_the_queue_of_a_silent_robot_first_says_what_will_happen(home, ui):
    pend(home)
    run(ui, "Deliver")
    ui.wait(lambda: len(rows(ui)) == 1)
    clear_queue(ui)
    assert "doesn't answer" not in ui.find(AskSheet).text
    press(ui, "Keep")
    ui.wait(lambda: not ui.find_all(AskSheet))
    home.aino.control({"reboot_seconds": 600})
    ui.wait(lambda: home.root_vm.view.card.old)
    clear_queue(ui)
    assert "Aino doesn't answer now, so perhaps nothing is removed." in ui.find(AskSheet).text
    ui.tap(ui.find(CommandButton, ui.find(AskSheet), text="Clear queue"))
    ui.wait(lambda: any(text.startswith("Clear queue: ") for text in home.shell.snackbars.texts))
    (execution,) = home.site.container.history.open()  # nothing has reached it
    assert execution.cancel_code is None


def test_a_start_of_the_app_can_be_cancelled(home, ui):
    pend(home)
    run(ui, "Deliver")
    ui.wait(lambda: is_shown_pending(ui))
    tap_cancel(ui)
    press(ui, "Keep")
    ui.wait(lambda: home.shell.sheets.top is None)
    assert [item["state"] for item in home.aino.state()["queue"][-1:]] == ["Pending"]
    tap_cancel(ui)
    assert {"Cancel Deliver?", "It leaves the queue of Aino. This can't be undone."} <= set(ui.texts(ui.find(AskSheet)))
    press(ui, "Cancel mission")
    ui.wait(lambda: last_ended(home.site.container, 1))
    (execution,) = last_ended(home.site.container, 1)
    assert execution.reason.code is ReasonCode.USER_CANCELLED
    ui.wait(lambda: not rows(ui))


def test_an_unsent_start_is_cancelled_at_once_and_undo_makes_it_wait_again(home, ui):
    home.site.container.holds.hold("Audit")
    run(ui, "Home")
    ui.wait(lambda: rows(ui))
    tap_cancel(ui)
    ui.wait(lambda: "Home is cancelled" in home.shell.snackbars.texts)
    ui.tap(ui.find(text="Undo"))
    ui.wait(lambda: "Home waits again" in home.shell.snackbars.texts and rows(ui))


def test_a_start_that_begins_during_the_question_is_stopped_only_after_the_answer(home, ui):
    pend(home)
    run(ui, "Deliver")
    ui.wait(lambda: is_shown_pending(ui))
    tap_cancel(ui)
    api(home.aino, "PUT", "/status", state_id=3)
    ui.wait(lambda: is_shown_running(ui))
    press(ui, "Cancel mission")
    assert "Cancel Deliver?" in ui.texts()
    press(ui, "Keep")
    assert home.aino.state()["queue"][-1]["state"] == "Executing"


def test_a_running_mission_is_stopped_only_after_a_question(home, ui):
    run(ui, "Deliver")
    ui.wait(lambda: is_shown_running(ui))
    tap_cancel(ui)
    assert "Cancel Deliver?" in ui.texts()
    press(ui, "Keep")
    ui.wait(lambda: home.shell.sheets.top is None)
    assert home.aino.state()["queue"][-1]["state"] == "Executing"
    tap_cancel(ui)
    press(ui, "Cancel mission")
    ui.wait(lambda: last_ended(home.site.container, 1))
    (execution,) = last_ended(home.site.container, 1)
    assert execution.reason.code is ReasonCode.USER_CANCELLED


def test_stopping_a_mission_says_what_the_robot_continues_with(home, ui):
    run(ui, "Deliver")
    ui.wait(lambda: is_shown_running(ui))
    api(home.aino, "POST", "/mission_queue", mission_id=GUIDS["Home"])
    ui.wait(lambda: ("Home", "1") in [(item.title, item.number) for item in items(ui, *QUEUE)])
    tap_cancel(ui)
    assert "Cancel Deliver?" in ui.texts()
    assert "Aino stops where it is. Then it runs Home." in ui.texts()
    press(ui, "Keep")
    ui.wait(lambda: home.shell.sheets.top is None)
    press(ui, "Pause")  # and then with nothing, until somebody resumes
    ui.wait(lambda: any(item.icon == "pause" for item in items(ui, *QUEUE)))
    tap_cancel(ui)
    assert "Cancel Deliver?" in ui.texts()
    assert "Aino stops where it is." in ui.texts()


def test_a_start_that_could_not_be_cancelled_on_the_robot_is_not_cancelled_yet(home, ui):
    pend(home)
    run(ui, "Deliver")
    ui.wait(lambda: is_shown_pending(ui))
    number = home.site.container.history.open()[0].queue_id
    home.aino.control(
        {"fault": {"kind": "drop_request", "method": "DELETE", "path": f"/mission_queue/{number}", "count": None}}
    )
    ui.wait(lambda: home.shell.snackbars.texts == ["Deliver is sent to Aino"])
    tap_cancel(ui)
    press(ui, "Cancel mission")
    ui.wait(lambda: home.shell.snackbars.texts == ["Asked to cancel Deliver"])
    home.aino.control({"fault": None})
    ui.wait(lambda: not rows(ui))


def test_a_start_in_doubt_on_a_silent_robot_can_be_taken_back(home, ui):
    before = api(home.aino, "GET", "/mission_queue").json()
    home.aino.control({"fault": {"kind": "drop_response", "method": "POST", "path": "/mission_queue", "count": None}})
    run(ui, "Deliver")
    ui.wait(lambda: api(home.aino, "GET", "/mission_queue").json() != before)
    home.aino.control({"fault": {"kind": "drop_request", "count": None}})
    ui.wait(lambda: home.root_vm.view.card.old and rows(ui))
    tap_cancel(ui)
    press(ui, "Cancel mission")
    asked = "Not sent again, and cancelled there if it has arrived"
    ui.wait(lambda: home.shell.snackbars.texts == [f"Deliver: {asked}"])
    home.aino.control({"fault": None})
    ui.wait(lambda: not home.site.container.history.open())
    assert last_ended(home.site.container, 1)[0].reason.code is ReasonCode.USER_CANCELLED


def test_somebody_elses_item_shows_its_creator_and_can_be_cancelled(home, ui):
    pend(home)
    number = api(home.aino, "POST", "/mission_queue", mission_id=GUIDS["Home"]).json()["id"]
    ui.wait(lambda: rows(ui))
    mission, origin = rows(ui)[0]
    assert mission == "Home"
    assert origin.startswith(api(home.aino, "GET", f"/mission_queue/{number}").json()["created_by_name"])
    tap_cancel(ui)
    press(ui, "Cancel mission")
    ui.wait(lambda: not rows(ui))
    assert api(home.aino, "GET", f"/mission_queue/{number}").json()["state"] == "Aborted"


def test_cancelling_an_item_does_not_mark_the_same_number_on_another_robot(home, ui):
    """And is still said when the robot is shown again."""
    robots = home.site.fleet.robots[:2]
    numbers = [0, 0]
    pend(home)
    robots[1].control({"emergency_stop": True})
    robots[1].control({"emergency_stop": False})
    while numbers[0] != numbers[1] or not all(numbers):
        behind = numbers.index(min(numbers))
        if numbers[behind]:
            api(robots[behind], "DELETE", f"/mission_queue/{numbers[behind]}")
        numbers[behind] = api(robots[behind], "POST", "/mission_queue", mission_id=GUIDS["Home"]).json()["id"]
    ui.wait(lambda: [item.key for item in items(ui, *QUEUE)] == [("item", numbers[0])])
    robots[0].control(
        {
            "fault": {
                "kind": "late",
                "path": f"/mission_queue/{numbers[0]}",
                "method": "DELETE",
                "count": 1,
                "seconds": 9.0,
            }
        }
    )
    tap_cancel(ui)
    press(ui, "Cancel mission")
    ui.wait(lambda: home.shell.sheets.top is None and "Being cancelled" in dict(rows(ui)).values())
    open_robot(ui, "Veikko")
    ui.wait(lambda: home.root_vm.view.card.name == "Veikko" and rows(ui) and not home.root_vm.facts.is_new)
    assert "Being cancelled" not in dict(rows(ui)).values()
    open_robot(ui, "Aino")
    ui.wait(lambda: home.root_vm.view.card.name == "Aino" and not home.root_vm.facts.is_new)
    assert "Being cancelled" in dict(rows(ui)).values()
    ui.wait(lambda: not rows(ui))


def test_a_question_about_one_robot_ends_when_another_is_shown(home, ui):
    pend(home)
    number = api(home.aino, "POST", "/mission_queue", mission_id=GUIDS["Home"]).json()["id"]
    ui.wait(lambda: [item.key for item in items(ui, *QUEUE)] == [("item", number)])
    tap_cancel(ui)
    ui.wait(lambda: ui.find_all(AskSheet))
    home.root_vm.select_robot(next(robot.id for robot in home.root_vm.facts.robots if robot.name == "Veikko"))
    ui.wait(lambda: home.root_vm.view.card.name == "Veikko" and not home.root_vm.facts.is_new)
    assert not ui.find_all(AskSheet)
    assert api(home.aino, "GET", f"/mission_queue/{number}").json()["state"] == "Pending"


@contextmanager
def screen_behind(home):
    """The robot continues, but its queue cannot be read: the screen shows an old state."""
    number = home.root_vm.facts.snapshot.queue[0].id
    for method, path in (
        ("GET", "/mission_queue"),
        ("POST", "/mission_queue/search"),
        ("GET", f"/mission_queue/{number}"),
    ):
        home.aino.control({"fault": {"kind": "status_503", "method": method, "path": path, "count": None}})
    yield
    home.aino.control({"fault": None})


def test_cancelling_what_somebody_else_has_just_cancelled_is_not_an_error(home, ui, monkeypatch):
    pend(home)
    number = api(home.aino, "POST", "/mission_queue", mission_id=GUIDS["Home"]).json()["id"]
    operator = home.site.container.operator
    cancel_item = operator.cancel_item

    def cancel_second(robot_id, queue_id):
        api(home.aino, "DELETE", f"/mission_queue/{number}")
        return cancel_item(robot_id, queue_id)

    monkeypatch.setattr(operator, "cancel_item", cancel_second)
    ui.wait(lambda: rows(ui))
    tap_cancel(ui)
    press(ui, "Cancel mission")
    ui.wait(lambda: "Home is cancelled" in home.shell.snackbars.texts)
    ui.wait(lambda: not rows(ui))


def test_one_of_ours_that_ends_behind_an_old_screen_can_not_be_cancelled_and_keeps_how_it_ended(home, ui):
    run(ui, "Home")
    ui.wait(lambda: is_shown_running(ui))
    with screen_behind(home):
        ui.wait(lambda: home.aino.state()["queue"][-1]["state"] == "Done")
        ui.wait(lambda: home.root_vm.view.card.old)
        assert not any(item.actions for item in items(ui, *QUEUE))
    ui.wait(lambda: last_ended(home.site.container, 1))
    (execution,) = last_ended(home.site.container, 1)
    assert execution.state is State.COMPLETED
    ui.wait(lambda: not rows(ui))


def test_an_item_that_the_robot_does_not_know_any_more_had_ended(home, ui, monkeypatch):
    pend(home)
    operator = home.site.container.operator
    cancel_item, unknown = operator.cancel_item, 999_999
    monkeypatch.setattr(operator, "cancel_item", lambda robot_id, _number: cancel_item(robot_id, unknown))
    api(home.aino, "POST", "/mission_queue", mission_id=GUIDS["Home"])
    ui.wait(lambda: rows(ui))
    tap_cancel(ui)
    press(ui, "Cancel mission")
    ui.wait(lambda: "Home had already ended" in ui.texts())


def test_a_robot_that_goes_offline_while_pausing_is_reported_in_one_sentence(home, ui):
    """The robot was there when the finger came down; the press itself finds no connection."""
    home.aino.control({"fault": {"kind": "drop_request", "method": "PUT", "path": "/status", "count": None}})
    press(ui, "Pause")
    ui.wait(lambda: "foot" not in home.root_vm.busy)
    (message,) = home.shell.snackbars.texts
    assert message.startswith("Pause: ")
    assert "Aino" in message
    assert not ui.find(CommandButton, text="Pause").disabled  # it can be tried again at once
    home.aino.control({"fault": None})
    press(ui, "Pause")
    ui.wait(lambda: "Paused" in ui.texts())


def test_another_robot_can_be_paused_while_one_does_not_answer(home, ui):
    home.aino.control({"fault": {"kind": "hang", "method": "PUT", "path": "/status", "count": None, "seconds": 60}})
    press(ui, "Pause")
    assert "foot" in home.root_vm.busy
    open_robot(ui, "Veikko")
    ui.wait(lambda: home.root_vm.view.card.name == "Veikko")
    assert "foot" not in home.root_vm.busy
    press(ui, "Pause")
    ui.wait(lambda: ui.find_all(CommandButton, text="Resume"), seconds=3)
    open_robot(ui, "Aino")
    ui.wait(lambda: home.root_vm.view.card.name == "Aino")
    assert "foot" in home.root_vm.busy  # it has not answered yet
    home.aino.control({"fault": None})
    ui.wait(lambda: "foot" not in home.root_vm.busy, seconds=20)


def test_a_robot_that_is_known_to_be_offline_can_only_be_stopped_by_hand(home, ui):
    home.aino.control({"reboot_seconds": 60})
    ui.wait(lambda: "No answer" in ui.texts())
    assert ui.find(CommandButton, text="Pause").disabled
    assert "Aino can't hear it. Use the button on the robot." in ui.texts()
