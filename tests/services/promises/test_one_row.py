"""What an absence costs a schedule is one row, whose count is exact; what may still go is not kept waiting by it."""

from __future__ import annotations

import csv
import io
from collections import Counter
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from time import perf_counter

import pytest

from app.database.backups import back_up, restore
from app.domain.models import Overlap, ReasonCode, Schedule, State
from app.domain.reasons import sentence
from app.services.files.history_export import write_history
from app.services.live.alarms import alarm_sentence
from tests.simulation.diary import instants
from tests.support.groups import Hall
from tests.support.seen import covered, reason, sent_at
from tests.support.site import Site

DAY, YEAR = 86400.0, 365 * 86400.0
OFTEN = "FREQ=MINUTELY;INTERVAL=10"


def off_for(site: Site, seconds: float) -> None:
    """By a power cut. Somebody charges the robots."""
    site.keep_charged()
    site.power_cut(seconds)


def is_whole(site: Site, schedule: Schedule, until: datetime) -> bool:
    """Whether each instant up to then has exactly one row that stands for it."""
    planned = list(instants(schedule, datetime(2026, 11, 23, 6, tzinfo=UTC), until + timedelta(seconds=1)))
    return Counter(covered(site, schedule)) == Counter(planned)


def missed(site: Site) -> list[tuple[str, int]]:
    return [(row.schedule, row.starts) for row in site.executions(State.MISSED)]


def test_two_weeks_off_are_one_row_that_says_how_many_and_when(site, plan):
    schedule = plan("2026-11-23T06:05", OFTEN, respect_working_days=False, start_window_minutes=1)
    site.run(60)
    off_for(site, 14 * DAY)
    site.run(120)
    [row] = site.executions(State.MISSED)
    assert row.starts == 2016
    assert sentence(reason(row), "UTC") == "Missed 2,016 starts, 23 November – 7 December: the app was off or asleep"
    assert is_whole(site, schedule, site.clock.now())


def test_its_starts_count_in_figures_and_in_the_csv(site, plan):
    plan("2026-11-23T06:05", OFTEN, respect_working_days=False, start_window_minutes=1)
    site.run(60)
    off_for(site, 14 * DAY)
    site.run(120)
    kpis = site.container.kpis
    assert sum(day.missed for day in kpis.per_day()) == 2016
    assert kpis.facts().not_run == {ReasonCode.APP_DOWN: 2016}
    [alarm] = [alarm for alarm in site.container.alarms.open() if alarm.code == "executions_missed"]
    assert alarm.details["count"] == 2016
    assert alarm_sentence(alarm).startswith("2,016 planned missions were missed")
    file = io.StringIO(newline="")
    write_history(site.container.db.read(), file)
    rows = list(csv.DictReader(io.StringIO(file.getvalue())))
    assert [row["starts"] for row in rows if row["state"] == "missed"] == ["2016"]
    assert sum(int(row["starts"]) for row in rows) == 2016 + len(rows) - 1


def test_the_shift_report_says_it_once_and_leaves_nothing_over(site, plan):
    plan("2026-11-23T06:05", OFTEN, respect_working_days=False, start_window_minutes=1)
    site.run(60)
    off_for(site, 14 * DAY)
    site.run(120)
    report = site.container.shift_reports.make("today")
    assert [row.starts for row in report.runs if row.state is State.MISSED] == [2016]
    assert (report.facts.missed, report.more_runs) == (2016, 0)


def test_a_single_missed_start_is_the_row_that_it_always_was(site, plan):
    plan("2026-11-23T06:05", "FREQ=DAILY", respect_working_days=False)
    site.run(60)
    off_for(site, 7200)
    site.run(60)
    [row] = site.executions()
    assert (row.state, row.starts, row.planned_at) == (State.MISSED, 1, datetime(2026, 11, 23, 6, 5, tzinfo=UTC))
    assert sentence(reason(row), "UTC").startswith("The app was off or asleep from 06:0")


# ---------------------------------------------------------------------- a year, and the limit of the history
def every_minute(site: Site, schedules: int) -> None:
    robot, mission = site.container.catalogue.robots()[0], site.container.catalogue.missions()[0]

    def save(edit):
        for number in range(schedules):
            edit.save_schedule(
                Schedule(
                    f"S{number}",
                    robot.id,
                    mission.id,
                    datetime(2026, 11, 23, 6, 5),
                    "Europe/Helsinki",
                    "FREQ=MINUTELY",
                    respect_working_days=False,
                    overlap=Overlap.QUEUE,
                )
            )

    site.container.catalogue.edit(save)


