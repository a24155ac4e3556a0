"""Home's words about groups: what waits for a robot, for what one is kept, whom Run now starts on."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.robots import Hold
from app.domain.models import Connection, Group, HandOver, Mission, Reason, ReasonCode, Schedule, State, Wait
from app.screens.common.group_starts import robots_for
from app.screens.home import run_now, waiting
from app.screens.home.lists import planned_starts, queue_entries
from app.screens.home.run_now import Target
from app.screens.home.view import present
from app.services.planning.planned import PlannedRun, unassigned_robot
from tests.support.home_facts import AINO, FACTS, KITS, NOW, READY, RUNNING, SETTINGS, VEIKKO, execution, snapshot

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
    [start] = waiting.waiting_starts([row()], SETTINGS)
    assert start.origin == "any of Hall 1 · Schedule · since 14:34"
    assert start.note == "Aino busy until about 14:52; Veikko 18 % battery. Goes into a queue at 14:59 at the latest"


@pytest.mark.parametrize(
    ("values", "note"),
    [
        (
            {"finish_by": NOW + timedelta(minutes=23)},
            "Aino busy until about 14:52; Veikko 18 % battery. Skipped if it can't be done by 15:01",
        ),
        ({"wait": Wait.PLACE, "wait_details": {"place": "Dock 2"}}, "Waits for Dock 2 until 15:00"),
        ({"wait_details": {"group": "Hall 1"}}, "Waits for a robot of Hall 1 until 15:00"),
        (
            {"wait_details": {"group": "Hall 1", "robots": [BUSY], "kept_for": "Shift bus"}},
            "kept for Shift bus; Aino busy until about 14:52. Goes into a queue at 14:59 at the latest",
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
    assert [
        (start.key, start.priority, start.urgent)
        for start in waiting.waiting_starts(waiting.waiting_of(rows), SETTINGS)
    ] == [(2, "Critical", True), (1, "Normal", False), (3, "Low", False)]


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


def test_hidden_rows_are_counted():
    assert [waiting.more_words(count) for count in (0, 2, 5)] == ["", "", "Show 3 more"]


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
        "held until 15:16",
    ]
    assert (
        robots_for(row(), (AINO, VEIKKO), (HALL,), (replace(held, until=None),), SETTINGS, NOW)[1].note
        == "held until released"
    )


def test_the_card_says_for_what_the_robot_is_kept():
    bus = Schedule("Shift bus", None, KITS.id, NOW.replace(tzinfo=None), "UTC", id=9, group_id=5)
    coming = PlannedRun(NOW + timedelta(minutes=5), bus, AINO, KITS)
    held_back = row(wait_details={"group": "Hall 1", "robots": [], "kept_for": KITS.name})
    shown = facts(held_back, planned=(coming,), snapshots={1: snapshot(1, READY), 2: snapshot(2, READY)})
    assert present(shown, NOW).card.mission.note.startswith("Kept for ")
    assert present(shown, NOW).card.mission.note.endswith(" at 14:43")
    assert waiting.kept_for(shown, VEIKKO, NOW) == ""
    assert waiting.kept_for(replace(shown, open=()), AINO, NOW) == ""


def test_a_start_that_another_robot_may_take_is_probably_next():
    kits = Schedule("", None, KITS.id, NOW.replace(tzinfo=None), "UTC", id=9, group_id=5)
    coming = PlannedRun(
        NOW + timedelta(minutes=22), kits, AINO, KITS, group=HALL, begins_at=NOW + timedelta(minutes=22)
    )
    shown = facts(planned=(coming,), snapshots={1: snapshot(1, READY)})
    assert present(shown, NOW).card.mission.note.startswith(f"probably next: {KITS.name}, in 22 min")
    assert present(replace(shown, planned=(replace(coming, group=None),)), NOW).card.mission.note.startswith("next: ")


def test_a_run_of_a_group_says_why_it_came_here():
    chosen = replace(RUNNING, choice={"robots": [{"robot": "Aino"}, LOW]})
    [entry, *_rest] = queue_entries(replace(FACTS, open=(chosen,)), NOW)
    assert entry.origin.endswith(" · Aino: free now")  # the others' stories are in Logs


def test_other_robots_are_offered_for_a_start_that_a_silent_robot_may_have():
    lost = replace(row(60), state=State.SUBMITTING, robot_id=1, robot="Aino")
    silent = snapshot(1, READY, connection=Connection.UNREACHABLE)
    shown = facts(lost, snapshots={1: silent, 2: snapshot(2, READY)})
    [(found, start)] = waiting.starts_with_a_robot(shown, NOW)
    assert (found, start.is_stuck) == (lost, True)
    assert start.note.startswith("Aino may have it, no answer since ")
    assert [(option.key, option.text) for option in waiting.others_for(lost, (AINO, VEIKKO), (HALL,))] == [
        (2, "Veikko")
    ]
    [(_found, start)] = waiting.starts_with_a_robot(replace(shown, snapshots={1: snapshot(1, READY)}), NOW)
    assert not start.is_stuck
    assert waiting.starts_with_a_robot(facts(replace(lost, group_id=None), snapshots={1: silent}), NOW) == []


@pytest.mark.parametrize("state", [State.WAITING, State.SUBMITTING])
def test_a_start_that_is_being_sent_to_a_robot_is_there_until_that_has_it(state):
    """Seen: it went from robot to robot for half a minute, and nothing was shown where it had been pressed."""
    sent = replace(row(60), state=state, robot_id=2, robot="Veikko", wait=Wait.DUE)
    shown = facts(sent, snapshots={2: snapshot(2, READY)})
    [(found, start)] = waiting.starts_with_a_robot(shown, NOW)
    assert (found, start.note, start.is_stuck, start.can_give) == (sent, "Being sent to Veikko", False, False)
    assert waiting.starts_with_a_robot(facts(replace(sent, state=State.QUEUED, queue_id=7)), NOW) == []
    assert waiting.starts_with_a_robot(shown, sent.planned_at + timedelta(seconds=1)) == []  # mostly it has it by then


@pytest.mark.parametrize("wait", [Wait.HOLD, Wait.BATTERY, Wait.PLACE, Wait.CLOCK, Wait.ELSEWHERE, Wait.LATE_START])
def test_a_start_assigned_by_hand_that_still_waits_is_not_said_to_be_sent(wait):
    """It may wait for hours; the robot's queue says what for."""
    shown = replace(row(60), robot_id=2, robot="Veikko", wait=wait, wait_details={})
    assert waiting.starts_with_a_robot(facts(shown, snapshots={2: snapshot(2, READY)}), NOW) == []


