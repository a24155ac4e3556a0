"""Every operation of MiR's definitions of Fleet Enterprise that is simulated, of every version: codes, schemas, refusals."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mir_sim.control import apply
from mir_sim.fleets.enterprise_api import HANDLERS, PROBLEM
from mir_sim.fleets.enterprise_definition import VERSIONS, load
from tests.conformance import exceptions
from tests.conformance.schema import differences
from tests.conformance.test_any_body import ANYTHING
from tests.conformance.test_operations import path_of, unexplained
from tests.support.examples import examples
from tests.unit.sim.asking import GUIDS
from tests.unit.sim.fleets.enterprise_asking import KEY, EnterpriseAsker, uuid_of

DEVIATIONS = exceptions.load("exceptions_fleet_enterprise.json")
OPERATIONS = [
    (version, verb, template)
    for version in VERSIONS
    for template, verbs in load(version).document["paths"].items()
    for verb in verbs
    if template != "/healthz"
]
PROBLEM_SCHEMA = {"$ref": "#/components/schemas/problem-details"}
NAMES = [f"{version} {verb} {template}" for version, verb, template in OPERATIONS]


class Client(EnterpriseAsker):
    """A fleet where much happens: an order asks a person, one has a fallback mission that runs, one waits, one has ended."""

    def __init__(self, version: str) -> None:
        super().__init__(version=version)
        self.document = load(version).document
        self.aino.robot.fail_next = "Failed to reach goal position 'Home'"
        self.post("ended", robot_id=self.aino.guid)
        self.pass_time(10)
        self.aino.robot.clear_errors()
        self.aino.robot.resume()
        self.post("asks", "Ask for release", "Home", robot_id=self.aino.guid)
        self.post(
            "falls back", "Deliver", phase={"fallback-mission-id": GUIDS["Wait at home"]}, robot_id=self.veikko.guid
        )
        self.post(
            "waits", "Go to position", phase={"arguments": [self.argument]}, earliest_start_time="2026-12-24T18:00:00Z"
        )
        while self.aino.robot.prompt is None:
            self.pass_time(1)
        self.send("DELETE", f"/serial-order/{uuid_of('falls back')}")
        self.pass_time(5)

    @property
    def argument(self) -> dict[str, str]:
        return {"name": "Position", "value": next(iter(self.fleet.site.table("/positions")))["guid"]}

    def operation(self, verb: str, template: str) -> Any:
        return self.document["paths"][template][verb]

    def parameters(self, verb: str, template: str) -> dict[str, str]:
        """Ids of what exists."""
        if "fallback" in template:
            return {"serialOrderId": uuid_of("falls back")}
        kind = template.split("/")[3]
        known = {
            "site": GUIDS["Home"],
            "robots": self.veikko.guid,
            "serial-order": uuid_of("waits"),
            "order": uuid_of("ended 0"),
        }
        return {"id": known[kind]} if "{id}" in template else {}

    def body(self, verb: str, template: str) -> Any:
        phase = {"mission-id": GUIDS["Home"], "arguments": [], "fallback-mission-id": None}
        waiting = {"serial-order-id": uuid_of("waits")}
        return {
            ("post", "/api/v1/serial-order"): {
                "serial-order": {"id": uuid_of("new"), "priority": "Low", "phases": [phase]}
            },
            ("patch", "/api/v1/serial-order"): {**waiting, "priority": "High", "robot-id": None},
            ("put", "/api/v1/serial-order/phase"): {**waiting, "index": 0, "phase": phase},
            ("patch", "/api/v1/robots/{id}"): {"robot-end-state": "Paused", "errors": []},
            ("post", "/api/v1/user-prompt"): {"id": self.aino.robot.prompt and self.aino.robot.prompt.guid, "value": 1},
        }.get((verb, template))

    def ask(self, verb: str, path: str, body: Any = None, headers: dict[str, str] | None = None) -> Any:
        return self.send(verb.upper(), path.removeprefix("/api/v1"), body, headers)


def schema_of(client: Client, verb: str, template: str, status: int, content_type: str) -> Any:
    """What the definition has for an answer, None where it has no body. The content type has to be one of those documented."""
    contents = client.operation(verb, template)["responses"][str(status)].get("content")
    return None if contents is None else contents[content_type]["schema"]


def test_answers_are_true_to_their_schemas_and_every_exception_is_needed() -> None:
    wrong, used = {}, set()
    for version, verb, template in OPERATIONS:
        client = Client(version)
        apply(client.veikko.robot, {"error": {"code": 7, "description": "Too hot"}})
        path = path_of(template, client.parameters(verb, template))
        response = client.ask(verb, path, client.body(verb, template))
        documented = client.operation(verb, template)["responses"]
        assert str(response.status) in documented, (version, verb, template, response.body)
        assert response.status < 300, (version, verb, template, response.body)
        schema = schema_of(client, verb, template, response.status, response.headers.get("Content-Type", ""))
        if schema is None:
            assert response.body == b""
            continue
        found = differences(client.document, schema, response.json())
        left, needed = unexplained(found, version, f"{verb.upper()} {template}", DEVIATIONS)
        if template == "/api/v1/order":  # its schema is open: the entries are taken for those of GET /order/{id}
            order = {"$ref": "#/components/schemas/order"}
            for entry in response.json() if version == "1.5.0" else ():
                left += [one.what for one in differences(client.document, order, entry)]
        if left:
            wrong[version, verb, template] = left
        used |= needed
    assert wrong == {}
    assert [one for number, one in enumerate(DEVIATIONS) if number not in used] == []


def test_every_operation_has_a_handler_and_every_handler_an_operation() -> None:
    assert {(verb, template) for _, verb, template in OPERATIONS} == set(HANDLERS)


@pytest.mark.parametrize(("version", "verb", "template"), OPERATIONS, ids=NAMES)
def test_refusals_are_as_documented(version: str, verb: str, template: str) -> None:
    client = Client(version)
    nothing = {name: uuid_of("nothing") for name in client.parameters(verb, template)}
    strange = dict.fromkeys(nothing, "no-such-thing")
    responses = []
    if nothing:
        body = client.body(verb, template)
        responses = [client.ask(verb, path_of(template, one), body) for one in (nothing, strange)]
        assert {str(one.status) for one in responses} <= set(client.operation(verb, template)["responses"])
    for one in responses:
        schema = schema_of(client, verb, template, one.status, one.headers["Content-Type"])
        assert one.status in (400, 404)
        assert differences(client.document, schema, one.json()) == []
    anonymous = client.ask(verb, path_of(template, client.parameters(verb, template)), headers={})
    assert (anonymous.status, anonymous.headers["Content-Type"]) == (401, PROBLEM)
    assert differences(client.document, PROBLEM_SCHEMA, anonymous.json()) == []


WITH_BODY = [one for one in OPERATIONS if "requestBody" in load(one[0]).document["paths"][one[2]][one[1]]]


@examples(100)
@given(operation=st.sampled_from(WITH_BODY), data=st.data())
def test_any_body_gets_an_answer_and_the_fleet_goes_on(operation: tuple[str, str, str], data: st.DataObject) -> None:
    """400 is not documented everywhere; that a wrong body is answered so nevertheless is a guess."""
    version, verb, template = operation
    client = Client(version)
    right = client.body(verb, template)
    inner = right.get("serial-order", right)
    changed = data.draw(st.dictionaries(st.sampled_from(sorted(inner)), ANYTHING, max_size=3))
    body = {**right, **changed} if inner is right else {"serial-order": {**inner, **changed}}
    path = path_of(template, client.parameters(verb, template))
    response = client.ask(verb, path, body if data.draw(st.booleans()) else data.draw(ANYTHING))
    assert str(response.status) in {*client.operation(verb, template)["responses"], "400"}
    client.pass_time(20)
    assert client.send("GET", "/serial-order-status/snapshot", headers=KEY).status == 200
