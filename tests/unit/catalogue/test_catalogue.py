"""Every change of robots, missions, schedules and settings: checked first, whole, with all that follows from it."""
from __future__ import annotations

from dataclasses import replace
from datetime import date, datetime, time, timedelta

import pytest

from app.database.connection import Database
from app.database.executions import ExecutionRepository
from app.database.holds import HoldRepository, StoredHold
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.domain.models import (
    Between,
    DayException,
    Execution,
    IdleRule,
    InvalidInput,
    Mission,
    ReasonCode,
    Robot,
    Schedule,
    Settings,
    State,
    Trigger,
)
from app.domain.robot import IdentifiedBy
from app.services.catalogue.catalogue import Catalogue
from app.services.live.changes import Changes, Topic
from tests.support.clock import VirtualClock

ROBOTS, MISSIONS, SCHEDULES, EXECUTIONS = RobotRepository(), MissionRepository(), ScheduleRepository(), ExecutionRepository()


class World:
    """A catalogue over a database, on Monday 2026-11-23 06:00 UTC, and what it published."""

    def __init__(self, path) -> None:
        self.clock, self.changes, self.told = VirtualClock(), Changes(), []
        self.changes.subscribe(lambda topic, about: self.told.append(topic))
        self.db = Database.open(path / "data" / "a.db", clock=self.clock, threaded=False, durable=False)
        self.catalogue = Catalogue(self.db, self.clock, self.changes)
        self.robot = self.catalogue.save_robot(Robot("Aino", "10.0.0.1", "user"), password="secret")
        self.mission = self.catalogue.save_mission(Mission("Deliver", "guid-1"))
        self.told.clear()

    def schedule(self, **values) -> Schedule:
        given = Schedule("Morning", self.robot.id, self.mission.id, datetime(2026, 11, 24, 6, 30), "UTC", "FREQ=DAILY")
        return self.catalogue.save_schedule(replace(given, **values))

    def stored(self, schedule: Schedule) -> Schedule | None:
        return SCHEDULES.get(self.db.read(), schedule.id)

    def row(self, schedule: Schedule, state: State = State.WAITING) -> Execution:
        now = self.clock.now()
        number = EXECUTIONS.count(self.db.read(), self.every) + 1
        execution = Execution(Trigger.SCHEDULED, schedule.robot_id, "Aino", "Deliver", "guid-1", now + timedelta(minutes=number),
                              now + timedelta(hours=1), now, f"token-{number}", "UTC", state=state, schedule_id=schedule.id)
        return self.db.write(lambda c: EXECUTIONS.add(c, execution))

    def outcome(self, row: Execution) -> tuple[State, ReasonCode | None]:
        found = EXECUTIONS.get(self.db.read(), row.id)
        return found.state, found.reason.code if found.reason else None

    @property
    def every(self):
        from app.database.executions import ExecutionFilter
        return ExecutionFilter()


@pytest.fixture
def world(tmp_path):
    world = World(tmp_path)
    yield world
    world.db.close()


def refuses(field: str, told: str):
    return pytest.raises(InvalidInput, match=told, check=lambda error: error.field == field)


# ---------------------------------------------------------------------- robots
def test_a_password_becomes_the_token_and_is_kept_nowhere(world):
    assert world.robot.token.startswith("Basic ")
    assert (world.robot.enabled, world.robot.needs_password, world.robot.address) == (True, False, "http://10.0.0.1")
    assert b"secret" not in world.db.path.read_bytes()
    assert world.robot.token not in repr(world.robot)


def test_without_a_password_a_new_robot_is_off_until_it_has_one(world):
    new = world.catalogue.save_robot(Robot("Bella", "10.0.0.2", "user"))
    assert (new.enabled, new.needs_password, new.token) == (False, True, None)
    assert world.catalogue.set_robot_enabled(new.id, True) == new
    given = world.catalogue.save_robot(new, password="secret")
    assert (given.enabled, given.needs_password, given.token) == (True, False, world.robot.token)


@pytest.mark.parametrize("change", [{"username": "other"}, {"address": "10.0.0.9"}, {"certificate_sha256": "ab" * 32}])
def test_another_user_address_or_certificate_needs_the_password_again(world, change):
    assert world.catalogue.save_robot(replace(world.robot, name="Bella")).token == world.robot.token
    changed = world.catalogue.save_robot(replace(world.robot, **change))
    assert (changed.enabled, changed.needs_password, changed.token) == (False, True, None)


