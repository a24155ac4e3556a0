"""Home where there are six robots that are ready."""

from __future__ import annotations

import pytest

from app.domain.models import Robot
from tests.support import home_facts as sample
from tests.ui.fleet.operator import add_robots, see


@pytest.fixture
def robots(container) -> list[Robot]:
    """Six that are ready."""
    add_robots(container, 3)
    found = container.catalogue.robots()
    for robot in found:
        see(container, robot, sample.READY)
    return found


@pytest.fixture
def sent(container, monkeypatch) -> list[tuple]:
    """The commands that the robots get, in place of sending them."""
    calls: list[tuple] = []
    for name in ("answer_prompt", "reset_errors", "resume"):
        monkeypatch.setattr(type(container.operator), name, lambda _self, *what, name=name: calls.append((name, *what)))
    return calls
