"""Any body gets a documented answer: hypothesis generates bodies for every operation that takes one."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mir_sim.definition import SOFTWARE
from tests.conformance.client import REFERENCES, Client
from tests.conformance.test_operations import WITH_BODY, path_of
from tests.support.examples import examples

ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.sampled_from([10**400, "\ud800"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)
REPORTED = {500}  # unknown parameter names when a mission is queued


def ready(software: str, verb: str, template: str) -> tuple[Client, str, dict[str, Any]]:
    """A robot on which the operation's path exists, that path, and a valid body."""
    client = Client(software)
    params = client.fill(template) or {}
    return client, path_of(template, params), client.body(verb, template, params)


@examples(400)
@given(operation=st.sampled_from(WITH_BODY), data=st.data())
def test_any_body_gets_a_documented_answer(operation: tuple[str, str, str], data: st.DataObject) -> None:
    client, path, right = ready(*operation)
    _, verb, template = operation
    changed = data.draw(st.dictionaries(st.sampled_from(sorted(right)), ANYTHING, max_size=3)) if right else {}
    response = client.send(verb, path, {**right, **changed} if data.draw(st.booleans()) else data.draw(ANYTHING))
    documented = {int(code) for code in client.document["paths"][template][verb]["responses"]}
    assert response.status in documented | (REPORTED if template in ("/mission_queue", "/mission_scheduler") else set())
    if response.status >= 400:
        assert set(response.json()) == {"error_code", "error_human"}
    client.pass_time(30)  # and the machine keeps working
    assert client.send("GET", "/status", headers={}).status in (200, 503)


@pytest.mark.parametrize("software", SOFTWARE)
@examples(100)
@given(parameters=st.lists(ANYTHING | st.fixed_dictionaries({"id": ANYTHING, "value": ANYTHING}), max_size=3))
def test_any_parameters_of_an_action_leave_the_robot_alive(software: str, parameters: list[Any]) -> None:
    client = Client(software)
    mission = REFERENCES["mission_id"]
    for action_type in ("move", "move_to_position", "wait", "charging", "docking", "set_plc_register", "prompt_user"):
        client.send(
            "POST",
            f"/missions/{mission}/actions",
            {"mission_id": mission, "action_type": action_type, "priority": 0, "parameters": parameters},
        )
    client.send("POST", "/mission_queue", {"mission_id": mission})
    client.robot.advance_to(3600)
    assert client.send("GET", "/mission_queue/1").status == 200
