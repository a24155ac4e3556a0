"""Parameters that a mission does not have, or values that it can't take: refused at entry by robots' answers, never by
a robot's silence. Others are refused before sending, and nothing is sent."""

from __future__ import annotations

import time
from dataclasses import replace
from threading import Event
from unittest.mock import Mock

import pytest

from app.database import missions
from app.database.missions import MissionParameterRepository
from app.domain.execution import ReasonCode, State
from app.domain.models import InvalidInput, Mission
from app.domain.reasons import sentence
from app.domain.robot import MissionParameter
from app.mir.client import RobotClient
from app.services.catalogue import parameter_check
from tests.support.edits import import_file
from tests.support.seen import requests
from tests.support.site import GUIDS

GO_TO_POSITION = GUIDS["Go to position"]
START = "2026-11-23T06:05"


@pytest.fixture
def robot(site):
    site.container.catalogue.change_settings(poll_interval_seconds=1800)  # a day soon passes
    site.run(10)
    return site.container.catalogue.robots()[0]


def take(site, *schedules, **sections):
    return import_file(site.container.catalogue, **sections, schedules=schedules)


def schedule(parameters, **values):
    return {"name": "S", "robot": "R1", "mission": "Go to position", "start": START, "parameters": parameters, **values}


WRONG = [
    ({"Position": "Line 1", "Speed": 1}, "Go to position has no parameter Speed, it takes Position"),
    ({"Position": "Nowhere"}, "Go to position can't take Nowhere for Position: Choose one of "),
    ({"Position": 7}, "Go to position can't take 7 for Position: Choose one of "),
    ({"Position": ""}, "Position is missing: the robot does not start Go to position without it"),
    ({"Position": None}, "Position is missing: the robot does not start Go to position without it"),
]


@pytest.mark.parametrize(("parameters", "problem"), WRONG)
def test_a_file_is_refused_with_mission_and_parameter(site, robot, go_to_position, parameters, problem):
    with pytest.raises(InvalidInput, match=rf"^schedules\[0\].parameters: {problem}"):
        take(site, schedule(parameters))
    assert site.container.catalogue.schedules() == []


@pytest.mark.parametrize(("parameters", "problem"), WRONG)
def test_run_now_is_refused_with_mission_and_parameter(site, robot, go_to_position, parameters, problem):
    with pytest.raises(InvalidInput, match=f"^{problem}"):
        site.container.operator.run_now(robot.id, go_to_position.id, parameters)
    assert site.executions() == []


def test_a_mission_without_parameters_is_given_none(site, robot):
    with pytest.raises(InvalidInput, match="Deliver has no parameter Speed: it takes none"):
        take(site, schedule({"Speed": 1}, mission="Deliver"))


def test_what_is_known_refuses_a_schedule_and_run_now_without_asking(site, robot, go_to_position, plan):
    site.container.robot_missions.parameters(robot.id, GO_TO_POSITION)
    with pytest.raises(InvalidInput, match="Go to position has no parameter Speed"):
        plan(START, mission_id=go_to_position.id, parameters={"Speed": 1})
    with pytest.raises(InvalidInput, match="Position is missing"):
        site.container.operator.run_now(robot.id, go_to_position.id)


def test_what_is_planned_and_would_be_refused_is_known_before_its_time(site, robot, go_to_position, plan):
    catalogue = site.container.catalogue
    saved = plan(START, mission_id=go_to_position.id)  # before its robot has said what the mission needs
    assert catalogue.refused() == {}
    site.container.robot_missions.parameters(robot.id, GO_TO_POSITION)
    assert list(catalogue.refused()) == [saved.id]
    assert str(catalogue.refused()[saved.id]).startswith("Position is missing")
    catalogue.switch_schedule(saved.id, False)
    assert catalogue.refused() == {}


def test_an_idle_mission_may_not_ask_for_anything(site, robot, go_to_position):
    rule = {"name": "R1", "idle": {"mission": "Go to position"}}
    with pytest.raises(
        InvalidInput, match="Go to position asks for Position, which only a schedule or Run now can give"
    ):
        take(site, robots=[rule])
    site.container.robot_missions.parameters(robot.id, GO_TO_POSITION)
    with pytest.raises(InvalidInput, match="Go to position asks for Position"):
        site.container.catalogue.change_idle_rule(robot.id, mission_id=go_to_position.id)


