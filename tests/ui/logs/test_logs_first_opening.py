"""The first opening of the Logs: the figures come later than the list, which stays where it is."""

from __future__ import annotations

import threading

import pytest
from kivy.core.window import Window

from app.screens.logs.cards import RunsList
from app.screens.logs.view import Period
from app.widgets.figures import FigureCard
from tests.ui.logbook import settle
from tests.ui.whole_app import shown

pytestmark = pytest.mark.long

SIZES = ((1280, 800), (800, 1280), (1024, 600))


def place(ui) -> float:
    return round(ui.find(RunsList).to_window(0, ui.find(RunsList).top)[1])


@pytest.mark.parametrize("size", SIZES)
def test_the_list_stays_where_it_is_when_the_figures_come_or_have_fewer_lines(container, ui, monkeypatch, size):
    facts, may_read, before = container.kpis.facts, threading.Event(), Window.size
    monkeypatch.setattr(container.kpis, "facts", lambda *args: may_read.wait(60) and facts(*args))
    Window.size = size
    try:
        with shown(container, ui, "logs") as app:
            logs = app.shell.navigator.screen("logs").vm
            ui.wait(lambda: logs.rows)
            ui.advance(0.1)
            top = place(ui)
            assert [card.value for card in ui.find_all(FigureCard)] == ["–"] * 5
            may_read.set()
            settle(app, ui)
            assert "–" not in [card.value for card in ui.find_all(FigureCard)]
            assert place(ui) == top
            for period in (Period.ALL, Period.TODAY, Period.WEEK):
                logs.choose_period(period)
                settle(app, ui)
                assert place(ui) <= top  # fewer lines give no room back
    finally:
        may_read.set()
        Window.size = before
