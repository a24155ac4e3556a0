"""Every change of robots: checked first, whole, with all that follows from it."""

from __future__ import annotations

from dataclasses import replace
from datetime import date

import pytest

from app.database.robots import Hold, HoldRepository
from app.domain.execution import ReasonCode, State
from app.domain.models import DayException, Group, IdleRule, Mission, Place, Robot
from app.domain.robot import IdentifiedBy
from tests.support.edits import switch_robot
from tests.support.errors import refuses
from tests.unit.catalogue.world import MISSIONS, ROBOTS, SCHEDULES


@pytest.fixture
def removed(world):
    return world.catalogue.remove_robot(world.robot.id)


def test_a_password_becomes_the_token_and_is_kept_nowhere(world):
    assert world.robot.token.startswith("Basic ")
    assert (world.robot.enabled, world.robot.needs_password, world.robot.address) == (True, False, "http://10.0.0.1")
    assert b"secret" not in world.db.path.read_bytes()
    assert world.robot.token not in repr(world.robot)


def test_without_a_password_a_new_robot_is_off_until_it_has_one(world):
    new = world.catalogue.save_robot(Robot("Bella", "10.0.0.2", "user"))
    assert (new.enabled, new.needs_password, new.token) == (False, True, None)
    assert switch_robot(world.catalogue, new.id, True) == new
    saved = world.catalogue.save_robot(new, password="secret")
    assert (saved.enabled, saved.needs_password, saved.token) == (True, False, world.robot.token)


def shown(world):
    """The robot, whose serial number was tested."""
    return world.catalogue.save_robot(
        replace(world.robot, serial_number="1", identified_by=IdentifiedBy.SERIAL_NUMBER), is_tested=True
    )


def test_a_known_serial_number_changes_with_the_password_only_and_is_never_forgotten(world):
    known = shown(world)
    assert known.token == world.robot.token  # now it is known: nothing has changed
    assert world.catalogue.save_robot(replace(known, serial_number=None)) == known
    new = world.catalogue.save_robot(replace(known, serial_number="2"), "secret")
    assert (new.serial_number, new.needs_password) == ("2", False)
    assert world.catalogue.save_robot(replace(new, serial_number="3")).needs_password


@pytest.mark.parametrize(
    "change",
    [{"username": "other"}, {"address": "10.0.0.9"}, {"certificate_sha256": "ab" * 32}, {"serial_number": "2"}],
)
def test_a_robot_that_showed_its_serial_number_is_expected_to_after_any_change(world, change):
    known = shown(world)
    assert world.catalogue.save_robot(replace(known, **change), "secret").identified_by is IdentifiedBy.SERIAL_NUMBER


def test_undo_of_a_name_takes_no_token_to_an_address_from_elsewhere(world):
    before = world.robot
    moved = world.catalogue.save_robot(replace(before, address="10.0.0.9"), "other")
    renamed = world.catalogue.change(before, replace(before, name="Aino 2"))
    assert world.catalogue.change_back(replace(renamed, name=before.name, token=before.token), renamed) == moved


def test_a_robot_that_was_switched_off_stays_off_with_a_new_password(world):
    off = switch_robot(world.catalogue, world.robot.id, False)
    assert world.catalogue.save_robot(off, password="new").enabled is False


def test_switching_a_robot_off_cancels_what_waits_for_it_and_leaves_what_runs(world):
    schedule = world.schedule()
    waiting, running = world.row(schedule), world.row(schedule, State.EXECUTING)
    switch_robot(world.catalogue, world.robot.id, False)
    assert world.outcome(waiting) == (State.CANCELLED, ReasonCode.ROBOT_REMOVED)
    assert world.outcome(running) == (State.EXECUTING, None)


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"name": ""}, "name"),
        ({"name": " \t"}, "name"),
        ({"name": "x" * 81}, "name"),
        ({"name": "a\nb"}, "name"),
        ({"name": "\ud800"}, "name"),
        ({"address": ""}, "address"),
        ({"address": "ftp://x"}, "address"),
        ({"address": "http://u:p@x"}, "address"),
        ({"username": "a:b"}, "username"),
        ({"username": "a\x00b"}, "username"),
        ({"certificate_sha256": "12"}, "certificate_sha256"),
    ],
)
def test_an_invalid_robot_is_reported_at_its_field_and_changes_nothing(world, values, field):
    with refuses(field):
        world.catalogue.save_robot(replace(world.robot, **values))
    assert ROBOTS.all(world.db.read()) == [world.robot]
    assert world.announced == []


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


