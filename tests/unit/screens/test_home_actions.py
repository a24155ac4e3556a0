"""What Home offers for each state of the robot: the way out, the controls, the button that runs a mission."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.robots import Hold
from app.domain.models import Connection
from app.domain.robot import RobotProblem, RobotState
from app.screens.home.facts import HomeFacts
from app.screens.home.view import can_reset, present
from tests.support.home_facts import (
    AINO,
    ASKING,
    EXECUTING,
    FACTS,
    FAILED,
    KITS,
    NOW,
    READY,
    SETTINGS,
    STOPPED,
    VEIKKO,
    ago,
    with_aino,
)


def view(facts: HomeFacts, chosen: int | None = None):
    return present(facts, NOW, chosen)


# ---------------------------------------------------------------------- the controls
def test_emergency_stop_says_what_to_do_by_hand_and_offers_nothing_useless():
    shown = view(with_aino(STOPPED))
    assert (shown.card.state, shown.card.tone, shown.card.loud) == ("Stopped", "fault", True)
    assert shown.card.mission.name == "Release the red button, then press Reset on the robot"
    assert shown.card.mission.note == ""  # the state's word says it
    assert shown.controls.next_step == "hands"
    assert shown.controls.pause == "Resume"
    assert shown.controls.pause_off
    assert shown.controls.reset_off
    assert shown.run.off
    assert shown.run.text == "Aino is stopped"


def test_an_error_that_can_be_reset_lights_reset_up_and_resume_only_after_it():
    shown = view(with_aino(FAILED))
    assert shown.card.mission.name == "Failed to reach goal position 'Line 2' (10120)"
    assert not shown.controls.reset_off
    assert shown.controls.pause_off
    afterwards = view(with_aino(replace(EXECUTING, state=RobotState.PAUSE)))
    assert afterwards.controls.reset_off
    assert afterwards.controls.pause == "Resume"
    assert not afterwards.controls.pause_off
    assert not afterwards.controls.pauses


def test_the_way_out_of_a_stop_is_loud_and_only_one_step_at_a_time():
    paused = replace(EXECUTING, state=RobotState.PAUSE)
    steps = [
        view(with_aino(status)).controls.next_step
        for status in (
            EXECUTING,
            FAILED,
            replace(paused, errors=FAILED.errors),
            paused,
            replace(paused, user_prompt=ASKING.user_prompt),
        )
    ]
    assert steps == ["", "reset", "reset", "resume", "answer"]
    assert view(with_aino(FAILED, age=300, connection=Connection.UNREACHABLE)).controls.next_step == ""


def test_while_a_robot_needs_a_person_nothing_else_is_loud():
    paused = replace(EXECUTING, state=RobotState.PAUSE)
    assert [
        view(with_aino(status)).controls.next_step for status in (READY, EXECUTING, ASKING, FAILED, STOPPED, paused)
    ] == ["", "", "answer", "reset", "hands", "resume"]
    assert not view(with_aino(ASKING, age=300)).controls.next_step


def test_an_error_that_needs_hands_on_the_robot_says_so():
    hardware = replace(FAILED, errors=(RobotProblem(9000, "Scanner broken", "Safety", resettable=False),))
    shown = view(with_aino(hardware))
    assert shown.controls.reset_off
    assert shown.controls.next_step == "hands"
    assert shown.card.mission.name == "It can't be reset from here: check the robot itself"
    assert shown.card.mission.note == "Scanner broken (9000)"
    assert not can_reset(hardware)
    assert can_reset(replace(FAILED, errors=()))  # some software names no error


def test_a_paused_robot_offers_to_continue():
    shown = view(with_aino(replace(EXECUTING, state=RobotState.PAUSE)))
    assert (shown.card.state, shown.card.tone) == ("Paused", "action")
    assert shown.queue[0].origin == "Run now · held, started 14:33"


def test_pause_can_be_tried_on_a_robot_that_does_not_answer():
    shown = view(with_aino(EXECUTING, age=300, connection=Connection.UNREACHABLE, problem="10.40.12.21 doesn't answer"))
    assert shown.controls.pause == "Pause"
    assert not shown.controls.pause_off


def test_a_robot_that_is_switched_off_can_do_nothing():
    facts = replace(FACTS, robots=(replace(AINO, enabled=False), VEIKKO))
    shown = view(facts)
    assert shown.card.state == "Off"
    assert shown.controls.pause_off
    assert shown.controls.clear_count == 0
    assert shown.run.text == "Aino is switched off"


def test_a_question_of_the_robot_can_be_answered():
    shown = view(with_aino(ASKING))
    assert shown.prompt.question == "Is the pallet loaded at Dock 3?"
    assert shown.prompt.options == ("Yes", "No", "Skip this stop")
    assert shown.card.state == "Asks"
    assert not view(with_aino(ASKING, age=300)).prompt.guid  # an old question may have been answered at the robot


# ---------------------------------------------------------------------- run now
def test_favourites_are_offered_by_one_tap_and_the_chosen_one_is_marked():
    run = view(FACTS, chosen=2).run
    assert [(row.text, row.icon, row.selected) for row in run.chips] == [
        ("Collect empties", "star", False),
        ("Deliver kits to line 2", "star", True),
        ("Return to charger", "star", False),
    ]
    assert run.text == "Run on Aino"
    assert not run.off


def test_nothing_is_chosen_for_the_operator_unless_there_is_only_one():
    assert view(FACTS).run.text == "Choose a mission"
    assert view(FACTS).run.off
    assert view(replace(FACTS, missions=(KITS,))).run.mission_id == KITS.id
    assert view(replace(FACTS, missions=())).run.text == "No missions yet"
    assert view(replace(FACTS, missions=(), is_new=True)).run.text == "Choose a mission"  # until they are read


def held_run(**values):
    return view(replace(FACTS, holds=(Hold(since=ago(minutes=1), **values),)), chosen=2).run


def test_while_starts_are_held_the_button_queues_and_says_until_when():
    run = held_run(until=NOW + timedelta(minutes=10))
    assert (run.text, run.icon, run.off, run.note) == (
        "Queue, held until 14:48",
        "hand-back-right-outline",
        False,
        "on Aino",
    )
    assert held_run(until=NOW + timedelta(minutes=10), robot_id=VEIKKO.id).text == "Run on Aino"
    assert held_run(until=NOW - timedelta(seconds=1)).text == "Run on Aino"


def test_a_hold_longer_than_the_start_window_promises_no_start():
    assert (held_run().text, held_run().note) == ("Queue, held", "skipped at 14:53 unless released")
    long = held_run(until=NOW + timedelta(hours=1), robot_id=AINO.id)
    assert (long.text, long.note) == ("Queue, held", "skipped at 14:53 unless released")


def test_data_of_another_tablet_can_only_be_looked_at():
    copy = view(replace(FACTS, holds=(Hold(is_copy=True),)), chosen=2).run
    assert (copy.text, copy.off) == ("Nothing is sent from this tablet", True)


@pytest.mark.parametrize("last_seen", [EXECUTING, STOPPED])
def test_to_a_silent_robot_it_is_sent_when_it_answers(last_seen):
    """Also to one that was stopped when it last answered: it may have moved since."""
    silent = with_aino(last_seen, age=300, connection=Connection.UNREACHABLE)
    run = view(silent, chosen=2).run
    assert (run.text, run.off, run.note) == ("Send when Aino answers", False, "waits until 14:53 at most")


def test_under_the_minimum_the_operator_is_asked():
    low = with_aino(replace(READY, battery_percentage=12.0), ())
    assert view(low, 2).run.low_battery == "The battery of Aino is at 12 %, under the minimum of 30 %."
    assert not view(low, 2).run.off
    assert view(with_aino(replace(READY, battery_percentage=None), ()), 2).run.low_battery.startswith(
        "The battery of Aino is not known"
    )
    assert view(FACTS, 2).run.low_battery == ""
    assert view(replace(low, settings=replace(SETTINGS, minimum_battery_percent=None)), 2).run.low_battery == ""
