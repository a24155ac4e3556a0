"""From all robots to one and back, by finger and by keys."""

from __future__ import annotations

import pytest

from app.domain.models import Group, Robot
from app.screens.home.cards import HomeWide, SendTile
from app.screens.home.fleet_page import FleetPage, NameLine, RobotCell
from app.screens.home.sending import HomeSheet
from app.screens.scheduler.hold import HoldSheet
from app.widgets.buttons import CommandButton
from app.widgets.choices import ChoiceSheet
from app.widgets.list_row import RowButton
from app.widgets.panel_grid import PanelGrid
from app.widgets.rest import DOUBLE_TAP, SETTLES
from app.window.key_focus import ARROWS, ENTER, ESCAPE
from tests.support import home_facts as sample
from tests.ui.fleet.operator import add_robots, go_back, head, open_tile, see, settle, tab_to, tiles, to_do
from tests.ui.whole_app import shown, tab_shown

pytestmark = pytest.mark.long

_UP, DOWN, _RIGHT, _LEFT = ARROWS


# ---------------------------------------------------------------------- to a robot and back
def test_a_tile_opens_its_robot_and_back_is_the_same_place(container, ui):
    add_robots(container, 90)
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        grid = ui.find(PanelGrid)
        grid.scroll_y = 0.4
        ui.advance(1)
        before, place = tiles(ui), grid.scroll_y
        assert "Aino" not in before
        open_tile(ui, before[20])
        ui.wait(lambda: ui.find_all(HomeWide) and tab_shown(ui) == before[20])
        assert not ui.find_all(FleetPage)
        settle(app, ui)
        go_back(ui)
        assert tiles(ui) == before
        assert ui.find(PanelGrid).scroll_y == pytest.approx(place)
        open_tile(ui, before[20])  # the one that is selected already
        assert ui.find_all(HomeWide)


def test_a_second_tap_on_a_tile_presses_nothing_of_what_comes_in_its_place(container, ui):
    add_robots(container, 90)
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        aino = next(robot for robot in container.catalogue.robots() if robot.name == "Aino")
        see(container, aino, sample.READY)
        open_tile(ui, "Aino")
        settle(app, ui)
        below = [tile.to_window(*tile.center) for tile in ui.find_all(SendTile)]
        go_back(ui)
        settle(app, ui)
        cells = ui.find_all(RobotCell)
        place = next(at for at in below if any(cell.collide_point(*cell.parent.to_widget(*at)) for cell in cells))
        ui.tap_at(*place)
        ui.tap_at(*place)
        assert ui.find_all(HomeWide)
        settle(app, ui)
        assert not ui.find_all(HomeSheet)
        ui.advance(0.2)
        ui.tap_at(*place)
        settle(app, ui)
        assert ui.find_all(HomeSheet)


def test_hold_in_the_scheduler_begins_with_all_robots_whichever_was_looked_at(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        open_tile(ui, "Veikko")
        settle(app, ui)
        app.shell.go("scheduler")
        settle(app, ui)
        ui.tap(ui.find(CommandButton, text="Hold"))
        ui.wait(lambda: ui.find_all(HoldSheet))
        assert ui.find(HoldSheet).robot == "All robots"


def test_an_opened_tile_selects_its_robot_although_another_was_chosen_since(container, robots, ui):
    aino, veikko = (
        next(robot.id for robot in container.catalogue.robots() if robot.name == name) for name in ("Aino", "Veikko")
    )
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(RobotCell, title="Aino"))
        container.catalogue.change_settings(selected_robot_id=veikko)
        open_tile(ui, "Aino")
        settle(app, ui)
        assert container.settings().selected_robot_id == aino
        for robot_id in (veikko, aino, veikko):
            app.shell.go("home", robot_id=robot_id)
        settle(app, ui)
        assert container.settings().selected_robot_id == veikko


