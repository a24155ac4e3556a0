"""Which alarms make a sound, and after how long without an answer it is repeated."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.domain.models import Alarm
from app.screens.frame.sounding import Sounding
from tests.support.alarms import alarm
from tests.support.home_facts import NOW

STOP = alarm("emergency_stop", id=3)


def heard(*moments: tuple[timedelta, list[Alarm]], set_back: timedelta = timedelta()) -> list[bool]:
    """``set_back``: by how much the clock is, after the first moment."""
    sounding = Sounding()
    return [
        sounding.is_due(alarms, NOW + after - (set_back if n else timedelta()), after.total_seconds())
        for n, (after, alarms) in enumerate(moments)
    ]


def after(seconds: float) -> timedelta:
    return timedelta(seconds=seconds)


def test_a_new_alarm_of_high_priority_is_heard_once():
    assert heard((after(0), []), (after(1), [STOP]), (after(2), [STOP])) == [False, True, False]


@pytest.mark.parametrize(
    "quiet",
    [
        alarm("unreachable"),
        replace(STOP, acknowledged_at=NOW),
        replace(STOP, cleared_at=NOW),
        replace(STOP, shelved_until=NOW + timedelta(hours=1)),
    ],
)
def test_minor_acknowledged_ended_or_shelved_alarms_are_silent(quiet):
    assert heard((after(0), [quiet])) == [False]


def test_two_at_once_are_one_sound_and_a_third_one_is_heard_too():
    another, third = alarm("robot_error", "robot:2", id=4), alarm("robot_error", "robot:3", id=5)
    assert heard((after(0), [STOP, another]), (after(1), [STOP, another, third])) == [True, True]


def test_an_alarm_sounds_every_five_minutes_until_acknowledged():
    seen = replace(STOP, acknowledged_at=NOW)
    assert heard(
        (after(0), [STOP]),
        (after(299), [STOP]),
        (after(300), [STOP]),
        (after(301), [STOP]),
        (after(600), [STOP]),
        (after(900), [seen]),
    ) == [True, False, True, False, True, False]


def test_an_alarm_sounds_again_after_the_clock_was_set_back():
    assert heard((after(0), [STOP]), (after(299), [STOP]), (after(300), [STOP]), set_back=timedelta(hours=1)) == [
        True,
        False,
        True,
    ]


def test_an_alarm_that_returns_sounds_again():
    over = replace(STOP, cleared_at=NOW)
    assert heard((after(0), [STOP]), (after(1), [over]), (after(2), [replace(STOP, count=2)])) == [True, False, True]


def test_an_alarm_that_cannot_be_acknowledged_sounds_once():
    database = alarm("database", "database", id=0)
    assert heard((after(0), [database]), (after(400), [database])) == [True, False]