def test_a_year_with_four_schedules_every_minute_is_caught_up_with_in_two_seconds(site):
    site.container.catalogue.change_settings(history_limit=200)
    every_minute(site, 4)
    off_for(site, YEAR)
    begun = perf_counter()
    site.run(3.0)
    took = perf_counter() - begun
    assert missed(site) == [(f"S{number}", 525_600) for number in range(4)]
    assert took < 2.0


def test_the_history_limit_holds_at_every_moment_of_catching_up(site, monkeypatch):
    """Also where more schedules have missed something than rows may be kept."""
    site.container.catalogue.change_settings(history_limit=3)
    every_minute(site, 250)
    off_for(site, YEAR)
    db, most = site.container.db, [0]

    def counted(work, *given):
        written = write(work, *given)
        number = db.read().execute("SELECT count(*) FROM executions WHERE state IN ('missed', 'skipped')").fetchone()[0]
        most[0] = max(most[0], number)
        return written

    write = db.write
    monkeypatch.setattr(db, "write", counted)
    site.run(3.0)
    [alarm] = [alarm for alarm in site.container.alarms.open() if alarm.code == "executions_missed"]
    assert (most[0], alarm.details["count"] > 250 * 525_000) == (3, True)


def test_a_start_that_may_still_go_leaves_within_35_seconds_whatever_else_was_missed(tmp_path):
    """With a window, which lists it for 30 seconds first."""
    site = Site(tmp_path, with_window=True)
    site.add_robots()
    site.add_mission("Deliver")
    every_minute(site, 100)
    site.container.catalogue.save_schedule(
        Schedule("Once", 1, 1, datetime(2026, 11, 30, 5, 55), "UTC", start_window_minutes=60)
    )
    off_for(site, 7 * DAY)
    back = site.seconds()
    site.run_until(lambda: any(row.schedule == "Once" and row.submitted_at for row in site.executions()), within=60)
    assert site.seconds() - back < 36.0
    site.switch_off()


# ---------------------------------------------------------------------- which absence, and what is no part of it
def test_a_tablet_that_slept_has_one_row_too(site, plan):
    schedule = plan("2026-11-23T06:05", "FREQ=HOURLY")
    site.run(60)
    site.suspend(5 * 3600.0)
    site.run(600)
    assert missed(site) == [("S1", 5)]
    assert is_whole(site, replace(schedule, recurrence="FREQ=MINUTELY;INTERVAL=60"), site.clock.now())


def test_each_absence_has_its_own_row(site, plan):
    schedule = plan("2026-11-23T06:05", OFTEN)
    site.run(60)
    for _absence in range(2):
        off_for(site, 7200)
        site.run(1300)
    assert missed(site) == [("S1", 11), ("S1", 11)]
    assert is_whole(site, schedule, site.clock.now())


def test_what_a_clock_that_was_not_plausible_cost_says_so(site, plan):
    """The robot's clock, which is right, holds everything back for hours."""
    plan("2026-11-23T06:05", OFTEN)
    site.run(60)
    site.clock.step(-DAY)
    site.switch_off()
    site.switch_on()
    site.run(3 * 3600.0)
    site.clock.step(DAY)
    site.run(60)
    [row] = site.executions(State.MISSED)
    assert (reason(row).code, row.starts > 10) == (ReasonCode.CLOCK_IMPLAUSIBLE, True)


def test_what_could_not_be_written_says_why(site, plan):
    """The disk is full for two hours."""
    schedule = plan("2026-11-23T06:05", OFTEN)
    site.run(60)
    room = site.make_read_only()
    site.run(7200)
    room()
    site.run(60)
    [row] = site.executions(State.MISSED)
    assert sentence(reason(row), "UTC").startswith(
        f"Missed {row.starts} starts, 23 November, 06:05–07:45: nothing could be written ("
    )
    assert is_whole(site, schedule, site.clock.now())


def test_starts_of_a_pause_are_one_row_and_those_after_it_another(site, plan):
    schedule = plan("2026-11-23T06:05", OFTEN)
    site.container.pausing.pause(schedule.id, datetime(2026, 11, 23, 8, tzinfo=UTC))
    site.run(60)
    off_for(site, 4 * 3600)
    site.run(60)
    assert [(row.state, reason(row).code, row.starts) for row in site.executions() if row.reason] == [
        (State.SKIPPED, ReasonCode.HOLD, 12),
        (State.MISSED, ReasonCode.APP_DOWN, 11),
    ]
    assert is_whole(site, schedule, site.clock.now())


def test_a_start_that_a_person_skipped_keeps_its_row_and_is_not_among_the_missed(site, plan):
    schedule = plan("2026-11-23T06:05", OFTEN)
    site.run(60)
    for minute in (25, 35):
        site.container.pausing.skip(schedule.id, datetime(2026, 11, 23, 6, minute, tzinfo=UTC))
    off_for(site, 7200)
    site.run(60)
    assert [(row.state, row.starts) for row in site.executions() if row.reason] == [
        (State.SKIPPED, 1),
        (State.SKIPPED, 1),
        (State.MISSED, 9),
    ]


