"""The story of a run: its steps, why it ended so, and what is asked of the reader."""

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.execution_history import Replacement
from app.domain.execution import DurationEstimate, Reason, ReasonCode, State, Wait
from app.domain.message import message
from app.screens.logs.story import StoryFacts, steps, story
from tests.unit.screens.test_logs_view import DONE, FAILED, GOAL, NOW, PLANNED, SKIPPED, TO_DOCK, ZONE

USUAL = DurationEstimate(360.0, 400.0, (350.0, 360.0))


def steps_of(run, expected=None, replacement=None) -> list[tuple[str, str, str]]:
    """Label, time and note of each step."""
    return [(step.title, step.lead, step.support) for step in steps(StoryFacts(run, expected, replacement), ZONE)]


def test_a_story_has_four_steps_and_ends_in_its_outcome():
    assert steps_of(FAILED) == [
        ("Planned", "13:30:00", "Kits"),
        ("Sent", "13:30:02", "1st try"),
        ("Started", "13:30:09", ""),
        ("Failed", "13:36:27", "after 6 min"),
    ]
    assert [step.tone for step in steps(StoryFacts(FAILED), ZONE)] == ["neutral", "neutral", "neutral", "fault"]
    assert steps_of(replace(FAILED, robot_delay_s=90.0))[2][2] == "waited 1 min 30 s"


def test_a_story_says_why_in_our_words_and_in_those_of_the_robot():
    found = story(StoryFacts(FAILED, like=5), NOW, ZONE)
    assert (found.title, found.line) == ("Deliver kits", "Aino · Today 13:30")
    assert (found.cause, found.quote, found.tone) == (
        "Can't reach Dock 3",
        "Failed to reach goal position 'Dock 3'",
        "fault",
    )
    assert (found.like, found.again, found.note) == ("5 like this in 30 days", True, "")
    alone = story(StoryFacts(FAILED, like=1), NOW, ZONE)
    assert alone.like == ""
    strange = replace(FAILED, reason=Reason(ReasonCode.ROBOT_ABORTED, {"message": "Qwerty"}))
    assert (story(StoryFacts(strange), NOW, ZONE).cause, story(StoryFacts(strange), NOW, ZONE).quote) == ("Qwerty", "")


def test_a_failed_attempt_names_the_robot_and_its_story_the_address():
    problem = message("{address} doesn't answer", address="10.1.1.1:8080")
    reason = Reason(ReasonCode.RETRY_LIMIT, {"attempts": 3, "problem": problem})
    given_up = replace(SKIPPED, state=State.FAILED, attempts=3, reason=reason)
    assert story(StoryFacts(given_up), NOW, ZONE).cause == "Given up at attempt 3: Aino doesn't answer"
    waits = replace(given_up, reason=None, state=State.WAITING, wait=Wait.RETRY, wait_details={"problem": problem})
    assert story(StoryFacts(waits), NOW, ZONE).cause.endswith(": Aino doesn't answer")
    assert steps_of(given_up)[1][2] == "3 tries, none accepted · 10.1.1.1:8080"


def test_a_completed_story_has_no_cause_and_compares_with_the_usual_duration():
    found = story(StoryFacts(replace(DONE, parameters={"goal": GOAL}), USUAL), NOW, ZONE, TO_DOCK)
    assert (found.title, found.cause, found.again) == ("Deliver kits · Dock 3", "", False)
    assert found.note == "Position: Dock 3"
    assert found.steps[-1].support == "after 6 min, usually 6 min"
    assert (
        steps_of(DONE, replace(USUAL, samples_s=(360.0,)))[-1][2] == "after 6 min"
    )  # it would be compared with itself


def test_a_story_ends_where_the_run_ended():
    assert [label for label, _time, _note in steps_of(SKIPPED)] == ["Planned", "Not run"]
    refused = replace(SKIPPED, state=State.FAILED, attempts=3, reason=Reason(ReasonCode.RETRY_LIMIT))
    assert steps_of(refused) == [
        ("Planned", "13:30:00", "Kits"),
        ("Tried", "–", "3 tries, none accepted"),
        ("Failed", "13:36:27", ""),
    ]
    running = replace(DONE, state=State.EXECUTING, ended_at=None, duration_s=None, robot_delay_s=0.2)
    assert steps_of(running)[2:] == [("Started", "13:30:09", ""), ("Working", "–", "")]


