"""Conflicts of a schedule that is not saved yet: robots of a group, places, what matters more, what has to be done in time."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.domain import conflicts
from app.domain.models import ANY_VEHICLE, Fleet, FleetKind, Group, Mission, Overlap, Place, Robot, Schedule
from app.services.catalogue.preview import ConcernCode, Forecasts
from app.services.planning.durations import LiveRobots
from app.services.planning.plan import Plan
from tests.support.clock import VirtualClock
from tests.support.edits import skip_next, switch_robot
from tests.support.history import add_run

ZONE = "Europe/Helsinki"
NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)  # Friday, 14:38 in Helsinki
MONDAY = datetime(2026, 11, 23)


@pytest.fixture
def clock():
    return VirtualClock(NOW)


@pytest.fixture
def container(container):
    container.catalogue.change_settings(timezone=ZONE)
    for number, name in enumerate(("Aino", "Sisu", "Veikko", "Onni"), 1):
        container.catalogue.save_robot(Robot(name, f"10.0.0.{number}", "scheduler"), "secret")
    for name, minutes in (("Kits", 11), ("Empties", 12), ("Shift bus", 5)):
        container.catalogue.save_mission(Mission(name, f"guid-{name.lower()}".replace(" ", "-"), usual_minutes=minutes))
    container.catalogue.save_group(Group("Hall 1", (1, 2, 3)))
    return container


def draft(at="07:30", **values):
    values = {"robot_id": None, "mission_id": 1, "recurrence": "FREQ=DAILY", **values}
    if values["robot_id"] is None:
        values = {"group_id": 1, "overlap": Overlap.PARALLEL, **values}
    return Schedule(
        **{
            "name": "",
            "start": datetime.combine(MONDAY, datetime.strptime(at, "%H:%M").time()),
            "timezone": ZONE,
            **values,
        }
    )


def plan(container, at="07:30", **values):
    return container.catalogue.save_schedule(draft(at, **values))


def found(container, schedule):
    forecast = Forecasts(container.db, container.clock).of(schedule)
    return [
        (concern.code, conflicts.sentence(concern.code, concern.at, concern.details, ZONE))
        for concern in forecast.concerns
    ], forecast


def ran(container, seconds, mission="Kits", robot_id=1):
    """Completed runs that took so long."""
    for lasted in seconds:
        at = NOW - timedelta(days=1)
        add_run(container, at, robot_id=robot_id, mission_guid=f"guid-{mission.lower()}", duration_s=lasted)


# ---------------------------------------------------------------------- robots of a group
def test_a_fourth_start_of_three_robots_is_one_too_many_and_a_free_time_is_offered(container):
    for _ in range(3):
        plan(container)
    said, forecast = found(container, draft())
    assert (
        said == [(ConcernCode.TOO_FEW_ROBOTS, "At 07:30, 4 starts need the 3 robots of Hall 1, until about 07:41")] * 5
    )
    assert forecast.free_at == datetime(2026, 11, 23, 7, 45)
    assert found(container, draft("07:45"))[0] == []


def test_three_starts_of_three_robots_are_none_too_many_whatever_other_groups_and_other_robots_do(container):
    other = container.catalogue.save_group(Group("Yard", (4,)))
    for _ in range(2):
        plan(container)
    plan(container, group_id=other.id)
    plan(container, robot_id=4)
    assert found(container, draft())[0] == []


def test_a_fixed_start_on_one_of_the_robots_takes_it_and_two_on_one_robot_take_it_once(container):
    for _ in range(2):
        plan(container)
    plan(container, robot_id=2)
    plan(container, "07:31", robot_id=2, mission_id=2)
    said, _forecast = found(container, draft())
    assert said[0] == (ConcernCode.TOO_FEW_ROBOTS, "At 07:30, 4 starts need the 3 robots of Hall 1, until about 07:41")


def test_a_fixed_start_shows_that_the_group_needs_its_robot(container):
    for _ in range(3):
        plan(container, "07:35")
    said, forecast = found(container, draft(robot_id=1))
    assert said[0] == (ConcernCode.TOO_FEW_ROBOTS, "At 07:35, 4 starts need the 3 robots of Hall 1, until about 07:41")
    assert forecast.free_at == datetime(2026, 11, 23, 7, 20)
    assert found(container, draft(robot_id=4))[0] == []


def test_robots_that_are_off_are_not_counted(container):
    plan(container)
    switch_robot(container.catalogue, 2, False)
    switch_robot(container.catalogue, 3, False)
    assert found(container, draft())[0][0][1] == "At 07:30, 2 starts need the only robot of Hall 1, until about 07:41"
    switch_robot(container.catalogue, 1, False)
    assert found(container, draft())[0][0][1] == "No robot of Hall 1 is switched on: nothing will be sent"


def test_skipped_starts_and_the_schedule_itself_cause_no_conflict(container):
    for _ in range(2):
        plan(container, recurrence=None)
    skipped, own = plan(container, recurrence=None), plan(container, recurrence=None)
    assert found(container, own)[0] != []
    skip_next(container, skipped.id)
    assert found(container, own)[0] == []


# ---------------------------------------------------------------------- places
@pytest.mark.parametrize("where", [{"robot_id": 1}, {"robot_id": None}])
def test_the_form_reads_the_schedules_of_a_robot_once_however_many_groups_it_is_in(container, where):
    for number in range(9):
        container.catalogue.save_group(Group(f"G{number}", (1, 2, 3, 4)))
    container.catalogue.save_place(Place("Dock 2", 1, (1, 2)))
    reading, asked = container.db.read(), list[str]()
    reading.set_trace_callback(asked.append)
    Forecasts(container.db, container.clock).of(draft(**where))
    reading.set_trace_callback(None)
    of_schedules = [statement for statement in asked if "FROM current_schedules AS schedules WHERE" in statement]
    assert len(of_schedules) == len(set(of_schedules)) > 0


def test_a_place_is_full_whichever_robots_come(container):
    container.catalogue.save_place(Place("Dock 2", 2, (1, 2)))
    plan(container, robot_id=4)
    plan(container, robot_id=3, mission_id=2)
    said, forecast = found(container, draft())
    assert said[0] == (
        ConcernCode.PLACE_FULL,
        "At 07:30, 3 missions need Dock 2, which takes 2 at a time, until about 07:41",
    )
    assert forecast.free_at == datetime(2026, 11, 23, 7, 45)
    assert found(container, draft(mission_id=3))[0] == []  # does not use it


def test_a_place_in_use_most_of_an_hour_is_reported_once(container):
    container.catalogue.save_place(Place("Dock 2", 2, (1,)))
    for minute in range(7):
        plan(container, f"07:{minute * 8:02}", robot_id=4, recurrence="FREQ=DAILY")
    said = found(container, draft("07:58"))[0]
    assert [text for code, text in said if code is ConcernCode.PLACE_CROWDED] == [
        "From 07:00 to 08:00 Dock 2 is in use 73 % of the time: starts will often wait for it"
    ]
    assert [code for code, _ in found(container, draft("08:58"))[0]] == []


def test_a_place_being_entered_shows_its_worst_hour(container):
    for minute in range(8):
        plan(container, f"07:{minute * 7:02}", robot_id=4)
        plan(container, f"09:{minute * 7:02}", robot_id=4, mission_id=2)
    dock = Place("Dock 2", 2, (1, 2, 99))
    shown = container.plan.place_warning(dock)
    assert conflicts.sentence(shown.code, shown.at, shown.details, ZONE).startswith(
        "From 09:00 to 10:00 Dock 2 is in use 80 %"
    )
    assert container.plan.place_warning(replace(dock, most=3)) is None
    assert container.plan.place_warning(replace(dock, missions=())) is None


# ---------------------------------------------------------------------- what matters more
def test_a_run_that_nearly_always_makes_a_more_important_one_late_is_reported_instead_of_the_overlap(container):
    ran(container, [600.0] * 19 + [100.0])
    plan(container, "07:35", robot_id=1, mission_id=3, priority=2)
    said = found(container, draft(robot_id=1, recurrence=None))[0]
    assert said == [
        (
            ConcernCode.CRITICAL_BEHIND,
            "Kits at 07:30 usually still runs on Aino when the more important Shift bus starts at 07:35",
        )
    ]
    assert [code for code, _ in found(container, draft(robot_id=1, recurrence=None, priority=2))[0]] == [
        ConcernCode.OVERLAP
    ]


def test_the_more_important_one_shows_the_run_before_it(container):
    ran(container, [600.0] * 20)
    plan(container, robot_id=1)
    said = found(container, draft("07:35", robot_id=1, mission_id=3, priority=1, recurrence=None))[0]
    assert [code for code, _ in said] == [ConcernCode.CRITICAL_BEHIND]


@pytest.mark.parametrize("seconds", [[600.0] * 17 + [100.0] * 3, []])
def test_one_that_often_is_over_by_then_or_was_never_measured_only_overlaps(container, seconds):
    ran(container, seconds)
    plan(container, "07:35", robot_id=1, mission_id=3, priority=2)
    assert [code for code, _ in found(container, draft(robot_id=1, recurrence=None))[0]] == [ConcernCode.OVERLAP]


def test_only_with_one_robot_in_the_group_a_start_is_behind(container):
    ran(container, [600.0] * 20)
    plan(container, "07:35", robot_id=1, mission_id=3, priority=2)
    assert found(container, draft(recurrence=None))[0] == []
    container.catalogue.save_group(replace(container.catalogue.groups()[0], members=(1,)))
    assert ConcernCode.CRITICAL_BEHIND in [code for code, _ in found(container, draft(recurrence=None))[0]]


def test_starts_on_any_robot_of_a_fleet_are_not_in_each_others_way(container):
    hall = container.catalogue.save_fleet(
        Fleet("Fleet", "http://10.0.0.9", FleetKind.CLASSIC, "distributor"), password="secret"
    )
    either = container.catalogue.save_robot(Robot("Any", "", fleet=hall, vehicle=ANY_VEHICLE)).id
    ran(container, [600.0] * 20, robot_id=either)
    plan(container, "07:35", robot_id=either, mission_id=3, priority=2)
    said, forecast = found(container, draft(robot_id=either))
    assert ([code for code, _ in said], forecast.free_at) == ([ConcernCode.NOT_CHECKED_UP], None)
    plan(container, robot_id=either)
    assert on_plan(container) == []


# ---------------------------------------------------------------------- done in time
@pytest.mark.parametrize(("minutes", "is_shown"), [(10, True), (11, False), (None, False)])
def test_a_mission_that_usually_takes_longer_than_allowed_is_reported(container, minutes, is_shown):
    said = found(container, draft(finish_by_minutes=minutes))[0]
    assert said == (
        [(ConcernCode.FINISH_BY_SHORT, f"Kits usually takes 11 min, but only {minutes} min are allowed")]
        if is_shown
        else []
    )


# ---------------------------------------------------------------------- on the plan
def on_plan(container, begins=datetime(2026, 11, 24, tzinfo=UTC), hours=24.0):
    planned = container.plan.between(begins, begins + timedelta(hours=hours))
    return [
        (conflict.code, conflict.at, conflicts.sentence(conflict.code, conflict.at, conflict.details, ZONE))
        for conflict in planned.conflicts
    ]


def test_the_plan_has_the_same_conflicts_as_the_form(container):
    container.catalogue.save_place(Place("Dock 2", 2, (2,)))
    ran(container, [600.0] * 20, robot_id=4)
    for _ in range(3):
        plan(container)
    plan(container, "07:32")
    for _ in range(3):
        plan(container, "09:00", mission_id=2, robot_id=1)
    plan(container, "11:00", robot_id=4)
    plan(container, "11:05", robot_id=4, mission_id=3, priority=2)
    plan(container, "12:00", finish_by_minutes=5)
    assert [text for _code, _at, text in on_plan(container)] == [
        "At 07:32, 4 starts need the 3 robots of Hall 1, until about 07:41",
        "At 09:00, 3 missions need Dock 2, which takes 2 at a time, until about 09:12",
        "Kits at 11:00 usually still runs on Onni when the more important Shift bus starts at 11:05",
        "Kits usually takes 11 min, but only 5 min are allowed",
    ]


def test_a_plan_without_groups_places_or_priorities_has_none(container):
    for _ in range(4):
        plan(container, robot_id=1)
    assert on_plan(container) == []


@pytest.mark.parametrize(("begins", "hours"), [(0, 168), (0, 24), (5, 1), (5.45, 6), (4, 1.51), (5.51, 1)])
def test_what_is_said_is_true_however_much_is_looked_at(container, begins, hours):
    container.catalogue.save_place(Place("Dock 2", 2, (1,)))
    for at in ("07:20", "07:28", "07:30", "07:30", "07:31", "07:33"):
        plan(container, at)
    start = datetime(2026, 11, 24, tzinfo=UTC) + timedelta(hours=begins)
    end = start + timedelta(hours=hours)
    whole, seen = on_plan(container, datetime(2026, 11, 23, tzinfo=UTC), 240.0), on_plan(container, start, hours)
    true = {(code, at): text for code, at, text in whole}
    assert {key for key in true if start <= key[1] < end} == {(code, at) for code, at, _text in seen if at >= start}
    for code, at, text in seen:  # no end is given if it is not soon after the hour
        assert text == true[code, at] or (
            true[code, at].startswith(f"{text}, until about") and at + timedelta(minutes=1) > end
        )


def test_a_crowd_that_is_not_over_when_the_plan_ends_has_no_end():
    details = {"group": "Hall 1", "robots": 3, "starts": 4, "until": None}
    assert conflicts.sentence("too_few_robots", NOW, details, ZONE) == "At 14:38, 4 starts need the 3 robots of Hall 1"


# ---------------------------------------------------------------------- what none of a group's robots has
def live(missing):
    """As if each robot's list of missions had been read; ``missing``: the robots without "Kits", by id."""
    return LiveRobots(has_mission=lambda robot_id, guid: guid != "guid-kits" or robot_id not in missing)


def plan_of(container, missing):
    return Plan(container.db, container.clock, live(missing))


@pytest.mark.parametrize(
    ("missing", "off", "is_shown"),
    [((1, 2, 3), None, True), ((1, 2), 3, True), ((1, 2), None, False), ((4,), None, False)],
)
def test_a_mission_that_no_robot_of_the_group_has_is_shown_in_form_and_plan(container, missing, off, is_shown):
    if off is not None:
        switch_robot(container.catalogue, off, False)
    concerns = Forecasts(container.db, container.clock, live(missing)).of(draft()).concerns
    shown = [concern.details for concern in concerns if concern.code is ConcernCode.MISSION_MISSING]
    assert shown == ([{"mission": "Kits", "group": "Hall 1"}] if is_shown else [])
    plan(container)
    [run] = plan_of(container, missing).next(1)
    assert (run.lacks_mission, run.begins_at is None) == (is_shown, is_shown)


def test_the_robot_that_is_foreseen_has_the_mission(container):
    plan(container)
    foreseen = {missing: plan_of(container, missing).next(1)[0].robot.name for missing in ((), (1,), (1, 2), (2, 3))}
    assert foreseen == {(): "Aino", (1,): "Sisu", (1, 2): "Veikko", (2, 3): "Aino"}
