from __future__ import annotations

import pytest

from tests.support.kpi_world import World


@pytest.fixture
def world(tmp_path):
    world = World(tmp_path)
    yield world
    world.db.close()
