"""A run that failed is run again: the same mission with its parameters, on the same robot or on any of the same group."""

from __future__ import annotations

import pytest

from app.domain.execution import Execution, State
from app.domain.models import InvalidInput
from tests.support.errors import raises


def failed(site, plan) -> Execution:
    """By the robot."""
    site.machines["R1"].fail_next = "a pallet fell over"
    plan("2026-11-23T06:05")
    site.run(600)
    [row] = site.executions()
    assert row.state is State.FAILED
    return row


def test_it_runs_again_and_the_failed_one_stays(site, plan):
    row = failed(site, plan)
    site.machines["R1"].clear_errors()
    site.machines["R1"].resume()
    again = site.container.operator.run_again(row.id)
    site.run(600)
    assert [(run.id, run.state) for run in site.executions()] == [(row.id, State.FAILED), (again.id, State.COMPLETED)]
    assert (again.mission_guid, again.robot_id, dict(again.parameters)) == (
        row.mission_guid,
        row.robot_id,
        dict(row.parameters),
    )


def test_of_a_group_any_robot_may_have_it(hall):
    row = hall.container.operator.run_on_any(hall.group.id, 1)
    hall.container.operator.cancel_execution(row.id)
    again = hall.container.operator.run_again(row.id)
    hall.run(600)
    assert (again.group_id, again.mission) == (hall.group.id, "Deliver")
    assert [(run.id, run.state) for run in hall.executions()] == [
        (row.id, State.CANCELLED),
        (again.id, State.COMPLETED),
    ]


def test_where_it_can_not_be_a_sentence_says_why(site, plan):
    row = failed(site, plan)
    with pytest.raises(InvalidInput, match="this run is no longer in the history"):
        site.container.operator.run_again(99)
    for schedule in site.container.catalogue.schedules():
        site.container.catalogue.remove_schedule(schedule.id)
    site.container.catalogue.remove_mission(site.container.catalogue.missions()[0].id)
    with raises(InvalidInput, msgid="{robot} has no mission {mission}"):
        site.container.operator.run_again(row.id)
