"""All robots in one look: groups, tiles, counts, filter and order."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.database.robots import Hold
from app.domain.models import Connection, Robot, RobotSnapshot, Settings
from app.domain.robot import RobotProblem, RobotState, RobotStatus
from app.screens.common.holding import HAND
from app.screens.common.robot_appearance import battery_appearance, is_old
from app.screens.common.robot_groups import Group, group_of, help_words, or_held
from app.screens.home import fleet
from app.screens.home.fleet import Look, RobotTile, Work, arranged, counts, robot_tile
from tests.support import home_facts as sample
from tests.support.home_facts import AINO, NOW, SETTINGS, snapshot


def look(
    status: RobotStatus | None, robot: Robot = AINO, doing: Work | None = None, **values
) -> tuple[Group, RobotTile]:
    seen = snapshot(robot.id, status, **values)
    old = is_old(seen, NOW, SETTINGS)
    group = group_of(robot, seen, old, SETTINGS)
    return group, robot_tile(robot, seen, doing, group, old, SETTINGS, NOW)


def test_a_held_robot_is_not_called_ready():
    group, _tile = look(sample.READY)
    assert or_held(group, (Hold(robot_id=2),), AINO, NOW) is Group.READY
    assert or_held(Group.WORKING, (Hold(robot_id=1),), AINO, NOW) is Group.WORKING
    held = or_held(group, (Hold(robot_id=1),), AINO, NOW)
    tile = robot_tile(AINO, snapshot(1, sample.READY), None, held, False, SETTINGS, NOW)
    assert (tile.word, tile.icon, tile.tone) == ("On hold", HAND, "neutral")
    assert [count.text for count in counts({1: held, 2: group}, Look())] == ["1 held", "1 ready"]


def in_state(state: RobotState, **values) -> RobotStatus:
    return replace(sample.READY, state=state, **values)


# ---------------------------------------------------------------------- one robot
@pytest.mark.parametrize(
    ("status", "group", "tone", "detail"),
    [
        (sample.STOPPED, Group.STOPPED, "fault", "Stopped"),
        (sample.FAILED, Group.STOPPED, "fault", "Failed to reach goal position 'Line 2' (10120)"),
        (sample.ASKING, Group.ASKS, "action", "Is the pallet loaded at Dock 3?"),
        (in_state(RobotState.PAUSE), Group.PAUSED, "action", ""),
        (in_state(RobotState.MANUAL_CONTROL), Group.LOOK, "attention", "Manual control"),
        (in_state(RobotState.UNKNOWN, state_text="Levitating"), Group.LOOK, "attention", "Levitating"),
        (
            in_state(RobotState.EXECUTING, errors=(RobotProblem(1, "Lidar is dirty"),)),
            Group.LOOK,
            "attention",
            "Lidar is dirty (1)",
        ),
        (in_state(RobotState.READY, battery_percentage=29.0), Group.LOOK, "attention", "Battery under 30 %"),
        (sample.READY, Group.READY, "neutral", ""),
        (in_state(RobotState.COMPLETED), Group.READY, "neutral", ""),
        (sample.CHARGING, Group.CHARGING, "neutral", ""),
        (in_state(RobotState.SHUTTING_DOWN), Group.STARTING, "neutral", "Off"),
        (in_state(RobotState.DOCKING), Group.WORKING, "neutral", ""),
    ],
)
def test_a_robot_is_in_the_group_that_its_state_says(status, group, tone, detail):
    found, tile = look(status)
    assert (found, tile.tone, tile.detail) == (group, tone, detail)
    assert tile.loud == (group is Group.STOPPED)
    assert tile.icon


@pytest.mark.parametrize(("percent", "group"), [(9.0, Group.LOOK), (10.0, Group.READY)])
def test_a_battery_that_is_nearly_empty_is_looked_at_without_a_minimum(percent, group):
    status, settings = in_state(RobotState.READY, battery_percentage=percent), Settings()
    assert group_of(AINO, snapshot(1, status), False, settings) is group
    tile = robot_tile(AINO, snapshot(1, status), None, group, False, settings, NOW)
    assert tile.battery_tone == ("attention" if group is Group.LOOK else "neutral")
    assert tile.detail == ("Battery under 10 %" if group is Group.LOOK else "")
    charging = replace(sample.CHARGING, battery_percentage=percent)
    assert battery_appearance(charging, settings).note == "charging"


def test_a_silent_robot_says_since_when_and_shows_no_old_values():
    group, tile = look(sample.EXECUTING, doing=Work("Deliver", 2), age=400, connection=Connection.UNREACHABLE)
    assert (group, tile.word, tile.detail, tile.battery) == (Group.SILENT, "No answer", "since 14:18", "–")


def test_a_robot_that_answers_wrongly_says_how():
    group, tile = look(sample.READY, connection=Connection.UNAUTHORIZED)
    assert (group, tile.detail) == (Group.SILENT, "Wrong password since 14:18")


def test_a_reading_that_is_too_old_is_no_answer():
    group, tile = look(sample.EXECUTING, age=400)
    assert (group, tile.detail) == (Group.SILENT, "No update · 6 min ago")


@pytest.mark.parametrize(
    ("robot", "group"),
    [(replace(AINO, enabled=False), Group.OFF), (replace(AINO, enabled=False, needs_password=True), Group.LOOK)],
)
def test_a_disabled_robot_needs_attention_only_for_a_missing_password(robot, group):
    found, tile = look(sample.STOPPED, robot)
    assert (found, tile.detail) == (group, "Off" if robot.needs_password else "")


def test_a_robot_that_was_not_asked_yet_is_starting():
    unknown = RobotSnapshot(1)
    assert group_of(AINO, unknown, is_old(unknown, NOW, SETTINGS), SETTINGS) is Group.STARTING


@pytest.mark.parametrize(
    ("elapsed", "usual", "detail"),
    [
        (60.0, 420.0, "6 min left · Deliver"),
        (301.0, 420.0, "2 min left · Deliver"),
        (419.0, 420.0, "1 min left · Deliver"),
        (430.0, 420.0, "soon done · Deliver"),
        (700.0, 420.0, "longer than usual · Deliver"),
        (60.0, 9000.0, "2 h 29 min left · Deliver"),
        (60.0, None, "Deliver"),
        (None, 420.0, "Deliver"),
    ],
)
def test_a_running_mission_says_its_remaining_time(elapsed, usual, detail):
    doing = fleet.work("Deliver", elapsed, usual)
    _group, tile = look(sample.EXECUTING, doing=doing)
    assert (tile.detail, tile.late) == (detail, detail.startswith("longer"))


def test_words_of_many_lines_become_one():
    _group, tile = look(
        replace(sample.ASKING, user_prompt=replace(sample.ASKING.user_prompt, question="Is it\n  there?"))
    )
    assert tile.detail == "Is it there?"


# ---------------------------------------------------------------------- all of them
GROUPS = {1: Group.READY, 2: Group.WORKING, 3: Group.STOPPED, 4: Group.WORKING, 5: Group.SILENT}
TILES = [RobotTile(key, f"Robot {key}") for key in GROUPS]


def test_counts_are_by_urgency_without_zeros():
    found = counts(GROUPS, Look())
    assert [count.text for count in found] == ["1 stopped", "1 no answer", "2 working", "1 ready"]
    assert [count.tone for count in found] == ["fault", "attention", "neutral", "neutral"]


def test_an_empty_group_that_is_shown_is_counted():
    count = counts(GROUPS, Look(Group.ASKS))[1]
    assert (count.text, count.selected, count.tone) == ("0 ask", True, "neutral")


def test_a_filter_keeps_the_places():
    assert [tile.key for tile in arranged(TILES, GROUPS, Look(Group.WORKING))] == [2, 4]


def test_robots_that_need_a_person_come_first_and_the_others_keep_their_order():
    assert [tile.key for tile in arranged(TILES, GROUPS, Look(needy_first=True))] == [3, 5, 2, 4, 1]


def test_all_is_well_when_no_robot_needs_a_person():
    assert not fleet.all_well(GROUPS, alarms=0)
    assert fleet.all_well({1: Group.READY, 2: Group.CHARGING, 3: Group.OFF}, alarms=0)
    assert not fleet.all_well({1: Group.READY}, alarms=1)


def test_help_is_counted_in_words():
    assert help_words(GROUPS.values()) == "2 need help"
    assert help_words([Group.ASKS]) == "1 needs help"
    assert help_words([Group.READY]) == ""


def test_time_left_runs_down():
    minutes = [fleet.work("Deliver", float(elapsed), 300.0).minutes_left for elapsed in (0, 59, 61, 241, 299, 301)]
    assert minutes == [5, 5, 4, 1, 1, 0]
