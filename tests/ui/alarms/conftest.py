"""A new tablet without any alarm, and a loudspeaker that counts."""

from __future__ import annotations

import pytest

from app.widgets.frame import Banner, TopBar
from tests.support import month
from tests.support.stored import Stored
from tests.ui.whole_app import restart, shown


class Recorder:
    """A loudspeaker that counts."""

    exists = True

    def __init__(self) -> None:
        self.played = 0

    def play(self) -> None:
        self.played += 1


@pytest.fixture(scope="module")
def ui(shared_ui):
    return shared_ui


@pytest.fixture(scope="module")
def container(tmp_path_factory):
    """The container of a new tablet, on which nothing runs."""
    container = month.plant(tmp_path_factory.mktemp("data"), furnished=False)
    yield container
    container.close()


@pytest.fixture(scope="module")
def shared_app(container, ui):
    with shown(container, ui, loudspeaker=Recorder()) as app:
        app.stored = Stored(container)
        yield app


@pytest.fixture
def app(shared_app, container, ui):
    """Without any alarm, now or in the past."""

    def put_back() -> None:
        container.alarms.database_works()
        container.clock.step((month.NOW - container.clock.now()).total_seconds())
        shared_app.stored.put_back()
        ui.skip(1e3)  # what rests after a press takes presses again, however long a test lets it rest

    restart(shared_app, ui, put_back)
    assert not ui.find_all(Banner)
    assert ui.find(TopBar).bell_count == ""
    return shared_app


@pytest.fixture
def alarms(app, container):
    return container.alarms
