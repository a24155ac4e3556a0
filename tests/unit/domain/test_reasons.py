from __future__ import annotations

import string
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.execution import Execution, Reason, ReasonCode, State, Trigger, Wait
from app.domain.message import message
from app.domain.reasons import at_robot, codes_with, sentence, waiting_sentence

NOON = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)
HELSINKI = "Europe/Helsinki"


def in_words(code: ReasonCode, zone=HELSINKI, **details) -> str:
    return sentence(Reason(code, details), zone)


@pytest.mark.parametrize(
    ("text", "address"),
    [("{address} doesn't answer", "Aino"), ("the fleet at {address} doesn't have this robot any more", "10.1.1.5")],
)
def test_a_robot_is_named_in_the_place_of_its_own_address(text, address):
    details = {"problem": message(text, address="10.1.1.5")}
    assert at_robot(details, "Aino")["problem"]["params"] == {"address": address}


@pytest.mark.parametrize(
    ("code", "details", "expected"),
    [
        (
            ReasonCode.BATTERY_LOW,
            {"battery": 12.0, "minimum": 30, "until": "2026-11-23T12:30:00+00:00"},
            "Battery 12 % stayed under 30 % until 14:30",
        ),
        (
            ReasonCode.BATTERY_LOW,
            {"battery": 12.34, "minimum": 30.5, "until": NOON},
            "Battery 12.3 % stayed under 30.5 % until 14:00",
        ),
        (
            ReasonCode.BATTERY_LOW,
            {"battery": None, "minimum": 30, "until": NOON},
            "Battery unknown until 14:00, at least 30 % needed",
        ),
        (
            ReasonCode.BATTERY_LOW,
            {"battery": float("nan"), "minimum": 30, "until": NOON},
            "Battery unknown until 14:00, at least 30 % needed",
        ),
        (
            ReasonCode.RETRY_LIMIT,
            {"attempts": 11, "problem": "no answer\n within 10 s"},
            "Given up at attempt 11: no answer within 10 s",
        ),
        (
            ReasonCode.WINDOW_CLOSED,
            {"attempts": 0, "until": NOON, "problem": ""},
            "Its start window closed at 14:00 before it could be sent",
        ),
        (
            ReasonCode.WINDOW_CLOSED,
            {"attempts": 2, "until": NOON, "problem": "busy"},
            "Its start window closed at 14:00 after attempt 2: busy",
        ),
        (ReasonCode.ROBOT_ABORTED, {"message": "Failed to reach goal"}, "The robot ended it: Failed to reach goal"),
        (
            ReasonCode.WRONG_ROBOT,
            {"found": "22", "expected": "11"},
            "Another robot answered at this address: serial number 22 instead of 11",
        ),
        (ReasonCode.OVERLAP, {"planned_at": NOON}, "The run planned for 14:00 had not ended"),
        (
            ReasonCode.OVERLAP,
            {"idle": True},
            "Not needed now: the robot was used, something is planned soon, or it is a day off",
        ),
        (ReasonCode.SCHEDULE_CHANGED, {"idle": True}, "The idle mission was changed or switched off while it waited"),
        (ReasonCode.SCHEDULE_CHANGED, {"deleted": True}, "Its schedule was deleted while it waited"),
        (
            ReasonCode.SCHEDULE_CHANGED,
            {"deleted": False},
            "Its schedule was changed, switched off or deleted while it waited",
        ),
        (
            ReasonCode.UNKNOWN_MISSION,
            {"mission": True},
            "There is no such mission: choose another or create it",
        ),
        (
            ReasonCode.HOLD,
            {"until": NOON + timedelta(days=2)},
            "On hold until its start window closed on 25 Nov 2026 14:00",
        ),
        (ReasonCode.HOLD, {"skipped_at": NOON}, "Skipped by a person on 23 Nov 2026 14:00"),
        (
            ReasonCode.APP_DOWN,
            {"start": NOON, "end": NOON + timedelta(hours=1)},
            "The app was off or asleep from 14:00 to 15:00",
        ),
        (
            ReasonCode.APP_DOWN,
            {"start": NOON, "end": NOON + timedelta(hours=11)},
            "The app was off or asleep from 2026-11-23 14:00 to 2026-11-24 01:00",
        ),
        (
            ReasonCode.APP_DOWN,
            {
                "start": NOON,
                "end": NOON + timedelta(days=14),
                "starts": 2016,
                "first": "2026-07-01T09:00:00+00:00",
                "last": "2026-07-14T20:50:00+00:00",
            },
            "Missed 2,016 starts, 1–14 July: the app was off or asleep",
        ),
        (
            ReasonCode.APP_DOWN,
            {"starts": 5, "first": NOON, "last": NOON + timedelta(hours=1), "problem": "the disk is full"},
            "Missed 5 starts, 23 November, 14:00–15:00: nothing could be written (the disk is full)",
        ),
        (
            ReasonCode.CLOCK_IMPLAUSIBLE,
            {"starts": 40, "first": NOON, "last": NOON + timedelta(days=10)},
            "Missed 40 starts, 23 November – 3 December: the tablet's clock could not be trusted",
        ),
        (
            ReasonCode.HOLD,
            {
                "starts": 4000,
                "first": NOON,
                "last": NOON + timedelta(days=40),
                "paused_until": NOON + timedelta(days=60),
            },
            "4,000 starts were not run, 23 November 2026 – 2 January 2027: the schedule was paused until 22 Jan 2027 14:00",
        ),
        (ReasonCode.APP_DOWN, {"starts": "many", "first": NOON, "last": NOON}, "The app was off or asleep"),
        (ReasonCode.VANISHED, {"queue_id": 0}, "The robot no longer has queue item 0"),
        (ReasonCode.VANISHED, {"queue_id": 3, "fleet": True}, "The fleet no longer has this order"),
        (
            ReasonCode.WRONG_ROBOT,
            {"fleet": True, "found": "Hall 3", "expected": "Hall 2"},
            "Another fleet answered at this address: Hall 3 instead of Hall 2",
        ),
    ],
)
def test_numbers_and_times_are_in_the_sentence(code, details, expected):
    assert in_words(code, **details) == expected


