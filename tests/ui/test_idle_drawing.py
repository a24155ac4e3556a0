"""Hardly anything is drawn while nothing happens: without a graphics card a frame takes 30 ms of the processor."""

from __future__ import annotations

import pytest

from app.domain.models import Connection
from app.services.executions import transitions
from tests.support.home_facts import READY
from tests.ui.fleet.operator import add_robots
from tests.ui.wear import SECTIONS
from tests.ui.whole_app import shown

pytestmark = pytest.mark.long

SECONDS = 10
AT_MOST = 1  # frames in SECONDS: the line of the timeline that says what time it is
PLACES = [("home", {}), ("scheduler", {}), ("logs", {}), *[("settings", {"section": section}) for section in SECTIONS]]


def robots_answer(container) -> None:
    """All are ready, and have been read just now."""
    now = container.clock.now()
    for robot in container.catalogue.robots():
        container.snapshots.update(
            robot.id, connection=Connection.CONNECTED, status=READY, read_at=now, queue=(), queue_read_at=now
        )


@pytest.mark.parametrize("place", PLACES, ids=lambda place: "-".join([place[0], *place[1].values()]))
def test_at_rest_next_to_nothing_is_drawn(container, silent_robots, ui, place):
    """The robots are read every two seconds, and answer the same each time."""
    at_rest(container, ui, *place)


def test_neither_is_it_of_fifty_robots(container, silent_robots, ui):
    add_robots(container, 47)
    at_rest(container, ui, "home", {})


def at_rest(container, ui, name: str, intent: dict[str, str]) -> None:
    now = container.clock.now()
    container.ledger.apply([transitions.complete(run, now, 240.0, 2.0) for run in container.history.open()])
    robots_answer(container)
    container.clock.advance(5)  # words like "in 22 min" change after a full minute
    with shown(container, ui) as app:
        app.shell.go(name, **intent)
        for _second in range(5):  # until all has been read and made
            ui.wait(lambda: app.shell.background.idle)
            ui.advance(1)
        drawn = 0
        for second in range(SECONDS):
            container.clock.advance(1)
            if second % 2:
                robots_answer(container)
            drawn += ui.frames_drawn(1)
            ui.wait(lambda: app.shell.background.idle)
    assert drawn <= AT_MOST
