"""Each call: what it sends, what it makes of the answer. Without sockets; tests/integration/mir has those."""

import json
import re
import traceback
from collections.abc import Callable
from typing import Any

import pytest
import requests
import urllib3
from responses import RequestsMock, matchers

from app.domain.robot import MapPosition, MissionInfo, MissionParameter, Pose, RobotState, Spot
from app.mir.client import RobotClient
from app.mir.errors import (
    Busy,
    Delivery,
    NotAMir,
    Rejected,
    RobotError,
    RobotFault,
    Unauthorized,
    Unreadable,
)
from tests.support.errors import raises
from tests.unit.mir.answers import MAP, MISSION, STATUS, item
from tests.unit.mir.conftest import TOKEN
from tests.unit.mir.test_parse import PNG

API = "http://robot.test/api/v2.0.0"


def sent(responses: RequestsMock, number: int = -1) -> requests.PreparedRequest:
    return responses.calls[number].request


def body(responses: RequestsMock, number: int = -1) -> Any:
    return json.loads(sent(responses, number).body)


# ---------------------------------------------------------------------- who and how
def test_status(robot: RobotClient, responses: RequestsMock) -> None:
    responses.get(
        f"{API}/status", json=STATUS, headers={"Robot-Version": "2.13.1.4", "Date": "Thu, 07 Dec 2023 10:54:31 GMT"}
    )
    status = robot.status()
    assert (status.robot_name, status.state, status.software) == ("R1", RobotState.EXECUTING, "2.13.1.4")
    assert status.date.isoformat() == "2023-12-07T10:54:31+00:00"
    assert 0 <= status.elapsed_s < 5


def test_identify_asks_with_credentials(robot: RobotClient, responses: RequestsMock) -> None:
    responses.get(f"{API}/status", json=STATUS)
    responses.get(f"{API}/users/me", json={"guid": "u", "name": "Distributor"})
    responses.get(f"{API}/software/system_status", json=[{"application_version": "3.5.4"}])
    identity = robot.identify()
    assert (identity.name, identity.model, identity.serial_number) == ("R1", "MiR100", "200100000000000")
    assert (identity.user_name, identity.software) == ("Distributor", "3.5.4")


def test_identify_takes_the_version_from_the_header_when_there_is_one(
    robot: RobotClient, responses: RequestsMock
) -> None:
    responses.get(f"{API}/status", json=STATUS, headers={"Robot-Version": "2.13.1.4"})
    responses.get(f"{API}/users/me", json=[{"guid": "u", "name": "Admin"}])
    assert robot.identify().software == "2.13.1.4"


@pytest.mark.parametrize("password_holds", [True, False])
def test_a_robot_without_users_me_is_asked_for_its_queue(
    robot: RobotClient, responses: RequestsMock, password_holds: bool
) -> None:
    responses.get(f"{API}/status", json={**STATUS, "serial_number": None, "robot_model": ""})
    responses.get(f"{API}/users/me", status=404)
    responses.get(f"{API}/mission_queue", json=[] if password_holds else {}, status=200 if password_holds else 401)
    if password_holds:
        responses.get(f"{API}/software/system_status", status=404)
        identity = robot.identify()
        assert (identity.user_name, identity.software, identity.serial_number, identity.model) == ("", None, None, None)
    else:
        with pytest.raises(Unauthorized):
            robot.identify()


@pytest.mark.parametrize(
    ("status", "text", "kind", "says"),
    [
        *(
            (status, "not here", NotAMir, f"answers, but not like a MiR robot .* .status {status}")
            for status in (404, 405, 410)
        ),
        *(
            (200, text, NotAMir, "answers with a web page")
            for text in ("<html><body>Sign in</body></html>", "\n <!DOCTYPE html>", "\ufeff<html>")
        ),
        *(
            (200, text, Unreadable, "^robot.test gave an answer that can't be read: it ")
            for text in ("", "noise", "{", "NaN", '{"state_id": NaN}', "[" * 100_000, '{"state_id": 3, "state_id": 4}')
        ),
    ],
    ids=lambda value: value[:12] if isinstance(value, str) else None,
)
def test_what_answers_otherwise_is_no_mir_or_can_not_be_read(
    robot: RobotClient, responses: RequestsMock, status: int, text: str, kind: type[Exception], says: str
) -> None:
    responses.get(f"{API}/status", status=status, body=text)
    with pytest.raises(kind, match=says):
        robot.status()


# ---------------------------------------------------------------------- missions
def test_missions(robot: RobotClient, responses: RequestsMock) -> None:
    responses.get(
        f"{API}/missions",
        json=[
            {"url": f"/v2.0.0/missions/{MISSION}", "guid": MISSION, "name": "Deliver\n"},
            {"name": "no guid"},
            {"guid": "g", "name": None},
        ],
    )
    assert robot.missions() == [
        MissionInfo(MISSION, "Deliver"),
        MissionInfo("g", "g"),
    ]


