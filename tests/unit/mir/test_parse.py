import base64
import json
import math
from datetime import UTC, datetime
from typing import Any

import pytest

from app.domain.robot import MissionActions, MissionParameter, Pose, QueueState, RobotProblem, RobotState, UserPrompt
from app.mir import parse
from app.mir.errors import NotAMir, Unreadable
from app.mir.parameters import MOST_STOPS, actions, from_actions, from_definition
from tests.support.errors import raises
from tests.unit.mir.answers import STATUS, item, short


# ---------------------------------------------------------------------- JSON
@pytest.mark.parametrize(
    ("body", "problem"),
    [
        (b"", "no JSON"),
        (b"{", "no JSON"),
        (b"<html></html>", "no JSON"),
        (b"{} {}", "no JSON"),
        (b"{'a': 1}", "no JSON"),
        (b'{"battery_percentage": NaN}', "NaN"),
        (b"[-Infinity]", "-Infinity"),
        (b"[1e999]", "infinite"),
        (b"[-1e999]", "infinite"),
        (b'{"id": ' + b"9" * 5000 + b"}", "64 bit"),
        (b"[9223372036854775808]", "64 bit"),
        (b'{"state": "Done", "state": "Aborted"}', "twice"),
        (b"[" * 10_000, "too deep"),
        (b'{"a":' * 10_000, "too deep"),
        (b"\xff\xfe{\x00}\x00", "UTF-8"),
        (b'"\xe4"', "UTF-8"),
    ],
)
def test_json_that_python_would_take_or_choke_on_is_refused(body: bytes, problem: str) -> None:
    with pytest.raises(Unreadable) as refused:
        parse.loads(body)
    assert problem in refused.value.text


def test_ordinary_json_is_read() -> None:
    assert parse.loads(b'\xef\xbb\xbf{"a": [1, 2.5, null, true, "\xc3\xa4"]}') == {"a": [1, 2.5, None, True, "ä"]}
    assert parse.loads(b"9223372036854775807") == 2**63 - 1
    assert parse.loads(json.dumps(STATUS).encode()) == STATUS


# ---------------------------------------------------------------------- values
@pytest.mark.parametrize(
    ("raw", "percent"),
    [
        (93.5, 93.5),
        (100, 100.0),
        (0, 0.0),
        (100.1, 100.0),
        (105, 100.0),
        (105.1, None),
        (255, None),
        (-1.0, None),
        (-0.1, None),
        (True, None),
        ("93", None),
        (None, None),
        (math.nan, None),
        (math.inf, None),
        ([93], None),
    ],
)
def test_battery_is_a_percentage_or_unknown(raw: Any, percent: float | None) -> None:
    assert parse.battery(raw) == percent


@pytest.mark.parametrize(
    ("raw", "number"),
    [
        (5, 5),
        (5.0, 5),
        (-3, -3),
        (5.5, None),
        (True, None),
        ("5", None),
        (None, None),
        (1e300, None),
        (2**53, 2**53),
        (2**53 + 1, None),
        (-(2**60), None),
        (math.nan, None),
    ],
)
def test_whole_numbers(raw: Any, number: int | None) -> None:
    assert parse.int_or_none(raw) == number


@pytest.mark.parametrize(
    ("raw", "time"),
    [
        ("2023-12-07T10:54:31", datetime(2023, 12, 7, 10, 54, 31)),
        ("2023-12-07T10:54:31Z", datetime(2023, 12, 7, 10, 54, 31)),
        ("2023-12-07T10:54:31+02:00", datetime(2023, 12, 7, 8, 54, 31)),
        ("2023-12-07T10:54:31.5", datetime(2023, 12, 7, 10, 54, 31, 500_000)),
        *((never, None) for never in ("0001-01-01T00:00:00", "1969-12-31T23:59:59", "1970-01-01T00:00:00")),
        *((never, None) for never in ("2100-01-01T00:00:00", "9999-12-31T23:59:59")),
        ("", None),
        ("yesterday", None),
        (None, None),
        (1701946471, None),
        ("0001-01-01T00:00:00+23:00", None),
        ("9" * 50, None),
    ],
)
def test_instants_are_naive_times_of_the_robots_clock(raw: Any, time: datetime | None) -> None:
    assert parse.instant(raw) == time


@pytest.mark.parametrize(
    ("raw", "instant"),
    [
        ("Thu, 07 Dec 2023 10:54:31 GMT", datetime(2023, 12, 7, 10, 54, 31, tzinfo=UTC)),
        ("Thu, 07 Dec 2023 12:54:31 +0200", datetime(2023, 12, 7, 10, 54, 31, tzinfo=UTC)),
        ("Thu, 07 Dec 2023 10:54:31 -0000", datetime(2023, 12, 7, 10, 54, 31, tzinfo=UTC)),
        (None, None),
        ("", None),
        ("soon", None),
        ("Thu, 99 Dec 2023 10:54:31 GMT", None),
        ("Thu, 07 Dec 999999999999 10:54:31 GMT", None),
        ("Fri, 31 Dec 9999 23:59:59 -2300", None),
        ("x" * 1000, None),
    ],
)
def test_http_dates(raw: str | None, instant: datetime | None) -> None:
    assert parse.http_date(raw) == instant


