from __future__ import annotations

import pytest

from app.services.check_up import load_probes
from tests.support.check_up_site import CheckedRobot


@pytest.fixture
def quick_reading(monkeypatch) -> None:
    """Reading a robot takes fewer questions, for tests of what is tried afterwards."""
    monkeypatch.setattr(load_probes, "QUESTIONS", 5)
    monkeypatch.setattr(load_probes, "LOAD_S", 1.0)


@pytest.fixture
def robot(tmp_path) -> CheckedRobot:
    return CheckedRobot(tmp_path)