def test_a_known_serial_number_changes_with_the_password_only_and_is_never_forgotten(world):
    known = world.catalogue.save_robot(replace(world.robot, serial_number="1", identified_by=IdentifiedBy.SERIAL_NUMBER), is_tested=True)
    assert known.token == world.robot.token          # now it is known: nothing has changed
    assert world.catalogue.save_robot(replace(known, serial_number=None)) == known
    new = world.catalogue.save_robot(replace(known, serial_number="2"), "secret")
    assert (new.serial_number, new.needs_password) == ("2", False)
    assert world.catalogue.save_robot(replace(new, serial_number="3")).needs_password


@pytest.mark.parametrize("change", [{"username": "other"}, {"address": "10.0.0.9"}, {"certificate_sha256": "ab" * 32},
                                    {"serial_number": "2"}])
def test_a_robot_that_showed_its_serial_number_is_expected_to_after_any_change(world, change):
    known = world.catalogue.save_robot(replace(world.robot, serial_number="1", identified_by=IdentifiedBy.SERIAL_NUMBER), is_tested=True)
    assert world.catalogue.save_robot(replace(known, **change), "secret").identified_by is IdentifiedBy.SERIAL_NUMBER


def test_a_robot_that_was_switched_off_stays_off_with_a_new_password(world):
    off = world.catalogue.set_robot_enabled(world.robot.id, False)
    assert world.catalogue.save_robot(off, password="new").enabled is False


def test_switching_a_robot_off_cancels_what_waits_for_it_and_leaves_what_runs(world):
    schedule = world.schedule()
    waiting, running = world.row(schedule), world.row(schedule, State.EXECUTING)
    world.catalogue.set_robot_enabled(world.robot.id, False)
    assert world.outcome(waiting) == (State.CANCELLED, ReasonCode.ROBOT_REMOVED)
    assert world.outcome(running) == (State.EXECUTING, None)


@pytest.mark.parametrize(("values", "field"), [
    ({"name": ""}, "name"), ({"name": " \t"}, "name"), ({"name": "x" * 81}, "name"), ({"name": "a\nb"}, "name"),
    ({"name": "\ud800"}, "name"),
    ({"address": ""}, "address"), ({"address": "ftp://x"}, "address"), ({"address": "http://u:p@x"}, "address"),
    ({"username": "a:b"}, "username"), ({"username": "a\x00b"}, "username"), ({"certificate_sha256": "12"}, "certificate_sha256")])
def test_what_a_robot_cannot_be_is_reported_at_its_field_and_nothing_changes(world, values, field):
    with pytest.raises(InvalidInput) as caught:
        world.catalogue.save_robot(replace(world.robot, **values))
    assert caught.value.field == field
    assert ROBOTS.all(world.db.read()) == [world.robot]
    assert world.told == []


def test_names_are_taken_once(world):
    with refuses("name", "a robot Aino already"):
        world.catalogue.save_robot(Robot(" Aino ", "10.0.0.3"))
    with refuses("name", "a mission Deliver already"):
        world.catalogue.save_mission(Mission("Deliver", "guid-9"))
    world.schedule()
    with refuses("name", "a schedule Morning already"):
        world.schedule()


@pytest.mark.parametrize("address", ["http://10.0.0.1", "10.0.0.1:80", "https://10.0.0.1"])
def test_the_same_machine_is_refused_at_its_address_and_named(world, address):
    with refuses("address", "this is the address of Aino, which is configured already"):
        world.catalogue.save_robot(Robot("Bella", address, "user"), password="x")
    other = world.catalogue.save_robot(Robot("Bella", "10.0.0.1:8080", "user"), password="x")
    with refuses("address", "this is the address of Aino"):
        world.catalogue.save_robot(replace(other, address=address), password="x")


def test_the_same_serial_number_is_refused_and_named(world):
    world.catalogue.save_robot(replace(world.robot, serial_number="A-1"), password="secret")
    with refuses("address", "this is Aino, which is configured already: serial number A-1"):
        world.catalogue.save_robot(Robot("Bella", "10.0.0.2", "user", serial_number="A-1"), password="x")


def test_a_robot_does_not_come_back_to_an_address_that_is_taken(world):
    removed = world.catalogue.remove_robot(world.robot.id)
    world.catalogue.save_robot(Robot("Bella", "10.0.0.1", "user"), password="x")
    with refuses("address", "this is the address of Bella"):
        world.catalogue.restore(removed)


