"""The page of all robots as an operator uses it: taps and keys, on real services; what the robots do is written into the snapshots."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from kivy.metrics import dp

from app.domain.models import Execution, Robot, State, Trigger
from app.domain.robot import QueueItem, QueueState
from app.screens.home.cards import HomeWide
from app.screens.home.fleet_page import CountChip, FarLine, FleetPage, FleetTile, LargeTile, NameLine, SmallTile
from app.widgets.buttons import ChoiceChip, CommandButton
from app.widgets.frame import TopBar
from app.widgets.panel_grid import PanelGrid
from app.widgets.rows import RobotChip
from app.widgets.text import BodyStrong, Ico, Txt
from tests.support import home_facts as sample
from tests.ui.fleet.operator import add_robots, counted, go_back, see, settle, tiles
from tests.ui.whole_app import shown

CAPITAL = 0.711  # of Roboto, in em


def minutes(label: Txt) -> float:
    """The height of its capitals in minutes of arc, at two metres from a 10" tablet: 150 px an inch, one a dp."""
    return math.degrees(label.font_size / dp(1) * CAPITAL * 25.4 / 150 / 2000) * 60


# ---------------------------------------------------------------------- when there is such a page
def test_up_to_three_robots_have_no_such_page(container, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(HomeWide))
        settle(app, ui)
        assert len(ui.find_all(RobotChip)) == 3
        assert not ui.find_all(FleetPage)
        assert not any(button.text.startswith("All robots") for button in ui.find_all(CommandButton))
        add_robots(container, 1)  # nothing is sent, but it would be possible
        ui.wait(lambda: not ui.find_all(RobotChip))
        settle(app, ui)
        go_back(ui)
        assert len(tiles(ui)) == 4


def test_with_many_robots_home_shows_all_first(container, robots, ui):
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(FleetPage))
        assert tiles(ui) == ["Aino", "Robot 1", "Robot 2", "Robot 3", "Sisu", "Veikko"]
        assert counted(ui) == ["6 ready"]
        assert "All well" in ui.texts()
        assert {type(tile) for tile in ui.find_all(FleetTile)} == {LargeTile}
        for robot in robots[3:]:
            container.catalogue.remove_robot(robot.id)
        ui.wait(lambda: len(ui.find_all(RobotChip)) == 3)
        assert not ui.find_all(FleetPage)


def test_all_is_not_well_while_an_alarm_is_shelved(container, robots, ui):
    with shown(container, ui):
        ui.wait(lambda: "All well" in ui.texts())
        container.alarms.raise_("backup_failed", "backup", problem="no room")
        container.alarms.shelve(container.alarms.open()[0].id, 1)
        ui.wait(lambda: "All well" not in ui.texts())


def are_at_least(tiles: list[FleetTile], width: float, height: float) -> bool:
    return min(round(tile.width) for tile in tiles) >= width and min(round(tile.height) for tile in tiles) >= height


def test_above_twenty_the_tiles_are_small(container, ui):
    add_robots(container, 17)
    with shown(container, ui):
        ui.wait(lambda: len(ui.find_all(LargeTile)) > 4)
        assert are_at_least(ui.find_all(LargeTile), 296, 112)
        container.catalogue.save_robot(Robot("Robot 18", "10.40.13.18", "scheduler"), "secret")
        ui.wait(lambda: ui.find_all(SmallTile))
        assert not ui.find_all(LargeTile)
        assert are_at_least(ui.find_all(SmallTile), 144, 84)


def test_up_to_twenty_four_fill_a_wide_page(container, ui):
    add_robots(container, 21)
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(SmallTile))
        assert ui.find(PanelGrid).columns == 6
        container.catalogue.save_robot(Robot("Robot 22", "10.40.13.22", "scheduler"), "secret")
        ui.wait(lambda: ui.find(PanelGrid).columns == 8)


# ---------------------------------------------------------------------- what it shows
def test_robots_that_need_a_person_are_readable_at_two_metres(container, ui):
    """Letters of 24 sp, in the same room, and what fits is not cut."""
    robots = add_robots(container, 40)
    named = container.catalogue.save_robot(replace(robots[20], name="Trukki hallissa 1"))
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(SmallTile))
        for robot, status in ((robots[8], sample.ASKING), (robots[19], sample.STOPPED), (named, sample.STOPPED)):
            see(container, robot, status)
        ui.wait(lambda: counted(ui)[:2] == ["2 stopped", "1 asks"])
        ui.advance(0.1)
        assert all(
            minutes(label) >= 4.9 for chip in ui.find_all(CountChip)[:2] for label in ui.find_all(BodyStrong, chip)
        )
        for robot in (robots[8], robots[19], named):
            tile = ui.find(SmallTile, name=robot.name)
            name, word = ui.find(NameLine, tile), ui.find(FarLine, tile, text=tile.word)
            assert (round(tile.height), word._label.text, minutes(word) >= 4.9) == (84, tile.word, True)
            assert minutes(name) >= (3.2 if robot is named else 4.9)
            assert name._label.text.endswith(robot.name.split()[-1])
        calm = ui.find(SmallTile, name=robots[0].name)
        assert (round(calm.height), minutes(ui.find(NameLine, calm)) < 4) == (84, True)


