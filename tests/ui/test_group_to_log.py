"""From the form to the log with a group: two simulated robots, one breaks, the other comes, and nothing runs twice."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

import mir_sim
from app.container import Container
from app.domain.execution import State
from app.domain.models import Group, Mission, Overlap, Robot, Schedule
from app.screens.scheduler.cards import FormNote, FormSheet
from app.widgets.buttons import CommandButton, Segment
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.fields import Field
from app.widgets.pickers import TimeCell
from app.widgets.sheet import FOOT_RESTS
from tests.support.history import last_ended
from tests.ui.test_plan_to_log import ShiftedClock, go
from tests.ui.whole_app import GUIDS, PASSWORD, USER, shown

pytestmark = pytest.mark.long


@pytest.fixture
def fleet():
    with mir_sim.serve(robots=2, time_scale=20.0, battery=90.0) as fleet:
        yield fleet


@pytest.fixture
def site(tmp_path: Path, fleet):
    container = Container.open(tmp_path, ShiftedClock(datetime(2026, 11, 23, 6, 29, 1, tzinfo=UTC)), with_window=True)
    container.catalogue.change_settings(timezone="UTC", poll_interval_seconds=1)
    robots = [
        container.catalogue.save_robot(Robot(robot.name, robot.url, USER), password=PASSWORD) for robot in fleet.robots
    ]
    container.catalogue.save_group(Group("Hall 1", tuple(robot.id for robot in robots)))
    container.catalogue.save_mission(Mission("Home", GUIDS["Home"]))
    yield container
    container.close()


def pick(ui, label: str, option: str) -> None:
    ui.tap(ui.find(Field, label=label))
    ui.wait(lambda: ui.find_all(ChoiceSheet))
    ui.advance(0.3)
    ui.tap(ui.find(OptionRow, title=option))
    ui.advance(0.3)


def queued(fleet) -> dict[str, int]:
    """Items that each robot has ever had."""
    return {robot.name: len(robot.state()["queue"]) for robot in fleet.robots}


def test_one_robot_breaks_the_other_comes_and_nothing_runs_twice(site, fleet, ui):
    with shown(site, ui) as app:
        go(ui, "scheduler")
        plan = app.shell.navigator.screen("scheduler").vm
        ui.wait(lambda: app.shell.background.idle and plan.has_robots)
        plan.begin()
        ui.wait(lambda: app.shell.background.idle and ui.find_all(Field, label="Robot", value="Aino"))
        ui.tap(ui.find(Field, label="Robot"))
        ui.wait(lambda: ui.find_all(ChoiceSheet))
        ui.advance(0.3)
        assert [row.item.title for row in sorted(ui.find_all(OptionRow), key=lambda row: -row.y)] == [
            "Any of Hall 1",
            "Aino",
            "Veikko",
        ]
        ui.tap(ui.find(OptionRow, title="Any of Hall 1"))
        ui.advance(0.3)
        pick(ui, "Mission", "Home")
        ui.tap(ui.find(Field, label="Time"))
        ui.advance(0.5)
        for hour_or_minute in ("06", "30"):
            ui.tap(ui.find(TimeCell, text=hour_or_minute))
        ui.advance(FOOT_RESTS)
        ui.advance(0.5)
        plan.form.more = True
        ui.advance(0.5)
        assert ui.find(Segment, text="Normal").selected
        for word in ("Beside it", "High"):
            ui.find(FormSheet).ids.page.scroll_to(ui.find(Segment, text=word), animate=False)
            ui.advance(0.2)
            ui.tap(ui.find(Segment, text=word))
        ui.wait(lambda: not ui.find(CommandButton, text="Save").disabled)
        ui.tap(ui.find(CommandButton, text="Save"))
        ui.wait(lambda: site.catalogue.schedules())
        (schedule,) = site.catalogue.schedules()
        (group,) = site.catalogue.groups()
        assert (schedule.name, schedule.robot_id, schedule.group_id, schedule.priority, schedule.overlap) == (
            "Home on Hall 1",
            None,
            group.id,
            1,
            Overlap.PARALLEL,
        )
        ui.wait(lambda: [row.place for row in plan.listed.rows] == ["any of Hall 1"])

        fleet.robots[0].control({"reboot_seconds": 3600})
        site.clock.leap_to(datetime(2026, 11, 23, 6, 30, tzinfo=UTC) - timedelta(seconds=3))
        site.holds.confirm_clock()  # the robots live in another year
        site.runner.start()
        ui.wait(lambda: last_ended(site, 1), seconds=60)
        (run,) = last_ended(site, 1)
        assert (run.state, run.mission, run.robot, run.robot_group) == (State.COMPLETED, "Home", "Veikko", "Hall 1")
        ui.wait(lambda: plan.listed.rows[0].place == "any of Hall 1 (last: Veikko)")
        assert queued(fleet) == {"Aino": 0, "Veikko": 1}


def test_the_form_learns_from_all_its_robots_that_none_has_the_mission(site, ui):
    missing = site.catalogue.save_mission(Mission("Gone", "00000000-0000-0000-0000-000000000000"))
    (group,) = site.catalogue.groups()
    site.catalogue.save_schedule(
        Schedule("", None, missing.id, datetime(2026, 11, 24, 6, 30), "UTC", group_id=group.id)
    )
    with shown(site, ui, "scheduler") as app:
        plan = app.shell.navigator.screen("scheduler").vm
        ui.wait(lambda: plan.listed.rows)
        plan.edit(plan.listed.rows[0].key)
        ui.wait(lambda: "No robot of Hall 1 has the mission Gone" in [row.item.text for row in ui.find_all(FormNote)])
