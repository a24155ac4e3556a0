"""What commands mean by a name."""

from __future__ import annotations

import pytest

from app.container import Container
from app.domain.models import Fleet, Mission, Robot
from app.failures import BadInput
from app.process.requests import find_checked, find_mission
from tests.support.clock import VirtualClock


@pytest.fixture
def container(tmp_path):
    container = Container.open(tmp_path, VirtualClock())
    yield container
    container.close()


def test_a_fleet_is_checked_up_though_its_any_robot_has_the_same_name(container):
    """As in the example of docs/interfaces.md."""
    fleet = container.catalogue.save_fleet(Fleet("Hall 2", "10.0.0.50", username="user"), password="secret")
    container.catalogue.save_robot(Robot("Hall 2", "", vehicle="any").within(fleet))
    assert find_checked(container.db.read(), "Hall 2") == fleet


def test_a_mission_of_another_robot_alone_is_not_said_to_be_known(container):
    robots = [container.catalogue.save_robot(Robot(name, name, "user"), password="p") for name in ("R1", "R2")]
    container.catalogue.save_mission(Mission("Home", "g-1"))
    container.catalogue.save_mission(Mission("Long", "g-2", robot_id=robots[1].id))
    with pytest.raises(BadInput, match=r"no mission 'Long' for R1; known: Home$"):
        find_mission(container, "Long", robots[0])
