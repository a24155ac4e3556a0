"""Reading the queue of robots that know more or less of search, filters, order, paging and whitelist."""

import json as json_module
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from app.domain.check_up import RobotProfile
from app.domain.robot import QueueItem
from app.mir import mission_queue
from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.errors import Busy, Rejected, Unreadable
from app.mir.transport import Response
from tests.support.examples import examples
from tests.unit.mir.answers import item, short


@dataclass
class QueueTransport:
    """A robot's queue with the features that it has been given. It also proves that a client runs on any transport."""

    items: list[dict[str, Any]]
    has_search: bool = True
    filters: bool = True
    sorts: bool = True
    pages: bool = True
    whitelists: bool = True
    page_of_bare_list: int | None = None
    page_limit: int | None = None
    offsets: bool = True
    missing_status: int = 404
    requests: list[str] = field(default_factory=list)

    def send(
        self, method: str, path: str, *, query: Mapping[str, str] | None = None, json: Any = None, **_options: object
    ) -> Response:
        self.requests.append(f"{method} {path}")
        if path == "/mission_queue/search" and not self.has_search:
            return Response(self.missing_status)
        if path.startswith("/mission_queue/") and path != "/mission_queue/search":
            found = [entry for entry in self.items if entry["id"] == int(path.rpartition("/")[2])]
            return self._answer(found[0]) if found else Response(404)
        return self._answer(self._listed(query or {}, json), 201 if method == "POST" else 200)

    def _listed(self, query: Mapping[str, str], json: Any) -> list[dict[str, Any]]:
        entries = sorted(self.items, key=lambda entry: entry["id"])
        if json is not None and self.filters:
            (wanted,) = json["filters"]
            entries = [entry for entry in entries if self._fits(entry, wanted)]
        if self.sorts and query.get("sort_by") == "id,desc":
            entries.reverse()
        if self.pages and "limit" in query:
            offset = int(query.get("offset", "0")) if self.offsets else 0
            entries = entries[offset : offset + min(int(query["limit"]), self.page_limit or 5000)]
        elif "limit" not in query and self.page_of_bare_list is not None:
            entries = entries[: self.page_of_bare_list]
        return (
            entries
            if self.whitelists and query.get("whitelist") == "all"
            else [short(entry["id"], entry["state"]) for entry in entries]
        )

    @staticmethod
    def _fits(entry: dict[str, Any], wanted: dict[str, Any]) -> bool:
        match wanted:
            case {"fieldname": "id", "operator": ">", "value": int(floor)}:
                return bool(entry["id"] > floor)
            case {"fieldname": "state", "operator": "IN", "value": list(states)}:
                return entry["state"] in states
        raise AssertionError(wanted)

    @staticmethod
    def _answer(value: Any, status: int = 200) -> Response:
        return Response(status, json_module.dumps(value).encode())

    def read_connection(self) -> None:
        pass

    def close(self) -> None:
        pass


def history(done: int, executing: int = 0, pending: int = 0, first: int = 1) -> list[dict[str, Any]]:
    states = ["Done"] * done + ["Executing"] * executing + ["Pending"] * pending
    return [item(first + number, state, description=f"token {first + number}") for number, state in enumerate(states)]


def client(transport: QueueTransport) -> RobotClient:
    return RobotClient(Address.parse("robot"), Token(), transport=transport)


FEATURES = {name: st.booleans() for name in ("has_search", "filters", "sorts", "pages", "whitelists")}


@example(done=0, executing=0, pending=0, above=0, features=dict.fromkeys(FEATURES, True))
@example(done=0, executing=0, pending=2, above=7, features=dict.fromkeys(FEATURES, False))
@examples(100)
@given(
    done=st.integers(0, 450),
    executing=st.integers(0, 1),
    pending=st.integers(0, 30),
    above=st.integers(0, 40),
    features=st.fixed_dictionaries(FEATURES),
)
def test_open_and_newer_items_are_found_on_any_robot(
    done: int, executing: int, pending: int, above: int, features: dict[str, Any]
) -> None:
    everything = history(done, executing, pending, first=5000)
    robot = client(QueueTransport(everything, **features))
    open_ids = [entry["id"] for entry in everything if entry["state"] != "Done"]
    assert [found.id for found in robot.open_items()] == open_ids
    floor = 5000 + len(everything) - 1 - above
    found = robot.items_after(floor)
    assert [(one.id, one.description) for one in found] == [
        (n, f"token {n}") for n in range(max(floor + 1, 5000), 5000 + len(everything))
    ]
    assert robot.highest_queue_id() == max((entry["id"] for entry in everything), default=None)