def test_a_guid_cannot_lead_anywhere_else(robot: RobotClient, responses: RequestsMock) -> None:
    responses.get(f"{API}/missions/..%2Fstatus%3Fx%3D%3F", status=404)
    with pytest.raises(Rejected):
        robot.mission("../status?x=\ud800")


def test_parameters_are_asked_for_where_the_mission_says(robot: RobotClient, responses: RequestsMock) -> None:
    responses.get(
        f"{API}/missions/{MISSION}",
        json={
            "guid": MISSION,
            "name": "Deliver",
            "has_user_parameters": True,
            "definition": "/v2.0.0/missions/elsewhere/definition",
        },
    )
    responses.get(
        f"{API}/missions/elsewhere/definition",
        json=[{"parameters": [{"id": "goal", "name": "Goal", "type": "Reference"}]}],
    )
    responses.get(f"{API}/missions/{MISSION}/actions", status=404)
    assert robot.parameters(MISSION) == [MissionParameter("goal", "Goal", "Reference")]


def test_the_actions_say_what_a_parameter_sets(robot: RobotClient, responses: RequestsMock) -> None:
    responses.get(f"{API}/missions/{MISSION}", json={"guid": MISSION, "name": "Deliver"})
    responses.get(
        f"{API}/missions/{MISSION}/definition",
        json=[
            {
                "parameters": [
                    {"id": "goal", "name": "Goal", "type": "Reference"},
                    {"id": "charge", "type": "Integer", "constraints": {"minimum": 20}},
                    {"id": "note", "type": "String"},
                ]
            }
        ],
    )
    responses.get(
        f"{API}/missions/{MISSION}/actions",
        json=[
            {
                "parameters": [
                    {"id": "position", "input_name": "goal", "value": None},
                    {"id": "minimum_percentage", "input_name": "charge", "value": 50},
                ]
            }
        ],
    )
    goal, charge, note = robot.parameters(MISSION)
    assert (goal.sets, goal.is_position, charge.is_position, note.sets) == ("position", True, False, "")
    assert (charge.unit, charge.minimum, charge.maximum) == ("%", 20, 100)


def test_parameters_are_found_in_the_actions_when_the_definition_has_none(
    robot: RobotClient, responses: RequestsMock
) -> None:
    responses.get(f"{API}/missions/{MISSION}", json={"guid": MISSION, "name": "Deliver"})
    responses.get(f"{API}/missions/{MISSION}/definition", status=404)
    responses.get(
        f"{API}/missions/{MISSION}/actions", json=[{"parameters": [{"id": "x", "input_name": "Where", "value": 2.0}]}]
    )
    assert robot.parameters(MISSION) == [MissionParameter("Where", type="x", default=2.0, sets="x", unit="m")]


def test_a_mission_without_parameters_is_asked_no_further(robot: RobotClient, responses: RequestsMock) -> None:
    responses.get(f"{API}/missions/{MISSION}", json={"guid": MISSION, "name": "Deliver", "has_user_parameters": False})
    assert robot.parameters(MISSION) == []


# ---------------------------------------------------------------------- queueing
def test_enqueue(robot: RobotClient, responses: RequestsMock) -> None:
    responses.post(
        f"{API}/mission_queue", status=201, json={"id": 724, "state": "Pending", "url": "/v2.0.0/mission_queue/724"}
    )
    assert robot.enqueue(MISSION, description="token", text="Morning" * 100, priority=2, parameters={"count": 3}) == 724
    assert body(responses) == {
        "mission_id": MISSION,
        "description": "token",
        "message": ("Morning" * 100)[:200],
        "priority": 2,
        "parameters": [{"input_name": "count", "value": 3}],
    }


def test_enqueue_omits_unset_fields(robot: RobotClient, responses: RequestsMock) -> None:
    responses.post(f"{API}/mission_queue", status=201, json=item(1))
    assert robot.enqueue(MISSION) == 1
    assert body(responses) == {"mission_id": MISSION, "priority": 0}


@pytest.mark.parametrize("value", [float("nan"), float("inf"), object(), b"x"])
def test_parameters_that_are_no_json_are_refused_before_anything_is_sent(
    robot: RobotClient, responses: RequestsMock, value: Any
) -> None:
    with raises(Rejected, delivery=Delivery.REFUSED):
        robot.enqueue(MISSION, parameters={"x": value})
    assert len(responses.calls) == 0


