"""The Logs of runs that any robot of a group could take."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.domain.execution import State, Wait
from app.domain.models import Group, Robot
from app.screens.logs import of_groups, view
from app.screens.logs.facts import execution_filter
from app.screens.logs.of_groups import OfGroup
from app.screens.logs.view import Filters, Period
from tests.unit.screens.test_logs_story import steps_of
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
    assert steps_of(RUN)[:4] == [
        ("Planned", "13:30:00", "Kits · any of Hall 1"),
        ("Passed by", "–", "Aino: the connection was refused"),
        ("Chosen", "13:30:01", "Sisu: free now · Veikko 18 % battery"),
        ("Sent", "13:30:02", "1st try"),
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
    assert steps_of(waits)[1] == (
        "Waits for a robot",
        "–",
        "Sisu: free now · Veikko 18 % battery",
    )
    assert view.row(waits, NOW, ZONE).place == "any of Hall 1"


@pytest.mark.parametrize("run", [DONE, replace(DONE, robot_group="", tried={"1": {"tries": 1, "robot": "Aino"}})])
def test_the_story_of_a_run_of_one_robot_is_as_ever(run):
    assert [label for label, _time, _note in steps_of(run)] == ["Planned", "Sent", "Started", "Completed"]
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
    assert view.robot_word(filters, []) == "Any of Hall 1"
    assert view.empty_text(filters) == "Nothing found"
    assert OfGroup("Hall 1", (1, 2)) == options[1].key
