"""All robots as an operator uses it: taps and keys, on real services; what the robots do is written into the snapshots."""
from __future__ import annotations

import threading
from dataclasses import replace

import pytest

from app.container import Container
from app.domain.models import Connection, Execution, Group, Robot, State, Trigger
from app.domain.robot import QueueItem, QueueState, RobotStatus
from app.screens.home.cards import HomeWide
from app.screens.home.fleet_page import CountChip, FleetPage, FleetTile, LargeTile, NameLine, SmallTile
from app.screens.home.waiting_model import WaitingDialog, WaitingRow
from app.screens.scheduler.hold import HoldDialog
from app.widgets.buttons import ChoiceChip, CommandButton
from app.widgets.dialogs import ChoiceDialog
from app.widgets.frame import TopBar
from app.widgets.panel_grid import PanelGrid
from app.widgets.rows import OptionRow, RobotChip
from app.window.key_focus import ARROWS, ENTER, ESCAPE, TAB, KeyFocus
from tests.support import home_facts as sample
from tests.ui.whole_app import shown

_UP, DOWN, RIGHT, _LEFT = ARROWS


def add_robots(container: Container, count: int) -> list[Robot]:
    """After the three of the plant."""
    return [container.catalogue.save_robot(Robot(f"Robot {n}", f"10.40.13.{n}", "scheduler"), "secret") for n in range(1, count + 1)]


def see(container: Container, robot: Robot, status: RobotStatus, queue: tuple[QueueItem, ...] = ()) -> None:
    """A poll has found this."""
    now = container.clock.now()
    container.snapshots.update(robot.id, connection=Connection.CONNECTED, status=status, queue=queue, read_at=now, queue_read_at=now)


@pytest.fixture
def robots(container) -> list[Robot]:
    """Six that are ready."""
    add_robots(container, 3)
    found = container.catalogue.robots()
    for robot in found:
        see(container, robot, sample.READY)
    return found


def tiles(ui) -> list[str]:
    """Names, in reading order on the screen."""
    def place(tile) -> tuple[float, float]:
        x, y = tile.to_window(*tile.pos)
        return -round(y), x
    return [tile.name for tile in sorted(ui.find_all(FleetTile), key=place)]


def counted(ui) -> list[str]:
    return [chip.text for chip in ui.find_all(CountChip)]


def open_tile(ui, name: str) -> None:
    ui.tap(ui.find(FleetTile, name=name))


def go_back(ui) -> None:
    """Not as the second tap on what led here; nor is the next one."""
    ui.advance(.5)
    ui.tap(next(button for button in ui.find_all(CommandButton) if button.text.startswith("All robots")))
    ui.advance(.5)


def settle(app, ui) -> None:
    ui.wait(lambda: app.shell.background.idle)
    ui.advance(.5)


# ---------------------------------------------------------------------- when there is such a page
def test_up_to_three_robots_have_no_such_page(container, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(HomeWide))
        settle(app, ui)
        assert len(ui.find_all(RobotChip)) == 3
        assert not ui.find_all(FleetPage)
        assert not any(button.text.startswith("All robots") for button in ui.find_all(CommandButton))
        add_robots(container, 1)             # nobody is sent anywhere, but the way is there
        ui.wait(lambda: not ui.find_all(RobotChip))
        settle(app, ui)
        go_back(ui)
        assert len(tiles(ui)) == 4


def test_of_more_robots_home_shows_all_first(container, robots, ui):
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


def test_above_twenty_the_tiles_are_small(container, ui):
    add_robots(container, 18)
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(SmallTile))
        assert not ui.find_all(LargeTile)


# ---------------------------------------------------------------------- what it shows
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
        assert (tile.word, tile.detail, tile.loud) == ("Stopped", "Emergency stop", True)


