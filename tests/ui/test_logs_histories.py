"""The Logs of special histories: an empty one, and one that grows."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from app.container import Container
from app.screens.logs.view import Period
from app.services.executions import transitions
from app.widgets.figure_charts import FigureCard
from tests.support import month
from tests.ui.logbook import opened, runs_of, settle

pytestmark = pytest.mark.long


@pytest.fixture
def nothing(tmp_path) -> Iterator[Container]:
    """A plant without robots and history."""
    container = month.plant(tmp_path, furnished=False)
    yield container
    container.close()


def test_an_empty_history_says_so(nothing, ui):
    with opened(nothing, ui) as app:
        app.logs.set_filters(period=Period.ALL)
        settle(app, ui)
        assert "Nothing has run yet" in ui.texts()


def test_without_history_every_figure_is_a_dash(nothing, ui):
    with opened(nothing, ui, "figures"):
        assert [card.item.value for card in ui.find_all(FigureCard)] == ["–"] * 5
        assert {"Why runs failed", "–"} <= set(ui.texts())


def test_a_run_that_ends_shows_at_once(container, ui):
    with opened(container, ui) as screen:
        running = max(container.history.open(), key=lambda run: run.planned_at)
        container.ledger.apply([transitions.complete(running, container.clock.now(), 240.0, 2.0)])
        settle(screen, ui)
        ended = next(item for item in runs_of(screen) if item.key == running.id)
        assert (ended.tone, ended.meta) == ("done", "4 min")
