"""A robot that claims more missions than any site has: none of their names is kept, and Settings says why."""

from __future__ import annotations

import gc
import json
import tracemalloc
from unittest.mock import Mock

import pytest

from app.domain.models import Robot
from app.mir import parse
from app.mir.api_v2 import MOST_MISSIONS
from app.mir.client import RobotClient
from app.mir.errors import Unreadable
from app.services.robots.missions import RobotMissions
from tests.support.clock import VirtualClock
from tests.unit.mir.answers import answered

ROBOT = Robot("Aino", "http://10.0.0.1", id=1)


def client(count: int) -> RobotClient:
    """Of a robot with this many missions."""
    return answered(200, json.dumps([{"guid": str(n), "name": f"M{n}"} for n in range(count)]).encode())


def test_as_many_as_the_limit_are_read() -> None:
    assert len(client(MOST_MISSIONS).missions()) == MOST_MISSIONS


def test_more_are_said_in_a_sentence() -> None:
    with pytest.raises(Unreadable, match="the mission list has more than 2000 entries"):
        client(MOST_MISSIONS + 1).missions()


def test_far_more_are_not_parsed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parse, "loads", lambda _body: pytest.fail("parsed"))
    with pytest.raises(Unreadable, match="1024 KiB"):
        client(100_000).missions()


def test_no_name_of_them_is_kept() -> None:
    robot = client(30_000)
    names = RobotMissions({1: ROBOT}.get, lambda _robot: robot, VirtualClock(), Mock())
    tracemalloc.start()
    assert not names.learn_names(1)
    gc.collect()
    grown, _peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert names.names(1) == {}
    assert grown < 1 << 20  # bytes


def test_names_are_not_copied_for_the_screens_that_ask_each_second() -> None:
    names = RobotMissions({1: ROBOT}.get, lambda _robot: client(3), VirtualClock(), Mock())
    assert names.learn_names(1)
    assert names.names(1) is names.names(1)
