"""A finding needs evidence: without evidence it says "not found out"."""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import zip_longest
from typing import Any

import pytest

from app.domain.check_up import Level, Topic
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.transport import Response
from app.services.check_up import report as reports
from app.services.check_up.probes import read_robot
from app.services.check_up.session import CheckUpSession
from mir_sim import profile as simulated
from mir_sim.mission_queue import QueueItem
from tests.support.check_up_site import CheckedRobot
from tests.support.findings import says
from tests.support.recorded_robot import ZONE, AskedRobot

AMBER, GREEN = Level.AMBER, Level.GREEN
FEW = "Not found out: too few missions are in its queue"
GONE = Response(404, b'{"error_human": "not found"}', {})
BROKEN = Response(500, b"{}", {})
QUEUE = "/mission_queue"
Meddle = Callable[[str, str, Response], Response]


def read(robot: AskedRobot) -> CheckUpSession:
    session = robot.session()
    read_robot(session)
    return session


def of_queue(change: Callable[[list[dict[str, Any]]], list[dict[str, Any]]]) -> Meddle:
    """Changes every answer with a list of queue items."""

    def meddle(method, path, answer):
        if path not in (QUEUE, f"{QUEUE}/search") or not answer.body.startswith(b"["):
            return answer
        return Response(answer.status, json.dumps(change(json.loads(answer.body))).encode(), answer.headers)

    return meddle


def without(name: str) -> Meddle:
    """Of its status."""

    def meddle(_method, path, answer):
        if path != "/status" or answer.status != 200:
            return answer
        status = json.loads(answer.body)
        del status[name]
        return Response(answer.status, json.dumps(status).encode(), answer.headers)

    return meddle


@pytest.fixture
def robot() -> AskedRobot:
    return AskedRobot()


# ---------------------------------------------------------------------- its queue
def test_an_empty_queue_shows_neither_order_nor_pages_nor_search():
    session = read(AskedRobot(history=0))
    for topic in (Topic.SORTING, Topic.PAGING, Topic.SEARCH):
        assert says(session, topic) == (AMBER, FEW)
    assert says(session, Topic.QUEUE) == (GREEN, "Its queue is empty, and can be read")
    assert says(session, Topic.OTHERS) == (GREEN, "Its queue is empty: not in use now")
    assert not session.facts.keys() & {"has_search", "page_limit", "ignores"}


@pytest.mark.parametrize("ignored", [(), ("sort_by", "limit", "offset", "whitelist", "filters")])
def test_one_mission_shows_neither_order_nor_pages(ignored):
    session = read(AskedRobot(history=1, ignores=frozenset(ignored)))
    assert says(session, Topic.SORTING) == (AMBER, FEW)
    assert says(session, Topic.PAGING)[0] is AMBER


@pytest.mark.parametrize("ignored", ["sort_by", "limit", "offset"])
def test_three_missions_show_what_is_ignored(ignored):
    assert read(AskedRobot(history=3, ignores=frozenset({ignored}))).facts["ignores"] == {ignored}


@pytest.mark.parametrize(
    ("ids", "ignored"), [((401, 405, 409), "offset"), ((7, 9, 90), "offset"), ((7, 9, 90), "sort_by")]
)
def test_numbers_with_gaps_are_no_limit_of_pages(ids, ignored):
    robot = AskedRobot(history=0, ignores=frozenset({ignored}))
    for number in ids:
        robot.machine.queue.add(QueueItem(number, "m", "2026-11-23T06:00:00", "u", "Distributor"))
    session = read(robot)
    assert "page_limit" not in session.facts
    assert session.facts["ignores"] == {ignored}


def test_a_robot_that_ignores_offset_and_gives_short_pages_has_a_limit():
    session = read(AskedRobot(history=400, page_limit=50, ignores=frozenset({"offset"})))
    assert session.facts["page_limit"] == 50


def test_a_search_that_finds_nothing_is_none(robot):
    robot.gives(Response(200, b"[]", {}), lambda method, path: path == f"{QUEUE}/search")
    session = read(robot)
    assert says(session, Topic.SEARCH) == (AMBER, "Its search does not find items that are in its queue")
    assert session.facts["has_search"] is False


# ---------------------------------------------------------------------- who else uses it
def test_of_a_long_queue_in_the_other_order_the_newest_missions_are_looked_at():
    """The last page is another one than the first."""
    robot = AskedRobot(history=900, ignores=frozenset({"sort_by"}))
    assert max(entry["id"] for entry in read(robot).entries) == 900


# ---------------------------------------------------------------------- itself
def test_the_battery_level_is_reported():
    assert says(read(AskedRobot()), Topic.BATTERY) == (GREEN, "Its battery is at 80 %")


def test_in_emergency_stop_it_is_not_found_out_whether_it_reports_its_battery(robot):
    robot.machine.press_emergency_stop(True)
    assert (
        says(read(robot), Topic.BATTERY)[1]
        == "Not found out whether it reports its battery level, as it stands in emergency stop"
    )


@pytest.mark.parametrize(
    ("user", "password", "level"),
    [("distributor", "distributor", AMBER), ("Admin", "admin", AMBER), ("distributor", "Tr0ub4dor", GREEN)],
)
def test_the_published_default_password_is_reported(robot, user, password, level):
    session = robot.session()
    client = session.robot.client
    session.robot.client = RobotClient(
        client.address, Token.derive(user, password), transport=client._transport, clock=robot.clock.monotonic
    )
    read_robot(session)
    assert says(session, Topic.PASSWORD)[0] is level