@pytest.mark.parametrize(
    "features",
    [
        {"page_limit": 50},
        {"offsets": False},
        {"page_limit": 50, "offsets": False},
        {"page_limit": 50, "sorts": False},
        {"page_limit": 50, "filters": False},
        {"page_limit": 50, "has_search": False},
        {"offsets": False, "has_search": False},
        {"page_limit": 1},
        {"page_limit": 1, "sorts": False, "filters": False},
        {"page_limit": 1, "sorts": False, "has_search": False},
        {"page_limit": 1, "sorts": False, "filters": False, "offsets": False},
    ],
)
@pytest.mark.parametrize("profile", [None, RobotProfile(None, None, page_limit=50)])
def test_a_list_that_ends_early_hides_nothing(features: dict[str, Any], profile: RobotProfile | None) -> None:
    """What is wanted is found, or it is said that it can't be; a start that is not found is sent again."""
    robot = client(QueueTransport(history(600), **features))
    robot.use_profile(profile)
    assert [found.id for found in robot.items_after(595)] == [596, 597, 598, 599, 600]
    known: dict[int, QueueItem | None] = {}
    for _n in range(5):
        try:
            assert [found.id for found in robot.items_after(340, known)] == list(range(341, 601))
            break
        except Unreadable:
            assert (
                features.get("offsets") is False
                or features.get("sorts") is False
                or features.get("has_search") is False
            )
    else:
        pytest.fail("not even in several calls")


def test_where_pages_are_known_to_be_short_or_whole_no_request_is_wasted() -> None:
    transport = QueueTransport([entry for entry in history(600) if entry["id"] not in (501, 551)], page_limit=50)
    robot = client(transport)
    robot.use_profile(RobotProfile(None, None, page_limit=50))
    assert len(robot.items_after(551)) == 49
    assert len(robot.open_items()) == 0
    assert len(transport.requests) == 2
    whole = QueueTransport([entry for entry in history(600) if entry["id"] != 501])
    robot = client(whole)
    robot.use_profile(RobotProfile(None, None, page_limit=0, has_search=True))
    assert len(robot.items_after(500)) == 99
    assert whole.requests == ["POST /mission_queue/search"]


def test_a_healthy_robot_is_asked_once() -> None:
    transport = QueueTransport(history(15_000, 1, 3))
    robot = client(transport)
    assert len(robot.items_after(15_000)) == 4
    assert len(robot.open_items()) == 4
    assert robot.highest_queue_id() == 15_004
    assert transport.requests == ["POST /mission_queue/search", "POST /mission_queue/search", "GET /mission_queue"]


@pytest.mark.parametrize("status", [400, 404, 405, 410, 501])
def test_a_robot_without_search_is_asked_for_it_once(status: int) -> None:
    transport = QueueTransport(history(500, 1, 2), has_search=False, missing_status=status)
    robot = client(transport)
    assert len(robot.items_after(500)) == 3
    assert len(robot.items_after(495)) == 8
    assert transport.requests.count("POST /mission_queue/search") == 1


def test_a_robot_that_refuses_its_search_for_a_moment_is_searched_again() -> None:
    transport = QueueTransport(history(500, 1, 2))
    robot = client(transport)
    robot.open_items()
    transport.has_search = False
    assert [item.id for item in robot.items_after(498)] == [499, 500, 501, 502, 503]
    transport.has_search = True
    transport.requests.clear()
    assert [item.id for item in robot.items_after(498)] == [499, 500, 501, 502, 503]
    assert transport.requests == ["POST /mission_queue/search"]


def test_other_refusals_of_the_search_are_no_reason_to_read_the_list() -> None:
    transport = QueueTransport(history(3), has_search=False, missing_status=503)
    with pytest.raises(Busy):
        client(transport).items_after(0)
    transport.missing_status = 429
    with pytest.raises(Rejected):
        client(transport).items_after(0)
    assert transport.requests == ["POST /mission_queue/search"] * 2


