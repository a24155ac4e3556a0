"""Home's lists in words: the queue, what is planned and what has just finished."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.robots import Hold
from app.domain.models import Connection, Group, Reason, ReasonCode, State, Trigger, Wait
from app.domain.robot import QueueItem, QueueState
from app.screens.common.execution_appearance import word
from app.screens.common.mission_names import MissionNames
from app.screens.home.lists import (
    NOT_BLOCKED,
    Blocked,
    finished_runs,
    outcome_line,
    planned_starts,
    queue_entries,
    queue_note,
    robot_summaries,
    trigger_words,
)
from app.screens.home.view import present
from tests.support.home_facts import (
    AINO,
    FACTS,
    HELD,
    KITS,
    NOW,
    QUEUE,
    QUEUED,
    READY,
    RUNNING,
    VEIKKO,
    ago,
    execution,
    with_aino,
)


# ---------------------------------------------------------------------- the queue
def test_the_values_of_missions_are_next_to_their_names():
    here = {"goal": "a1c4e008-5d0f-11ef-93c1-0001297b6e20"}
    run = replace(FACTS.planned[0], schedule=replace(FACTS.planned[0].schedule, parameters=here))
    rows = [replace(row, parameters=here) for row in (RUNNING, QUEUED, HELD)]
    facts = replace(
        FACTS,
        open=tuple(rows),
        planned=(run,),
        finished=(replace(FACTS.finished[0], parameters=here),),
        mission_names=MissionNames(names={here["goal"]: "Dock 3"}),
    )
    named = (*queue_entries(facts, NOW), *planned_starts(facts, NOW), *finished_runs(facts, NOW))
    assert [row.mission.partition(" · ")[2] for row in named] == ["Dock 3", "Dock 3", "", "Dock 3", "Dock 3", "Dock 3"]
    assert present(facts, NOW).card.mission.name == f"{RUNNING.mission} · Dock 3"


@pytest.mark.parametrize(
    ("minutes", "held", "words"),
    [
        (None, False, "On hold: Audit; skipped at 14:50 unless released"),
        (5, False, "Held until 14:43: Audit"),
        (30, False, "On hold: Audit; skipped at 14:50 unless released"),
        (None, True, "On hold; skipped at 14:50 unless released"),
    ],
)
def test_a_start_that_is_held_says_as_run_now_its_outcome(minutes, held, words):
    kept = replace(HELD, wait=Wait.HOLD, wait_details={} if held else {"hold": "Audit"}, held=held)
    hold = Hold("Audit", NOW + timedelta(minutes=minutes) if minutes else None, robot_id=AINO.id)
    row = queue_entries(replace(FACTS, open=(kept,), holds=() if held else (hold,)), NOW)[-1]
    assert row.origin == f"Waste, extra round · {words}"


def test_the_later_end_of_two_holds_counts():
    short, long = (
        Hold("Audit", NOW + timedelta(minutes=5)),
        Hold("Cleaning", NOW + timedelta(minutes=60), robot_id=AINO.id),
    )
    row = queue_entries(
        replace(FACTS, open=(replace(HELD, wait=Wait.HOLD, wait_details={"hold": "Audit"}),), holds=(short, long)), NOW
    )[-1]
    assert row.origin == "Waste, extra round · On hold: Cleaning; skipped at 14:50 unless released"


def test_the_queue_names_the_source_of_every_item():
    rows = queue_entries(FACTS, NOW)
    assert [(row.mission, row.origin) for row in rows] == [
        ("Deliver kits to line 2", "Run now · started 14:33"),
        ("Collect empties", "Run now · since 14:36"),
        ("Bring pallet to dock", "Matti · 14:37 robot time"),
        ("Waste to compactor", "Waste, extra round · Battery 78 % is under 80 %; waits until 14:50"),
    ]
    assert [row.key for row in rows] == [("execution", 1), ("execution", 2), ("item", 103), ("execution", 3)]
    assert [row.number for row in rows] == ["", "1", "2", ""]
    assert queue_note(FACTS, NOW) == "1 running, 3 waiting"


def test_a_blocked_start_is_shown_above_the_queue():
    assert present(FACTS, NOW).queue_blocked == Blocked("1 blocked: battery", ("execution", 3))
    silent = replace(HELD, id=4, wait=Wait.RETRY)
    assert present(replace(FACTS, open=(silent, HELD, replace(HELD, id=5))), NOW).queue_blocked == Blocked(
        "3 blocked: no answer, battery", ("execution", 4)
    )
    assert (
        present(replace(FACTS, open=(RUNNING, QUEUED, replace(HELD, wait=Wait.DUE))), NOW).queue_blocked == NOT_BLOCKED
    )


def test_an_item_without_a_creator_belongs_to_the_robot():
    facts = replace(with_aino(READY, (QueueItem(9, QueueState.PENDING, mission_id="g4"),)), open=())
    assert queue_entries(facts, NOW)[0].origin == "The robot itself"


def test_a_submission_is_recognised_by_its_token_before_its_number_is_stored():
    ours = execution(5, AINO, KITS.name, State.SUBMITTING, guid=KITS.guid, schedule="Kits")
    facts = replace(
        with_aino(READY, (QueueItem(110, QueueState.PENDING, mission_id=KITS.guid, description="token-5"),)),
        open=(ours,),
    )
    rows = queue_entries(facts, NOW)
    assert len(rows) == 1
    assert rows[0].origin.startswith("Kits")


def test_a_row_stays_while_the_robot_has_taken_it_but_its_queue_was_not_read_yet():
    taken = execution(5, AINO, KITS.name, State.QUEUED, guid=KITS.guid, schedule="Kits", queue_id=111, submitted_at=NOW)
    (row,) = queue_entries(replace(with_aino(READY, ()), open=(taken,)), NOW)
    assert (row.key, row.number, row.origin) == (("execution", 5), "1", "Kits · since 14:38")


def test_a_start_that_is_being_cancelled_cannot_be_cancelled_again():
    asked = replace(RUNNING, cancel_code=ReasonCode.USER_CANCELLED)
    facts = replace(FACTS, open=(asked,), cancelling=frozenset({(AINO.id, 103)}))
    rows = {row.key: row for row in queue_entries(facts, NOW)}
    assert rows["execution", 1].origin == rows["item", 103].origin == "Being cancelled"
    assert not rows["execution", 1].cancellable


def test_an_item_that_the_robot_dropped_waits_for_nothing():
    stopped = replace(RUNNING, cancel_code=ReasonCode.USER_CANCELLED)
    facts = replace(with_aino(READY, QUEUE[2:]), open=(stopped,))
    waits, leaves = queue_entries(facts, NOW)
    assert (waits.number, leaves.number, leaves.icon, leaves.origin) == ("1", "", "cancel", "Being cancelled")
    assert queue_note(facts, NOW) == "1 waiting"


def test_robots_number_their_items_alike():
    facts = replace(FACTS, cancelling=frozenset({(VEIKKO.id, 103)}))
    assert "Being cancelled" not in [row.origin for row in queue_entries(facts, NOW)]
    assert "Being cancelled" in [
        row.origin for row in queue_entries(replace(facts, cancelling=frozenset({(AINO.id, 103)})), NOW)
    ]


def test_a_late_start_counts_down():
    late = replace(HELD, wait=Wait.LATE_START, listed_until=NOW + timedelta(seconds=24))
    row = queue_entries(replace(FACTS, open=(late,), snapshots={}), NOW)[0]
    assert row.origin == "Waste, extra round · late, because the app was off; starts in 24 s"


def test_other_robots_items_stay_away():
    theirs = execution(6, VEIKKO, "Elsewhere", State.WAITING)
    assert all(row.mission != "Elsewhere" for row in queue_entries(replace(FACTS, open=(*FACTS.open, theirs)), NOW))


def test_clearing_counts_what_is_on_the_robot_and_what_waits_here():
    assert present(FACTS, NOW).controls.clear_count == len(QUEUE) + 1


def test_a_mission_that_was_not_entered_here_has_the_name_of_the_robot():
    item = QueueItem(9, QueueState.PENDING, mission_id="strange")
    facts = replace(with_aino(READY, (item,)), open=())
    assert facts.needs_name(item)
    assert facts.name_of(item) == "strange"
    assert replace(facts, names={"strange": "Wash the floor"}).name_of(item) == "Wash the floor"


# ---------------------------------------------------------------------- before and after
def test_planned_starts_say_when_and_where():
    rows = planned_starts(FACTS, NOW)
    assert [(row.time, row.mission, row.note) for row in rows[:2]] == [
        ("15:00", "Deliver kits to line 2", "Aino · in 22 min"),
        ("15:10", "Collect empties", "Veikko · in 32 min"),
    ]
    assert [row.day for row in rows] == ["", "", "", "", ""]
    [tomorrow] = planned_starts(replace(FACTS, planned=(replace(FACTS.planned[4], at=NOW + timedelta(hours=26)),)), NOW)
    assert (tomorrow.day, tomorrow.note) == ("Sat 21 Nov", "Veikko")  # how soon it is, its day says
    early = replace(FACTS.planned[0], at=NOW + timedelta(hours=16))
    [row] = planned_starts(replace(FACTS, planned=(early,)), NOW)
    assert (row.day, row.note) == ("Sat 21 Nov", "Aino · in 16 h")


@pytest.mark.parametrize(
    ("until", "words"),
    [
        (None, "held until released"),
        (NOW + timedelta(minutes=60), "skipped: held until 15:38"),
        (NOW + timedelta(minutes=30), "held until 15:08"),
    ],
)
def test_a_planned_start_in_a_hold_says_so_instead_of_how_soon_it_comes(until, words):
    held = replace(FACTS, holds=(Hold("Maintenance", until, ago(minutes=1), robot_id=AINO.id),))
    rows = planned_starts(held, NOW)
    assert (rows[0].note, rows[0].icon) == (f"Aino · {words}", "hand-back-right-outline")
    assert (rows[1].note, rows[1].icon) == ("Veikko · in 32 min", "")
    idle = replace(with_aino(READY, ()), holds=held.holds)
    assert present(idle, NOW).card.mission.note == f"next: Deliver kits to line 2, {words}"


@pytest.mark.parametrize(
    ("connection", "words"),
    [
        (Connection.UNREACHABLE, "No answer · "),
        (Connection.UNAUTHORIZED, "Wrong password · "),
        (Connection.WRONG_ROBOT, "Another robot · "),
        (Connection.UNTRUSTED, "Another certificate · "),
        (Connection.SLOW, ""),
        (Connection.UNKNOWN, ""),
    ],
)
def test_a_planned_start_of_a_robot_that_gives_no_answer_to_trust_says_why(connection, words):
    silent = replace(
        FACTS,
        snapshots={**FACTS.snapshots, 1: replace(FACTS.snapshots[1], connection=connection, since=ago(minutes=4))},
    )
    rows = planned_starts(silent, NOW)
    assert [row.note for row in rows[:2]] == [f"Aino · {words}in 22 min", "Veikko · in 32 min"]
    of_group = replace(FACTS.planned[0], group=Group("Hall", (1, 2)), begins_at=FACTS.planned[0].at)
    assert (
        planned_starts(replace(silent, planned=(of_group,)), NOW)[0].note == "any of Hall (≈ Aino) · in 22 min"
    )  # or another one
    held = replace(silent, holds=(Hold("Maintenance", None, ago(minutes=1), robot_id=AINO.id),))
    assert planned_starts(held, NOW)[0].note == "Aino · held until released"


def test_an_old_level_of_a_battery_is_not_shown_as_one_of_now():
    silent = replace(
        FACTS.snapshots[2], connection=Connection.UNREACHABLE, since=ago(minutes=4), read_at=ago(minutes=5)
    )
    chip = robot_summaries(replace(FACTS, snapshots={**FACTS.snapshots, 2: silent}), NOW)[1]
    assert (chip.word, chip.battery, chip.battery_icon, chip.battery_tone) == (
        "No answer",
        "–",
        "battery-unknown",
        "offline",
    )


def test_a_start_held_alone_shows_its_hold():
    kept = replace(FACTS, planned=(replace(FACTS.planned[0], held=True), *FACTS.planned[1:]))
    rows = planned_starts(kept, NOW)
    assert (rows[0].note, rows[0].icon) == ("Aino · held until released", "hand-back-right-outline")
    assert rows[1].icon == ""


def test_finished_runs_carry_their_reason_and_only_the_abnormal_ones_colour():
    rows = finished_runs(FACTS, NOW)
    assert [row.reason for row in rows[:4]] == [
        "Not run: Battery 12 % stayed under 30 % until 14:30",
        "Completed in 8 min 05 s",
        "Completed in 5 min 55 s",
        "Failed: Failed to reach goal position 'Dock 3'",
    ]
    assert [row.abnormal for row in rows[:4]] == [True, False, False, True]
    assert rows[0].when == "Sisu 14:30"


def test_a_start_that_ended_without_a_robot_names_its_group():
    ended = execution(
        20, AINO, "M", State.FAILED, ended_at=NOW, reason=Reason(ReasonCode.NO_ROBOT), robot_group="Hall 1"
    )
    [row] = finished_runs(replace(FACTS, finished=(replace(ended, robot_id=None, robot=""),)), NOW)
    assert row.when == "Hall 1 14:38"


@pytest.mark.parametrize("code", list(ReasonCode))
def test_every_reason_makes_a_line(code):
    reason = Reason(code)
    ended = execution(20, AINO, "M", reason.state, Trigger.SCHEDULED, ended_at=NOW, reason=reason)
    assert len(outcome_line(ended).removeprefix(f"{word(reason.state)}: ")) > 5


def test_yesterdays_run_shows_its_day():
    yesterday = execution(21, AINO, "M", State.COMPLETED, ended_at=ago(hours=20))
    assert finished_runs(replace(FACTS, finished=(yesterday,)), NOW)[0].when == "Aino Thu 19 Nov 18:38"


def test_the_source_of_an_item_is_a_typed_name_and_not_a_generated_one():
    own_name = execution(5, AINO, KITS.name, State.WAITING, schedule="Night kits 2")
    made = [replace(own_name, schedule=f"{KITS.name} on Aino{number}") for number in ("", " 2")]
    assert [trigger_words(row) for row in (own_name, *made)] == ["Night kits 2", "Schedule", "Schedule"]
    of_group = replace(own_name, schedule=f"{KITS.name} on Hall 1 2", robot_group="Hall 1")  # on any robot
    assert trigger_words(of_group) == "Schedule"


@pytest.mark.parametrize(
    ("details", "line"),
    [
        ({"skipped_at": NOW.isoformat()}, "Not run: Skipped by a person on 20 Nov 2026 14:38"),
        ({}, "Not run: Skipped or put on hold by a person"),
        ({"paused_until": NOW.isoformat()}, "Not run: The schedule was paused until 20 Nov 2026 14:38"),
    ],
)
def test_a_skipped_start_was_not_run(details, line):
    assert outcome_line(execution(5, AINO, KITS.name, State.SKIPPED, reason=Reason(ReasonCode.HOLD, details))) == line


def test_a_cancellation_by_a_person_is_said_once():
    def line(code, **details):
        return outcome_line(execution(5, AINO, KITS.name, State.CANCELLED, reason=Reason(code, details)))

    assert line(ReasonCode.USER_CANCELLED) == "Cancelled by a person"
    assert line(ReasonCode.QUEUE_CLEARED) == "Cancelled with the robot's whole queue"
    assert line(ReasonCode.SCHEDULE_CHANGED, deleted=True) == "Cancelled: Its schedule was deleted while it waited"