@pytest.mark.parametrize("status", [403, 500])
def test_what_the_user_may_not_ask_says_nothing_of_its_software(robot, status):
    robot.gives(Response(status, b"{}", {}), lambda method, path: path == "/guided_move/waypoints")
    assert says(read(robot), Topic.SOFTWARE)[1].startswith("Its software is 3.5.4. Not found out")


# ---------------------------------------------------------------------- what it does not say, or says oddly
def at(path: str, answer: Response) -> Meddle:
    """Its answer to that, and to what is below it."""
    return lambda method, asked, own: answer if asked.startswith(path) else own


def newest_first(method: str, path: str, own: Response) -> Response:
    """Whichever order is asked for."""
    if path == QUEUE and method == "GET" and own.body.startswith(b"[") and json.loads(own.body)[0]["id"] == 1:
        return Response(200, b'[{"id": 400, "state": "Done"}]', own.headers)
    return own


def without_software(_method: str, path: str, own: Response) -> Response:
    headers = {name: value for name, value in own.headers.items() if name.casefold() != "robot-version"}
    return Response(own.status, b"[{}]" if path == "/software/system_status" else own.body, headers)


def begin_with(*changes: dict[str, Any]) -> Meddle:
    """Long lists have these changes made to their first entries; all others are the app's."""
    app = {"created_by_name": "Distributor", "fleet_schedule_guid": ""}
    return of_queue(
        lambda rows: (
            [row | change for row, change in zip_longest(rows, changes, fillvalue=app)] if len(rows) >= 50 else rows
        )
    )


FLEET, PAULA = (
    {"created_by_name": "Fleet", "ordered": None},
    {"created_by_name": "Paula", "ordered": "2026-11-23T07:00:00"},
)
NO_NAMES = of_queue(lambda rows: [{name: row[name] for name in row if name != "created_by_name"} for row in rows])
NO_DATES = of_queue(lambda rows: [{**row, "created_by_name": None, "ordered": None} for row in rows])
WHOSE = "Not found out: it does not say who queued the newest missions"
NEWEST_FIRST = "It ignores the order that is asked for: the newest entries come first"
UNDATED = "5 of the newest 200 missions in its queue were queued by others. It does not report when"
NO_MISSIONS = "It has 19 missions. Not found out which ask for values when they are started"
NO_MAP = "Not found out which of its 1 maps is in use: its status does not say"
NO_WORDS = "Not found out which language it speaks: it has no words for its state"
NO_VERSION = "It does not report its software. MiR's definition of 3.5.4 fits"


@pytest.mark.parametrize(
    ("meddle", "topic", "text"),
    [
        pytest.param(newest_first, Topic.SORTING, NEWEST_FIRST, id="always the newest first"),
        pytest.param(begin_with(*[FLEET] * 5), Topic.OTHERS, UNDATED, id="missions of others without dates"),
        pytest.param(
            begin_with(PAULA), Topic.OTHERS, "One mission of the last two hours is of Paula", id="one of another"
        ),
        pytest.param(NO_NAMES, Topic.OTHERS, WHOSE, id="no names"),
        pytest.param(NO_DATES, Topic.OTHERS, WHOSE, id="no dates"),
        pytest.param(without_software, Topic.SOFTWARE, NO_VERSION, id="no software"),
        pytest.param(at("/missions/", GONE), Topic.MISSIONS, NO_MISSIONS, id="no actions of missions"),
        pytest.param(
            at("/maps", BROKEN), Topic.RIGHTS, "Not found out whether user Distributor may read: maps", id="no maps"
        ),
        pytest.param(
            without("battery_percentage"), Topic.BATTERY, "It does not report its battery level", id="no battery"
        ),
        pytest.param(without("map_id"), Topic.MAPS, NO_MAP, id="no map in its status"),
        pytest.param(without("state_text"), Topic.LANGUAGE, NO_WORDS, id="no words in its status"),
    ],
)
def test_what_is_missing_or_odd_is_a_note(robot, meddle, topic, text):
    robot.meddle = meddle
    assert says(read(robot), topic) == (AMBER, text)


# ---------------------------------------------------------------------- a robot that removes what has ended
def removes(robot: CheckedRobot, *states: str) -> None:
    """Items in these states are missing from its queue in every way of reading it."""

    def meddle(method, path, answer):
        if not path.startswith(QUEUE) or answer.status >= 300 or not answer.body:
            return answer
        found = json.loads(answer.body)
        if isinstance(found, list):
            return Response(
                answer.status,
                json.dumps([row for row in found if row.get("state") not in states]).encode(),
                answer.headers,
            )
        return GONE if method == "GET" and found.get("state") in states else answer

    robot.asked.meddle = meddle


def test_a_robot_that_removes_cancelled_missions_has_no_word_for_them(tmp_path):
    robot = CheckedRobot(tmp_path)
    removes(robot, "Aborted", "Abort")
    report = robot.trial()
    assert says(report, Topic.CANCELLED) == (AMBER, "A cancelled mission is not in its queue any longer")
    assert "" not in report.profile.item_states
    assert simulated.profile_of(json.loads(reports.document(report, ZONE)))


def test_a_robot_that_removes_all_that_has_ended_is_said_to(tmp_path):
    robot = CheckedRobot(tmp_path, history=0)
    removes(robot, "Aborted", "Abort", "Done")
    report = robot.trial()
    assert says(report, Topic.WORDS) == (AMBER, "A mission that has ended is not in its queue any longer")
    assert says(report, Topic.CANCELLED) == (AMBER, "A cancelled mission is not in its queue any longer")
    assert "goes on afterwards" not in reports.text(report, ZONE)
    assert simulated.profile_of(json.loads(reports.document(report, ZONE)))