@pytest.mark.parametrize(
    ("raw", "path"),
    [
        ("/v2.0.0/missions/7", "/missions/7"),
        ("/api/v2.0.0/missions/7", "/missions/7"),
        ("http://elsewhere/v2.0.0/missions/7", ""),
        ("//elsewhere/v2.0.0", ""),
        ("/etc/passwd", ""),
        (None, ""),
        (7, ""),
    ],
)
def test_urls_lead_nowhere_else_than_below_the_api(raw: Any, path: str) -> None:
    assert parse.own_path(raw) == path


# ---------------------------------------------------------------------- status
def test_a_recorded_status() -> None:
    status = parse.status(STATUS, software="2.13.0.6", elapsed_s=0.02)
    assert (status.state, status.state_text) == (RobotState.EXECUTING, "Executing")
    assert (status.robot_name, status.robot_model, status.serial_number) == ("R1", "MiR100", "200100000000000")
    assert (status.battery_percentage, status.battery_time_remaining_s) == (93.5, 89725.0)
    assert (status.mission_queue_id, status.mission_text) == (
        14026,
        "Charging until battery reaches 95% (Current: 94%)...",
    )
    assert (status.position, status.map_id) == (Pose(9.52, 7.156, 104.3), STATUS["map_id"])
    assert (status.errors, status.user_prompt, status.uptime_s, status.moved) == ((), None, 3552693.0, 671648.391)
    assert (status.software, status.elapsed_s) == ("2.13.0.6", 0.02)


@pytest.mark.parametrize("missing", STATUS)
def test_any_field_of_the_status_may_be_missing_or_null(missing: str) -> None:
    without = {key: value for key, value in STATUS.items() if key != missing}
    assert parse.status(without).state is RobotState.EXECUTING
    assert parse.status({**STATUS, missing: None}).state is RobotState.EXECUTING


@pytest.mark.parametrize(
    ("state_id", "text", "state"),
    [
        (3, "Ready", RobotState.READY),
        (12, "Error", RobotState.ERROR),
        (99, "Dancing", RobotState.UNKNOWN),
        (0, "", RobotState.UNKNOWN),
        (-1, "Ready", RobotState.UNKNOWN),
        (None, "Ready", RobotState.READY),
        (None, "Emergency Stop", RobotState.EMERGENCY_STOP),
        (None, "ManualControl", RobotState.MANUAL_CONTROL),
        (None, "Manualcontrol", RobotState.MANUAL_CONTROL),
        ("3", "x", RobotState.UNKNOWN),
    ],
)
def test_states_are_read_by_number_and_unknown_ones_are_kept(state_id: Any, text: str, state: RobotState) -> None:
    status = parse.status({"state_id": state_id, "state_text": text})
    assert status.state is state
    assert status.state_text == text


def test_errors_and_prompt_with_their_templates() -> None:
    status = parse.status(
        {
            **STATUS,
            "mission_text": '{"message": "Moving to \'%(name)s\'", "args": {"name": "Dock"}}',
            "errors": [
                {
                    "code": 10120,
                    "description": '{"message": "Failed to reach \'%(n)s\'", "args": {"n": "S2"}}',
                    "module": "MissionController",
                    "non_resettable": True,
                },
                {"code": 10201, "description": "Lost"},
                "nonsense",
            ],
            "user_prompt": {
                "guid": "g-1",
                "user_group": "u",
                "question": "Loaded?",
                "timeout": 60,
                "options": ["Yes", "No\x00", 3],
            },
        }
    )
    assert status.mission_text == "Moving to 'Dock'"
    assert status.errors == (
        RobotProblem(10120, "Failed to reach 'S2'", "MissionController", resettable=False),
        RobotProblem(10201, "Lost"),
    )
    assert status.user_prompt == UserPrompt("g-1", "Loaded?", ("Yes",), 60.0, 2)


@pytest.mark.parametrize("value", [None, [], {}, "x", 5, [STATUS], {"robot_name": "R1"}, {"error": "no"}])
def test_an_answer_that_is_no_status_is_no_mir(value: Any) -> None:
    with raises(NotAMir, code="no_status"):
        parse.status(value)


# ---------------------------------------------------------------------- queue
def test_a_recorded_queue_item() -> None:
    found = parse.queue_item(
        item(
            finished="2023-12-07T10:55:31",
            message='{"message": "At %(x)s", "args": {"x": "A"}}',
            description="token",
            parameters=[{"input_name": "n", "value": 1}],
            priority=4,
        )
    )
    assert (found.id, found.state, found.state_text) == (723, QueueState.EXECUTING, "Executing")
    assert (found.message, found.description, found.priority) == ("At A", "token", 4)
    assert found.parameters == ({"input_name": "n", "value": 1},)
    assert (found.finished - found.started).total_seconds() == 60
    assert (found.created_by_name, found.state.is_open, found.is_pending) == ("Administrator", True, False)


