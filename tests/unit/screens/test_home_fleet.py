"""All robots in one look: cells, what needs a person, counts, groups."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.robots import Hold
from app.domain.capabilities import Capabilities
from app.domain.execution import DurationEstimate
from app.domain.models import Connection, Robot, RobotSnapshot, Settings
from app.domain.models import Group as RobotGroup
from app.domain.robot import RobotProblem, RobotState, RobotStatus
from app.screens.common.holding import HAND
from app.screens.common.robot_appearance import battery_appearance, is_old
from app.screens.common.robot_groups import Group, free_words, group_of, or_held, robots_in_words
from app.screens.home import fleet
from app.screens.home.fleet import (
    Look,
    causes,
    columns,
    counts,
    halls_of,
    heading,
    heads,
    listed,
    minutes_left,
    of_group,
    pane_of,
    to_do,
    troubles_in_words,
)
from tests.support import fleet_facts
from tests.support import home_facts as sample
from tests.support.home_facts import AINO, NOW, SETTINGS, ago, snapshot

SELDOM = Robot("Robot 9", "http://10.40.12.29", id=9, token="x")


def seen(robot: Robot, shot: RobotSnapshot, since=None, left: int | None = None, settings: Settings = SETTINGS) -> Look:
    old = is_old(shot, NOW, settings)
    return fleet.look(robot, shot, group_of(robot, shot, old, settings), old, settings, left, since)


def look(status: RobotStatus | None, robot: Robot = AINO, since=None, left: int | None = None, **values) -> Look:
    return seen(robot, snapshot(robot.id, status, **values), since, left)


def in_state(state: RobotState, **values) -> RobotStatus:
    return replace(sample.READY, state=state, **values)


PAUSED = in_state(RobotState.PAUSE)


def numbered(n: int, status: RobotStatus, since=None) -> Look:
    return look(status, replace(SELDOM, name=f"Robot {n}", id=n), since)


def silent(n: int, minutes: int) -> Look:
    robot = replace(SELDOM, name=f"Robot {n}", id=n)
    shot = sample.silent(robot, sample.READY, minutes=minutes)
    return seen(robot, shot, shot.since)


def rows(*looks: Look, halls=None):
    return to_do(looks, SETTINGS, NOW, halls or {})


# ---------------------------------------------------------------------- one robot
@pytest.mark.parametrize(
    ("status", "group", "tone", "fact", "problem", "remedy"),
    [
        (
            sample.STOPPED,
            Group.STOPPED,
            "fault",
            "Stopped",
            "Emergency stop. Release the red button, then press Reset on the robot.",
            "",
        ),
        (
            sample.FAILED,
            Group.STOPPED,
            "fault",
            "Stopped",
            "Can't reach Line 2",
            "reset",
        ),
        (sample.ASKING, Group.ASKS, "action", "Asks", "Is the pallet loaded at Dock 3?", ""),
        (PAUSED, Group.PAUSED, "action", "Paused", "Paused", "resume"),
        (in_state(RobotState.MANUAL_CONTROL), Group.LOOK, "attention", "Manual control", "Manual control", ""),
        (
            in_state(RobotState.UNKNOWN, state_text="Levitating", mission_text="Levitating"),
            Group.LOOK,
            "attention",
            "–",
            "Levitating",
            "",
        ),
        (
            in_state(RobotState.EXECUTING, errors=(RobotProblem(1, "Lidar is dirty"),)),
            Group.LOOK,
            "attention",
            "Working",
            "Lidar is dirty (1)",  # not among the texts that are known
            "",
        ),
        (
            in_state(RobotState.READY, battery_percentage=29.0),
            Group.LOOK,
            "attention",
            "29 %",
            "Battery under 30 %",
            "",
        ),
        (sample.READY, Group.READY, "neutral", "Ready", "Ready", ""),
        (in_state(RobotState.COMPLETED), Group.READY, "neutral", "Ready", "Ready", ""),
        (in_state(RobotState.SHUTTING_DOWN), Group.STARTING, "neutral", "Off", "Off", ""),
        (in_state(RobotState.DOCKING), Group.WORKING, "neutral", "Working", "Working", ""),
    ],
)
def test_a_robot_looks_as_its_state_says(status, group, tone, fact, problem, remedy):
    found = look(status)
    assert (found.group, found.cell.tone, found.cell.support) == (group, tone, fact)
    assert (found.problem, found.remedy) == (problem, remedy)
    assert found.cell.loud == (group is Group.STOPPED)
    assert found.cell.icon


def test_a_charging_robot_says_its_level_and_is_never_amber():
    found = look(replace(sample.CHARGING, battery_percentage=45.0))
    assert (found.cell.support, found.cell.tone, found.said) == ("45 %", "neutral", "Charging · 45 %")


def test_a_ready_robot_on_hold_says_so():
    shot = snapshot(1, sample.READY)
    assert or_held(Group.READY, (Hold(robot_id=2),), AINO, NOW) is Group.READY
    held = or_held(Group.READY, (Hold(robot_id=1),), AINO, NOW)
    cell = fleet.look(AINO, shot, held, False, SETTINGS).cell
    assert (cell.support, cell.icon, cell.tone) == ("On hold", HAND, "neutral")


@pytest.mark.parametrize(("percent", "group"), [(9.0, Group.LOOK), (10.0, Group.READY)])
def test_a_battery_that_is_nearly_empty_is_looked_at_without_a_minimum(percent, group):
    status, settings = in_state(RobotState.READY, battery_percentage=percent), Settings()
    found = seen(AINO, snapshot(1, status), settings=settings)
    assert (found.group, found.problem) == (group, "Battery under 10 %" if group is Group.LOOK else "Ready")
    charging = replace(sample.CHARGING, battery_percentage=percent)
    assert battery_appearance(charging, settings).note == "charging"


def test_a_silent_robot_says_what_is_wrong_and_its_last_state():
    found = look(sample.EXECUTING, age=400, connection=Connection.UNREACHABLE)
    assert (found.group, found.problem, found.cell.support) == (Group.SILENT, "No answer", "No answer")
    assert found.said.startswith("Working · ")
    assert look(sample.READY, connection=Connection.UNAUTHORIZED).problem == "Wrong password"
    assert look(sample.EXECUTING, age=400).group is Group.SILENT  # a reading that is too old is no answer


@pytest.mark.parametrize(
    ("robot", "group", "problem"),
    [
        (replace(AINO, enabled=False), Group.OFF, "Off"),
        (replace(AINO, enabled=False, needs_password=True), Group.LOOK, "Needs its password"),
    ],
)
def test_a_disabled_robot_needs_attention_only_for_a_missing_password(robot, group, problem):
    found = look(sample.STOPPED, robot)
    assert (found.group, found.problem, found.remedy) == (group, problem, "")


def test_a_robot_that_was_not_asked_yet_is_unknown():
    found = seen(AINO, RobotSnapshot(1))
    assert (found.group, found.cell.support, found.is_known) == (Group.STARTING, "–", False)


@pytest.mark.parametrize(
    ("elapsed", "usual", "fact"),
    [
        (60.0, DurationEstimate(420.0, 420.0), "6 min left"),
        (301.0, DurationEstimate(420.0, 420.0), "1 min left"),
        (419.0, DurationEstimate(420.0, 420.0), "1 min left"),
        (430.0, DurationEstimate(420.0, 420.0), "Soon done"),
        (700.0, DurationEstimate(420.0, 420.0), "4 min late"),
        (700.0, DurationEstimate(420.0, 420.0, typed=True), "Soon done"),
        (60.0, DurationEstimate(9000.0, 9000.0), "2 h 29 min left"),
    ],
)
def test_a_run_says_how_long_it_still_takes(elapsed, usual, fact):
    assert look(sample.EXECUTING, left=minutes_left(usual.left_s(elapsed))).cell.support == fact


# ---------------------------------------------------------------------- what needs a person
def test_the_worst_comes_first_then_the_oldest():
    looks = (
        numbered(1, PAUSED, ago(minutes=40)),
        numbered(2, sample.FAILED, ago(minutes=7)),
        numbered(3, sample.FAILED, ago(minutes=9)),
        numbered(4, sample.STOPPED, ago(minutes=2)),
        numbered(5, sample.READY),
        numbered(6, sample.FAILED),
    )
    assert [row.title for row in rows(*looks)] == ["Robot 4", "Robot 3", "Robot 2", "Robot 6", "Robot 1"]
    assert [row.aside for row in rows(*looks)] == ["14:36", "14:29", "14:31", "", "13:58"]


def test_each_row_has_the_one_button_that_helps():
    found = rows(
        numbered(1, sample.STOPPED), numbered(2, sample.FAILED), numbered(3, sample.ASKING), numbered(4, PAUSED)
    )
    assert [[action.text for action in row.actions] for row in found] == [
        [""],  # only a person at the robot can do it: the way to it
        ["Reset errors"],
        ["Yes", "No", "Skip this stop"],
        ["Resume"],
    ]


def test_what_its_fleet_cannot_do_has_no_button():
    can = Capabilities(pause=False, clear_error=False, prompts=False)
    for status in (PAUSED, in_state(RobotState.ERROR), sample.ASKING):
        (row,) = rows(look(status, since=ago(minutes=1), capabilities=can))
        assert [action.name for action in row.actions] == ["open"]


def test_robots_with_one_cause_in_one_minute_are_one_row():
    looks = (silent(9, 15), silent(23, 15), silent(40, 15), silent(41, 3))
    found = rows(*looks)
    assert [(row.title, row.support) for row in found] == [("Robot 9, 23, 40", "No answer"), ("Robot 41", "No answer")]
    assert [row.actions[0].name for row in found] == ["open", "open"]
    assert [len(same) for same in causes(looks, SETTINGS.timezone).values()] == [3, 1]


def test_robots_without_a_common_beginning_are_named_in_full():
    looks = tuple(
        replace(silent(n, 15), robot=replace(SELDOM, name=name, id=n)) for n, name in ((1, "Aino"), (2, "Sisu 2"))
    )
    assert rows(*looks)[0].title == "Aino, Sisu 2"


def test_many_at_once_are_counted_with_what_the_others_do():
    lost = [silent(n, 2) for n in range(1, 6)]
    (row,) = rows(*lost, numbered(7, sample.READY), numbered(8, sample.EXECUTING))
    assert (row.title, row.support) == ("5 robots", "No answer, all at the same minute. 2 others answer.")
    assert rows(*lost)[0].support == "No answer, all at the same minute. Maybe this tablet has no network."
    stopped = [numbered(n, PAUSED, ago(minutes=2)) for n in range(1, 6)]
    assert rows(*stopped)[0].support == "Paused, all at the same minute."


def test_questions_are_never_one_row():
    """Each has its own answer."""
    assert len(rows(numbered(1, sample.ASKING, NOW), numbered(2, sample.ASKING, NOW))) == 2


def test_a_question_of_many_lines_becomes_one():
    prompt = replace(sample.ASKING.user_prompt, question="Is it\n  there?")
    assert look(replace(sample.ASKING, user_prompt=prompt)).problem == "Is it there?"


def test_an_option_is_offered_once():
    prompt = replace(sample.ASKING.user_prompt, options=("Yes", "Yes", "No"))
    (row,) = rows(look(replace(sample.ASKING, user_prompt=prompt)))
    assert [action.text for action in row.actions] == ["Yes", "No"]


def test_the_group_is_named_where_there_are_many_robots():
    (row,) = rows(numbered(1, sample.STOPPED, ago(minutes=2)), halls={1: "Hall 1"})
    assert row.aside == "14:36 · Hall 1"


def test_listed_robots_say_their_state_and_keep_their_button():
    found = listed([numbered(1, PAUSED), numbered(2, sample.CHARGING)])
    assert [(row.title, row.meta.split(" · ")[0], row.actions[0].name) for row in found] == [
        ("Robot 1", "Paused", "resume"),
        ("Robot 2", "Charging", "open"),
    ]


def test_help_is_counted_in_words():
    ready, asks = numbered(1, sample.READY), numbered(2, sample.ASKING)
    assert troubles_in_words([ready, asks, silent(3, 9)]) == "2 need you"
    assert troubles_in_words([ready, asks]) == "1 needs you"
    assert troubles_in_words([ready]) == ""


# ---------------------------------------------------------------------- through a fleet
def looks_of(facts) -> list[Look]:
    free = {
        robot.id: free_words(robot, facts.robots, facts.snapshots.get, facts.settings, NOW) for robot in facts.robots
    }
    groups = {robot.id: group_of(robot, facts.snapshots[robot.id], False, SETTINGS) for robot in facts.robots}
    return [
        fleet.look(
            robot,
            shot := facts.snapshots[robot.id],
            groups[robot.id],
            is_old(shot, NOW, SETTINGS),
            SETTINGS,
            since=shot.since,
            free=free[robot.id],
        )
        for robot in facts.robots
    ]


def test_any_robot_of_a_fleet_says_how_many_are_free():
    found = looks_of(fleet_facts.of_fleet(sample.READY, sample.EXECUTING, sample.CHARGING, sample.FAILED))
    assert [(each.cell.title, each.cell.support, each.cell.icon) for each in found[:2]] == [
        ("Any of Hall 2", "2 of 4 free", "robot"),
        ("MiR 1", "Ready", "check-circle-outline"),
    ]
    alone = looks_of(fleet_facts.of_fleet())
    assert [each.cell.support for each in alone] == ["Ready"]  # none of them is in the plan


def test_any_robot_of_a_fleet_is_no_robot_to_count():
    found = looks_of(fleet_facts.of_fleet(sample.READY, sample.READY))
    assert robots_in_words(each.robot for each in found) == "2 robots"
    assert [each.robot.name for each in of_group(found, Group.READY)] == ["MiR 1", "MiR 2"]
    (head,) = heads(found, dict.fromkeys((10, 11, 12), 0), (RobotGroup("Hall", (10, 11, 12), id=1),), None)
    assert (head.robots, [part.text for part in head.calm]) == ("2 robots", ["0", "2", "0"])


def test_a_silent_fleet_is_one_trouble_however_many_robots_it_has():
    found = looks_of(fleet_facts.of_fleet(*[sample.READY] * 10, silent=True))
    (row,) = rows(*found)
    assert (row.title, row.support) == ("Hall 2", "No answer. Is the fleet's server on?")
    assert row.actions[0].name == "open"
    assert troubles_in_words(found) == "1 needs you"
    pane = pane_of(found, row.key[2])
    assert (pane.title, len(pane.rows)) == ("Hall 2", 11)


def test_another_fleet_is_one_trouble_too():
    found = fleet_facts.of_fleet(sample.READY, sample.READY, silent=True)
    others = {number: replace(shot, connection=Connection.WRONG_ROBOT) for number, shot in found.snapshots.items()}
    (row,) = rows(*looks_of(replace(found, snapshots=others)))
    assert (row.title, row.support) == ("Hall 2", "Another fleet")


def test_a_robot_that_its_fleet_has_lost_is_a_trouble_of_its_own():
    found = fleet_facts.of_fleet(sample.READY, sample.READY)
    lost = replace(sample.silent(found.robots[1], sample.READY, minutes=2), fleet_failed=False)
    (row,) = rows(*looks_of(replace(found, snapshots={**found.snapshots, 11: lost})))
    assert (row.title, row.support) == ("MiR 1", "No answer")


# ---------------------------------------------------------------------- all of them
def test_only_normal_robots_are_counted_in_the_head():
    groups = [Group.READY, Group.WORKING, Group.STOPPED, Group.WORKING, Group.SILENT, Group.HELD]
    found = counts(groups, Group.READY)
    assert [count.text for count in found] == ["2 working", "1 ready", "1 on hold"]
    assert [count.selected for count in found] == [False, True, False]


def test_all_is_well_only_if_all_are_known_and_nothing_is_open():
    ready = numbered(1, sample.READY)
    assert heading([ready], has_alarms=False)[0] == "All well"
    assert heading([ready], has_alarms=True)[0] == "Look at the alarms"
    assert heading([ready, seen(AINO, RobotSnapshot(1))], has_alarms=False)[0] == "–"


HALLS = (RobotGroup("Hall 1", (1, 2), id=1), RobotGroup("Yard", (2, 3), id=2))


def test_a_robot_of_two_groups_is_in_the_first_and_one_of_none_in_the_last():
    assert halls_of((1, 2, 3, 4), HALLS) == {1: 0, 2: 0, 3: 1, 4: 2}


def test_heads_count_what_is_abnormal_and_the_rest_in_columns():
    looks = [numbered(1, sample.STOPPED), numbered(2, sample.READY), numbered(3, sample.READY), numbered(4, PAUSED)]
    found = heads(looks, halls_of((1, 2, 3, 4), HALLS), HALLS, 1)
    assert [(head.name, head.robots, head.is_open) for head in found] == [
        ("Hall 1", "2 robots", False),
        ("Yard", "1 robot", True),
        ("Others", "1 robot", False),
    ]
    assert [[part.text for part in head.bad] for head in found] == [["1"], [], ["1"]]
    assert [[part.text for part in head.calm] for head in found] == [["0", "1", "0"], ["0", "1", "0"], ["0", "0", "0"]]


@pytest.mark.parametrize(
    ("count", "width", "height", "scale", "found"),
    [
        (50, 664, 656, 1.0, 7),  # 92 × 68
        (50, 664, 656, 1.3, 5),
        (12, 664, 656, 1.0, 3),  # no wider than 230
        (6, 664, 656, 1.0, 3),
        (30, 664, 656, 1.0, 4),
        (200, 664, 656, 1.0, 7),
        (50, 60, 20, 1.0, 1),
    ],
)
def test_the_fewest_columns_that_show_all(count, width, height, scale, found):
    assert columns(count, width, height, (88 * scale, 68 * scale), 230 * scale, 8) == found


def test_forty_in_trouble_are_seven_rows():
    facts = fleet_facts.outage(50)
    looks = [
        seen(
            robot, shot, shot.since if shot.connection is Connection.UNREACHABLE else NOW - timedelta(minutes=robot.id)
        )
        for robot, shot in ((robot, facts.snapshots[robot.id]) for robot in facts.robots)
    ]
    found = to_do(looks, SETTINGS, NOW, {})
    assert sum(len(same) for same in causes(looks, SETTINGS.timezone).values()) == 40
    assert len(found) == 7
