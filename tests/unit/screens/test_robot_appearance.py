"""A robot's state, battery and texts in the words of the app."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import Connection, Settings
from app.domain.robot import RobotState
from app.i18n import translator
from app.screens.common.robot_appearance import battery_appearance, link_appearance, state_appearance
from app.screens.common.robot_texts import problem_of
from tests.support.home_facts import AINO, ASKING, CHARGING, EXECUTING, NOW, READY, SETTINGS, snapshot

WORDS = {
    "Working": "Tehtävässä",
    "Ready": "Valmiina",
    "Charging": "Latautuu",
    "Asks": "Kysyy",
    "Paused": "Keskeytetty",
    "Stopped": "Pysähtynyt",
    "Manual control": "Käsiajolla",
    "No answer": "Ei vastaa",
    "Wrong password": "Väärä salasana",
    "Another robot": "Eri robotti",
    "Another certificate": "Eri varmenne",
    "Starting up": "Käynnistyy",
    "Off": "Pois käytöstä",
    "–": "–",
}


def words() -> list[str]:
    """Of a robot in every state and with every kind of connection."""
    robots = [AINO, replace(AINO, enabled=False), replace(AINO, enabled=False, needs_password=True)]
    statuses = [*(replace(READY, state=state) for state in RobotState), ASKING, CHARGING, None]
    return [
        state_appearance(robot, snapshot(1, status, connection=connection), stale).word
        for robot in robots
        for status in statuses
        for connection in Connection
        for stale in (False, True)
    ]


def test_a_state_has_one_of_these_words_and_no_other():
    assert set(words()) == set(WORDS)


def test_and_in_finnish_one_of_these():
    translator.use("fi")
    try:
        assert set(words()) == set(WORDS.values())
    finally:
        translator.use("en")


@pytest.mark.parametrize(
    ("state", "word"), [(RobotState.PAUSE, "Paused"), (RobotState.MANUAL_CONTROL, "Manual control")]
)
def test_a_robot_that_is_held_does_not_charge_whatever_its_text_still_says(state, word):
    status = replace(EXECUTING, state=state, mission_text="Charging... Waiting for new mission...")
    assert state_appearance(AINO, snapshot(1, status), False).word == word
    assert not battery_appearance(status, SETTINGS).icon.startswith("battery-charging")


def test_connected_but_silent_for_three_polls_is_old_too():
    assert link_appearance(AINO, snapshot(1, EXECUTING, age=91), NOW, SETTINGS).word == "No update · 1 min ago"
    assert link_appearance(AINO, snapshot(1, EXECUTING, age=89), NOW, SETTINGS).tone == "neutral"


@pytest.mark.parametrize(
    ("percent", "icon"), [(100.0, "battery"), (78.0, "battery-80"), (3.0, "battery-alert-variant-outline")]
)
def test_battery_icons(percent, icon):
    assert battery_appearance(replace(READY, battery_percentage=percent), Settings()).icon == icon


def test_charging_is_seen():
    assert battery_appearance(CHARGING, SETTINGS).note == "under 30 %"
    assert battery_appearance(replace(CHARGING, battery_percentage=50.0), SETTINGS).note == "charging"


def test_an_unknown_level_is_a_dash_and_never_zero():
    look = battery_appearance(replace(READY, battery_percentage=None), SETTINGS)
    assert look.text == "–"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Failed to reach goal position 'Line 2' (10120)", "Can't reach Line 2"),
        ("Failed to dock to 'Charger'", "Can't dock at Charger"),
        ("AMCL: robot is not localized (10201)", "Doesn't know where it is"),
        ("Aborted - User Request", "Cancelled at the robot"),
        ("Mission was stopped..", "Stopped at the robot"),
        ("Levitation lost", ""),
        ("", ""),
    ],
)
def test_common_texts_of_robots_have_our_words_and_keep_their_own(text, words):
    problem = problem_of(text)
    assert (problem.words, problem.quote) == (words, text)
    assert bool(problem.step) == bool(words and not words.endswith("at the robot"))
