"""For any answer, a call returns its type or raises RobotError, and a POST only counts as accepted if it certainly
was."""

from __future__ import annotations

import json as json_module
import unicodedata
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from app.domain.robot import QueueItem, RobotState, RobotStatus
from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.errors import Delivery, RobotError
from app.mir.transport import Response
from tests.support.examples import examples
from tests.unit.mir.answers import STATUS, Scripted, item

TOKEN = Token.derive("distributor", "distributor")

SCALARS = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=20)
    | st.sampled_from(
        ['{"message": "%(a)s", "args": {"a": 1}}', '{"message": 5', "Pending", "\ud800", "-1", 10**30, -1, 2**63]
    )
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=8,
)


def like(template: dict[str, Any]) -> st.SearchStrategy[dict[str, Any]]:
    """Objects of the right keys with some values replaced by anything."""
    return st.dictionaries(st.sampled_from(sorted(template)), VALUES, max_size=6).map(
        lambda changes: {**template, **changes}
    )


ITEMS = like(item())
BODIES = st.one_of(VALUES, like(STATUS), ITEMS, st.lists(ITEMS | VALUES, max_size=3)).map(
    lambda value: json_module.dumps(value).encode()
) | st.binary(max_size=60)
STATUSES = (
    st.sampled_from([200, 201])
    | st.sampled_from([100, 202, 204, 206, 301, 304, 400, 401, 404, 408, 429, 500, 503])
    | st.integers(100, 999)
)
HEADERS = st.dictionaries(st.sampled_from(["Date", "Robot-Version", "Location", "x"]), st.text(max_size=40), max_size=4)
ANSWERS = st.builds(Response, STATUSES, BODIES, HEADERS)


def robot_that_says(answers: list[Response]) -> tuple[RobotClient, Scripted]:
    transport = Scripted(list(answers))
    return RobotClient(Address.parse("robot"), TOKEN, transport=transport), transport


READS = {
    "status": lambda robot: robot.status(),
    "identify": lambda robot: robot.identify(),
    "missions": lambda robot: robot.missions(),
    "mission": lambda robot: robot.mission("g"),
    "parameters": lambda robot: robot.parameters("g"),
    "queue_item": lambda robot: robot.queue_item(7),
    "open_items": lambda robot: robot.open_items(),
    "items_after": lambda robot: robot.items_after(7),
    "highest_queue_id": lambda robot: robot.highest_queue_id(),
    "map": lambda robot: robot.map("g"),
    "positions": lambda robot: robot.positions("g"),
    "position": lambda robot: robot.position("g"),
    "actions": lambda robot: robot.actions("g"),
}


@examples(150)
@given(call=st.sampled_from(sorted(READS)), answers=st.lists(ANSWERS, min_size=1, max_size=3))
def test_reading_raises_nothing_but_robot_errors(call: str, answers: list[Response]) -> None:
    robot, _ = robot_that_says(answers)
    try:
        found = READS[call](robot)
    except RobotError as error:
        _is_presentable(error.text)
    else:
        for value in found if isinstance(found, list) else [found]:
            _is_sound(value)


def _is_presentable(text: str) -> None:
    text.encode()
    assert not any(unicodedata.category(character) in ("Cc", "Cs", "Zl", "Zp") for character in text)
    assert len(text) < 1000
    assert TOKEN.header.removeprefix("Basic ") not in text


def _is_sound(value: Any) -> None:
    if isinstance(value, RobotStatus):
        assert isinstance(value.state, RobotState)
        assert value.battery_percentage is None or 0 <= value.battery_percentage <= 100
        for text in (value.state_text, value.mission_text, value.robot_name, value.serial_number or ""):
            assert len(text) <= 500
            text.encode()
    if isinstance(value, QueueItem):
        assert 0 <= value.id < 2**63
        assert all(stamp is None or stamp.tzinfo is None for stamp in (value.ordered, value.started, value.finished))


WRITES = {
    "set_state": lambda robot: robot.set_state(RobotState.READY),
    "clear_error": lambda robot: robot.clear_error(),
    "answer_prompt": lambda robot: robot.answer_prompt("g", "Yes"),
    "cancel": lambda robot: robot.cancel(7),
    "clear_queue": lambda robot: robot.clear_queue(),
}


@examples(60)
@given(call=st.sampled_from(sorted(WRITES)), answer=ANSWERS)
def test_a_command_is_sent_once_and_raises_nothing_but_robot_errors(call: str, answer: Response) -> None:
    robot, transport = robot_that_says([answer])
    try:
        WRITES[call](robot)
    except RobotError as error:
        _is_presentable(error.text)
        assert not 200 <= answer.status < 300
    assert len(transport.methods) == 1


@examples(150)
@given(answer=ANSWERS | st.builds(Response, st.just(201), ITEMS.map(lambda value: json_module.dumps(value).encode())))
def test_a_mission_is_accepted_only_with_201_and_an_integer_id(answer: Response) -> None:
    robot, transport = robot_that_says([answer])
    number, delivery = None, None
    try:
        number = robot.enqueue("g", description="token")
    except RobotError as error:
        delivery = error.delivery
    if delivery is not None:
        refused = 400 <= answer.status < 500 and answer.status not in (408, 425, 429)
        assert delivery is (Delivery.REFUSED if refused else Delivery.UNKNOWN)
    else:
        assert answer.status == 201
        assert type(number) is int
        assert json_module.loads(answer.body)["id"] == number
    assert transport.methods == ["POST"]