def test_a_start_that_was_cancelled_before_the_clock_was_set_back_is_not_among_the_missed(site, plan):
    """It is skipped, as a person did not want it."""
    plan("2026-11-23T06:05", OFTEN)
    site.network.down.add("R1")
    site.run(30)
    site.clock.step(1100)
    site.run(60)
    [row] = site.executions(State.WAITING)
    site.container.operator.cancel_execution(row.id)
    site.clock.step(-1100)
    site.network.down.clear()
    site.run(60)
    off_for(site, 7200)
    site.run(60)
    assert [(row.state, row.starts) for row in site.executions() if row.reason] == [
        (State.SKIPPED, 1),
        (State.MISSED, 10),
    ]


def test_the_row_of_a_group_has_no_robot_and_says_which_group(tmp_path):
    hall = Hall(tmp_path)
    hall.plan(recurrence=OFTEN)
    hall.run(60)
    off_for(hall, DAY)
    hall.run(60)
    [row] = hall.executions(State.MISSED)
    assert (row.robot_id, row.robot_group, row.starts) == (None, "Hall", 143)
    hall.switch_off()


def test_a_rule_that_ended_meanwhile_has_missed_what_was_left_of_it(site, plan):
    schedule = plan("2026-11-23T06:05", f"{OFTEN};COUNT=30")
    site.run(60)
    off_for(site, 14 * DAY)
    site.run(60)
    assert missed(site) == [("S1", 30)]
    assert site.container.catalogue.schedules()[0].next_at is None
    assert schedule.next_at is not None


# ---------------------------------------------------------------------- whatever happens about it
def test_an_app_that_is_killed_while_it_catches_up_has_one_row_for_each_schedule(site, monkeypatch):
    every_minute(site, 250)
    off_for(site, DAY)
    add = site.container.repositories.executions.add_each_once
    transactions = iter((True, True, False))

    def killed(c, rows):
        if rows and rows[0].state is State.MISSED and not next(transactions):
            raise KeyboardInterrupt
        return add(c, rows)

    monkeypatch.setattr(site.container.repositories.executions, "add_each_once", killed)
    with pytest.raises(KeyboardInterrupt):
        site.run(3.0)
    off_for(site, 30.0)
    site.run(3.0)
    assert Counter(name for name, _starts in missed(site)) == {f"S{number}": 1 for number in range(250)}


def test_a_clock_that_was_ahead_is_set_back_into_the_absence(site, plan):
    """By a wrong clock the absence lasted two days; it was one. What is still to come is planned and not missed."""
    schedule = plan("2026-11-23T06:05", OFTEN, respect_working_days=False)
    site.run(60)
    site.network.down.add("R1")
    off_for(site, DAY)
    site.clock.step(DAY)
    site.run(60)
    assert [starts for _name, starts in missed(site)] == [288 - 1]
    site.network.down.clear()
    site.clock.step(-DAY)
    site.run(7200)
    assert is_whole(site, schedule, site.clock.now())
    assert sum(starts for _name, starts in missed(site)) < 150


def test_nothing_is_missed_twice_when_its_schedule_is_edited_right_after(site, plan):
    schedule = plan("2026-11-23T06:05", OFTEN)
    site.run(60)
    off_for(site, 7200)
    site.run(5)
    site.container.catalogue.save_schedule(replace(schedule, name="Other"))
    site.container.catalogue.change_settings(working_days=("MO", "TU", "WE", "TH", "FR", "SA"))
    site.run(1300)
    assert [starts for _name, starts in missed(site)] == [11]
    assert is_whole(site, schedule, site.clock.now())


def test_a_backup_from_before_the_absence_makes_its_row_again_and_no_second_one(site, plan):
    schedule = plan("2026-11-23T06:05", OFTEN)
    site.run(60)
    backup = site.directory / "before.db"
    back_up(site.container.db.path, backup)
    off_for(site, 7200)
    site.run(60)
    site.switch_off()
    restore(backup, site.container.db.path, site.clock.now())
    site.switch_on()
    site.run(900)
    assert len(missed(site)) == 1
    assert is_whole(site, schedule, site.clock.now())


def test_the_latest_start_of_the_absence_goes_once(site, plan):
    plan("2026-11-23T06:05", OFTEN)
    site.run(60)
    off_for(site, 7200)
    back = round(site.seconds())
    site.run(120)
    assert [at - back < 10 for at in sent_at(site)] == [True]
