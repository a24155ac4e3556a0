"""Idle automation starts what its robot's idle period, as it was really seen, still allows at that moment (D14)."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.domain.models import Place, ReasonCode, Schedule, State, Trigger, Wait
from mir_sim.mission_queue import MissionQueue
from tests.support.network import Fate
from tests.support.seen import robot_of, sent_at, states
from tests.support.site import Site


@pytest.fixture
def resting(site):
    """R1 goes home after 5 minutes of rest; read every two minutes."""
    home = site.add_mission("Home")
    site.container.catalogue.change_settings(poll_interval_seconds=120)
    site.container.catalogue.save_idle_rule(robot_of(site).id, home.id, after_minutes=5)
    return site


def stranger_works(site, seconds):
    site.at(seconds, lambda: site.stranger_queues("Deliver"))


@pytest.mark.parametrize("fate", [Fate.LOST, Fate.ERROR_BEFORE])
def test_an_idle_start_whose_outcome_is_unknown_is_not_tried_again_once_somebody_works(resting, fate):
    """In the quiet time a person gives the robot something to do: its rest is over, and so is the idle start."""
    site = resting
    site.network.next("POST", "/mission_queue", fate)
    site.run_until(lambda: bool(sent_at(site)), within=900)
    [first] = sent_at(site)
    stranger_works(site, 60)
    site.run(180)
    assert sent_at(site) == [first]
    assert [row.state.is_open for row in site.executions()] == [False]


def test_an_item_that_cannot_be_read_does_not_make_the_queue_seem_to_begin_anew(resting):
    """The list of such a robot ends with its oldest items, so what is newer is tried one by one."""
    site = resting
    site.network.short_lists = 1
    site.stranger_queues("Deliver")
    site.run(120)
    site.run_until(lambda: states(site) == ["Done", "Done"], within=1800)
    [number] = [item.id for item in site.machines["R1"].queue if item.description]
    site.network.unreadable.add(("R1", number))
    site.run(2400)
    assert len(sent_at(site)) == 1


def test_a_queue_that_really_begins_anew_ends_the_rest(resting):
    site = resting
    for _ in range(3):
        site.stranger_queues("Deliver")
    site.run_until(lambda: len(sent_at(site)) == 1, within=2400)
    site.run(300)
    site.machines["R1"].queue = MissionQueue()
    site.run(900)
    assert len(sent_at(site)) == 2


def test_a_robot_that_is_deleted_and_put_back_is_not_sent_home_again(resting):
    """Undo gives back what is known of its rest, and which item it took last."""
    site = resting
    site.run_until(lambda: states(site) == ["Done"], within=900)
    catalogue, robots = site.container.catalogue, site.container.repositories.robots
    robot, accepted = robot_of(site), robots.last_accepted(site.container.db.read(), robot_of(site).id)
    removed = catalogue.remove_robot(robot.id)
    site.run(20)
    catalogue.restore(removed)
    site.run(1800)
    assert len(sent_at(site)) == 1
    assert robots.last_accepted(site.container.db.read(), robot.id) == accepted is not None


@pytest.mark.parametrize(
    ("is_seen", "copy", "away"), [(True, "Aborted", 0), (False, "Done", 400), (False, "Done", 1500)]
)
def test_a_late_copy_of_the_idle_mission_ends_no_rest(resting, is_seen, copy, away):
    """Its request landed after the quiet time: cancelled or not, nobody has used the robot, also when nobody looks for it any more."""
    site = resting
    site.network.next("POST", "/mission_queue", Fate.LATE, 400.0)
    site.run_until(lambda: len(states(site)) == 1, within=1800)
    if not is_seen:
        site.run(60)
        site.network.down.add("R1")
        site.at(away, site.network.down.clear)
    site.run(3600)
    assert states(site) == ["Done", copy]
    assert len(sent_at(site)) == 2


def test_an_idle_mission_that_was_overtaken_and_comes_all_the_same_begins_no_other_rest(resting):
    """Nobody looked when it came, and it has run: it is what the robot did last by itself."""
    site = resting
    site.network.next("POST", "/mission_queue", Fate.LATE, 400.0)
    site.run_until(lambda: len(sent_at(site)) == 1, within=1800)
    stranger_works(site, 60)
    site.run_until(lambda: not site.executions()[0].state.is_open, within=300)
    site.switch_off()
    site.stay_off(500)
    site.switch_on()
    site.run(3600)
    assert states(site) == ["Done", "Done"]
    assert len(sent_at(site)) == 1


def test_a_late_copy_of_an_idle_mission_that_a_person_has_cancelled_ends_no_rest(resting):
    site = resting
    site.network.next("POST", "/mission_queue", Fate.LATE, 400.0)
    site.run_until(lambda: bool(site.executions()), within=900)
    site.run(20)
    site.container.operator.cancel_execution(site.executions()[0].id)
    site.run(3600)
    assert states(site) == ["Aborted"]
    assert len(sent_at(site)) == 1


def test_however_much_a_robot_has_done_since_its_idle_mission_comes_again(resting):
    """On a robot that is read item by item, a hundred and more missions between two rests are too many to read at once."""
    site = resting
    site.run_until(lambda: states(site) == ["Done"], within=900)
    for _n in range(150):
        site.stranger_queues("Deliver")
    site.machines["R1"].cancel_all()
    site.network.short_lists = 10
    site.run(1200)
    assert len(sent_at(site)) == 2


@pytest.mark.parametrize("how", ["paused", "skipped"])
def test_a_start_that_is_left_out_keeps_no_idle_mission_away(resting, how):
    """It comes every five minutes, so that there would never be room before the next one."""
    site = resting
    catalogue, pausing = site.container.catalogue, site.container.pausing
    first = datetime(2026, 11, 23, 6, 4)
    schedule = catalogue.save_schedule(
        Schedule("Often", robot_of(site).id, 1, first, "UTC", "FREQ=MINUTELY;INTERVAL=4")
    )
    if how == "paused":
        pausing.pause(schedule.id, datetime(2026, 11, 23, 8, tzinfo=UTC))
    else:
        for number in range(20):
            pausing.skip(schedule.id, first.replace(tzinfo=UTC) + number * timedelta(minutes=4))
    site.run(1200)
    assert len(sent_at(site)) == 1


def test_an_idle_start_that_waits_for_its_next_try_is_judged_again(resting):
    """The robot refused the connection; when it accepts again somebody is using it."""
    site = resting
    site.network.next("POST", "/mission_queue", Fate.REFUSED, count=4)
    site.run_until(lambda: bool(site.network.counts[Fate.REFUSED]), within=900)
    site.stranger_queues("Deliver")
    site.run(60)
    assert sent_at(site) == []
    assert states(site) == ["Executing"]


def test_an_idle_start_that_waits_for_its_next_try_gives_way_to_a_hold_of_its_rule(resting):
    """Idle automation that is switched off meanwhile starts nothing."""
    site = resting
    site.network.next("POST", "/mission_queue", Fate.REFUSED, count=4)
    site.run_until(lambda: bool(site.network.counts[Fate.REFUSED]), within=900)
    robot = robot_of(site)
    site.container.catalogue.save_idle_rule(robot.id, robot.idle.mission_id, after_minutes=5, enabled=False)
    site.run(120)
    assert sent_at(site) == []


def test_what_a_robot_did_between_two_polls_ends_its_rest(resting):
    """A stranger's mission that began and ended unseen shows in the queue's numbers: the rest counts from when it was over."""
    site = resting
    stranger_works(site, 125)
    site.run(240)
    assert states(site) == ["Done"]
    site.run(270)
    assert sent_at(site) == []
    site.run(390)
    assert len(sent_at(site)) == 1


def test_time_asleep_is_no_time_of_rest_that_was_seen(resting):
    """After the tablet slept the rest counts from zero: nobody knows what the robot did."""
    site = resting
    site.run(250)
    site.suspend(7200.0)
    site.run(280)
    assert sent_at(site) == []
    site.run(400)
    assert len(sent_at(site)) == 1


def test_work_during_a_sleep_of_the_tablet_ends_the_rest(resting):
    """The robot worked while the tablet slept."""
    site = resting
    site.run(130)
    site.stranger_queues("Deliver")
    site.suspend(7200.0)
    site.run(280)
    assert sent_at(site) == []


@pytest.mark.parametrize("refused", [1, 2])
def test_an_idle_start_that_found_no_connection_is_the_one_that_is_sent(resting, refused):
    """The number that tells whether anybody has used the robot since is kept: it has not been overtaken."""
    site = resting
    site.network.next("POST", "/mission_queue", Fate.REFUSED, count=refused)
    site.run_until(lambda: bool(sent_at(site)), within=900)
    site.run(60)
    assert [(row.state, row.attempts) for row in site.executions()] == [(State.COMPLETED, refused + 1)]


def test_an_idle_start_that_nothing_has_overtaken_is_tried_again(resting):
    """The robot still rests after the quiet time, so it is sent home then, once."""
    site = resting
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(1200)
    assert len(sent_at(site)) == 2
    assert states(site) == ["Done"]


def _removed(site):
    site.container.catalogue.remove_robot(robot_of(site).id)


def _switched_off(site):
    site.container.catalogue.save_robot(replace(robot_of(site), enabled=False))


def _rule_switched_off(site):
    robot = robot_of(site)
    site.container.catalogue.save_idle_rule(robot.id, robot.idle.mission_id, after_minutes=5, enabled=False)


def _held(site):
    site.container.holds.hold("a meeting")


@pytest.mark.parametrize("take_back", [_removed, _switched_off, _rule_switched_off, _held])
def test_an_idle_mission_that_is_taken_back_while_the_robot_is_read_for_it_is_not_sent(resting, take_back):
    """The read that finds the robot idle for long enough is answered slowly, and meanwhile a person decides otherwise."""
    site = resting
    site.network.others_wait = False
    site.run(330)
    site.network.next("GET", "/mission_queue", Fate.SLOW, 8.0)
    site.at(35, lambda: take_back(site))
    site.run(600)
    assert site.network.counts[Fate.SLOW] == 1
    assert (states(site), site.executions()) == ([], [])


def _mission_removed(site):
    site.container.catalogue.remove_mission(robot_of(site).idle.mission_id)


def _day_off(site):
    site.container.catalogue.change_settings(working_days=("SU",))


def _planned_soon(site):
    soon = (site.clock.now() + timedelta(minutes=3)).replace(tzinfo=None, second=0, microsecond=0)
    site.container.catalogue.save_schedule(
        Schedule("soon", robot_of(site).id, robot_of(site).idle.mission_id, soon, "UTC")
    )


def _somebody_works(site):
    site.stranger_queues("Deliver")


@pytest.mark.parametrize(
    "take_back",
    [_removed, _switched_off, _rule_switched_off, _mission_removed, _held, _day_off, _planned_soon, _somebody_works],
)
def test_an_idle_mission_that_is_taken_back_while_the_robot_is_asked_once_more_is_not_sent(resting, take_back):
    """Its row is on the disk; the status is too old to send by."""
    site = resting
    site.network.others_wait = False
    site.run(330)
    site.network.next("GET", "/mission_queue", Fate.SLOW, 8.0)
    site.at(33, lambda: site.network.next("GET", "/status", Fate.SLOW, 8.0))
    found = []

    def act():
        found.extend(site.executions())
        take_back(site)

    site.at(39, act)
    site.run(90)
    assert [row.trigger for row in found] == [Trigger.IDLE]
    assert sent_at(site) == []


def test_an_idle_mission_that_waits_for_a_place_is_judged_again_once_there_is_room(tmp_path):
    """When the place is free again, somebody uses the robot."""
    site = Site(tmp_path, robots=2)
    site.add_robots()
    home, deliver = site.add_mission("Home"), site.add_mission("Deliver")
    catalogue = site.container.catalogue
    catalogue.change_settings(poll_interval_seconds=120)
    catalogue.edit(lambda edit: edit.save_place(Place("Dock", 1, (home.id, deliver.id))))
    catalogue.save_idle_rule(robot_of(site, "R1").id, home.id, after_minutes=5)
    site.run(330)
    site.container.operator.run_now(robot_of(site, "R2").id, deliver.id)
    site.run_until(lambda: any(row.wait is Wait.PLACE for row in site.executions()), within=120)
    site.stranger_queues("Deliver")
    site.run_until(lambda: states(site, "R2") == ["Done"], within=120)
    site.run(60)
    assert sent_at(site, "R1") == []
    assert [row.reason.code for row in site.executions(State.SKIPPED)] == [ReasonCode.PLACE_BUSY]
    site.switch_off()