@pytest.mark.parametrize("values", [{}, {"Position": "Nowhere"}])
def test_what_one_robot_says_refuses_nothing_of_another_that_has_said_nothing(hall, values):
    go = hall.container.catalogue.save_mission(Mission("Go to position", GO_TO_POSITION))
    group, alone = (hall.plan(name, mission_id=go.id, parameters=values) for name in ("Group", "Alone"))
    first, *others = (robot.id for robot in hall.container.catalogue.robots())
    hall.container.catalogue.save_schedule(replace(alone, robot_id=others[-1], group_id=None))
    found = (MissionParameter("Position", sets="position", choices=(("g-1", "Line 1"),)),)
    hall.container.parameters.keep({(first, GO_TO_POSITION): found})
    assert hall.container.catalogue.refused() == {}
    hall.container.parameters.keep({(robot_id, GO_TO_POSITION): found for robot_id in others})
    assert set(hall.container.catalogue.refused()) == {group.id, alone.id}


def test_equal_schedules_are_judged_once_and_answers_are_read_once(hall, monkeypatch):
    catalogue = hall.container.catalogue
    for number in range(20):
        hall.plan(f"S{number}", parameters={"Speed": 1})
    hall.container.parameters.keep({(robot.id, GUIDS["Deliver"]): () for robot in catalogue.robots()})
    hall.switch_off()
    hall.switch_on()
    judged, read = Mock(wraps=parameter_check.values_for), Mock(wraps=missions.decoded)
    monkeypatch.setattr(parameter_check, "values_for", judged)
    monkeypatch.setattr(missions, "decoded", read)
    for reading in (1, 2):
        assert len(hall.container.catalogue.refused()) == 20
        assert (judged.call_count, read.call_count) == (3 * reading, 3)


# ---------------------------------------------------------------------- robots that do not answer
def test_a_silent_robot_keeps_nothing_from_being_imported(site, go_to_position):
    site.network.down.add("R1")
    take(site, schedule({"Speed": 1}))
    assert [each.parameters for each in site.container.catalogue.schedules()] == [{"Speed": 1}]


def test_a_start_of_which_the_robot_never_said_anything_is_asked_for_and_refused_unsent(site, go_to_position):
    site.network.down.add("R1")
    take(site, schedule({"Speed": 1}))
    site.at(60, lambda: site.network.down.clear())
    site.run(400)
    (row,) = site.executions(State.FAILED)
    assert (row.reason.code, sentence(row.reason, "UTC")) == (
        ReasonCode.REFUSED,
        "It was refused: Go to position has no parameter Speed, it takes Position",
    )
    assert site.network.posts() == []


def test_a_start_without_what_its_mission_needs_is_refused_unsent(site, go_to_position):
    site.network.down.add("R1")
    take(site, schedule({}))
    site.network.down.clear()
    site.container.robot_missions.parameters(site.container.catalogue.robots()[0].id, GO_TO_POSITION)
    site.run(400)
    (row,) = site.executions(State.FAILED)
    assert sentence(row.reason, "UTC") == (
        "It was refused: Position is missing: the robot does not start Go to position without it"
    )
    assert site.network.posts() == []


def test_one_that_cannot_be_asked_waits_as_for_any_silent_robot(site, go_to_position):
    site.network.down.add("R1")
    take(site, schedule({"Position": "Line 1"}))
    site.at(300 + 120, lambda: site.network.down.clear())
    site.run(900)
    assert site.the_row(State.COMPLETED).submitted_at.minute == 7


def test_it_is_known_after_a_restart(site, robot, go_to_position):
    site.container.robot_missions.parameters(robot.id, GO_TO_POSITION)
    site.switch_off()
    site.network.down.add("R1")
    site.switch_on()
    site.run(10)
    with pytest.raises(InvalidInput, match="Go to position has no parameter Speed"):
        take(site, schedule({"Speed": 1}))


def test_a_mission_that_was_edited_on_the_robot_is_asked_again_before_anything_is_refused(site, robot, go_to_position):
    site.container.parameters.keep({(robot.id, GO_TO_POSITION): (MissionParameter("Old"),)})
    take(site, schedule({"Position": "Line 1"}))
    site.container.parameters.keep({(robot.id, GO_TO_POSITION): (MissionParameter("Old"),)})
    assert site.states(after=900) == [State.COMPLETED]


