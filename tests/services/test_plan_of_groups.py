"""The plan of groups: which robot a start will probably get, and what finds none."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.domain.execution import Wait
from app.domain.models import Group, Mission, Overlap, Place, Schedule
from app.services.files.plan_export import PlanFiles
from tests.support.edits import switch_robot
from tests.support.site import Site

DAY = datetime(2026, 11, 24, tzinfo=UTC)  # the next one


@pytest.fixture
def site(tmp_path):
    site = Site(tmp_path / "one", robots=4)
    site.add_robots()
    site.container.catalogue.save_mission(replace(site.add_mission("Deliver"), usual_minutes=10))
    yield site
    site.switch_off()


@pytest.fixture
def hall(site):
    return site.container.catalogue.save_group(Group("Hall 1", (1, 2, 3)))


def save(site, start, **values):
    values = {"recurrence": "FREQ=DAILY", "respect_working_days": False, "robot_id": None, **values}
    at = datetime.fromisoformat(f"2026-11-23T{start}")
    return site.container.catalogue.save_schedule(
        Schedule(values.pop("name", ""), mission_id=1, start=at, timezone="UTC", **values)
    )


def kits(site, group, *starts, **values):
    """A schedule of the group for each of these times; returns the last one."""
    saved = [save(site, start, **{"overlap": Overlap.PARALLEL, "group_id": group.id, **values}) for start in starts]
    site.kick()
    return saved[-1]


def planned(site, start=DAY, hours=24.0):
    return site.container.plan.between(start, start + timedelta(hours=hours)).runs


def lanes(runs):
    return [(f"{run.at:%H:%M}", run.robot.name, run.lane) for run in runs]


def test_starts_at_one_time_lie_on_different_robots_and_say_that_this_is_a_guess(site, hall):
    kits(site, hall, "07:30", "07:30", "07:30")
    runs = planned(site)
    assert lanes(runs) == [("07:30", "R1", 1), ("07:30", "R2", 2), ("07:30", "R3", 3)]
    assert all(
        run.is_approximate and run.group == hall and run.whose == "Hall 1" and run.begins == run.at for run in runs
    )


def test_one_that_waits_begins_when_a_robot_is_free_and_one_that_finds_none_in_time_has_a_lane_of_its_own(site, hall):
    kits(site, hall, *["07:30"] * 4)
    kits(site, hall, "07:30", start_window_minutes=5, name="Short")
    runs = {run.schedule.name: run for run in planned(site)}
    assert (runs["Short"].lane, runs["Short"].is_approximate, runs["Short"].robot.name) == (
        ("group", hall.id),
        False,
        "Hall 1",
    )
    waits = runs["Deliver on Hall 1 4"]
    assert (waits.begins - waits.at, waits.ends - waits.begins) == (timedelta(minutes=10), timedelta(minutes=10))


def test_fixed_starts_keep_their_robot_and_groups_go_around_them(site, hall):
    fixed = save(site, "07:25", robot_id=1)
    kits(site, hall, "07:30")
    runs = planned(site)
    assert [(run.schedule.id == fixed.id, run.robot.name, run.group is None, run.is_approximate) for run in runs] == [
        (True, "R1", True, False),
        (False, "R2", False, True),
    ]


def test_a_start_waits_for_a_place_that_a_fixed_one_on_another_robot_has(site, hall):
    site.container.catalogue.save_place(Place("Dock 2", 1, (1,)))
    save(site, "07:28", robot_id=4)
    kits(site, hall, "07:30")
    assert [(run.robot.name, f"{run.begins:%H:%M}") for run in planned(site)] == [("R4", "07:28"), ("R1", "07:38")]


def test_robots_that_are_off_held_or_lack_the_mission_are_not_expected_to_come(site, hall):
    switch_robot(site.container.catalogue, 1, False)
    site.container.holds.hold("Repair", until=DAY + timedelta(hours=12), robot_id=2)
    kits(site, hall, "07:30", "13:30")
    assert [run.robot.name for run in planned(site)] == ["R3", "R2"]
    for robot_id in (1, 2, 3):
        switch_robot(site.container.catalogue, robot_id, False)
    assert planned(site) == ()


def test_a_robot_that_is_silent_now_is_not_expected_to_come_within_minutes(site, hall):
    kits(site, hall, "06:12", "06:30")
    assert [run.robot.name for run in planned(site, site.clock.now(), 1.0)] == ["R1", "R2"]
    site.network.down.add("R1")
    site.run(240)
    assert [run.robot.name for run in planned(site, site.clock.now(), 1.0)] == ["R2", "R1"]
    site.network.down.clear()
    site.run(60)
    assert [run.robot.name for run in planned(site, site.clock.now(), 1.0)] == ["R1", "R2"]


def test_a_mission_of_another_robot_means_what_that_robot_has_of_its_name(site, hall):
    site.container.catalogue.save_mission(
        Mission("Deliver", "e0cb8c3c-1bbb-11f0-9ba0-000e8e9884ec", robot_id=1, usual_minutes=3)
    )
    kits(site, hall, "07:30")
    [run] = planned(site)
    assert (run.robot.name, run.usual_s) == ("R1", 180.0)  # sooner done than the others


@pytest.mark.parametrize("hours", [1.0, 6.0, 24.0, 168.0])
def test_however_much_is_looked_at_a_start_has_the_same_robot(site, hall, hours):
    kits(site, hall, "05:00", "07:05", "07:30", "07:30", "07:31", recurrence="FREQ=HOURLY;INTERVAL=3")
    at = DAY + timedelta(days=2, hours=7)
    seen = {(run.schedule.id, run.at): (run.lane, run.begins) for run in planned(site, at, hours)}
    wanted = {
        (run.schedule.id, run.at): (run.lane, run.begins)
        for run in planned(site, DAY, 168.0)
        if at <= run.at < at + timedelta(hours=1)
    }
    assert wanted
    assert {key: seen[key] for key in wanted} == wanted


def test_a_run_that_began_before_what_is_looked_at_is_still_there(site, hall):
    kits(site, hall, "06:55")
    assert lanes(planned(site, DAY + timedelta(hours=7), 1.0)) == [("06:55", "R1", 1)]
    assert lanes(planned(site, DAY + timedelta(hours=7, minutes=6), 1.0)) == []


def test_the_next_starts_have_their_robots_too(site, hall):
    kits(site, hall, "07:30", "07:30")
    assert [run.robot.name for run in site.container.plan.next(3)] == ["R1", "R2", "R1"]


def test_what_robots_do_at_present_counts_and_the_forecast_comes_true(site, hall):
    kits(site, hall, "06:05", "06:05")
    kits(site, hall, "06:06", recurrence=None)
    expected = sorted((run.at, run.robot.name) for run in planned(site, site.clock.now(), 1.0))
    assert [name for _, name in expected] == ["R1", "R2", "R3"]
    site.run(310)
    assert [run.robot.name for run in planned(site, site.clock.now(), 1.0)] == ["R3"]  # R1 and R2 are under way
    site.run(120)
    assert sorted((row.planned_at, row.robot) for row in site.executions()) == expected


def test_what_waits_already_has_its_robot_before_what_is_still_to_come(site, hall):
    site.container.catalogue.save_group(replace(hall, members=(1,)))
    kits(site, hall, "06:05", "06:05")
    kits(site, hall, "06:06", start_window_minutes=60)
    site.run(305)  # the second one waits for R1
    assert [row.robot for row in site.executions()] == ["R1", ""]
    [run] = planned(site, site.clock.now(), 1.0)
    assert timedelta(minutes=13) < run.begins - run.at < timedelta(minutes=20)


def test_a_calendar_file_names_the_group(site, hall, tmp_path):
    kits(site, hall, "07:30")
    found = PlanFiles(site.container.db, site.container.catalogue, site.clock, site.container.plan, tmp_path).export(1)
    text = found.path.read_text(encoding="utf-8")
    assert "SUMMARY:Deliver · Hall 1" in text
    assert "Deliver on Hall 1" not in text  # the name that was made says nothing more


def test_where_too_many_starts_are_planned_those_after_the_last_that_was_computed_have_no_robot(site, hall):
    schedule = kits(site, hall, "07:30", recurrence="FREQ=MINUTELY")
    found = site.container.plan.between(DAY, DAY + timedelta(days=1), most=100)
    assert (len(found.runs), list(found.more)) == (100, [schedule.id])


def test_what_waits_for_something_else_than_its_robot_keeps_it_from_no_start_to_come(site):
    group = site.container.catalogue.save_group(Group("Alone", (1,)))
    save(site, "06:05", robot_id=1, recurrence=None, minimum_battery_percent=100, start_window_minutes=600)
    site.run(310)
    assert [row.wait for row in site.executions()] == [Wait.BATTERY]
    kits(site, group, "06:08", recurrence=None, start_window_minutes=5)
    [run] = planned(site, site.clock.now(), 1)
    assert (run.robot.name, run.begins) == ("R1", run.at)
