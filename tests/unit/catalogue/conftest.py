from __future__ import annotations

import pytest

from app.domain.models import Mission, Robot
from tests.unit.catalogue import configured
from tests.unit.catalogue.world import World


@pytest.fixture
def world(tmp_path):
    world = World(tmp_path)
    yield world
    world.db.close()


@pytest.fixture
def bella(world):
    """A second robot."""
    return world.catalogue.save_robot(Robot("Bella", "10.0.0.2", "user"), password="x")


@pytest.fixture
def home(world):
    """A second mission."""
    return world.catalogue.save_mission(Mission("Home", "guid-2"))


@pytest.fixture
def tablet(tmp_path):
    """One that takes configurations."""
    tablet = configured.World(tmp_path)
    yield tablet
    tablet.db.close()