def test_a_run_is_shown_with_the_time_it_still_takes(container, robots, ui):
    aino, now = robots[0], container.clock.now()
    e = Execution(trigger=Trigger.MANUAL, robot_id=aino.id, robot=aino.name, mission="Collect empties", mission_guid="g-new",
                  planned_at=now, closes_at=now, created_at=now, token="t-new", timezone="UTC", state=State.EXECUTING, queue_id=900,
                  started_at=now)
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
    run = Execution(trigger=Trigger.MANUAL, robot_id=aino.id, robot=aino.name, mission="Collect empties", mission_guid="g-new",
                    planned_at=now, closes_at=now, created_at=now, token="t-new", timezone="UTC", state=State.EXECUTING, queue_id=900,
                    started_at=now)
    container.db.write(lambda c: container.repositories.executions.add(c, run))
    see(container, aino, replace(sample.EXECUTING, mission_queue_id=number))
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(FleetPage))
        ui.wait(lambda: ui.find(FleetTile, name="Aino").detail == "Collect empties")
        see(container, aino, replace(sample.EXECUTING, mission_queue_id=901), (QueueItem(900, QueueState.EXECUTING, mission_id="g-new"),))
        ui.wait(lambda: ui.find(FleetTile, name="Aino").detail == sample.EXECUTING.mission_text)         # somebody else's
        see(container, robots[1], replace(sample.EXECUTING, mission_queue_id=None))                      # whose number it does not say
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
        ui.tap(ui.find(CountChip, text="1 stopped"))
        assert tiles(ui) == [robots[2].name]
        see(container, robots[2], sample.READY)
        ui.wait(lambda: not tiles(ui))
        assert counted(ui) == ["0 stopped", "6 ready"]
        assert any(text.startswith("No robot is like this now") for text in ui.texts())
        ui.tap(ui.find(CountChip, text="0 stopped"))
        assert len(tiles(ui)) == 6
        assert counted(ui) == ["6 ready"]


def test_who_needs_me_comes_first_on_demand(container, robots, ui):
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


def test_nothing_moves_under_a_finger(container, robots, ui):
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(FleetPage))
        ui.tap(ui.find(ChoiceChip, text="Needs me first"))
        before, lift = tiles(ui), ui.press(ui.find(FleetTile, name=robots[5].name))
        see(container, robots[3], sample.STOPPED)
        ui.advance(.5)
        assert tiles(ui) == before
        lift(.1)
        ui.wait(lambda: ui.find(TopBar).robot == robots[5].name)
        go_back(ui)
        assert tiles(ui)[0] == robots[3].name


# ---------------------------------------------------------------------- to a robot and back
def test_a_tile_opens_its_robot_and_back_is_the_same_place(container, ui):
    add_robots(container, 90)
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        grid = ui.find(PanelGrid)
        grid.scroll_y = .4
        ui.advance(1)
        before, place = tiles(ui), grid.scroll_y
        assert "Aino" not in before
        open_tile(ui, before[20])
        ui.wait(lambda: ui.find_all(HomeWide) and ui.find(TopBar).robot == before[20])
        assert not ui.find_all(FleetPage)
        settle(app, ui)
        go_back(ui)
        assert tiles(ui) == before
        assert ui.find(PanelGrid).scroll_y == pytest.approx(place)
        open_tile(ui, before[20])            # the one that is selected already
        assert ui.find_all(HomeWide)


def test_a_second_tap_on_a_tile_presses_nothing_of_what_comes_in_its_place(container, ui, monkeypatch):
    add_robots(container, 90)
    paused: list[int] = []
    monkeypatch.setattr(type(container.operator), "pause", lambda _self, robot_id: paused.append(robot_id))
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        open_tile(ui, "Aino")
        settle(app, ui)
        button = ui.find(CommandButton, text="Pause")
        place = button.to_window(*button.center)
        go_back(ui)
        settle(app, ui)
        ui.tap_at(*place)
        ui.tap_at(*place)
        assert ui.find_all(HomeWide)
        settle(app, ui)
        assert paused == []
        ui.tap_at(*place)
        settle(app, ui)
        assert len(paused) == 1


