"""Home's words: what a person reads off each state of the robot, and of what is run now."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.robots import Hold
from app.domain.activity import ActivitySpan
from app.domain.models import Connection, DurationEstimate, IdleRule, Reason, ReasonCode, Settings, State
from app.domain.robot import QueueItem, QueueState, RobotState
from app.i18n import translator
from app.mir.errors import Unreachable
from app.screens.common.robot_appearance import battery_appearance, link_appearance, state_appearance
from app.screens.home.facts import HomeFacts
from app.screens.home.lists import (
    outcome_line,
    robot_summaries,
)
from app.screens.home.view import present
from app.services.planning.working_days import WorkingCalendar
from tests.support.home_facts import (
    AINO,
    CHARGER,
    CHARGING,
    EXECUTING,
    FACTS,
    KITS,
    NOW,
    READY,
    SETTINGS,
    STOPPED,
    VEIKKO,
    ago,
    execution,
    snapshot,
    with_aino,
)


def view(facts: HomeFacts, chosen: int | None = None):
    return present(facts, NOW, chosen)


# ---------------------------------------------------------------------- which robot
def test_no_robot_is_an_invitation_and_nothing_else():
    empty = view(HomeFacts())
    assert not empty.has_robots
    assert empty.controls.pause_off
    assert empty.run.off


def test_the_first_robot_is_shown_after_the_selected_one_was_deleted():
    facts = replace(FACTS, settings=replace(SETTINGS, selected_robot_id=99))
    assert facts.robot == AINO


def test_every_robot_has_a_chip_with_state_and_battery():
    rows = robot_summaries(replace(FACTS, settings=replace(SETTINGS, selected_robot_id=2)), NOW)
    assert [(row.name, row.battery, row.selected) for row in rows] == [
        ("Aino", "78 %", False),
        ("Veikko", "64 %", True),
        ("Sisu", "19 %", False),
    ]
    assert [row.word for row in rows] == ["Working", "Ready", "Charging"]
    assert rows[0].tone == "accent"
    assert rows[1].tone == "neutral"  # normal is grey
    assert rows[2].battery_icon.startswith("battery-charging")
    assert rows[2].battery_tone == "attention"  # under the minimum of 30 %


# ---------------------------------------------------------------------- the card
def test_a_running_mission_shows_elapsed_against_usual():
    card = view(FACTS).card
    assert (card.state, card.tone) == ("Working", "accent")
    assert card.mission.name == KITS.name
    assert card.mission.elapsed == "4 min 12 s"
    assert card.mission.note == "of usually 6 min 30 s"
    assert card.mission.progress == pytest.approx(252 / 390)


def test_the_expected_end_is_next_to_the_battery():
    tile = view(FACTS).card.end_tile
    assert (tile.label, tile.value, tile.note) == ("Done about", "14:40", "2 min left")


def test_a_run_that_takes_longer_than_usual_says_by_how_much():
    tile = view(replace(FACTS, expected={KITS.guid: DurationEstimate(100.0, 110.0)})).card.end_tile
    assert (tile.label, tile.value) == ("Longer than usual", "+2 min")


def test_a_mission_that_charges_is_not_compared_with_earlier_runs():
    """It ends when the robot is charged or gets another one."""
    charging = replace(EXECUTING, mission_text="Charging... Waiting for new mission...")
    card = view(replace(with_aino(charging), expected={KITS.guid: DurationEstimate(100.0, 110.0)})).card
    assert (card.mission.tone, card.mission.note, card.mission.progress) == (
        "neutral",
        "charging: not compared with earlier runs",
        -1,
    )
    assert card.end_tile.label == "Address"


@pytest.mark.parametrize(
    ("state", "word"), [(RobotState.PAUSE, "Paused"), (RobotState.MANUAL_CONTROL, "Manual control")]
)
def test_a_robot_that_is_held_does_not_charge_whatever_its_text_still_says(state, word):
    card = view(with_aino(replace(EXECUTING, state=state, mission_text="Charging... Waiting for new mission..."))).card
    assert card.state == word
    assert not card.battery.icon.startswith("battery-charging")


def test_a_mission_that_charges_and_is_paused_is_held_by_the_pause_alone():
    paused = replace(EXECUTING, state=RobotState.PAUSE, mission_text="Charging... Waiting for new mission...")
    mission = view(replace(with_aino(paused), expected={KITS.guid: DurationEstimate(100.0, 110.0)})).card.mission
    assert (mission.label, mission.note, mission.progress) == ("Mission, held by the pause", "", -1)


@pytest.mark.parametrize(
    "facts",
    [
        replace(FACTS, expected={}),
        with_aino(READY, ()),
        with_aino(replace(EXECUTING, state=RobotState.PAUSE)),
        with_aino(STOPPED),
        with_aino(EXECUTING, age=1200),
    ],
)
def test_a_new_held_or_silent_mission_has_no_expected_end(facts):
    assert view(facts).card.end_tile.label == "Address"


def test_the_minimum_on_the_batterys_bar_is_named():
    assert view(FACTS).card.battery_minimum == "min 30 %"
    assert view(replace(FACTS, settings=replace(SETTINGS, minimum_battery_percent=None))).card.battery_minimum == ""


def test_a_working_robot_with_an_unread_queue_is_not_said_to_do_nothing():
    mission = view(with_aino(EXECUTING, ())).card.mission
    assert (mission.name, mission.note) == ("–", "the robot is being asked")


def test_an_idle_robot_says_that_nothing_is_planned():
    assert view(replace(with_aino(READY, ()), planned=())).card.mission.note == "nothing is planned"


def test_elapsed_runs_on_between_two_readings():
    assert present(FACTS, NOW + timedelta(seconds=3), None).card.mission.elapsed == "4 min 15 s"


@pytest.mark.parametrize(
    ("state", "activities", "elapsed", "left"),
    [
        (
            "paused",
            [("executing", 252, 120), ("paused", 120, 60)],
            "2 min 12 s",
            "",
        ),  # still: stored only once a minute
        ("paused", [("executing", 252, 60)], "4 min 10 s", ""),  # it was read a moment ago
        ("paused", [("executing", 252, 200), ("paused", 200, 100), ("executing", 100, 30)], "2 min 30 s", ""),
        ("executing", [("executing", 252, 120), ("paused", 120, 60), ("executing", 60, 0)], "3 min 12 s", "3 min left"),
        (
            "executing",
            [("executing", 252, 120), ("paused", 120, 60)],
            "2 min 14 s",
            "4 min left",
        ),  # going on was read 2 s ago
    ],
)
def test_the_time_of_a_pause_does_not_count(state, activities, elapsed, left):
    status = replace(EXECUTING, state=RobotState.PAUSE if state == "paused" else RobotState.EXECUTING)
    spans = tuple(ActivitySpan(activity, ago(seconds=start), ago(seconds=end)) for activity, start, end in activities)
    facts = replace(with_aino(status), activities=spans)
    card, later = view(facts).card, present(facts, NOW + timedelta(seconds=20), None).card
    assert (card.mission.elapsed, card.end_tile.note) == (elapsed, left) if left else card.mission.elapsed == elapsed
    assert (later.mission.progress == card.mission.progress) is (state == "paused")


def test_much_longer_than_usual_is_reported():
    facts = replace(FACTS, expected={KITS.guid: DurationEstimate(100.0, 110.0)})
    card = view(facts).card
    assert card.mission.tone == "attention"
    assert card.mission.progress == 1.0


def test_a_typed_duration_is_called_one_and_raises_no_concern():
    facts = replace(FACTS, expected={KITS.guid: DurationEstimate(120.0, 120.0, typed=True)})
    card = view(facts).card
    assert (card.mission.note, card.mission.progress) == ("of 2 min as typed in Settings", 1.0)
    assert card.mission.tone != "attention"


def test_a_first_run_has_nothing_to_compare_with():
    card = view(replace(FACTS, expected={})).card
    assert card.mission.progress == -1
    assert card.mission.note == "no earlier run to compare with"


def test_somebody_elses_mission_counts_from_when_this_tablet_saw_it():
    facts = replace(
        with_aino(EXECUTING, (QueueItem(7, QueueState.EXECUTING, mission_id="strange"),)),
        open=(),
        names={"strange": "Wash the floor"},
        seen_running={(AINO.id, 7): ago(seconds=65)},
    )
    card = view(facts).card
    assert card.mission.name == "Wash the floor"
    assert card.mission.elapsed == "1 min 05 s"


def test_when_an_item_of_that_number_was_seen_on_another_robot_says_nothing():
    facts = replace(
        with_aino(EXECUTING, (QueueItem(7, QueueState.EXECUTING, mission_id="strange"),)),
        open=(),
        seen_running={(VEIKKO.id, 7): ago(seconds=65)},
    )
    assert facts.running_since(facts.running) is None


def test_unknown_values_are_a_dash_and_never_zero():
    facts = with_aino(
        replace(READY, battery_percentage=None, linear_velocity=None, distance_to_next_target=None, moved=None), ()
    )
    card = view(facts).card
    assert card.battery.text == "–"
    assert card.battery.level == -1
    assert {row.value for row in card.facts} == {"–"}


def test_an_old_state_looks_old_and_says_since_when():
    shown = view(with_aino(EXECUTING, age=300, connection=Connection.UNREACHABLE, problem="10.40.12.21 doesn't answer"))
    assert shown.card.state == "No answer"
    assert shown.card.old
    assert shown.card.mission.note == "unknown since 14:33"
    assert shown.card.end_tile.note == "No answer since 14:18"
    assert shown.card.message == "10.40.12.21 doesn't answer"
    assert shown.card.mission.elapsed == ""
    assert shown.queue_note == "as of 14:33"
    assert shown.queue[0].tone == "offline"


def test_an_old_reading_promises_nothing():
    silent = with_aino(EXECUTING, age=300, connection=Connection.UNREACHABLE)
    assert (view(FACTS).card.battery.note, view(silent).card.battery.note) == ("about 4 h 10 min left", "as of 14:33")
    charging = with_aino(replace(CHARGING, battery_percentage=50.0), age=300)
    assert view(charging).card.battery.note == "as of 14:33"
    assert view(silent, 2).run.low_battery.startswith("The battery of Aino is not known")


def test_a_silent_robot_is_not_said_to_have_nothing_to_do():
    idle = with_aino(READY, ())
    assert view(idle).queue_empty.startswith("Aino has nothing to do.")
    silent = with_aino(READY, (), age=300, connection=Connection.UNREACHABLE)
    assert view(silent).queue_empty == "The queue was empty when Aino last answered."
    off = replace(idle, robots=(replace(AINO, enabled=False), *idle.robots[1:]))
    assert view(off).queue_empty == "The queue of a robot that is switched off is not read."


def test_problems_are_reported_in_the_language_of_the_screen():
    problem = Unreachable(code="refused", address="10.40.12.21").message
    facts = with_aino(EXECUTING, age=300, connection=Connection.UNREACHABLE, problem=problem)
    assert (
        view(facts).card.message
        == "10.40.12.21 refused the connection; is the robot switched on and its address right?"
    )
    translator.use("fi")
    try:
        assert view(facts).card.message == "10.40.12.21 ei ota yhteyttä vastaan; onko robotti päällä ja osoite oikein?"
        ended = execution(1, AINO, "Deliver", State.FAILED, reason=Reason(ReasonCode.REFUSED, {"problem": problem}))
        assert outcome_line(ended).endswith("osoite oikein?")
    finally:
        translator.use("en")


def test_connected_but_silent_for_three_polls_is_old_too():
    old = snapshot(1, EXECUTING, age=91)
    assert link_appearance(AINO, old, NOW, SETTINGS).word == "No update · 1 min ago"
    assert link_appearance(AINO, snapshot(1, EXECUTING, age=89), NOW, SETTINGS).tone == "neutral"


@pytest.mark.parametrize(
    ("connection", "words"),
    [
        (Connection.UNAUTHORIZED, "Wrong password"),
        (Connection.WRONG_ROBOT, "Another robot"),
        (Connection.UNTRUSTED, "Another certificate"),
        (Connection.NOT_A_ROBOT, "Another robot"),
    ],
)
def test_each_problem_with_the_connection_has_its_words(connection, words):
    seen = snapshot(1, EXECUTING, connection=connection)
    look = link_appearance(AINO, seen, NOW, SETTINGS)
    assert look.word.startswith(words)
    assert look.tone == "attention"
    assert state_appearance(AINO, seen, stale=False).word == words  # the same as what the robot does


def test_a_robot_that_needs_its_password_says_so_everywhere():
    waiting = replace(AINO, enabled=False, needs_password=True, token=None)
    shown = view(replace(FACTS, robots=(waiting, VEIKKO), planned=()))
    assert (shown.card.state, shown.card.end_tile.note, shown.card.tone) == (
        "Off",
        "Off",
        "attention",
    )
    assert shown.card.mission.note == "Its password has to be entered in Settings"
    assert shown.run.text == "Aino needs its password"
    assert shown.planned_empty == "Nothing starts on Aino before its password is entered in Settings."


def test_an_idle_robot_says_what_comes_next():
    card = view(with_aino(READY, ())).card
    assert (card.state, card.tone) == ("Ready", "neutral")
    assert card.mission.note == "next: Deliver kits to line 2, in 22 min"


@pytest.mark.parametrize(
    ("battery", "mission", "words"),
    [
        (12.0, CHARGER, "Return to charger when idle waits: battery 12 %, needs 30 %"),
        (None, CHARGER, "Return to charger when idle waits: battery unknown"),
        (12.0, replace(CHARGER, charges=True), ""),
        (12.0, replace(CHARGER, on_low_battery=True), ""),
        (80.0, CHARGER, ""),
    ],
)
def test_an_idle_robot_says_what_keeps_its_idle_mission(battery, mission, words):
    aino = replace(AINO, idle=IdleRule(mission.id))
    ready = with_aino(replace(READY, battery_percentage=battery), ())
    facts = replace(ready, robots=(aino, *ready.robots[1:]), entered=(mission,))
    planned = "next: Deliver kits to line 2, in 22 min"
    assert view(facts).card.mission.note == (f"{planned} · {words}" if words else planned)
    off = replace(facts, robots=(replace(aino, idle=replace(aino.idle, enabled=False)), *ready.robots[1:]))
    assert view(off).card.mission.note == planned


def test_an_idle_robot_says_that_nothing_starts_on_a_day_off():
    ready = with_aino(READY, ())
    facts = replace(
        ready,
        robots=(replace(AINO, idle=IdleRule(CHARGER.id)), *ready.robots[1:]),
        entered=(CHARGER,),
        planned=(),
        calendar=WorkingCalendar(replace(SETTINGS, working_days=("MO",))),
    )
    assert view(facts).card.mission.note == "Return to charger when idle: not today, a day off"


@pytest.mark.parametrize(
    ("percent", "icon"), [(100.0, "battery"), (78.0, "battery-80"), (3.0, "battery-alert-variant-outline")]
)
def test_battery_icons(percent, icon):
    assert battery_appearance(replace(READY, battery_percentage=percent), Settings()).icon == icon


def test_charging_is_seen():
    look = battery_appearance(CHARGING, SETTINGS)
    assert look.note == "under 30 %"
    assert battery_appearance(replace(CHARGING, battery_percentage=50.0), SETTINGS).note == "charging"


# ---------------------------------------------------------------------- held robots
def test_a_held_robot_says_so_on_its_card_and_its_tile():
    until = Hold("Maintenance", NOW + timedelta(minutes=38), ago(minutes=1), robot_id=2)
    held = replace(FACTS, settings=replace(FACTS.settings, selected_robot_id=2), holds=(until,))
    shown = present(held, NOW)
    assert (shown.card.state, shown.card.note) == ("Ready, held", "Veikko · MiR100 · held until 15:16")
    assert [(robot.name, robot.word) for robot in shown.robots] == [
        ("Aino", "Working"),
        ("Veikko", "On hold"),
        ("Sisu", "Charging"),
    ]
    assert present(replace(held, holds=(replace(until, until=None),)), NOW).card.note.endswith(" · held until released")
    assert present(replace(held, holds=()), NOW).card.state == "Ready"
