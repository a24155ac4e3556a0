"""One app for all tests of a file about the Scheduler."""

from __future__ import annotations

import threading

import pytest

from app.domain.models import InvalidInput
from app.screens.common.mission_names import NOTHING_KNOWN
from tests.support import month
from tests.support.stored import Stored
from tests.ui.planner import opened, rebuild_scheduler


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
    """With the plan and the time from before the first test, an empty form and no dialog."""
    container.clock.step((month.NOW - container.clock.now()).total_seconds())
    stored.put_back()
    rebuild_scheduler(scheduler, ui)
    return scheduler


@pytest.fixture
def slow(container, monkeypatch):
    """Writing waits for this event."""
    go = threading.Event()

    def late(write):
        return lambda *schedules: go.wait(30) and write(*schedules)

    for name in ("save_schedule", "change"):
        monkeypatch.setattr(container.catalogue, name, late(getattr(container.catalogue, name)))
    yield go
    go.set()


@pytest.fixture
def refused(container, monkeypatch):
    """Writing is refused, once this event is set."""
    go = threading.Event()

    def refuse(*_schedules):
        go.wait(30)
        raise InvalidInput("name", "Choose another name")

    for name in ("save_schedule", "change"):
        monkeypatch.setattr(container.catalogue, name, refuse)
    yield go
    go.set()


@pytest.fixture
def hanging(screen, container, monkeypatch):
    """The robot answers nothing about missions until this event is set, and nothing is known about them."""
    answers = threading.Event()
    monkeypatch.setattr(screen.shell.mission_names, "known", NOTHING_KNOWN)
    monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: answers.wait(30) and ())
    yield answers
    answers.set()