def test_a_removed_robot_comes_back_with_everything_under_its_old_ids(world):
    own = world.catalogue.save_mission(Mission("Home", "guid-2", robot_id=world.robot.id))
    world.catalogue.change_idle_rule(world.robot.id, mission_id=own.id, after_minutes=7)
    schedule = world.schedule()
    world.db.write(lambda c: HoldRepository().add(c, Hold(since=world.clock.now(), robot_id=world.robot.id)))
    before = ROBOTS.all(world.db.read()), MISSIONS.all(world.db.read())
    waiting, running = world.row(schedule), world.row(schedule, State.QUEUED)
    removed = world.catalogue.remove_robot(world.robot.id)
    assert (ROBOTS.all(world.db.read()), SCHEDULES.all(world.db.read())) == ([], [])
    assert world.outcome(waiting) == world.outcome(running) == (State.CANCELLED, ReasonCode.ROBOT_REMOVED)
    world.catalogue.restore(removed)
    assert (ROBOTS.all(world.db.read()), MISSIONS.all(world.db.read())) == before
    assert SCHEDULES.all(world.db.read()) == [replace(schedule, changed_at=world.clock.now())]
    assert len(HoldRepository().all(world.db.read())) == 1


def test_the_token_of_a_deleted_robot_is_not_on_the_disk_and_comes_back_with_it(world):
    token = world.robot.token
    removed = world.catalogue.remove_robot(world.robot.id)
    assert token
    assert token not in repr(removed)
    assert world.db.read().execute("SELECT token FROM robots").fetchone()[0] is None
    world.catalogue.restore(removed)
    assert ROBOTS.get(world.db.read(), world.robot.id).token == token


def test_a_robot_comes_back_to_no_name_that_a_group_has_now(world, bella):
    removed = world.catalogue.remove_robot(world.robot.id)
    world.catalogue.save_group(Group(world.robot.name, (bella.id,)))
    with refuses("name", "there is another group Aino now: rename that one, then undo again"):
        world.catalogue.restore(removed)


def test_an_edit_of_what_is_left_takes_nothing_from_what_comes_back(world):
    """The idle rule of a mission, the robot of a group, the mission of a place: they are hidden while the other one is edited."""
    others = [
        world.catalogue.save_robot(Robot(name, f"10.0.1.{n}", "user"), password="x") for n, name in enumerate("BCD")
    ]
    world.catalogue.change_idle_rule(world.robot.id, mission_id=world.mission.id, after_minutes=7)
    group = world.catalogue.save_group(Group("Hall", (world.robot.id, *(robot.id for robot in others)), keep_free=1))
    place = world.catalogue.save_place(Place("Dock", 1, (world.mission.id,)))
    mission = world.catalogue.remove_mission(world.mission.id)
    edited = world.catalogue.save_robot(replace(world.robot, name="Alma"))
    world.catalogue.save_place(replace(place, most=2, missions=()))
    robots = [world.catalogue.remove_robot(robot.id) for robot in others[:2]]
    assert world.catalogue.groups() == [replace(group, members=(world.robot.id, others[2].id), keep_free=0)]
    world.catalogue.save_group(replace(world.catalogue.groups()[0], name="Yard"))
    for removed in (robots[0], mission, robots[1]):
        world.catalogue.restore(removed)
    assert edited.idle is None
    assert world.catalogue.robot(world.robot.id).idle == IdleRule(world.mission.id, 7)
    assert world.catalogue.groups() == [replace(group, name="Yard")]
    assert world.catalogue.places() == [replace(place, most=2)]


@pytest.mark.parametrize("undone_first", [0, 1])
def test_a_robot_and_its_group_are_back_in_whatever_order_they_are_undone(world, undone_first):
    group = world.catalogue.save_group(Group("Hall", (world.robot.id,)))
    schedule = world.schedule(robot_id=None, group_id=group.id)
    removed = [world.catalogue.remove_robot(world.robot.id), world.catalogue.remove_group(group.id)]
    for number in (undone_first, 1 - undone_first):
        world.catalogue.restore(removed[number])
    assert (world.catalogue.groups(), world.stored(schedule).group_id) == ([group], group.id)


