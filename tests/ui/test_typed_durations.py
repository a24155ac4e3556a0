"""A usual duration that somebody typed, on the Scheduler: drawn as one, said in words, and warned by."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.widgets.lanes import Lanes
from tests.ui.planner import choose, named, opened, pick_time, save, settle

pytestmark = pytest.mark.long

DOCK = "Bring pallet to dock"  # Aino has never brought one


@pytest.fixture
def screen(container, ui, silent_robots):
    with opened(container, ui) as app:
        yield app


def type_duration(container, mission: str, minutes: int) -> None:
    found = next(one for one in container.repositories.missions.all(container.db.read()) if one.name == mission)
    container.catalogue.save_mission(replace(found, usual_minutes=minutes))


def test_a_typed_duration_is_said_drawn_and_warned_by(screen, container, ui):
    choose(screen, ui, "Mission", DOCK)
    choose(screen, ui, "Robot", "Aino")
    pick_time(screen, ui, "Time", 16, 40)
    assert not any("17:00" in note.text for note in screen.plan.form.view.notes)
    type_duration(container, DOCK, 45)
    settle(screen, ui)
    assert any("17:00" in note.text for note in screen.plan.form.view.notes)  # the kits of the full hour
    save(screen, ui)
    saved = named(container, DOCK, "Aino")
    bar = next(bar for lane in ui.find(Lanes).lanes for bar in lane.bars if bar.key[:2] == ("schedule", saved.id))
    assert round((bar.end - bar.start) * 60) == 45