def test_times_are_reported_in_the_zone_that_is_asked_for():
    assert (
        in_words(ReasonCode.OVERLAP, ZoneInfo("Asia/Tokyo"), planned_at=NOON)
        == "The run planned for 21:00 had not ended"
    )
    assert in_words(ReasonCode.OVERLAP, "No/Where", planned_at=NOON) == "The run planned for 12:00 had not ended"


@pytest.mark.parametrize("code", list(ReasonCode))
def test_every_code_has_a_sentence_of_its_own_even_without_details(code):
    text = in_words(code)
    assert text[0].isupper()
    assert "{" not in text
    assert not text.endswith(".")
    assert [in_words(other) for other in ReasonCode].count(text) == 1


ODD = st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.lists(st.integers()) | st.datetimes()
NAMES = st.sampled_from(
    [
        "battery",
        "minimum",
        "until",
        "start",
        "end",
        "planned_at",
        "problem",
        "message",
        "attempts",
        "queue_id",
        "hold",
        "robot",
    ]
)


@given(code=st.sampled_from(list(ReasonCode)), details=st.dictionaries(NAMES | st.text(), ODD))
def test_odd_details_never_break_it(code, details):
    text = sentence(Reason(code, details), HELSINKI)
    assert text
    assert text == " ".join(text.split())


def test_a_text_from_outside_is_never_a_template():
    assert in_words(ReasonCode.ROBOT_ABORTED, message="{0} {attempts} %s") == "The robot ended it: {0} {attempts} %s"


def test_a_very_long_text_is_cut():
    assert len(in_words(ReasonCode.ROBOT_ABORTED, message="x" * 5000)) < 500


