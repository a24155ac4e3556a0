"""Alarms of a robot that is switched off, on and removed: a robot that is not asked has none, and gets its own again
when it is asked."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest

from app.domain.models import Connection
from app.mir.errors import CertificateMismatch
from app.screens.common.alarms_view import alarm_note
from app.services.live.alarms import alarm_sentence
from tests.support.edits import switch_robot
from tests.support.network import Fate
from tests.support.seen import robot_of
from tests.support.site import PASSWORD, Site


def active(site, after=0.0):
    site.run(after)
    return [alarm.code for alarm in site.container.alarms.open() if alarm.cleared_at is None]


@pytest.fixture
def robot(site):
    return robot_of(site)


def test_a_robot_that_is_still_unreachable_when_it_is_switched_on_again_has_its_alarm_again(site, robot):
    site.network.down.add("R1")
    assert active(site, after=120) == ["unreachable"]
    switch_robot(site.container.catalogue, robot.id, False)
    assert active(site, after=120) == []
    switch_robot(site.container.catalogue, robot.id, True)
    assert active(site, after=120) == ["unreachable"]


@pytest.mark.long
def test_a_robot_whose_queue_can_not_be_read_is_one_thing_and_not_now_this_now_that(site, robot):
    """It always shows its status, and is on screen."""
    site.container.engine.watch(robot.id)
    site.run(60)
    seen = []
    site.container.changes.subscribe(
        lambda _topic, _about: seen.append(site.container.snapshots.get(robot.id).connection)
    )
    site.network.next("GET", "/mission_queue", Fate.ERROR_BEFORE, count=10_000)
    site.network.next("POST", "/mission_queue/search", Fate.ERROR_BEFORE, count=10_000)
    site.run(300)
    assert [key for key, _same in itertools.groupby(seen)] == [Connection.CONNECTED, Connection.UNREACHABLE]
    assert active(site) == ["unreachable"]
    assert site.container.snapshots.get(robot.id).status is not None
    site.network.planned.clear()
    site.run(120)
    assert site.container.snapshots.get(robot.id).connection is Connection.CONNECTED
    assert active(site) == []


@pytest.mark.parametrize("leave", ["removed", "switched off"])
def test_an_answer_that_comes_after_the_robot_was_given_up_raises_no_alarm(site, robot, leave):
    """Nothing would ever end it."""

    def before_the_answer(_robot, _planned) -> None:
        if (
            site.container.snapshots.get(robot.id).problem and not given_up
        ):  # the second failure, which raises the alarm
            given_up.append(leave)
            if leave == "removed":
                site.container.catalogue.remove_robot(robot.id)
            else:
                switch_robot(site.container.catalogue, robot.id, False)

    given_up: list[str] = []
    site.run(20)
    site.network.met = before_the_answer
    site.network.down.add("R1")
    site.run(300)
    assert given_up == [leave]
    assert active(site) == []


def test_a_robot_that_answers_with_another_certificate_is_silent_no_longer(site):
    def refuse(_where) -> None:
        raise CertificateMismatch(address="R1")

    site.network.down.add("R1")
    assert active(site, after=120) == ["unreachable"]
    site.network.down.clear()
    site.network.interrupt = refuse
    assert active(site, after=60) == ["certificate_changed"]


def test_robots_that_have_changed_places_are_named(tmp_path):
    site = Site(tmp_path, robots=2)
    site.add_robots()
    site.run(60)
    first, second = site.machines.values()
    first.serial_number, second.serial_number = second.serial_number, first.serial_number
    site.run(60)
    alarms = {alarm.details["robot"]: alarm for alarm in site.container.alarms.open()}
    assert alarm_sentence(alarms["R1"]) == (
        f"Another robot answers at the address of R1: serial number {first.serial_number} (R2) instead of {second.serial_number}, "
        "nothing is sent"
    )
    assert alarm_note(alarms["R2"], site.container.settings(), site.clock.now()).endswith("correct the addresses")
    site.switch_off()


def test_an_alarm_about_another_robot_ends_when_that_is_accepted(site):
    site.container.catalogue.change_settings(poll_interval_seconds=1800)
    site.run(10)
    site.machines["R1"].serial_number = "777"
    assert active(site, after=7200) == ["wrong_robot"]
    site.container.catalogue.save_robot(replace(robot_of(site), serial_number="777"), PASSWORD)
    assert active(site, after=5) == []
