"""The app was off, the tablet slept, its clock was moved: nothing doubled, nothing lost without a word."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.database.backups import back_up, restore
from app.domain.models import ReasonCode, Schedule, State, Wait
from tests.support.network import Fate
from tests.support.site import Site


def outcome(site):
    return [(run.planned_at.strftime("%H:%M"), run.state, run.reason and run.reason.code) for run in site.executions()]


def off_for(site, seconds):
    site.switch_off(cleanly=False)
    site.clock.advance(seconds)
    site.switch_on()


def test_off_at_the_instant_but_back_in_the_window_runs_once(site, plan):
    plan("2026-11-23T06:05")
    site.run(60)
    off_for(site, 600)
    site.run(300)
    assert outcome(site) == [("06:05", State.COMPLETED, None)]
    assert "app_was_off" in [alarm.code for alarm in site.container.alarms.open()]


def test_off_longer_than_the_window_is_missed(site, plan):
    plan("2026-11-23T06:05")
    site.run(60)
    off_for(site, 3600)
    site.run(300)
    [run] = site.executions()
    assert (run.state, run.reason.code) == (State.MISSED, ReasonCode.APP_DOWN)
    assert run.reason.details["start"] < run.planned_at.isoformat() < run.reason.details["end"]


def test_of_many_missed_only_the_latest_still_runs(site, plan):
    plan("2026-11-23T06:05", "FREQ=HOURLY")
    site.run(60)
    off_for(site, 5 * 3600 + 400)  # back at about 11:07
    site.run(600)
    assert outcome(site) == [("10:05", State.MISSED, ReasonCode.APP_DOWN), ("11:05", State.COMPLETED, None)]
    assert [run.starts for run in site.executions()] == [5, 1]


def test_with_a_window_late_starts_are_listed_for_30_seconds_first(tmp_path):
    site = Site(tmp_path, with_window=True)
    site.add_robots()
    site.add_mission("Deliver")
    c = site.container
    c.catalogue.save_schedule(Schedule("S", 1, 1, datetime(2026, 11, 23, 6, 5), "UTC"))
    site.run(60)
    off_for(site, 600)
    site.run(25)
    [run] = site.executions()
    assert (run.state, run.wait) == (State.WAITING, Wait.LATE_START)
    assert len(site.machines["R1"].queue) == 0
    site.run(300)
    assert site.executions()[0].state is State.COMPLETED
    site.switch_off()


def test_late_starts_are_listed_when_the_clock_was_behind_at_the_start_and_is_set_right(tmp_path):
    site = Site(tmp_path, with_window=True)
    [robot], mission = site.add_robots(), site.add_mission("Deliver")
    site.container.catalogue.save_schedule(Schedule("S", robot.id, mission.id, datetime(2026, 11, 23, 6, 5), "UTC"))
    site.run(60)
    site.switch_off(cleanly=False)
    site.clock.advance(600)
    site.clock.step(-1 * 86400)
    site.switch_on()
    site.run(2)
    site.clock.step(1 * 86400)
    site.run(20)
    [run] = site.executions()
    assert (run.state, run.wait) == (State.WAITING, Wait.LATE_START)
    site.run(300)
    assert outcome(site) == [("06:05", State.COMPLETED, None)]
    assert "app_was_off" in [alarm.code for alarm in site.container.alarms.open()]
    site.switch_off()


def test_an_absence_ends_when_the_app_was_started_and_not_when_its_clock_was_set(tmp_path):
    """A small computer comes up with its last saved time, an hour behind; it is set right after forty minutes."""
    site = Site(tmp_path)
    site.add_robots()
    site.run(120)
    site.switch_off(cleanly=False)
    site.clock.advance(600)
    site.clock.step(-3600)
    site.switch_on()
    site.run(2400)
    site.clock.step(3600)
    site.run(60)
    [alarm] = [alarm for alarm in site.container.alarms.open() if alarm.code == "app_was_off"]
    assert datetime.fromisoformat(alarm.details["end"]) < datetime(2026, 11, 23, 6, 13, tzinfo=UTC)
    site.switch_off()


@pytest.fixture
def late(tmp_path):
    """Two late starts on the list of a window, on R1 and R2."""
    site = Site(tmp_path, robots=2, with_window=True)
    robots, mission = site.add_robots(), site.add_mission("Deliver")
    for robot in robots:
        site.container.catalogue.save_schedule(
            Schedule(robot.name, robot.id, mission.id, datetime(2026, 11, 23, 6, 5), "UTC")
        )
    site.run(60)
    off_for(site, 600)
    site.run(15)
    yield site
    site.switch_off()


def the_start(site, robot):
    return next(run for run in site.executions() if run.robot == robot)


def test_one_late_start_is_held_and_the_others_go(late):
    assert late.container.operator.hold_starts([the_start(late, "R1").id]) == 1
    late.run(120)
    assert (the_start(late, "R1").state, the_start(late, "R1").wait) == (State.WAITING, Wait.HOLD)
    assert the_start(late, "R2").state in (State.EXECUTING, State.COMPLETED)
    assert not late.container.holds.current()


def test_a_held_start_goes_when_it_is_released(late):
    late.container.operator.hold_starts([the_start(late, "R1").id])
    late.run(120)
    late.container.operator.hold_starts([the_start(late, "R1").id], held=False)
    late.run(5)
    assert len(late.machines["R1"].queue) == 1


def test_a_listed_start_that_is_let_go_goes_at_once(late):
    late.container.operator.hold_starts([the_start(late, "R1").id], held=False)
    late.run(2)
    assert [len(late.machines[name].queue) for name in ("R1", "R2")] == [1, 0]


def test_a_start_held_beyond_its_window_is_skipped(late):
    late.container.operator.hold_starts([the_start(late, "R1").id])
    late.run(900)
    run = the_start(late, "R1")
    assert (run.state, run.reason.code, run.attempts) == (State.SKIPPED, ReasonCode.HOLD, 0)
    assert len(late.machines["R1"].queue) == 0


def schedule_of(site, robot):
    return next(schedule for schedule in site.container.catalogue.schedules() if schedule.name == robot)


def switched_off_and_on(site):
    for enabled in (False, True):
        site.container.catalogue.set_schedule_enabled(schedule_of(site, "R1").id, enabled)
        site.run(5)


def moved_and_moved_back(site):
    for hours in (2, -2):
        schedule = schedule_of(site, "R1")
        site.container.catalogue.save_schedule(replace(schedule, start=schedule.start + timedelta(hours=hours)))
        site.run(5)


@pytest.mark.parametrize("edit", [switched_off_and_on, moved_and_moved_back])
def test_a_held_start_is_not_sent_because_its_schedule_was_edited_there_and_back(late, edit):
    late.container.operator.hold_starts([the_start(late, "R1").id])
    edit(late)
    late.run(200)
    assert len(late.machines["R1"].queue) == 0


def test_after_another_sleep_late_starts_are_listed_for_as_long_again(late):
    late.suspend(60)
    late.run(20)
    assert [run.wait for run in late.executions()] == [Wait.LATE_START] * 2
    late.run(60)
    assert all(run.state in (State.EXECUTING, State.COMPLETED) for run in late.executions())


def test_a_held_start_stays_held_over_another_absence(late):
    late.container.operator.hold_starts([the_start(late, "R1").id])
    late.run(10)
    off_for(late, 120)
    late.run(60)
    assert len(late.machines["R1"].queue) == 0
    assert the_start(late, "R1").held


@pytest.mark.parametrize("seconds", [14.9, 15.0, 15.1])
def test_what_was_said_to_be_held_is_not_sent(late, seconds):
    """Whoever presses in the last moment is told the truth: held and not sent, or on its way already."""
    held: list[int] = []
    run = the_start(late, "R1")
    late.at(seconds, lambda: held.append(late.container.operator.hold_starts([run.id])))
    late.run(120)
    assert len(late.machines["R1"].queue) == 1 - held[0]


def test_a_start_that_is_held_while_its_robot_is_asked_for_its_status_is_not_sent(late):
    late.run(10)
    late.network.next("GET", "/status", Fate.SLOW, 4.0, robot="R1")
    late.at(7.0, lambda: late.container.operator.hold_starts([the_start(late, "R1").id]))
    late.run(120)
    assert (len(late.machines["R1"].queue), the_start(late, "R1").wait) == (0, Wait.HOLD)
    assert len(late.machines["R2"].queue) == 1


def test_a_start_that_is_on_its_way_is_not_held(late):
    late.run(60)
    assert late.container.operator.hold_starts([the_start(late, "R1").id]) == 0


def test_a_short_restart_is_no_absence(site, plan):
    plan("2026-11-23T06:05")
    site.run(280)
    off_for(site, 10)
    site.run(300)
    assert outcome(site) == [("06:05", State.COMPLETED, None)]
    assert site.container.alarms.open() == []


@pytest.mark.parametrize("seconds", [7200, 3 * 86400])
def test_the_tablet_sleeps_over_the_window(site, plan, seconds):
    plan("2026-11-23T06:05")
    site.run(60)
    site.suspend(seconds)
    site.run(300)
    assert outcome(site) == [("06:05", State.MISSED, ReasonCode.APP_DOWN)]


@pytest.mark.parametrize("step", [-45, -3600, -3 * 86400])
def test_the_clock_jumps_back_and_nothing_runs_twice(site, plan, step):
    plan("2026-11-23T06:05", "FREQ=DAILY", respect_working_days=False)
    site.run(310)
    site.clock.step(step)
    site.container.catalogue.change_settings(poll_interval_seconds=1800)
    site.run(max(-step, 0) + 600)
    assert [run.planned_at.day for run in site.executions()] == [23]
    assert len(site.machines["R1"].queue) == 1


def test_a_clock_before_the_last_heartbeat_holds_everything(site, plan):
    plan("2026-11-23T06:05", "FREQ=DAILY", respect_working_days=False)
    site.run(120)
    site.switch_off()
    site.clock.step(-86400 * 3650)
    site.switch_on()
    site.run(600)
    assert site.executions() == []
    assert "clock_implausible" in [alarm.code for alarm in site.container.alarms.open()]
    assert site.container.holds.active().clock
    site.clock.step(86400 * 3650)
    site.run(600)
    assert site.container.holds.active() is None
    assert [run.state for run in site.executions()] == [State.COMPLETED]


def test_dst_night_in_helsinki(tmp_path):
    """03:30 does not exist on 28 March 2027 and comes twice on 31 October: once each, shifted and first."""
    for start, expected in (
        (datetime(2027, 3, 27, 12, tzinfo=UTC), "2027-03-28T01:30:00+00:00"),
        (datetime(2027, 10, 30, 12, tzinfo=UTC), "2027-10-31T00:30:00+00:00"),
    ):
        directory = tmp_path / expected[:7]
        directory.mkdir()
        site = Site(directory, now=start)
        site.add_robots()
        site.add_mission("Deliver")
        site.container.catalogue.change_settings(poll_interval_seconds=600)
        first = start.replace(tzinfo=None).replace(hour=3, minute=30)
        site.container.catalogue.save_schedule(
            Schedule("S", 1, 1, first, "Europe/Helsinki", "FREQ=DAILY", respect_working_days=False)
        )
        site.run(timedelta(hours=20).total_seconds())
        assert [run.planned_at.isoformat() for run in site.executions()] == [expected]
        site.switch_off()


def test_a_restored_backup_finds_what_it_has_forgotten(site, plan):
    """The occurrence ran after the backup was made: its token is computed again, found on the robot and adopted."""
    plan("2026-11-23T06:05")
    site.run(60)
    db = site.container.db
    backup = site.directory / "before.db"
    back_up(db.path, backup)
    site.run_until(lambda: site.executions(State.COMPLETED))
    site.switch_off()
    restore(backup, db.path, site.clock.now())
    site.switch_on()
    site.run(300)
    assert outcome(site) == [("06:05", State.COMPLETED, None)]
    assert len(site.machines["R1"].queue) == 1
    codes = [alarm.code for alarm in site.container.alarms.open()]
    assert "backup_restored" in codes
    assert "app_was_off" not in codes  # it was on, and had started the mission


def test_an_absence_after_a_restored_backup_is_one_again(site):
    site.run(60)
    backup = site.directory / "before.db"
    back_up(site.container.db.path, backup)
    site.switch_off()
    restore(backup, site.container.db.path, site.clock.now())
    site.switch_on()
    site.run(60)
    off_for(site, 600)
    site.run(60)
    assert [alarm.code for alarm in site.container.alarms.open()] == ["app_was_off"]


def test_the_history_is_held_to_its_limit(site, plan):
    site.container.catalogue.change_settings(history_limit=3, poll_interval_seconds=600)
    plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=5")
    site.run(3600)
    ended = site.executions(State.COMPLETED)
    assert len(ended) == 3
    assert ended[-1].planned_at.strftime("%H:%M") == "06:55"