def test_other_screens_lead_back_to_what_was_shown(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        app.shell.go("logs")
        app.shell.go("home")
        ui.advance(0.3)
        assert ui.find_all(FleetPage)
        app.shell.go("logs")
        app.shell.go("home", robot_id=robots[2].id)  # as an alarm does
        ui.wait(lambda: ui.find_all(HomeWide) and tab_shown(ui) == robots[2].name)
        settle(app, ui)
        app.shell.navigator.rebuild()  # gloves on
        ui.wait(lambda: ui.find_all(HomeWide))
        settle(app, ui)
        assert not ui.find_all(FleetPage)


def test_by_keys_alone(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        settle(app, ui)
        tab_to(ui, RobotCell)
        ui.key(DOWN)
        ui.key(ENTER)
        ui.wait(lambda: ui.find_all(HomeWide) and tab_shown(ui) == "Veikko")


def test_the_ring_goes_along_to_a_robot_and_back(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        settle(app, ui)
        tab_to(ui, RobotCell, title="Sisu")
        for _round in range(2):
            ui.key(ENTER)
            ui.wait(lambda: ui.find_all(HomeWide) and tab_shown(ui) == "Sisu")
            settle(app, ui)
            ui.key(ESCAPE)
            ui.wait(lambda: ui.find_all(FleetPage))
            settle(app, ui)  # and there on the tile


def test_escape_leads_back_to_all_robots_where_they_were(container, ui):
    add_robots(container, 90)
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        settle(app, ui)
        ui.key(ESCAPE)
        assert ui.find_all(FleetPage)
        ui.find(PanelGrid).scroll_y = 0.4
        ui.advance(1)
        before, place, name = tiles(ui), ui.find(PanelGrid).scroll_y, tiles(ui)[20]
        open_tile(ui, name)
        ui.wait(lambda: ui.find_all(HomeWide) and tab_shown(ui) == name)
        settle(app, ui)
        app.shell.sheets.ask("Title", "Text", "Yes", lambda: None, "Keep")
        ui.advance(2 * SETTLES)
        ui.key(ESCAPE)  # closes what is open first
        assert ui.find_all(HomeWide)
        ui.advance(DOUBLE_TAP)
        ui.key(ESCAPE)
        assert ui.find_all(FleetPage)
        assert tiles(ui) == before
        assert ui.find(PanelGrid).scroll_y == pytest.approx(place)


def test_a_name_that_is_too_long_keeps_its_end(container, ui):
    add_robots(container, 20)
    container.catalogue.save_robot(Robot("Autonomous pallet truck in hall 17", "10.40.14.1", "scheduler"), "secret")
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(RobotCell))
        (label,) = ui.find_all(NameLine, text="Autonomous pallet truck in hall 17")
        shown_name = label._label.text
        assert shown_name.startswith("Auto")
        assert shown_name.endswith("… 17")


def test_starts_that_wait_for_a_robot_are_listed_below_what_needs_a_person(container, ui, robots):
    group = container.catalogue.save_group(Group("Hall 1", tuple(robot.id for robot in robots)))
    with shown(container, ui) as app:
        settle(app, ui)
        assert head(ui) == ""
        for _n in range(2):
            container.operator.run_on_any(group.id, container.catalogue.missions()[0].id)
        ui.wait(lambda: head(ui) == "Waiting to start (2)")
        see(container, robots[3], sample.STOPPED)
        ui.wait(lambda: head(ui) == "1 needs you" and len(to_do(ui)) == 3)
        assert to_do(ui)[0] == robots[3].name


def test_a_start_is_assigned_to_a_robot_with_the_keyboard_alone(container, ui, robots):
    group = container.catalogue.save_group(Group("Hall 1", tuple(robot.id for robot in robots)))
    container.operator.run_on_any(group.id, container.catalogue.missions()[0].id)
    with shown(container, ui) as app:
        ui.wait(lambda: head(ui) == "Waiting to start (1)")
        settle(app, ui)
        tab_to(ui, RowButton, text="Give to a robot")
        ui.key(ENTER)
        settle(app, ui)
        assert {option.text for option in ui.find(ChoiceSheet).options} == {robot.name for robot in robots}


def test_robots_are_listed_as_their_numbers_follow_each_other(container, ui):
    add_robots(container, 11)
    in_order = [f"Robot {n}" for n in range(1, 12)]
    with shown(container, ui):
        ui.wait(lambda: [name for name in tiles(ui) if name.startswith("Robot ")] == in_order)
