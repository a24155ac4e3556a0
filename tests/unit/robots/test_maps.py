"""Maps are asked for once in a while, stored next to the database, and never delay anything, for any answer of a
robot."""

from __future__ import annotations

import logging
import os
import tracemalloc
from pathlib import Path

import pytest

from app.domain.models import Robot
from app.domain.robot import MapPosition, RobotMap
from app.mir.errors import RobotError, TimedOut, Unreachable, Unreadable
from app.services.robots import maps as robot_maps
from app.services.robots.maps import ASK_EVERY, REFRESH_AFTER, RobotMaps
from tests.support.clock import VirtualClock
from tests.support.modes import is_private
from tests.unit.robots.test_map_picture import floor, hall

AINO = Robot("Aino", "http://10.0.0.1", id=1, serial_number="201900042")


class FakeClient:
    """A robot with these maps; exceptions among them are raised."""

    def __init__(self, maps: dict[str, RobotMap | RobotError], positions: RobotError | None = None) -> None:
        self.maps, self._positions = maps, positions
        self.asked: list[str] = []
        self.closed = 0

    def map(self, map_id: str) -> RobotMap:
        self.asked.append(map_id)
        found = self.maps[map_id]
        if isinstance(found, RobotError):
            raise found.with_traceback(None)  # it may be raised again
        return found

    def positions(self, _map_id: str) -> list[MapPosition]:
        if self._positions is not None:
            raise self._positions
        return []

    def close(self) -> None:
        self.closed += 1


class Site:
    def __init__(self, directory: Path, maps: dict[str, RobotMap | RobotError] | None = None) -> None:
        self.clock, self.directory = VirtualClock(), directory / "maps"
        self.client = FakeClient(maps if maps is not None else {"m": floor(hall())})
        self.robots = {1: AINO}
        self.maps = self.restarted()

    def restarted(self) -> RobotMaps:
        return RobotMaps(self.directory, self.robots.get, lambda _robot: self.client, self.clock)  # type: ignore[arg-type, return-value]


@pytest.fixture
def site(tmp_path: Path) -> Site:
    return Site(tmp_path)


def test_a_map_is_asked_for_once_and_again_after_an_hour(site: Site) -> None:
    assert site.maps.is_due(1, "m")
    picture = site.maps.learn(1, "m")
    assert picture is not None
    assert site.maps.known(1, "m") is picture
    assert not site.maps.is_due(1, "m")
    site.clock.advance(REFRESH_AFTER)
    assert site.maps.is_due(1, "m")
    assert site.client.closed == 1


def test_after_a_restart_the_stored_map_is_shown_at_once_and_refreshed_a_minute_later(site: Site) -> None:
    before = site.maps.learn(1, "m")
    maps = site.restarted()
    assert maps.known(1, "m") is None
    assert maps.learn(1, "m").shade == before.shade
    assert site.client.asked == ["m"]
    assert not maps.is_due(1, "m")
    site.clock.advance(ASK_EVERY)
    assert maps.is_due(1, "m")
    maps.learn(1, "m")
    assert site.client.asked == ["m", "m"]
    assert not maps.is_due(1, "m")


def test_files_are_private_and_written_whole(site: Site) -> None:
    site.maps.learn(1, "m")
    (file,) = site.directory.iterdir()
    assert file.suffix == ".json"
    assert is_private(file, site.directory)


def test_another_machine_behind_the_same_name_does_not_get_this_map(site: Site) -> None:
    site.maps.learn(1, "m")
    site.robots[1] = Robot("Aino", AINO.address, id=1, serial_number="201900043")
    site.client.maps = {"m": Unreachable(code="unreachable", address="10.0.0.1")}
    assert site.restarted().learn(1, "m") is None


@pytest.mark.parametrize("problem", [Unreachable(code="unreachable", address="a"), TimedOut(address="a", seconds="5")])
def test_a_silent_robot_is_asked_again_after_a_minute_and_its_map_stays(site: Site, problem: RobotError) -> None:
    picture = site.maps.learn(1, "m")
    site.clock.advance(REFRESH_AFTER)
    site.client.maps = {"m": problem}
    assert site.maps.learn(1, "m") is picture
    assert not site.maps.is_due(1, "m")
    site.clock.advance(ASK_EVERY)
    assert site.maps.is_due(1, "m")
    assert site.client.closed == 2


