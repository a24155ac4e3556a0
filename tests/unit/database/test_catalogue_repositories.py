"""Robots, missions, schedules, settings and holds: what is put in comes out."""

from __future__ import annotations

import sqlite3
from dataclasses import replace
from datetime import UTC, datetime, time, timedelta

import pytest

from app.database.missions import MissionRepository
from app.database.robots import Accepted, Hold, HoldRepository, RobotRepository
from app.database.schedules import Progress, ScheduleRepository
from app.database.settings import SettingsRepository
from app.database.values import to_text
from app.domain.models import Between, Mission, Overlap, Robot, Schedule, Settings
from app.domain.robot import IdentifiedBy
from tests.unit.database.conftest import NOON

ROBOTS, MISSIONS, SCHEDULES, SETTINGS = (
    RobotRepository(),
    MissionRepository(),
    ScheduleRepository(),
    SettingsRepository(),
)
HOLDS = HoldRepository()
FULL = Robot(
    "Äiti",
    "https://10.0.0.1",
    "user",
    "Basic x",
    enabled=False,
    needs_password=True,
    certificate_sha256="ab",
    serial_number="1",
    identified_by=IdentifiedBy.CERTIFICATE,
    model="MiR100",
    software="3.5.4",
)


@pytest.fixture
def robot(db):
    return db.write(lambda c: ROBOTS.add(c, FULL))


@pytest.fixture
def mission(db):
    return db.write(lambda c: MISSIONS.add(c, Mission("Deliver", "guid-1", favourite=True, usual_minutes=12)))


@pytest.fixture
def schedule(db, robot, mission):
    return db.write(
        lambda c: SCHEDULES.add(
            c,
            Schedule(
                "Morning",
                robot.id,
                mission.id,
                datetime(2026, 11, 23, 6, 30),
                "Europe/Helsinki",
                "FREQ=HOURLY",
                enabled=True,
                between=Between(time(8, 30), time(16, 45)),
                minimum_battery_percent=12.5,
                respect_working_days=False,
                start_window_minutes=0,
                overlap=Overlap.QUEUE,
                priority=3,
                parameters={"speed": 0.5, "name": "Ä"},
                changed_at=NOON,
                next_at=NOON + timedelta(hours=1),
                paused_until=NOON,
            ),
        )
    )


# ---------------------------------------------------------------------- robots
def test_a_robot_is_read_back_unchanged(db, robot):
    assert robot == replace(FULL, id=robot.id)
    assert ROBOTS.get(db.read(), robot.id) == robot
    assert ROBOTS.by_name(db.read(), "Äiti") == robot
    assert ROBOTS.by_name(db.read(), "nobody") is None
    assert ROBOTS.all(db.read()) == [robot]


def test_only_facts_of_the_machine_itself_are_stored(db, robot):
    db.write(lambda c: ROBOTS.update(c, replace(robot, serial_number=None)))
    for number in ("2", "3"):  # a known serial number is not overwritten by what answers
        asked = ROBOTS.get(db.read(), robot.id)
        assert db.write(
            lambda c, n=number, asked=asked: ROBOTS.note_identity(c, asked, serial_number=n, software=f"{n}.6")
        )
    assert ROBOTS.get(db.read(), robot.id) == replace(robot, serial_number="2", software="3.6")
    with pytest.raises(ValueError, match="token"):
        db.write(lambda c: ROBOTS.note_identity(c, robot, token="x"))


@pytest.mark.parametrize(
    "edit",
    [{"address": "http://10.0.0.99"}, {"username": "other"}, {"certificate_sha256": "cd" * 32}, {"serial_number": "2"}],
)
def test_facts_read_before_the_robot_was_edited_are_not_stored(db, robot, edit):
    edited = replace(robot, **edit)
    db.write(lambda c: ROBOTS.update(c, edited))
    assert not db.write(
        lambda c: ROBOTS.note_identity(c, robot, serial_number="1", model="Old", identified_by="address")
    )
    assert ROBOTS.get(db.read(), robot.id) == edited


def test_a_removed_robot_takes_its_schedules_missions_and_hold_along(db, robot, schedule):
    db.write(lambda c: MISSIONS.add(c, Mission("Own", "guid-2", robot_id=robot.id)))
    db.write(lambda c: HOLDS.add(c, Hold(since=NOON, robot_id=robot.id)))
    db.write(lambda c: ROBOTS.remove(c, robot.id, NOON))
    db.write(ROBOTS.purge)
    c = db.read()
    assert (ROBOTS.all(c), SCHEDULES.all(c), HOLDS.all(c)) == ([], [], [])
    assert [mission.name for mission in MISSIONS.all(c)] == ["Deliver"]


def test_an_id_never_comes_back(db, robot):
    db.write(lambda c: ROBOTS.remove(c, robot.id, NOON))
    db.write(ROBOTS.purge)
    assert db.write(lambda c: ROBOTS.add(c, FULL)).id > robot.id


