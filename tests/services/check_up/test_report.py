"""The report of a check-up: as text, and as a file that makes a simulated robot of what was found."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime

import pytest

from app.domain.check_up import Finding, Level, Report, Rest, RobotProfile, Topic
from app.domain.message import message
from app.services.check_up import report as reports
from mir_sim import DEVIANTS, Profile, deviant
from mir_sim.profile import ITEM_FIELDS, KEYS, read
from tests.support.check_up_site import CheckedRobot
from tests.support.recorded_robot import ZONE

NOT_IN_A_PROFILE = (Topic.OTHERS, Topic.LANGUAGE)  # other users of the robot; texts that nothing depends on
MEASURED = ("clock_offset", "latency", "lost", "quiet_s", "timeout_s", "rest")


def checked(directory, profile=None) -> Report:
    robot = CheckedRobot(directory, profile)
    robot.asked.clock.advance(3630)
    return robot.trial()


def levels_of(report: Report) -> dict[Topic, Level]:
    return {finding.topic: finding.level for finding in report.findings if finding.topic not in NOT_IN_A_PROFILE}


def as_simulated(report: Report, path) -> Profile:
    path.write_text(reports.document(report, ZONE), encoding="utf-8")
    return read(path)


QUICK = (None, "moves-descriptions", "german-states", "slow-disk")


@pytest.mark.parametrize(
    "name", [*QUICK, *(pytest.param(name, marks=pytest.mark.long) for name in DEVIANTS if name not in QUICK)]
)
def test_a_simulated_robot_made_of_the_file_is_found_to_be_the_same(tmp_path, name):
    found = checked(tmp_path / "robot", deviant(name) if name else None)
    again = checked(tmp_path / "simulated", as_simulated(found, tmp_path / "found.json"))
    assert again.profile.serial_number == found.profile.serial_number  # of the same seed
    same = dict.fromkeys(MEASURED)
    assert replace(again.profile, **same) == replace(found.profile, **same)
    assert again.profile.clock_offset == pytest.approx(found.profile.clock_offset, abs=1.0)
    assert again.profile.latency == pytest.approx(found.profile.latency, abs=1.5)
    assert (again.profile.rest is None) is (found.profile.rest is None)
    assert levels_of(again) == levels_of(found)


REPORT = Report(
    "Aino <&>",
    "http://10.0.0.1",
    "MiR250",
    datetime(2026, 11, 23, 6, 0, tzinfo=UTC),
    95.4,
    (
        Finding(
            Topic.SEARCH,
            Level.AMBER,
            message("Its queue can't be searched: {problem}", problem="<b>no</b>"),
            message("Nothing to do."),
        ),
        Finding(
            Topic.LOAD,
            Level.RED,
            message("It booted when it was asked {n} times within 10 s", n=31),
            message("The app asks less."),
        ),
        Finding(
            Topic.SOFTWARE,
            Level.GREEN,
            message(
                "Its software is {software}. MiR's definition of {definition} fits",
                software="3.5.4",
                definition="3.5.4",
            ),
        ),
    ),
    RobotProfile("S1", "3.5.4"),
)


def test_the_text_has_every_finding_and_the_worst_first():
    lines = reports.text(REPORT, "Europe/Helsinki").splitlines()
    assert lines[:4] == [
        "Check-up of Aino <&>",
        "MiR250, serial number S1, software 3.5.4, at http://10.0.0.1",
        "2026-11-23 08:00 (Europe/Helsinki), it took 95 s",
        "Only read: no mission was queued",
    ]
    assert lines[5:] == [
        "Problem",
        "- Load: It booted when it was asked 31 times within 10 s.",
        "  The app asks less.",
        "",
        "Note",
        "- Searching: Its queue can't be searched: <b>no</b>.",
        "  Nothing to do.",
        "",
        "Fine",
        "- Software: Its software is 3.5.4. MiR's definition of 3.5.4 fits.",
    ]


def test_every_topic_and_level_has_its_name():
    assert set(reports.TOPICS) == set(Topic)
    assert set(reports.LEVELS) == set(Level)


def test_what_is_not_complete_says_so():
    assert "It is not complete" in reports.text(replace(REPORT, is_complete=False), ZONE)
    assert "Tried with the mission Home" in reports.text(replace(REPORT, mission="Home"), ZONE)


def test_a_robot_without_facts_is_known_by_its_address_and_a_question_keeps_its_mark():
    silent = replace(
        REPORT,
        model="",
        profile=RobotProfile(None, None),
        findings=(
            Finding(
                Topic.IDENTITY, Level.RED, message("It could not be asked: {problem}", problem="is it switched on?")
            ),
        ),
    )
    lines = reports.text(silent, ZONE).splitlines()
    assert lines[1] == "At http://10.0.0.1. It did not report what it is"
    assert lines[-1] == "- Who it is: It could not be asked: is it switched on?"


@pytest.mark.parametrize(
    ("software", "said"), [("2.13.5", "Software 2.13.5, at "), (None, "At http://10.0.0.1. It did")]
)
def test_a_fleet_has_no_model_and_no_serial_number_that_a_person_knows(software, said):
    profile = RobotProfile("b8a9f3c0-0000-4000-8000-000000000000", software)
    lines = reports.heading(replace(REPORT, model="", profile=profile, of_fleet=True), ZONE)
    assert lines[1].startswith(said)


def test_the_file_has_the_simulators_keys_the_findings_and_no_secret(tmp_path):
    robot = CheckedRobot(tmp_path)
    written = reports.document(robot.check_ups.run(robot.id), ZONE)
    found = json.loads(written)
    assert set(found) <= set(KEYS)
    assert {each["topic"] for each in found["report"]["findings"]} == {topic for topic in Topic if not topic.is_tried}
    assert found["report"]["profile"]["serial_number"] == robot.machine.serial_number
    token = robot.container.catalogue.robot(robot.id).token
    assert token
    assert token.removeprefix("Basic ") not in written
    assert "password" not in set(found) | set(found["report"]) | set(found["report"]["profile"])
    assert "distributor" not in written.replace("Distributor", "")


@pytest.mark.parametrize(
    ("software", "nearest"),
    [
        ("2.13.1.4", "2.14.7"),
        ("3.0.0", "3.5.4"),
        ("3.5.4", "3.5.4"),
        ("3.10.2", "3.8.1"),
        ("4.0", "3.8.1"),
        ("1.9", None),
        ("?", None),
        (None, None),
    ],
)
def test_the_simulated_robot_has_the_nearest_software(tmp_path, software, nearest):
    report = replace(REPORT, profile=RobotProfile("S1", software))
    assert json.loads(reports.document(report, ZONE)).get("software") == nearest
    assert as_simulated(report, tmp_path / "found.json").software == (nearest or "3.5.4")


@pytest.mark.parametrize(
    "found",
    [
        *({"token_field": field} for field in (*ITEM_FIELDS, "", "order_description")),
        *({"clock_offset": seconds} for seconds in (-2e9, 2e9, 3.0)),
        {"item_states": {"": "Cancelled", "Fertig": "Done", "Valmis": "Done"}},
        {"item_states": {"Weg": "Cancelled", "Stopp": "Aborted"}},
        {"page_limit": 0},
        {"latency": (0.0, 0.0, 0.0, 0.0)},
        {"rest": Rest(1, 1.0)},
        {"ignores": frozenset({"filters"})},
        {"cancelled_message": "Aborted - User Request"},
        {"cancelled_message": ""},
        {"order_status": 202},
        {"has_search": False},
    ],
    ids=str,
)
def test_the_simulator_takes_whatever_was_found(tmp_path, found):
    assert as_simulated(replace(REPORT, profile=replace(RobotProfile("S1", "3.5.4"), **found)), tmp_path / "found.json")
