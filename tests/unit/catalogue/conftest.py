from __future__ import annotations

import pytest

from tests.unit.catalogue import configured
from tests.unit.catalogue.world import World


@pytest.fixture
def world(tmp_path):
    world = World(tmp_path)
    yield world
    world.db.close()


@pytest.fixture
def tablet(tmp_path):
    """One that takes configurations."""
    tablet = configured.World(tmp_path)
    yield tablet
    tablet.db.close()
