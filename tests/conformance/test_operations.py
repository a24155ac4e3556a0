"""Every operation of MiR's definitions, of every software version of robots and of classic fleets: codes, bodies, schemas, refusals."""

from __future__ import annotations

from functools import cache

import pytest

from mir_sim.definition import FLEET_SOFTWARE, SOFTWARE, load
from tests.conformance import exceptions
from tests.conformance.client import Client
from tests.conformance.exceptions import Deviation
from tests.conformance.schema import Difference, differences
from tests.unit.sim.asking import HEADERS

DEVIATIONS = exceptions.load()
ALL_SOFTWARE = (*SOFTWARE, FLEET_SOFTWARE)
OPERATIONS = [
    (software, verb, template)
    for software in ALL_SOFTWARE
    for template, verbs in load(software).document["paths"].items()
    for verb in verbs
]
ERROR = {"$ref": "#/definitions/Error"}


def name_of(verb: str, template: str) -> str:
    return f"{verb.upper()} {template}"


def unexplained(
    found: list[Difference], software: str, operation: str, deviations: list[Deviation]
) -> tuple[list[str], set[int]]:
    """Differences from the schema that no exception allows, and the exceptions that were needed."""
    left, used = [], set()
    for difference in found:
        number = next(
            (
                number
                for number, one in enumerate(deviations)
                if one.allows(operation, software, difference.field, difference.value, difference.missing)
            ),
            None,
        )
        if number is None:
            left.append(f"{difference.field or 'the answer'}: {difference.what}")
        else:
            used.add(number)
    return left, used


def path_of(template: str, params: dict[str, str]) -> str:
    for name, value in params.items():
        template = template.replace(f"{{{name}}}", value)
    return template


@cache
def shared(software: str, has_more: bool) -> Client:
    """A machine for what only reads, or is refused. ``has_more``: rows are added to it, and missions run."""
    return Client(software)


def succeed(software: str, verb: str, template: str) -> tuple[list[str], set[int]]:
    """Perform the operation properly; return what is wrong with the answer and the exceptions that were needed."""
    client = shared(software, "{" in template) if verb == "get" else Client(software)
    params = client.fill(template)
    if params is None:
        return nothing_there(client, verb, template)
    if template.startswith("/status"):
        client.pass_time(1)
    response = client.send(verb, path_of(template, params), client.body(verb, template, params))
    documented = client.document["paths"][template][verb]["responses"]
    success = next(code for code in documented if code.startswith("2"))
    assert str(response.status) == success, f"{software} {verb} {template}: {response.status} {response.body[:200]!r}"
    schema = documented[success].get("schema")
    if schema is None:
        assert response.body == b""
        return [], set()
    if "metrics" in template:
        assert response.body.decode().endswith("# EOF\n")
        return [], set()
    if "protective_scan" in template:
        assert response.body.startswith(b"\x89PNG")  # a schema without fields may mean anything
        return [], set()
    found = differences(client.document, schema, response.json())
    return unexplained(found, software, name_of(verb, template), DEVIATIONS)


def nothing_there(client: Client, verb: str, template: str) -> tuple[list[str], set[int]]:
    """The robot has no such row: the answer is 404, or 400 if the operation has no 404."""
    placeholders = [part[1:-1] for part in template.split("/") if part.startswith("{")]
    response = client.send(
        verb, path_of(template, dict.fromkeys(placeholders, "no-such-thing")), client.body(verb, template)
    )
    is_documented = "404" in client.document["paths"][template][verb]["responses"]
    expected = (404, "Not found") if is_documented else (400, f"Argument error: {placeholders[-1]}")
    assert (response.status, response.json()["error_human"]) == expected, (verb, template)
    assert not differences(client.document, ERROR, response.json()), (verb, template)
    return [], set()


def test_answers_are_true_to_their_schemas_and_every_exception_is_needed() -> None:
    wrong, used = {}, set()
    for operation in OPERATIONS:
        differing, needed = succeed(*operation)
        if differing:
            wrong[operation] = differing
        used |= needed
    assert wrong == {}
    assert [DEVIATIONS[number] for number in range(len(DEVIATIONS)) if number not in used] == []