def test_a_poll_changes_its_tile_and_the_counts_and_no_place(container, robots, ui):
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(FleetPage))
        before = tiles(ui)
        see(container, robots[3], sample.STOPPED)
        see(container, robots[1], sample.ASKING)
        ui.wait(lambda: counted(ui) == ["1 stopped", "1 asks", "4 ready"])
        assert "All well" not in ui.texts()
        assert tiles(ui) == before
        tile = ui.find(FleetTile, name=robots[3].name)
        assert (tile.word, tile.detail, tile.loud) == ("Stopped", "Stopped", True)


def test_while_the_list_moves_one_tile_a_frame_becomes_another(container, ui):
    robots = add_robots(container, 40)
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(SmallTile))
        grid = ui.find(PanelGrid)
        for robot in container.catalogue.robots():
            see(container, robot, sample.READY)
        ui.wait(lambda: counted(ui) == ["43 ready"])
        grid.scroll_y = 0.9
        for robot in robots[:10]:
            see(container, robot, sample.STOPPED)
        before, changed = [tile.word for tile in grid.panels], []
        for n in range(16):
            grid.scroll_y = 0.9 - n / 100
            ui.advance()  # three frames
            now = [tile.word for tile in grid.panels]
            changed.append(sum(a != b for a, b in zip(before, now, strict=True)))
            before = now
        assert max(changed) == 3
        assert sum(changed) == 10  # it continues, however long somebody scrolls
        ui.wait(lambda: counted(ui) == ["10 stopped", "33 ready"])


def collecting(robot, now) -> Execution:
    """A run that the robot has just begun."""
    return Execution(
        trigger=Trigger.MANUAL,
        robot_id=robot.id,
        robot=robot.name,
        mission="Collect empties",
        mission_guid="g-new",
        planned_at=now,
        closes_at=now,
        created_at=now,
        token="t-new",
        timezone="UTC",
        state=State.EXECUTING,
        queue_id=900,
        started_at=now,
    )


def test_a_run_is_shown_with_the_time_it_still_takes(container, robots, ui):
    aino, now = robots[0], container.clock.now()
    e = collecting(aino, now)
    repository = container.repositories.executions
    container.db.write(lambda c: repository.add(c, e))
    done = replace(e, token="t-old", state=State.COMPLETED, queue_id=800, ended_at=now, duration_s=290.0)
    container.db.write(lambda c: repository.add(c, done))
    see(container, aino, sample.EXECUTING, (QueueItem(900, QueueState.EXECUTING, mission_id="g-new"),))
    with shown(container, ui):
        ui.wait(lambda: "5 min left · Collect empties" in ui.texts())
        assert counted(ui) == ["1 working", "5 ready"]


@pytest.mark.parametrize("number", [900, None])
def test_a_run_is_named_before_the_queue_is_read_again(container, robots, ui, number):
    """Between its polls only the status of a robot is read, unless it is the one on screen."""
    aino, now = robots[0], container.clock.now()
    run = collecting(aino, now)
    container.db.write(lambda c: container.repositories.executions.add(c, run))
    see(container, aino, replace(sample.EXECUTING, mission_queue_id=number))
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        ui.wait(lambda: ui.find(FleetTile, name="Aino").detail == "Collect empties")
        see(
            container,
            aino,
            replace(sample.EXECUTING, mission_queue_id=901),
            (QueueItem(900, QueueState.EXECUTING, mission_id="g-new"),),
        )
        ui.wait(lambda: ui.find(FleetTile, name="Aino").detail == sample.EXECUTING.mission_text)  # somebody else's
        unknown = (QueueItem(902, QueueState.EXECUTING, mission_id="g-of-nobody"),)
        see(
            container, robots[2], replace(sample.EXECUTING, mission_queue_id=902), unknown
        )  # of a mission that was never fetched
        ui.wait(lambda: ui.find(FleetTile, name=robots[2].name).detail == sample.EXECUTING.mission_text)
        settle(app, ui)
        assert ui.find(FleetTile, name=robots[2].name).detail == sample.EXECUTING.mission_text
        see(container, robots[1], replace(sample.EXECUTING, mission_queue_id=None))  # whose number it does not say
        ui.wait(lambda: ui.find(FleetTile, name=robots[1].name).detail == sample.EXECUTING.mission_text)


def test_robots_that_are_not_heard_of_for_long_no_longer_answer(container, robots, ui):
    with shown(container, ui):
        ui.wait(lambda: counted(ui) == ["6 ready"])
        container.clock.advance(3600)
        see(container, robots[0], sample.READY)
        ui.skip(1)
        ui.wait(lambda: counted(ui) == ["5 no answer", "1 ready"])


