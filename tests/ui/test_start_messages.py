"""Messages about a mission that a person has just started or assigned: shown once known, and only while they are true."""

from __future__ import annotations

import logging
from dataclasses import replace
from types import SimpleNamespace

import pytest

from app.domain.execution import Execution, ReasonCode, State, Wait
from app.domain.robot import MissionParameter
from app.screens.common.cancelled import say_cancelled
from app.screens.common.group_starts import GroupStarts
from app.screens.common.mission_names import NOTHING_KNOWN
from app.screens.common.overlays import Dialogs
from app.screens.common.shell import Shell
from app.screens.common.started import StartReports, outcome
from app.screens.common.threads import Changed, UiBus
from app.screens.common.view_model import Navigator
from app.screens.frame.controller import FrameController
from app.services.live.changes import Topic
from app.widgets.buttons import CommandButton
from app.widgets.choices import ChoiceSheet
from app.widgets.frame import Frame
from app.widgets.sheet import AskSheet
from app.widgets.snackbar import Snackbars
from tests.support.home_facts import AINO, execution

UNBOUND = replace(
    execution(7, AINO, "Kits", State.WAITING),
    robot_id=None,
    robot="",
    group_id=5,
    robot_group="Hall 1",
    wait=Wait.ROBOT,
    wait_details={"group": "Hall 1"},
)
BOUND = replace(
    UNBOUND, robot_id=1, robot="Aino", wait=Wait.DUE, wait_details={}, choice={"robots": [{"robot": "Aino"}]}
)
SENT = replace(BOUND, state=State.QUEUED, queue_id=31)
REFUSED = replace(UNBOUND, tried={"2": {"tries": 1, "robot": "Veikko", "code": "unknown_mission", "problem": ""}})


def test_an_answer_that_leaves_it_open_is_said_as_such():
    looked_for = replace(
        SENT, state=State.SUBMITTING, queue_id=None, wait_details={"answer": "the robot answered: No (status 500)"}
    )
    text, _icon, _seconds = outcome(looked_for, NOTHING_KNOWN)
    assert (
        text
        == "It is not certain that Aino has Kits. Asking whether it has arrived: the robot answered: No (status 500)"
    )


class AtOnce:
    """Work in the background that takes no time."""

    @staticmethod
    def run(work, done, _failed, key=None) -> None:
        done(work())


class World:
    """A ledger with one row, and who follows it."""

    def __init__(self, ui) -> None:
        self.row: Execution | None = None
        self.bus, self.ui = UiBus(), ui
        self.shell = Shell(Navigator(None, {}), Dialogs(), Snackbars(), self.bus, AtOnce())
        self.page = SimpleNamespace(is_open=True)
        self.reports = StartReports(
            self.page,
            self.shell,
            SimpleNamespace(get=lambda key: self.row if self.row is not None and self.row.id == key else None),
        )

    def becomes(self, row: Execution) -> None:
        self.row = row
        self.bus.publish(Changed(Topic.EXECUTIONS))
        self.ui.advance()

    @property
    def messages(self) -> list[str]:
        return self.shell.snackbars.texts


@pytest.fixture
def world(ui, caplog):
    ui.advance()  # the clock may not have ticked for long
    made = World(ui)
    yield made
    made.page.is_open = False
    made.shell.snackbars.clear()
    assert [record.getMessage() for record in caplog.get_records("call") if record.levelno >= logging.ERROR] == []


def test_a_start_of_a_group_that_soon_has_a_robot_is_not_said_to_wait(world, ui):
    world.row = UNBOUND
    world.reports.follow(UNBOUND)
    assert world.messages == []
    ui.advance(0.3)
    world.becomes(BOUND)
    assert world.messages == []
    world.becomes(SENT)
    assert world.messages == ["Kits is sent to Aino. Aino: free now"]
    ui.advance(2)
    assert world.messages == ["Kits is sent to Aino. Aino: free now"]


def test_a_start_still_without_a_robot_is_said_to_wait_once(world, ui):
    world.row = UNBOUND
    world.reports.follow(UNBOUND)
    ui.advance(5.2)
    [message] = world.messages
    assert message.startswith("Kits is not sent yet. Waits for a robot of Hall 1 until ")
    world.becomes(UNBOUND)
    assert world.messages == [message]


def test_a_robot_that_refuses_the_values_is_named(world, ui):
    world.row = BOUND
    world.reports.follow(BOUND)
    world.becomes(REFUSED)
    [message] = world.messages
    assert message.startswith("Kits is not sent yet. Veikko refused it: There is no such mission: ")