def test_every_exception_has_its_reason() -> None:
    assert all(len(one.reason) > 10 for one in DEVIATIONS)


def test_without_credentials_only_the_status_can_be_read() -> None:
    clients = {software: Client(software) for software in ALL_SOFTWARE}  # nothing is done
    for software, verb, template in OPERATIONS:
        client = clients[software]
        response = client.send(verb, template, headers={"Content-Type": "application/json"})
        is_status = (verb, template) == ("get", "/status")
        assert response.status == (200 if is_status else 401), (software, verb, template)
        assert is_status or not differences(client.document, ERROR, response.json()), (software, verb, template)


def test_what_does_not_exist_is_refused_as_documented() -> None:
    """The row that is asked for, or the one that a collection is inside of."""
    clients = {software: Client(software) for software in ALL_SOFTWARE}
    for software, verb, template in OPERATIONS:
        if "{" in template:
            nothing_there(clients[software], verb, template)


@pytest.mark.parametrize("software", SOFTWARE)
def test_a_robot_has_the_footprint_of_its_model(software: str) -> None:
    client = Client(software)
    (listed,) = client.send("GET", "/footprints").json()
    found, status = client.send("GET", f"/footprints/{listed['guid']}").json(), client.send("GET", "/status").json()
    assert (found["config_id"], found["footprint_points"]) == (status["robot_model"], status["footprint"])


@pytest.mark.parametrize("software", SOFTWARE)
def test_the_built_in_missions_ask_for_what_clients_send(software: str) -> None:
    client = Client(software)
    guid = {mission["name"]: mission["guid"] for mission in client.send("GET", "/missions").json()}[
        "GoToPositionPrototype"
    ]
    (action,) = client.send("GET", f"/missions/{guid}/actions").json()
    asked = {one["input_name"]: (one["id"], one["guid"]) for one in action["parameters"] if one["input_name"]}
    assert asked == {
        "X": ("x", "mirconst-guid-0000-0004-actlistparam"),
        "Y": ("y", "mirconst-guid-0000-0005-actlistparam"),
        "Orientation": ("orientation", "mirconst-guid-0000-0006-actlistparam"),
    }
    values = {"X": 10.0, "Y": 12.0, "Orientation": 90.0}
    sent = [
        {"guid": asked[name][1], "id": asked[name][0], "input_name": name, "value": value}
        for name, value in values.items()
    ]
    assert client.send("POST", "/mission_queue", {"mission_id": guid, "parameters": sent}).status == 201
    client.robot.advance_to(300)
    position = client.send("GET", "/status").json()["position"]
    assert position == pytest.approx({"x": 10.0, "y": 12.0, "orientation": 90.0}, abs=0.1)
    refused = client.send("POST", "/mission_queue", {"mission_id": guid})
    assert (refused.status, refused.json()["error_human"]) == (400, "Argument error: X")


WITH_BODY = [
    (software, verb, template)
    for software, verb, template in OPERATIONS
    if any(parameter["in"] == "body" for parameter in load(software).document["paths"][template][verb]["parameters"])
]


def test_bodies_are_checked() -> None:
    for operation in WITH_BODY:
        check_bodies(*operation)


def check_bodies(software: str, verb: str, template: str) -> None:
    client = shared(software, True)
    params = client.fill(template)
    if params is None:
        nothing_there(client, verb, template)
        return
    path = path_of(template, params)
    schema = next(
        one["schema"] for one in client.document["paths"][template][verb]["parameters"] if one["in"] == "body"
    )
    required = client.document["definitions"][schema["$ref"].rsplit("/", 1)[-1]].get("required", [])
    refusals = {
        "Missing content type application/json on the header": client.send(
            verb, path, b"a=1", HEADERS | {"Content-Type": "application/x-www-form-urlencoded"}
        ),
        "Invalid JSON": client.send(verb, path, b"{"),
        "Argument error": client.send(verb, path, []),
    }
    if verb == "put":
        refusals["No fields"] = client.send(verb, path, {})
    elif required:
        refusals[f"Argument error: {', '.join(required)}"] = client.send(verb, path, {})
    for name in right if isinstance(right := client.body(verb, template, params), dict) else ():
        refusals[f"Argument error: {name}"] = client.send(verb, path, {**right, name: None})
    for human, response in refusals.items():
        assert (response.status, response.json()["error_human"]) == (400, human), (software, verb, template)
        assert not differences(client.document, ERROR, response.json()), (software, verb, template)


