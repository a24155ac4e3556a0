from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime

import pytest

import mir_sim
from app.domain.models import Schedule
from tests.support.groups import Hall
from tests.support.site import Site


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
        c = site.container.db.read()
        robot = site.container.repositories.robots.by_name(c, "R1")
        mission = next(m for m in site.container.repositories.missions.all(c) if m.name == "Deliver")
        values = {
            "name": f"S{len(site.container.repositories.schedules.all(c)) + 1}",
            "mission_id": mission.id,
            **values,
        }
        saved = site.container.catalogue.save_schedule(
            Schedule(
                robot_id=robot.id, start=datetime.fromisoformat(start), timezone="UTC", recurrence=recurrence, **values
            )
        )
        site.kick()
        return saved

    return make


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
