"""Clients of configured robots."""

from dataclasses import replace

import pytest

from app.container import Connector
from app.domain.check_up import Rest, RobotProfile
from app.domain.models import Fleet, FleetKind, Robot
from app.mir.credentials import Token


def test_all_clients_of_a_robot_share_its_request_rate():
    make, robot = Connector(), Robot("R1", "http://r1")
    worker = make(robot)
    checked_up = replace(robot, profile=RobotProfile(None, None, rest=Rest(8, 10.0)))
    worker.use_profile(checked_up.known)
    assert make(checked_up).pace is worker.pace
    assert make(replace(robot, address="http://r2")).pace is not worker.pace


def test_clients_of_a_fleet_share_what_it_says_of_its_robots():
    make, fleet = Connector(), Fleet("Hall", "http://hall")
    first, second = (make(Robot("", "", vehicle=vehicle).within(fleet)) for vehicle in ("1", "2"))
    assert first._connection is second._connection
    other = replace(fleet, token=Token.derive("other", "secret").header)
    assert make(Robot("", "", vehicle="1").within(other))._connection is not first._connection


@pytest.mark.parametrize("kind", FleetKind)
def test_a_client_that_asks_a_fleet_who_it_is_leaves_the_request_rate_of_its_robots(kind: FleetKind):
    rest = Rest(8, 10.0)
    fleet = Fleet("Hall", "http://hall", kind=kind, profile=RobotProfile(None, None, rest=rest))
    make = Connector()
    worker, _unchecked = (
        make(Robot("", "", vehicle="1").within(each)) for each in (fleet, replace(fleet, profile=None))
    )
    assert worker.pace.rest == rest
