"""whitelist, sort_by, limit, offset and search, which all lists of the API support."""

from __future__ import annotations

from typing import Any

import pytest

from tests.unit.sim.asking import Asker


@pytest.fixture
def busy(aino: Asker) -> Asker:
    """Four items: two done, one executing, one pending."""
    for _ in range(2):
        aino.order("Home")
    aino.pass_time(60)
    for _ in range(2):
        aino.order("Deliver", priority=3, description="kits")
    aino.pass_time(10)
    return aino


def search(asker: Asker, *filters: Any, query: str = "") -> Any:
    body = {"filters": [dict(zip(("fieldname", "operator", "value"), one, strict=True)) for one in filters]}
    response = asker.send("POST", f"/mission_queue/search{query}", body)
    assert response.status == 201
    return [item["id"] for item in response.json()]


def test_whitelist_brings_fields_that_the_list_omits(busy: Asker) -> None:
    assert busy.get("/mission_queue?whitelist=id,priority")[2] == {"id": 3, "priority": 3}
    assert busy.get("/mission_queue?whitelist=all")[2] == busy.item(3)
    assert busy.get("/status?whitelist=state_text,battery_percentage").keys() == {"state_text", "battery_percentage"}
    assert busy.get("/mission_queue/3?whitelist=state") == {"state": "Executing"}


def test_whitelist_takes_a_field_that_this_robot_has_not_but_the_definition_has(aino: Asker) -> None:
    assert aino.get("/status?whitelist=state_id,hook_status") == {"state_id": 3}


def test_sorting(busy: Asker) -> None:
    assert [item["id"] for item in busy.get("/mission_queue?sort_by=id,desc")] == [4, 3, 2, 1]
    assert [item["id"] for item in busy.get("/mission_queue?sort_by=id")] == [1, 2, 3, 4]
    assert [item["id"] for item in busy.get("/mission_queue?sort_by=finished,asc")] == [3, 4, 1, 2]  # nulls first
    names = [mission["name"] for mission in busy.get("/missions?sort_by=name")]
    assert names == sorted(names)


def test_pages(busy: Asker) -> None:
    assert [item["id"] for item in busy.get("/mission_queue?limit=2")] == [1, 2]
    assert [item["id"] for item in busy.get("/mission_queue?limit=2&offset=1")] == [2, 3]
    assert [item["id"] for item in busy.get("/mission_queue?offset=3")] == [4]
    assert busy.get("/mission_queue?limit=0") == []


def test_an_unknown_query_is_ignored_and_a_trailing_slash_is_fine(busy: Asker) -> None:
    assert len(busy.get("/mission_queue/?nonsense=1")) == 4
    assert busy.get("/status/?whitelist=state_id") == {"state_id": 5}


@pytest.mark.parametrize(
    ("query", "text"),
    [
        ("whitelist=id,colour", "Wrong output fields"),
        ("sort_by=colour", "Invalid ordering"),
        ("sort_by=id,up", "Invalid ordering"),
        ("limit=many", "Invalid limits"),
        ("limit=-1", "Invalid limits"),
        ("offset=1.5", "Invalid limits"),
    ],
)
def test_wrong_queries_are_refused_with_mirs_texts(busy: Asker, query: str, text: str) -> None:
    response = busy.send("GET", f"/mission_queue?{query}")
    assert (response.status, response.json()["error_human"]) == (400, text)


@pytest.mark.parametrize(
    ("one", "found"),
    [
        (("id", "=", 3), [3]),
        (("id", "<=>", 3), [3]),
        (("id", "<>", 3), [1, 2, 4]),
        (("id", "!=", "3"), [1, 2, 4]),
        (("id", ">", 2), [3, 4]),
        (("id", ">=", "2"), [2, 3, 4]),
        (("id", "<", 2), [1]),
        (("id", "<=", 2), [1, 2]),
        (("state", "IN", ["Pending", "Executing"]), [3, 4]),
        (("state", "not in", ["Done"]), [3, 4]),
        (("description", "LIKE", "K_T%"), [3, 4]),
        (("description", "NOT LIKE", "k%"), [1, 2]),
        (("finished", "IS", None), [3, 4]),
        (("finished", "IS NOT", None), [1, 2]),
        (("finished", "=", None), []),
        (("finished", "<=>", None), [3, 4]),
        (("started", ">", "2026-11-23T07:00:50"), [3]),
        (("control_state", "=", 0), [1, 2, 3, 4]),
    ],
)
def test_search_operators(busy: Asker, one: Any, found: list[int]) -> None:
    assert search(busy, one) == found


def test_filters_add_up_and_go_with_the_query(busy: Asker) -> None:
    assert search(busy, ("id", ">", 1), ("state", "=", "Done")) == [2]
    assert search(busy, ("id", ">", 1), query="?sort_by=id,desc&limit=2") == [4, 3]


@pytest.mark.parametrize(
    "body",
    [
        {"filters": [{"fieldname": "colour", "operator": "=", "value": 1}]},
        {"filters": [{"fieldname": "id", "operator": "~", "value": 1}]},
        {"filters": [{"fieldname": "id", "value": 1}]},
        {"filters": [{"fieldname": "id", "operator": "IN", "value": 1}]},
        {"filters": 5},
        [],
    ],
)
def test_wrong_filters_are_refused(busy: Asker, body: Any) -> None:
    response = busy.send("POST", "/mission_queue/search", body)
    assert (response.status, response.json()["error_human"]) == (400, "Invalid filters")


def test_other_lists_can_be_searched_too(aino: Asker) -> None:
    body = {"filters": [{"fieldname": "name", "operator": "LIKE", "value": "%charge%"}]}
    assert {mission["name"] for mission in aino.send("POST", "/missions/search", body).json()} == {
        "Return to charger",
        "Charge to 80 %",
        "ChargeAtStation",
    }
    assert aino.send("POST", "/status/search", body).status == 404


def test_a_batch_is_answered_in_order(aino: Asker) -> None:
    requests = [
        {"url": "/registers/5", "method": "put", "body": {"value": 9}},
        {"url": "/registers/5", "method": "get"},
        {"url": "/mission_queue/77", "method": "GET"},
        {"url": "/mission_queue", "method": "delete"},
    ]
    answers = aino.send("POST", "/batch", {"requests": requests}).json()
    assert [answer["status"] for answer in answers] == [200, 200, 404, 204]
    assert answers[1]["body"]["value"] == 9
    assert answers[3]["body"] is None
    for wrong in ({}, {"requests": [1]}, {"requests": [{"url": "/batch", "method": "post", "body": {"requests": []}}]}):
        assert aino.send("POST", "/batch", wrong).status == 400
