"""What the page of all robots asks the database for, and how often."""

from __future__ import annotations

from types import SimpleNamespace

from app.screens.home import fleet_known
from tests.support.clock import VirtualClock


def test_when_a_robot_stopped_is_looked_for_once_though_nothing_is_stored(monkeypatch):
    asked = []
    services = SimpleNamespace(
        robot_states=SimpleNamespace(timelines=lambda _since, _until, robots: asked.extend(robots) or []),
        alarms=SimpleNamespace(open=list),
        clock=VirtualClock(),
    )
    monkeypatch.setattr(
        fleet_known,
        "Refresher",
        lambda _shell, reading, take, _failed: SimpleNamespace(request=lambda: take(reading()())),
    )
    known = fleet_known.Known(services, None, lambda: None)
    assert [known.since(robot) for robot in (1, 2, 1, 2)] == [None] * 4
    assert asked == [1, 2]
    known.ask_again()
    assert asked == [1, 2, 1, 2]