def test_a_removed_robot_comes_back_with_everything_under_its_old_ids(world):
    own = world.catalogue.save_mission(Mission("Home", "guid-2", robot_id=world.robot.id))
    world.catalogue.save_idle_rule(world.robot.id, own.id, after_minutes=7)
    schedule = world.schedule()
    world.db.write(lambda c: HoldRepository().add(c, StoredHold(world.clock.now(), robot_id=world.robot.id)))
    before = ROBOTS.all(world.db.read()), MISSIONS.all(world.db.read())
    waiting, running = world.row(schedule), world.row(schedule, State.QUEUED)
    removed = world.catalogue.remove_robot(world.robot.id)
    assert (ROBOTS.all(world.db.read()), SCHEDULES.all(world.db.read())) == ([], [])
    assert world.outcome(waiting) == world.outcome(running) == (State.CANCELLED, ReasonCode.ROBOT_REMOVED)
    world.catalogue.restore(removed)
    assert (ROBOTS.all(world.db.read()), MISSIONS.all(world.db.read())) == before
    assert SCHEDULES.all(world.db.read()) == [replace(schedule, changed_at=world.clock.now())]
    assert len(HoldRepository().all(world.db.read())) == 1


def test_undo_says_when_the_name_has_been_taken_meanwhile(world):
    removed = world.catalogue.remove_robot(world.robot.id)
    world.catalogue.save_robot(Robot("Aino", "10.0.0.5"))
    with refuses("name", "there is another robot Aino by now: give that one another name, then undo again"):
        world.catalogue.restore(removed)
    assert len(ROBOTS.all(world.db.read())) == 1
    world.catalogue.save_robot(replace(ROBOTS.by_name(world.db.read(), "Aino"), name="Alma"))
    world.catalogue.restore(removed)
    assert {robot.name: robot.address for robot in ROBOTS.all(world.db.read())} == {"Aino": "http://10.0.0.1", "Alma": "http://10.0.0.5"}


def test_undo_brings_no_second_robot_to_an_address_that_is_taken_by_now(world):
    removed = world.catalogue.remove_robot(world.robot.id)
    world.catalogue.save_robot(Robot("Alma", "10.0.0.1"))
    with refuses("address", "not put back: this is the address of Alma, .* already; change or delete that one, then undo again"):
        world.catalogue.restore(removed)
    assert [robot.name for robot in ROBOTS.all(world.db.read())] == ["Alma"]


def test_undo_says_what_else_was_taken_or_went_meanwhile_and_changes_nothing(world):
    own = world.catalogue.save_mission(Mission("Home", "guid-2", robot_id=world.robot.id))
    home, morning = world.schedule(name="Home", mission_id=own.id), world.schedule()
    gone = {
        "another schedule Morning by now": (world.catalogue.remove_schedule(morning.id), lambda: world.schedule()),
        "another mission Home by now": (world.catalogue.remove_mission(own.id), lambda: world.catalogue.save_mission(
            Mission("Home", "guid-3", robot_id=world.robot.id))),
    }
    for told, (removed, take) in gone.items():
        take()
        with refuses("name", told):
            world.catalogue.restore(removed)
    removed = world.catalogue.remove_schedule(SCHEDULES.by_name(world.db.read(), "Morning").id)
    world.catalogue.remove_mission(world.mission.id)
    with refuses("mission", "no such mission any more"):
        world.catalogue.restore(removed)
    world.catalogue.remove_robot(world.robot.id)
    with refuses("robot", "no such robot any more"):
        world.catalogue.restore(gone["another mission Home by now"][0])
    assert (MISSIONS.all(world.db.read()), SCHEDULES.all(world.db.read()), world.stored(home)) == ([], [], None)


def test_what_is_put_back_twice_is_there_once(world):
    days = world.catalogue.save_days(DayException("Audit", date(2026, 12, 1), date(2026, 12, 2)))
    schedule = world.schedule()
    for remove in (lambda: world.catalogue.remove_days(days.id), lambda: world.catalogue.remove_schedule(schedule.id),
                   lambda: world.catalogue.remove_mission(world.mission.id), lambda: world.catalogue.remove_robot(world.robot.id)):
        removed = remove()
        world.catalogue.restore(removed)
        with refuses("name", "this has been put back already"):
            world.catalogue.restore(removed)
    world.catalogue.save_robot(replace(world.robot, name="Alma"))
    with refuses("name", "this has been put back already"):
        world.catalogue.restore(removed)