NOT_ACCEPTED: list[tuple[int, str]] = [
    (201, ""),
    (201, "null"),
    (201, "[]"),
    (201, "{}"),
    (201, '{"id": null}'),
    (201, '{"id": "7"}'),
    (201, '{"id": 7.0}'),
    (201, '{"id": true}'),
    (201, '{"id": -1}'),
    (201, '[{"id": 7}]'),
    (201, '{"id": 7, "id": 8}'),
    (201, '{"id": 7, "x": NaN}'),
    (201, '{"id": 7'),
    (201, '{"id": 9999999999999999999}'),
    (201, "<html>Sign in</html>"),
    (200, '{"id": 7}'),
    (202, '{"id": 7}'),
    (204, ""),
    (206, '{"id": 7}'),
]


@pytest.mark.parametrize(("status", "text"), NOT_ACCEPTED)
def test_only_201_with_an_integer_id_is_accepted(
    robot: RobotClient, responses: RequestsMock, status: int, text: str
) -> None:
    responses.post(f"{API}/mission_queue", status=status, body=text)
    with raises((Unreadable, NotAMir), delivery=Delivery.UNKNOWN):
        robot.enqueue(MISSION)


def test_an_unknown_queue_item(robot: RobotClient, responses: RequestsMock) -> None:
    responses.get(f"{API}/mission_queue/723", status=404, json={"error_code": "not_found", "error_human": "Not found"})
    with raises(Rejected, status=404, reason="Not found"):
        robot.queue_item(723)


# ---------------------------------------------------------------------- the robot
@pytest.mark.parametrize(
    ("call", "expected"),
    [
        (lambda robot: robot.set_state(RobotState.PAUSE), {"state_id": 4}),
        (lambda robot: robot.set_state(RobotState.READY), {"state_id": 3}),
        (lambda robot: robot.clear_error(), {"clear_error": True}),
        (lambda robot: robot.answer_prompt("g-1", "Y" * 255), {"guid": "g-1", "answer": "Y" * 255}),
    ],
)
def test_putting_the_status(
    robot: RobotClient, responses: RequestsMock, call: Callable[[RobotClient], Any], expected: Any
) -> None:
    responses.put(f"{API}/status", json=STATUS)
    assert call(robot).robot_name == "R1"
    assert body(responses) == expected
    assert len(responses.calls) == 1  # clear_error doesn't set the robot going


def test_a_status_change_with_an_unexpected_answer_counts_as_done(robot: RobotClient, responses: RequestsMock) -> None:
    responses.put(f"{API}/status", json={"state": "ok"})
    assert robot.clear_error() is None


def test_map_and_positions(robot: RobotClient, responses: RequestsMock) -> None:
    responses.get(
        f"{API}/maps/{MAP}", json={"guid": MAP, "name": "Hall", "base_map": PNG, "resolution": 0.05, "origin_x": 1}
    )
    responses.get(
        f"{API}/maps/{MAP}/positions",
        json=[
            {"guid": "p", "name": "Dock", "type_id": 7, "pos_x": 1.5, "pos_y": -2, "orientation": 90},
            {"guid": "q", "name": "Door"},
            {},
        ],
    )
    responses.get(f"{API}/positions", json=[{"guid": "r", "name": "A", "map_id": "m"}])
    assert robot.map(MAP).name == "Hall"
    assert robot.positions(MAP) == [
        MapPosition("p", "Dock", 7, MAP, Pose(1.5, -2.0, 90.0)),
        MapPosition("q", "Door", None, MAP),
    ]
    assert robot.positions() == [MapPosition("r", "A", None, "m")]


def test_one_position_comes_with_its_coordinates(robot: RobotClient, responses: RequestsMock) -> None:
    responses.get(
        f"{API}/positions/p",
        json={"guid": "p", "name": "Dock", "type_id": 11, "map_id": "m", "pos_x": 1.5, "pos_y": -2, "orientation": 90},
    )
    responses.get(f"{API}/positions/q", json={"guid": "q", "name": "Door", "map": "/v2.0.0/maps/m"})
    responses.get(f"{API}/positions/r", json={"name": "Nowhere"})
    assert (robot.position("p").spot, robot.position("p").name) == (Spot("m", 1.5, -2.0), "Dock")
    assert robot.position("q").spot is None
    with pytest.raises(Unreadable):
        robot.position("r")


# ---------------------------------------------------------------------- errors
STATUSES: list[tuple[int, type[RobotError], Delivery]] = [
    *((status, Rejected, Delivery.REFUSED) for status in (400, 404, 405, 409, 410, 418, 422)),
    *((status, Rejected, Delivery.UNKNOWN) for status in (408, 425, 429)),
    (401, Unauthorized, Delivery.REFUSED),
    (403, Unauthorized, Delivery.REFUSED),
    *((status, RobotFault, Delivery.UNKNOWN) for status in (500, 501, 502, 504, 599)),
    (503, Busy, Delivery.UNKNOWN),
    *((status, NotAMir, Delivery.UNKNOWN) for status in (300, 301, 302, 303, 307, 308)),
]


