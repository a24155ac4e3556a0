"""A usual duration that somebody typed, on the Scheduler: drawn as one, said in words, and warned by."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.screens.scheduler.cards import FormCard
from app.screens.scheduler.timeline import Bar, Lane
from app.widgets.display import LegendItem
from app.widgets.timeline import Timeline
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
    pick_time(screen, ui, "Time", "1640")
    view = ui.find(FormCard).view
    assert view.lasts == "Its duration on Aino is not known yet: 5 min are assumed"
    assert not any("17:00" in warning.text for warning in view.warnings)
    type_duration(container, DOCK, 45)
    settle(screen, ui)
    view = ui.find(FormCard).view
    assert view.lasts == "45 min as typed in Settings: no run was completed on Aino yet"
    assert any("17:00" in warning.text for warning in view.warnings)  # the kits of the full hour
    save(screen, ui)
    saved = named(container, DOCK, "Aino")
    bar = next(bar for lane in ui.find(Timeline).lanes for bar in lane.bars if bar.key[:2] == ("schedule", saved.id))
    assert (bar.typed, round((bar.end - bar.start) * 60)) == (True, 45)
    assert "Length typed" in [item.text for item in ui.find_all(LegendItem)]


def test_a_bar_shows_how_well_its_length_is_known(ui):
    def drawn(hours=4.0, **how) -> int:
        """Number of drawing instructions."""
        chart = ui.show(Timeline(lanes=[Lane("Aino", bars=(Bar(1, 2, 2 + hours, **how),))]), (800, 100))
        ui.advance(0.1)

        def count(group) -> int:
            return sum(1 + count(child) if hasattr(child, "children") else 1 for child in group.children)

        return count(chart.canvas)

    assert drawn(typed=True) > drawn() == drawn(assumed=True)
