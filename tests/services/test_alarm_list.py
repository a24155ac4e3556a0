"""The alarms as the operator handles them: acknowledge with a note, shelve and unshelve, the past ones."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.connection import Database
from app.database.robots import RobotRepository
from app.domain.models import Robot
from app.services.catalogue.catalogue import Catalogue
from app.services.live import alarms
from app.services.live.alarms import LONGEST_NOTE, SHELF_HOURS, Alarms
from app.services.live.changes import Changes, Topic
from tests.support.clock import VirtualClock
from tests.support.edits import switch_robot


class Desk:
    def __init__(self, path):
        self.clock = VirtualClock()
        self.changes = Changes()
        self.db = Database.open(path / "a.db", clock=self.clock, durable=False)
        self.alarms = Alarms(self.db, self.clock, self.changes)
        self.published = []
        self.changes.subscribe(lambda topic, _about: self.published.append(topic))

    def only(self):
        [alarm] = self.alarms.open()
        return alarm


@pytest.fixture
def desk(tmp_path):
    desk = Desk(tmp_path)
    yield desk
    desk.db.close()


def test_alarms_carry_the_name_that_the_robot_has_now(desk):
    """Those of a condition, whose key is the robot's, as those of an execution; also when they are past."""
    robots = RobotRepository()
    robot = desk.db.write(lambda c: robots.add(c, Robot("Aino", "http://10.0.0.1")))
    desk.alarms.raise_("unreachable", f"robot:{robot.id}", robot="Aino", problem="no answer")
    desk.alarms.raise_("execution_failed", "schedule:1", robot="Aino", robot_id=robot.id, mission="Deliver", reason="x")
    desk.alarms.raise_("emergency_stop", "robot:99", robot="Sisu")  # of a robot that was removed
    desk.db.write(lambda c: robots.update(c, replace(robot, name="Alma")))
    assert {alarm.code: alarm.details["robot"] for alarm in desk.alarms.open()} == {
        "unreachable": "Alma",
        "execution_failed": "Alma",
        "emergency_stop": "Sisu",
    }
    for alarm in desk.alarms.open():
        desk.alarms.acknowledge(alarm.id)
    [failed], _total = desk.alarms.past(10)
    assert failed.details["robot"] == "Alma"


@pytest.mark.parametrize(
    "leave", [Catalogue.remove_robot, lambda catalogue, robot_id: switch_robot(catalogue, robot_id, False)]
)
def test_what_is_wrong_with_a_robot_ends_when_it_leaves(desk, leave):
    """It is not asked any longer, so nothing else would clear the alarm."""
    catalogue = Catalogue(desk.db, desk.clock, desk.changes)
    robot, other = (catalogue.save_robot(Robot(name, f"http://{name}", username="u"), "p") for name in ("Aino", "Sisu"))
    for number in (robot.id, other.id):
        desk.alarms.raise_("unreachable", f"robot:{number}", robot="R", problem="no answer")
    desk.published.clear()
    desk.clock.advance(60)
    leave(catalogue, robot.id)
    assert Topic.ALARMS in desk.published
    assert {alarm.key: alarm.cleared_at for alarm in desk.alarms.open()} == {
        f"robot:{robot.id}": desk.clock.now(),
        f"robot:{other.id}": None,
    }


def test_a_condition_that_lasts_is_one_line_with_its_newest_details(desk):
    began, alarm = desk.clock.now(), ("unreachable", "robot:1")
    for problem in "ab":
        desk.alarms.raise_(*alarm, problem=problem)
        desk.clock.advance(300)
    found = desk.only()
    assert (found.count, found.raised_at, found.last_at, found.details) == (1, began, began, {"problem": "b"})


def test_a_condition_that_went_and_came_again_is_counted(desk):
    desk.alarms.raise_("unreachable", "robot:1")
    for _ in range(2):
        desk.alarms.clear("unreachable", "robot:1")
    assert len(desk.published) == 2
    assert desk.only().cleared_at is not None
    desk.clock.advance(300)
    desk.alarms.raise_("unreachable", "robot:1")
    assert (desk.only().count, desk.only().last_at, desk.only().cleared_at) == (2, desk.clock.now(), None)


def test_an_event_is_counted_each_time_and_stays_open_until_acknowledged(desk):
    for count in (1, 2):
        desk.alarms.raise_("app_was_off", "app")
        assert desk.only().count == count
    desk.alarms.acknowledge(desk.only().id)
    assert desk.alarms.open() == []
    desk.alarms.raise_("app_was_off", "app")
    assert desk.only().count == 1


