from __future__ import annotations

import pytest

from tests.unit.sim.fleets.classic import FleetAsker
from tests.unit.sim.fleets.enterprise_asking import EnterpriseAsker


@pytest.fixture
def fleet() -> FleetAsker:
    return FleetAsker()


@pytest.fixture
def client() -> EnterpriseAsker:
    return EnterpriseAsker()
