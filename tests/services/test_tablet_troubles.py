"""The tablet's own troubles: each alarm comes, goes and does not flap; without a network there is one alarm, not one per robot."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from app.services.live.tablet_troubles import BATTERY_LOW, MB, Battery, Readings, Room, TabletTroubles
from tests.support.site import Site

FULL_BATTERY, MUCH_ROOM = Battery(90, False), Room(10_000 * MB, 20 * MB)
NOTHING = Readings(lambda: None, lambda: None, lambda: None, lambda: None)


class Tablet:
    """What it reads of itself, set by tests, and the alarms about it."""

    def __init__(self, site: Site) -> None:
        self.site, self.battery, self.room = site, FULL_BATTERY, MUCH_ROOM
        self.is_synchronised, self.has_network = True, True
        self.watch(
            Readings(
                lambda: self.room, lambda: self.is_synchronised, lambda: self.battery, lambda: self.has_network is True
            )
        )

    def watch(self, readings: Readings) -> None:
        """As after a start of the app."""
        c = self.site.container
        self.troubles = TabletTroubles(
            readings,
            clock=c.clock,
            alarms=c.alarms,
            snapshots=c.snapshots,
            tablet=c.tablet,
            robots=lambda: [robot.id for robot in c.catalogue.robots()],
        )

    def run(self, seconds: int, step: int = 1) -> None:
        for _second in range(0, seconds, step):
            self.troubles.tick()
            self.site.run(step)

    def alarms(self, after: int = 0, step: int = 1) -> list[tuple[str, int]]:
        """Codes of those that last, with how often each has come, when so many seconds have passed."""
        self.run(after, step)
        return [(alarm.code, alarm.count) for alarm in self.site.container.alarms.open() if alarm.cleared_at is None]


@contextmanager
def switched_on(directory: Path, robots: int) -> Iterator[Tablet]:
    site = Site(directory, robots=robots)
    site.add_robots()
    tablet = Tablet(site)
    assert tablet.alarms(after=40) == []
    yield tablet
    site.switch_off()


@pytest.fixture
def tablet(tmp_path) -> Iterator[Tablet]:
    """With three robots."""
    with switched_on(tmp_path, 3) as tablet:
        yield tablet


@pytest.fixture
def alone(tmp_path) -> Iterator[Tablet]:
    """Without robots."""
    with switched_on(tmp_path, 0) as tablet:
        yield tablet


# ---------------------------------------------------------------------- disk, clock, battery
LOW = replace(FULL_BATTERY, percent=BATTERY_LOW)
TROUBLES = [  # code, what is read, what begins it, what does not end it yet, what ends it
    ("tablet_battery_low", "battery", LOW, Battery(20, False), Battery(15, True)),
    ("tablet_battery_low", "battery", LOW, Battery(16, False), Battery(21, False)),
    ("disk_nearly_full", "room", Room(350 * MB, 20 * MB), Room(440 * MB, 20 * MB), Room(460 * MB, 20 * MB)),
    ("disk_nearly_full", "room", Room(3_000 * MB, 1_000 * MB), Room(4_000 * MB, 1_000 * MB), MUCH_ROOM),
    ("clock_not_synchronised", "is_synchronised", False, False, True),
]


@pytest.mark.parametrize(("code", "name", "trouble", "between", "good"), TROUBLES)
def test_an_alarm_comes_stays_while_it_is_not_clearly_over_and_goes(alone, code, name, trouble, between, good):
    setattr(alone, name, trouble)
    assert alone.alarms(after=1000, step=20) == [(code, 1)]
    setattr(alone, name, between)
    assert alone.alarms(after=200, step=20) == [(code, 1)]
    setattr(alone, name, good)
    assert alone.alarms(after=100, step=20) == []


@pytest.mark.parametrize(("name", "trouble", "good"), [(name, trouble, good) for _, name, trouble, _, good in TROUBLES])
def test_a_moment_of_it_is_no_alarm(alone, name, trouble, good):
    for _time in range(3):
        setattr(alone, name, trouble)
        alone.run(5, step=5)
        setattr(alone, name, good)
        alone.run(20, step=10)
    assert alone.site.container.alarms.open() == []


def test_a_loose_charging_plug_is_one_alarm(alone):
    alone.battery = LOW
    alone.run(60)
    for _time in range(10):
        alone.battery = replace(LOW, is_charging=True)
        alone.run(10, step=10)
        alone.battery = LOW
        alone.run(10, step=10)
    assert alone.alarms() == [("tablet_battery_low", 1)]


def test_a_charging_battery_is_no_alarm(alone):
    alone.battery = Battery(3, True)
    assert alone.alarms(after=300, step=20) == []


def test_an_alarm_of_an_earlier_run_ends_when_its_cause_is_over_or_can_not_be_known(alone):
    alone.battery, alone.room, alone.is_synchronised = LOW, Room(0, 0), False
    alone.run(1000, step=20)
    assert len(alone.alarms()) == 3
    alone.watch(NOTHING)
    assert alone.alarms(after=100, step=20) == []


# ---------------------------------------------------------------------- the network
def lose_network(tablet: Tablet) -> None:
    tablet.has_network, tablet.site.network.down = False, {"R1", "R2", "R3"}


def test_without_a_network_there_is_one_alarm_and_it_ends_with_the_outage(tablet):
    lose_network(tablet)
    assert tablet.alarms(after=150) == [("network_lost", 1)]
    tablet.has_network = True
    tablet.site.network.down.clear()
    assert tablet.alarms(after=100) == []


def test_the_robot_on_screen_which_is_asked_more_often_has_no_alarm_of_its_own(tablet):
    tablet.site.container.engine.watch(1)
    tablet.run(10)
    lose_network(tablet)
    assert tablet.alarms(after=120) == [("network_lost", 1)]


def test_a_robot_that_is_still_silent_when_the_network_is_back_gets_its_own_alarm(tablet):
    lose_network(tablet)
    tablet.run(120)
    tablet.has_network = True
    tablet.site.network.down = {"R2"}
    assert tablet.alarms(after=240) == [("unreachable", 1)]


def test_robots_that_are_silent_in_a_network_that_works_get_their_own_alarms(tablet):
    tablet.site.network.down = {"R1", "R2", "R3"}
    assert tablet.alarms(after=240) == [("unreachable", 1)] * 3


def test_while_one_robot_answers_the_others_get_their_own_alarms(tablet):
    """The robots of the demo are on the tablet itself."""
    lose_network(tablet)
    tablet.site.network.down = {"R2"}
    assert tablet.alarms(after=240) == [("unreachable", 1)]


def test_a_network_that_comes_and_goes_is_one_alarm(tablet):
    lose_network(tablet)
    tablet.run(120)
    for _time in range(4):
        tablet.has_network = True
        tablet.run(5)
        tablet.has_network = False
        tablet.run(20)
    assert tablet.alarms() == [("network_lost", 1)]
