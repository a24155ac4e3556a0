"""MiR Fleets and the robots that are reached through them."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.executions import ExecutionRepository
from app.database.fleets import FleetRepository
from app.database.robots import RobotRepository
from app.database.schema import _FLEETS
from app.domain.check_up import RobotProfile
from app.domain.execution import State
from app.domain.models import ANY_VEHICLE, Fleet, FleetKind, Robot
from app.services.catalogue.database_check import find_problem
from tests.support.stored import brought_up_to_date
from tests.unit.database.conftest import NOON

FLEETS, ROBOTS, EXECUTIONS = FleetRepository(), RobotRepository(), ExecutionRepository()
FLEET = Fleet(
    "Hall fleet",
    "https://10.0.0.9",
    FleetKind.ENTERPRISE,
    "api key",
    "x-api-key mir_secret",
    certificate_sha256="cd",
    identity="MiR Fleet 1",
    software="1.5.0",
    profile=RobotProfile("MiR Fleet 1", "1.5.0", token_field="description"),
)


@pytest.fixture
def fleet(db):
    return db.write(lambda c: FLEETS.add(c, FLEET))


@pytest.fixture
def robot(db, fleet):
    """As the catalogue adds it: with the fleet's address and credentials."""
    of_fleet = {"address": fleet.address, "username": fleet.username, "token": fleet.token}
    robot = Robot("Aino", **of_fleet, certificate_sha256="cd", fleet=fleet, vehicle="7", serial_number="S7")
    return db.write(lambda c: ROBOTS.add(c, robot))


def test_a_fleet_is_read_back_unchanged(db, fleet):
    assert FLEETS.all(db.read()) == [fleet] == [replace(FLEET, id=fleet.id)]
    assert "mir_secret" not in repr(fleet)


def test_a_robot_of_a_fleet_has_its_address_and_credentials(db, fleet, robot):
    assert ROBOTS.get(db.read(), robot.id) == robot
    moved = replace(fleet, address="http://10.0.0.10", username="", token=None, needs_password=True)
    db.write(lambda c: FLEETS.update(c, moved))
    found = ROBOTS.get(db.read(), robot.id)
    assert (found.fleet, found.address, found.token, found.needs_password) == (moved, "http://10.0.0.10", None, True)


def test_credentials_of_a_fleet_are_stored_once(db, fleet, robot):
    db.write(lambda c: ROBOTS.update(c, replace(robot, name="Alma")))
    stored = db.read().execute("SELECT address, username, token, certificate_sha256 FROM robots").fetchone()
    assert tuple(stored) == ("", "", None, None)


def test_a_robot_of_a_fleet_is_known_as_far_as_its_fleet_is(db, fleet, robot):
    assert ROBOTS.get(db.read(), robot.id).known == FLEET.profile
    db.write(lambda c: FLEETS.note_identity(c, fleet, "MiR Fleet 1", "1.6.0"))
    assert ROBOTS.get(db.read(), robot.id).known is None


def test_facts_about_a_robot_are_stored_unless_its_fleet_was_edited_since(db, fleet, robot):
    assert db.write(lambda c: ROBOTS.note_identity(c, robot, model="MiR250"))
    db.write(lambda c: FLEETS.update(c, replace(fleet, address="http://10.0.0.10")))
    assert not db.write(lambda c: ROBOTS.note_identity(c, robot, model="MiR600"))
    assert ROBOTS.get(db.read(), robot.id).model == "MiR250"
    assert not db.write(lambda c: FLEETS.note_identity(c, fleet, "Another", "1.6.0"))


def test_a_known_fleet_keeps_its_identity(db, fleet):
    db.write(lambda c: FLEETS.note_identity(c, fleet, "Another", "1.5.0"))
    assert FLEETS.get(db.read(), fleet.id) == fleet


def test_robots_of_a_fleet_are_those_in_the_plan(db, fleet, robot):
    other = db.write(lambda c: ROBOTS.add(c, replace(robot, id=0, name="Any", vehicle=ANY_VEHICLE)))
    assert FLEETS.robot_ids(db.read(), fleet.id) == [robot.id, other.id]
    db.write(lambda c: ROBOTS.remove(c, robot.id, NOON))
    assert FLEETS.robot_ids(db.read(), fleet.id) == [other.id]


def test_an_order_of_a_fleet_belongs_to_one_start_of_all_its_robots(db, fleet, robot, row):
    """Their numbers are the fleet's; those of robots that are reached directly are their own."""
    either = db.write(lambda c: ROBOTS.add(c, replace(robot, id=0, name="Any", vehicle=ANY_VEHICLE)))
    direct = db.write(lambda c: ROBOTS.add(c, Robot("Bella", "http://10.0.0.2")))
    db.write(lambda c: EXECUTIONS.add_once(c, row(robot_id=either.id, queue_id=5)))
    claimed = {each.name: EXECUTIONS.is_claimed(db.read(), each.id, 5) for each in (robot, either, direct)}
    assert claimed == {"Aino": True, "Any": True, "Bella": False}
    assert not EXECUTIONS.is_claimed(db.read(), robot.id, 6)


@pytest.mark.parametrize(("ended", "is_claimed"), [(None, True), (NOON, True), (NOON - timedelta(seconds=1), False)])
def test_an_order_belongs_to_no_start_that_had_ended_before(db, fleet, robot, row, ended, is_claimed):
    state = State.COMPLETED if ended else State.QUEUED
    db.write(lambda c: EXECUTIONS.add_once(c, row(robot_id=robot.id, queue_id=5, ended_at=ended, state=state)))
    assert EXECUTIONS.is_claimed(db.read(), robot.id, 5, NOON) is is_claimed


def test_a_database_without_fleets_is_brought_up_to_date(path, clock):
    def fill(old):
        old.write(lambda c: c.execute("INSERT INTO robots (name, address) VALUES ('Aino', 'http://a')"))

    db = brought_up_to_date(path, clock, _FLEETS, fill)
    (robot,) = ROBOTS.all(db.read())
    assert (robot.address, robot.fleet, robot.vehicle) == ("http://a", None, "")
    assert find_problem(db.read()) is None
    db.close()


def test_a_fleet_of_an_unknown_kind_is_found_at_the_start(db, fleet):
    db.write(lambda c: c.execute("UPDATE fleets SET kind = 'other'"))
    assert find_problem(db.read()) is not None


def test_a_robot_of_a_fleet_that_was_deleted_is_found_too(db, fleet, robot):
    db.write(lambda c: FLEETS.remove(c, fleet.id, NOON))
    assert "deleted_at" in str(find_problem(db.read()))
