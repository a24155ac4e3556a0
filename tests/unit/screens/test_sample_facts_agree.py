"""All pictures show one Friday at 14:38: Home, the Scheduler and Logs say the same of a run, and banners agree with robots."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from zoneinfo import ZoneInfo

import pytest

from app.container import Container
from app.domain.execution import Execution, State, Wait
from app.domain.robot import QueueState
from app.screens.common.alarm_groups import group_text
from app.screens.common.robot_appearance import is_old
from app.screens.common.robot_groups import Group, group_of
from app.screens.frame.view import open_lines
from mir_sim import world
from tests.support import fleet_facts, month
from tests.support import home_facts as sample
from tests.support.history import last_ended
from tests.support.sample_alarms import issues_of

OF_HOME = {
    "all well": sample.FACTS,
    "waiting": sample.WITH_WAITING,
    "held": sample.on_hold(sample.FACTS),
    "stopped": sample.with_aino(sample.STOPPED),
    "failed": sample.with_aino(sample.FAILED),
    "asking": sample.with_aino(sample.ASKING),
    "two out": sample.without_veikko(),
    "silent": sample.without_aino(),
}
OF_MANY = {"twelve": fleet_facts.facts(12), "fifty": fleet_facts.facts(50)}
STORIES = OF_HOME | OF_MANY


def minute(at: datetime | None) -> str:
    return f"{at.astimezone(ZoneInfo(sample.ZONE)):%d %H:%M}" if at else "–"


def summary(run: Execution) -> tuple[object, ...]:
    """What two screens may say of a run."""
    seconds = round(run.duration_s) if run.duration_s else None
    return (
        run.robot,
        run.mission,
        run.state,
        run.trigger,
        run.wait,
        dict(run.wait_details),
        minute(run.planned_at),
        minute(run.ended_at),
        seconds,
        run.reason,
    )


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Container]:
    container = month.plant(Path(tmp_path_factory.mktemp("plant")))
    yield container
    container.close()


def test_all_samples_show_one_moment():
    assert sample.NOW == month.NOW


def test_home_plans_what_the_scheduler_plans(plant):
    assert [(run.at, run.robot.name, run.mission.name) for run in sample.PLANNED] == [
        (run.at, run.robot.name, run.mission.name) for run in plant.plan.next(len(sample.PLANNED))
    ]


def test_home_has_the_runs_of_logs(plant):
    assert [summary(run) for run in sample.FINISHED] == [
        summary(run) for run in last_ended(plant, len(sample.FINISHED))
    ]


def test_home_and_logs_have_the_same_under_way(plant):
    def by_robot(runs: tuple[Execution, ...] | list[Execution]) -> list[tuple[object, ...]]:
        return sorted((summary(run) for run in runs), key=str)

    assert by_robot(sample.FACTS.open) == by_robot(plant.history.open())
    running = next(run for run in sample.FACTS.open if run.state is State.EXECUTING)
    assert running.started_at == next(run for run in plant.history.open() if run.state is State.EXECUTING).started_at
    assert {run.schedule for run in sample.FACTS.open if run.schedule} <= {
        schedule.name for schedule in plant.catalogue.schedules()
    }


def test_a_start_waiting_for_the_battery_matches_the_battery_shown():
    facts = sample.FACTS
    held = next(run for run in facts.open if run.wait_details.get("battery"))
    battery = facts.snapshots[held.robot_id].status.battery_percentage
    assert held.wait_details == {"battery": battery, "minimum": held.minimum_battery_percent}
    assert held.wait_details["battery"] < held.wait_details["minimum"]


@pytest.mark.parametrize("name", STORIES)
def test_nothing_that_was_read_is_younger_than_the_reading(name):
    facts = STORIES[name]
    for robot in facts.robots:
        snapshot = facts.snapshots[robot.id]
        assert snapshot.since <= sample.NOW
        if snapshot.problem:
            assert snapshot.since == snapshot.read_at == snapshot.queue_read_at
        here = replace(facts, settings=replace(facts.settings, selected_robot_id=robot.id))
        for item in snapshot.queue:
            ours = here.execution_of(item)
            ordered = item.ordered.replace(tzinfo=ZoneInfo(sample.ZONE)) if item.ordered else None
            times = [at for at in (ordered, ours and ours.submitted_at, ours and ours.started_at) if at]
            assert times, item
            assert max(times) <= snapshot.queue_read_at, item
            assert item.state is QueueState.PENDING or ours.started_at, item
        on_it = {item.id for item in snapshot.queue}
        assert all(run.queue_id in on_it for run in here.open_here if run.state in (State.QUEUED, State.EXECUTING))


@pytest.mark.parametrize("name", STORIES)
def test_banner_and_bell_agree_with_the_robots(name):
    facts = STORIES[name]
    issues = issues_of(facts)
    seen = [
        group_of(
            robot, snapshot := facts.snapshots[robot.id], is_old(snapshot, sample.NOW, facts.settings), facts.settings
        )
        for robot in facts.robots
    ]
    codes = [alarm.code for alarm in issues.alarms]
    assert codes.count("emergency_stop") + codes.count("robot_error") == seen.count(Group.STOPPED)
    assert (codes.count("question"), codes.count("unreachable")) == (seen.count(Group.ASKS), seen.count(Group.SILENT))
    assert bool(open_lines(issues.alarms, sample.NOW)) == bool(issues.alarms)


def test_nothing_is_sent_while_nothing_is_to_be_sent():
    held = sample.on_hold(sample.FACTS)
    assert all(run.submitted_at <= sample.HOLD.since for run in held.open if run.submitted_at)
    assert {run.wait for run in held.open if run.state is State.WAITING} == {Wait.HOLD}


def test_robots_that_fell_silent_together_are_one_line():
    facts = OF_MANY["fifty"]
    lines = open_lines(issues_of(facts).alarms, sample.NOW)
    assert [group_text(group, facts.settings, sample.NOW) for group in lines] == [
        "Robot 4: emergency stop",
        "Robot 7 asks: Is the pallet loaded at Dock 3?",
        "Robot 31: Can't reach Line 2",
        "3 robots: no answer",
    ]


@pytest.mark.parametrize("count", [12, 50])
def test_where_all_is_well_there_is_nothing_to_say(count):
    issues = issues_of(fleet_facts.facts(count, well=True))
    assert (issues.alarms, list(issues.holds)) == ([], [])


@pytest.mark.parametrize("name", OF_HOME)
def test_robots_stand_where_robots_can(name):
    for robot_id, snapshot in OF_HOME[name].snapshots.items():
        pose = snapshot.status.position
        assert not any(
            box.left <= pose.x <= box.right and box.bottom <= pose.y <= box.top for box in world.OBSTACLES
        ), robot_id
    places = [(snapshot.status.position.x, snapshot.status.position.y) for snapshot in OF_HOME[name].snapshots.values()]
    assert len(set(places)) == len(places)


def test_a_charging_robot_is_at_the_charger():
    charger = world.BY_NAME["Charger"].pose
    sisu = sample.FACTS.snapshots[sample.SISU.id].status
    assert (sisu.position.x, sisu.position.y) == (charger.x, charger.y)
