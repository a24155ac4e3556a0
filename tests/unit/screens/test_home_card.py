"""The card of one robot in each of its states: what it says, its one button, what is off and why."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.robots import Hold
from app.domain.activity import ActivitySpan
from app.domain.capabilities import Capabilities
from app.domain.execution import DurationEstimate
from app.domain.models import Connection, IdleRule, Robot, RobotSnapshot
from app.domain.robot import QueueItem, QueueState, RobotProblem, RobotState, UserPrompt
from app.screens.home.card import Card, battery_words, can_reset
from app.screens.home.facts import HomeFacts, standing
from app.screens.home.view import ALL_ROBOTS, present, tabs
from app.services.planning.working_days import WorkingCalendar
from tests.support import fleet_facts
from tests.support.home_facts import (
    AINO,
    ASKING,
    CHARGER,
    CHARGING,
    EXECUTING,
    FACTS,
    FAILED,
    HOLD,
    KITS,
    NOW,
    READY,
    SETTINGS,
    STOPPED,
    VEIKKO,
    ago,
    on_hold,
    with_aino,
    without_aino,
)

PAUSED = replace(EXECUTING, state=RobotState.PAUSE)
MANUAL = replace(EXECUTING, state=RobotState.MANUAL_CONTROL)
HARDWARE = replace(FAILED, errors=(RobotProblem(9000, "Spindle broken", "Safety", resettable=False),))


def card(facts: HomeFacts) -> Card:
    return present(facts, NOW).card


def of(status, **values) -> Card:
    return card(with_aino(status, **values))


# ---------------------------------------------------------------------- through a fleet
WHY_NOT = "The fleet can't do that. Do it at the robot."


@pytest.mark.parametrize(
    ("status", "can", "why"),
    [
        (EXECUTING, {"pause": False}, WHY_NOT),
        (PAUSED, {"pause": False}, WHY_NOT),
        (FAILED, {"clear_error": False}, WHY_NOT),
        (EXECUTING, {"clear_error": False}, ""),
        (FAILED, {"pause": False}, ""),
    ],
)
def test_what_its_fleet_cannot_do_is_off_and_says_why(status, can, why):
    foot = of(status, capabilities=Capabilities(**can)).foot
    assert (foot.off, foot.why) == (bool(why), why)


def test_a_question_that_its_fleet_cannot_answer_is_answered_at_the_robot():
    note = of(ASKING, capabilities=Capabilities(prompts=False)).note
    assert (note.answers, note.step) == ((), WHY_NOT)
    assert note.problem


def test_any_robot_of_a_fleet_has_an_icon_of_its_own_in_the_tabs():
    assert [tab.icon for tab in tabs(fleet_facts.of_fleet(READY), None, NOW)] == ["robot", "check-circle-outline"]


def test_any_robot_of_a_fleet_says_how_many_are_free_and_where_to_pause():
    shown = card(fleet_facts.of_fleet(READY, EXECUTING, FAILED))
    assert (shown.state, shown.icon) == ("1 of 3 free", "robot")
    assert (shown.foot.text, shown.foot.off, shown.foot.why) == ("Pause", True, "Pause a robot on its own page.")


def test_the_card_of_a_fleet_tells_no_single_run_as_several_robots_may_have_one():
    shown = card(fleet_facts.with_any_run())
    assert (shown.state, shown.mission, shown.left, shown.end) == ("1 of 2 free", "Nothing planned", "", "")


def test_a_silent_fleet_is_asked_about_in_the_place_of_its_robots():
    shown = card(fleet_facts.of_fleet(READY, silent=True))
    assert (shown.state, shown.note.problem, shown.note.step) == (
        "No answer",
        "Hall 2 is silent. Is its server on?",
        "Ask IT about the server if it is.",
    )
    assert (shown.send_note, shown.said) == ("Sent when Hall 2 answers", "")


@pytest.mark.parametrize(
    ("connection", "state", "problem"),
    [
        (Connection.UNAUTHORIZED, "Wrong password", "Look at Hall 2 in Settings."),
        (Connection.WRONG_ROBOT, "Another fleet", "Look at Hall 2 in Settings."),
        (Connection.NOT_A_ROBOT, "Another fleet", "Look at Hall 2 in Settings."),
        (Connection.UNTRUSTED, "Another certificate", "Look at Hall 2 in Settings."),
    ],
)
def test_what_is_wrong_with_a_fleet_is_mended_there(connection, state, problem):
    facts = fleet_facts.of_fleet(READY, silent=True)
    found = {number: replace(shot, connection=connection) for number, shot in facts.snapshots.items()}
    shown = card(replace(facts, snapshots=found))
    assert (shown.state, shown.note.problem) == (state, problem)


def test_nothing_is_sent_to_a_fleet_that_could_be_another_one():
    facts = fleet_facts.of_fleet(READY)
    assert not card(facts).send_off
    unknown = fleet_facts.ANY.within(replace(fleet_facts.HALL_2, identity=None))
    assert card(replace(facts, robots=(unknown,))).send_off == "Give the app its own user at the fleet"


def test_a_robot_that_its_fleet_has_replaced_is_added_again():
    facts = fleet_facts.of_fleet(READY, READY).about(11)
    other = replace(facts.snapshots[11], connection=Connection.WRONG_ROBOT)
    note = card(replace(facts, snapshots={**facts.snapshots, 11: other})).note
    assert (note.problem, note.step) == (
        "The fleet has another robot in its place.",
        "Delete it here, and add the new one.",
    )


def test_a_silent_fleet_counts_once_in_the_tab_of_all_robots():
    assert tabs(fleet_facts.of_fleet(*[READY] * 10, silent=True), None, NOW)[0].count == 1


def test_a_fleet_clears_only_what_was_sent_from_here():
    all_of_them = present(with_aino(EXECUTING), NOW).clear_count
    ours = present(with_aino(EXECUTING, capabilities=Capabilities(own_queue=False)), NOW).clear_count
    assert (all_of_them, ours) == (4, len(FACTS.open_here))
    assert ours < all_of_them


# ---------------------------------------------------------------------- the table of states
@pytest.mark.parametrize(
    ("facts", "state", "tone", "problem", "foot", "why", "send_off", "send_note"),
    [
        (FACTS, "Working", "accent", "", "Pause", "", "", ""),
        (with_aino(READY, ()), "Ready", "neutral", "", "Pause", "", "", ""),
        (with_aino(CHARGING, ()), "Charging", "neutral", "", "Pause", "", "", ""),
        (with_aino(PAUSED), "Paused", "action", "", "Resume", "", "", "Starts after Resume"),
        (with_aino(ASKING), "Asks", "action", "Is the pallet loaded at Dock 3?", "Pause", "", "", ""),
        (with_aino(FAILED), "Stopped", "fault", "Can't reach Line 2", "Reset errors", "", "Reset errors first", ""),
        (
            with_aino(HARDWARE),
            "Stopped",
            "fault",
            "“Spindle broken (9000)”",
            "Resume",
            "after Reset on the robot",
            "Not while Aino is stopped",
            "",
        ),
        (
            with_aino(STOPPED),
            "Stopped",
            "fault",
            "Release the red button. Then press Reset on the robot.",
            "Resume",
            "after Reset on the robot",
            "Not while Aino is stopped",
            "",
        ),
        (
            with_aino(MANUAL),
            "Manual control",
            "attention",
            "Driven by hand. Turn the key back.",
            "Pause",
            "Driven by hand",
            "",
            "Waits while it is driven by hand",
        ),
        (
            without_aino(),
            "No answer",
            "attention",
            "Is it switched on?",
            "Pause",
            "Aino can't hear it. Use the button on the robot.",
            "",
            "Sent when Aino answers",
        ),
        (on_hold(FACTS), "Working", "accent", "", "Pause", "", "", "On hold, not run from 14:53"),
        (
            replace(FACTS, robots=(replace(AINO, enabled=False), VEIKKO)),
            "Off",
            "offline",
            "Switched off in Settings.",
            "Pause",
            "Aino is off",
            "Aino is off",
            "",
        ),
        (
            replace(FACTS, robots=(replace(AINO, enabled=False, needs_password=True),)),
            "Off",
            "attention",
            "Enter its password in Settings.",
            "Pause",
            "Aino is off",
            "Aino is off",
            "",
        ),
        (
            replace(FACTS, snapshots={}),
            "–",
            "offline",
            "",
            "Pause",
            "Not read yet",
            "",
            "Sent when Aino answers",
        ),
        (
            with_aino(replace(READY, state=RobotState.STARTING), ()),
            "Starting up",
            "offline",
            "",
            "Pause",
            "Aino can't hear it",
            "",
            "",
        ),
    ],
)
def test_each_state_says_what_it_is_and_what_can_be_done(facts, state, tone, problem, foot, why, send_off, send_note):
    shown = card(facts)
    assert (shown.state, shown.tone, shown.note.problem) == (state, tone, problem)
    assert (shown.foot.text, shown.foot.why, shown.foot.off) == (foot, why, bool(why))
    assert (shown.send_off, shown.send_note) == (send_off, send_note)
    assert len(why.split()) <= 10


def test_without_a_robot_there_is_nothing_to_press():
    empty = present(HomeFacts(), NOW)
    assert not empty.has_robots
    assert empty.card.foot.off


def test_the_first_robot_is_shown_after_the_selected_one_was_deleted():
    assert replace(FACTS, settings=replace(SETTINGS, selected_robot_id=99)).robot == AINO


# ---------------------------------------------------------------------- working
def test_a_running_mission_shows_how_long_it_takes_yet():
    shown = card(FACTS)
    assert (shown.mission, shown.left, shown.end, shown.end_tone) == (KITS.name, "2 min left", "done 14:40", "neutral")
    assert shown.progress == pytest.approx(252 / 390)


@pytest.mark.parametrize(
    ("usual", "left", "end", "tone"),
    [
        (DurationEstimate(100.0, 110.0), "", "2 min longer than usual", "attention"),
        (DurationEstimate(200.0, 210.0), "soon done", "", "neutral"),
        (DurationEstimate(100.0, 110.0, typed=True), "soon done", "", "neutral"),  # a guess raises no concern
        (DurationEstimate(0.0, 0.0), "", "since 14:33", "neutral"),
    ],
)
def test_a_run_that_takes_longer_than_usual_says_by_how_much(usual, left, end, tone):
    shown = card(replace(FACTS, expected={KITS.guid: usual}))
    assert (shown.left, shown.end, shown.end_tone) == (left, end, tone)


def test_a_first_run_has_nothing_to_compare_with():
    shown = card(replace(FACTS, expected={}))
    assert (shown.progress, shown.left, shown.end) == (-1, "", "since 14:33")


def test_a_mission_that_charges_is_not_compared_with_earlier_runs():
    """It ends when the robot is charged or gets another one."""
    charging = replace(EXECUTING, mission_text="Charging... Waiting for new mission...")
    shown = card(replace(with_aino(charging), expected={KITS.guid: DurationEstimate(100.0, 110.0)}))
    assert (shown.state, shown.mission, shown.progress, shown.end) == ("Charging", KITS.name, -1, "")
    until = replace(EXECUTING, mission_text="Charging until battery reaches 95% (Current: 94%)...")
    assert of(until).mission == "Charging to 95 %"


def test_by_a_wrong_clock_no_end_is_foretold():
    shown = card(replace(FACTS, holds=(Hold(clock=True),)))
    assert (shown.left, shown.end, shown.send_note) == ("2 min left", "", "Sent when the clock is right")


@pytest.mark.parametrize(
    ("state", "activities", "left"),
    [
        ("executing", [("executing", 252, 120), ("paused", 120, 60), ("executing", 60, 0)], "3 min left"),
        ("executing", [("executing", 252, 120), ("paused", 120, 60)], "4 min left"),  # going on was read 2 s ago
        ("executing", [("paused", 900, 600), ("executing", 600, 0)], "2 min left"),  # before it began
    ],
)
def test_the_time_of_a_pause_does_not_count(state, activities, left):
    spans = tuple(ActivitySpan(activity, ago(seconds=start), ago(seconds=end)) for activity, start, end in activities)
    assert card(replace(FACTS, activities=spans)).left == left


def test_a_working_robot_with_an_unread_queue_is_not_said_to_do_nothing():
    assert of(EXECUTING, queue=()).mission == "–"


def test_somebody_elses_mission_has_the_robots_name_for_it():
    facts = replace(
        with_aino(EXECUTING, (QueueItem(7, QueueState.EXECUTING, mission_id="strange"),)),
        open=(),
        names={"strange": "Wash the floor"},
        seen_running={(AINO.id, 7): ago(seconds=65)},
    )
    assert (card(facts).mission, card(facts).end) == ("Wash the floor", "since 14:36")
    other = replace(facts, seen_running={(VEIKKO.id, 7): ago(seconds=65)})  # numbers repeat between robots
    assert other.running_since(other.running) is None


# ---------------------------------------------------------------------- ready
def test_an_idle_robot_says_what_comes_next():
    assert of(READY, queue=()).mission == "Next 15:00 Deliver kits to line 2"
    assert card(replace(with_aino(READY, ()), planned=())).mission == "Nothing planned"
    assert card(replace(with_aino(READY, ()), planned=(), is_new=True)).mission == ""  # until it is read


@pytest.mark.parametrize(
    ("battery", "mission", "words"),
    [
        (12.0, CHARGER, "Return to charger waits: battery under 30 %"),
        (None, CHARGER, "Return to charger waits: battery unknown"),
        (12.0, replace(CHARGER, charges=True), ""),
        (80.0, CHARGER, ""),
    ],
)
def test_an_idle_robot_says_what_keeps_its_idle_mission(battery, mission, words):
    aino = replace(AINO, idle=IdleRule(mission.id))
    ready = with_aino(replace(READY, battery_percentage=battery), ())
    facts = replace(ready, robots=(aino, *ready.robots[1:]), entered=(mission,))
    assert card(facts).said == words


def test_an_idle_robot_says_that_nothing_starts_on_a_day_off():
    ready = with_aino(READY, ())
    calendar = WorkingCalendar(replace(SETTINGS, working_days=("MO",)))
    robots = (replace(AINO, idle=IdleRule(CHARGER.id)), *ready.robots[1:])
    facts = replace(ready, robots=robots, entered=(CHARGER,), planned=(), calendar=calendar)
    assert card(facts).said == "Return to charger: not today, a day off"


# ---------------------------------------------------------------------- what needs a person
def test_an_error_has_our_words_the_step_and_the_robots_own():
    note = of(FAILED).note
    assert (note.step, note.quote) == (
        "Clear the way. Then reset.",
        "“Failed to reach goal position 'Line 2' (10120)”",
    )
    without_effect = replace(with_aino(FAILED), reset_without_effect=frozenset({standing(with_aino(FAILED).snapshot)}))
    assert card(without_effect).note.step == "Still there. Remove its cause, reset again."


def test_the_way_out_of_a_stop_is_one_step_at_a_time():
    statuses = (EXECUTING, FAILED, replace(PAUSED, errors=FAILED.errors), PAUSED)
    assert [of(status).foot.action for status in statuses] == ["pause", "reset", "reset", "resume"]
    assert [of(status).foot.style for status in statuses] == ["tonal", "filled", "filled", "filled"]


def test_a_robot_that_works_with_an_error_can_be_paused():
    shown = of(replace(EXECUTING, errors=FAILED.errors))
    assert (shown.foot.action, shown.note.tone, shown.note.problem) == ("pause", "attention", "Can't reach Line 2")


def test_an_error_that_needs_hands_on_the_robot_says_so():
    assert of(HARDWARE).note.step == "Solve it at the robot."
    assert not can_reset(HARDWARE)
    assert can_reset(replace(FAILED, errors=()))  # some software names no error


def test_since_when_it_is_so_is_said_as_far_as_it_is_known():
    spans = (ActivitySpan("executing", ago(minutes=9), ago(minutes=1)), ActivitySpan("error", ago(minutes=1), NOW))
    assert card(replace(with_aino(FAILED), activities=spans)).since == "since 14:37"
    assert card(replace(with_aino(FAILED), activities=spans[:1])).since == ""


def test_a_question_has_its_answers_and_none_of_them_stands_out():
    shown = of(ASKING)
    assert (shown.note.tone, shown.note.answers) == ("action", ("Yes", "No", "Skip this stop"))
    assert shown.foot.style == "tonal"
    assert not of(ASKING, age=300).note.answers  # it may have been answered at the robot
    answered = card(replace(with_aino(ASKING), answered=frozenset({ASKING.user_prompt.guid})))
    assert (answered.note.tone, answered.note.answers) == ("neutral", ())  # though the robot still shows it


def test_a_long_question_is_cut_and_more_answers_are_at_the_robot():
    status = replace(ASKING, user_prompt=UserPrompt("p1", "pallet " * 60, ("Yes",), more_options=2))
    note = of(status).note
    assert note.problem.endswith("… read all of it at the robot")
    assert note.step == "2 more answers at the robot"


# ---------------------------------------------------------------------- silence
def test_an_old_state_says_since_when_and_what_it_did():
    shown = card(without_aino())
    assert (shown.since, shown.note.step) == ("since 14:34", "Ask IT about the Wi-Fi if it is.")
    assert shown.said == "At 14:34: working, Deliver kits to line 2"
    assert (shown.battery.text, shown.battery.tone, shown.left) == ("78 % at 14:34", "offline", "")


@pytest.mark.parametrize(
    ("connection", "words"),
    [
        (Connection.UNAUTHORIZED, "Enter its password in Settings."),
        (Connection.WRONG_ROBOT, "Check its address in Settings."),
        (Connection.NOT_A_ROBOT, "Check its address in Settings."),
        (Connection.UNTRUSTED, "Compare its certificate in Settings."),
    ],
)
def test_each_problem_with_the_connection_has_its_step(connection, words):
    assert of(EXECUTING, connection=connection).note.problem == words


def test_pause_can_be_tried_while_only_a_reading_is_late():
    shown = of(EXECUTING, age=300)
    assert (shown.state, shown.foot.action, shown.foot.off) == ("No answer", "pause", False)


def test_the_battery_says_how_long_it_lasts_and_its_minimum():
    assert battery_words(FACTS, False) == "about 4 h 10 min left\nMinimum 30 %"
    assert battery_words(FACTS, True) == "Minimum 30 %"


# ---------------------------------------------------------------------- what can be sent
def test_a_hold_that_ends_in_time_says_when_it_starts():
    soon = Hold("Audit", NOW + timedelta(minutes=10), ago(minutes=1))
    assert card(replace(FACTS, holds=(soon,))).send_note == "Starts after 14:48"
    assert card(replace(FACTS, holds=(replace(soon, robot_id=VEIKKO.id),))).send_note == ""
    assert card(replace(FACTS, holds=(HOLD,))).send_note == "On hold, not run from 14:53"


def test_data_of_another_tablet_can_only_be_looked_at():
    assert card(replace(FACTS, holds=(Hold(is_copy=True),))).send_off == "Nothing is sent from this tablet"


# ---------------------------------------------------------------------- tabs
def test_up_to_three_robots_have_a_tab_each_coloured_when_not_normal():
    shown = tabs(with_aino(FAILED), 1, NOW)
    assert [(tab.key, tab.text, tab.tone) for tab in shown] == [
        (1, "Aino", "fault"),
        (2, "Veikko", ""),
        (3, "Sisu", ""),  # charging is never amber
    ]


def test_of_more_robots_there_is_one_tab_and_that_of_the_robot_opened_last():
    many = fleet_facts.facts(12)
    assert [tab.key for tab in tabs(many, 5, NOW)] == [ALL_ROBOTS, 5]
    assert [tab.key for tab in tabs(many, None, NOW)] == [ALL_ROBOTS]


def test_the_tab_of_all_robots_has_the_colour_of_the_worst_and_counts_those_that_need_a_person():
    four = replace(with_aino(FAILED), robots=(*FACTS.robots, Robot("Robot 4", "10.0.0.4", "scheduler", id=4)))
    silent = RobotSnapshot(4, Connection.UNREACHABLE, since=NOW)
    [every, aino] = tabs(replace(four, snapshots={**four.snapshots, 4: silent}), 1, NOW)
    assert (every.text, every.tone, every.count) == ("All robots", "fault", 2)
    assert (aino.text, aino.tone) == ("Aino", "fault")
    every = tabs(fleet_facts.facts(12, well=True), 1, NOW)[0]
    assert (every.tone, every.count) == ("", 0)