def test_short_lists_are_completed_one_by_one() -> None:
    transport = QueueTransport(history(100, 0, 3), whitelists=False)
    assert [found.description for found in client(transport).items_after(100)] == [
        "token 101",
        "token 102",
        "token 103",
    ]
    assert transport.requests == ["POST /mission_queue/search", *(f"GET /mission_queue/{n}" for n in (103, 102, 101))]


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer items are too many, so that they are made quickly."""
    monkeypatch.setattr(mission_queue, "MOST_ITEMS", 500)


def test_too_much_to_read_completely_is_said_and_not_passed_for_all_there_is(few: None) -> None:
    with pytest.raises(Unreadable, match="more than 500 queue items"):
        client(QueueTransport(history(600))).items_after(0)
    with pytest.raises(Unreadable, match="more than 100 queue items in short form"):
        client(QueueTransport(history(200), whitelists=False)).items_after(0)


def test_a_bare_list_that_is_paged_does_not_hide_the_newest() -> None:
    robot = client(QueueTransport(history(900, 1, 2), page_of_bare_list=50))
    assert robot.highest_queue_id() == 903
    assert [found.id for found in robot.open_items()] == [901, 902, 903]


@pytest.mark.parametrize(
    "deleted", [set(), {60, 61, 200}, {50, 100, 150, 903}, {51}, {899, 900, 901, 902}, {49, 50, 51, 52, 901}]
)
def test_above_a_list_of_the_oldest_the_highest_number_is_climbed_to(deleted: set[int]) -> None:
    items = [entry for entry in history(903) if entry["id"] not in deleted]
    transport = QueueTransport(items, has_search=False, sorts=False, pages=False, page_of_bare_list=50)
    transport._listed = lambda query, json: items[:48]  # type: ignore[method-assign]
    robot, newest = client(transport), items[-1]["id"]
    assert robot.highest_queue_id() == newest
    asked = len(transport.requests)
    assert robot.highest_queue_id() == newest
    assert len(transport.requests) - asked <= 8, "it goes on from there"
    items[48:] = []
    assert robot.highest_queue_id() == items[47]["id"], "its numbers restarted"


@pytest.mark.parametrize(
    "said", [lambda asked: asked, lambda asked: 7], ids=["has every number", "always gives one item"]
)
def test_a_climb_ends(said: Callable[[int], int]) -> None:
    transport = QueueTransport([])
    transport._listed = lambda query, json: history(3)  # type: ignore[method-assign]
    send = transport.send

    def answer(method: str, path: str, **asked: Any) -> Response:
        number = path.removeprefix("/mission_queue").lstrip("/")
        return transport._answer(item(said(int(number)), "Done")) if number.isdecimal() else send(method, path, **asked)

    transport.send = answer  # type: ignore[method-assign, assignment]
    robot = client(transport)
    if said(1) == 1:
        with pytest.raises(Unreadable, match="the queue has no end"):
            robot.highest_queue_id()
    else:
        assert robot.highest_queue_id() == 7
    assert len(transport.requests) < 30


def test_a_page_of_any_length_holds_no_more_open_items_than_are_read(few: None) -> None:
    with pytest.raises(Unreadable, match="more than 500 queue items"):
        client(QueueTransport(history(0, 0, 501), pages=False)).open_items()
    assert len(client(QueueTransport(history(600, 1, 3), pages=False, filters=False)).open_items()) == 4


def test_an_item_that_appears_twice_while_paging_counts_once() -> None:
    """A new item moves the pages on between two requests."""
    transport = QueueTransport(history(450), filters=False)
    ask = transport.send

    def send(method: str, path: str, **rest: Any) -> Response:
        answer = ask(method, path, **rest)
        transport.items.append(item(len(transport.items) + 1, "Done", description="new"))
        return answer

    transport.send = send  # type: ignore[method-assign]
    assert [one.id for one in client(transport).items_after(100)] == list(range(101, 451))
    assert len(transport.requests) == 3
    assert mission_queue.PAGE == 200


def reader_of(there: set[int], read: Callable[[int], QueueItem] = QueueItem) -> mission_queue.QueueReader:
    """A reader of a robot that always lists only its ten oldest items."""

    def ask(_method: str, path: str, _query: Mapping[str, str], _json: Any) -> list[dict[str, Any]]:
        if path.endswith("search"):
            raise Rejected(status=404, address="r1")
        return [item(number) for number in sorted(there)[:10]]

    def read_item(number: int) -> QueueItem:
        if number not in there:
            raise Rejected(status=404, address="r1")
        return read(number)

    return mission_queue.QueueReader(ask, read_item)


@pytest.mark.parametrize(
    "there", [set(range(1, 451)), {*range(1, 12), *range(301, 451)}, {*range(1, 12), *range(40, 451, 7), 450}]
)
def test_single_reads_are_split_over_calls_however_many_numbers_are_missing(there: set[int]) -> None:
    reader, known, calls = reader_of(there), dict[int, QueueItem | None](), 0
    while (calls := calls + 1) < 10:
        try:
            found = reader.items_after(0, known, 450)
            break
        except Unreadable:
            assert calls < 6
    assert {each.id for each in found} == there


def test_a_robot_that_has_every_number_is_not_read_for_ever() -> None:
    reader, known = reader_of(set(range(1, 2 * mission_queue.MOST_ITEMS))), dict[int, QueueItem | None]()
    for _n in range(100):
        with pytest.raises(Unreadable):
            reader.items_after(0, known)
    assert len(known) <= mission_queue.MOST_ITEMS


def test_another_item_than_the_one_that_was_asked_for_proves_nothing() -> None:
    reader = reader_of(set(range(1, 30)), lambda _number: QueueItem(5))
    with pytest.raises(Unreadable, match="instead of"):
        reader.items_after(12)


@pytest.mark.parametrize(
    "states",
    [
        {"Ausstehend": "Pending", "Fertig": "Done"},
        {"Aktiv": "Executing"},
        {"Ausstehend": "Pending", "Wartend": "Pending"},
    ],
)
def test_open_items_are_found_when_a_check_up_learned_only_some_words(
    states: dict[str, str],
) -> None:
    robot = QueueTransport(
        [
            item(1, state="Fertig"),
            item(2, state="Aktiv") | {"finished": None},
            item(3, state="Ausstehend") | {"finished": None},
        ]
    )
    client = RobotClient(
        Address.parse("r1"), Token(""), transport=robot, profile=RobotProfile(None, None, item_states=states)
    )
    assert {entry.id for entry in client.open_items()} >= {2, 3}
