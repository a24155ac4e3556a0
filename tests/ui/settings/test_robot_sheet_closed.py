"""The robot dialog that is closed before the robot has answered."""

from __future__ import annotations

import threading

import pytest

from app.screens.settings.robot_sheet import RobotSheet
from app.screens.settings.trust import TrustSheet
from app.widgets.buttons import IconButton
from tests.ui.integrator import add, enter, entry, fill_in, go, item_of, open_row, press, robots, titles, undo
from tests.ui.whole_app import PASSWORD, USER

pytestmark = pytest.mark.long

SLOW = {"kind": "late", "count": None, "seconds": 2.0}


@pytest.fixture
def slow(site):
    site.fleet.robots[0].control({"fault": SLOW})
    yield
    site.fleet.robots[0].control({"fault": None})


def test_cancelling_during_the_connection_test_adds_no_robot(site, app, ui, slow):
    go(ui, "robots")
    add(ui, "Add robot")
    dialog = fill_in(ui, name="Aino", address=site.fleet.robots[0].url, username=USER, password=PASSWORD)
    press(ui, "Save", dialog)
    assert dialog.second_busy
    ui.tap(ui.find(IconButton, dialog, icon="close"))
    ui.wait(lambda: app.shell.background.idle)
    assert robots(site) == []
    assert app.shell.snackbars.texts == []


def test_a_sheet_that_comes_back_after_the_answer_can_be_saved(site, app, ui, monkeypatch):
    operator, may_answer = site.container.operator, threading.Event()
    test = operator.test_connection
    monkeypatch.setattr(
        operator, "test_connection", lambda *args, **named: may_answer.wait(20) and test(*args, **named)
    )
    go(ui, "robots")
    add(ui, "Add robot")
    dialog = fill_in(ui, name="Aino", address=site.fleet.robots[0].url, username=USER, password=PASSWORD)
    press(ui, "Save", dialog)
    ui.tap(ui.find(IconButton, dialog, icon="close"))
    may_answer.set()
    ui.wait(lambda: app.shell.background.idle)
    undo(ui)
    ui.wait(lambda: ui.find_all(RobotSheet))
    assert (dialog.second_busy, dialog.saving, dialog.outcome.text) == (False, False, "")
    ui.advance(0.5)  # until it takes touches
    press(ui, "Save", dialog)
    ui.wait(lambda: [robot.name for robot in robots(site)] == ["Aino"])


def test_nothing_is_asked_of_a_robot_whose_dialog_is_closed(site, app, ui):
    """The machine that answers is another one."""
    site.add_robots()
    veikko = site.fleet.robots[1]
    go(ui, "robots")
    ui.wait(lambda: len(titles(ui)) == 2 and all(item_of(ui, name).icon == "wifi" for name in titles(ui)))
    site.container.catalogue.remove_robot(robots(site)[1].id)
    ui.wait(lambda: len(titles(ui)) == 1)
    dialog = open_row(ui, "Aino")
    enter(ui, entry(dialog, "address"), veikko.url)
    enter(ui, entry(dialog, "password"), PASSWORD)
    veikko.control({"fault": SLOW})
    press(ui, "Test connection", dialog)
    assert dialog.second_busy
    ui.tap(ui.find(IconButton, dialog, icon="close"))
    ui.wait(lambda: app.shell.background.idle)
    veikko.control({"fault": None})
    assert ui.find_all(TrustSheet) == []
