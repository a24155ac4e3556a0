from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from datetime import datetime
from typing import Any

import pytest

import mir_sim
from app.container import Container
from app.database.connection import Database
from app.domain.models import Mission, Schedule
from tests.support.clock import VirtualClock
from tests.support.groups import Hall
from tests.support.site import GUIDS, Site


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock()


@pytest.fixture
def container(tmp_path, clock) -> Iterator[Container]:
    """The app on that clock, without robots and without threads of its own but the database's."""
    container = Container(Database.open(tmp_path / "amr-scheduler.db", clock=clock, durable=False), clock)
    yield container
    container.close()


@pytest.fixture
def site(tmp_path) -> Iterator[Site]:
    """One robot R1, the mission Deliver, Monday 06:00 UTC, working days Monday to Friday."""
    site = Site(tmp_path)
    site.add_robots()
    site.add_mission("Deliver")
    yield site
    site.switch_off()


@pytest.fixture
def plan(site):
    """Make a schedule of Deliver on R1; ``start`` is text like "2026-11-23T06:05"."""

    def make(start: str, recurrence: str | None = None, **values) -> Schedule:
        named = {"name": f"S{len(site.container.catalogue.schedules()) + 1}", "robot_id": 1, "mission_id": 1, **values}
        at = datetime.fromisoformat(start)
        saved = site.container.catalogue.save_schedule(
            Schedule(start=at, timezone="UTC", recurrence=recurrence, **named)
        )
        site.kick()
        return saved

    return make


@pytest.fixture
def go_to_position(site) -> Mission:
    """A mission that asks for a position."""
    return site.container.catalogue.save_mission(Mission("Go to position", GUIDS["Go to position"]))


@pytest.fixture
def fleet() -> Iterator[mir_sim.Fleet]:
    """One robot that answers at an address, for commands in processes of their own."""
    with mir_sim.serve(robots=1) as fleet:
        yield fleet


@pytest.fixture
def hall(tmp_path) -> Iterator[Hall]:
    """Three robots of one group."""
    hall = Hall(tmp_path)
    yield hall
    hall.switch_off()


@pytest.fixture
def enterprise(tmp_path) -> Iterator[Callable[..., tuple[Any, ...]]]:
    """Make the site of a Fleet Enterprise with these knobs, and the mission Deliver; returns it and its robots."""
    with ExitStack() as made:

        def make(robots: int = 1, **knobs: Any) -> tuple[Any, ...]:
            site = Site(tmp_path, target="enterprise", robots=robots)
            made.callback(site.switch_off)
            site.fleet.knobs = replace(site.fleet.knobs, **knobs)
            found = site.add_robots()
            site.add_mission()
            site.run(10)
            return site, *found

        yield make