def test_it_is_translated_before_the_numbers_are_put_in():
    german = {
        "Battery {battery} % stayed under {minimum} % until {until}": "Akku {battery} % blieb bis {until} unter {minimum} %"
    }
    reason = Reason(ReasonCode.BATTERY_LOW, {"battery": 12, "minimum": 30, "until": NOON})
    assert sentence(reason, HELSINKI, lambda text: german.get(text, text)) == "Akku 12 % blieb bis 14:00 unter 30 %"


# ---------------------------------------------------------------------- waiting
def row(**values) -> Execution:
    return Execution(
        Trigger.SCHEDULED,
        1,
        "Aino",
        "Deliver",
        "guid",
        NOON,
        NOON + timedelta(minutes=15),
        NOON,
        "token",
        HELSINKI,
        **values,
    )


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({}, "Is being sent"),
        (
            {"wait": Wait.RETRY, "wait_details": {"problem": "no answer"}, "attempts": 2},
            "Attempt 2 failed, trying again until 14:15: no answer",
        ),
        (
            {"wait": Wait.BATTERY, "wait_details": {"battery": 12, "minimum": 30}},
            "Battery 12 % is under 30 %, waits until 14:15",
        ),
        (
            {"wait": Wait.BATTERY, "wait_details": {"battery": None, "minimum": 30}},
            "Battery unknown, at least 30 % needed, waits until 14:15",
        ),
        ({"wait": Wait.HOLD, "wait_details": {"hold": ""}}, "On hold, waits until 14:15"),
        (
            {"wait": Wait.CHECK_UP, "wait_details": {"fleet": "Hall"}},
            "The fleet Hall has to be checked up first, waits until 14:15",
        ),
        ({"wait": Wait.CLOCK}, "The tablet's clock can't be trusted, waits until 14:15"),
        (
            {"wait": Wait.ELSEWHERE, "wait_details": {"robots": "Aino"}},
            "May have run already, waits until 14:15 for an answer from Aino",
        ),
        ({"wait": Wait.ELSEWHERE}, "Robots are being asked whether it has run already, waits until 14:15"),
        ({"state": State.SUBMITTING}, "Asking whether it has arrived"),
        ({"state": State.EXECUTING}, "Running on the robot"),
        ({"state": State.COMPLETED}, ""),
    ],
)
def test_the_hold_of_a_start_is_reported(values, expected):
    assert waiting_sentence(row(**values)) == expected


@pytest.mark.parametrize(
    "code",
    [
        ReasonCode.UNAUTHORIZED,
        ReasonCode.UNKNOWN_MISSION,
        ReasonCode.REFUSED,
        ReasonCode.VANISHED,
        ReasonCode.UNKNOWN_OUTCOME,
    ],
)
@pytest.mark.parametrize("details", [{}, {"problem": "no", "mission": "Kits"}])
def test_what_answers_a_start_may_be_a_robot_or_a_fleet(code, details):
    assert "robot" not in sentence(Reason(code, details), "UTC").casefold()


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"wait_details": {"answer": "no"}},
        {"cancel_code": ReasonCode.USER_CANCELLED},
        {"withdrawn": Reason(ReasonCode.SCHEDULE_CHANGED)},
        {"state": State.QUEUED},
    ],
)
def test_what_a_start_was_sent_to_may_be_a_robot_or_a_fleet(values):
    assert "robot" not in waiting_sentence(row(**{"state": State.SUBMITTING, **values})).casefold()


@pytest.mark.parametrize("wait", list(Wait))
def test_every_wait_has_a_sentence(wait):
    assert waiting_sentence(row(wait=wait), ZoneInfo("UTC"))[0] in string.ascii_uppercase


def test_reasons_are_found_by_words_of_their_sentences_in_the_language_on_screen():
    assert codes_with("stayed UNDER") == (ReasonCode.BATTERY_LOW,)
    assert codes_with("{minimum}") == ()
    assert codes_with("akku", lambda text: text.replace("Battery", "Akku")) == (ReasonCode.BATTERY_LOW,)
