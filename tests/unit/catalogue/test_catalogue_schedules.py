"""Every change of schedules: checked first, whole, with all that follows from it."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, time

import pytest

from app.database.schedules import ScheduleRepository
from app.domain.execution import ReasonCode, State
from app.domain.models import Between, Mission, Robot
from app.services.live.changes import Topic
from tests.support.errors import refuses
from tests.unit.catalogue.world import EXECUTIONS, SCHEDULES


def test_a_new_schedule_knows_when_it_runs_first(world):
    schedule = world.schedule()
    assert schedule.next_at.isoformat() == "2026-11-24T06:30:00+00:00"
    assert schedule.changed_at == world.clock.now()
    assert world.stored(schedule) == schedule
    assert world.announced == [Topic.SCHEDULES]


def test_a_blank_name_is_made_of_mission_and_robot(world):
    assert [world.schedule(name="").name for _ in range(3)] == [
        "Deliver on Aino",
        "Deliver on Aino 2",
        "Deliver on Aino 3",
    ]


def test_renaming_keeps_the_order_of_numbers_and_leaves_what_a_person_typed(world):
    made = [world.schedule(name="").id for _ in range(12)]
    typed = world.schedule(name="Deliver on Aino 2026")
    world.announced.clear()
    world.catalogue.save_robot(replace(world.robot, name="Alma"))
    assert set(world.announced) == {Topic.ROBOTS, Topic.SCHEDULES}
    names = [SCHEDULES.get(world.db.read(), number).name for number in made]
    assert names == ["Deliver on Alma", *(f"Deliver on Alma {number}" for number in range(2, 13))]
    assert world.stored(typed).name == "Deliver on Aino 2026"


def test_renaming_a_mission_renames_generated_names_and_not_typed_ones(world):
    made = [world.schedule(name="").id for _ in range(12)]
    typed, other = world.schedule(name="Deliver on Aino 2026"), world.schedule(name="Carry on Aino 3")
    world.catalogue.save_mission(replace(world.mission, name="Carry"))
    names = [SCHEDULES.get(world.db.read(), number).name for number in made]
    assert names == ["Carry on Aino", "Carry on Aino 2", *(f"Carry on Aino {number}" for number in range(4, 14))]
    assert (world.stored(typed).name, world.stored(other).name) == ("Deliver on Aino 2026", "Carry on Aino 3")


def test_a_generated_name_follows_the_undo_of_an_edit(world):
    sisu = world.catalogue.save_robot(Robot("Sisu", "10.0.0.2", "user"), password="secret")
    schedule = world.schedule(name="")
    changed = world.catalogue.change_schedule(schedule, replace(schedule, robot_id=sisu.id))
    assert changed.after.name == "Deliver on Sisu"
    assert world.schedule(name="").name == schedule.name  # which is taken then
    world.catalogue.save_robot(replace(sisu, name="Seppo"))
    assert world.catalogue.undo_change(changed).name == "Deliver on Aino 2"


def test_a_made_name_that_is_cut_before_the_part_that_changed_stays(world):
    long = world.catalogue.save_mission(Mission("M" * 80, "guid-2"))
    schedule = world.schedule(name="", mission_id=long.id)
    world.catalogue.save_robot(replace(world.robot, name="Alma"))
    assert world.stored(schedule).name == "M" * 80


def test_a_made_name_is_never_longer_than_a_name_may_be(world):
    long = world.catalogue.save_mission(Mission("M" * 80, "guid-2"))
    names = [world.schedule(name="", mission_id=long.id).name for _ in range(2)]
    assert [len(name) for name in names] == [80, 80]
    assert names[1].endswith(" 2")


def test_changing_how_a_schedule_runs_changes_what_waits_in_place(world):
    schedule = world.schedule(start=datetime(2026, 11, 23, 5, 0))
    waiting, running = world.row(schedule), world.row(schedule, State.EXECUTING)
    world.clock.advance(3600)
    changed = world.catalogue.save_schedule(replace(schedule, priority=5, minimum_battery_percent=30))
    row = EXECUTIONS.get(world.db.read(), waiting.id)
    assert (row.state, row.priority, row.minimum_battery_percent, row.planned_at) == (
        State.WAITING,
        5,
        30.0,
        waiting.planned_at,
    )
    assert EXECUTIONS.get(world.db.read(), running.id) == running
    assert changed.changed_at == world.clock.now()
    assert changed.next_at == schedule.next_at


def test_moving_a_schedule_cancels_what_waits_and_starts_again_from_now(world):
    schedule = world.schedule(start=datetime(2026, 11, 23, 5, 0))
    waiting, running = world.row(schedule), world.row(schedule, State.EXECUTING)
    world.clock.advance(3600)
    changed = world.catalogue.save_schedule(replace(schedule, start=datetime(2026, 11, 23, 5, 10)))
    assert world.outcome(waiting) == (State.CANCELLED, ReasonCode.SCHEDULE_CHANGED)
    assert world.outcome(running) == (State.EXECUTING, None)
    assert changed.changed_at == world.clock.now()
    assert changed.next_at.isoformat() == "2026-11-24T05:10:00+00:00"


def test_saving_what_was_not_changed_touches_nothing(world):
    schedule = world.schedule()
    waiting = world.row(schedule)
    world.db.write(lambda c: SCHEDULES.advance(c, schedule.id, None))
    world.announced.clear()
    world.clock.advance(3600)
    world.catalogue.save_schedule(schedule)
    assert world.stored(schedule) == replace(schedule, next_at=None)
    assert world.outcome(waiting) == (State.WAITING, None)
    assert world.announced == []


def test_a_deleted_schedule_is_off_at_once_and_undo_brings_it_back_from_then_on(world):
    schedule = world.schedule(start=datetime(2026, 11, 23, 5, 0), recurrence="FREQ=HOURLY")
    waiting = world.row(schedule)
    removed = world.catalogue.remove_schedule(schedule.id)
    assert world.stored(schedule) is None
    assert world.outcome(waiting) == (State.CANCELLED, ReasonCode.SCHEDULE_CHANGED)
    world.clock.advance(3 * 3600 + 60)
    world.catalogue.restore(removed)
    assert world.stored(schedule).next_at.isoformat() == "2026-11-23T10:00:00+00:00"


def test_undo_tries_each_free_name_once_however_many_schedules_need_one(world, monkeypatch):
    """Trying from the first one again for each took 25 s for 2,000 schedules, in which nothing else was written."""
    many = [world.schedule(name="") for _ in range(30)]
    removed = world.catalogue.remove_robot(world.robot.id)
    world.catalogue.save_mission(replace(world.mission, name="Fetch"))
    tried, by_name = [], ScheduleRepository.by_name

    def count(self, c, name):
        tried.append(name)
        return by_name(self, c, name)

    monkeypatch.setattr(ScheduleRepository, "by_name", count)
    world.catalogue.restore(removed)
    assert {world.stored(each).name for each in many} == {
        "Fetch on Aino",
        *(f"Fetch on Aino {n}" for n in range(2, 31)),
    }
    assert len(tried) <= 2 * len(many)


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"start": datetime(2026, 11, 24, 6, 30, 1)}, "start"),
        ({"start": datetime(1969, 1, 1)}, "start"),
        ({"start": datetime(2200, 1, 1)}, "start"),
        ({"timezone": "Mars/Base"}, "timezone"),
        ({"timezone": "../etc/passwd"}, "timezone"),
        ({"recurrence": ""}, "recurrence"),
        ({"recurrence": "FREQ=DAILY;BYMONTH=2;BYMONTHDAY=30"}, "recurrence"),
        ({"minimum_battery_percent": 101}, "minimum_battery_percent"),
        ({"minimum_battery_percent": float("nan")}, "minimum_battery_percent"),
        ({"start_window_minutes": 1441}, "start_window_minutes"),
        ({"start_window_minutes": -1}, "start_window_minutes"),
        ({"between": Between(time(8), time(9))}, "between"),
        ({"between": Between(time(9), time(8)), "recurrence": "FREQ=HOURLY"}, "between"),
        ({"overlap": "both"}, "overlap"),
        ({"priority": 1.5}, "priority"),
        ({"parameters": {"a": [1]}}, "parameters"),
        ({"parameters": {"": 1}}, "parameters"),
        ({"robot_id": 99}, "robot"),
        ({"mission_id": 99}, "mission"),
        ({"name": "x" * 81}, "name"),
        ({"id": 99}, "schedule"),
    ],
)
def test_an_invalid_schedule_is_reported_at_its_field_and_changes_nothing(world, values, field):
    with refuses(field):
        world.schedule(**values)
    assert SCHEDULES.all(world.db.read()) == []


def test_a_one_time_schedule_on_a_day_off_is_refused(world):
    sunday = datetime(2026, 11, 29, 6, 30)
    with refuses("start", "2026-11-29 is a Sunday, a day off"):
        world.schedule(start=sunday, recurrence=None)
    assert world.schedule(start=sunday, recurrence=None, respect_working_days=False).next_at is not None
