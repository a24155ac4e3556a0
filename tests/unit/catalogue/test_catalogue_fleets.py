"""Every change of fleets: checked first, whole, with all that follows from it for their robots."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.check_up import RobotProfile
from app.domain.execution import ReasonCode, State
from app.domain.models import ANY_VEHICLE, Fleet, FleetKind, Group, InvalidInput, Robot
from tests.support.edits import switch_robot
from tests.support.errors import refuses
from tests.unit.catalogue.world import ROBOTS


@pytest.fixture
def fleet(world):
    return world.catalogue.save_fleet(Fleet("Hall", "10.0.0.50", username="user"), password="secret")


@pytest.fixture
def robot(world, fleet):
    """One of the fleet, on which a schedule starts a mission."""
    world.robot = world.catalogue.save_robot(Robot("Bella", "", fleet=fleet, vehicle="7", serial_number="S7"))
    return world.robot


@pytest.fixture
def any_robot(world, fleet):
    return world.catalogue.save_robot(Robot("Any of Hall", "", fleet=fleet, vehicle=ANY_VEHICLE))


def the(world, robot):
    return ROBOTS.get(world.db.read(), robot.id)


def test_the_password_of_fleet_enterprise_is_a_key(world):
    fleet = world.catalogue.save_fleet(Fleet("E", "10.0.0.51", FleetKind.ENTERPRISE), password="mir_1")
    assert fleet.token == "x-api-key mir_1"
    with refuses("password", "API key"):
        world.catalogue.save_fleet(fleet, password="two words")


def test_other_credentials_of_a_fleet_reach_its_robots(world, fleet, robot):
    moved = world.catalogue.save_fleet(replace(fleet, address="10.0.0.60", username="other"), password="new")
    assert (the(world, robot).address, the(world, robot).token) == ("http://10.0.0.60", moved.token)
    assert moved.token != fleet.token


def test_a_fleet_at_another_address_is_off_with_its_robots_until_it_has_a_password(world, fleet, robot):
    waiting = world.row(world.schedule())
    moved = world.catalogue.save_fleet(replace(fleet, address="10.0.0.60"))
    assert (moved.enabled, moved.needs_password, the(world, robot).enabled) == (False, True, False)
    assert world.outcome(waiting) == (State.CANCELLED, ReasonCode.ROBOT_REMOVED)
    world.catalogue.save_fleet(moved, password="secret")
    assert the(world, robot).enabled


def test_a_robot_that_was_off_before_its_fleet_stays_off_with_it(world, fleet, robot):
    other = world.catalogue.save_robot(Robot("Cara", "", fleet=fleet, vehicle="8"))
    switch_robot(world.catalogue, other.id, False)
    off = world.catalogue.change(fleet, replace(fleet, enabled=False))
    assert not the(world, robot).enabled
    world.catalogue.save_robot(replace(the(world, robot), name="Bea"))  # another change leaves it so
    world.catalogue.change_back(fleet, off)
    assert (the(world, robot).enabled, the(world, other).enabled) == (True, False)


def test_a_robot_added_to_a_fleet_that_is_off_is_on_with_it(world, fleet):
    off = world.catalogue.change(fleet, replace(fleet, enabled=False))
    robot = world.catalogue.save_robot(Robot("Bella", "", fleet=off, vehicle="7"))
    assert not robot.enabled
    world.catalogue.change(off, fleet)
    assert the(world, robot).enabled


def test_removing_a_fleet_removes_its_robots_and_the_undo_puts_all_back(world, fleet, robot):
    schedule = world.schedule()
    removed = world.catalogue.remove_fleet(fleet.id)
    assert (world.catalogue.fleets(), the(world, robot), world.stored(schedule)) == ([], None, None)
    assert fleet.token.encode() not in b"".join(p.read_bytes() for p in world.db.path.parent.glob("*.db"))
    world.catalogue.restore(removed)
    assert (world.catalogue.fleets(), the(world, robot)) == ([fleet], robot)
    assert world.stored(schedule).name == schedule.name


def test_a_robot_is_not_put_back_without_its_fleet(world, fleet, robot):
    removed = world.catalogue.remove_robot(robot.id)
    world.catalogue.remove_fleet(fleet.id)
    with refuses("fleet", "no longer exists"):
        world.catalogue.restore(removed)


def test_nor_where_it_was_added_again(world, fleet, robot):
    removed = world.catalogue.remove_robot(robot.id)
    world.catalogue.save_robot(Robot("Again", "", fleet=fleet, vehicle="7"))
    with refuses("vehicle", "Again, which is configured already"):
        world.catalogue.restore(removed)


def test_a_removed_fleet_is_not_put_back_where_its_address_is_taken(world, fleet):
    removed = world.catalogue.remove_fleet(fleet.id)
    world.catalogue.save_fleet(Fleet("New", "10.0.0.50", username="user"), password="secret")
    with refuses("address", "not restored"):
        world.catalogue.restore(removed)


def test_a_robot_of_a_fleet_needs_its_id_there_and_has_it_once(world, fleet, robot):
    for vehicle, problem in (
        ("", "needs its id"),
        ("7", "Bella, which is configured already"),
        ("abc", "is a number"),
        ("07", "is a number"),
    ):
        with refuses("vehicle", problem):
            world.catalogue.save_robot(Robot("B", "", fleet=fleet, vehicle=vehicle))
    with refuses("vehicle", "others have none"):
        world.catalogue.save_robot(Robot("B", "10.0.0.7", vehicle="7"))
    world.db.write(lambda c: c.execute("UPDATE robots SET vehicle = 'abc'"))  # of an earlier version
    assert world.catalogue.save_robot(replace(the(world, robot), name="Bea")).name == "Bea"


def test_the_password_is_entered_at_the_fleet(world, fleet, robot):
    with refuses("password", "Hall has the password"):
        world.catalogue.save_robot(robot, password="new")


def test_a_robot_stays_reached_as_it_is(world, fleet, robot):
    """Its items have the numbers of another queue."""
    direct = world.catalogue.robots()[0]
    for changed in (replace(direct, fleet=fleet, vehicle="9"), replace(robot, vehicle="9")):
        with refuses("fleet", "another way"):
            world.catalogue.save_robot(changed)


def test_a_fleet_has_an_address_and_name_of_its_own(world, fleet):
    for address, other in (("10.0.0.1", "Aino"), ("10.0.0.50", "Hall")):
        with refuses("address", f"address of {other}"):
            world.catalogue.save_fleet(Fleet("New", address))
    with refuses("address", "address of Hall"):
        world.catalogue.save_robot(Robot("B", "10.0.0.50", "user"), password="x")
    with refuses("name", "a fleet Hall already"):
        world.catalogue.save_fleet(Fleet("Hall", "10.0.0.52"))


def test_a_fleet_of_another_kind_is_another_fleet(world, fleet):
    with refuses("kind", "another fleet"):
        world.catalogue.save_fleet(replace(fleet, kind=FleetKind.ENTERPRISE))


def test_one_machine_may_be_reached_directly_and_through_a_fleet(world, fleet, robot):
    """It is warned about, as both may be wanted while a site changes over."""
    direct = world.catalogue.save_robot(Robot("Direct", "10.0.0.7", "user", serial_number="S7"), password="secret")
    assert direct.serial_number == the(world, robot).serial_number


def test_a_group_has_single_robots_of_a_fleet_or_any_of_it(world, robot, any_robot):
    group = world.catalogue.save_group(Group("G", (world.catalogue.robots()[0].id, any_robot.id)))
    with refuses("members", "single robots of Hall and any"):
        world.catalogue.save_group(replace(group, members=(*group.members, robot.id)))


def test_a_removed_robot_does_not_come_back_into_a_group_with_any_of_its_fleet(world, robot, any_robot):
    group = world.catalogue.save_group(Group("G", (world.catalogue.robots()[0].id, robot.id)))
    removed = world.catalogue.remove_robot(robot.id)
    world.catalogue.save_group(replace(group, members=(any_robot.id,)))
    with pytest.raises(InvalidInput, match="single robots of Hall"):
        world.catalogue.restore(removed)


def test_changes_of_a_fleet_are_in_the_log(world, fleet, caplog):
    with caplog.at_level("INFO"):
        world.catalogue.save_fleet(replace(fleet, name="Halls", enabled=False), password="new")
    assert "fleet 'Hall' changed: name 'Hall' → 'Halls', enabled yes → no, another password" in caplog.text
    assert fleet.token not in caplog.text


def test_any_robot_of_a_fleet_has_no_idle_mission(world, any_robot):
    with refuses("idle", "never idle"):
        world.catalogue.change_idle_rule(any_robot.id, mission_id=world.mission.id)


def test_a_fleet_stays_known_at_another_address_and_is_another_one_for_another_user(world, fleet):
    profile = RobotProfile("guid-1", None)
    known = world.catalogue.save_fleet(replace(fleet, identity="guid-1", profile=profile))
    moved = world.catalogue.save_fleet(replace(known, address="10.0.0.60"), password="secret")
    assert (moved.identity, moved.known) == ("guid-1", profile)
    other = world.catalogue.save_fleet(replace(moved, username="other"), password="secret")
    assert (other.identity, other.known) == (None, None)
    tested = world.catalogue.save_fleet(replace(moved, username="third", identity="guid-3"), password="secret")
    assert tested.identity == "guid-3"


def test_a_fleet_whose_password_is_entered_again_may_be_another_one(world, fleet):
    """It was renamed, or set up again. Until it has said who it is, and if it is another one, it has to be checked up."""
    profile = RobotProfile("guid-1", None)
    known = world.catalogue.save_fleet(replace(fleet, identity="guid-1", profile=profile))
    again = world.catalogue.save_fleet(known, password="secret")
    assert (again.identity, again.known) == (None, None)
    world.catalogue.note_fleet(again, "guid-2", None)
    assert world.catalogue.fleets()[0].known is None


def test_a_fleet_that_is_known_by_nothing_is_checked_up_again_at_another_address(world, fleet):
    checked_up = world.catalogue.save_fleet(replace(fleet, profile=RobotProfile(None, None)))
    assert checked_up.known
    moved = world.catalogue.save_fleet(replace(checked_up, address="10.0.0.60"), password="secret")
    assert moved.known is None
