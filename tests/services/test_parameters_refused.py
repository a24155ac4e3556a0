"""Parameters that a mission does not have, or values that it can't take: refused at entry by robots' answers, never by
a robot's silence. Others are refused before sending, and nothing is sent."""

from __future__ import annotations

import json
import time
from threading import Event

import pytest

from app.database.missions import MissionParameterRepository
from app.domain.models import InvalidInput, Mission, ReasonCode, State
from app.domain.reasons import sentence
from app.domain.robot import MissionParameter
from app.mir.client import RobotClient
from tests.support.edits import import_file

GO_TO_POSITION = "3d7c7c49-ce85-11ef-904a-000e8e9884eb"
START = "2026-11-23T06:05"


@pytest.fixture
def robot(site):
    site.container.catalogue.change_settings(poll_interval_seconds=1800)  # a day soon passes
    site.run(10)
    return site.container.catalogue.robots()[0]


@pytest.fixture
def mission(site):
    return site.container.catalogue.save_mission(Mission("Go to position", GO_TO_POSITION))


def asked(site) -> list[str]:
    """The questions about a mission's parameters, from now on."""
    seen: list[str] = []
    handle = site.network.fate_of

    def fate_of(robot, method, path):
        if method == "GET" and path.startswith("/missions/"):
            seen.append(f"{robot} {path}")
        return handle(robot, method, path)

    site.network.fate_of = fate_of
    return seen


def take(site, *schedules, **sections):
    return import_file(site.container.catalogue, **sections, schedules=schedules)


def schedule(parameters, **values):
    return {"name": "S", "robot": "R1", "mission": "Go to position", "start": START, "parameters": parameters, **values}


WRONG = [
    ({"Position": "Line 1", "Speed": 1}, "Go to position has no parameter Speed; it takes Position"),
    ({"Position": "Nowhere"}, "Go to position can't take Nowhere for Position: Choose one of "),
    ({"Position": 7}, "Go to position can't take 7 for Position: Choose one of "),
    ({"Position": ""}, "Position is missing: the robot does not start Go to position without it"),
]


@pytest.mark.parametrize(("parameters", "problem"), WRONG)
def test_a_file_is_refused_with_mission_and_parameter(site, robot, mission, parameters, problem):
    with pytest.raises(InvalidInput) as caught:
        take(site, schedule(parameters))
    assert caught.value.text.startswith(f"schedules[0].parameters: {problem}")
    assert site.container.catalogue.schedules() == []


@pytest.mark.parametrize(("parameters", "problem"), WRONG)
def test_run_now_is_refused_with_mission_and_parameter(site, robot, mission, parameters, problem):
    with pytest.raises(InvalidInput) as caught:
        site.container.operator.run_now(robot.id, mission.id, parameters)
    assert caught.value.text.startswith(problem)
    assert site.executions() == []


def test_a_mission_without_parameters_is_given_none(site, robot):
    with pytest.raises(InvalidInput, match="Deliver has no parameter Speed: it takes none"):
        take(site, schedule({"Speed": 1}, mission="Deliver"))


def test_a_schedule_that_is_saved_is_refused_by_what_is_known(site, robot, mission, plan):
    site.container.robot_missions.parameters(robot.id, GO_TO_POSITION)
    with pytest.raises(InvalidInput, match="Go to position has no parameter Speed"):
        plan(START, mission_id=mission.id, parameters={"Speed": 1})


def test_an_idle_mission_may_not_ask_for_anything(site, robot, mission):
    rule = {"name": "R1", "idle": {"mission": "Go to position"}}
    with pytest.raises(
        InvalidInput, match="Go to position asks for Position, which only a schedule or Run now can give"
    ):
        take(site, robots=[rule])
    site.container.robot_missions.parameters(robot.id, GO_TO_POSITION)
    with pytest.raises(InvalidInput, match="Go to position asks for Position"):
        site.container.catalogue.save_idle_rule(robot.id, mission.id)


def test_a_position_is_kept_by_its_name_and_sent_by_its_guid(site, robot, mission):
    """The export has it as entered."""
    take(site, schedule({"Position": "line 1"}))
    assert site.container.catalogue.schedules()[0].parameters == {"Position": "line 1"}
    site.run(900)
    (row,) = site.executions(State.COMPLETED)
    (item,) = site.machines["R1"].queue
    by_name = {
        name: guid for guid, name in site.container.robot_missions.parameters(robot.id, GO_TO_POSITION)[0].choices
    }
    assert (row.parameters, json.loads(json.dumps(item.parameters))) == (
        {"Position": "line 1"},
        [{"input_name": "Position", "value": by_name["Line 1"]}],
    )


# ---------------------------------------------------------------------- robots that do not answer
def test_a_silent_robot_keeps_nothing_from_being_imported(site, mission):
    site.network.down.add("R1")
    take(site, schedule({"Speed": 1}))
    assert [each.parameters for each in site.container.catalogue.schedules()] == [{"Speed": 1}]


