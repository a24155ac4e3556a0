"""Stored check-ups: read back unchanged, valid for one machine with one software, deleted and restored with their robot."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import pytest

from app.container import Container
from app.database.backups import back_up
from app.database.check_ups import CheckUpRepository
from app.domain.check_up import Finding, LeftBehind, Level, Report, Rest, RobotProfile, Topic
from app.domain.message import message
from app.domain.models import Fleet, InvalidInput, Robot
from tests.support.clock import VirtualClock

PROFILE = RobotProfile(
    "S1",
    "3.5.4",
    has_search=False,
    page_limit=50,
    ignores=frozenset({"sort_by", "limit"}),
    token_field="order_description",
    item_states={"Fertig": "Done"},
    cancelled_message="Abgebrochen",
    gives_id=False,
    order_status=200,
    timezone="Asia/Tokyo",
    clock_offset=-1.5,
    latency=(0.1, 0.2, 0.5, 9.0),
    lost=0.05,
    rest=Rest(30, 10.0),
    priority_counts=False,
    quiet_s=90.0,
    timeout_s=18.0,
)
REPORT = Report(
    "R1",
    "http://10.0.0.1",
    "MiR250",
    datetime(2026, 11, 23, 6, tzinfo=UTC),
    81.5,
    (
        Finding(
            Topic.SEARCH,
            Level.AMBER,
            message("Its queue can't be searched: {problem}", problem="404"),
            message("Nothing."),
        ),
        Finding(Topic.CLOCK, Level.GREEN, message("Its clock is right, in {zone}", zone="Asia/Tokyo")),
    ),
    PROFILE,
    "Wait",
    False,
)
CHECK_UPS = CheckUpRepository()


@pytest.fixture
def container(tmp_path):
    container = Container.open(tmp_path, VirtualClock())
    yield container
    container.close()


@pytest.fixture
def robot(container) -> Robot:
    robot = container.catalogue.save_robot(Robot("R1", "http://10.0.0.1", "admin"), password="admin")
    note(container, robot, serial_number="S1", software="3.5.4")
    return current(container, robot)


def note(container, robot, **identity: str) -> None:
    container.db.write(lambda c: container.repositories.robots.note_identity(c, robot, **identity))


def current(container, robot) -> Robot:
    return container.repositories.robots.get(container.db.read(), robot.id)


def put(container, robot, report=REPORT) -> None:
    container.db.write(lambda c: CHECK_UPS.put(c, robot.id, report))


@pytest.mark.parametrize(
    "report", [REPORT, replace(REPORT, findings=(), profile=RobotProfile("S1", None), mission="", is_complete=True)]
)
def test_it_is_read_back_unchanged(container, robot, report):
    put(container, robot, report)
    assert CHECK_UPS.report(container.db.read(), robot.id) == report


def test_a_robot_has_its_profile_and_with_another_software_none(container, robot):
    assert robot.known is None
    put(container, robot)
    note(container, robot, software="3.8.1")
    assert current(container, robot).known is None
    note(container, robot, software="3.5.4")
    assert current(container, robot).known == PROFILE


def test_another_machine_gets_nothing_of_it(container, robot):
    put(container, robot)
    container.catalogue.save_robot(replace(current(container, robot), serial_number="S2"), password="admin")
    assert current(container, robot).known is None
    put(container, robot)
    assert CHECK_UPS.report(container.db.read(), robot.id) is None


def test_a_check_up_is_deleted_and_restored_with_its_robot(container, robot):
    put(container, robot)
    left = LeftBehind("S1", "guid", ("token",), 17, True)
    container.db.write(lambda c: CHECK_UPS.note_left_behind(c, robot.id, left))
    removed = container.catalogue.remove_robot(robot.id)
    assert CHECK_UPS.report(container.db.read(), robot.id) is None
    container.catalogue.restore(removed)
    assert CHECK_UPS.report(container.db.read(), robot.id) == REPORT
    assert CHECK_UPS.left_behind(container.db.read()) == {robot.id: left}


def test_what_was_left_behind_is_stored_with_it(container, robot):
    left = LeftBehind("S1", tokens=("a", "b"))
    container.db.write(lambda c: CHECK_UPS.note_left_behind(c, robot.id, left))
    put(container, robot)
    assert CHECK_UPS.left_behind(container.db.read()) == {robot.id: left}
    container.db.write(lambda c: CHECK_UPS.note_left_behind(c, robot.id, None))
    assert CHECK_UPS.left_behind(container.db.read()) == {}
    assert CHECK_UPS.report(container.db.read(), robot.id) == REPORT


def test_no_backup_can_be_chosen_while_changes_are_left_on_robots_or_fleets(container, robot, tmp_path):
    fleet = container.catalogue.save_fleet(Fleet("Hall", "10.0.0.50", username="user"), password="secret")
    back_up(container.db.path, tmp_path / "before.db")
    container.files.check_backup(tmp_path / "before.db")
    container.db.write(lambda c: CHECK_UPS.note_left_behind(c, robot.id, LeftBehind("S1")))
    container.db.write(lambda c: CHECK_UPS.note_left_on_fleet(c, fleet.id, LeftBehind("F1")))
    with pytest.raises(InvalidInput, match="the check-up of Hall, R1 is not over"):
        container.files.check_backup(tmp_path / "before.db")
