"""The Logs while they are being read: what arrives late takes nothing back that was loaded or chosen since."""

from __future__ import annotations

import threading

import pytest

from app.database.execution_history import ExecutionFilter
from app.screens.logs import screen as screen_module
from app.screens.logs.cards import RunsList
from app.screens.logs.view import Period
from tests.ui.logbook import failures, reset_logs, runs_of, settle

pytestmark = pytest.mark.long


@pytest.fixture
def screen(logs, ui):
    reset_logs(logs, ui)
    return logs


def held_back(monkeypatch, name: str):
    """The next reading of ``name`` in the screen's module ends when the first returned event is set, with the facts
    from its begin; the second event is set then."""
    real, go_on, begun = getattr(screen_module, name), threading.Event(), threading.Event()

    def late(*args):
        found = real(*args)
        if not begun.is_set():
            begun.set()
            assert go_on.wait(30)
        return found

    monkeypatch.setattr(screen_module, name, late)
    return go_on, begun


def test_rows_that_were_loaded_stay_when_a_reading_from_before_arrives(screen, ui, monkeypatch):
    screen.logs.set_filters(period=Period.ALL)
    settle(screen, ui)
    go_on, begun = held_back(monkeypatch, "read_facts")
    screen.logs._refresher.read()  # as after any change
    ui.wait(begun.is_set)
    ui.find(RunsList).scroll_y = 0
    ui.wait(lambda: len(runs_of(screen)) == 200)
    seen = []
    screen.logs.fbind("rows", lambda *_: seen.append(len(runs_of(screen))))
    go_on.set()
    settle(screen, ui)
    assert len(runs_of(screen)) == 200
    assert {*seen, 200} == {200}


@pytest.mark.usefixtures("put_back")
def test_no_row_is_missing_where_a_run_has_begun_while_more_were_loaded(screen, container, ui, monkeypatch):
    screen.logs.set_filters(period=Period.ALL)
    settle(screen, ui)
    go_on, begun = held_back(monkeypatch, "read_next_page")
    ui.find(RunsList).scroll_y = 0
    ui.wait(begun.is_set)
    mission, robot = container.catalogue.missions()[0], container.catalogue.robots()[0]
    new = container.operator.run_now(robot.id, mission.id, {})
    ui.wait(lambda: runs_of(screen)[0].key == new.id)
    go_on.set()
    settle(screen, ui)
    shown = [item.key for item in runs_of(screen)]
    assert len(shown) == 200
    assert shown == [row.id for row in container.history.page(ExecutionFilter(), size=200).rows]


@pytest.mark.parametrize(
    "then",
    [
        lambda screen, ui: screen.logs.set_filters(period=Period.TODAY),
        lambda screen, ui: screen.shell.go("home"),
        lambda screen, ui: screen.logs.choose_part("activity"),
        lambda screen, ui: screen.logs.search("Aino"),
    ],
    ids=["filter", "screen", "part", "search"],
)
def test_a_late_story_does_not_undo_a_newer_choice(screen, container, ui, monkeypatch, then):
    old = container.history.page(failures(container)).rows[-1]
    get, go_on = container.ledger.get, threading.Event()
    monkeypatch.setattr(container.ledger, "get", lambda number: go_on.wait(30) and get(number))
    screen.shell.go("logs", execution_id=old.id)
    then(screen, ui)
    logs = screen.logs
    chosen = logs.part, logs.query, logs.period
    go_on.set()
    ui.wait(lambda: screen.shell.background.idle)  # before what is typed is searched for
    settle(screen, ui)
    assert (logs.part, logs.query, logs.period) == chosen
    assert logs.story.run is None
    screen.shell.go("logs", unfiltered=True)
    settle(screen, ui)
