"""Words about starts that wait for a robot of their group."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from types import SimpleNamespace

import pytest

from app.database.robots import Hold
from app.domain.execution import Reason, ReasonCode, State, Wait
from app.domain.models import Connection, Group
from app.screens.common.cancelled import ask_to_cancel
from app.screens.common.group_starts import robots_for
from app.screens.home import waiting
from tests.support.home_facts import AINO, FACTS, NOW, READY, SETTINGS, VEIKKO, execution, snapshot

HALL = Group("Hall 1", (1, 2), id=5)
BUSY = {"robot": "Aino", "until": (NOW + timedelta(minutes=14)).isoformat()}
LOW = {"robot": "Veikko", "out": "low_battery", "battery": 18.2}


def row(number: int = 50, **values):
    return replace(
        execution(number, AINO, "Kits", State.WAITING),
        **(
            {
                "robot_id": None,
                "robot": "",
                "group_id": 5,
                "robot_group": "Hall 1",
                "wait": Wait.ROBOT,
                "wait_details": {"group": "Hall 1", "robots": [BUSY, LOW]},
                "closes_at": NOW + timedelta(minutes=22),
            }
            | values
        ),
    )


def facts(*rows, **values):
    return replace(FACTS, groups=(HALL,), open=rows, **values)


def test_a_waiting_start_says_what_each_robot_does_and_when_it_is_queued():
    start = waiting.waiting_row(facts(), row())
    assert [action.text for action in start.actions] == ["Give to a robot", ""]
    assert (
        start.support == "Aino busy until about 14:52 · Veikko 18 % battery. Goes into a queue at 14:59 at the latest"
    )


@pytest.mark.parametrize(
    ("values", "note"),
    [
        (
            {"finish_by": NOW + timedelta(minutes=23)},
            "Aino busy until about 14:52 · Veikko 18 % battery. Not run if it can't be done by 15:01",
        ),
        ({"wait": Wait.PLACE, "wait_details": {"place": "Dock 2"}}, "Waits for Dock 2 until 15:00"),
        ({"wait_details": {"group": "Hall 1"}}, "Waits for a robot of Hall 1 until 15:00"),
        (
            {"wait_details": {"group": "Hall 1", "robots": [BUSY], "kept_for": "Shift bus"}},
            "kept for Shift bus · Aino busy until about 14:52. Goes into a queue at 14:59 at the latest",
        ),
        (
            {"wait_details": {"group": "Hall 1"}, "tried": {"1": {"tries": 1, "robot": "Aino", "problem": ""}}},
            "Aino refused it or did not answer. Waits for a robot of Hall 1 until 15:00",
        ),
    ],
)
def test_whatever_it_waits_for_has_its_sentence(values, note):
    assert waiting.waits_for(row(**values), SETTINGS) == note


def test_the_most_important_is_first_and_nothing_with_a_robot_is_among_them():
    rows = [
        row(1),
        row(2, priority=2),
        row(3, priority=-1),
        row(4, robot_id=1, robot="Aino"),
        row(5, state=State.SUBMITTING),
    ]
    assert [found.id for found in waiting.waiting_of(rows)] == [2, 1, 3]


@pytest.mark.parametrize(
    ("rows", "title"),
    [
        ([], ""),
        ([row()], "Waiting for a robot (1)"),
        ([row(1), row(2, wait=Wait.DUE)], "Waiting for a robot (2)"),
        ([row(1, wait=Wait.PLACE)], "Waiting for a place (1)"),
        ([row(1), row(2, wait=Wait.PLACE)], "Waiting to start (2)"),
        ([row(1, wait=Wait.HOLD)], "Waiting to start (1)"),
        ([row(1, wait=Wait.PLACE), row(2, robot_id=2, robot="Veikko", state=State.SUBMITTING)], "Waiting to start (2)"),
    ],
)
def test_for_what_and_how_many_wait(rows, title):
    assert waiting.waiting_title(rows) == title


def test_it_can_be_assigned_to_enabled_members_each_with_its_state():
    off = replace(VEIKKO, enabled=False)
    assert [(option.key, option.note) for option in robots_for(row(), (AINO, off), (HALL,), (), SETTINGS, NOW)] == [
        (1, "Aino busy until about 14:52")
    ]


def test_a_robot_that_can_not_have_it_says_why():
    place = row(wait=Wait.PLACE, wait_details={"place": "Dock 1", "robot": "Sisu"})
    held = Hold("Maintenance", until=NOW + timedelta(minutes=38), robot_id=2)
    assert [option.note for option in robots_for(place, (AINO, VEIKKO), (HALL,), (held,), SETTINGS, NOW)] == [
        "Dock 1 is full: Sisu uses it",
        "on hold until 15:16",
    ]
    assert robots_for(row(), (AINO, VEIKKO), (HALL,), (replace(held, until=None),), SETTINGS, NOW)[1].note == "on hold"


def test_other_robots_are_offered_for_a_start_that_a_silent_robot_may_have():
    lost = replace(row(60), state=State.SUBMITTING, robot_id=1, robot="Aino")
    silent = snapshot(1, READY, connection=Connection.UNREACHABLE)
    shown = facts(lost, snapshots={1: silent, 2: snapshot(2, READY)})
    [(found, start)] = waiting.starts_with_a_robot(shown, NOW)
    assert (found, start.actions[0].text) == (lost, "Start elsewhere")
    assert start.support.startswith("Aino may have it, no answer since ")
    assert [(option.key, option.text) for option in waiting.others_for(lost, (AINO, VEIKKO), (HALL,))] == [
        (2, "Veikko")
    ]
    [(_found, start)] = waiting.starts_with_a_robot(replace(shown, snapshots={1: snapshot(1, READY)}), NOW)
    assert [action.name for action in start.actions] == ["cancel"]
    assert waiting.starts_with_a_robot(facts(replace(lost, group_id=None), snapshots={1: silent}), NOW) == []


@pytest.mark.parametrize(
    ("asked_of", "text"),
    [
        (None, "It leaves the queue of Aino. This can't be undone."),
        (replace(row(), state=State.QUEUED, queue_id=7), "It leaves the queue of Aino. This can't be undone."),
        (
            replace(row(), state=State.SUBMITTING),
            "It is not sent again. If Aino has it, it is cancelled there. This can't be undone.",
        ),
        (replace(row(), attempts=1), "This can't be undone."),
    ],
)
def test_before_it_is_cancelled_only_what_is_known_is_said(asked_of, text):
    asked = []
    shell = SimpleNamespace(sheets=SimpleNamespace(ask=lambda _title, text, *_rest: asked.append(text)))
    ask_to_cancel(shell, "Kits", "Aino", asked_of, lambda: None)
    assert asked == [text]


@pytest.mark.parametrize("state", [State.WAITING, State.SUBMITTING])
def test_a_start_that_is_being_sent_to_a_robot_is_there_until_that_has_it(state):
    """Seen: it went from robot to robot for half a minute, and nothing was shown where it had been pressed."""
    sent = replace(row(60), state=state, robot_id=2, robot="Veikko", wait=Wait.DUE)
    shown = facts(sent, snapshots={2: snapshot(2, READY)})
    [(found, start)] = waiting.starts_with_a_robot(shown, NOW)
    assert (found, start.support) == (sent, "Being sent to Veikko")
    assert [action.name for action in start.actions] == ["cancel"]
    assert waiting.starts_with_a_robot(facts(replace(sent, state=State.QUEUED, queue_id=7)), NOW) == []
    assert waiting.starts_with_a_robot(shown, sent.planned_at + timedelta(seconds=1)) == []  # mostly it has it by then


@pytest.mark.parametrize("wait", [Wait.HOLD, Wait.BATTERY, Wait.PLACE, Wait.CLOCK, Wait.ELSEWHERE, Wait.LATE_START])
def test_a_start_assigned_by_hand_that_still_waits_is_not_said_to_be_sent(wait):
    """It may wait for hours; the robot's queue says what for."""
    shown = replace(row(60), robot_id=2, robot="Veikko", wait=wait, wait_details={})
    assert waiting.starts_with_a_robot(facts(shown, snapshots={2: snapshot(2, READY)}), NOW) == []


@pytest.mark.parametrize(
    "why", [{"withdrawn": Reason(ReasonCode.USER_CANCELLED)}, {"cancel_code": ReasonCode.USER_CANCELLED}]
)
@pytest.mark.parametrize("connection", [Connection.UNREACHABLE, Connection.CONNECTED])
def test_a_start_that_is_not_sent_again_is_offered_to_no_robot_and_not_said_to_be_sent(why, connection):
    """It was cancelled, or started on another robot, while the first was silent."""
    lost = replace(row(60), state=State.SUBMITTING, robot_id=1, robot="Aino", **why)
    shown = facts(lost, snapshots={1: snapshot(1, READY, connection=connection)})
    assert waiting.starts_with_a_robot(shown, NOW) == []
