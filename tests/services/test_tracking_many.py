"""Many executions of one robot are followed in one request, or one by one where that can't be."""

from __future__ import annotations

import pytest

from app.domain.execution import State
from app.mir.client import RobotClient
from app.mir.errors import Unreadable
from app.services.dispatch.tracking import MANY
from tests.support.seen import requests

DUE = 300.0  # s from the beginning: 06:05
COUNT = 2 * MANY


@pytest.fixture
def asked(site, plan) -> list[str]:
    """What the robot is asked for while it has many missions in its queue."""
    for number in range(COUNT):
        plan("2026-11-23T06:05", name=f"S{number}")
    site.run(DUE + 1.0)
    return requests(site)


def test_many_are_followed_in_one_request(site, asked):
    site.run(10.0)
    assert "POST /mission_queue/search" in asked
    assert not [path for path in asked if path.startswith("GET /mission_queue/")]
    assert site.states(after=1500.0) == [State.COMPLETED] * COUNT


@pytest.mark.long
def test_one_by_one_where_the_robot_has_too_many(site, asked, monkeypatch):
    def too_many(client, floor):
        raise Unreadable(problem="more than 5000 queue items")

    monkeypatch.setattr(RobotClient, "items_after", too_many)
    assert site.states(after=1500.0) == [State.COMPLETED] * COUNT
    assert {path for path in asked if path.startswith("GET /mission_queue/")}


def test_those_that_are_not_in_the_list_are_asked_for_by_themselves(site, asked, monkeypatch):
    """Items missing from the list do not count as deleted."""
    monkeypatch.setattr(RobotClient, "items_after", lambda client, floor: [])
    site.run(10.0)
    assert len({path for path in asked if path.startswith("GET /mission_queue/")}) == COUNT
    assert site.states(after=1500.0) == [State.COMPLETED] * COUNT
