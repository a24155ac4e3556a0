"""Trials on robots that answer nonsense, refuse or lose things: a report in any case, and nothing left."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable

import pytest

from app.domain.check_up import Level, Topic
from app.domain.message import render
from app.mir.errors import ConnectionLost
from app.mir.raw_client import RawClient
from app.mir.transport import Response
from app.services.catalogue.database_check import find_problem
from app.services.check_up.trials import RELEASED_WITHIN
from mir_sim import MISSIONS, deviant
from tests.services.check_up.test_reading import ODD, SIMULATED
from tests.support.check_up_site import CheckedRobot, Killed
from tests.support.examples import every_fourth
from tests.support.findings import in_words, not_green, says
from tests.support.recorded_robot import AskedRobot
from tests.support.site import GUIDS

FORBIDDEN = Response(403, b'{"error_code": "unauthorized", "error_human": "no"}', {})
QUEUE = "/mission_queue"


MEANT: dict[str, Callable[[str, str], bool]] = {
    "the list": lambda method, path: (method, path) == ("GET", QUEUE),
    "the search": lambda method, path: path == f"{QUEUE}/search",
    "orders": lambda method, path: (method, path) == ("POST", QUEUE),
    "missions": lambda method, path: path.startswith("/missions") or path == "/mission_groups",
    "items": lambda method, path: method == "GET" and path.startswith(f"{QUEUE}/"),
    "cancelling": lambda method, path: method == "DELETE" and path.startswith(QUEUE),
    "pausing": lambda method, path: (method, path) == ("PUT", "/status"),
    "everything": lambda method, path: True,
}


CASES = list(itertools.product(sorted({*ODD} - {"gone"}), MEANT))  # reported as missing from the queue


@pytest.mark.usefixtures("quick_reading")
@pytest.mark.parametrize(("odd", "meant"), every_fourth(CASES))
def test_odd_answers_make_a_report_and_leave_nothing(robot, odd, meant):
    robot.asked.gives(ODD[odd], lambda method, path: bool(robot.asked.writes) and MEANT[meant](method, path))
    report = robot.trial()
    topics = [each.topic for each in report.findings]
    assert (len(set(topics)), Topic.LEFT in topics) == (len(topics), True), in_words(report)
    if meant in ("orders", "everything"):
        assert any(each.topic.is_tried and each.level is not Level.GREEN for each in report.findings), in_words(report)
    robot.asked.behave()
    robot.clean_up()
    robot.check_is_restored(in_words(report))


def test_a_user_who_may_not_start_missions_is_a_red_finding(robot):
    robot.asked.gives(FORBIDDEN, MEANT["orders"])
    assert says(robot.trial("Home"), Topic.ORDER) == (Level.RED, "User Distributor may not start missions")


def test_a_user_who_may_not_make_missions_is_asked_to_choose_one(robot):
    robot.asked.gives(FORBIDDEN, lambda method, path: (method, path) == ("POST", "/missions"))
    report = robot.trial()
    assert says(report, Topic.ORDER) == (Level.AMBER, "User Distributor may not make a mission for the trial")
    assert not report.is_complete
    robot.asked.behave()
    robot.clean_up()
    robot.check_is_restored()


def test_a_user_who_may_not_pause_the_robot_learns_the_rest(robot):
    robot.asked.gives(FORBIDDEN, MEANT["pausing"])
    robot.machine.pause = lambda: None
    report = robot.trial()
    assert not_green(report) == {**SIMULATED, Topic.PAUSE: Level.AMBER}, in_words(report)
    assert report.profile.token_field == "description"


def test_a_robot_that_does_not_pause_is_a_red_finding(robot):
    """It says that it stands in Pause, and drives on."""
    robot.machine._settle_paused = robot.machine._settle

    def settle():
        paused, robot.machine.paused = robot.machine.paused, False
        robot.machine._settle_paused()
        robot.machine.paused = paused

    robot.machine._settle = settle
    report = robot.trial()
    assert says(report, Topic.PAUSE)[0] is Level.RED, in_words(report)


def test_a_robot_on_which_priority_counts_is_known_to(robot):
    queue = robot.machine.queue
    pending = queue.pending
    queue.pending = lambda: sorted(pending(), key=lambda item: (-item.priority, item.id))
    report = robot.trial()
    assert (report.profile.priority_counts, not_green(report)) == (True, SIMULATED), in_words(report)
    assert says(report, Topic.PAUSE)[1] == "While it is paused, missions wait. The running one continues afterwards"


@pytest.mark.parametrize("profile", [None, deviant("german-states")])
def test_a_mission_that_fails_is_a_red_finding(tmp_path, profile):
    robot = CheckedRobot(tmp_path, profile, history=0)
    robot.asked.before = lambda method, path: (
        setattr(robot.machine, "failure_rate", 1.0) if path == "/mission_groups" else None
    )
    report = robot.trial()
    assert {topic for topic, level in not_green(report).items() if level is Level.RED} == {Topic.WORDS, Topic.LEFT}, (
        in_words(report)
    )
    assert "Done" not in report.profile.item_states.values()
    assert says(report, Topic.LEFT)[1] == "Nothing of the trial is left on it, but it has an error"
    assert robot.as_it_is()["open"] == []


def test_while_something_can_not_be_undone_it_is_reported_and_tried_again(robot):
    lost = ConnectionLost(address="10.0.0.1")
    robot.asked.gives(lost, lambda method, path: method == "GET" and path.endswith("/actions"))
    assert says(robot.trial(), Topic.LEFT)[0] is Level.RED
    robot.clean_up()
    assert robot.check_ups.left_behind() == [robot.id]
    with pytest.raises(ValueError, match=r"^the last check-up has not been undone yet"):
        robot.trial()
    robot.asked.behave()
    robot.clean_up()
    robot.check_is_restored()


def test_a_robot_that_others_use_since_is_not_released_by_what_is_done_late(robot):
    def die_when_released(method, path):
        if method == "PUT" and "PUT /status" in robot.asked.writes:
            robot.kill_at(0, is_handled=False)
            raise Killed

    robot.asked.before = die_when_released
    with pytest.raises(Killed):
        robot.trial()
    robot.start_again()
    machine = robot.machine
    user = next(row for row in machine.site.table("/users") if row["name"] == "Administrator")
    machine.order(GUIDS["Home"], user)
    assert machine.paused
    robot.asked.clock.advance(RELEASED_WITHIN.total_seconds())
    problem = robot.check_ups.put_back(robot.id)
    assert render(problem) == "it is paused, with missions of others in its queue: press Resume there or in the app"
    assert [str(item.state) for item in machine.queue][-1] == "Pending"
    machine.resume()
    assert robot.check_ups.put_back(robot.id) is None
    assert not robot.check_ups.left_behind()


def test_what_a_trial_showed_stays_known_when_the_robot_is_only_read(robot):
    tried = robot.trial().profile
    read = robot.check_ups.run(robot.id).profile
    assert (read.token_field, read.cancelled_message, read.priority_counts) == (
        "description",
        tried.cancelled_message,
        False,
    )
    assert robot.container.catalogue.robot(robot.id).known == read


def test_what_a_robot_calls_things_has_bounds(robot):
    """Stored values must be readable at the next start, for any fields and words of a robot."""

    def rename(method, path, answer):
        if not path.startswith(QUEUE) or b'"description"' not in answer.body:
            return answer
        found = json.loads(answer.body)
        for item in found if isinstance(found, list) else [found]:
            for field in ("x" * 20_000, "\n\x1b[31m"):
                item[field] = item["description"]
            item["state"], item["message"] = item["state"] + "Z" * 20_000, "m" * 20_000
            del item["description"]
        return Response(answer.status, json.dumps(found).encode(), answer.headers)

    robot.asked.meddle = rename
    report = robot.trial()
    assert (report.is_complete, report.profile.token_field) == (True, "")
    assert max(map(len, report.profile.item_states)) <= 40
    assert len(report.profile.cancelled_message or "") <= 200
    robot.container.db.close()
    robot.open()
    assert find_problem(robot.container.db.read()) is None
    assert robot.check_ups.report(robot.id) == report


def test_missions_without_times_are_reported(tmp_path):
    whole = AskedRobot().machine.order(MISSIONS[0].guid, {"guid": "", "name": ""}).full()
    report = CheckedRobot(tmp_path, fields={"item": frozenset(whole) - {"started", "finished"}}).trial()
    assert says(report, Topic.WORDS)[1] == "A completed mission lacks its times: started, finished"
    assert report.is_complete


@pytest.mark.parametrize("states", [("Executing", "Done"), ("Done", "Cancelled")])
def test_one_word_for_several_states_is_not_learnt(tmp_path, states):
    report = CheckedRobot(tmp_path, item_states=dict.fromkeys(states, "Over")).trial()
    assert report.profile.item_states == {}
    assert says(report, Topic.WORDS)[1] == "It has one word for several states of missions: Over"


def test_a_robot_that_bears_little_is_asked_less(tmp_path):
    robot = CheckedRobot(tmp_path, deviant("reboots-under-load"))
    robot.trial()
    rest = robot.container.catalogue.robot(robot.id).known.rest
    assert robot.machine.reboots == 1  # by the questions that are to show it
    probe = RawClient(robot.asked.client(), robot.asked.clock)
    probe.spare(rest.requests, rest.seconds)
    for _ in range(200):
        assert probe.get("/missions").is_good
    assert robot.machine.reboots == 1


def test_on_a_slow_robot_the_plan_is_held_to_the_end(tmp_path):
    robot = CheckedRobot(tmp_path, deviant("slow-disk"))
    unheld = []

    def look(method, path):
        if robot.asked.writes and not robot.container.holds.active(robot.id):
            unheld.append(path)

    robot.asked.before = look
    assert robot.trial().is_complete
    assert unheld == []


@pytest.mark.parametrize("limit", [1, 2, 50])
def test_what_is_stored_of_short_pages_can_be_read_again(tmp_path, limit):
    robot = CheckedRobot(tmp_path, page_limit=limit)
    robot.trial()
    assert robot.container.catalogue.robot(robot.id).known.page_limit == (limit if limit > 1 else None)
    assert find_problem(robot.container.db.read()) is None
