"""The Logs of special histories: an empty one, and one that grows."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from app.container import Container
from app.services.executions import transitions
from app.widgets.buttons import Segment
from app.widgets.figures import FigureCard
from app.widgets.rows import LogRow
from tests.support import month
from tests.ui.logbook import opened, settle, tap

pytestmark = pytest.mark.long


@pytest.fixture
def nothing(tmp_path) -> Iterator[Container]:
    """A plant without robots and history."""
    container = month.plant(tmp_path, furnished=False)
    yield container
    container.close()


def test_an_empty_history_teaches(nothing, ui):
    with opened(nothing, ui) as app:
        tap(app, ui, ui.find(Segment, text="All"))
        assert "Nothing has run yet" in ui.texts()
        assert [card.value for card in ui.find_all(FigureCard)] == ["–"] * 5


def test_without_history_the_figures_say_so(nothing, ui):
    with opened(nothing, ui, "Figures"):
        assert {
            "No run failed.",
            "Nothing was planned",
            "No planned run has started",
            "No mission was completed.",
        } <= set(ui.texts())


def test_without_robots_their_page_says_so(nothing, ui):
    with opened(nothing, ui, "Robots"):
        assert "There is no robot yet." in ui.texts()


def test_a_run_that_ends_shows_at_once(container, ui):
    with opened(container, ui) as screen:
        running = max(container.history.open(), key=lambda run: run.planned_at)
        container.ledger.apply([transitions.complete(running, container.clock.now(), 240.0, 2.0)])
        settle(screen, ui)
        newest = max(ui.find_all(LogRow), key=lambda row: row.to_window(0, row.y)[1])
        assert (newest.outcome, newest.took) == ("Completed", "4 min")