def test_only_the_removal_that_is_meant_is_undone(db, schedule):
    assert db.write(lambda c: SCHEDULES.put_back(c, schedule.id, NOON)) is None
    db.write(lambda c: SCHEDULES.remove(c, schedule.id, NOON))
    assert db.write(lambda c: SCHEDULES.put_back(c, schedule.id, NOON - timedelta(hours=1))) is None
    assert db.write(lambda c: SCHEDULES.put_back(c, schedule.id, NOON)) == schedule


def test_a_purge_takes_only_what_was_removed(db, robot, schedule):
    other = db.write(lambda c: ROBOTS.add(c, replace(FULL, name="Other")))
    db.write(lambda c: ROBOTS.remove(c, other.id, NOON))
    db.write(SCHEDULES.purge)
    db.write(ROBOTS.purge)
    assert (ROBOTS.all(db.read()), SCHEDULES.all(db.read())) == ([robot], [schedule])
    assert db.write(lambda c: ROBOTS.put_back(c, other.id, NOON)) is None


def test_two_robots_of_one_name_are_refused(db, robot):
    with pytest.raises(sqlite3.IntegrityError):
        db.write(lambda c: ROBOTS.add(c, FULL))


# ---------------------------------------------------------------------- missions
def test_a_robots_own_mission_hides_the_one_for_all(db, robot, mission):
    own = db.write(lambda c: MISSIONS.add(c, Mission("Deliver", "guid-2", robot_id=robot.id)))
    c = db.read()
    assert MISSIONS.for_robot(c, "Deliver", robot.id) == own
    assert MISSIONS.for_robot(c, "Deliver", robot.id + 1) == mission
    assert MISSIONS.by_name(c, "Deliver") == mission
    assert MISSIONS.available_on(c, robot.id) == [own]
    assert MISSIONS.available_on(c, robot.id + 1) == [mission]
    assert MISSIONS.all(c) == [mission, own]


def test_a_name_is_unique_among_shared_missions_and_per_robot(db, robot, mission):
    db.write(lambda c: MISSIONS.add(c, Mission("Deliver", "guid-2", robot_id=robot.id)))
    for robot_id in (None, robot.id):
        with pytest.raises(sqlite3.IntegrityError):
            db.write(lambda c, robot_id=robot_id: MISSIONS.add(c, Mission("Deliver", "guid-3", robot_id=robot_id)))


# ---------------------------------------------------------------------- schedules
def test_a_schedule_is_read_back_unchanged(db, schedule):
    c = db.read()
    assert SCHEDULES.get(c, schedule.id) == schedule == SCHEDULES.by_name(c, "Morning")
    assert (
        SCHEDULES.all(c)
        == SCHEDULES.for_robot(c, schedule.robot_id)
        == SCHEDULES.for_mission(c, schedule.mission_id)
        == [schedule]
    )
    plain = replace(
        schedule,
        between=None,
        recurrence=None,
        minimum_battery_percent=None,
        start_window_minutes=None,
        next_at=None,
        paused_until=None,
        parameters={},
    )
    db.write(lambda w: SCHEDULES.update(w, plain))
    assert SCHEDULES.get(c, schedule.id) == plain


def test_due_are_the_enabled_ones_whose_time_has_come(db, schedule):
    def add(name, minutes, enabled=True):
        at = None if minutes is None else NOON + timedelta(minutes=minutes)
        return db.write(lambda c: SCHEDULES.add(c, replace(schedule, id=0, name=name, next_at=at, enabled=enabled)))

    db.write(lambda c: SCHEDULES.remove(c, schedule.id, NOON))
    second, first = add("b", -1), add("a", -2)
    exact = add("c", 0)
    add("d", 1)
    add("off", -5, enabled=False)
    add("done", None)
    c = db.read()
    assert [found.name for found in SCHEDULES.due(c, NOON)] == ["a", "b", "c"]
    assert [found.id for found in SCHEDULES.due(c, NOON, limit=2)] == [first.id, second.id]
    lately = NOON - timedelta(seconds=90)
    assert [found.name for found in SCHEDULES.due(c, NOON, lately)] == [
        "b",
        "c",
        "a",
    ]  # what waited long waits a moment more
    assert SCHEDULES.next_due(c) == first.next_at
    db.write(lambda w: SCHEDULES.advance(w, first.id, None))
    assert SCHEDULES.next_due(c) == second.next_at
    assert SCHEDULES.next_to_run(c, schedule.robot_id) == exact.next_at  # all are paused until then
    db.write(lambda w: SCHEDULES.pause(w, second.id, None))
    assert SCHEDULES.next_to_run(c, schedule.robot_id) == second.next_at
    assert SCHEDULES.next_to_run(c, schedule.robot_id + 1) is None
    soon = [(each.next_at, "Deliver", each.robot_id, None, each.priority) for each in (second, exact)]
    assert SCHEDULES.next_starts(c, NOON - timedelta(minutes=2), NOON) == soon
    assert SCHEDULES.next_starts(c, second.next_at, NOON) == soon[1:]


