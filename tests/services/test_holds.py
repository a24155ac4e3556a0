"""Holds of all robots or of one: which starts they stop, until when, and after a restart."""

from __future__ import annotations

import sqlite3
import threading
from datetime import UTC, datetime, timedelta
from unittest.mock import Mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.database.connection import Database
from app.database.robots import Hold, HoldRepository
from app.domain.models import Robot
from app.services.live.changes import Changes, Topic
from app.services.live.holds import LONGEST_REASON, Holds
from tests.support.clock import VirtualClock
from tests.support.errors import refuses

NOW = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)
HOUR = timedelta(hours=1)


@pytest.fixture
def clock():
    return VirtualClock(NOW)


@pytest.fixture
def container(container):
    for name in ("Aino", "Veikko"):
        container.catalogue.save_robot(Robot(name, f"http://{name.lower()}", "user"), "secret")
    return container


def test_a_removed_robot_can_not_be_held(container):
    robot = container.catalogue.robots()[0]
    container.catalogue.remove_robot(robot.id)
    with refuses("robot"):
        container.holds.hold("a meeting", robot_id=robot.id)
    assert container.holds.all_active() == []


def test_the_hold_of_a_removed_robot_goes_and_comes_back_with_it(container):
    hold = container.holds.hold("a meeting", robot_id=1)
    removed = container.catalogue.remove_robot(1)
    assert container.holds.current() == []
    container.catalogue.restore(removed)
    assert container.holds.current() == [hold]


def test_a_hold_of_all_holds_each_and_says_since_when_and_why(container):
    published = []
    container.changes.subscribe(lambda topic, _about: published.append(topic))
    hold = container.holds.hold("  Fire\n drill ", NOW + HOUR)
    assert (hold.reason, hold.since, hold.until, hold.robot_id) == ("Fire drill", NOW, NOW + HOUR, None)
    assert container.holds.active() == container.holds.active(1) == container.holds.current()[0] == hold
    assert published == [Topic.HOLDS]


def test_it_ends_by_itself_and_the_shorter_one_uncovers_the_longer(container, clock):
    container.holds.hold("All", NOW + HOUR)
    container.holds.hold("One", NOW + 2 * HOUR, robot_id=1)
    assert [hold.reason for hold in container.holds.current()] == ["All", "One"]
    clock.step(3600)
    assert (container.holds.active(1).reason, container.holds.active(2)) == ("One", None)
    clock.step(3600)
    assert (container.holds.active(1), container.holds.current()) == (None, [])


def test_a_new_hold_takes_the_place_of_the_old_one_and_release_ends_it(container):
    container.holds.hold("Audit", NOW + HOUR)
    container.holds.hold("Maintenance")
    assert [hold.reason for hold in container.holds.current()] == ["Maintenance"]
    container.holds.hold("One", robot_id=1)
    container.holds.release()
    assert [hold.reason for hold in container.holds.current()] == ["One"]
    container.holds.release(1)
    assert container.holds.current() == []


@pytest.mark.parametrize(
    ("reason", "until", "field"),
    [("", NOW, "until"), ("", NOW - HOUR, "until"), ("x" * (LONGEST_REASON + 1), None, "reason")],
)
def test_what_a_hold_cannot_be_is_reported_at_its_field_and_nothing_changes(container, reason, until, field):
    container.holds.hold("Audit")
    with refuses(field):
        container.holds.hold(reason, until)
    assert [hold.reason for hold in container.holds.current()] == ["Audit"]


@given(st.none() | st.integers(1, 3), st.none() | st.integers(1, 3), st.integers(-5, 5), st.none() | st.integers(1, 5))
def test_a_hold_covers_its_robots_from_its_start_to_its_end(held, robot, hours, until):
    hold = Hold("", NOW + until * HOUR if until else None, NOW, robot_id=held)
    covered = (held is None or held == robot) and hours >= 0 and (until is None or hours < until)
    assert hold.covers(robot, NOW + hours * HOUR) is covered


def test_a_hold_is_kept_though_somebody_who_asked_earlier_reads_on_after_it(tmp_path, clock, monkeypatch):
    """What is read is remembered: what was read before the hold must not be."""
    db, everything = Database.open(tmp_path / "a.db", durable=False), HoldRepository.all
    holds = Holds(db, clock, Changes())
    has_read, may_go_on = threading.Event(), threading.Event()

    def slowly(repository, c):
        found = everything(repository, c)
        if threading.current_thread() is asking:
            has_read.set()
            may_go_on.wait(30)
        return found

    monkeypatch.setattr(HoldRepository, "all", slowly)
    asking = threading.Thread(target=holds.current)
    asking.start()
    assert has_read.wait(30)
    holds.hold("stop everything")
    may_go_on.set()
    asking.join(30)
    assert [hold.reason for hold in holds.current()] == ["stop everything"]
    db.close()


def test_a_hold_comes_back_with_its_robot_though_it_could_not_be_read_at_once(container, monkeypatch):
    robot = container.catalogue.robots()[0]
    container.holds.hold("Audit", robot_id=robot.id)
    removed = container.catalogue.remove_robot(robot.id)
    assert not container.holds.current()
    container.catalogue.restore(removed)
    with monkeypatch.context() as broken:
        broken.setattr(HoldRepository, "all", Mock(side_effect=sqlite3.OperationalError("disk I/O error")))
        with pytest.raises(sqlite3.OperationalError):
            container.holds.current()
    assert [hold.reason for hold in container.holds.current()] == ["Audit"]
