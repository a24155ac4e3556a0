"""The wall view: what a page that is left alone on a wall shows, read from far away."""

from __future__ import annotations

import pytest

from app.screens.home.fleet_page import FleetPage, RobotCell
from app.screens.home.wall import WallRow, WallView
from app.window.key_focus import ESCAPE
from tests.support import fleet_facts
from tests.support import home_facts as sample
from tests.ui.fleet.operator import (
    head,
    see,
    settle,
)
from tests.ui.looks import labels
from tests.ui.whole_app import shown


def leave_alone(app, ui, seconds: float = 121) -> None:
    app.shell.navigator.screen("home").vm.fleet.wall.is_kiosk = True
    ui.skip(seconds)
    ui.skip(1)


def test_a_wall_that_is_left_alone_is_read_from_far_away(container, robots, ui):
    with shown(container, ui) as app:
        for robot, status in zip(
            robots[1:], (sample.STOPPED, sample.FAILED, sample.ASKING, fleet_facts.PAUSED), strict=False
        ):
            see(container, robot, status)
        ui.wait(lambda: head(ui) == "4 need you")
        leave_alone(app, ui)
        for robot, status in zip(
            robots[1:], (sample.STOPPED, sample.FAILED, sample.ASKING, fleet_facts.PAUSED), strict=False
        ):
            see(container, robot, status)  # they still answer
        ui.wait(lambda: ui.find_all(WallView))
        ui.wait(lambda: len(ui.find_all(WallRow)) == 3)
        assert {"4 need you", "1 more", robots[1].name} <= set(ui.texts(ui.find(WallView)))
        large = {round(label.font_size) for label in labels(ui.find(WallView))}
        assert large == {72, 40, 32}


@pytest.mark.parametrize("by_key", [False, True], ids=["touch", "key"])
def test_what_leaves_the_wall_view_does_nothing_else(container, robots, ui, by_key):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        settle(app, ui)
        cell = ui.find(RobotCell, title="Aino")
        place = cell.to_window(*cell.center)
        leave_alone(app, ui)
        assert ui.find_all(WallView)
        if by_key:
            ui.key(ESCAPE)
        else:
            ui.tap_twice(place, 0.3)
        ui.advance(0.3)
        assert not ui.find_all(WallView)
        assert ui.find_all(FleetPage)
        ui.advance(1)
        ui.tap_at(*place)
        assert not ui.find_all(FleetPage)


def test_the_wall_view_comes_only_over_a_page_of_a_wall_with_nothing_open(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        settle(app, ui)
        ui.skip(300)
        ui.skip(1)
        assert not ui.find_all(WallView)  # a window on a desk
        app.shell.sheets.ask("Title", "Text", "Yes", lambda: None)
        leave_alone(app, ui)
        assert not ui.find_all(WallView)
        app.shell.sheets.close(app.shell.sheets.top)
        ui.skip(1)
        assert ui.find_all(WallView)
        app.shell.go("logs")
        leave_alone(app, ui)
        assert not ui.find_all(WallView)
