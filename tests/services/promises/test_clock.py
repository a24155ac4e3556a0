"""A clock that may be wrong sends nothing and writes nothing off, until robots or the operator say that it is right (D3, D4)."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.database.connection import DatabaseUnavailable
from app.domain.models import Overlap, ReasonCode, Schedule, State
from tests.support.seen import alarms, covered, items, outcomes, reason, sent_at
from tests.support.site import Site

DAY = 86400.0
YEAR = 365 * DAY


@pytest.fixture(params=[1, 2])
def fleet(request, tmp_path):
    """Robots, each with a daily start at 08:05; it is 06:00."""
    site = Site(tmp_path, robots=request.param)
    mission = site.add_mission("Deliver")
    site.container.catalogue.change_settings(poll_interval_seconds=60)
    for robot in site.add_robots():
        start = datetime.fromisoformat("2026-11-23T08:05")
        site.container.catalogue.save_schedule(
            Schedule(f"S{robot.id}", robot.id, mission.id, start, "UTC", "FREQ=DAILY", respect_working_days=False)
        )
    yield site
    site.switch_off()


def run_days(site):
    """Daily at 06:05 on R1, every day of the week."""
    site.container.catalogue.change_settings(poll_interval_seconds=1800)
    start = datetime.fromisoformat("2026-11-23T06:05")
    return site.container.catalogue.save_schedule(
        Schedule("S", 1, 1, start, "UTC", "FREQ=DAILY", respect_working_days=False)
    )


def glitch(site, seconds, lasts=60.0):
    """The wall clock jumps, and a while later it is set right."""
    site.clock.step(seconds)
    site.run(lasts)
    site.clock.step(-seconds)


def started(site):
    return [(row.planned_at.day, row.state) for row in site.executions()]


# ---------------------------------------------------------------------- at the start
def test_a_tablet_that_starts_three_days_ahead_sends_nothing_and_misses_nothing(fleet):
    """At the start nothing is sent or written off before a robot's time agrees with the tablet's."""
    site, ahead = fleet, 3 * DAY + 7200.0
    site.run(60)
    site.switch_off()
    site.clock.step(ahead)
    site.network.down |= set(site.machines)
    site.switch_on()
    site.at(8.0, site.network.down.clear)
    site.run(900)
    assert sent_at(site) == []
    assert outcomes(site) == []
    assert "clock_implausible" in alarms(site)
    site.clock.step(-ahead)
    site.run(7200)
    assert sent_at(site) == [7500] * len(site.machines)
    assert [row.state for row in site.executions()] == [State.COMPLETED] * len(site.machines)
    assert "clock_implausible" not in [alarm.code for alarm in site.container.alarms.open() if alarm.cleared_at is None]


def test_while_no_robot_can_be_asked_nothing_is_written_off_for_half_a_minute(fleet):
    """With nobody there to compare clocks with, the tablet's own counts 30 s after the start, and not before."""
    site = fleet
    site.run(60)
    site.network.down |= set(site.machines)
    site.power_cut(3 * 3600.0)
    site.run(25)
    assert outcomes(site) == []
    site.run(125)
    assert [(row.state, reason(row).code) for row in site.executions()] == [(State.MISSED, ReasonCode.APP_DOWN)] * len(
        site.machines
    )


def test_after_a_restart_just_before_a_start_it_leaves_in_its_moment(fleet):
    """A robot that agrees is asked at once: comparing clocks makes nobody late."""
    site = fleet
    site.run(7485)
    site.power_cut(5)
    site.run(60)
    assert [round(post.at - 7500.0, 1) <= 1.0 for post in site.network.posts()] == [True] * len(site.machines)