@pytest.mark.parametrize(
    ("text", "state"),
    [
        ("Pending", QueueState.PENDING),
        ("Executing", QueueState.EXECUTING),
        ("Starting", QueueState.EXECUTING),
        ("Done", QueueState.DONE),
        ("Aborted", QueueState.ABORTED),
        ("Abort", QueueState.ABORTING),
        ("ABORTED", QueueState.ABORTED),
        ("Outbound", QueueState.UNKNOWN),
    ],
)
def test_queue_states(text: str, state: QueueState) -> None:
    found = parse.queue_item({"id": 1, "state": text})
    assert (found.state, found.state_text) == (state, text)
    assert found.state.is_open is (state in (QueueState.PENDING, QueueState.EXECUTING))


@pytest.mark.parametrize(
    "value",
    [
        None,
        [],
        {},
        {"id": 1},
        {"state": "Done"},
        {"id": "1", "state": "Done"},
        {"id": True, "state": "Done"},
        {"id": 1.5, "state": "Done"},
        {"id": -1, "state": "Done"},
        {"id": None, "state": "Done"},
        {"id": 1, "state": None},
        {"id": 1, "state": ""},
        [item()],
    ],
)
def test_an_answer_that_is_no_queue_item_is_unreadable(value: Any) -> None:
    with pytest.raises(Unreadable):
        parse.queue_item(value)


def test_full_and_short_items_are_distinguished() -> None:
    assert parse.has_all_fields(item())
    assert not parse.has_all_fields(short(3))


# ---------------------------------------------------------------------- the rest
PNG = base64.b64encode(b"\x89PNG\r\n\x1a\nrest").decode()


@pytest.mark.parametrize("key", ["map", "base_map"])
def test_a_map_of_either_software(key: str) -> None:
    found = parse.robot_map(
        {"guid": "g", "name": "Hall", key: PNG, "resolution": 0.1, "origin_x": -1.5, "origin_y": 2, "origin_theta": 0}
    )
    assert (found.name, found.resolution, found.origin) == ("Hall", 0.1, Pose(-1.5, 2.0, 0.0))
    assert found.png.startswith(b"\x89PNG")
    assert "png" not in repr(found)


@pytest.mark.parametrize("picture", [None, "", "####", "aGVsbG8=", 5, "ä"])
def test_a_map_without_a_png_is_unreadable(picture: Any) -> None:
    with pytest.raises(Unreadable):
        parse.robot_map({"guid": "g", "name": "Hall", "map": picture})


def test_a_map_with_nonsense_for_its_scale_gets_the_usual_one() -> None:
    assert parse.robot_map({"map": "data:image/png;base64," + PNG, "resolution": -1}).resolution == 0.05


def test_parameters_of_a_definition_and_of_actions() -> None:
    definition = {
        "parameters": [
            {
                "id": "goal",
                "name": "Goal",
                "type": "Reference",
                "value": "a",
                "constraints": {"choices": [{"name": "A", "value": "a"}, {"value": 2}]},
            },
            {
                "input_name": "count",
                "type": "Integer",
                "value": 5,
                "constraints": {"default": 3, "minimum": 1, "maximum": 9.5},
            },
            {"id": "goal", "name": "again"},
            {"name": "nameless"},
            "nonsense",
        ]
    }
    goal, count = from_definition([definition, None])
    assert goal == MissionParameter("goal", "Goal", "Reference", "a", choices=(("a", "A"), (2, "2")))
    assert count == MissionParameter("count", "", "Integer", 3, 1.0, 9.5)
    actions = [
        {
            "parameters": [
                {"id": "minimum_time", "input_name": None, "value": None},
                {"id": "x", "input_name": "Where", "value": 1.5},
            ]
        },
        7,
    ]
    assert from_actions(actions) == [MissionParameter("Where", type="x", default=1.5, sets="x", unit="m")]
    assert from_definition("x") == from_actions({}) == []


def test_the_stops_of_a_mission_are_in_order() -> None:
    def action(kind: str, priority: int, **parameters: Any) -> dict[str, Any]:
        return {
            "action_type": kind,
            "priority": priority,
            "parameters": [{"id": key, "value": value} for key, value in parameters.items()],
        }

    asked = {
        "action_type": "move",
        "priority": 4,
        "parameters": [{"id": "position", "value": "old", "input_name": "Where"}],
    }
    found = actions(
        [
            action("docking", 3, marker="dock", marker_type="type"),
            asked,
            action("wait", 2, time="00:00:10"),
            action("move", 1, position="store", cart_entry_position="main"),
            action("move_to_position", 5, x=1.0, y=2.0),
            action("load_mission", 6, mission_id="other"),
            action("move", 7, position=None),
            action("charging", 8),
        ]
    )
    assert found == MissionActions(False, ("store", "dock", "", "", "", ""))
    assert actions([action("move", 1, position="entry"), action("charging", 2)]) == MissionActions(True, ("entry",))
    assert actions("nothing") == MissionActions()
    assert len(actions([action("move", 1, position=f"p{n}") for n in range(400)]).drives_to) == MOST_STOPS
