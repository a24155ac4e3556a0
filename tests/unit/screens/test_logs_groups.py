"""The Logs of runs that any robot of a group could take."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.domain.models import Group, Robot, State, Wait
from app.screens.logs import group_figures, of_groups, view
from app.screens.logs.facts import execution_filter
from app.screens.logs.of_groups import OfGroup
from app.screens.logs.view import Filters, Period
from app.services.history.figures import GroupFacts
from tests.unit.screens.test_logs_view import DONE, NOW, PLANNED, ZONE

CHOICE = {"robots": [{"robot": "Sisu"}, {"robot": "Veikko", "out": "low_battery", "battery": 18}]}
RUN = replace(
    DONE,
    robot="Sisu",
    robot_group="Hall 1",
    group_id=5,
    bound_at=PLANNED + timedelta(seconds=1),
    choice=CHOICE,
    tried={"1": {"tries": 1, "robot": "Aino", "problem": "the connection was refused"}},
)


def test_the_story_has_each_robot_that_was_passed_by_and_why_one_was_chosen():
    steps = [(step.label, step.time, step.note) for step in view.story(RUN, ZONE, {})]
    assert steps[:4] == [
        ("Planned", "13:30:00", "Kits · any of Hall 1"),
        ("Passed by", "–", "Aino: the connection was refused"),
        ("Chosen", "13:30:01", "Sisu: free now; Veikko 18 % battery"),
        ("Submitted", "13:30:02", "1 attempt"),
    ]


def test_a_waiting_start_says_what_each_robot_does_and_its_group():
    waits = replace(
        RUN,
        state=State.WAITING,
        robot="",
        robot_id=None,
        choice={},
        tried={},
        submitted_at=None,
        started_at=None,
        ended_at=None,
        attempts=0,
        wait=Wait.ROBOT,
        wait_details={**CHOICE, "group": "Hall 1"},
    )
    assert [(step.label, step.note) for step in view.story(waits, ZONE, {})][1] == (
        "Waits for a robot",
        "Sisu: free now; Veikko 18 % battery",
    )
    assert view.row(waits, NOW, ZONE, {}, opened=False).robot == "any of Hall 1"


@pytest.mark.parametrize("run", [DONE, replace(DONE, robot_group="", tried={"1": {"tries": 1, "robot": "Aino"}})])
def test_the_story_of_a_run_of_one_robot_is_as_ever(run):
    assert [step.label for step in view.story(run, ZONE, {})] == ["Planned", "Submitted", "Started", "Completed"]
    assert of_groups.whose(run) == "Aino"


def test_groups_are_offered_first_and_filter_by_their_name():
    options = of_groups.target_options(
        [Group("Hall 1", (1, 2), id=5)], [Robot("Aino", "", id=1), Robot("Sisu", "", id=2)]
    )
    assert [(option.text, option.note) for option in options] == [
        ("All robots", ""),
        ("Any of Hall 1", "Aino, Sisu"),
        ("Aino", ""),
        ("Sisu", ""),
    ]
    filters = Filters(Period.ALL, group=options[1].key)
    wanted = execution_filter(filters, NOW, ZONE)
    assert (wanted.group, wanted.robot_ids, filters.robot_ids) == ("Hall 1", None, (1, 2))
    assert view.robot_chip(filters, []) == "Any of Hall 1"
    assert view.empty_texts(filters)[0] == "Nothing found"
    assert OfGroup("Hall 1", (1, 2)) == options[1].key


def test_the_figures_of_a_group_in_words():
    group = GroupFacts(5, "Hall 1", 104, 96, [0.4] * 5 + [25.0], [("Aino", 0.5), ("Sisu", 0.25)])
    [card] = group_figures.cards([group])
    assert (card.title, card.note) == ("Any of Hall 1", "104 starts")
    assert [(row.label, row.value, row.note) for row in card.rows] == [
        ("Started within 1 min of plan", "92 %", "96 of 104"),
        ("Waited for a robot, half within", "0 s", ""),
        ("Nine of ten within", "25 s", ""),
        ("Spread of use", "25 points", "Aino 50 %, Sisu 25 %"),
    ]
    [card] = group_figures.cards([GroupFacts(5, "Hall 1")])
    assert [(row.label, row.value) for row in card.rows] == [("Started within 1 min of plan", "–")]
