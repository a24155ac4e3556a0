from __future__ import annotations

import pytest

from mir_sim.definition import SOFTWARE
from tests.unit.sim.asking import Asker


@pytest.fixture
def aino() -> Asker:
    return Asker()


@pytest.fixture(params=SOFTWARE)
def either(request: pytest.FixtureRequest) -> Asker:
    """A robot of each software version."""
    return Asker(software=request.param)