def test_how_far_schedules_have_been_planned(db, schedule):
    later, day = NOON + timedelta(days=1), timedelta(days=1)
    other = db.write(lambda c: SCHEDULES.add(c, replace(schedule, id=0, name="Other")))
    db.write(
        lambda c: SCHEDULES.advance_all(
            c, [Progress(schedule.id, later, NOON, NOON), Progress(other.id, None, NOON, None)]
        )
    )
    assert SCHEDULES.get(db.read(), schedule.id) == replace(
        schedule, next_at=later, planned_through=NOON, started_through=NOON
    )
    assert SCHEDULES.get(db.read(), other.id) == replace(other, next_at=None, planned_through=NOON)
    db.write(
        lambda c: SCHEDULES.advance_all(c, [Progress(schedule.id, None, later, None)])
    )  # only planned further, not started
    assert SCHEDULES.get(db.read(), schedule.id) == replace(
        schedule, next_at=None, planned_through=later, started_through=NOON
    )
    assert [found.id for found in SCHEDULES.planned_beyond(db.read(), NOON)] == [schedule.id]
    db.write(lambda c: c.execute("UPDATE schedules SET changed_at = ? WHERE id = ?", (to_text(later), schedule.id)))
    db.write(lambda c: SCHEDULES.replan(c, schedule.id, NOON + day, NOON, NOON))
    assert SCHEDULES.get(db.read(), schedule.id) == replace(
        schedule, next_at=NOON + day, planned_through=NOON, started_through=NOON, changed_at=NOON
    )
    assert SCHEDULES.planned_beyond(db.read(), NOON) == []


def test_starts_left_out_go_with_their_schedule(db, schedule):
    for instant in (NOON, NOON, NOON + timedelta(hours=1)):
        db.write(lambda c, instant=instant: SCHEDULES.skip(c, schedule.id, instant))
    assert SCHEDULES.skipped(db.read(), schedule.id) == {NOON, NOON + timedelta(hours=1)}
    assert SCHEDULES.skipped(db.read(), schedule.id + 1) == set()
    db.write(lambda c: SCHEDULES.remove(c, schedule.id, NOON))
    db.write(SCHEDULES.purge)
    assert SCHEDULES.skipped(db.read(), schedule.id) == set()


def test_dispatch_state_of_a_robot_survives_an_edit(db, robot):
    def known():
        c = db.read()
        return ROBOTS.last_accepted(c, robot.id), ROBOTS.idle_queue_id(c, robot.id)

    assert known() == (None, None)
    db.write(lambda c: ROBOTS.note_accepted(c, robot.id, Accepted(41, "token")))
    db.write(lambda c: ROBOTS.note_idle(c, robot.id, 40))
    db.write(lambda c: ROBOTS.update(c, replace(robot, name="Other")))
    db.write(lambda c: ROBOTS.note_identity(c, robot, software="9.9"))
    assert known() == (Accepted(41, "token"), 40)
    db.write(lambda c: ROBOTS.note_idle(c, robot.id, None))
    assert known() == (Accepted(41, "token"), None)


def test_finding_the_due_ones_reads_an_index_and_never_the_table(db):
    plan = (
        db.read()
        .execute(
            f"""EXPLAIN QUERY PLAN {SCHEDULES.query}
        WHERE enabled = 1 AND next_at IS NOT NULL AND next_at <= ? ORDER BY next_at, id LIMIT ?""",
            ("x", 1),
        )
        .fetchall()
    )
    first, *of_moved_starts = [row["detail"] for row in plan]
    assert first == "SEARCH schedules USING INDEX schedules_due (next_at>? AND next_at<?)"
    assert not [each for each in of_moved_starts if "SCAN" in each]


# ---------------------------------------------------------------------- settings
def test_a_fresh_database_has_the_defaults(db):
    assert SETTINGS.load(db.read()) == Settings()
    assert not SETTINGS.is_stored(db.read(), "timezone")


def test_a_setting_that_does_not_exist_is_a_mistake_in_the_program(db):
    with pytest.raises(ValueError, match="install_id"):
        db.write(lambda c: SETTINGS.save(c, install_id="x"))


# ---------------------------------------------------------------------- values
def test_instants_sort_as_text_whatever_their_zone_and_fraction(db, schedule):
    instants = [
        datetime(2026, 1, 1, tzinfo=UTC),
        datetime(2026, 1, 1, 0, 0, 0, 1, tzinfo=UTC),
        datetime(2026, 1, 1, 0, 0, 1, tzinfo=UTC),
        datetime(2026, 1, 1, 3, tzinfo=UTC).astimezone(),
    ]
    for number, instant in enumerate(instants):
        db.write(lambda c, n=number, i=instant: SCHEDULES.add(c, replace(schedule, id=0, name=str(n), next_at=i)))
    rows = db.read().execute("SELECT name FROM current_schedules WHERE id <> ? ORDER BY next_at", (schedule.id,))
    assert [row["name"] for row in rows] == ["0", "1", "2", "3"]