@pytest.mark.parametrize("silent_s", [60, 1500])
def test_a_robot_that_answers_late_is_asked_for_the_time_before_anything_is_sent_to_it(site, plan, silent_s):
    """As nobody answered for half a minute, a clock that is two days ahead counted: its starts tried a silent robot, or were given up."""
    ahead = 2 * DAY + 900.0
    plan("2026-11-23T06:10", "FREQ=MINUTELY;INTERVAL=30", start_window_minutes=20)
    site.container.catalogue.change_settings(poll_interval_seconds=600)
    site.run(10)
    site.switch_off()
    site.clock.step(ahead)
    site.network.down.add("R1")
    site.switch_on()
    site.at(silent_s, site.network.down.clear)
    site.run(silent_s + 300)
    assert {row.state for row in site.executions()} >= {State.MISSED, State.WAITING if silent_s == 60 else State.FAILED}
    assert sent_at(site) == []
    site.clock.step(-ahead)
    begun = site.seconds()
    site.run(7200)
    assert sent_at(site) == [at for at in range(600, 9000, 1800) if begun < at < begun + 7200]


def test_a_robot_that_has_contradicted_the_clock_and_falls_silent_is_believed(site, plan):
    """Nobody has told anything else since: the tablet's own clock does not count again after half a minute."""
    plan("2026-11-23T06:10", "FREQ=MINUTELY;INTERVAL=30")
    site.run(10)
    site.switch_off()
    site.clock.step(2 * DAY)
    site.network.down.add("R1")
    site.switch_on()
    site.run(60)
    site.network.down.clear()
    site.run(70)
    site.network.down.add("R1")
    assert site.container.holds.active().clock
    rows = len(site.executions())
    site.run(3600)
    assert site.container.holds.active().clock
    assert len(site.executions()) == rows


def test_one_robot_with_a_wrong_clock_among_others_stops_nobody(tmp_path):
    """Most robots agree with the tablet, so it is the one robot's clock that is wrong."""
    site = Site(tmp_path, robots=3)
    site.machines["R2"].clock.offset = YEAR
    mission = site.add_mission("Deliver")
    for robot in site.add_robots():
        start = datetime.fromisoformat("2026-11-23T06:05")
        site.container.catalogue.save_schedule(Schedule(f"S{robot.id}", robot.id, mission.id, start, "UTC"))
    site.run(600)
    assert [row.state for row in site.executions()] == [State.COMPLETED] * 3
    site.switch_off()


def test_the_operator_can_say_that_the_clock_is_right(fleet):
    """Robots whose clocks are all wrong hold everything only until a person has looked at the tablet's clock."""
    site = fleet
    for machine in site.machines.values():
        machine.clock.offset = -YEAR
    site.power_cut(5)
    site.run(120)
    assert site.container.holds.active().clock
    site.container.holds.confirm_clock()
    assert site.container.holds.active() is None
    site.run(7500)
    assert [row.state for row in site.executions()] == [State.COMPLETED] * len(site.machines)
    site.power_cut(5)
    site.run(120)
    assert site.container.holds.active() is None  # it has been confirmed, and nothing has jumped since


# ---------------------------------------------------------------------- while it runs
def test_while_the_clock_has_jumped_ahead_nothing_is_sent_and_nothing_missed(fleet):
    """A jump beyond a start window puts the clock in doubt until a robot agrees."""
    site = fleet
    site.run(60)
    site.clock.step(YEAR + 7200.0)
    site.run(600)
    assert sent_at(site) == []
    assert outcomes(site) == []
    assert "clock_implausible" in alarms(site)


@pytest.mark.parametrize("jump", [3 * DAY, YEAR])
def test_after_a_jump_ahead_and_back_every_day_runs_once(site, jump):
    """Whatever the clock showed for a minute, everything is planned from the true time, and no day is missed in advance."""
    run_days(site)
    site.run(60)
    glitch(site, jump)
    site.run(DAY + 600)
    assert started(site) == [(day, State.COMPLETED) for day in (23, 24)]
    assert len(items(site)) == 2


def test_days_of_a_pause_are_not_skipped_in_advance(site):
    """Rows that say skipped for instants still to come, of which nothing was ever sent, go when the clock is set back."""
    schedule = run_days(site)
    site.container.pausing.pause(schedule.id, datetime(2026, 11, 24, 12, tzinfo=UTC))
    site.run(60)
    glitch(site, 3 * DAY)
    site.container.pausing.resume(schedule.id)
    site.run(DAY + 600)
    assert started(site) == [(23, State.COMPLETED), (24, State.COMPLETED)]