def test_acknowledging_keeps_the_time_and_the_note_of_the_first(desk):
    desk.alarms.raise_("unreachable", "robot:1", robot="Aino", problem="no answer")
    alarm_id, at = desk.only().id, desk.clock.now()
    desk.alarms.acknowledge(alarm_id, "  access point\nis off ")
    desk.clock.advance(60)
    desk.alarms.acknowledge(alarm_id)  # a second tap, or a second tablet
    assert (desk.only().acknowledged_at, desk.only().note) == (at, "access point is off")
    desk.alarms.clear("unreachable", "robot:1")
    assert desk.alarms.open() == []
    [past], total = desk.alarms.past(10)
    assert (past.note, total) == ("access point is off", 1)
    assert desk.published == [Topic.ALARMS] * 4


@pytest.mark.parametrize("comes_again", [False, True])
def test_an_acknowledgement_is_undone_unless_the_alarm_has_come_again(desk, comes_again):
    """Then that one counts, and is new."""
    desk.alarms.raise_("app_was_off", "app")
    alarm_id = desk.only().id
    desk.alarms.acknowledge(alarm_id, "seen")
    if comes_again:
        desk.alarms.raise_("app_was_off", "app")
    desk.alarms.unacknowledge(alarm_id)
    assert (desk.only().id == alarm_id, desk.only().acknowledged_at, desk.only().note) == (not comes_again, None, "")
    assert len(desk.alarms.past(9)[0]) == comes_again


def test_a_note_is_as_long_as_a_note(desk):
    desk.alarms.raise_("clock_stepped", "clock", seconds=40)
    desk.alarms.acknowledge(desk.only().id, "x" * 5000)
    [past], _total = desk.alarms.past(1)
    assert len(past.note) == LONGEST_NOTE


@pytest.mark.parametrize("hours", SHELF_HOURS)
def test_shelving_ends_by_itself(desk, hours):
    desk.alarms.raise_("unreachable", "robot:1", robot="Aino")
    desk.alarms.raise_("app_was_off", "app")
    [first, _second] = desk.alarms.open()
    desk.alarms.shelve(first.id, hours)
    assert desk.alarms.open()[-1].shelved_until == desk.clock.now() + timedelta(hours=hours)
    assert [alarm.code for alarm in desk.alarms.open()] == ["app_was_off", "unreachable"]  # shelved ones last
    desk.clock.advance(hours * 3600 + 1)
    assert [alarm.code for alarm in desk.alarms.open()] == ["unreachable", "app_was_off"]


def test_what_comes_and_goes_stays_on_the_shelf_also_when_it_was_acknowledged_between(desk):
    desk.alarms.raise_("unreachable", "robot:1", robot="Aino")
    desk.alarms.shelve(desk.only().id, 4)
    until = desk.only().shelved_until
    desk.alarms.acknowledge(desk.only().id)
    desk.alarms.clear("unreachable", "robot:1")
    desk.clock.advance(600)
    desk.alarms.raise_("unreachable", "robot:1", robot="Aino")
    assert desk.only().shelved_until == until
    desk.alarms.acknowledge(desk.only().id)
    desk.alarms.clear("unreachable", "robot:1")
    desk.clock.advance(4 * 3600)
    desk.alarms.raise_("unreachable", "robot:1", robot="Aino")
    assert desk.only().shelved_until is None
    desk.alarms.raise_("unreachable", "robot:2", robot="Veikko")
    assert all(alarm.shelved_until is None for alarm in desk.alarms.open())


def test_a_withdrawn_start_stays_withdrawn(desk):
    desk.alarms.raise_("unreachable", "robot:1", robot="Aino")
    desk.alarms.shelve(desk.only().id, 24)
    desk.alarms.unshelve(desk.only().id)
    assert desk.only().shelved_until is None
    desk.alarms.acknowledge(desk.only().id)
    desk.alarms.clear("unreachable", "robot:1")
    desk.alarms.raise_("unreachable", "robot:1", robot="Aino")
    assert desk.only().shelved_until is None


def test_the_past_is_limited_and_counted(desk, monkeypatch):
    for number in range(12):
        desk.alarms.raise_("app_was_off", str(number))
        desk.clock.advance(1)
    for alarm in desk.alarms.open():
        desk.alarms.acknowledge(alarm.id)
    newest, total = desk.alarms.past(5)
    assert [alarm.key for alarm in newest] == ["11", "10", "9", "8", "7"]
    assert total == 12
    desk.alarms.raise_("app_was_off", "open")
    monkeypatch.setattr(alarms, "KEPT", 5)
    desk.alarms.prune()
    assert desk.alarms.past(12) == (newest, 5)
    assert desk.only().key == "open"
