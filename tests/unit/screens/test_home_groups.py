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


@pytest.mark.parametrize(
    ("values", "note"),
    [
        ({}, "Aino busy until about 14:52 · Veikko 18 % battery"),
        ({"wait": Wait.PLACE, "wait_details": {"place": "Dock 2"}}, "Waits for Dock 2 until 15:00"),
        ({"wait_details": {"group": "Hall 1"}}, "Waits for a robot of Hall 1 until 15:00"),
        (
            {"wait_details": {"group": "Hall 1", "robots": [BUSY], "kept_for": "Shift bus"}},
            "kept for Shift bus · Aino busy until about 14:52",
        ),
    ],
)
def test_whatever_it_waits_for_has_its_sentence(values, note):
    [start] = waiting.waiting_rows(facts(row(**values)))
    assert (start.support, [action.text for action in start.actions]) == (note, ["Give to a robot", ""])


def test_the_most_important_is_first_and_nothing_with_a_robot_is_among_them():
    rows = [
        row(1),
        row(2, priority=2),
        row(3, priority=-1),
        row(4, robot_id=1, robot="Aino"),
        row(5, state=State.SUBMITTING),
    ]
    assert [found.id for found in waiting.group_starts(facts(*rows))] == [2, 1, 3]


def test_one_on_hold_is_given_to_no_robot():
    [start] = waiting.waiting_rows(facts(row(held=True, wait=Wait.HOLD)))
    assert [action.name for action in start.actions] == ["cancel"]


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
    [start] = waiting.waiting_rows(shown)
    assert (start.key, start.actions[0].text) == (("start", 60), "Start elsewhere")
    assert start.support.startswith("Aino may have it, no answer since ")
    assert [(option.key, option.text) for option in waiting.others_for(shown, lost)] == [(2, "Veikko")]
    assert waiting.waiting_rows(replace(shown, snapshots={1: snapshot(1, READY)})) == ()
    assert waiting.waiting_rows(replace(shown, open=(replace(lost, group_id=None),))) == ()


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


@pytest.mark.parametrize(
    "why", [{"withdrawn": Reason(ReasonCode.USER_CANCELLED)}, {"cancel_code": ReasonCode.USER_CANCELLED}]
)
@pytest.mark.parametrize("connection", [Connection.UNREACHABLE, Connection.CONNECTED])
def test_a_start_that_is_not_sent_again_is_offered_to_no_robot(why, connection):
    """It was cancelled, or started on another robot, while the first was silent."""
    lost = replace(row(60), state=State.SUBMITTING, robot_id=1, robot="Aino", **why)
    shown = facts(lost, snapshots={1: snapshot(1, READY, connection=connection)})
    assert waiting.waiting_rows(shown) == ()
