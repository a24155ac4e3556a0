"""What a check-up reads of a robot: a finding of each topic, and nothing is written to it."""

from __future__ import annotations

import re
from collections.abc import Mapping

import pytest

from app.domain.check_up import Level, Topic
from app.domain.message import render
from app.domain.models import Robot
from app.domain.robot import RobotStatus
from app.mir.transport import Response
from app.services.check_up import load_probes
from app.services.check_up.load_probes import latency, load
from app.services.check_up.probes import read_robot
from app.services.check_up.session import Cancelled
from mir_sim import deviant
from tests.support.check_up_site import CheckedRobot
from tests.support.findings import in_words, not_green
from tests.support.recorded_robot import AskedRobot

READ = [topic for topic in Topic if not topic.is_tried]
SIMULATED = {Topic.CERTIFICATE: Level.AMBER, Topic.PASSWORD: Level.AMBER}  # it speaks http and has the default password
EMPTY = dict.fromkeys((Topic.SORTING, Topic.PAGING, Topic.SEARCH), Level.AMBER)  # what an empty queue does not show
# The topics that are not green, besides these.
NAMED: Mapping[str, dict[Topic, Level]] = {
    "forgets-descriptions": {},
    "renames-descriptions": {},
    "moves-descriptions": {},
    "no-id": {},  # shown by a trial only
    "no-search": {Topic.SEARCH: Level.AMBER},
    "pages-of-50": {Topic.PAGING: Level.AMBER},
    "ignores-sort": {Topic.SORTING: Level.AMBER},
    "german-texts": {Topic.LANGUAGE: Level.AMBER},
    "german-states": {Topic.LANGUAGE: Level.AMBER},
    "cancelled": {Topic.LANGUAGE: Level.AMBER},
    "slow-disk": {Topic.LATENCY: Level.RED},
    "other-zone": {Topic.CLOCK: Level.AMBER},
    "reboots-under-load": {Topic.LOAD: Level.RED},
    "fleet": {Topic.OTHERS: Level.AMBER},
}


def read(robot: AskedRobot, **values):
    session = robot.session(**values)
    read_robot(session)
    return session


@pytest.fixture
def robot() -> AskedRobot:
    return AskedRobot()


@pytest.mark.parametrize(("software", "history"), [("2.14.7", 3), ("3.5.4", 0), ("3.5.4", 400), ("3.8.1", 3)])
def test_a_faithful_robot_is_green(software, history):
    robot = AskedRobot(software=software, history=history)
    session = read(robot)
    assert not_green(session) == SIMULATED | ({} if history else EMPTY), in_words(session)
    assert [finding.topic for finding in session.findings] == sorted(
        READ, key=[f.topic for f in session.findings].index
    )
    assert set(READ) == {finding.topic for finding in session.findings}
    assert "60 of 60 questions were answered" in in_words(session)
    assert robot.writes == []


def test_a_slow_robot_is_reported_with_its_questions_and_their_time():
    robot = AskedRobot(deviant("slow-disk"))
    session = robot.session()
    began = robot.clock.now()
    session.add(Topic.LOAD, load(session))
    took = (robot.clock.now() - began).total_seconds()
    [finding] = session.findings
    found = re.fullmatch(r"It answered (\d+) questions within (\d+) s", render(finding.says))
    assert 2 <= int(found[1]) <= 5
    assert 10 <= int(found[2]) <= took < 30


def test_a_robot_that_is_slow_to_answer_is_asked_less_so_that_it_lasts_no_longer():
    robot = AskedRobot(deviant("slow-disk"))
    session = robot.session()
    began = robot.clock.now()
    session.add(Topic.LATENCY, latency(session))
    assert (robot.clock.now() - began).total_seconds() < 60.0 + 9.0
    (finding,) = session.findings
    assert finding.level is Level.RED
    answered, of = (int(word) for word in render(finding.says).split()[:3:2])
    assert answered == of in range(7, 20)


def test_another_robot_of_the_list_with_its_serial_number_is_a_problem(tmp_path):
    robot = CheckedRobot(tmp_path)
    assert Topic.IDENTITY not in not_green(robot.check_ups.run(robot.id))
    serial = robot.machine.serial_number
    robots = robot.container.repositories.robots
    for name, number in (("Veikko", serial), ("Sisu", serial), ("Lempi", "of another"), ("Onni", "")):
        other = robot.container.catalogue.save_robot(
            Robot(name, f"http://{name}", "distributor"), password="distributor"
        )
        if number:  # as its worker stores it once it has asked
            robot.container.db.write(
                lambda c, other=other, number=number: robots.note_identity(c, other, serial_number=number)
            )
    report = robot.check_ups.run(robot.id)
    assert not_green(report)[Topic.IDENTITY] is Level.RED
    assert f"red identity: Its serial number {serial} is also that of Sisu, Veikko - They are one machine" in in_words(
        report
    )
    assert robot.check_ups.report(robot.id) == report


def test_no_answer_takes_no_time(monkeypatch):
    session = AskedRobot().session()
    monkeypatch.setattr(session, "status", RobotStatus)  # at once
    monkeypatch.setattr(load_probes, "QUESTIONS", 3)
    session.add(Topic.LATENCY, latency(session))
    assert "3 of 3 questions were answered, half of these within 0.01 s, the slowest in 0.01 s" in in_words(session)


ODD = {
    "a page": Response(200, b"<html><body>Sign in</body></html>", {"Content-Type": "text/html"}),
    "no JSON": Response(200, b"\xff\xfe{", {}),
    "a text": Response(200, b'"yes"', {}),
    "a number": Response(200, b"17", {}),
    "null": Response(200, b"null", {}),
    "an object": Response(200, b"{}", {}),
    "a list of odd things": Response(
        200, b'[null, 3, "x", [], {}, {"id": "7", "guid": 5, "ordered": 9, "state": {}}]', {}
    ),
    "ids of all kinds": Response(200, b'[{"id": true, "state": "Done"}, {"id": -4, "state": ""}, {"id": 9e99}]', {}),
    "nothing": Response(204, b"", {}),
    "refused": Response(401, b"", {}),
    "forbidden": Response(403, b"{}", {}),
    "gone": Response(410, b"", {}),
    "busy": Response(503, b"{}", {}),
    "elsewhere": Response(302, b"", {"Location": "http://10.9.9.9/"}),
}


@pytest.mark.parametrize("but_for", ["/status", ""])
@pytest.mark.parametrize("odd", ODD)
def test_odd_answers_are_findings_and_nothing_else(robot, odd, but_for):
    """To everything, or to everything but its status."""
    robot.gives(ODD[odd], lambda method, path: path != but_for)
    session = read(robot)
    assert any(finding.level is Level.RED for finding in session.findings), in_words(session)
    assert len({finding.topic for finding in session.findings}) == len(session.findings)
    assert robot.writes == []


def test_it_ends_where_somebody_wants_it_to(robot):
    wanted = iter([True] * 20)
    with pytest.raises(Cancelled):
        read(robot, is_wanted=lambda: next(wanted, False))
    assert len(robot.requests) < 80