def test_a_start_of_which_the_robot_never_said_anything_is_asked_for_and_refused_unsent(site, mission):
    site.network.down.add("R1")
    take(site, schedule({"Speed": 1}))
    site.at(60, lambda: site.network.down.clear())
    site.run(400)
    (row,) = site.executions(State.FAILED)
    assert (row.reason.code, sentence(row.reason, "UTC")) == (
        ReasonCode.REFUSED,
        "The robot refused it: Go to position has no parameter Speed; it takes Position",
    )
    assert site.network.posts() == []


def test_one_that_cannot_be_asked_waits_as_for_any_silent_robot(site, mission):
    site.network.down.add("R1")
    take(site, schedule({"Position": "Line 1"}))
    site.at(300 + 120, lambda: site.network.down.clear())
    site.run(900)
    (row,) = site.executions(State.COMPLETED)
    assert row.submitted_at.minute == 7


def test_it_is_known_after_a_restart(site, robot, mission):
    site.container.robot_missions.parameters(robot.id, GO_TO_POSITION)
    site.switch_off()
    site.network.down.add("R1")
    site.switch_on()
    site.run(10)
    with pytest.raises(InvalidInput, match="Go to position has no parameter Speed"):
        take(site, schedule({"Speed": 1}))


def test_a_mission_that_was_edited_on_the_robot_is_asked_again_before_anything_is_refused(site, robot, mission):
    site.container.parameters.keep({(robot.id, GO_TO_POSITION): (MissionParameter("Old"),)})
    take(site, schedule({"Position": "Line 1"}))
    site.container.parameters.keep({(robot.id, GO_TO_POSITION): (MissionParameter("Old"),)})
    site.run(900)
    assert [row.state for row in site.executions()] == [State.COMPLETED]


def test_a_mission_that_lost_a_parameter_on_the_robot_is_known_to_after_its_first_refusal(site, robot, mission):
    """What was remembered let it pass; the robot answered 500 without a word about the parameter."""
    before = {(robot.id, GO_TO_POSITION): (MissionParameter("Speed", default=1.0),)}
    site.container.parameters.keep(before)
    take(site, schedule({"Speed": 1}, recurrence="FREQ=DAILY"))
    site.run(600)
    (row,) = site.executions(State.FAILED)
    assert (
        sentence(row.reason, "UTC") == "The robot refused it: Go to position has no parameter Speed; it takes Position"
    )
    assert len(site.network.posts()) == 1
    site.run(86_400)
    assert [row.reason.code for row in site.executions(State.FAILED)] == [ReasonCode.REFUSED] * 2
    assert len(site.network.posts()) == 1


# ---------------------------------------------------------------------- what it costs
def test_each_robot_is_asked_once_for_each_mission_of_a_file(site, robot, mission):
    seen = asked(site)
    take(site, *(schedule({"Position": "Line 1"}, name=f"S{number}") for number in range(20)))
    assert seen.count(f"R1 /missions/{GO_TO_POSITION}") == 1
    take(site, schedule({"Position": "Line 2"}, name="S1"))
    assert seen.count(f"R1 /missions/{GO_TO_POSITION}") == 1


def test_starts_without_parameters_ask_nothing(site, robot, plan):
    seen = asked(site)
    plan(START)
    site.run(600)
    assert [row.state for row in site.executions()] == [State.COMPLETED]
    assert seen == []


def test_a_robot_that_has_not_been_asked_yet_is_asked_before_the_instant(site, mission):
    site.network.down.add("R1")
    take(site, schedule({"Position": "Line 1"}))
    site.at(60, lambda: site.network.down.clear())
    site.run(900)
    (post,) = site.network.posts()
    assert 0 <= post.at - 300 < 0.1


def test_a_robot_that_does_not_say_what_a_mission_asks_for_judges_for_itself(site, robot, mission, monkeypatch):
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
    assert time.monotonic() - began < 5


def test_what_can_no_longer_be_read_was_never_said(site, robot, mission):
    site.container.robot_missions.parameters(robot.id, GO_TO_POSITION)
    for text in ("{", "[1]", '[{"name": null}]', "[{}]", "null"):
        site.container.db.write(lambda c, text=text: c.execute("UPDATE mission_parameters SET parameters = ?", (text,)))
        assert MissionParameterRepository().get(site.container.db.read(), robot.id, GO_TO_POSITION) is None


# ---------------------------------------------------------------------- groups
def test_of_a_group_each_robot_gets_its_own_position(hall):
    go = hall.container.catalogue.save_mission(Mission("Go to position", GO_TO_POSITION))
    hall.plan(mission_id=go.id, parameters={"Position": "Line 1"})
    hall.run(900)
    (row,) = hall.executions(State.COMPLETED)
    (item,) = hall.items()
    assert (row.parameters, len(item.parameters[0]["value"])) == ({"Position": "Line 1"}, 36)


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
