"""The page of all robots as an operator uses it: taps and keys, on real services; what the robots do is written into the snapshots."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.activities import ActivityRepository
from app.domain.activity import ActivitySpan
from app.domain.execution import Execution, State, Trigger
from app.domain.models import Connection, Group
from app.domain.robot import QueueItem, QueueState, RobotStatus
from app.screens.home.cards import HomeWide
from app.screens.home.fleet_page import FleetGrid, FleetHead, FleetPage, RobotCell
from app.screens.home.wall import WallRow, WallView
from app.widgets.buttons import ChoiceChip, IconButton
from app.widgets.fields import FieldInput
from app.widgets.frame import TopBar
from app.widgets.list_row import RowButton
from app.widgets.lists import STILL
from app.widgets.rest import rest
from app.widgets.tabs import TabButton
from app.window.key_focus import ESCAPE
from tests.support import fleet_facts
from tests.support import home_facts as sample
from tests.ui.fleet.operator import (
    add_robots,
    counted,
    go_back,
    head,
    open_tile,
    press,
    row_of,
    see,
    settle,
    tiles,
    to_do,
)
from tests.ui.looks import labels
from tests.ui.whole_app import shown, tab_shown


# ---------------------------------------------------------------------- when there is such a page
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


# ---------------------------------------------------------------------- what it shows
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
        cell = ui.find(RobotCell, name=robots[3].name)
        assert (cell.item.fact, cell.tone, cell.item.loud) == ("Stopped", "fault", True)


def test_a_robot_that_is_deleted_before_its_turn_is_not_looked_at(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        settle(app, ui)
        vm = app.shell.navigator.screen("home").vm
        vm.fleet._tick()  # all wait for their turn
        vm.fleet.take(replace(vm.facts, robots=vm.facts.robots[1:]))
        vm.fleet._look_at_some(0)
        assert len(vm.fleet.cells) == len(robots) - 1


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
        before, changed = [cell.fact for cell in grid.panels], []
        for n in range(16):
            grid.scroll_y = 0.9 - n / 100
            ui.advance()  # three frames
            now = [cell.fact for cell in grid.panels]
            changed.append(sum(a != b for a, b in zip(before, now, strict=True)))
            before = now
        assert max(changed) == 3
        assert sum(changed) == 10  # it continues, however long somebody scrolls
        ui.wait(lambda: head(ui) == "11 need you")


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
        ui.wait(lambda: ui.find_all(RobotCell, name="Aino", fact="5 min left"))
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
        ui.wait(lambda: ui.find_all(RobotCell, name="Aino", fact="5 min left"))
        see(container, aino, replace(sample.EXECUTING, mission_queue_id=901))  # somebody else's
        ui.wait(lambda: ui.find(RobotCell, name="Aino").item.fact == "Working")


def test_robots_that_are_not_heard_of_for_long_no_longer_answer(container, robots, ui):
    with shown(container, ui):
        ui.wait(lambda: counted(ui) == ["6 ready"])
        container.clock.advance(3600)
        see(container, robots[0], sample.READY)
        ui.skip(1)
        ui.wait(lambda: head(ui) == "5 need you" and counted(ui) == ["1 ready"])
        assert row_of(ui, "5 robots").item.support == "No answer, all at the same minute. 1 other answers."


def test_it_knows_since_when_robots_need_a_person_although_it_has_just_been_opened(container, robots, ui):
    """From what was stored; of what happens later, from what was seen."""
    stopped, asking, paused = robots[1], robots[2], robots[3]
    began = container.clock.now() - timedelta(minutes=20)
    container.db.write(
        lambda c: ActivityRepository().save(
            c, paused.id, [ActivitySpan("paused", began, container.clock.now() - timedelta(seconds=30))]
        )
    )
    container.alarms.raise_("question", f"robot:{asking.id}", robot=asking.name, question="Loaded?")
    see(container, asking, sample.ASKING)
    see(container, paused, fleet_facts.PAUSED)
    with shown(container, ui):
        ui.wait(lambda: head(ui) == "2 need you")
        ui.wait(lambda: row_of(ui, paused.name).item.aside == "14:18")
        assert row_of(ui, asking.name).item.aside == "14:38"
        container.clock.advance(120)
        for robot in robots:
            status = {asking.id: sample.ASKING, paused.id: fleet_facts.PAUSED, stopped.id: sample.STOPPED}
            see(container, robot, status.get(robot.id, sample.READY))
        ui.wait(lambda: stopped.name in to_do(ui))
        ui.advance(0.5)
        assert row_of(ui, stopped.name).item.aside == "14:40"


def test_it_says_since_when_a_robot_is_in_error_though_its_alarm_came_after_it_was_seen(container, robots, ui):
    aino = robots[0]
    see(container, aino, sample.FAILED)
    with shown(container, ui) as app:
        ui.wait(lambda: head(ui) == "1 needs you")
        settle(app, ui)
        assert row_of(ui, aino.name).item.aside == ""
        container.alarms.raise_("robot_error", f"robot:{aino.id}", robot=aino.name, problem="Can't reach Dock 3")
        ui.advance(6)
        ui.wait(lambda: row_of(ui, aino.name).item.aside == "14:38")


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


# ---------------------------------------------------------------------- what is pressed in it
def test_a_question_is_answered_with_one_touch(container, robots, ui, monkeypatch):
    answered: list[object] = []
    monkeypatch.setattr(type(container.operator), "answer_prompt", lambda _self, *what: answered.append(what))
    with shown(container, ui) as app:
        see(container, robots[2], sample.ASKING)
        ui.wait(lambda: head(ui) == "1 needs you")
        settle(app, ui)
        press(ui, robots[2].name, "Yes")
        settle(app, ui)
        assert answered == [(robots[2].id, sample.ASKING.user_prompt.guid, "Yes")]
        assert ui.find_all(FleetPage)
        assert app.shell.snackbars.texts == [f"Answer sent to {robots[2].name}: Yes"]


@pytest.mark.parametrize(
    ("status", "word", "command"),
    [(sample.FAILED, "Reset errors", "reset_errors"), (fleet_facts.PAUSED, "Resume", "resume")],
)
def test_a_row_solves_its_problem_once_for_a_double_tap(container, robots, ui, monkeypatch, status, word, command):
    sent: list[int] = []
    monkeypatch.setattr(type(container.operator), command, lambda _self, robot_id: sent.append(robot_id))
    with shown(container, ui) as app:
        see(container, robots[2], status)
        ui.wait(lambda: head(ui) == "1 needs you")
        settle(app, ui)
        press(ui, robots[2].name, word)
        press(ui, robots[2].name, word)
        settle(app, ui)
        assert sent == [robots[2].id]


def test_a_reset_without_effect_is_reported_for_a_robot_of_the_list(container, robots, ui, monkeypatch):
    monkeypatch.setattr(type(container.operator), "reset_errors", lambda _self, _robot_id: None)
    with shown(container, ui) as app:
        see(container, robots[2], sample.FAILED)
        ui.wait(lambda: head(ui) == "1 needs you")
        settle(app, ui)
        press(ui, robots[2].name, "Reset errors")
        settle(app, ui)
        see(container, robots[2], sample.FAILED)
        ui.skip(6)
        ui.wait(lambda: any(text.startswith("Still there") for text in app.shell.snackbars.texts))


def test_a_row_of_several_lists_them_and_leads_back(container, robots, ui):
    with shown(container, ui) as app:
        for robot in robots[2:5]:
            container.snapshots.update(
                robot.id, connection=Connection.UNREACHABLE, since=container.clock.now() - timedelta(minutes=9)
            )
        ui.wait(lambda: head(ui) == "3 need you")
        settle(app, ui)
        (title,) = to_do(ui)
        ui.tap(row_of(ui, title))
        assert head(ui) == "No answer: 3 robots"
        assert to_do(ui) == [robot.name for robot in robots[2:5]]
        assert row_of(ui, robots[2].name).item.meta.startswith("Ready")
        ui.advance(1)
        ui.key(ESCAPE)
        assert to_do(ui) == [title]


def test_a_count_lists_its_robots_until_it_is_tapped_again(container, robots, ui):
    with shown(container, ui) as app:
        see(container, robots[2], sample.STOPPED)
        ui.wait(lambda: counted(ui) == ["5 ready"])
        settle(app, ui)
        before = tiles(ui)
        ui.tap(ui.find(ChoiceChip, text="5 ready"))
        assert (head(ui), len(to_do(ui))) == ("5 ready", 5)
        assert tiles(ui) == before  # the cells stay
        ui.advance(1)
        ui.tap(ui.find(ChoiceChip, text="5 ready"))
        assert head(ui) == "1 needs you"


def test_an_arrival_on_the_page_shows_who_needs_a_person(container, robots, ui):
    with shown(container, ui) as app:
        see(container, robots[2], sample.STOPPED)
        ui.wait(lambda: counted(ui) == ["5 ready"])
        settle(app, ui)
        ui.tap(ui.find(ChoiceChip, text="5 ready"))
        app.shell.go("logs")
        settle(app, ui)
        app.shell.go("home")
        settle(app, ui)
        assert head(ui) == "1 needs you"


def test_a_list_ends_when_no_robot_is_in_it_any_more(container, robots, ui):
    with shown(container, ui) as app:
        see(container, robots[2], sample.CHARGING)
        ui.wait(lambda: "1 charging" in counted(ui))
        settle(app, ui)
        ui.tap(ui.find(ChoiceChip, text="1 charging"))
        assert to_do(ui) == [robots[2].name]
        see(container, robots[2], sample.READY)
        ui.wait(lambda: head(ui) == "")


def test_a_robot_that_stops_brings_the_list_back(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: counted(ui) == ["6 ready"])
        settle(app, ui)
        ui.tap(ui.find(ChoiceChip, text="6 ready"))
        see(container, robots[1], fleet_facts.PAUSED)
        ui.wait(lambda: head(ui) == "5 ready")
        see(container, robots[2], sample.STOPPED)
        ui.wait(lambda: head(ui) == "2 need you")


def test_robots_are_found_by_a_part_of_their_name(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: ui.find_all(FleetPage))
        settle(app, ui)
        ui.tap(ui.find(IconButton, ui.find(FleetPage), icon="magnify"))
        ui.advance(0.5)
        field = ui.find(FieldInput)
        ui.type(field, "OT 2")
        ui.wait(lambda: to_do(ui) == ["Robot 2"])
        ui.type(field, "x")
        ui.wait(lambda: to_do(ui) == [])
        assert "Nothing found" in ui.texts()


def test_changes_delayed_by_a_finger_come_no_faster_when_it_leaves(container, ui):
    robots = add_robots(container, 40)
    with shown(container, ui):
        for robot in container.catalogue.robots():
            see(container, robot, sample.READY)
        ui.wait(lambda: counted(ui) == ["43 ready"])
        grid = ui.find(FleetGrid)
        lift = ui.press(grid)
        for robot in robots[:30]:
            see(container, robot, sample.STOPPED)
        ui.advance(0.5)
        assert counted(ui) == ["43 ready"]
        changed, before = [], list(grid.panels)
        grid.bind(panels=lambda _grid, panels: changed.append(sum(a != b for a, b in zip(before, panels, strict=True))))
        grid.bind(panels=lambda _grid, panels: before.__setitem__(slice(None), panels))
        lift(0.1)
        ui.wait(lambda: not ui.find_all(FleetGrid) or counted(ui) == ["13 ready"])
        assert max(changed, default=0) <= 6


def test_the_list_never_comes_under_a_finger(container, robots, ui):
    """Where it comes the buttons of a row could be pressed instead of a cell."""
    with shown(container, ui) as app:
        ui.wait(lambda: counted(ui) == ["6 ready"])
        settle(app, ui)
        lift = ui.press(ui.find(RobotCell, name=robots[5].name))
        see(container, robots[3], sample.STOPPED)
        ui.advance(0.5)
        assert head(ui) == ""
        lift(0.1)
        ui.wait(lambda: tab_shown(ui) == robots[5].name)
        go_back(ui)
        assert head(ui) == "1 needs you"


def test_a_touch_just_after_the_list_has_come_presses_nothing(container, robots, ui):
    with shown(container, ui) as app:
        ui.wait(lambda: counted(ui) == ["6 ready"])
        settle(app, ui)
        see(container, robots[3], sample.FAILED)
        ui.wait(lambda: head(ui) == "1 needs you")
        assert rest.is_on


def test_a_tap_that_was_under_way_to_a_tile_answers_no_question(container, robots, ui, monkeypatch):
    answered: list[object] = []
    monkeypatch.setattr(type(container.operator), "answer_prompt", lambda _self, *what: answered.append(what))
    with shown(container, ui) as app:
        ui.wait(lambda: counted(ui) == ["6 ready"])
        settle(app, ui)
        see(container, robots[2], sample.ASKING)
        ui.wait(lambda: head(ui) == "1 needs you")
        ui.advance(0.6)
        yes = ui.find(RowButton, row_of(ui, robots[2].name), text="Yes")
        ui.tap_at(*yes.to_window(*yes.center))
        settle(app, ui)
        assert answered == []
        ui.tap(yes)
        ui.wait(lambda: answered)


# ---------------------------------------------------------------------- more than fit
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


# ---------------------------------------------------------------------- the wall view
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
        cell = ui.find(RobotCell, name="Aino")
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


# ---------------------------------------------------------------------- a robot that changes under the finger
def other_question() -> RobotStatus:
    return replace(
        sample.ASKING, user_prompt=replace(sample.ASKING.user_prompt, guid="another", question="Drop the load now?")
    )


@pytest.mark.parametrize("held", [0.05, 3.0], ids=["tap", "held"])
@pytest.mark.parametrize(
    ("before", "word", "after", "said"),
    [
        (sample.ASKING, "Yes", other_question(), "{robot} asks something else now"),
        (sample.FAILED, "Reset errors", fleet_facts.PAUSED, "{robot}: nothing sent, its state has changed"),
    ],
    ids=["question", "remedy"],
)
def test_nothing_is_sent_that_was_not_shown_when_the_finger_came_down(
    container, robots, ui, sent, before, word, after, said, held
):
    with shown(container, ui) as app:
        see(container, robots[2], before)
        ui.wait(lambda: head(ui) == "1 needs you")
        settle(app, ui)
        lift = ui.press(ui.find(RowButton, row_of(ui, robots[2].name), text=word))
        see(container, robots[2], after)
        ui.advance(0.1)
        lift(held)
        settle(app, ui)
        assert sent == []
        is_there = held < 1.0  # later the robot has left those that need a person, and its button with it
        assert app.shell.snackbars.texts == [said.format(robot=robots[2].name)] * is_there


@pytest.mark.parametrize(
    ("before", "word", "after", "shows"),
    [
        (sample.ASKING, "Yes", other_question(), "Drop the load now?"),
        (sample.FAILED, "Reset errors", fleet_facts.PAUSED, "Paused"),
    ],
    ids=["question", "remedy"],
)
def test_a_button_that_has_just_become_another_takes_no_tap(container, robots, ui, sent, before, word, after, shows):
    with shown(container, ui) as app:
        see(container, robots[2], before)
        ui.wait(lambda: head(ui) == "1 needs you")
        settle(app, ui)
        button = ui.find(RowButton, row_of(ui, robots[2].name), text=word)
        place = button.to_window(*button.center)
        see(container, robots[2], after)
        ui.wait(lambda: row_of(ui, robots[2].name).item.support.startswith(shows))
        ui.tap_at(*place)
        ui.tap_at(*place)
        settle(app, ui)
        assert sent == []
        ui.advance(STILL)
        ui.tap_at(*place)
        settle(app, ui)
        assert len(sent) == 1