# ---------------------------------------------------------------------- missions
@pytest.mark.parametrize("guid", ["", " ", "a b", "x" * 65, "a/b", "ä"])
def test_a_guid_is_letters_digits_and_hyphens(world, guid):
    with refuses("guid", "guid"):
        world.catalogue.save_mission(Mission("New", guid))


@pytest.mark.parametrize("minutes", [0, -5, 1441, 2.5, True, "12"])
def test_a_usual_duration_is_a_whole_number_of_minutes_of_a_day(world, minutes):
    with refuses("usual_minutes", "a whole number from 1 to 1440"):
        world.catalogue.save_mission(replace(world.mission, usual_minutes=minutes))
    assert MISSIONS.get(world.db.read(), world.mission.id) == world.mission


@pytest.mark.parametrize("minutes", [1, 1440, None])
def test_a_usual_duration_is_kept_or_taken_away(world, minutes):
    typed = world.catalogue.save_mission(replace(world.mission, usual_minutes=12))
    world.catalogue.save_mission(replace(typed, usual_minutes=minutes))
    assert MISSIONS.get(world.db.read(), world.mission.id).usual_minutes == minutes


def test_a_robots_own_mission_takes_over_what_is_planned_there(world):
    other = world.catalogue.save_robot(Robot("Bella", "10.0.0.2", "user"), password="x")
    here, there = world.schedule(), world.schedule(name="There", robot_id=other.id)
    world.catalogue.save_idle_rule(world.robot.id, world.mission.id)
    own = world.catalogue.save_mission(Mission("Deliver", "guid-2", robot_id=world.robot.id))
    assert (world.stored(here).mission_id, world.stored(there).mission_id) == (own.id, world.mission.id)
    assert ROBOTS.get(world.db.read(), world.robot.id).idle.mission_id == own.id
    assert world.schedule(name="Later").mission_id == own.id
    world.catalogue.remove_mission(own.id)
    assert world.stored(here).mission_id == world.mission.id


def test_a_mission_of_another_robot_cannot_be_planned(world):
    other = world.catalogue.save_robot(Robot("Bella", "10.0.0.2"))
    own = world.catalogue.save_mission(Mission("Home", "guid-2", robot_id=other.id))
    with refuses("mission", "another robot only"):
        world.schedule(mission_id=own.id)
    with refuses("mission", "another robot only"):
        world.catalogue.save_idle_rule(world.robot.id, own.id)


def test_a_removed_mission_takes_schedules_and_idle_rules_along_and_brings_them_back(world):
    schedule = world.schedule()
    waiting = world.row(schedule)
    with_rule = world.catalogue.save_idle_rule(world.robot.id, world.mission.id)
    removed = world.catalogue.remove_mission(world.mission.id)
    assert (MISSIONS.all(world.db.read()), SCHEDULES.all(world.db.read())) == ([], [])
    assert world.outcome(waiting) == (State.CANCELLED, ReasonCode.SCHEDULE_CHANGED)
    world.catalogue.restore(removed)
    assert ROBOTS.all(world.db.read()) == [with_rule]
    assert [found.id for found in SCHEDULES.all(world.db.read())] == [schedule.id]


@pytest.mark.parametrize("minutes", [4, 31, 7.5, True])
def test_idle_time_is_5_to_30_minutes(world, minutes):
    with refuses("after_minutes", "5 to 30"):
        world.catalogue.save_idle_rule(world.robot.id, world.mission.id, after_minutes=minutes)


def test_an_idle_rule_can_be_taken_away(world):
    assert world.catalogue.save_idle_rule(world.robot.id, world.mission.id, 30, enabled=False).idle == IdleRule(world.mission.id, 30, False)
    assert world.catalogue.edit(lambda edit: edit.set_idle_rule(world.robot.id, None)).idle is None


# ---------------------------------------------------------------------- schedules
def test_a_new_schedule_knows_when_it_runs_first(world):
    schedule = world.schedule()
    assert schedule.next_at.isoformat() == "2026-11-24T06:30:00+00:00"
    assert schedule.changed_at == world.clock.now()
    assert world.stored(schedule) == schedule
    assert world.told == [Topic.SCHEDULES]


def test_a_blank_name_is_made_of_mission_and_robot(world):
    assert [world.schedule(name="").name for _ in range(3)] == ["Deliver on Aino", "Deliver on Aino 2", "Deliver on Aino 3"]


