"""A finding needs evidence: without evidence it says "not found out"."""

from __future__ import annotations

import json
from collections.abc import Callable
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
QUEUE = "/mission_queue"


def read(robot: AskedRobot) -> CheckUpSession:
    session = robot.session()
    read_robot(session)
    return session


def of_queue(
    change: Callable[[list[dict[str, Any]]], list[dict[str, Any]]],
) -> Callable[[str, str, Response], Response]:
    """Changes every answer with a list of queue items."""

    def meddle(method, path, answer):
        if path not in (QUEUE, f"{QUEUE}/search") or not answer.body.startswith(b"["):
            return answer
        return Response(answer.status, json.dumps(change(json.loads(answer.body))).encode(), answer.headers)

    return meddle


def of_status(change: Callable[[dict[str, Any]], object]) -> Callable[[str, str, Response], Response]:
    def meddle(method, path, answer):
        if path != "/status" or answer.status != 200:
            return answer
        change(status := json.loads(answer.body))
        return Response(answer.status, json.dumps(status).encode(), answer.headers)

    return meddle


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
    session = read(AskedRobot(history=3, ignores=frozenset({ignored})))
    assert session.facts["ignores"] == {ignored}


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


def test_lists_that_are_always_the_newest_first_are_not_sorted_as_asked():
    robot = AskedRobot()

    def meddle(method, path, answer):
        if path == QUEUE and method == "GET" and answer.body.startswith(b"[") and json.loads(answer.body)[0]["id"] == 1:
            return Response(200, json.dumps([{"id": 400, "state": "Done"}]).encode(), answer.headers)
        return answer

    robot.meddle = meddle
    assert says(read(robot), Topic.SORTING) == (
        AMBER,
        "It ignores the order that is asked for: the newest entries come first",
    )


def test_a_search_that_finds_nothing_is_none():
    robot = AskedRobot()
    robot.meddle = lambda method, path, answer: Response(200, b"[]", {}) if path == f"{QUEUE}/search" else answer
    session = read(robot)
    assert says(session, Topic.SEARCH) == (AMBER, "Its search does not find items that are in its queue")
    assert session.facts["has_search"] is False


# ---------------------------------------------------------------------- who else uses it
def with_items(*changes: dict[str, Any]) -> AskedRobot:
    """A robot whose lists have these changes made to their first entries."""
    robot = AskedRobot()

    def change(rows):
        if len(rows) < 50:
            return rows
        return [{**row, **change} for row, change in zip(rows, changes, strict=False)] + [
            {**row, "created_by_name": "Distributor", "fleet_schedule_guid": ""} for row in rows[len(changes) :]
        ]

    robot.meddle = of_queue(change)
    return robot


def test_missions_of_others_without_dates_are_reported():
    robot = with_items(*[{"created_by_name": "Fleet", "ordered": None}] * 5)
    assert says(read(robot), Topic.OTHERS) == (
        AMBER,
        "5 of the newest 200 missions in its queue were queued by others; it does not report when",
    )


def test_one_recent_mission_of_another_is_reported():
    robot = with_items({"created_by_name": "Paula", "ordered": "2026-11-23T07:00:00"})
    assert says(read(robot), Topic.OTHERS) == (AMBER, "One mission of the last two hours is of Paula")


@pytest.mark.parametrize("missing", ["created_by_name", "ordered"])
def test_without_names_or_dates_it_is_not_found_out(missing):
    robot = AskedRobot()
    robot.meddle = of_queue(
        lambda rows: [
            {
                **{name: value for name, value in row.items() if name != missing},
                **({"created_by_name": None} if missing == "ordered" else {}),
            }
            for row in rows
        ]
    )
    assert says(read(robot), Topic.OTHERS) == (AMBER, "Not found out: it does not say who queued the newest missions")


def test_of_a_long_queue_in_the_other_order_the_newest_missions_are_looked_at():
    """The last page is another one than the first."""
    robot = AskedRobot(history=900, ignores=frozenset({"sort_by"}))
    entries = read(robot).entries
    assert max(entry["id"] for entry in entries) == 900


# ---------------------------------------------------------------------- itself
def test_a_status_without_battery_is_reported():
    robot = AskedRobot()
    robot.meddle = of_status(lambda status: status.pop("battery_percentage"))
    assert says(read(robot), Topic.BATTERY) == (AMBER, "It does not report its battery level")
    assert says(read(AskedRobot()), Topic.BATTERY) == (GREEN, "Its battery is at 80 %")


def test_in_emergency_stop_it_is_not_found_out_whether_it_reports_its_battery():
    robot = AskedRobot()
    robot.machine.press_emergency_stop(True)
    assert (
        says(read(robot), Topic.BATTERY)[1]
        == "Not found out whether it reports its battery level, as it stands in emergency stop"
    )


@pytest.mark.parametrize(
    ("user", "password", "level"),
    [("distributor", "distributor", AMBER), ("Admin", "admin", AMBER), ("distributor", "Tr0ub4dor", GREEN)],
)
def test_the_published_default_password_is_reported(user, password, level):
    robot = AskedRobot()
    session = robot.session()
    client = session.robot.client
    session.robot.client = RobotClient(
        client.address, Token.derive(user, password), transport=client._transport, clock=robot.clock.monotonic
    )
    read_robot(session)
    assert says(session, Topic.PASSWORD)[0] is level


def test_a_robot_that_does_not_report_its_software_is_a_note():
    robot = AskedRobot()

    def meddle(method, path, answer):
        headers = {name: value for name, value in answer.headers.items() if name.casefold() != "robot-version"}
        return Response(answer.status, b"[{}]" if path == "/software/system_status" else answer.body, headers)

    robot.meddle = meddle
    assert says(read(robot), Topic.SOFTWARE) == (
        AMBER,
        "It does not report its software; MiR's definition of 3.5.4 fits",
    )


@pytest.mark.parametrize("status", [403, 500])
def test_what_the_user_may_not_ask_says_nothing_of_its_software(status):
    robot = AskedRobot()
    robot.meddle = lambda method, path, answer: (
        Response(status, b"{}", {}) if path == "/guided_move/waypoints" else answer
    )
    assert says(read(robot), Topic.SOFTWARE)[1].startswith("Its software is 3.5.4; not found out")


def test_what_failed_for_another_reason_says_nothing_of_rights():
    robot = AskedRobot()
    robot.meddle = lambda method, path, answer: Response(500, b"{}", {}) if path == "/maps" else answer
    assert says(read(robot), Topic.RIGHTS) == (AMBER, "Not found out whether user Distributor may read: maps")


def test_missions_that_can_not_be_read_say_nothing_of_values():
    robot = AskedRobot()
    robot.meddle = lambda method, path, answer: GONE if path.startswith("/missions/") else answer
    assert says(read(robot), Topic.MISSIONS) == (
        AMBER,
        "It has 19 missions; not found out which ask for values when they are started",
    )


def test_a_status_without_map_or_words_says_nothing_of_them():
    robot = AskedRobot()
    robot.meddle = of_status(lambda status: [status.pop("map_id"), status.pop("state_text")])
    session = read(robot)
    assert says(session, Topic.MAPS)[1] == "Not found out which of its 1 maps is in use: its status does not say"
    assert says(session, Topic.LANGUAGE)[1] == "Not found out which language it speaks: it has no words for its state"


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
