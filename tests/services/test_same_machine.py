"""Two robots of the list that are one machine raise an alarm as soon as both have shown their serial number."""

from __future__ import annotations

import pytest

from app.database.robots import RobotRepository
from app.services.live.alarms import alarm_sentence
from app.services.live.changes import Topic
from tests.support.edits import switch_robot
from tests.support.site import Site


@pytest.fixture
def site(tmp_path):
    site = Site(tmp_path, robots=3)
    site.machines["R3"].serial_number = site.machines["R1"].serial_number
    yield site
    site.switch_off()


def alarms(site: Site, after: float = 0.0) -> list[str]:
    site.run(after)
    return [
        alarm_sentence(alarm)
        for alarm in site.container.alarms.open()
        if alarm.code == "same_machine" and alarm.cleared_at is None
    ]


def said(site: Site) -> str:
    return (
        f"R1, R3 have the same serial number, {site.machines['R1'].serial_number}: they are one machine, and starts for both end "
        "up in its one queue"
    )


def test_both_are_named_at_once(site):
    site.add_robots()
    assert alarms(site, after=10) == [said(site)]
    site.run(600)
    assert [alarm.count for alarm in site.container.alarms.open()] == [1]


def test_it_is_over_when_one_is_switched_off_or_removed(site):
    _first, _second, third = site.add_robots()
    site.run(10)
    switch_robot(site.container.catalogue, third.id, False)
    assert alarms(site, after=10) == []
    switch_robot(site.container.catalogue, third.id, True)
    assert alarms(site, after=10) == [said(site)]
    site.container.catalogue.remove_robot(third.id)
    assert alarms(site, after=10) == []


def test_it_stays_one_alarm_over_a_new_start_and_ends_with_its_cause(site):
    third = site.add_robots()[2]
    site.run(10)
    site.switch_off()
    site.switch_on()
    site.run(10)
    assert [alarm.count for alarm in site.container.alarms.open() if alarm.code == "same_machine"] == [1]
    site.switch_off()
    site.switch_on()
    site.container.db.write(lambda c: c.execute("DELETE FROM robots WHERE id = ?", (third.id,)))
    site.container.changes.publish(Topic.ROBOTS)
    assert alarms(site, after=10) == []


def test_the_list_is_read_only_after_a_change(site, monkeypatch):
    site.add_robots()
    site.run(10)
    reads = []
    read = RobotRepository.of_one_machine
    monkeypatch.setattr(RobotRepository, "of_one_machine", lambda self, c: reads.append(1) or read(self, c))
    site.run(60)
    assert not reads