def test_schedules_that_the_app_named_carry_the_new_name_of_their_robot(world):
    made = [world.schedule(name=""), world.schedule(name=""), world.schedule(name="Deliver on Aino tonight")]
    world.told.clear()
    world.catalogue.save_robot(replace(world.robot, name="Alma"))
    assert [world.stored(schedule).name for schedule in made] == ["Deliver on Alma", "Deliver on Alma 2", "Deliver on Aino tonight"]
    assert set(world.told) == {Topic.ROBOTS, Topic.SCHEDULES}


def test_renaming_keeps_the_order_of_numbers_and_leaves_what_a_person_typed(world):
    made = [world.schedule(name="").id for _ in range(12)]
    typed = world.schedule(name="Deliver on Aino 2026")
    world.catalogue.save_robot(replace(world.robot, name="Alma"))
    names = [SCHEDULES.get(world.db.read(), number).name for number in made]
    assert names == ["Deliver on Alma", *(f"Deliver on Alma {number}" for number in range(2, 13))]
    assert world.stored(typed).name == "Deliver on Aino 2026"


def test_every_change_of_the_plan_is_a_line_of_the_log(world, caplog):
    caplog.set_level("INFO", "app.services.catalogue")
    schedule = world.schedule()
    world.catalogue.set_schedule_enabled(schedule.id, False)
    world.catalogue.save_robot(replace(world.robot, name="Alma"), password="secret")
    world.catalogue.remove_schedule(schedule.id)
    world.catalogue.remove_robot(world.robot.id)
    with pytest.raises(InvalidInput):
        world.catalogue.edit(lambda edit: [edit.save_robot(Robot("Ville", "10.0.0.9", "u"), "p"), edit.the_robot(99)])
    assert [record.message for record in caplog.records] == [
        "schedule 'Morning' added", "schedule 'Morning' changed: enabled yes → no", "robot 'Aino' changed: name 'Aino' → 'Alma'",
        "schedule 'Morning' removed", "robot 'Alma' removed, and 0 schedules with it"]


def test_a_renamed_mission_takes_the_made_names_of_its_schedules_along_and_leaves_typed_ones(world):
    made = [world.schedule(name="").id for _ in range(12)]
    typed, other = world.schedule(name="Deliver on Aino 2026"), world.schedule(name="Carry on Aino 3")
    world.catalogue.save_mission(replace(world.mission, name="Carry"))
    names = [SCHEDULES.get(world.db.read(), number).name for number in made]
    assert names == ["Carry on Aino", "Carry on Aino 2", *(f"Carry on Aino {number}" for number in range(4, 14))]
    assert (world.stored(typed).name, world.stored(other).name) == ("Deliver on Aino 2026", "Carry on Aino 3")


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
    assert (row.state, row.priority, row.minimum_battery_percent, row.planned_at) == (State.WAITING, 5, 30.0, waiting.planned_at)
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
    world.told.clear()
    world.clock.advance(3600)
    world.catalogue.save_schedule(schedule)
    assert world.stored(schedule) == replace(schedule, next_at=None)
    assert world.outcome(waiting) == (State.WAITING, None)
    assert world.told == []


def test_switching_off_and_on(world):
    schedule = world.schedule()
    waiting = world.row(schedule)
    assert world.catalogue.set_schedule_enabled(schedule.id, False).next_at is None
    assert world.outcome(waiting) == (State.CANCELLED, ReasonCode.SCHEDULE_CHANGED)
    assert world.catalogue.set_schedule_enabled(schedule.id, True).next_at == schedule.next_at


def test_a_deleted_schedule_is_off_at_once_and_undo_brings_it_back_from_then_on(world):
    schedule = world.schedule(start=datetime(2026, 11, 23, 5, 0), recurrence="FREQ=HOURLY")
    waiting = world.row(schedule)
    removed = world.catalogue.remove_schedule(schedule.id)
    assert world.stored(schedule) is None
    assert world.outcome(waiting) == (State.CANCELLED, ReasonCode.SCHEDULE_CHANGED)
    world.clock.advance(3 * 3600 + 60)
    world.catalogue.restore(removed)
    assert world.stored(schedule).next_at.isoformat() == "2026-11-23T10:00:00+00:00"


