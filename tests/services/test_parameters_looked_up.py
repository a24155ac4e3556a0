"""Positions that are entered by name: each start gets the position that has that name on its robot, on the map it is on then."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.execution import ReasonCode, State
from app.domain.robot import MissionParameter
from app.mir.client import RobotClient
from app.mir.errors import AnotherRobot, NotAMir, Unauthorized
from tests.support.edits import import_file
from tests.support.examples import at_night
from tests.support.seen import requests
from tests.support.site import GUIDS

GO_TO_POSITION = GUIDS["Go to position"]
HALL_B = "22222222-ce85-11ef-904a-000e8e9884eb"
NEW_GUID = "11111111-ce85-11ef-904a-000e8e9884eb"
START = "2026-11-23T06:05"
DAY = 86_400


@pytest.fixture(autouse=True)
def robot(site):
    site.container.catalogue.change_settings(poll_interval_seconds=1800)  # a day soon passes
    site.run(10)
    return site.container.catalogue.robots()[0]


@pytest.fixture
def positions(site):
    return site.machines["R1"].site.table("/positions")


@pytest.fixture
def line_1(positions):
    return next(row for row in list(positions) if row["name"] == "Line 1")


@pytest.fixture
def hall_b(site, positions, line_1):
    """A second map of the robot's, which has a Line 1 too."""
    maps = site.machines["R1"].site.table("/maps")
    maps.add({**next(iter(maps)), "guid": HALL_B, "name": "Hall B"})
    positions.add({**line_1, "guid": NEW_GUID, "map_id": HALL_B})


def take(site, parameters, **values):
    schedule = {"name": "S", "robot": "R1", "mission": "Go to position", "start": START, **values}
    import_file(site.container.catalogue, schedules=[schedule | {"parameters": parameters}])


def sent(site, after=0.0) -> list[object]:
    site.run(after)
    return [item.parameters[0]["value"] for item in site.machines["R1"].queue]


def test_a_robot_that_has_changed_its_map_goes_to_the_position_on_that_map(site, go_to_position, line_1, hall_b):
    take(site, {"Position": "Line 1"}, recurrence="FREQ=DAILY")
    site.run(600)
    site.machines["R1"].map_id = HALL_B
    assert sent(site, after=DAY) == [line_1["guid"], NEW_GUID]


@pytest.mark.long
def test_a_robot_that_changes_its_map_just_before_the_start_is_asked_again(site, go_to_position, line_1, hall_b):
    take(site, {"Position": "Line 1"}, start="2026-11-23T06:10")
    site.container.robot_missions.parameters(1, GO_TO_POSITION)
    site.run(585)
    site.container.parameters.learn(
        1, GO_TO_POSITION, client := site.container.make_client(site.container.catalogue.robots()[0])
    )
    client.close()
    site.machines["R1"].map_id = HALL_B
    assert sent(site, after=60) == [NEW_GUID]


def test_a_position_that_was_deleted_and_made_again_is_found_by_its_name(site, go_to_position, positions, line_1):
    take(site, {"Position": "Line 1"}, recurrence="FREQ=DAILY")
    site.run(600)
    positions.remove(line_1["guid"])
    positions.add({**line_1, "guid": NEW_GUID})
    site.switch_off()
    site.switch_on()
    assert sent(site, after=DAY) == [line_1["guid"], NEW_GUID]
    assert {row.state for row in site.executions()} == {State.COMPLETED}


@pytest.mark.long
def test_it_is_looked_up_before_the_instant(site, go_to_position, line_1):
    take(site, {"Position": "Line 1"}, recurrence="FREQ=DAILY")
    site.run(DAY + 600)
    assert all(0 <= post.at % 300 < 0.1 for post in site.network.posts())
    assert len(site.network.posts()) == 2


@pytest.mark.long
def test_a_position_by_its_guid_is_asked_for_once_only(site, go_to_position, line_1):
    take(site, {"Position": line_1["guid"]}, recurrence="FREQ=DAILY")
    site.run(600)
    asked = requests(site)
    assert sent(site, after=DAY) == [line_1["guid"]] * 2
    assert [request for request in asked if "/missions/" in request or "/positions" in request] == []


def test_a_robot_that_answers_400_is_asked_what_the_mission_needs_now(site, robot, go_to_position, line_1):
    """It was remembered as a text: the first start takes the name along, and the next one the position."""
    site.container.parameters.keep({(robot.id, GO_TO_POSITION): (MissionParameter("Position"),)})
    take(site, {"Position": "Line 1"}, recurrence="FREQ=DAILY")
    site.run(600)
    assert (site.the_row(State.FAILED).reason.code, len(site.network.posts())) == (ReasonCode.REFUSED, 1)
    site.run(DAY)
    assert (len(site.executions(State.COMPLETED)), sent(site)) == (1, [line_1["guid"]])


def test_what_another_machine_has_said_is_forgotten_with_its_serial_number(site, robot, go_to_position):
    site.container.robot_missions.parameters(robot.id, GO_TO_POSITION)
    stored = site.container.catalogue.robots()[0]
    site.container.catalogue.save_robot(replace(stored, serial_number="another"), "secret")
    site.run(5)
    assert site.container.parameters.known(robot.id, GO_TO_POSITION) is None
    assert site.container.db.read().execute("SELECT count(*) FROM mission_parameters").fetchone()[0] == 0


# ---------------------------------------------------------------------- robots that do not say it
@pytest.mark.parametrize("error", [Unauthorized(status=403), NotAMir(code="web_page")], ids=["no rights", "a web page"])
@pytest.mark.parametrize("call", ["positions", *at_night("mission", "_parameters")])
def test_a_robot_that_keeps_it_from_this_user_judges_for_itself(site, go_to_position, line_1, monkeypatch, call, error):
    def refused(*_args: object, **_values: object) -> None:
        raise error

    monkeypatch.setattr(RobotClient, call, refused)
    take(site, {"Position": line_1["guid"]})
    site.run(900)
    assert (site.the_row(State.COMPLETED).attempts, sent(site)) == (1, [line_1["guid"]])


@pytest.mark.long
def test_another_robot_is_sent_nothing(site, go_to_position, line_1, monkeypatch):
    def refused(*_args: object, **_values: object) -> None:
        raise AnotherRobot(expected="1", found="2")

    monkeypatch.setattr(RobotClient, "parameters", refused)
    take(site, {"Position": line_1["guid"]})
    site.run(900)
    assert (site.the_row(State.FAILED).reason.code, site.network.posts()) == (ReasonCode.WRONG_ROBOT, [])


# ---------------------------------------------------------------------- defaults
def test_a_default_on_another_map_is_a_default(site, go_to_position, line_1, hall_b, monkeypatch):
    monkeypatch.setattr(
        RobotClient,
        "parameters",
        lambda _client, _guid: [
            MissionParameter("Position", default=line_1["guid"], sets="position"),
            MissionParameter("Speed", default=1.0),
        ],
    )
    site.machines["R1"].map_id = HALL_B
    site.network.down.add("R1")
    take(site, {"Speed": 2.0})
    site.at(60, lambda: site.network.down.clear())
    site.run(900)
    assert len(site.network.posts()) == 1
