"""One app for all tests of a file about the Scheduler."""
from __future__ import annotations

import pytest

from tests.support import month
from tests.support.stored import Stored
from tests.ui.planner import opened, show_anew


@pytest.fixture(scope="module")
def ui(shared_ui):
    return shared_ui


@pytest.fixture(scope="module")
def container(shared_container):
    return shared_container


@pytest.fixture(scope="module")
def scheduler(container, ui, silent_robots):
    with opened(container, ui) as app:
        yield app


@pytest.fixture(scope="module")
def stored(container):
    return Stored(container)


@pytest.fixture
def screen(scheduler, container, stored, ui):
    """With the plan and the time as they were before the first test, an empty form and nothing open above it."""
    container.clock.step((month.NOW - container.clock.now()).total_seconds())
    stored.put_back()
    show_anew(scheduler, ui)
    return scheduler