def test_a_start_that_one_refused_and_another_took_names_both(world, ui):
    world.row = REFUSED
    world.reports.follow(REFUSED)
    world.becomes(replace(SENT, tried=REFUSED.tried))
    [message] = world.messages
    assert message.startswith("Kits is sent to Aino. Veikko refused it: There is no such mission")
    assert message.endswith(" · assigned to Aino")


HELD = replace(BOUND, wait=Wait.HOLD, wait_details={"hold": "Maintenance"})


def test_a_released_start_is_not_said_to_wait_any_more(world, ui):
    world.row = HELD
    world.reports.follow(HELD)
    [message] = world.messages
    assert message.startswith("Kits is not sent to Aino yet. ")
    ui.advance(2)
    world.becomes(BOUND)  # released, being sent
    assert world.messages == []
    world.becomes(SENT)
    assert world.messages == ["Kits is sent to Aino. Aino: free now"]


def test_a_cancelled_held_start_is_not_said_to_wait_any_more(world, ui):
    world.row = HELD
    world.reports.follow(HELD)
    world.becomes(replace(HELD, state=State.CANCELLED))
    assert world.messages == []
    world.becomes(HELD)  # Undo: that it waits again is said where that is done
    assert world.messages == []


def test_long_after_that_was_read_nothing_more_is_said(world, ui):
    world.row = HELD
    world.reports.follow(HELD)
    ui.advance(60)
    world.becomes(SENT)
    assert world.messages == []


def test_a_message_is_not_repeated_with_every_change(world, ui):
    world.row = HELD
    world.reports.follow(HELD)
    ui.advance(5)
    world.becomes(replace(HELD, priority=50))
    ui.advance(3.5)
    assert world.messages == []  # 8 s after it was said the first time


def test_a_held_start_is_followed_while_an_undo_covers_its_message(world, ui):
    world.row = HELD
    world.reports.follow(HELD)
    ui.advance(1)
    world.shell.snackbars.undo("Count is deleted", "Undo", lambda: None)
    ui.advance(7.5)
    world.becomes(SENT)
    assert world.messages == ["Count is deleted", "Kits is sent to Aino. Aino: free now"]


def test_a_start_is_not_said_to_be_held_when_its_robot_stops_answering(world, ui):
    world.row = HELD
    world.reports.follow(HELD)
    ui.advance(1)
    world.becomes(BOUND)
    assert world.messages == []
    ui.advance(5.2)
    [message] = world.messages
    assert message.startswith("Kits: no answer from Aino, tried until ")


def test_a_sent_start_is_not_said_to_be_held_on_another_screen(world, ui):
    world.row = HELD
    world.reports.follow(HELD)
    world.page.is_open = False
    [message] = world.messages
    assert message.startswith("Kits is not sent to Aino yet. ")
    world.becomes(SENT)
    assert world.messages == ["Kits is sent to Aino. Aino: free now"]


def test_nothing_begins_to_be_said_once_another_screen_is_shown(world, ui):
    world.row = BOUND
    world.reports.follow(BOUND)
    world.page.is_open = False
    world.reports.follow(replace(BOUND, id=8))  # it was written only then
    ui.advance(6)
    world.becomes(SENT)
    assert (world.messages, world.bus._handlers[Changed]) == ([], [])


def test_a_start_of_a_group_that_is_not_held_any_more_is_said_to_wait_for_a_robot(world, ui):
    world.row = replace(UNBOUND, wait=Wait.HOLD, wait_details={"hold": "Maintenance"})
    world.reports.follow(UNBOUND)
    [message] = world.messages
    assert message.startswith("Kits is not sent yet. On hold: Maintenance")
    world.becomes(UNBOUND)
    ui.advance(5.2)
    [message] = world.messages
    assert message.startswith("Kits is not sent yet. Waits for a robot of Hall 1 until ")


def test_a_start_is_not_followed_after_its_message_ended(world, ui):
    """Not even for a database that was put in the place of this one."""
    world.row = HELD
    world.reports.follow(HELD)
    world.page.is_open = False
    world.shell.snackbars.clear()
    world.becomes(SENT)
    assert (world.messages, world.bus._handlers[Changed]) == ([], [])


SILENT = replace(execution(7, AINO, "Kits", State.WAITING), wait=Wait.DUE)


