"""More robots than fit on a page."""

from __future__ import annotations

from app.domain.models import Group
from app.screens.home.fleet_page import FleetGrid, FleetHead, RobotCell
from tests.support import home_facts as sample
from tests.ui.fleet.operator import (
    add_robots,
    counted,
    head,
    open_tile,
    row_of,
    see,
    settle,
    tiles,
)
from tests.ui.whole_app import shown, tab_shown


def test_above_fifty_six_robots_one_group_is_open(container, ui):
    robots = add_robots(container, 60)
    for n in range(3):
        container.catalogue.save_group(
            Group(f"Hall {n + 1}", tuple(robot.id for robot in robots[n * 20 : n * 20 + 20]))
        )
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetHead))
        settle(app, ui)
        names = [row.item.name for row in sorted(ui.find_all(FleetHead), key=lambda row: -row.to_window(*row.pos)[1])]
        assert names == ["Hall 1", "Hall 2", "Hall 3", "Others"]
        assert tiles(ui)[0] == "Robot 1"
        ui.tap(ui.find(FleetHead, name="Others"))
        ui.advance(0.5)
        assert tiles(ui) == ["Aino", "Sisu", "Veikko"]
        see(container, robots[25], sample.STOPPED)
        ui.wait(lambda: head(ui) == "1 needs you")
        assert row_of(ui, robots[25].name).item.aside.endswith("Hall 2")
        assert [part.text for part in ui.find(FleetHead, name="Hall 2").item.bad] == ["1"]
        assert tiles(ui) == ["Aino", "Sisu", "Veikko"]  # what is open stays open
        open_tile(ui, "Sisu")
        ui.wait(lambda: tab_shown(ui) == "Sisu")


def test_the_open_group_is_first_that_of_the_worst_robot(container, ui):
    robots = add_robots(container, 60)
    for n in range(3):
        container.catalogue.save_group(
            Group(f"Hall {n + 1}", tuple(robot.id for robot in robots[n * 20 : n * 20 + 20]))
        )
    see(container, robots[25], sample.STOPPED)
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(FleetHead, is_open=True))
        assert ui.find(FleetHead, is_open=True).item.name == "Hall 2"


def test_above_fifty_six_robots_without_groups_the_cells_scroll(container, ui):
    add_robots(container, 60)
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(RobotCell))
        assert not ui.find_all(FleetHead)
        assert ui.find(FleetGrid).do_scroll_y


def test_while_the_cells_move_one_a_frame_becomes_another(container, ui):
    robots = add_robots(container, 150)
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(RobotCell))
        grid = ui.find(FleetGrid)
        for robot in container.catalogue.robots():
            see(container, robot, sample.READY if robot.id != robots[0].id else sample.STOPPED)
        ui.wait(lambda: counted(ui) == ["152 ready"])
        grid.scroll_y = 0.9
        for robot in robots[1:11]:
            see(container, robot, sample.STOPPED)
        before, changed = [cell.support for cell in grid.panels], []
        for n in range(16):
            grid.scroll_y = 0.9 - n / 100
            ui.advance()  # three frames
            now = [cell.support for cell in grid.panels]
            changed.append(sum(a != b for a, b in zip(before, now, strict=True)))
            before = now
        assert max(changed) == 3
        assert sum(changed) == 10  # it continues, however long somebody scrolls
        ui.wait(lambda: head(ui) == "11 need you")
