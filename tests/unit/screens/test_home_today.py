"""Today: what one robot has done, does and will do, as rows of one list."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.robots import Hold
from app.domain.capabilities import Capabilities
from app.domain.execution import Reason, ReasonCode, State, Trigger, Wait
from app.domain.models import Connection, Group, Schedule
from app.domain.robot import QueueItem, QueueState, RobotState
from app.screens.common.execution_appearance import word
from app.screens.common.holding import HAND
from app.screens.common.mission_names import MissionNames
from app.screens.home.facts import HomeFacts
from app.screens.home.today import next_words, outcome_line, today
from app.services.planning.planned import PlannedRun, unassigned_robot
from app.widgets.items import Item
from tests.support import fleet_facts
from tests.support.home_facts import (
    AINO,
    ASKING,
    EXECUTING,
    FACTS,
    FAILED,
    HALL_1,
    HELD,
    KITS,
    NOW,
    QUEUE,
    QUEUED,
    READY,
    RUNNING,
    VEIKKO,
    WITH_WAITING,
    ago,
    execution,
    on_hold,
    snapshot,
    with_aino,
    without_aino,
)


def rows(facts: HomeFacts, room: float = 7.0) -> list[Item]:
    return list(today(facts, facts.robot, NOW, room))


def queue(facts: HomeFacts) -> list[Item]:
    """The running one and those that wait."""
    return [row for row in rows(facts, 99.0) if row.key[0] in ("execution", "item", "more")]


def planned(facts: HomeFacts) -> list[Item]:
    return [row for row in rows(facts) if row.key[0] in ("planned", "day")]


# ---------------------------------------------------------------------- the order
def test_the_day_is_one_list_from_what_is_done_to_what_is_planned():
    assert [(row.lead or row.number, row.title, row.meta) for row in rows(FACTS)] == [
        ("13:40", "Return to charger", ""),
        ("14:05", "Deliver kits to line 2", ""),
        ("Now", "Deliver kits to line 2", ""),
        ("1", "Collect empties", ""),
        ("2", "Bring pallet to dock", "Matti"),
        ("3", "Waste to compactor", "Needs 80 %"),
        ("15:00", "Deliver kits to line 2", ""),
        ("16:00", "Deliver kits to line 2", ""),
    ]


def test_the_robot_that_a_fleet_chose_is_named():
    taken = [replace(run, taken_by="MiR 7") if run.id == RUNNING.id else run for run in FACTS.open]
    done = [replace(run, taken_by="MiR 8") for run in FACTS.finished]
    supports = [row.support for row in rows(replace(FACTS, open=tuple(taken), finished=tuple(done)))]
    assert supports[:3] == ["MiR 8", "MiR 8", "MiR 7"]
    failed = [replace(run, state=State.FAILED, reason=Reason(ReasonCode.VANISHED, {"fleet": True})) for run in done]
    assert (
        rows(replace(FACTS, finished=tuple(failed)))[0].support == "MiR 8 · Failed: The fleet no longer has this order"
    )


def test_an_order_for_any_robot_of_a_fleet_is_ours_on_the_robot_that_took_it():
    for robot_id, said in ((fleet_facts.ANY.id, "MiR 2"), (12, "Any of Hall 2")):
        facts = fleet_facts.with_any_run().about(robot_id)
        (row,) = queue(facts)
        assert (row.key, row.support, row.actions[0].name) == (("execution", 61), said, "cancel")
        done = replace(FACTS.finished[0], robot_id=fleet_facts.ANY.id, robot="Any of Hall 2", taken_by="MiR 2")
        assert rows(replace(facts, finished=(done,)))[0].support == said


@pytest.mark.parametrize(
    ("status", "icon"), [(EXECUTING, "play"), (fleet_facts.PAUSED, "pause"), (FAILED, "alert-circle")]
)
def test_the_page_of_a_fleet_shows_a_run_as_its_robot_is(status, icon):
    facts = fleet_facts.with_any_run()
    facts = replace(facts, snapshots={**facts.snapshots, 12: replace(facts.snapshots[12], status=status)})
    assert [row.icon for row in queue(facts)] == [icon]


def test_a_run_that_the_queue_has_lost_is_not_shown_as_one_that_waits():
    lost = replace(FACTS, open=(RUNNING,), snapshots={**FACTS.snapshots, 1: snapshot(1, READY)})
    (row,) = queue(lost)
    assert (row.number, row.meta, row.actions) == ("", "not known now", ())
    (row,) = queue(replace(lost, open=(replace(RUNNING, submitted_at=ago(seconds=1)),)))
    assert row.number == "1"  # its queue was not read since


@pytest.mark.parametrize(("number", "can"), [(0, "cancel_running"), (1, "cancel_waiting")])
def test_what_a_fleet_cannot_cancel_says_why(number, can):
    facts = with_aino(EXECUTING, capabilities=Capabilities(**{can: False}))
    assert queue(facts)[number].actions[0].off == "The fleet can't do that. Do it at the robot."


def test_what_was_done_yesterday_is_not_of_this_day():
    last, *others = FACTS.finished
    yesterday = replace(last, ended_at=last.ended_at - timedelta(days=1))
    assert [row.lead for row in rows(replace(FACTS, finished=(yesterday, *others))) if row.key[0] == "run"] == ["13:40"]


@pytest.mark.parametrize(("room", "done"), [(7.0, 2), (5.8, 1), (4.9, 0), (2.0, 0)])
def test_what_is_done_gives_way_to_what_is_not(room, done):
    assert [row.key[0] for row in rows(FACTS, room)].count("run") == done


def test_what_waits_for_a_group_comes_after_now_with_its_reasons_and_takes_a_row_of_what_is_done():
    found = rows(replace(WITH_WAITING, open=WITH_WAITING.open[:4]), 6.9)
    assert [row.key[0] for row in found[:3]] == ["run", "execution", "waiting"]
    waits = found[2]
    assert waits.title == "Bring pallet to dock · any of Hall 1"
    assert waits.support == "Aino busy until about 14:52 · Veikko on hold · Sisu 19 % battery"
    assert (waits.tone, waits.look, [action.name for action in waits.actions]) == (
        "attention",
        "tint",
        ["here", "cancel"],
    )


def test_only_robots_of_the_group_show_it_the_most_important_first():
    keys = [row.key[1] for row in rows(WITH_WAITING) if row.key[0] == "waiting"]
    assert keys == [31, 32, 34, 33]
    other = replace(WITH_WAITING, groups=(replace(HALL_1, members=(2, 3)),))
    assert not [row for row in rows(other) if row.key[0] == "waiting"]


def test_a_start_that_a_silent_robot_may_have_can_be_started_here_but_not_on_that_robot():
    lost = replace(
        execution(60, VEIKKO, "Kits", State.SUBMITTING), group_id=HALL_1.id, robot_group="Hall 1", robot_id=VEIKKO.id
    )
    silent = snapshot(2, READY, connection=Connection.UNREACHABLE)
    facts = replace(FACTS, groups=(HALL_1,), open=(lost,), snapshots={**FACTS.snapshots, 2: silent})
    [row] = [row for row in rows(facts) if row.key == ("waiting", 60)]
    assert row.support.startswith("Veikko may have it, no answer since ")
    assert row.actions[0].name == "here"
    there = replace(facts, settings=replace(facts.settings, selected_robot_id=2))
    [row] = [row for row in rows(there) if row.key == ("waiting", 60)]
    assert [action.name for action in row.actions] == ["cancel"]


def test_nothing_at_all_is_said_and_a_missing_password_too():
    nothing = replace(with_aino(READY, ()), open=(), planned=(), finished=())
    assert [row.title for row in rows(nothing)] == ["Nothing done, nothing planned"]
    waiting = replace(nothing, robots=(replace(AINO, enabled=False, needs_password=True),))
    assert [row.title for row in rows(waiting)] == ["Nothing starts before its password is entered"]
    assert rows(nothing.about(3)) == []  # its plan is still to be read


# ---------------------------------------------------------------------- now
@pytest.mark.parametrize(
    ("status", "icon", "tone"),
    [
        (EXECUTING, "play", "accent"),
        (FAILED, "alert-circle", "fault"),
        (ASKING, "comment-question", "action"),
        (replace(EXECUTING, state=RobotState.PAUSE), "pause", "action"),
    ],
)
def test_the_row_of_now_has_the_tone_of_the_robot(status, icon, tone):
    now = queue(with_aino(status))[0]
    assert (now.icon, now.tone, now.look, now.actions[0].text) == (icon, tone, "tint", "Cancel")


def test_of_a_silent_robot_nothing_is_known_now_and_only_what_others_sent_can_not_be_cancelled():
    now, *others = queue(without_aino())
    assert (now.lead, now.meta, now.look, now.actions) == ("14:34", "not known now", "plain", ())
    assert [row.meta for row in others] == ["No answer", "No answer"]
    in_doubt = replace(HELD, state=State.SUBMITTING, attempts=1)
    silent = replace(
        FACTS,
        open=(RUNNING, QUEUED, in_doubt),
        snapshots={**FACTS.snapshots, 1: replace(FACTS.snapshots[1], read_at=ago(minutes=9))},
    )
    offs = {row.key: row.actions[0].off for row in queue(silent)[1:]}
    assert offs == {("execution", 2): "", ("item", 103): "Aino can't hear it", ("execution", 3): ""}


# ---------------------------------------------------------------------- the queue
def test_the_values_of_missions_are_next_to_their_names():
    here = {"goal": "a1c4e008-5d0f-11ef-93c1-0001297b6e20"}
    run = replace(FACTS.planned[0], schedule=replace(FACTS.planned[0].schedule, parameters=here))
    facts = replace(
        FACTS,
        open=tuple(replace(row, parameters=here) for row in (RUNNING, QUEUED, HELD)),
        planned=(run,),
        finished=(replace(FACTS.finished[0], parameters=here),),
        mission_names=MissionNames(names={here["goal"]: "Dock 3"}),
    )
    assert [row.title.partition(" · ")[2] for row in rows(facts)] == ["Dock 3"] * 3 + ["", "Dock 3", "Dock 3"]


@pytest.mark.parametrize(
    ("wait", "details", "words"),
    [
        (Wait.BATTERY, {"minimum": 80.0}, "Needs 80 %"),
        (Wait.BATTERY, {}, "battery unknown"),
        (Wait.RETRY, {}, "No answer"),
        (Wait.PLACE, {"place": "Dock 2"}, "Dock 2 is full"),
        (Wait.CLOCK, {}, "the tablet's clock"),
        (Wait.CHECK_UP, {}, "the fleet has to be checked up"),
        (Wait.CHECK_UP, {"user": "admin"}, "the app needs its own user at the fleet"),
        (Wait.ELSEWHERE, {}, "may have run already"),
        (Wait.ROBOT, {}, "waits for a robot"),
    ],
)
def test_a_blocked_start_says_why_in_its_row(wait, details, words):
    row = queue(replace(FACTS, open=(replace(HELD, wait=wait, wait_details=details),)))[-1]
    assert (row.meta, row.meta_tone, bool(row.meta_icon)) == (words, "attention", True)


def test_a_start_that_is_late_counts_down():
    late = replace(HELD, wait=Wait.LATE_START, listed_until=NOW + timedelta(seconds=24))
    assert queue(replace(FACTS, open=(late,)))[-1].meta == "Late, starts in 24 s"


def test_a_hold_that_ends_in_time_only_delays():
    kept = replace(HELD, wait=Wait.HOLD, wait_details={"hold": "Audit"})
    hold = Hold("Audit", NOW + timedelta(minutes=5), robot_id=AINO.id)
    assert queue(replace(FACTS, open=(kept,), holds=(hold,)))[-1].meta == "on hold"


def test_a_submission_is_recognised_by_its_token_before_its_number_is_stored():
    ours = execution(5, AINO, KITS.name, State.SUBMITTING, guid=KITS.guid)
    item = QueueItem(110, QueueState.PENDING, mission_id=KITS.guid, description="token-5")
    assert [row.key for row in queue(replace(with_aino(READY, (item,)), open=(ours,)))] == [("execution", 5)]


def test_a_row_stays_while_the_robot_has_taken_it_but_its_queue_was_not_read_yet():
    taken = execution(5, AINO, KITS.name, State.QUEUED, guid=KITS.guid, queue_id=111, submitted_at=NOW)
    (row,) = queue(replace(with_aino(READY, ()), open=(taken,)))
    assert (row.key, row.number) == (("execution", 5), "1")


def test_a_copy_of_ours_is_an_item_of_its_own():
    copy = QueueItem(120, QueueState.PENDING, mission_id=KITS.guid, description=RUNNING.token)
    facts = replace(with_aino(EXECUTING, (*QUEUE[:1], copy)), open=(RUNNING,))
    assert [row.key for row in queue(facts)] == [("execution", 1), ("item", 120)]


def test_what_is_being_cancelled_can_not_be_cancelled_again():
    asked = replace(RUNNING, cancel_code=ReasonCode.USER_CANCELLED)
    facts = replace(FACTS, open=(asked,), cancelling=frozenset({(AINO.id, 103)}))
    found = {row.key: row for row in queue(facts)}
    for key in (("execution", 1), ("item", 103)):
        assert (found[key].meta, found[key].actions) == ("Being cancelled", ())
    elsewhere = replace(FACTS, cancelling=frozenset({(VEIKKO.id, 103)}))  # robots number their items alike
    assert "Being cancelled" not in [row.meta for row in queue(elsewhere)]
    cleared = replace(FACTS, clearing=frozenset({AINO.id}))
    assert {row.meta for row in queue(cleared)} == {"Being cancelled"}


def test_other_robots_items_stay_away():
    theirs = execution(6, VEIKKO, "Elsewhere", State.WAITING)
    assert "Elsewhere" not in [row.title for row in queue(replace(FACTS, open=(*FACTS.open, theirs)))]


def test_a_very_long_queue_is_counted():
    many = tuple(QueueItem(number, QueueState.PENDING, mission_id=KITS.guid) for number in range(203))
    *_shown, more = queue(replace(with_aino(READY, many), open=()))
    assert (more.title, more.actions) == ("and 3 more", ())


def test_a_mission_that_was_not_entered_here_has_the_name_of_the_robot():
    item = QueueItem(9, QueueState.PENDING, mission_id="strange")
    facts = replace(with_aino(READY, (item,)), open=())
    assert facts.needs_name(item)
    assert facts.name_of(item) == "strange"
    assert replace(facts, names={"strange": "Wash the floor"}).name_of(item) == "Wash the floor"


# ---------------------------------------------------------------------- planned
def test_another_day_has_a_head():
    tomorrow = replace(FACTS.planned[1], at=NOW + timedelta(hours=26))
    found = planned(replace(FACTS, planned=(FACTS.planned[0], tomorrow)))
    assert [(row.look, row.lead or row.title) for row in found] == [
        ("plain", "15:00"),
        ("head", "Sat 21 Nov"),
        ("plain", "16:38"),
    ]


@pytest.mark.parametrize(("minutes", "words"), [(None, "on hold"), (60, "on hold, not run"), (30, "on hold")])
def test_a_planned_start_in_a_hold_says_so_once(minutes, words):
    until = NOW + timedelta(minutes=minutes) if minutes else None
    held = replace(FACTS, holds=(Hold("Maintenance", until, ago(minutes=1), robot_id=AINO.id),))
    first, second = planned(held)
    assert (first.meta, first.icon) == (words, HAND)
    assert second.meta in ("", words)
    alone = replace(FACTS, planned=(replace(FACTS.planned[0], held=True), *FACTS.planned[1:]))
    assert [(row.meta, row.icon) for row in planned(alone)] == [("on hold", HAND), ("", "clock-outline")]


def test_a_start_that_was_released_is_not_on_hold_until_its_worker_looks_again():
    waits = replace(HELD, wait=Wait.HOLD, wait_details={"hold": "Maintenance"})
    hold = Hold("Maintenance", None, ago(minutes=1))
    for holds, held, words in (((hold,), False, "on hold, not run from"), ((), False, ""), ((), True, "on hold, not")):
        facts = replace(FACTS, open=(replace(waits, held=held),), holds=holds, snapshots={})
        assert [row.meta[: len(words) or None] for row in queue(facts)] == [words]


def test_planned_starts_of_a_stopped_robot_are_for_when_it_is_back():
    assert [row.meta for row in planned(with_aino(FAILED))] == ["if Aino is back", ""]
    assert [row.meta for row in planned(without_aino())] == ["", ""]  # the card says that it does not answer


def test_a_start_of_a_group_names_it_and_that_no_robot_can_do_it():
    hall = Group("Hall 1", (1, 2), id=5)
    schedule = Schedule("Kits", None, 1, NOW.replace(tzinfo=None), "UTC", id=9, group_id=5)
    run = PlannedRun(NOW + timedelta(minutes=5), schedule, unassigned_robot(hall), KITS, group=hall, lacks_mission=True)
    [row] = planned(replace(FACTS, planned=(run,)))
    assert row.title == "Deliver kits to line 2 · any of Hall 1"
    assert (row.meta, row.meta_tone) == ("no robot of the group has the mission", "attention")


def test_a_start_without_a_value_that_its_mission_needs_says_so_before_its_time():
    [first, *_others] = planned(replace(FACTS, refused=frozenset([FACTS.planned[0].schedule.id])))
    assert (first.meta, first.meta_tone) == ("a value is missing or wrong", "attention")


def test_nothing_of_the_plan_starts_by_itself_while_all_is_on_hold():
    assert [row.icon for row in planned(on_hold(FACTS))] == [HAND, "clock-outline"]  # the second is after the hold
    assert [row.meta for row in planned(on_hold(FACTS))] == ["on hold, not run", ""]


def test_a_start_that_another_robot_may_take_is_only_about_next():
    kits = Schedule("", None, KITS.id, NOW.replace(tzinfo=None), "UTC", id=9, group_id=5)
    at = NOW + timedelta(minutes=22)
    coming = PlannedRun(at, kits, AINO, KITS, group=HALL_1, begins_at=at)
    assert next_words(replace(FACTS, planned=(coming,)), AINO, NOW)[0] == f"Next about 15:00 {KITS.name}"


def test_the_card_says_for_what_the_robot_is_kept():
    bus = Schedule("Shift bus", None, KITS.id, NOW.replace(tzinfo=None), "UTC", id=9, group_id=5)
    coming = PlannedRun(NOW + timedelta(minutes=5), bus, AINO, KITS)
    waits = replace(WITH_WAITING.open[-1], wait_details={"group": "Hall 1", "robots": [], "kept_for": KITS.name})
    facts = replace(FACTS, planned=(coming,), open=(waits,))
    assert next_words(facts, AINO, NOW)[1].endswith(" at 14:43")
    assert next_words(replace(facts, open=()), AINO, NOW)[1] == ""


# ---------------------------------------------------------------------- done
@pytest.mark.parametrize(
    ("said", "line"), [("No way", "No way"), ("Failed to reach goal position 'Dock 3'", "Can't reach Dock 3")]
)
def test_what_did_not_go_well_says_why_in_our_words(said, line):
    failed = execution(
        14, AINO, "M", State.FAILED, ended_at=NOW, reason=Reason(ReasonCode.ROBOT_ABORTED, {"message": said})
    )
    row = rows(replace(FACTS, finished=(failed,)))[0]
    assert (row.lead, row.support, row.tone) == ("14:38", f"Failed: {line}", "fault")


@pytest.mark.parametrize("code", list(ReasonCode))
def test_every_reason_makes_a_line(code):
    reason = Reason(code)
    ended = execution(20, AINO, "M", reason.state, Trigger.SCHEDULED, ended_at=NOW, reason=reason)
    assert len(outcome_line(ended).removeprefix(f"{word(reason.state)}: ")) > 5


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
    def line(code):
        return outcome_line(execution(5, AINO, KITS.name, State.CANCELLED, reason=Reason(code)))

    assert line(ReasonCode.USER_CANCELLED) == "Cancelled by a person"
    assert line(ReasonCode.QUEUE_CLEARED) == "Cancelled with the robot's whole queue"
