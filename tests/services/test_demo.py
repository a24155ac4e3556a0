"""What --demo puts into an empty database: something happens soon on any day, and real robots are left alone."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

import main
import mir_sim
from app.container import Container
from app.database.connection import Database
from app.domain.models import Robot
from app.failures import BadInput
from app.process.demo import furnish
from app.screens.common.robot_groups import FEW
from app.services.catalogue import zones
from app.services.live.tablet_zone import TabletZone
from tests.support.clock import VirtualClock
from tests.support.examples import every_fourth
from tests.support.history import last_ended

ROBOTS = [
    (name, f"http://127.0.0.1:{8080 + number}")
    for number, name in enumerate(("Aino", "Veikko", "Sisu", "Lempi", "Onni"))
]
MISSIONS = {mission.name: mission.guid for mission in mir_sim.MISSIONS}


@pytest.fixture
def make(tmp_path):
    opened = []

    def container(now: datetime) -> Container:
        clock = VirtualClock(now)
        opened.append(Container(Database.open(tmp_path / "amr-scheduler.db", clock=clock, durable=False), clock))
        return opened[-1]

    yield container
    for one in opened:
        one.close()


@pytest.mark.parametrize("day", every_fourth(range(23, 30)))
def test_a_mission_starts_within_two_minutes_whatever_day_it_is(make, day):
    now = datetime(2026, 11, day, 3, 7, 20, tzinfo=UTC)
    container = make(now)
    furnish(container, ROBOTS, MISSIONS)
    assert container.plan.between(now, now + timedelta(minutes=2)).runs
    assert last_ended(container, 1)
    day = container.plan.between(now, now + timedelta(hours=18)).runs
    assert {run.schedule.name for run in day} >= {"Deliver kits to line 2 on Hall 1", "Collect empties on Veikko"}


def test_it_has_enough_robots_for_the_page_of_all_robots():
    with main._fleet() as (robots, missions):
        assert ([name for name, _url in robots], missions) == ([name for name, _url in ROBOTS], MISSIONS)
        assert len(robots) > FEW


def test_it_asks_for_no_time_zone(make):
    container = make(datetime(2026, 11, 23, 3, 7, 20, tzinfo=UTC))
    container.catalogue.edit(
        lambda edit: zones.take_known_zones(edit, lambda: TabletZone("Etc/UTC", "/etc/localtime", False))
    )
    furnish(container, ROBOTS, MISSIONS)
    assert container.alarms.open() == []


@pytest.mark.parametrize("day", every_fourth(range(23, 30)))
def test_there_is_something_to_suggest(make, day):
    container = make(datetime(2026, 11, day, 3, 7, 20, tzinfo=UTC))
    furnish(container, ROBOTS, MISSIONS)
    [suggestion] = container.suggestions.compute().suggestions
    assert (suggestion.schedule.name, suggestion.finding.cause) == ("Move coils to press on Veikko", "busy")
    assert suggestion.changes


def test_a_second_demo_on_the_same_directory_brings_the_addresses_up_to_date(make):
    container = make(datetime(2026, 11, 23, 3, 7, tzinfo=UTC))
    furnish(container, ROBOTS, MISSIONS)
    furnish(container, [(name, url.replace(":80", ":90")) for name, url in ROBOTS], MISSIONS)
    assert {robot.address for robot in container.repositories.robots.all(container.db.read())} == {
        f"http://127.0.0.1:{port}" for port in range(9080, 9085)
    }


def test_a_robot_of_a_demo_that_was_renamed_is_found_again(make):
    container = make(datetime(2026, 11, 23, 3, 7, tzinfo=UTC))
    furnish(container, ROBOTS, MISSIONS)
    veikko = next(robot for robot in container.catalogue.robots() if robot.name == "Veikko")
    container.catalogue.save_robot(replace(veikko, name="Ville"))
    furnish(container, [(name, url.replace(":80", ":90")) for name, url in ROBOTS], MISSIONS)
    assert {robot.name: robot.address[-4:] for robot in container.catalogue.robots()} == {
        "Aino": "9080",
        "Ville": "9081",
        "Sisu": "9082",
        "Lempi": "9083",
        "Onni": "9084",
    }


def test_real_robots_are_not_taken_for_a_demo_s(make):
    container = make(datetime(2026, 11, 23, 3, 7, tzinfo=UTC))
    container.catalogue.save_robot(Robot("Aino", "http://10.0.0.5", "u"), password="p")
    with pytest.raises(BadInput, match="its robots are real"):
        furnish(container, ROBOTS, MISSIONS)
    assert [robot.address for robot in container.repositories.robots.all(container.db.read())] == ["http://10.0.0.5"]