def test_a_start_that_is_not_sent_again_is_not_said_to_be_sent():
    """It was started on another robot, while the first was silent."""
    withdrawn = replace(
        row(60), state=State.SUBMITTING, robot_id=1, robot="Aino", withdrawn=Reason(ReasonCode.USER_CANCELLED)
    )
    silent = snapshot(1, READY, connection=Connection.UNREACHABLE)
    assert waiting.starts_with_a_robot(facts(withdrawn, snapshots={1: silent}), NOW) == []


def test_the_priority_of_what_has_a_robot_is_settled():
    sent = replace(row(60), state=State.SUBMITTING, robot_id=2, robot="Veikko")
    [(_row, start)] = waiting.starts_with_a_robot(facts(sent, snapshots={2: snapshot(2, READY)}), NOW)
    assert start.has_robot
    assert not waiting.waiting_starts([row()], SETTINGS)[0].has_robot


# ---------------------------------------------------------------------- run now
def aimed(shown, target=None, mission=KITS.id):
    return run_now.aimed(present(shown, NOW, mission).run, shown, target or Target(5), NOW)


def test_groups_come_first_and_the_robot_is_the_default():
    view = aimed(facts(), Target())
    assert [(option.text, option.selected) for option in view.targets] == [("Any of Hall 1", False), ("Aino", True)]
    assert (view.text, view.can_be_first) == ("Run on Aino", False)
    view = aimed(facts())
    assert [(option.text, option.selected) for option in view.targets] == [("Any of Hall 1", True), ("Aino", False)]
    assert (view.text, view.off, view.can_be_first, view.note) == (
        "Run on any of Hall 1",
        False,
        True,
        "waits until 14:53 at most",
    )