def test_the_way_back_says_how_many_need_help(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        open_tile(ui, "Sisu")
        settle(app, ui)
        assert ui.find(CommandButton, text="All robots")
        see(container, robots[1], sample.STOPPED)
        ui.wait(lambda: ui.find_all(CommandButton, text="All robots · 1 needs help"))


def test_a_robot_that_is_picked_in_the_bar_is_shown(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        for name in ("Veikko", "Aino", "Aino"):              # the last one is selected already
            if ui.find_all(HomeWide):
                go_back(ui)
            ui.find(TopBar).dispatch("on_pick_robot")
            ui.wait(lambda name=name: ui.find_all(OptionRow, text=name))
            ui.advance(.3)
            ui.tap(ui.find(OptionRow, text=name))
            ui.wait(lambda name=name: ui.find_all(HomeWide) and ui.find(TopBar).robot == name)
            settle(app, ui)


def test_what_is_held_from_all_robots_is_all_and_from_one_this_one(container, robots, ui):
    def asked_to_hold(app) -> str:
        app.shell.go("scheduler")
        settle(app, ui)
        ui.tap(ui.find(CommandButton, text="Hold"))
        ui.advance(.3)
        robot: str = ui.find(HoldDialog).robot
        app.shell.dialogs.close_all()
        ui.advance(.3)
        return robot

    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        assert asked_to_hold(app) == "All robots"
        ui.find(TopBar).dispatch("on_pick_robot")
        ui.advance(.3)
        ui.tap(ui.find(OptionRow, text="Veikko"))
        settle(app, ui)
        ui.wait(lambda: asked_to_hold(app) == "Veikko")
        app.shell.go("home")
        ui.wait(lambda: ui.find_all(FleetPage))
        assert asked_to_hold(app) == "All robots"
        app.shell.go("home")
        ui.wait(lambda: ui.find_all(FleetPage))
        open_tile(ui, "Aino")
        ui.wait(lambda: ui.find_all(HomeWide))
        settle(app, ui)
        ui.wait(lambda: asked_to_hold(app) == "Aino")            # the choice is written beside


def test_a_tile_that_is_opened_selects_its_robot_though_another_one_has_been_chosen_since_it_was_drawn(container, robots, ui):
    aino, veikko = (next(robot.id for robot in container.catalogue.robots() if robot.name == name) for name in ("Aino", "Veikko"))
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetTile, name="Aino"))
        container.catalogue.change_settings(selected_robot_id=veikko)
        open_tile(ui, "Aino")
        settle(app, ui)
        assert container.settings().selected_robot_id == aino
        for robot_id in (veikko, aino, veikko):
            app.shell.go("home", robot_id=robot_id)
        settle(app, ui)
        assert container.settings().selected_robot_id == veikko


def test_a_robot_can_be_asked_for_before_any_is_known(container, robots, ui):
    """The first reading is slow: the choice comes late, not the form to add a first robot."""
    may, read = threading.Event(), container.holds.current
    container.holds.current = lambda: (may.wait(30), read())[1]
    with shown(container, ui) as app:
        ui.find(TopBar).dispatch("on_pick_robot")
        ui.advance(.3)
        assert not ui.find_all(OptionRow)
        assert "No robot" not in ui.texts()
        may.set()
        ui.wait(lambda: ui.find_all(OptionRow, text="Veikko"))
        assert app.shell.navigator.current == "home"
        settle(app, ui)