# ---------------------------------------------------------------------- filter and order
def test_a_count_filters_until_it_is_tapped_again(container, robots, ui):
    with shown(container, ui):
        see(container, robots[2], sample.STOPPED)
        ui.wait(lambda: "1 stopped" in counted(ui))
        chip = ui.find(CountChip, text="1 stopped")
        places = [each.pos[:] for each in ui.find_all(CountChip)]
        ui.tap(chip)
        assert tiles(ui) == [robots[2].name]
        assert ui.find_all(Ico, chip, icon="close")
        assert [each.pos[:] for each in ui.find_all(CountChip)] == places  # nothing moves under the finger
        see(container, robots[2], sample.READY)
        ui.wait(lambda: not tiles(ui))
        assert counted(ui) == ["0 stopped", "6 ready"]
        assert any(text.startswith("No robot is like this now") for text in ui.texts())
        ui.tap(ui.find(CountChip, text="0 stopped"))
        assert len(tiles(ui)) == 6
        assert counted(ui) == ["6 ready"]


def test_a_filter_that_no_robot_fits_ends_by_itself_without_a_tap(container, robots, ui):
    with shown(container, ui):
        see(container, robots[2], sample.STOPPED)
        ui.wait(lambda: "1 stopped" in counted(ui))
        ui.tap(ui.find(CountChip, text="1 stopped"))
        for state in (sample.READY, sample.STOPPED, sample.READY):  # the time restarts
            see(container, robots[2], state)
            ui.wait(lambda state=state: bool(tiles(ui)) == (state is sample.STOPPED))
            ui.skip(1)
            ui.skip(40)
        assert not tiles(ui)
        container.clock.step(3600)  # set, so no time has passed
        for robot in robots:
            see(container, robot, sample.READY)
        ui.skip(1)
        assert not tiles(ui)
        container.clock.step(-3600)
        ui.skip(40)
        ui.wait(lambda: len(tiles(ui)) == 6)
        assert "0 stopped" not in counted(ui)


def test_the_time_of_an_empty_filter_restarts_when_it_comes_on_screen(container, robots, ui):
    """What it fits has changed since."""
    with shown(container, ui) as app:
        see(container, robots[2], sample.STOPPED)
        ui.wait(lambda: "1 stopped" in counted(ui))
        ui.tap(ui.find(CountChip, text="1 stopped"))
        see(container, robots[2], sample.READY)
        ui.wait(lambda: not tiles(ui))
        ui.skip(1)
        app.shell.go("logs")
        settle(app, ui)
        see(container, robots[4], sample.STOPPED)
        ui.skip(70)
        app.shell.go("home")
        settle(app, ui)
        assert tiles(ui) == [robots[4].name]


def test_robots_that_need_a_person_come_first_on_demand(container, robots, ui):
    with shown(container, ui):
        see(container, robots[4], sample.STOPPED)
        see(container, robots[2], sample.ASKING)
        ui.wait(lambda: len(counted(ui)) == 3)
        order = [robot.name for robot in robots]
        assert tiles(ui) == order
        ui.tap(ui.find(ChoiceChip, text="Needs me first"))
        assert tiles(ui)[:2] == [robots[4].name, robots[2].name]
        assert tiles(ui)[2:] == [name for name in order if name not in (robots[4].name, robots[2].name)]
        ui.tap(ui.find(ChoiceChip, text="Needs me first"))
        assert tiles(ui) == order


def test_changes_delayed_by_a_finger_come_no_faster_when_it_leaves(container, ui):
    robots = add_robots(container, 40)
    with shown(container, ui):
        for robot in container.catalogue.robots():
            see(container, robot, sample.READY)
        ui.wait(lambda: counted(ui) == ["43 ready"])
        grid = ui.find(PanelGrid)
        lift = ui.press(grid)
        for robot in robots[:30]:
            see(container, robot, sample.STOPPED)
        ui.advance(0.5)
        assert counted(ui) == ["43 ready"]
        changed, before = [], list(grid.panels)
        grid.bind(panels=lambda _grid, panels: changed.append(sum(a != b for a, b in zip(before, panels, strict=True))))
        grid.bind(panels=lambda _grid, panels: before.__setitem__(slice(None), panels))
        lift(0.1)
        ui.wait(lambda: counted(ui) == ["30 stopped", "13 ready"] or not ui.find_all(PanelGrid))
        assert max(changed) <= 6


def test_nothing_moves_under_a_finger(container, robots, ui):
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(FleetPage))
        ui.tap(ui.find(ChoiceChip, text="Needs me first"))
        before, lift = tiles(ui), ui.press(ui.find(FleetTile, name=robots[5].name))
        see(container, robots[3], sample.STOPPED)
        ui.advance(0.5)
        assert tiles(ui) == before
        lift(0.1)
        ui.wait(lambda: ui.find(TopBar).robot == robots[5].name)
        go_back(ui)
        assert tiles(ui)[0] == robots[3].name