def test_without_groups_run_now_is_as_ever():
    assert run_now.aimed(present(FACTS, NOW, KITS.id).run, FACTS, Target(5), NOW) == present(FACTS, NOW, KITS.id).run


@pytest.mark.parametrize(
    ("change", "text", "off"),
    [
        (
            {"robots": (replace(AINO, enabled=False), replace(VEIKKO, enabled=False))},
            "No robot of Hall 1 is switched on",
            True,
        ),
        ({"groups": (Group("Hall 1", id=5),)}, "Hall 1 has no robot", True),
        ({"known": {1: {"other"}, 2: {"other"}}}, "No robot of Hall 1 has this mission", True),
        ({"known": {1: {"other"}, 2: {KITS.guid}}}, "Run on any of Hall 1", False),
        ({"known": {1: {"other"}}}, "Run on any of Hall 1", False),  # the other one may have it
        ({"missions": (Mission("Own", "g", 77, robot_id=1),)}, "This mission is for one robot only", True),
        ({"holds": (Hold("Audit"),)}, "Queue, held", False),
    ],
)
def test_the_button_says_what_prevents_it(change, text, off):
    shown = replace(facts(), **change)
    view = aimed(shown, mission=77 if "missions" in change else KITS.id)
    assert (view.text, view.off) == (text, off)


def test_the_missions_of_a_group_say_which_robot_does_not_have_them():
    shown = replace(facts(), missions=(KITS,), all_missions=(KITS,), known={1: {KITS.guid}, 2: {"other"}})
    assert [option.note for option in run_now.mission_options(shown, Target(5))] == ["not on Veikko"]
    assert [option.note for option in run_now.mission_options(shown, Target())] == [""]


def test_a_group_that_sends_at_once_does_not_say_that_it_waits():
    at_once = replace(HALL, hand_over=HandOver.AT_ONCE)
    assert aimed(replace(facts(), groups=(at_once,))).note == "at once, also to a busy robot"
    assert aimed(replace(facts(), groups=(at_once,), holds=(Hold("Audit"),))).note == "skipped at 14:53 unless released"


def test_a_group_that_is_held_until_a_time_says_so_on_the_button():
    view = aimed(replace(facts(), holds=(Hold("Audit", NOW + timedelta(minutes=10)),)))
    assert (view.text, view.note) == ("Queue, held until 14:48", "")


def test_before_everything_else_is_critical():
    assert (Target(5).priority, Target(5, first=True).priority) == (1, 2)


@pytest.mark.parametrize(
    ("values", "holds", "words"),
    [
        ({}, (), "in 5 min"),
        ({"lacks_mission": True}, (), "no robot of the group has the mission"),
        ({}, (Hold(since=NOW, robot_id=1),), "in 5 min"),
        ({}, (Hold(since=NOW, robot_id=1), Hold(since=NOW, robot_id=2)), "held until released"),
    ],
)
def test_a_planned_start_says_that_no_robot_of_its_group_can_take_it(values, holds, words):
    schedule = Schedule("Kits", None, 1, NOW.replace(tzinfo=None), "UTC", id=9, group_id=5)
    run = PlannedRun(NOW + timedelta(minutes=5), schedule, unassigned_robot(HALL), KITS, group=HALL, **values)
    [start] = planned_starts(facts(planned=(run,), holds=holds), NOW)
    assert start.note == f"any of Hall 1 · {words}"
