"""The page of all robots as an operator uses it: taps and keys, on real services; what the robots do is written into the snapshots."""

from __future__ import annotations

from dataclasses import replace

from app.domain.execution import Execution, State, Trigger
from app.domain.robot import QueueItem, QueueState
from app.screens.home.cards import HomeWide
from app.screens.home.fleet_page import FleetPage, RobotCell
from app.widgets.frame import TopBar
from app.widgets.tabs import TabButton
from tests.support import home_facts as sample
from tests.ui.fleet.operator import (
    add_robots,
    counted,
    go_back,
    head,
    open_tile,
    row_of,
    see,
    settle,
    tiles,
    to_do,
)
from tests.ui.whole_app import shown


def test_up_to_three_robots_have_no_such_page(container, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(HomeWide))
        settle(app, ui)
        assert len(ui.find_all(TabButton, ui.find(TopBar))) == 3
        assert not ui.find_all(FleetPage)
        add_robots(container, 1)  # nothing is sent, but it would be possible
        ui.wait(lambda: "All robots" in ui.texts(ui.find(TopBar)))
        settle(app, ui)
        go_back(ui)
        assert len(tiles(ui)) == 4


def test_with_many_robots_home_shows_all_first(container, robots, ui):
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(FleetPage))
        assert tiles(ui) == ["Aino", "Robot 1", "Robot 2", "Robot 3", "Sisu", "Veikko"]
        assert counted(ui) == ["6 ready"]
        assert "All well" in ui.texts()
        assert head(ui) == ""
        for robot in robots[3:]:
            container.catalogue.remove_robot(robot.id)
        ui.wait(lambda: len(ui.find_all(TabButton, ui.find(TopBar))) == 3)
        assert not ui.find_all(FleetPage)


def test_all_is_not_well_while_an_alarm_is_shelved(container, robots, ui):
    with shown(container, ui):
        ui.wait(lambda: "All well" in ui.texts())
        container.alarms.raise_("backup_failed", "backup", problem="no room")
        container.alarms.shelve(container.alarms.open()[0].id, 1)
        ui.wait(lambda: "All well" not in ui.texts())


def test_a_poll_changes_its_cell_the_list_and_the_counts_and_no_place(container, robots, ui):
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(FleetPage))
        before = tiles(ui)
        see(container, robots[1], sample.ASKING)
        see(container, robots[3], sample.STOPPED)
        ui.wait(lambda: counted(ui) == ["4 ready"])
        ui.advance(0.5)
        assert (head(ui), to_do(ui)) == ("2 need you", [robots[3].name, robots[1].name])
        assert "All well" not in ui.texts()
        assert tiles(ui) == before
        cell = ui.find(RobotCell, title=robots[3].name)
        assert (cell.item.support, cell.tone, cell.item.loud) == ("Stopped", "fault", True)


def test_a_robot_that_is_deleted_before_its_turn_is_not_looked_at(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        settle(app, ui)
        vm = app.shell.navigator.screen("home").vm
        vm.fleet._tick()  # all wait for their turn
        vm.fleet.take(replace(vm.facts, robots=vm.facts.robots[1:]))
        vm.fleet._look_at_some(0)
        assert len(vm.fleet.cells) == len(robots) - 1


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
    container.db.write(lambda c: repository.add_each_once(c, [e])[0])
    done = replace(e, token="t-old", state=State.COMPLETED, queue_id=800, ended_at=now, duration_s=290.0)
    container.db.write(lambda c: repository.add_each_once(c, [done])[0])
    see(container, aino, sample.EXECUTING, (QueueItem(900, QueueState.EXECUTING, mission_id="g-new"),))
    with shown(container, ui):
        ui.wait(lambda: "4 min left" in [cell.item.support for cell in ui.find_all(RobotCell, title="Aino")])
        assert counted(ui) == ["1 working", "5 ready"]


def test_a_run_is_followed_before_the_queue_is_read_again(container, robots, ui):
    """Between its polls only the status of a robot is read, unless it is the one on screen."""
    aino, now = robots[0], container.clock.now()
    e = collecting(aino, now)
    repository = container.repositories.executions
    container.db.write(lambda c: repository.add_each_once(c, [e])[0])
    done = replace(e, token="t-old", state=State.COMPLETED, queue_id=800, ended_at=now, duration_s=290.0)
    container.db.write(lambda c: repository.add_each_once(c, [done])[0])
    see(container, aino, replace(sample.EXECUTING, mission_queue_id=900))
    with shown(container, ui):
        ui.wait(lambda: "4 min left" in [cell.item.support for cell in ui.find_all(RobotCell, title="Aino")])
        see(container, aino, replace(sample.EXECUTING, mission_queue_id=901))  # somebody else's
        ui.wait(lambda: ui.find(RobotCell, title="Aino").item.support == "Working")


def test_robots_that_are_not_heard_of_for_long_no_longer_answer(container, robots, ui):
    with shown(container, ui):
        ui.wait(lambda: counted(ui) == ["6 ready"])
        container.clock.advance(3600)
        see(container, robots[0], sample.READY)
        ui.skip(1)
        ui.wait(lambda: head(ui) == "5 need you" and counted(ui) == ["1 ready"])
        assert row_of(ui, "5 robots").item.support == "No answer, all at the same minute. 1 other answers."


def test_while_it_is_shown_the_robots_are_read_every_few_seconds(container, robots, ui, monkeypatch):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        settle(app, ui)
        read: list[None] = []
        monkeypatch.setattr(container.engine, "request_cycle", lambda by_window=False: read.append(None))
        ui.advance(12)
        assert len(read) == 2
        open_tile(ui, "Veikko")
        ui.advance(12)
        assert len(read) == 2