def test_a_schedule_that_was_deleted_before_its_mission_is_back_after_it(world):
    schedule = world.schedule()
    removed = [world.catalogue.remove_schedule(schedule.id), world.catalogue.remove_mission(world.mission.id)]
    with refuses("mission", "this mission no longer exists"):
        world.catalogue.restore(removed[0])
    world.catalogue.restore(removed[1])
    assert world.stored(schedule) is None
    world.catalogue.restore(removed[0])
    assert world.stored(schedule).id == schedule.id


def test_a_deletion_can_be_undone_until_the_app_starts_again(removed, world):
    world.clock.advance(365 * 86400)
    world.catalogue.remove_mission(world.mission.id)
    world.catalogue.restore(removed)
    assert [robot.name for robot in ROBOTS.all(world.db.read())] == [world.robot.name]
    world.catalogue.edit(lambda edit: edit.purge())
    c = world.db.read()
    assert [c.execute(f"SELECT count(*) FROM {table}").fetchone()[0] for table in ("robots", "missions")] == [1, 0]


def test_undo_says_when_the_name_is_in_use(removed, world):
    world.catalogue.save_robot(Robot("Aino", "10.0.0.5"))
    with refuses("name", "there is another robot Aino now: rename that one, then undo again"):
        world.catalogue.restore(removed)
    assert len(ROBOTS.all(world.db.read())) == 1
    world.catalogue.save_robot(replace(ROBOTS.by_name(world.db.read(), "Aino"), name="Alma"))
    world.catalogue.restore(removed)
    assert {robot.name: robot.address for robot in ROBOTS.all(world.db.read())} == {
        "Aino": "http://10.0.0.1",
        "Alma": "http://10.0.0.5",
    }


def test_undo_adds_no_second_robot_at_an_address_in_use(removed, world):
    world.catalogue.save_robot(Robot("Alma", "10.0.0.1"))
    with refuses(
        "address", "not restored: this is the address of Alma, .* already. Change or delete that one, then undo again"
    ):
        world.catalogue.restore(removed)
    assert [robot.name for robot in ROBOTS.all(world.db.read())] == ["Alma"]


def test_undo_says_what_else_was_taken_or_removed_and_changes_nothing(world):
    own = world.catalogue.save_mission(Mission("Home", "guid-2", robot_id=world.robot.id))
    world.schedule(name="Home", mission_id=own.id)
    morning = world.schedule()
    conflicts = {
        "another schedule Morning now": (world.catalogue.remove_schedule(morning.id), lambda: world.schedule()),
        "another mission Home now": (
            world.catalogue.remove_mission(own.id),
            lambda: world.catalogue.save_mission(Mission("Home", "guid-3", robot_id=world.robot.id)),
        ),
    }
    for problem, (removed, take) in conflicts.items():
        take()
        with refuses("name", problem):
            world.catalogue.restore(removed)
    world.catalogue.remove_robot(world.robot.id)
    with refuses("robot", "this robot no longer exists"):
        world.catalogue.restore(conflicts["another mission Home now"][0])
    assert (MISSIONS.all(world.db.read()), SCHEDULES.all(world.db.read())) == ([world.mission], [])


def test_what_was_restored_is_not_restored_again(world):
    group = world.catalogue.save_group(Group("Hall", (world.robot.id,)))
    days = world.catalogue.save_days(DayException("Audit", date(2026, 12, 1), date(2026, 12, 2)))
    place = world.catalogue.save_place(Place("Dock 2", 1, (world.mission.id,)))
    schedule = world.schedule()
    for remove in (
        lambda: world.catalogue.remove_place(place.id),
        lambda: world.catalogue.remove_days(days.id),
        lambda: world.catalogue.remove_group(group.id),
        lambda: world.catalogue.remove_schedule(schedule.id),
        lambda: world.catalogue.remove_mission(world.mission.id),
        lambda: world.catalogue.remove_robot(world.robot.id),
    ):
        removed = remove()
        world.catalogue.restore(removed)
        with refuses("name", "this has been restored already"):
            world.catalogue.restore(removed)
    world.catalogue.save_robot(replace(world.robot, name="Alma"))
    with refuses("name", "this has been restored already"):
        world.catalogue.restore(removed)