@pytest.mark.long
def test_a_mission_that_lost_a_parameter_on_the_robot_is_known_to_after_its_first_refusal(site, robot, go_to_position):
    """What was remembered let it pass; the robot answered 500 without a word about the parameter."""
    before = {(robot.id, GO_TO_POSITION): (MissionParameter("Speed", default=1.0),)}
    site.container.parameters.keep(before)
    take(site, schedule({"Speed": 1}, recurrence="FREQ=DAILY"))
    site.run(600)
    (row,) = site.executions(State.FAILED)
    assert sentence(row.reason, "UTC") == "It was refused: Go to position has no parameter Speed, it takes Position"
    assert len(site.network.posts()) == 1
    site.run(86_400)
    assert [row.reason.code for row in site.executions(State.FAILED)] == [ReasonCode.REFUSED] * 2
    assert len(site.network.posts()) == 1


# ---------------------------------------------------------------------- what it costs
def test_each_robot_is_asked_once_for_each_mission_of_a_file(site, robot, go_to_position):
    asked = requests(site)
    take(site, *(schedule({"Position": "Line 1"}, name=f"S{number}") for number in range(20)))
    take(site, schedule({"Position": "Line 2"}, name="S1"))
    assert asked.count(f"GET /missions/{GO_TO_POSITION}") == 1


def test_starts_without_parameters_ask_nothing(site, robot, plan):
    asked = requests(site)
    plan(START)
    assert site.states(after=600) == [State.COMPLETED]
    assert [request for request in asked if "/missions/" in request] == []


def test_a_robot_that_has_not_been_asked_yet_is_asked_before_the_instant(site, go_to_position):
    site.network.down.add("R1")
    take(site, schedule({"Position": "Line 1"}))
    site.at(60, lambda: site.network.down.clear())
    site.run(900)
    assert [0 <= post.at - 300 < 0.1 for post in site.network.posts()] == [True]


def test_a_robot_that_does_not_say_what_a_mission_asks_for_judges_for_itself(site, robot, go_to_position, monkeypatch):
    """Software that offers neither the definition of a mission nor its actions."""
    monkeypatch.setattr(RobotClient, "parameters", lambda _client, _guid: None)
    take(site, schedule({"Speed": 1}))
    site.run(900)
    (row,) = site.executions(State.FAILED)
    assert (row.reason.code, len(site.network.posts())) == (ReasonCode.REFUSED, 1)
    assert "the robot answered: Internal server error (status 500)" in sentence(row.reason, "UTC")


def test_robots_that_hang_hold_up_a_file_for_some_seconds_at_most(hall, monkeypatch):
    waits = Event()
    monkeypatch.setattr(RobotClient, "parameters", lambda _client, _guid: [] if waits.wait(30) else None)
    began = time.monotonic()
    assert (
        hall.container.parameters.ask([(robot, ["a", "b"]) for robot in hall.container.catalogue.robots()], within=0.3)
        == {}
    )
    waits.set()
    assert time.monotonic() - began < 20


def test_what_can_no_longer_be_read_was_never_said(site, robot, go_to_position):
    site.container.robot_missions.parameters(robot.id, GO_TO_POSITION)
    for text in ("{", "[1]", '[{"name": null}]', "[{}]", "null"):
        site.container.db.write(lambda c, text=text: c.execute("UPDATE mission_parameters SET parameters = ?", (text,)))
        assert MissionParameterRepository().get(site.container.db.read(), robot.id, GO_TO_POSITION) is None


# ---------------------------------------------------------------------- groups
def test_of_a_group_each_robot_gets_its_own_position(hall):
    go = hall.container.catalogue.save_mission(Mission("Go to position", GO_TO_POSITION))
    hall.plan(mission_id=go.id, parameters={"Position": "Line 1"})
    hall.run(900)
    (item,) = hall.items()
    sent = item.parameters[0]["value"]
    assert (hall.the_row(State.COMPLETED).parameters, len(sent)) == ({"Position": "Line 1"}, 36)


def test_a_group_of_which_no_robot_takes_it_refuses_it(hall):
    hall.container.catalogue.save_mission(Mission("Go to position", GO_TO_POSITION))
    hall.run(10)
    with pytest.raises(InvalidInput, match="Go to position has no parameter Speed"):
        take(
            hall,
            {"name": "G", "group": "Hall", "mission": "Go to position", "start": START, "parameters": {"Speed": 1}},
        )
    hall.plan(mission_id=1, parameters={"Speed": 1})  # nothing is known of Deliver
    hall.run(900)
    row = hall.run_of("A")
    assert (row.reason.code, hall.network.posts()) == (ReasonCode.REFUSED, [])
    assert "Deliver has no parameter Speed" in sentence(row.reason, "UTC")
