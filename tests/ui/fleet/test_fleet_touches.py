"""What changes on the page under a finger, or just before it comes down."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.robot import RobotStatus
from app.screens.home.fleet_page import FleetGrid, RobotCell
from app.widgets.list_row import RowButton
from app.widgets.lists import STILL
from app.widgets.rest import rest
from tests.support import fleet_facts
from tests.support import home_facts as sample
from tests.ui.fleet.operator import (
    add_robots,
    counted,
    go_back,
    head,
    row_of,
    see,
    settle,
)
from tests.ui.whole_app import shown, tab_shown


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
        lift = ui.press(ui.find(RobotCell, title=robots[5].name))
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
