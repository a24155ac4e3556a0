"""The service of check-ups: what it offers, stores and restores."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.check_up import Level, Topic, Trial
from app.domain.message import render
from app.domain.models import InvalidInput
from app.mir.errors import Unreachable
from app.services.check_up.service import CheckUps
from app.services.live.changes import Topic as Change
from mir_sim import MISSIONS


def test_it_says_what_will_happen(robot):
    assert render(robot.check_ups.moves("Aino", Trial())).startswith(
        "Aino gets a mission that waits a second, four times. One"
    )
    assert render(robot.check_ups.moves("Aino", Trial())).endswith("Nothing drives.")
    assert render(robot.check_ups.moves("Aino", Trial("Home"))).startswith("Home is queued four times on Aino.")
    assert 60 < CheckUps.length_s(None) < CheckUps.length_s(Trial()) < CheckUps.length_s(Trial("Home"))


def test_it_offers_the_missions_that_people_made(robot):
    assert list(robot.check_ups.harmless_missions(robot.id)) == sorted(
        (mission.name for mission in MISSIONS), key=str.casefold
    )


def test_reading_changes_nothing_and_is_stored_and_reported(robot):
    published, progress = [], []
    robot.container.changes.subscribe(lambda topic, _about: published.append(topic))
    report = robot.check_ups.run(robot.id, on_progress=progress.append)
    assert robot.asked.writes == []
    assert robot.check_ups.report(robot.id) == report
    assert Change.ROBOTS in published
    assert {each.of for each in progress} == {CheckUps.length_s(None)}
    known = robot.container.catalogue.robot(robot.id)
    assert (known.software, known.model) == ("3.5.4", "MiR250")
    assert known.known == report.profile


def test_the_progress_of_a_trial_never_goes_back(robot):
    progress = []
    robot.trial(on_progress=progress.append)
    done = [each.done for each in progress]
    assert done == sorted(done)
    assert all(each.done <= each.of == CheckUps.length_s(Trial()) for each in progress)


def test_a_robot_that_is_off_is_a_finding_and_the_report_before_stays(robot):
    before = robot.check_ups.run(robot.id)
    robot.asked.gives(Unreachable(code="refused", address="10.0.0.1"), lambda method, path: True)
    for trial in (None, Trial()):
        report = robot.check_ups.run(robot.id, trial)
        assert [(finding.topic, finding.level) for finding in report.findings] == [(Topic.IDENTITY, Level.RED)]
        assert not report.is_complete
    assert robot.check_ups.report(robot.id) == before


def test_robots_that_can_not_be_asked_are_refused(robot):
    with pytest.raises(InvalidInput, match="this robot has been removed"):
        robot.check_ups.run(robot.id + 1)
    robot.container.catalogue.save_robot(
        replace(robot.container.catalogue.robot(robot.id), address="http://10.0.0.2", enabled=False)
    )
    with pytest.raises(InvalidInput, match="until its password is entered"):
        robot.check_ups.run(robot.id)
    assert robot.asked.requests == []


def test_what_was_left_on_another_machine_is_not_looked_for_on_this_one(robot):
    robot.leave(mission="guid", is_paused=True)
    robot.container.db.write(lambda c: c.execute("UPDATE robots SET serial_number = 'another'"))
    robot.machine.pause()
    assert robot.check_ups.put_back(robot.id) is None
    assert (robot.asked.requests, robot.check_ups.left_behind()) == ([], [])


def test_a_robot_is_asked_as_it_is_and_not_as_it_was_found_before(robot):
    asked, make = [], robot.asked.client
    robot.check_ups._make_client = lambda row: asked.append(row.profile) or make(row)
    robot.check_ups.run(robot.id)
    robot.check_ups.run(robot.id)
    assert robot.container.catalogue.robot(robot.id).known is not None
    assert asked == [None, None]