def test_a_start_that_a_person_skipped_stays_skipped_when_the_clock_jumps(site):
    """Skip next is a decision: it outlives rows that are taken out."""
    schedule = run_days(site)
    site.container.pausing.skip_next(schedule.id)
    site.run(60)
    glitch(site, 3 * DAY)
    site.run(DAY + 600)
    assert sent_at(site) == [round(DAY + 300)]


def test_after_a_sleep_robots_agree_and_what_was_missed_is_written_so(site, plan):
    """A tablet that slept for two hours has a right clock, which its robots confirm within a poll."""
    plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=60")
    site.run(60)
    site.suspend(7200.0)
    site.run(600)
    assert [(f"{row.planned_at:%H:%M}", row.state, row.starts) for row in site.executions()] == [
        ("07:05", State.MISSED, 2),
        ("08:05", State.COMPLETED, 1),
    ]


def test_a_clock_that_was_rightly_set_ahead_counts_once_a_person_says_so(site, plan):
    """No robot can be asked: a person confirms the new time, and what it passed over is missed."""
    plan("2026-11-23T06:05", "FREQ=DAILY", respect_working_days=False)
    site.run(60)
    site.network.down.add("R1")
    site.clock.step(2 * DAY + timedelta(hours=2).total_seconds())
    site.run(600)
    assert outcomes(site) == []
    site.container.holds.confirm_clock()
    site.run(120)
    assert [(row.planned_at.day, row.state, row.starts) for row in site.executions()] == [(25, State.MISSED, 3)]


# ---------------------------------------------------------------------- what people do while it is wrong
@pytest.mark.parametrize("jump", [1500.0, 3 * DAY])
@pytest.mark.parametrize("edit", ["move", "undo", "off and on", "skip", "working days"])
def test_what_is_edited_while_the_clock_is_ahead_is_planned_from_the_true_time(site, plan, jump, edit):
    """An edit finds its next start by the clock that it has; when that is set right the starts in between run."""
    schedule = plan("2026-11-23T06:02", "FREQ=MINUTELY;INTERVAL=10", respect_working_days=True)
    site.run(60)
    site.clock.step(jump)
    site.run(30)
    c = site.container
    skipped = None
    match edit:
        case "move":
            c.catalogue.save_schedule(replace(schedule, start=schedule.start.replace(minute=1)))
        case "undo":
            c.catalogue.restore(c.catalogue.remove_schedule(schedule.id))
        case "off and on":
            c.catalogue.set_schedule_enabled(schedule.id, False)
            c.catalogue.set_schedule_enabled(schedule.id, True)
        case "skip":
            skipped = c.pausing.skip_next(schedule.id)
        case "working days":
            c.catalogue.change_settings(working_days=("MO", "TU", "WE", "TH", "FR", "SA"))
    site.run(30)
    site.clock.step(-jump)
    site.run(2000)
    minutes = [1, 11, 21, 31] if edit == "move" else [2, 12, 22, 32]
    wanted = [
        minute
        for minute in minutes
        if minute > 2 and (skipped is None or minute != skipped.minute or skipped.hour != 6)
    ]
    assert [at for at in sent_at(site) if at > 180] == [60 * minute for minute in wanted]


def test_what_was_edited_while_the_clock_was_ahead_misses_nothing_when_the_app_starts_again(site, plan):
    """Before the time at which it seems to have been edited, the app is off while one of its instants falls due."""
    schedule = plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=10")
    site.run(60)
    site.clock.step(7200)
    site.run(30)
    site.container.catalogue.set_schedule_enabled(schedule.id, False)
    site.container.catalogue.set_schedule_enabled(schedule.id, True)
    site.run(30)
    site.clock.step(-7200)
    site.run(880 - 120)
    site.power_cut(40)
    site.run(120)
    first, second = sent_at(site)
    assert first == 300
    assert 920 <= second <= 930