@pytest.mark.parametrize(
    ("becomes", "said"),
    [
        (replace(SILENT, state=State.QUEUED, queue_id=31), ["Kits is sent to Aino"]),
        (replace(SILENT, state=State.CANCELLED), []),
        (replace(SILENT, state=State.SUBMITTING, cancel_code=ReasonCode.USER_CANCELLED), []),
    ],
)
def test_a_robot_is_no_longer_waited_for_once_it_answered_or_the_start_ended(world, ui, becomes, said):
    world.row = SILENT
    world.reports.follow(SILENT)
    ui.advance(5.2)
    [message] = world.messages
    assert message.startswith("Kits: no answer from Aino, tried until ")
    ui.advance(1)
    world.becomes(becomes)
    assert world.messages == said


def test_each_try_to_reach_a_robot_says_no_more_than_the_first(world, ui):
    def failed(attempts: int) -> Execution:
        return replace(
            SILENT, wait=Wait.RETRY, wait_details={"problem": "it refused the connection"}, attempts=attempts
        )

    world.row = SILENT
    world.reports.follow(SILENT)
    world.becomes(failed(1))
    [message] = world.messages
    assert message.startswith("Kits is not sent to Aino yet. Attempt 1 failed, trying again until ")
    for attempts in (2, 3):
        ui.advance(3)
        world.becomes(replace(failed(attempts), state=State.SUBMITTING))
        world.becomes(failed(attempts))
        assert world.messages == [message]
    ui.advance(3)
    assert world.messages == []


def test_an_answer_in_doubt_of_a_later_try_is_said(world, ui):
    retried = replace(SILENT, wait=Wait.RETRY, wait_details={"problem": "it refused the connection"}, attempts=1)
    world.row = retried
    world.reports.follow(retried)
    answered = replace(retried, state=State.SUBMITTING, wait_details={"answer": "the robot answered: No (status 500)"})
    world.becomes(answered)
    [message] = world.messages
    assert message.startswith("It is not certain that Aino has Kits. ")
    world.becomes(replace(retried, attempts=2))
    [message] = world.messages
    assert message.startswith("Kits is not sent to Aino yet. Attempt 2 failed, ")


def test_an_assigned_start_of_a_group_is_said_to_wait_for_the_answer(world, ui):
    world.row = UNBOUND
    world.reports.follow(UNBOUND)
    world.becomes(BOUND)
    ui.advance(5.2)
    [message] = world.messages
    assert message.startswith("Kits: no answer from Aino, tried until ")


def test_a_start_that_is_being_cancelled_is_not_said_to_be_sent(world, ui):
    world.row = BOUND
    world.reports.follow(BOUND)
    asked = replace(SENT, cancel_code=ReasonCode.USER_CANCELLED)
    say_cancelled(world.shell, None, "Kits", asked, lambda: None)
    world.becomes(asked)
    world.becomes(replace(asked, state=State.CANCELLED))
    assert world.messages == ["Asked to cancel Kits"]


def test_a_cancelled_start_is_no_longer_said_to_be_sent(world, ui):
    world.row = SENT
    world.reports.follow(SENT)
    say_cancelled(world.shell, None, "Kits", SENT, lambda: None)
    assert world.messages == ["Asked to cancel Kits"]


def test_two_starts_with_the_same_words_are_both_followed(world, ui):
    first, second = UNBOUND, replace(UNBOUND, id=8)
    rows = {7: first, 8: second}
    world.reports._history = rows
    for row in rows.values():
        world.reports.follow(row)
    ui.advance(5.2)
    assert len(world.messages) == 1
    rows[7] = SENT
    world.becomes(SENT)
    assert world.messages[-1] == "Kits is sent to Aino. Aino: free now"
    assert world.messages[0].startswith("Kits is not sent yet. ")
    rows[8] = replace(SENT, id=8, robot="Veikko", choice={})
    world.becomes(SENT)
    assert world.messages == ["Kits is sent to Aino. Aino: free now", "Kits is sent to Veikko"]


@pytest.fixture
def dock(world) -> dict[str, str]:
    """What a mission was given."""
    guid = "a1c4e008-5d0f-11ef-93c1-0001297b6e20"
    world.shell.mission_names.take(
        "m-1", (MissionParameter("goal", "Position", choices=((guid, "Dock 3"),), sets="position"),)
    )
    return {"goal": guid}


def test_messages_about_a_start_name_its_values(world, dock, ui):
    world.row = replace(UNBOUND, parameters=dock)
    world.reports.follow(world.row)
    ui.advance(5.2)
    assert world.messages[0].startswith("Kits · Dock 3 is not sent yet. ")
    world.becomes(replace(SENT, parameters=dock))
    assert world.messages == ["Kits · Dock 3 is sent to Aino. Aino: free now"]