def test_garbage_is_reported_in_one_line_of_the_log_and_not_asked_for_every_second(
    site: Site, caplog: pytest.LogCaptureFixture
) -> None:
    site.client.maps = {"m": RobotMap("m", "Hall", b"\x89PNG\r\n\x1a\n" + bytes(64))}
    with caplog.at_level(logging.WARNING):
        for _n in range(3):
            assert site.maps.learn(1, "m") is None
            assert not site.maps.is_due(1, "m")
            site.clock.advance(REFRESH_AFTER)
    assert len(caplog.records) == 1
    assert "Aino" in caplog.text
    assert not site.directory.exists()


def shown_for(site: Site, seconds: int) -> None:
    """Somebody looks at the map of a robot that is on another one each second."""
    for n in range(seconds):
        if site.maps.is_due(1, str(n)):
            site.maps.learn(1, str(n))
        site.clock.advance(1.0)


def test_a_robot_with_another_map_each_time_is_asked_once_a_minute_and_reported_once(
    site: Site, caplog: pytest.LogCaptureFixture
) -> None:
    garbage = Unreadable(address="a", problem="the map has no PNG picture")
    site.client.maps = dict.fromkeys(map(str, range(36_000)), garbage)
    shown_for(site, 600)
    assert len(site.client.asked) == 10
    assert len(caplog.records) == 1
    assert site.maps.is_due(2, "m")  # other robots' turn is not over
    tracemalloc.start()
    shown_for(site, 36_000)
    grown = tracemalloc.take_snapshot().filter_traces([tracemalloc.Filter(True, robot_maps.__file__)])
    tracemalloc.stop()
    assert len(site.client.asked) == 610
    assert len(caplog.records) == 1
    assert sum(trace.size for trace in grown.traces) < 64 * 1024  # bytes


def test_after_a_good_map_the_next_bad_one_is_reported_again(site: Site, caplog: pytest.LogCaptureFixture) -> None:
    good = site.client.maps["m"]
    for answer in (garbage := Unreadable(address="a", problem="no picture"), garbage, good, garbage):
        site.client.maps = {"m": answer}
        site.maps.learn(1, "m")
    assert len(caplog.records) == 2


def test_a_map_that_came_before_the_serial_number_is_found_after_it(site: Site) -> None:
    site.robots[1] = Robot("Aino", AINO.address, id=1)
    site.maps.learn(1, "m")
    site.robots[1] = AINO
    site.client.maps["m"] = Unreachable(address="10.0.0.1")
    assert site.restarted().learn(1, "m") is not None


def test_a_map_without_names_is_a_map(tmp_path: Path) -> None:
    site = Site(tmp_path)
    site.client = FakeClient(site.client.maps, positions=TimedOut(address="a", seconds="5"))
    assert site.maps.learn(1, "m").places == ()


def test_a_robot_that_has_been_removed_has_no_map(site: Site) -> None:
    site.robots.clear()
    assert site.maps.learn(1, "m") is None
    assert site.client.asked == []


def test_a_damaged_file_is_as_good_as_none(site: Site) -> None:
    site.maps.learn(1, "m")
    (file,) = site.directory.iterdir()
    file.write_bytes(b"{" + os.urandom(50))
    assert site.restarted().learn(1, "m") is not None
    assert site.client.asked == ["m", "m"]


def test_a_disk_without_room_only_means_that_nothing_is_kept(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_args: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    assert site.maps.learn(1, "m") is not None
    assert list(site.directory.iterdir()) == []


def test_memory_and_disk_keep_a_bounded_number(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robot_maps, "MOST_FILES", 5)
    one = floor(hall())
    site = Site(tmp_path, {str(n): one for n in range(12)})
    for n in range(12):
        site.maps.learn(1, str(n))
    assert len(list(site.directory.iterdir())) == 5
    assert [n for n in range(12) if site.maps.known(1, str(n))] == list(range(12 - robot_maps.MOST_IN_MEMORY, 12))