@pytest.mark.parametrize(("values", "field"), [
    ({"start": datetime(2026, 11, 24, 6, 30, 1)}, "start"), ({"start": datetime(1969, 1, 1)}, "start"),
    ({"start": datetime(2200, 1, 1)}, "start"), ({"timezone": "Mars/Base"}, "timezone"), ({"timezone": "../etc/passwd"}, "timezone"),
    ({"recurrence": ""}, "recurrence"), ({"recurrence": "FREQ=DAILY;BYMONTH=2;BYMONTHDAY=30"}, "recurrence"),
    ({"minimum_battery_percent": 101}, "minimum_battery_percent"), ({"minimum_battery_percent": float("nan")}, "minimum_battery_percent"),
    ({"start_window_minutes": 1441}, "start_window_minutes"), ({"start_window_minutes": -1}, "start_window_minutes"),
    ({"between": Between(time(8), time(9))}, "between"),
    ({"between": Between(time(9), time(8)), "recurrence": "FREQ=HOURLY"}, "between"), ({"overlap": "both"}, "overlap"),
    ({"priority": 1.5}, "priority"), ({"parameters": {"a": [1]}}, "parameters"), ({"parameters": {"": 1}}, "parameters"),
    ({"robot_id": 99}, "robot"), ({"mission_id": 99}, "mission"), ({"name": "x" * 81}, "name"), ({"id": 99}, "schedule")])
def test_what_a_schedule_cannot_be_is_reported_at_its_field_and_nothing_changes(world, values, field):
    with pytest.raises(InvalidInput) as caught:
        world.schedule(**values)
    assert caught.value.field == field
    assert SCHEDULES.all(world.db.read()) == []


def test_a_one_time_schedule_on_a_day_off_is_refused(world):
    sunday = datetime(2026, 11, 29, 6, 30)
    with refuses("start", "2026-11-29 is a Sunday, which is not a working day"):
        world.schedule(start=sunday, recurrence=None)
    assert world.schedule(start=sunday, recurrence=None, respect_working_days=False).next_at is not None


# ---------------------------------------------------------------------- settings
def test_settings_are_stored_and_told(world):
    assert world.catalogue.change_settings(retry_limit=3, history_limit=None).retry_limit == 3
    assert world.told == [Topic.SETTINGS]
    world.told.clear()
    world.catalogue.change_settings(retry_limit=3)
    assert world.told == []


@pytest.mark.parametrize("changes", [
    {"poll_interval_seconds": 0}, {"poll_interval_seconds": 3601}, {"poll_interval_seconds": None}, {"retry_limit": -1},
    {"retry_limit": 21}, {"retry_limit": True}, {"minimum_battery_percent": -1}, {"minimum_battery_percent": 100.5}, {"working_days": []},
    {"working_days": ["MO", "MO"]}, {"working_days": ["Monday"]}, {"working_days": "MO"}, {"timezone": "Nowhere"},
    {"start_window_minutes": 1441}, {"history_limit": 0},
    {"unknown_outcome_quiet_seconds": 4}, {"unknown_outcome_quiet_seconds": 601}, {"install_id": "x"}, {"poll_interval": 3}])
def test_what_a_setting_cannot_be_is_reported_at_its_field_and_nothing_changes(world, changes):
    with pytest.raises(InvalidInput) as caught:
        world.catalogue.change_settings(**changes, theme="dark")
    assert caught.value.field == next(iter(changes))
    assert world.catalogue.change_settings() == Settings()


def test_other_working_days_plan_anew_what_respects_them(world):
    daily, free = world.schedule(), world.schedule(name="Free", respect_working_days=False)
    weekend = world.schedule(name="Weekend", recurrence="FREQ=WEEKLY;BYDAY=SU")
    once = world.schedule(name="Once", recurrence=None)
    assert weekend.next_at is None
    world.catalogue.change_settings(working_days=["SU"])
    assert world.stored(daily).next_at.isoformat() == "2026-11-29T06:30:00+00:00" == world.stored(weekend).next_at.isoformat()
    assert (world.stored(free), world.stored(once)) == (free, once)
    assert world.stored(daily).changed_at == daily.changed_at


def test_what_is_due_already_stays_due_when_working_days_change(world):
    daily = world.schedule()
    world.clock.step(86400 + 1800)
    world.catalogue.change_settings(working_days=["SU"])
    assert world.stored(daily).next_at == daily.next_at


# ---------------------------------------------------------------------- together
def test_several_changes_are_made_all_or_not_at_all(world):
    def work(edit):
        edit.change_settings(retry_limit=1)
        edit.save_mission(Mission("New", "guid-7"))
        edit.save_mission(Mission("New", "guid-8"))
    with pytest.raises(InvalidInput):
        world.catalogue.edit(work)
    assert world.catalogue.change_settings().retry_limit == 10
    assert MISSIONS.all(world.db.read()) == [world.mission]
    assert world.told == []