# ---------------------------------------------------------------------- what a person does with it
class Operator:
    """Does what it is asked for."""

    left: Execution = UNBOUND

    def hold_starts(self, ids, _held) -> int:
        return len(ids)

    def cancel_execution(self, _key) -> Execution:
        return self.left


@pytest.fixture
def starts(world):
    return GroupStarts(Operator(), None, world.shell, lambda: None, lambda _execution: None, lambda _id: world.row)


def test_a_start_released_at_once_is_not_said_to_be_held(world, starts, ui):
    starts.hold(UNBOUND, True)
    assert world.messages == ["Kits is on hold"]
    ui.advance(1)
    starts.hold(UNBOUND, False)
    assert world.messages == ["Kits is no longer on hold"]


def test_actions_on_a_start_name_its_values(world, starts, dock, ui):
    start = replace(UNBOUND, parameters=dock)
    starts.hold(start, True)
    assert world.messages == ["Kits · Dock 3 is on hold"]
    ui.advance(1)
    starts.cancel(start)
    assert world.messages == ["Asked to cancel Kits · Dock 3"]
    starts.give(start, [])
    assert ui.find(ChoiceSheet).title == "Give Kits · Dock 3 to"
    world.shell.dialogs.close_all()


def test_a_start_cancelled_at_once_is_not_said_to_be_held(world, starts, ui):
    starts.hold(UNBOUND, True)
    ui.advance(1)
    starts.cancel(UNBOUND)
    assert world.messages == ["Asked to cancel Kits"]


def test_a_start_with_attempts_is_cancelled_only_after_a_question(world, starts, ui):
    starts.cancel(replace(UNBOUND, attempts=1))
    ui.advance(0.3)
    assert (world.messages, ui.find(AskSheet).title, ui.find(AskSheet).text) == (
        [],
        "Cancel Kits?",
        "This can't be undone.",
    )
    ui.tap(ui.find(CommandButton, text="Cancel mission"))
    assert world.messages == ["Asked to cancel Kits"]


def test_a_start_that_runs_when_its_cancellation_is_confirmed_asks_before_stopping(world, starts, ui):
    world.row = waits = replace(UNBOUND, attempts=1)
    starts.cancel(waits)
    ui.advance(0.5)
    world.row = replace(waits, state=State.EXECUTING, robot_id=1, robot="Aino")
    ui.tap(ui.find(CommandButton, text="Cancel mission"))
    ui.advance(0.5)
    assert (world.messages, ui.find(AskSheet).title) == ([], "Cancel Kits?")
    ui.tap(ui.find(CommandButton, text="Cancel mission"))
    assert world.messages == ["Asked to cancel Kits"]


def test_stopping_a_start_for_any_robot_names_the_one_that_the_fleet_chose(world, starts, ui):
    starts.cancel(replace(UNBOUND, state=State.EXECUTING, robot_id=1, robot="Hall", taken_by="Veikko"))
    ui.advance(0.5)
    assert ui.find(AskSheet).text == "Veikko stops where it is."


def test_a_waiting_start_that_is_held_is_said_only_to_be_held(world, starts, ui):
    world.row = UNBOUND
    world.reports.follow(UNBOUND)
    ui.advance(5.2)
    starts.hold(UNBOUND, True)
    assert world.messages == ["Kits is on hold"]
    world.becomes(replace(UNBOUND, wait=Wait.HOLD, held=True))
    assert world.messages == ["Kits is on hold"]


def test_a_hold_of_one_start_says_nothing_about_another(world, starts, ui):
    starts.hold(UNBOUND, True)
    starts.hold(replace(UNBOUND, id=8, mission="Count"), False)
    assert world.messages == ["Kits is on hold", "Count is no longer on hold"]


@pytest.fixture
def late(world):
    """Holds and releases what fell due while the app was off."""
    return FrameController(
        SimpleNamespace(operator=Operator(), robot_missions=None, clock=None), world.shell, Frame()
    )._hold_starts


def test_late_starts_are_not_said_to_be_held_once_one_of_them_is_released(world, late, ui):
    late([7, 8], True)
    assert world.messages == ["2 starts are on hold"]
    ui.advance(1)
    late([9], False)
    assert len(world.messages) == 1
    late([8], False)
    assert world.messages == []


def test_a_late_start_that_is_released_elsewhere_is_not_said_to_be_held(world, late, starts):
    late([7, 8], True)
    starts.hold(UNBOUND, False)
    assert world.messages == ["Kits is no longer on hold"]


def test_a_late_start_that_is_held_is_not_said_to_be_released(world, late, starts):
    starts.hold(UNBOUND, False)
    late([7], True)
    assert world.messages == ["1 start is on hold"]
