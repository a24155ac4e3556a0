"""What a mission asks for, on a simulated robot: positions by name."""

from __future__ import annotations

import pytest

from app.domain.execution import State
from app.domain.models import Mission
from app.mir.errors import RobotError
from tests.support.site import GUIDS

GO_TO_POSITION = GUIDS["Go to position"]


@pytest.fixture
def robot(site):
    return site.container.catalogue.robots()[0]


def asked(site, robot):
    [parameter] = site.container.robot_missions.parameters(robot.id, GO_TO_POSITION)
    return parameter


def test_positions_of_the_robots_map_can_be_chosen_by_name(site, robot, go_to_position):
    site.run(10)
    parameter = asked(site, robot)
    assert parameter.is_position
    names = [name for _guid, name in parameter.choices]
    assert names == sorted(names, key=str.casefold)
    assert "Line 1" in names
    assert parameter.default is None


@pytest.mark.parametrize("named", ["Line 1", "line 1", None])
def test_a_position_is_kept_as_it_was_entered_and_sent_by_its_guid(site, robot, go_to_position, named):
    site.run(10)
    by_name = {name: guid for guid, name in asked(site, robot).choices}
    entered = {"Position": named or by_name["Line 1"]}
    execution = site.container.operator.run_now(robot.id, go_to_position.id, entered)
    assert dict(execution.parameters) == entered
    site.run(600)
    assert site.container.ledger.get(execution.id).state is State.COMPLETED
    (item,) = site.machines["R1"].queue
    assert item.parameters[0]["value"] == by_name["Line 1"]


def test_what_was_said_before_is_known_of_a_robot_that_does_not_answer(site, robot, go_to_position):
    site.run(10)
    said_before, other = site.container.parameters.said_before, robot.id + 1
    assert said_before(robot.id, GO_TO_POSITION) is None
    said = asked(site, robot)
    site.network.down.add("R1")
    site.run(600)
    with pytest.raises(RobotError):
        asked(site, robot)
    assert [said_before(each, GO_TO_POSITION) for each in (robot.id, other)] == 2 * [(said,)]


def test_missions_that_a_robot_lacks_are_not_offered_for_it(site, robot, go_to_position):
    lost = site.container.catalogue.save_mission(Mission("Lost", "00000000-0000-0000-0000-000000000000"))
    missions = site.container.robot_missions
    there = site.container.catalogue.missions_of(robot.id)
    assert missions.offered(robot.id, there) == there  # its list has not been read
    site.run(10)
    assert missions.learn_names(robot.id)
    assert missions.offered(robot.id, there) == [each for each in there if each != lost]