def test_a_start_that_waits_when_the_clock_is_set_back_waits_for_its_instant(site, plan):
    """It fell due by a clock that was some minutes ahead; it is not sent before its time."""
    plan("2026-11-23T06:05")
    site.network.down.add("R1")
    site.run(30)
    site.clock.step(500)
    site.run(60)
    site.clock.step(-500)
    site.network.down.clear()
    site.run(900)
    assert sent_at(site) == [300]
    assert outcomes(site)[0][0] is State.COMPLETED


def test_days_that_become_working_days_while_the_clock_is_ahead_run_when_it_is_set_right(site, plan):
    """What seems to be due by the wrong clock is still to come by the true one."""
    plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=10", respect_working_days=True)
    site.run(30)
    site.container.catalogue.change_settings(working_days=("TU", "WE", "TH", "FR"))
    site.run(30)
    site.clock.step(2 * DAY)
    site.run(30)
    site.container.catalogue.change_settings(working_days=("MO", "TU", "WE", "TH", "FR"))
    site.run(30)
    site.clock.step(-2 * DAY)
    site.run(1200)
    assert sent_at(site) == [300, 900]


def test_an_absence_by_a_wrong_clock_makes_nothing_late_once_it_is_set_right(tmp_path):
    """With a window, what falls due after an absence is listed first: not what falls due after the clock has been set back."""
    site = Site(tmp_path, with_window=True)
    robot, mission = site.add_robots()[0], site.add_mission("Deliver")
    site.run(60)
    site.switch_off()
    site.clock.step(2 * DAY)
    site.switch_on()
    site.run(60)
    site.clock.step(-2 * DAY)
    site.container.catalogue.save_schedule(
        Schedule("S", robot.id, mission.id, datetime.fromisoformat("2026-11-23T06:10"), "UTC")
    )
    site.run(900)
    assert sent_at(site) == [600]
    site.switch_off()


def test_a_step_back_that_can_not_be_written_at_once_is_made_up_for(site, plan, monkeypatch):
    plan("2026-11-23T06:05", start_window_minutes=1)
    site.run(60.0)
    site.clock.step(600.0)
    site.run(2.0)
    assert [state for _day, state in started(site)] == [State.MISSED]

    def full(*_given):
        monkeypatch.undo()
        raise DatabaseUnavailable("the disk is full")

    monkeypatch.setattr(site.container.repositories.schedules, "planned_beyond", full)
    site.clock.step(-600.0)
    site.run(600.0)
    assert [state for _day, state in started(site)] == [State.COMPLETED]


def test_what_a_start_by_a_wrong_clock_has_passed_over_keeps_its_row(site, plan):
    """The clock is ten minutes ahead for a minute, in which the latest instant is started: it is not started again, and neither are the
    ones before it, so those have to stay in the history as missed."""
    schedule = plan("2026-11-23T06:00", "FREQ=MINUTELY;INTERVAL=2", overlap=Overlap.QUEUE)
    site.run(130)
    glitch(site, 600.0)
    site.run(1200)
    minutes = sorted(instant.minute for instant in covered(site, schedule) if instant.hour == 6)
    assert minutes == list(range(0, site.container.clock.now().minute + 1, 2))


def test_an_absence_that_only_a_wrong_clock_shows_is_not_told(fleet):
    """The app says for how long it was off once the clock can be trusted, and by that clock."""
    site = fleet
    site.run(60)
    site.stay_off(600)
    site.clock.step(3 * DAY)
    site.switch_on()
    site.run(60)
    assert "app_was_off" not in alarms(site)
    site.clock.step(-3 * DAY)
    site.run(60)
    [alarm] = [alarm for alarm in site.container.alarms.open() if alarm.code == "app_was_off"]
    start, end = (datetime.fromisoformat(alarm.details[name]) for name in ("start", "end"))
    assert timedelta(seconds=600) <= end - start < timedelta(seconds=800)