@pytest.mark.parametrize("software", SOFTWARE)
@pytest.mark.parametrize("path", ["/statuses", "/robots/1", "/missions/x/y/z", "/mission_scheduler", "/"])
def test_paths_outside_the_definition_are_not_found(software: str, path: str) -> None:
    client = Client(software)
    response = client.send("GET", path)
    assert response.status == 404
    assert not differences(client.document, ERROR, response.json())


@pytest.mark.parametrize(
    "path", ["/swagger", "/platform/timezone", "/experimental/diagnostics", "/software/system_status", "/zones"]
)
def test_paths_of_the_newer_software_are_not_in_the_older(path: str) -> None:
    assert Client("3.5.4").send("GET", path).status == 200
    assert Client("2.14.7").send("GET", path).status == 404


def test_3_8_1_is_3_5_4_with_guided_moves_and_three_fields() -> None:
    older, newer = load("3.5.4").document, load("3.8.1").document
    assert set(newer["paths"]) - set(older["paths"]) == {"/guided_move", "/guided_move/waypoints"}
    assert {path: newer["paths"][path] for path in older["paths"]} == older["paths"]
    assert {
        name: set(schema["properties"]) - set(older["definitions"][name].get("properties", ()))
        for name, schema in newer["definitions"].items()
        if name in older["definitions"] and schema != older["definitions"][name]
    } == {
        "GetSetting": {"disclaimer_text"},
        "GetSetting_advanced": {"disclaimer_text"},
        "PostRobots": {"time"},
        "PutStatus": {"prompt_user_group_from_fleet"},
    }
    properties = sum(len(schema.get("properties", ())) for schema in newer["definitions"].values())
    operations = sum(map(len, newer["paths"].values()))
    assert (len(newer["paths"]), operations, len(newer["definitions"]), properties) == (
        159,
        289,
        249,
        1307,
    )  # as reported of it


def test_a_guided_move_is_there_once_it_was_named() -> None:
    client = Client("3.8.1")
    assert client.send("GET", "/guided_move").json() == []
    client.send("PUT", "/guided_move", {"guided_move_id": "a", "assigned_waypoint_index": 2})
    (moved,) = client.send("GET", "/guided_move").json()
    assert (moved["guided_move_id"], moved["assigned_waypoint_index"], moved["current_waypoint_index"]) == ("a", 2, 0)
    assert client.send("GET", "/guided_move/waypoints").json()[0]["guided_move_id"] == "a"
    assert client.send("PUT", "/guided_move", {"assigned_waypoint_index": 3}).status == 400
    assert Client("3.5.4").send("GET", "/guided_move").status == 404


def test_the_fields_that_3_8_1_added() -> None:
    client, older = Client("3.8.1"), Client("3.5.4")
    assert client.send("GET", "/settings/101").json()["disclaimer_text"] == ""
    assert "disclaimer_text" not in older.send("GET", "/settings/101").json()
    for one, with_time, without in ((client, 201, 400), (older, 201, 201)):
        assert one.send("POST", "/robots", {"robots": [], "time": 1.5}).status == with_time
        assert one.send("POST", "/robots", {"robots": []}).status == without
    assert client.send("PUT", "/status", {"prompt_user_group_from_fleet": "Operators"}).status == 200
    assert (
        older.send("PUT", "/status", {"prompt_user_group_from_fleet": "Operators"}).json()["error_human"] == "No fields"
    )


@pytest.mark.parametrize("software", SOFTWARE)
def test_every_answer_says_which_robot_it_comes_from(software: str) -> None:
    for response in (Client(software).send("GET", "/status"), Client(software).send("GET", "/nothing")):
        said = [response.headers[name] for name in ("Robot-Version", "API-Version", "MiR-Product")]
        assert said == [software, "v2.0.0", "MIR250"]
