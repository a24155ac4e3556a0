from __future__ import annotations

import pytest

from tests.unit.sim.asking import Asker


@pytest.fixture
def aino() -> Asker:
    return Asker()


@pytest.fixture(params=["2.14.7", "3.5.4"])
def either(request: pytest.FixtureRequest) -> Asker:
    """A robot of each software generation."""
    return Asker(software=request.param)