@pytest.mark.parametrize(("status", "kind", "delivery"), STATUSES)
def test_every_status_of_failure(
    robot: RobotClient, responses: RequestsMock, status: int, kind: type[RobotError], delivery: Delivery
) -> None:
    responses.post(
        f"{API}/mission_queue",
        status=status,
        headers={"Location": "http://elsewhere.test/login"},
        json={"error_code": "word", "error_human": "Some text"},
    )
    with pytest.raises(RobotError) as failed:
        robot.enqueue(MISSION)
    assert type(failed.value) is kind
    assert failed.value.delivery is delivery
    assert len(responses.calls) == 1
    if kind is NotAMir:
        assert failed.value.params["target"] == "http://elsewhere.test/login"
    elif kind is not Unauthorized:
        assert failed.value.reason == "Some text"  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    "text", ["", "null", "[]", "5", "<html>", "{", '{"error_human": 5}', '{"error_human": null, "error_code": []}']
)
def test_an_error_without_readable_words(robot: RobotClient, responses: RequestsMock, text: str) -> None:
    responses.post(f"{API}/mission_queue", status=400, body=text)
    with raises(Rejected, text="robot.test refused (status 400)"):
        robot.enqueue(MISSION)


@pytest.mark.parametrize(
    "call",
    [
        lambda robot: robot.missions(),
        lambda robot: robot.mission(MISSION),
        lambda robot: robot.queue_item(5),
        lambda robot: robot.open_items(),
        lambda robot: robot.items_after(5),
        lambda robot: robot.highest_queue_id(),
        lambda robot: robot.map(MAP),
        lambda robot: robot.positions(),
        lambda robot: robot.status(),
    ],
)
@pytest.mark.parametrize("text", ['"text"', "5", "null", "true", '{"a": 1}', "[5]", "[null]", '[{"id": "x"}]', "[[]]"])
def test_an_answer_of_the_wrong_shape(
    robot: RobotClient, responses: RequestsMock, call: Callable[[RobotClient], Any], text: str
) -> None:
    responses.assert_all_requests_are_fired = False
    responses.get(re.compile(f"{API}/.*"), body=text)
    responses.post(re.compile(f"{API}/.*"), body=text, status=201)
    try:
        found = call(robot)
    except (Unreadable, NotAMir):
        return
    assert found == []  # lists skip entries without an identity


def test_the_search_is_asked_as_clients_on_robots_do(robot: RobotClient, responses: RequestsMock) -> None:
    responses.post(
        f"{API}/mission_queue/search",
        status=201,
        json=[item(7, "Pending")],
        match=[
            matchers.query_param_matcher({"whitelist": "all", "sort_by": "id,desc", "limit": "200", "offset": "0"}),
            matchers.json_params_matcher(
                {"filters": [{"fieldname": "state", "operator": "IN", "value": ["Pending", "Executing"]}]}
            ),
        ],
    )
    assert [found.id for found in robot.open_items()] == [7]


# ---------------------------------------------------------------------- what requests would add
@pytest.mark.parametrize("status", [413, 429, 503])
def test_an_answer_that_asks_for_a_retry_gets_none(robot: RobotClient, responses: RequestsMock, status: int) -> None:
    for method in (responses.get, responses.put):
        method(f"{API}/status", status=status, headers={"Retry-After": "0"})
    for call in (robot.status, robot.clear_error):
        with pytest.raises(RobotError):
            call()
    assert len(responses.calls) == 2


RAISED = [
    requests.ConnectionError,
    requests.ReadTimeout,
    requests.exceptions.ChunkedEncodingError,
    requests.exceptions.InvalidHeader,
    requests.exceptions.ContentDecodingError,
    urllib3.exceptions.HTTPError,
    ValueError,
    ConnectionResetError,
]


@pytest.mark.parametrize("kind", RAISED)
def test_whatever_requests_raises_leaves_the_outcome_unknown_and_shows_no_secret(
    robot: RobotClient, responses: RequestsMock, kind: type[Exception]
) -> None:
    responses.post(f"{API}/mission_queue", body=kind(f"header {TOKEN.header}"))
    with pytest.raises(Unreadable) as failed:
        robot.enqueue(MISSION)
    assert failed.value.delivery is Delivery.UNKNOWN
    assert TOKEN.header not in "".join(traceback.format_exception(failed.value))
    assert len(responses.calls) == 1
