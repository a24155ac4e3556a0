"""Each built-in deviant over HTTP compared with a standard robot: it differs in what its description says and in nothing else."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import requests

import mir_sim
from mir_sim import DEVIANTS, Fleet, Profile, SimulatedRobot, deviant, serve
from mir_sim.definition import load
from tests.support.examples import every_fourth
from tests.unit.sim.asking import GUIDS, HEADERS

BOUND = 60.0  # s; only to end a test that would wait for ever
STEP = 0.5  # simulated s between two requests: 20 in 10 s
OLD = 120  # items that the queue begins with
ANY = object()  # a difference whose value is not written down here


class Client:
    """A client of one robot, whose time passes when the test says so, and by a step before each request."""

    def __init__(self, profile: Profile) -> None:
        self.now, self._session = 0.0, requests.Session()
        self.robot = SimulatedRobot(
            "Aino", seed=1, battery=80.0, history=OLD, time_scale=1000, clock=lambda: self.now, profile=profile
        )
        self.url = ""

    def ask(self, method: str, path: str, body: Any = None, step: float = STEP) -> Any:
        """Status code and body of an answer; "refused" without one."""
        self.now += step
        try:
            answer = self._session.request(
                method, f"{self.url}/api/v2.0.0{path}", json=body, headers=HEADERS, timeout=BOUND
            )
        except requests.ConnectionError:
            return "refused"
        return answer.status_code, answer.json() if answer.headers.get(
            "Content-Type"
        ) == "application/json" else answer.text

    def get(self, path: str) -> Any:
        return self.ask("GET", path)[1]

    def order(self, description: str = "order 17") -> Any:
        return self.ask("POST", "/mission_queue", {"mission_id": GUIDS["Deliver"], "description": description})


@contextmanager
def client_of(profile: Profile) -> Iterator[Client]:
    client = Client(profile)
    fleet = Fleet([client.robot])
    fleet.start()
    try:
        client.url = fleet.robots[0].url
        yield client
    finally:
        fleet.stop()


# ---------------------------------------------------------------------- what is asked, in this order
def item(client: Client, number: int = OLD + 1) -> Any:
    return client.get(f"/mission_queue/{number}")


def only(shown: Any, are: Callable[[str], bool]) -> Any:
    return {name: shown[name] for name in sorted(shown) if are(name)}


def search(client: Client, what: str, shown: str, name: str, operator: str, value: Any) -> Any:
    """What is found, or the code of the refusal."""
    filters = [{"fieldname": name, "operator": operator, "value": value}]
    code, found = client.ask("POST", f"/{what}/search?whitelist={shown}", {"filters": filters})
    return [one[shown] for one in found] if code == 201 else code


def ids(client: Client, query: str = "") -> Any:
    return [one["id"] for one in client.get(f"/mission_queue{query}")]


def executing(client: Client) -> Any:
    client.now += 5
    shown = client.get("/status")
    return shown["state_id"], shown["state_text"], shown["mission_text"]


def cancelled_item(client: Client) -> Any:
    client.ask("DELETE", f"/mission_queue/{OLD + 1}")
    client.now += 2
    shown = item(client)
    return shown["state"], shown["message"]


def failed_item(client: Client) -> Any:
    mir_sim.control.apply(client.robot, {"fail_next_mission": "Failed to reach goal position 'Line 1'"})
    client.order("order 18")
    client.now += 20
    shown = item(client, OLD + 2)
    return shown["state"], shown["message"]


def error(client: Client) -> Any:
    shown = client.get("/status")
    return shown["state_text"], [one["description"] for one in shown["errors"]]


def cleared(client: Client) -> Any:
    client.ask("PUT", "/status", {"clear_error": True})
    shown = client.ask("PUT", "/status", {"state_id": 3})[1]
    return shown["state_id"], shown["errors"]


def an_hour_later(client: Client) -> Any:
    """Whether there are items that were not ordered here."""
    client.now += 3600
    return client.ask("GET", f"/mission_queue/{OLD + 3}?whitelist=id")[0]


def many_at_once(client: Client) -> Any:
    codes = {client.ask("GET", "/status", step=0.0)[0] for _ in range(40)}
    return codes, "refused" if client.ask("GET", "/status", step=2.0) == "refused" else "answered"


def afterwards(client: Client) -> Any:
    client.now += 60
    ends = time.monotonic() + BOUND
    while client.ask("GET", "/status", step=0.0) == "refused" and time.monotonic() < ends:
        pass
    return client.get("/status")["state_id"]


NOT_COMPARED = ("state", "message", "description", "ordered", "order_description")
PROBES: dict[str, Callable[[Client], Any]] = {
    "refused": lambda client: client.ask("GET", "/nothing"),
    "ready": lambda client: client.get("/status"),
    "answer_to_an_order": lambda client: client.order(),
    "item": lambda client: only(item(client), lambda name: name not in NOT_COMPARED),
    "description": lambda client: only(item(client), lambda name: "description" in name),
    "descriptions_in_lists": lambda client: client.get(f"/mission_queue?whitelist=description&offset={OLD}"),
    "found_by_description": lambda client: search(client, "mission_queue", "id", "description", "LIKE", "order%"),
    "found_by_state": lambda client: search(client, "mission_queue", "id", "state", "IN", ["Pending", "Executing"]),
    "positions_found": lambda client: search(client, "positions", "name", "name", "=", "Press"),
    "executing": executing,
    "executing_item": lambda client: item(client)["state"],
    "cancelled_item": cancelled_item,
    "failed_item": failed_item,
    "error": error,
    "cleared": cleared,
    "times": lambda client: only(item(client), lambda name: name in ("ordered", "started", "finished")),
    "every_item": ids,
    "long_page": lambda client: ids(client, "?limit=60&offset=30"),
    "short_page": lambda client: client.get("/mission_queue?limit=2&offset=3&whitelist=id,mission_id"),
    "newest": lambda client: ids(client, "?sort_by=id,desc&limit=2"),
    "old_states": lambda client: [item(client, number)["state"] for number in (1, 2, 3)],
}
LAST = {"an_hour_later": an_hour_later, "many_at_once": many_at_once, "afterwards": afterwards}
OTHERS = [
    path
    for path, verbs in load("3.5.4").document["paths"].items()
    if "get" in verbs and "{" not in path and path not in ("/status", "/mission_queue", "/swagger")
]


def answers(client: Client) -> dict[str, Any]:
    found = {name: probe(client) for name, probe in PROBES.items()}
    found |= {path: client.ask("GET", path) for path in OTHERS}
    return found | {name: probe(client) for name, probe in LAST.items()}


@pytest.fixture(scope="module")
def faithful() -> dict[str, Any]:
    with client_of(Profile()) as client:
        return answers(client)


# ---------------------------------------------------------------------- in what they differ
DIFFERENCES: dict[str, dict[str, Any]] = {
    "forgets-descriptions": {
        "description": {"description": ""},
        "descriptions_in_lists": [{"description": ""}],
        "found_by_description": [],
    },
    "renames-descriptions": {
        "description": {"description": "Deliver"},
        "descriptions_in_lists": [{"description": "Deliver"}],
        "found_by_description": [],
    },
    "moves-descriptions": {
        "description": {"order_description": "order 17"},
        "descriptions_in_lists": [{}],
        "found_by_description": [],
    },
    "no-search": {"found_by_description": 404, "found_by_state": 404, "positions_found": 404},
    "pages-of-50": {"every_item": list(range(1, 51)), "long_page": list(range(31, 81)), "/registers": ANY},
    "ignores-sort": {"newest": [1, 2]},
    "german-texts": {
        "refused": (404, {"error_code": "not_found", "error_human": "Nicht gefunden"}),
        "ready": ANY,
        "executing": (5, "In Ausführung", ANY),
        "cancelled_item": ("Aborted", "Abgebrochen - Benutzeranforderung"),
        "failed_item": ("Aborted", "Zielposition nicht erreicht: 'Line 1'"),
        "error": ("Fehler", ["Zielposition nicht erreicht: 'Line 1'"]),
    },
    "german-states": {
        "answer_to_an_order": ANY,
        "found_by_state": [],
        "executing_item": "Aktiv",
        "cancelled_item": ("Abgebrochen", "Aborted - User Request"),
        "failed_item": ("Abgebrochen", "Failed to reach goal position 'Line 1'"),
        "old_states": ["Fertig"] * 3,
    },
    "cancelled": {"cancelled_item": ("Cancelled", "Aborted - User Request")},
    "slow-disk": {},  # only later, see below
    "other-zone": {"times": ANY, "/platform/timezone": (200, {"value": "Asia/Tokyo"}), "/statistics/distance": ANY},
    "no-id": {"answer_to_an_order": (201, {"state": "Pending"})},
    "reboots-under-load": {"many_at_once": ({200}, "refused")},
    "fleet": {"an_hour_later": 200},
}


def matches(answer: Any, expected: Any) -> bool:
    if isinstance(expected, tuple) and isinstance(answer, tuple) and len(expected) == len(answer):
        return all(map(matches, answer, expected))
    return expected is ANY or bool(answer == expected)


@pytest.mark.parametrize("name", every_fourth(DEVIANTS))
def test_a_deviant_differs_in_what_it_says_and_in_nothing_else(name: str, faithful: dict[str, Any]) -> None:
    with client_of(deviant(name)) as client:
        found = answers(client)
    differing = {probe: answer for probe, answer in found.items() if answer != faithful[probe]}
    assert differing.keys() == DIFFERENCES[name].keys()
    for probe, expected in DIFFERENCES[name].items():
        assert matches(differing[probe], expected), (probe, differing[probe])


def test_every_deviant_is_described_here() -> None:
    assert DIFFERENCES.keys() == DEVIANTS.keys()


def test_the_faithful_robot_answers_all_of_it(faithful: dict[str, Any]) -> None:
    assert {faithful[path][0] for path in OTHERS} == {200}
    assert faithful["description"] == {"description": "order 17"}
    assert faithful["found_by_description"] == faithful["found_by_state"] == [OLD + 1]
    assert faithful["cancelled_item"] == ("Aborted", "Aborted - User Request")
    assert faithful["newest"] == [OLD + 2, OLD + 1]
    assert (faithful["an_hour_later"], faithful["many_at_once"], faithful["afterwards"]) == (
        404,
        ({200}, "answered"),
        3,
    )


# ---------------------------------------------------------------------- when they answer, and where the clock stands
def test_a_slow_disk_takes_3_to_9_seconds_of_the_simulated_time() -> None:
    with serve(robots=1, time_scale=30, profile=deviant("slow-disk")) as fleet:
        began = time.monotonic()
        for _ in range(4):
            assert requests.get(f"{fleet.robots[0].url}/api/v2.0.0/status", timeout=BOUND).status_code == 200
        assert time.monotonic() - began >= 4 * 3 / 30
    with client_of(deviant("slow-disk")) as client:
        ask = mir_sim.Request.of("GET", "/api/v2.0.0/status")
        waits = [mir_sim.exchange(client.robot, ask).seconds * 1000 for _ in range(200)]
    assert 3 <= min(waits) < 3.3
    assert 8.7 < max(waits) <= 9


def test_items_queued_by_a_fleet_are_its_own_and_do_not_accumulate() -> None:
    with client_of(deviant("fleet")) as client:
        client.ask("PUT", "/status", {"state_id": 4})
        client.now = 1500.0
        (pending,) = [
            one for one in client.get(f"/mission_queue?whitelist=all&offset={OLD}") if one["state"] == "Pending"
        ]
        assert (pending["mission_id"], len(pending["fleet_schedule_guid"]), pending["description"]) == (
            GUIDS["Home"],
            36,
            "",
        )
        client.ask("PUT", "/status", {"state_id": 3})
        client.now = 2990.0
        done = [one["state"] for one in client.get(f"/mission_queue?offset={OLD}")]
        assert done == ["Done"] * 5  # of 300, 1800, 2100, 2400 and 2700 s
