"""A single start moved to another time or robot: it runs there and only there, as its schedule is defined then, and can
be moved back."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import icalendar
import pytest

from app.domain.execution import State
from app.domain.models import DayException, InvalidInput
from app.services.catalogue.configuration import export_configuration
from app.services.catalogue.database_check import find_problem
from app.services.files.history_export import write_history
from app.services.files.plan_export import write_plan
from app.services.planning import sentences
from tests.support.plant import NOW, Plant


def at(day: int, hour: int = 6, minute: int = 30) -> datetime:
    return datetime(2026, 11, day, hour, minute, tzinfo=UTC)


def local(day: int, hour: int = 6, minute: int = 30) -> datetime:
    return datetime(2026, 11, day, hour, minute)


WEDNESDAY_OVER = at(26, 0, 0)


class MovingPlant(Plant):
    def move(self, instant=None, to=None, schedule=None, **values):
        return self.moving.move((schedule or self.daily).id, instant or at(24), to or local(24, 9, 0), **values)

    def planned(self, until: int = 26):
        """Robot and time of what is planned from Tuesday on, before that day."""
        runs = self.container.plan.between(at(24, 0, 0), at(until, 0, 0)).runs
        return [(run.whose, f"{run.at:%d %H:%M}", run.mission.name) for run in runs]

    def went(self):
        return [(row.robot, f"{row.planned_at:%d %H:%M}", row.state.value) for row in self.rows()]

    def live_through(self, until: datetime = WEDNESDAY_OVER) -> None:
        while self.clock.now() < until:
            self.go_to(self.clock.now() + timedelta(minutes=15))


@pytest.fixture
def plant(tmp_path):
    plant = MovingPlant(tmp_path)
    yield plant
    plant.container.close()


@pytest.fixture
def moved(plant):
    """The start of Tuesday, to 09:00."""
    return plant.move()


AS_BEFORE = [("Aino", "24 06:30", "Deliver"), ("Aino", "25 06:30", "Deliver")]
MOVED = [("Aino", "24 09:00", "Deliver"), ("Aino", "25 06:30", "Deliver")]


def runs_as_shown(plant) -> None:
    """The planner writes each start once, where the plan shows it."""
    shown = [("Aino", "23 06:30"), *((robot, when) for robot, when, _mission in plant.planned())]
    plant.edit(overlap="queue")
    plant.live_through()
    assert [(row.robot or row.robot_group, f"{row.planned_at:%d %H:%M}") for row in plant.rows()] == shown


# ---------------------------------------------------------------------- where it goes
@pytest.mark.parametrize(
    ("to", "where", "shown"),
    [
        (local(24, 9, 0), None, ("Aino", "24 09:00")),
        (local(23, 9, 0), None, None),
        (local(24), "sisu", ("Sisu", "24 06:30")),
        (local(24, 9, 0), "sisu", ("Sisu", "24 09:00")),
        (local(24, 9, 0), "hall", ("Hall", "24 09:00")),
        (local(25), None, ("Aino", "25 06:30")),  # where its schedule has another one
    ],
)
def test_it_runs_there_once_and_not_where_it_was(plant, to, where, shown):
    target = {"group_id" if where == "hall" else "robot_id": getattr(plant, where)} if where else {}
    plant.move(to=to, **target)
    tuesday = [] if shown is None else [shown]
    assert [each[:2] for each in plant.planned()] == [*tuesday, ("Aino", "25 06:30")]
    plant.live_through()
    rows = [(row.robot or row.robot_group, f"{row.planned_at:%d %H:%M}") for row in plant.rows()]
    assert sorted(rows) == sorted([("Aino", "23 06:30"), shown or ("Aino", "23 09:00"), ("Aino", "25 06:30")])


def test_it_runs_as_its_schedule_is_defined_and_has_its_name(plant):
    plant.edit(parameters={"Speed": "slow"}, priority=2, minimum_battery_percent=40)
    plant.move(robot_id=plant.sisu)
    plant.live_through(at(24, 10, 0))
    row = plant.rows()[-1]
    assert (row.schedule, row.mission, row.parameters, row.priority, row.minimum_battery_percent) == (
        "Daily",
        "Deliver",
        {"Speed": "slow"},
        2,
        40,
    )
    assert (row.moved_from, row.planned_at) == (at(24), at(24, 9, 0))


def test_a_one_time_schedule_is_changed(plant):
    once = plant.catalogue.save_schedule(plant.schedule(name="Once", recurrence=None, start=local(24, 8)))
    moved = plant.move(at(24, 8), local(24, 11, 0), once, robot_id=plant.sisu)
    stored = plant.catalogue.schedule(once.id)
    assert (stored.start, stored.robot_id, stored.moved_of) == (local(24, 11, 0), plant.sisu, None)
    plant.moving.undo(moved)
    stored = plant.catalogue.schedule(once.id)
    assert (stored.start, stored.robot_id) == (local(24, 8), plant.aino)


def test_the_list_of_schedules_and_their_names_stay_as_they_were(plant):
    plant.move()
    assert [each.name for each in plant.catalogue.schedules()] == ["Daily"]
    assert plant.catalogue.save_schedule(plant.schedule(name="", start=local(25, 12))).name == "Deliver on Aino"
    assert plant.edit(name="Renamed").name == "Renamed"
    assert {run.schedule.name for run in plant.container.plan.next(2)} == {"Renamed"}
    assert plant.container.plan.skips() == set()  # it is not shown as skipped


# ---------------------------------------------------------------------- it can't be moved there
@pytest.mark.parametrize(
    ("instant", "to", "why"),
    [
        (at(24), local(23, 5, 0), "choose a time in the future"),
        (at(24), local(23, 6, 0), "choose a time in the future"),
        (at(24, 7, 0), local(24, 9, 0), "this schedule no longer has this start"),
        (at(23, 5, 0), local(24, 9, 0), "the time of this start has passed"),
        (at(24), local(28, 9, 0), "Saturday, a day off"),
        (at(24), local(26, 9, 0), "a day off: Inventory"),
    ],
)
def test_what_can_t_be_is_refused_and_nothing_is_written(plant, instant, to, why):
    plant.catalogue.save_days(DayException("Inventory", local(26).date(), local(26).date()))
    plant.go_to(NOW)
    with pytest.raises(InvalidInput, match=why):
        plant.move(instant, to)
    assert plant.planned() == AS_BEFORE


def test_a_person_may_want_a_day_that_is_none_of_work(plant):
    plant.move(to=local(28, 9, 0), any_day=True)
    plant.catalogue.save_days(DayException("Closed", local(28).date(), local(28).date()))
    plant.edit(priority=1)  # which checks the schedule again
    assert plant.planned(until=29)[-1] == ("Aino", "28 09:00", "Deliver")


def test_undo_of_a_move_to_a_closed_day_keeps_off_closed_days_again(plant):
    once = plant.catalogue.save_schedule(plant.schedule(name="Once", recurrence=None, start=local(24, 8)))
    moved = plant.move(at(24, 8), local(28, 9, 0), once, any_day=True)
    assert not moved.after.respect_working_days
    again = plant.container.moving.undo(moved).after
    assert (again.start, again.respect_working_days) == (once.start, True)


def test_it_is_not_moved_into_a_pause(plant):
    plant.pausing.pause(plant.daily.id, at(25, 0, 0))
    with pytest.raises(InvalidInput, match="paused beyond that start"):
        plant.move()
    plant.move(to=local(25, 9, 0))  # out of it
    assert plant.planned() == [("Aino", "25 06:30", "Deliver"), ("Aino", "25 09:00", "Deliver")]


def test_two_people_move_the_same_start_and_the_second_gets_the_reason(plant):
    plant.move()
    with pytest.raises(InvalidInput, match="skipped or was moved already"):
        plant.move(to=local(24, 12, 0))
    with pytest.raises(InvalidInput, match="move it back"):
        plant.pausing.unskip(plant.daily.id, at(24))
    assert plant.planned() == MOVED


def test_nothing_is_moved_if_the_second_half_fails(plant, monkeypatch):
    """Both are written in one transaction."""
    monkeypatch.setattr(plant.container.repositories.schedules.__class__, "add", lambda *_args: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        plant.move()
    assert plant.planned() == AS_BEFORE


# ---------------------------------------------------------------------- again, and back
def test_moved_twice_it_runs_once(plant):
    first = plant.move()
    second = plant.move(first.at, local(24, 12, 0), first.after, robot_id=plant.sisu)
    assert plant.planned() == [("Sisu", "24 12:00", "Deliver"), AS_BEFORE[1]]
    assert second.after.moved_from == at(24)
    with pytest.raises(InvalidInput, match="no longer has this start"):
        plant.moving.undo(first)  # somebody else has moved it since
    plant.moving.undo(second)
    assert plant.planned() == MOVED
    plant.moving.undo(first)
    assert plant.planned() == AS_BEFORE
    runs_as_shown(plant)


@pytest.mark.parametrize("by_hand", [True, False])
def test_moved_back_it_is_a_start_of_its_schedule_again(moved, plant, by_hand):
    if by_hand:
        back = plant.move(moved.at, local(24), moved.after)
        assert (back.after.id, back.at) == (plant.daily.id, at(24))
        plant.moving.undo(back)
        assert plant.planned() == MOVED
        plant.move(back.was_at, local(24), plant.container.plan.next(2)[1].schedule)
    else:
        plant.moving.undo(moved)
    assert plant.planned() == AS_BEFORE
    with pytest.raises(InvalidInput, match="no longer"):
        plant.moving.undo(moved)
    runs_as_shown(plant)


@pytest.mark.parametrize("rule", ["FREQ=DAILY", None])
def test_undo_leaves_the_robot_that_was_chosen_since(plant, rule):
    plant.edit(recurrence=rule, start=local(24))
    moved = plant.move()
    plant.move(moved.at, local(24, 9, 0), moved.after, robot_id=plant.sisu)
    plant.moving.undo(moved)
    assert plant.planned(25) == [("Sisu", "24 06:30", "Deliver")]


@pytest.mark.parametrize("rule", ["FREQ=DAILY", None])
def test_undo_is_refused_if_another_robot_was_chosen_since(plant, rule):
    plant.edit(recurrence=rule, start=local(24))
    moved = plant.move(to=local(24), robot_id=plant.sisu)
    plant.move(at(24), local(24), moved.after, group_id=plant.hall)
    with pytest.raises(InvalidInput, match="has been changed since"):
        plant.moving.undo(moved)
    assert plant.planned(25) == [("Hall", "24 06:30", "Deliver")]


def test_it_stays_where_it_is_if_its_time_has_passed(plant):
    moved = plant.move(at(23), local(23, 9, 0))
    plant.go_to(at(23, 6, 31))
    with pytest.raises(InvalidInput, match="the time of this start has passed"):
        plant.moving.undo(moved)
    plant.go_to(at(23, 9, 0))
    assert plant.went() == [("Aino", "23 09:00", "waiting")]


def test_undo_after_it_was_due_doesn_t_start_it_again(plant):
    moved = plant.move(at(26), local(23, 6, 10))
    plant.go_to(at(23, 6, 10))
    with pytest.raises(InvalidInput, match="the time of this start has passed"):
        plant.moving.undo(moved)
    plant.live_through(at(27, 0, 0))
    assert [when for _robot, when, _state in plant.went()] == ["23 06:10", "23 06:30", "24 06:30", "25 06:30"]


def test_a_held_start_stays_held_and_comes_back_held(plant):
    def held():
        return [run.held for run in plant.container.plan.between(at(24, 0, 0), at(25, 0, 0)).runs]

    plant.catalogue.edit(lambda edit: edit.schedules.hold(edit.c, plant.daily.id, at(24)))
    first = plant.move()
    second = plant.move(first.at, local(24, 12, 0), first.after)
    assert held() == [True]
    plant.moving.undo(second)
    plant.moving.undo(first)
    assert (held(), plant.planned()) == ([True], AS_BEFORE)


def test_it_can_be_skipped_like_any_other(moved, plant):
    plant.pausing.skip(moved.after.id, moved.at)
    assert plant.planned() == AS_BEFORE[1:]
    plant.pausing.unskip(moved.after.id, moved.at, must_run=True)
    assert plant.planned() == MOVED


# ---------------------------------------------------------------------- its schedule is changed afterwards
@pytest.mark.parametrize(
    ("changes", "tuesday"),
    [
        ({"name": "Other name"}, [("Aino", "24 09:00", "Deliver")]),
        ({"mission": "other"}, [("Aino", "24 09:00", "Other")]),
        ({"robot": "sisu"}, [("Sisu", "24 09:00", "Deliver")]),
        ({"start": local(23, 9, 0)}, [("Aino", "24 09:00", "Deliver")]),  # to where it was moved
        ({"start": local(23, 7, 0)}, [("Aino", "24 07:00", "Deliver")]),
        ({"recurrence": "FREQ=WEEKLY;BYDAY=MO,TU,WE"}, [("Aino", "24 09:00", "Deliver")]),
        ({"recurrence": "FREQ=WEEKLY;BYDAY=MO,WE"}, []),
        ({"enabled": False}, []),
    ],
)
def test_a_change_of_its_schedule_holds_for_it_and_undone_it_is_there_again(plant, changes, tuesday):
    plant.move()
    before = plant.catalogue.schedules()[0]
    mission = getattr(plant, changes.pop("mission", "deliver"))
    plant.edit(mission_id=mission, robot_id=getattr(plant, changes.pop("robot", "aino")), **changes)
    assert [each for each in plant.planned() if each[1].startswith("24")] == tuesday
    plant.catalogue.save_schedule(replace(before, next_at=None))
    assert plant.planned() == MOVED
    runs_as_shown(plant)


def test_on_a_robot_of_its_own_it_stays_there(plant):
    plant.move(robot_id=plant.sisu)
    plant.edit(robot_id=None, group_id=plant.hall)
    assert [each[0] for each in plant.planned()] == ["Sisu", "Hall"]


def test_switched_off_and_on(plant):
    plant.move()
    switched = plant.catalogue.switch_schedule(plant.daily.id, False)
    assert plant.planned() == []
    plant.catalogue.undo_change(switched)
    assert plant.planned() == MOVED


@pytest.mark.parametrize(
    ("what", "stays"),
    [("schedule", []), ("mission", []), ("robot", []), ("own robot", AS_BEFORE[1:])],
)
def test_deleted_with_its_schedule_or_robot_and_put_back_with_it(plant, what, stays):
    plant.move(robot_id=plant.sisu)
    ids = {"schedule": plant.daily.id, "mission": plant.deliver, "robot": plant.aino, "own robot": plant.sisu}
    removed = getattr(plant.catalogue, f"remove_{what.split()[-1]}")(ids[what])
    assert plant.planned() == stays
    plant.catalogue.restore(removed)
    assert plant.planned() == [("Sisu", "24 09:00", "Deliver"), AS_BEFORE[1]]


def test_its_schedule_is_put_back_after_its_robot_was_deleted(plant):
    plant.move(robot_id=plant.sisu)
    removed = plant.catalogue.remove_schedule(plant.daily.id)
    plant.catalogue.remove_robot(plant.sisu)
    plant.catalogue.restore(removed)
    assert plant.planned() == AS_BEFORE[1:]
    assert find_problem(plant.container.db.read()) is None


def test_what_waits_of_it_is_ended_with_its_schedule(plant):
    plant.go_to(plant.move(to=local(23, 6, 10)).at)
    removed = plant.catalogue.remove_schedule(plant.daily.id)
    assert [(row.state, row.reason and row.reason.code) for row in plant.rows()] == [
        (State.CANCELLED, "schedule_changed")
    ]
    plant.catalogue.restore(removed)
    assert [row.state for row in plant.rows()] == [State.WAITING]


def test_a_pause_of_its_schedule_holds_for_it(plant):
    plant.move()
    plant.pausing.pause(plant.daily.id, at(25, 0, 0))
    plant.live_through()
    assert plant.went()[1] == ("Aino", "24 09:00", "skipped")
    plant.pausing.resume(plant.daily.id)


def test_moved_starts_that_are_over_are_forgotten_when_the_app_starts(plant):
    plant.move(to=local(23, 6, 10))
    second = plant.move(at(25), local(25, 9, 0))

    def kept():
        return [each.id for each in plant.container.repositories.schedules.all(plant.container.db.read())]

    plant.go_to(at(23, 6, 40))
    for row in plant.rows():
        plant.container.operator.cancel_execution(row.id)
    plant.catalogue.edit(lambda edit: edit.purge())
    assert kept() == [second.after.id, plant.daily.id]


# ---------------------------------------------------------------------- clocks
@pytest.mark.parametrize(
    ("to", "runs_at"),
    [
        (datetime(2027, 3, 28, 3, 30), datetime(2027, 3, 28, 1, 30, tzinfo=UTC)),  # does not exist: an hour later
        (datetime(2027, 10, 31, 3, 30), datetime(2027, 10, 31, 0, 30, tzinfo=UTC)),  # twice: the first
    ],
)
def test_a_time_that_a_clock_change_skips_or_repeats(plant, to, runs_at):
    daily = plant.catalogue.save_schedule(
        plant.schedule(name="Nightly", start=datetime(2027, 3, 1, 3, 30), timezone="Europe/Helsinki")
    )
    instant = runs_at + timedelta(days=2 - runs_at.weekday() % 2)
    instant = next(
        run.at
        for run in plant.container.plan.between(instant, instant + timedelta(days=4)).runs
        if run.schedule.id == daily.id
    )
    moved = plant.move(instant, to, daily, any_day=True)
    assert moved.at == runs_at
    plant.moving.undo(moved)
    runs = plant.container.plan.between(instant, instant + timedelta(minutes=1)).runs
    assert [run.schedule.id for run in runs if run.schedule.name == "Nightly"] == [daily.id]


# ---------------------------------------------------------------------- what others read of it
def test_the_history_says_when_it_was_planned_before(plant):
    plant.move()
    plant.live_through()
    file = io.StringIO()
    write_history(plant.container.db.read(), file)
    heads, *lines = [line.split(",") for line in file.getvalue().splitlines()]
    cells = [(line[heads.index("planned_at")], line[heads.index("moved_from")]) for line in lines]
    assert cells[1] == ("2026-11-24T09:00:00+00:00", "2026-11-24T06:30:00+00:00")
    assert cells[0][1] == cells[2][1] == ""


def test_a_newer_calendar_file_moves_its_event_and_an_older_one_doesn_t_move_it_back(plant):
    def events():
        file = io.StringIO()
        write_plan(
            file, plant.container.plan.until(at(26, 0, 0)), "6f0f8a52-5f0e-4e6c-9d2f-000000000001", plant.clock.now()
        )
        return {str(e["UID"]): e for e in icalendar.Calendar.from_ical(file.getvalue()).events}

    older = events()
    plant.clock.advance(60)
    plant.move(robot_id=plant.sisu)
    newer = events()
    assert newer.keys() == older.keys()
    (moved,) = [uid for uid in newer if newer[uid]["DTSTART"].dt != older[uid]["DTSTART"].dt]
    assert (newer[moved]["DTSTART"].dt, newer[moved]["DTSTAMP"].dt > older[moved]["DTSTAMP"].dt) == (at(24, 9, 0), True)
    assert newer[moved]["SUMMARY"] == "Deliver · Sisu"


def test_its_sentence(moved, plant):
    assert sentences.sentence(moved.after) == "Once on 24 Nov 2026 at 09:00, moved from 24 Nov 2026 06:30"


def test_an_exported_plan_has_its_schedule_as_it_is_without_it(plant):
    before = json.loads(export_configuration(plant.container.db.read()))
    plant.move()
    assert json.loads(export_configuration(plant.container.db.read())) == before


def test_the_preview_of_a_move_ignores_the_place_that_it_leaves(plant):
    draft = plant.moving.draft(plant.daily.id, at(24), local(24, 6, 32))
    assert [start.instant for start in plant.container.forecasts.of(draft).starts] == [at(24, 6, 32)]
    assert plant.container.forecasts.of(draft).concerns == ()
    beside = plant.moving.draft(plant.daily.id, at(24), local(25, 6, 32))
    assert [concern.code.value for concern in plant.container.forecasts.of(beside).concerns] == ["overlap"]
