"""The list beside the cells: who needs a person, and what was counted or looked for; its rows solve problems."""

from __future__ import annotations

from datetime import timedelta

import pytest

from app.database.activities import ActivityRepository
from app.domain.activity import ActivitySpan
from app.domain.models import Connection
from app.screens.home.fleet_page import FleetPage
from app.widgets.buttons import ChoiceChip, IconButton
from app.widgets.fields import FieldInput
from app.window.key_focus import ESCAPE
from tests.support import fleet_facts
from tests.support import home_facts as sample
from tests.ui.fleet.operator import (
    counted,
    head,
    press,
    row_of,
    see,
    settle,
    tiles,
    to_do,
)
from tests.ui.whole_app import shown


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