def test_other_screens_lead_back_to_what_was_shown(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        app.shell.go("logs")
        app.shell.go("home")
        ui.advance(.3)
        assert ui.find_all(FleetPage)
        app.shell.go("logs")
        app.shell.go("home", robot_id=robots[2].id)          # as an alarm does
        ui.wait(lambda: ui.find_all(HomeWide) and ui.find(TopBar).robot == robots[2].name)
        settle(app, ui)
        app.shell.navigator.rebuild()                        # gloves on
        ui.wait(lambda: ui.find_all(HomeWide))
        settle(app, ui)
        assert not ui.find_all(FleetPage)


def test_by_keys_alone(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        settle(app, ui)
        tab_to(ui, FleetTile)
        ui.key(RIGHT)
        ui.key(DOWN)
        ui.key(ENTER)
        ui.wait(lambda: ui.find_all(HomeWide) and ui.find(TopBar).robot == "Veikko")


def tab_to(ui, kind: type, **values) -> None:
    targets = KeyFocus().targets()
    for _n in range(1 + next(n for n, target in enumerate(targets)
                             if isinstance(target, kind) and all(getattr(target, name) == value for name, value in values.items()))):
        ui.key(TAB)


def test_the_ring_goes_along_to_a_robot_and_back(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        settle(app, ui)
        tab_to(ui, FleetTile, name="Sisu")
        for _round in range(2):
            ui.key(ENTER)
            ui.wait(lambda: ui.find_all(HomeWide) and ui.find(TopBar).robot == "Sisu")
            settle(app, ui)
            ui.key(ENTER)                                     # it is on the way back
            ui.wait(lambda: ui.find_all(FleetPage))
            settle(app, ui)                                   # and there on the tile


def test_escape_leads_back_to_all_robots_where_they_were(container, ui):
    add_robots(container, 90)
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        settle(app, ui)
        ui.key(ESCAPE)
        assert ui.find_all(FleetPage)
        ui.find(PanelGrid).scroll_y = .4
        ui.advance(1)
        before, place, name = tiles(ui), ui.find(PanelGrid).scroll_y, tiles(ui)[20]
        open_tile(ui, name)
        ui.wait(lambda: ui.find_all(HomeWide) and ui.find(TopBar).robot == name)
        settle(app, ui)
        app.shell.dialogs.confirm("Title", "Text", "Yes", lambda: None)
        ui.key(ESCAPE)                                        # closes what is open first
        assert ui.find_all(HomeWide)
        ui.key(ESCAPE)
        assert ui.find_all(FleetPage)
        assert tiles(ui) == before
        assert ui.find(PanelGrid).scroll_y == pytest.approx(place)


def test_a_name_that_is_too_long_keeps_its_end(container, ui):
    add_robots(container, 20)
    container.catalogue.save_robot(Robot("Autonomous pallet truck in hall 17", "10.40.14.1", "scheduler"), "secret")
    with shown(container, ui):
        ui.wait(lambda: ui.find_all(SmallTile))
        label, = ui.find_all(NameLine, text="Autonomous pallet truck in hall 17")
        shown_name = label._label.text
        assert shown_name.startswith("Auto")
        assert shown_name.endswith("… 17")


def test_the_bar_and_its_list_say_how_many_need_help(container, robots, ui):
    with shown(container, ui):
        see(container, robots[1], sample.STOPPED)
        ui.wait(lambda: ui.find(TopBar).help_count == "1")
        ui.find(TopBar).dispatch("on_pick_robot")
        ui.advance(.3)
        assert "Robot · 1 needs help" in ui.texts()


def test_what_waits_for_a_robot_is_told_above_all_of_them(container, ui, robots):
    group = container.catalogue.save_group(Group("Hall 1", tuple(robot.id for robot in robots)))
    with shown(container, ui) as app:
        settle(app, ui)
        assert not [button for button in ui.find_all(CommandButton) if button.text.startswith("Waiting for a robot")]
        for _n in range(2):
            container.operator.run_on_any(group.id, container.catalogue.missions()[0].id)
        ui.wait(lambda: ui.find_all(CommandButton, text="Waiting for a robot (2)"))
        settle(app, ui)
        ui.tap(ui.find(CommandButton, text="Waiting for a robot (2)"))
        ui.wait(lambda: ui.find_all(WaitingDialog))
        rows = ui.find_all(WaitingRow, ui.find(WaitingDialog))
        assert [(row.priority, row.urgent) for row in rows] == [("High", True)] * 2


def test_a_start_is_given_to_a_robot_by_keys_alone(container, ui, robots):
    """Enter presses what the ring is at: what waits, Give to …, and then a robot can be chosen."""
    group = container.catalogue.save_group(Group("Hall 1", tuple(robot.id for robot in robots)))
    container.operator.run_on_any(group.id, container.catalogue.missions()[0].id)
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(CommandButton, text="Waiting for a robot (1)"))
        settle(app, ui)
        for words in ("Waiting for a robot (1)", "Give to …"):
            tab_to(ui, CommandButton, text=words)
            ui.key(ENTER)
            settle(app, ui)
        assert {option.text for option in ui.find(ChoiceDialog).options} == {robot.name for robot in robots}