@pytest.mark.parametrize(
    ("expected", "note"),
    [(USUAL, "usually 6 min"), (DurationEstimate(1500.0, 1500.0, typed=True), "25 min as typed in Settings")],
)
def test_an_open_run_says_how_long_it_will_take_and_how_that_is_known(expected, note):
    running = replace(DONE, state=State.EXECUTING, ended_at=None, duration_s=None)
    assert steps_of(running, expected)[-1][2] == note


def test_one_row_for_missed_starts_says_how_many_and_is_planned_for_the_last():
    missed = replace(
        SKIPPED,
        state=State.MISSED,
        starts=2016,
        reason=Reason(
            ReasonCode.APP_DOWN, {"starts": 2016, "first": "2026-11-06T11:30:00+00:00", "last": PLANNED.isoformat()}
        ),
    )
    found = story(StoryFacts(missed), NOW, ZONE)
    assert found.cause == "Missed 2,016 starts, 6–20 November: the app was off or asleep"
    assert (found.steps[0].lead, found.steps[0].support) == ("13:30:00", "the last of 2,016 · Kits")


def test_a_story_says_that_a_person_had_it_started_on_another_robot():
    doubted = replace(DONE, id=4, started_at=None, ended_at=None, duration_s=None, state=State.SUBMITTING)
    found = Replacement(4, "Aino", 5, "Veikko", PLANNED + timedelta(minutes=2))
    assert steps_of(doubted, replacement=found)[2] == ("Elsewhere", "13:32:00", "a person started it on Veikko instead")
    instead = steps_of(replace(DONE, id=5), replacement=found)
    assert [label for label, _time, _note in instead] == ["Planned", "Sent", "Started", "Completed"]
    assert instead[0][2] == "Kits · instead of the start on Aino"


def test_a_story_that_was_found_late_has_the_times_of_the_robot():
    """The tablet was off and saw the run only after it was over."""
    found = DONE.ended_at + timedelta(minutes=40)
    seen = replace(DONE, started_at=found, ended_at=found)
    assert steps_of(seen, USUAL)[1:] == [
        ("Sent", "13:30:02", "1st try"),
        ("Started", "13:30:09", ""),
        ("Completed", "13:36:27", "after 6 min, usually 6 min · seen at 14:16:27"),
    ]
    started = replace(DONE, ended_at=found)  # it saw it start, and then was off
    assert [time for _label, time, _note in steps_of(started)] == ["13:30:00", "13:30:02", "13:30:09", "13:36:27"]
    runs = replace(DONE, state=State.EXECUTING, started_at=found, ended_at=None, duration_s=None)
    assert [time for _label, time, _note in steps_of(runs)] == ["13:30:00", "13:30:02", "13:30:09", "–"]


def test_a_story_over_several_days_has_their_dates():
    midnight = replace(
        DONE,
        planned_at=PLANNED + timedelta(hours=10, minutes=29),
        submitted_at=PLANNED + timedelta(hours=10, minutes=29),
        started_at=None,
        ended_at=PLANNED + timedelta(hours=10, minutes=31),
    )
    assert [time for _label, time, _note in steps_of(midnight)] == [
        "Fri 20 Nov\n23:59:00",
        "Fri 20 Nov\n23:59:00",
        "Sat 21 Nov\n00:01:00",
    ]
    tomorrow = PLANNED + timedelta(days=1)
    ahead = replace(
        SKIPPED, planned_at=tomorrow, ended_at=tomorrow, reason=Reason(ReasonCode.HOLD, {"skipped_at": NOW.isoformat()})
    )
    assert [(label, time) for label, time, _note in steps_of(ahead)] == [
        ("Planned", "Sat 21 Nov\n13:30:00"),
        ("Not run", "Fri 20 Nov\n14:38:00"),
    ]
    later_today = replace(ahead, planned_at=PLANNED + timedelta(hours=5), ended_at=PLANNED + timedelta(hours=5))
    assert [time for _label, time, _note in steps_of(later_today)] == ["18:30:00", "14:38:00"]
