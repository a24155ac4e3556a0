"""The power is cut in the middle of a trial, and comes back when starts are due: the robot is put back before anything is sent to it."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pytest

from app.database.backups import back_up, restore
from app.database.errors import DatabaseRefused, DatabaseUnavailable
from app.database.settings import SettingsRepository
from app.domain.check_up import Level, Topic, Trial
from app.domain.execution import State, Wait
from app.domain.message import render
from app.domain.models import InvalidInput
from app.services.catalogue.database_check import find_problem
from tests.support.check_up_site import CheckedRobot, Killed, check_ups_of
from tests.support.findings import says
from tests.support.site import GUIDS, Site

LEFT = "check_up_left"
OTHERS = "it is paused, with missions of others in its queue: press Resume there or in the app"


@pytest.fixture
def robot(site):
    site.run(10)
    return site.container.catalogue.robots()[0]


@pytest.fixture
def machine(site):
    return site.machines["R1"]


def alarms(site: Site) -> list[str]:
    return [alarm.code for alarm in site.container.alarms.open() if alarm.cleared_at is None]


def cut_in_pause(site: Site, robot, off_for: float) -> None:
    """The robot stands in Pause, with two missions of the trial in its queue."""

    def cut(where: str) -> None:
        if len(site.network.submissions) == 2:
            raise Killed

    site.network.interrupt = cut
    with pytest.raises(Killed):
        check_ups_of(site).run(robot.id, Trial())
    site.network.interrupt = lambda where: None
    assert site.machines["R1"].paused
    site.power_cut(off_for)


@pytest.fixture
def due(site, plan, robot) -> None:
    """The power comes back some seconds before a start."""
    plan("2026-11-23T06:30")
    cut_in_pause(site, robot, 1795 - site.seconds())


def check_is_restored(site: Site, robot) -> None:
    assert check_ups_of(site).put_back(robot.id) is None
    assert (site.machines["R1"].paused, site.container.holds.current(), LEFT in alarms(site)) == (False, [], False)


def queue_by_another(site: Site, robot) -> None:
    site.container.make_client(robot).enqueue(GUIDS["Home"], description="of another")


def of_the_plan(site: Site) -> list[str]:
    """Of the submissions, those that are starts of the plan."""
    tokens = {row.token for row in site.executions()}
    return [one.token for one in site.network.submissions if one.token in tokens]


# ---------------------------------------------------------------------- the plan waits
def test_a_start_that_is_due_waits_until_the_robot_is_restored(due, site, robot):
    site.run(60)
    [row] = site.executions()
    assert (row.state, row.wait) == (State.WAITING, Wait.HOLD)
    assert not of_the_plan(site)
    check_is_restored(site, robot)
    site.run_until(lambda: site.executions(State.COMPLETED), within=600)
    assert len(of_the_plan(site)) == 1


def test_a_silent_robot_is_held_until_it_answers_and_an_alarm_says_so(due, site, robot):
    site.network.down.add("R1")
    check_ups_of(site).put_back_all([robot.id])
    assert LEFT in alarms(site)
    site.run(120)
    site.network.down.clear()
    site.run(60)
    assert not of_the_plan(site)
    check_ups_of(site).put_back_all([robot.id])
    assert LEFT not in alarms(site)
    site.run_until(lambda: site.executions(State.COMPLETED), within=600)


def test_a_person_releases_it(due, site, robot, machine):
    site.container.holds.release(robot.id)
    machine.resume()
    site.run_until(lambda: site.executions(State.COMPLETED), within=600)


def test_what_could_not_be_undone_at_the_end_holds_the_plan(site, robot, machine):
    def fail(where: str) -> None:
        if len(site.network.submissions) == 2:
            site.network.down.add("R1")

    site.network.interrupt = fail
    assert says(check_ups_of(site).run(robot.id, Trial()), Topic.LEFT)[0] is Level.RED
    assert LEFT in alarms(site)
    [hold] = site.container.holds.current()
    assert (hold.robot_id, hold.until) == (robot.id, None)
    site.network.interrupt = lambda where: None
    site.network.down.clear()
    check_is_restored(site, robot)


# ---------------------------------------------------------------------- missions of others in the queue
@pytest.mark.parametrize(("off_for", "is_released"), [(60, True), (8 * 60, True), (11 * 60, False), (12 * 3600, False)])
def test_a_pause_of_minutes_is_the_trials_and_a_longer_one_may_be_a_persons(site, robot, machine, off_for, is_released):
    """With an empty queue nothing moves when it is released; with missions of others it drives off."""
    cut_in_pause(site, robot, off_for)
    queue_by_another(site, robot)
    if not is_released:
        assert render(check_ups_of(site).put_back(robot.id)) == OTHERS
        assert (machine.paused, len(site.container.holds.current()), LEFT in alarms(site)) == (True, 1, True)
        machine.resume()  # by a person
    check_is_restored(site, robot)
    machine.catch_up()
    assert [str(item.state) for item in machine.queue].count("Aborted") == 2


def test_long_after_it_a_robot_with_nothing_in_its_queue_is_released(site, robot, machine):
    cut_in_pause(site, robot, 12 * 3600)
    check_is_restored(site, robot)


def test_a_hold_that_was_released_says_that_a_person_has_the_robot(site, robot, machine):
    cut_in_pause(site, robot, 60)
    site.container.holds.release(robot.id)
    queue_by_another(site, robot)
    assert render(check_ups_of(site).put_back(robot.id)) == OTHERS
    assert machine.paused


# ---------------------------------------------------------------------- hold and note are one
def count_writes(robot: CheckedRobot, at: Callable[[int], None]) -> None:
    """``at`` is called after each transaction, with its number."""
    numbers, write = itertools.count(1), robot.container.db.write

    def counted(work, patient=False):
        result = write(work, patient)
        at(next(numbers))
        return result

    robot.container.db.write = counted


def writes_of(directory) -> int:
    robot, done = CheckedRobot(directory), list[int]()
    count_writes(robot, done.append)
    robot.trial()
    return len(done)


def test_whenever_the_power_is_cut_after_a_transaction_the_robot_is_restored(tmp_path):
    for number in range(1, writes_of(tmp_path / "whole") + 1):
        robot = CheckedRobot(tmp_path / str(number))

        def cut(done, robot=robot, number=number):
            if done == number:
                robot.kill_at(0, is_handled=False)
                raise Killed

        count_writes(robot, cut)
        with pytest.raises(Killed):
            robot.trial()
        robot.start_again()
        assert [hold.robot_id for hold in robot.container.holds.current()] == robot.check_ups.left_behind(), number
        robot.clean_up()
        robot.check_is_restored(number)
        robot.container.db.close()


def test_a_robot_removed_during_it_is_not_tried(tmp_path):
    robot = CheckedRobot(tmp_path)
    hold = robot.container.holds.hold

    def remove_first(*args, **values):
        robot.container.db.write(lambda c: c.execute("UPDATE robots SET serial_number = 'of another'"))
        return hold(*args, **values)

    robot.container.holds.hold = remove_first
    with pytest.raises(InvalidInput, match="removed"):
        robot.trial()
    assert (robot.asked.writes, robot.container.holds.current()) == ([], [])


def test_a_disk_that_is_full_at_the_end_holds_the_plan_until_it_is_noted(tmp_path):
    robot = CheckedRobot(tmp_path)
    release = robot.container.holds.release

    def full(*args, **values):
        raise DatabaseUnavailable("full", path=tmp_path)

    robot.container.holds.release = full
    with pytest.raises(DatabaseUnavailable):
        robot.trial()
    assert robot.as_it_is() == robot.before
    assert robot.container.holds.current()
    robot.container.holds.release = release
    robot.clean_up()
    robot.check_is_restored()


def test_no_backup_is_restored_before_the_robot_is(site, robot):
    backup = site.directory / "before.db"
    back_up(site.container.db.path, backup)
    cut_in_pause(site, robot, 60)
    site.switch_off()
    with pytest.raises(DatabaseRefused, match="the check-up of R1 is not over"):
        restore(backup, site.container.db.path, site.clock.now())
    site.switch_on()
    check_is_restored(site, robot)
    site.switch_off()
    restore(backup, site.container.db.path, site.clock.now())
    site.switch_on()


def test_a_backup_is_restored_where_the_app_can_not_start_to_undo_anything(site, robot):
    backup = site.directory / "before.db"
    back_up(site.container.db.path, backup)
    cut_in_pause(site, robot, 60)
    site.container.db.write(lambda c: SettingsRepository().put(c, "poll_interval_seconds", -5))
    site.switch_off()
    restore(backup, site.container.db.path, site.clock.now(), find_problem)
    site.switch_on()


def test_a_robot_removed_in_the_middle_and_restored_is_released_in_the_end(site, robot, machine):
    cut_in_pause(site, robot, 60)
    site.container.catalogue.restore(site.container.catalogue.remove_robot(robot.id))
    assert site.container.holds.current()
    check_is_restored(site, robot)
