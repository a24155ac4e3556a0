"""What an absence costs a schedule is one row, whose count is exact; what may still go is not kept waiting by it."""

from __future__ import annotations

import csv
import io
from collections import Counter
from dataclasses import replace
from datetime import datetime, timedelta

import pytest

from app.database.executions import ExecutionRepository
from app.domain.models import Overlap, Schedule
from app.domain.reasons import sentence
from app.services.catalogue import schedule_edit
from app.services.files.history_export import write_history
from app.services.live.alarms import alarm_sentence
from tests.services.story import *
from tests.simulation.diary import instants
from tests.support.effort import calls_of_this_thread
from tests.support.seen import covered

YEAR = 365 * DAY
OFTEN = [do(lambda s: s.keep_charged()), plan(every=10)]
TWO_WEEKS = [do(lambda s: s.keep_charged()), plan(every=10, window=1, workdays=False), 60, off_for(14 * DAY), 120]


@step
def whole(s, rule=None):
    """Each instant up to now has exactly one row that stands for it."""
    schedule = s.schedule() if rule is None else replace(s.schedule(), recurrence=rule)
    planned = list(instants(schedule, BEGIN, s.clock.now() + timedelta(seconds=1)))
    assert Counter(covered(s, schedule)) == Counter(planned)


def missed(*wanted):
    """How many starts each row of missed ones stands for."""
    return true(lambda s: [row.starts for row in s.executions(State.MISSED)] == list(wanted))


def reasons_are(*wanted):
    """State, reason and starts of the rows that have a reason."""
    return true(lambda s: [(r.state, r.reason.code, r.starts) for r in s.executions() if r.reason] == list(wanted))


def skipped_at(*minutes):
    return do(lambda s: [s.container.pausing.skip(1, BEGIN.replace(minute=minute)) for minute in minutes])


@step
def read_only(s, seconds):
    mend = s.make_read_only()
    s.run(seconds)
    mend()


FULL = "Missed 11 starts, 23 November, 06:05–07:45: nothing could be written ("

test_one_row = cases_of(
    Story(
        "a tablet that slept",
        [plan(rule="FREQ=HOURLY"), 60, asleep(5 * 3600.0), 600, missed(5), whole("FREQ=MINUTELY;INTERVAL=60")],
        stays_open=True,
    ),
    Story(
        "each absence has its own",
        [OFTEN, 60, off_for(7200), 1300, off_for(7200), 1300, missed(11, 11), whole()],
        stays_open=True,
    ),
    Story(
        "a single missed start is an ordinary row",
        [plan(rule="FREQ=DAILY", workdays=False), 60, off_for(7200), 60, ends(MISSED), missed(1)],
        true(lambda s: sentence(s.row().reason, "UTC").startswith("The app was off or asleep from 06:0")),
    ),
    Story(
        "starts missed by an implausible clock say so",
        [OFTEN, 60, clock(-DAY), app_off(), app_on(), 2 * 3600, clock(DAY), 60],
        true(lambda s: [row.reason.code for row in s.executions(State.MISSED)] == [ReasonCode.CLOCK_IMPLAUSIBLE]),
        true(lambda s: s.executions(State.MISSED)[0].starts > 10),
        stays_open=True,
    ),
    Story(
        "starts that could not be written say why",
        [OFTEN, 60, read_only(7200), 60, whole()],
        true(lambda s: [sentence(row.reason, "UTC").startswith(FULL) for row in s.executions(State.MISSED)] == [True]),
        stays_open=True,
    ),
    Story(
        "starts of a pause are one and those after it another",
        [OFTEN, pause(120), 60, off_for(4 * 3600), 60, reasons_are((*PAUSED, 12), (*MISSED, 11)), whole()],
        stays_open=True,
    ),
    Story(
        "a start that a person skipped has its own",
        [OFTEN, 60, skipped_at(25, 35), off_for(7200), 60],
        true(
            lambda s: (
                [(r.state, r.starts) for r in s.executions() if r.reason]
                == [*[(State.SKIPPED, 1)] * 2, (State.MISSED, 9)]
            )
        ),
        stays_open=True,
    ),
    Story(
        "a start that was cancelled before the clock was set back is skipped",
        [OFTEN, down(), 30, clock(1100), 60, cancel(), clock(-1100), up(), 60, off_for(7200), 60],
        true(
            lambda s: (
                [(r.state, r.starts) for r in s.executions() if r.reason] == [(State.SKIPPED, 1), (State.MISSED, 10)]
            )
        ),
        stays_open=True,
    ),
    Story(
        "the row of a group has no robot and names the group",
        [OFTEN, 60, off_for(DAY), 60],
        true(
            lambda s: (
                [(r.robot_id, r.robot_group, r.starts) for r in s.executions(State.MISSED)] == [(None, "Hall", 143)]
            )
        ),
        on="group",
        robots=3,
        stays_open=True,
    ),
    Story(
        "a rule that ended has missed its remaining starts",
        [plan(rule="FREQ=MINUTELY;INTERVAL=10;COUNT=30"), 60, off_for(14 * DAY), 60, missed(30)],
        true(lambda s: s.schedule().next_at is None),
    ),
    Story(
        "a clock that was ahead is set back into the absence: future starts are planned",
        [do(lambda s: s.keep_charged()), plan(every=10, workdays=False), 60, down(), off_for(DAY), clock(DAY), 60],
        [
            missed(2 * 144 - 1),
            up(),
            clock(-DAY),
            7200,
            whole(),
            true(lambda s: sum(r.starts for r in s.executions(State.MISSED)) < 150),
        ],
        stays_open=True,
    ),
    Story(
        "nothing is missed twice when its schedule is edited right after",
        [
            OFTEN,
            60,
            off_for(7200),
            5,
            edit(name="Other"),
            set_up(working_days=("MO", "TU", "WE", "TH", "FR", "SA")),
            1300,
        ],
        [missed(11), whole()],
        stays_open=True,
    ),
    Story(
        "a backup from before the absence writes its row again, once",
        [OFTEN, 60, backup(), off_for(7200), 60, restored(), 900, whole()],
        true(lambda s: len(s.executions(State.MISSED)) == 1),
        stays_open=True,
    ),
    Story(
        "the latest start of the absence is sent once",
        [OFTEN, 60, off_for(7200), do(lambda s: s.noted.append(s.seconds())), 120],
        true(lambda s: [at - s.noted[0] < 10 for at in sent_at(s)] == [True]),
        stays_open=True,
    ),
)


def test_two_weeks_off_say_how_many_and_when_everywhere(s):
    """In the reason, the figures, the alarm, the CSV and the shift report."""
    play(s, TWO_WEEKS, missed(2016), whole())
    [row] = s.executions(State.MISSED)
    assert sentence(row.reason, "UTC") == "Missed 2,016 starts, 23 November – 7 December: the app was off or asleep"
    kpis = s.container.kpis
    assert sum(day.missed for day in kpis.per_day()) == 2016
    assert kpis.facts().not_run == {ReasonCode.APP_DOWN: 2016}
    [alarm] = [alarm for alarm in s.container.alarms.open() if alarm.code == "executions_missed"]
    assert alarm.details["count"] == 2016
    assert alarm_sentence(alarm).startswith("2,016 planned missions were missed")
    file = io.StringIO(newline="")
    write_history(s.container.db.read(), file)
    rows = list(csv.DictReader(io.StringIO(file.getvalue())))
    assert [row["starts"] for row in rows if row["state"] == "missed"] == ["2016"]
    assert sum(int(row["starts"]) for row in rows) == 2016 + len(rows) - 1
    report = s.container.shift_reports.make("today")
    assert [row.starts for row in report.runs if row.state is State.MISSED] == [2016]
    assert (report.facts.missed, report.more_runs) == (2016, 0)


# ---------------------------------------------------------------------- a year, and the limit of the history
@step
def every_minute(s, schedules):
    def save(edit):
        for number in range(schedules):
            values = {"respect_working_days": False, "overlap": Overlap.QUEUE}
            start = datetime(2026, 11, 23, 6, 5)
            schedule_edit.save(edit, Schedule(f"S{number}", 1, 1, start, "Europe/Helsinki", "FREQ=MINUTELY", **values))

    s.container.catalogue.edit(save)


def test_a_year_with_four_schedules_every_minute_is_caught_up_with_at_once(s):
    play(s, set_up(history_limit=200), every_minute(4), off_for(YEAR))
    with calls_of_this_thread() as calls:
        s.run(3.0)
    play(s, missed(*[525_600] * 4))
    assert calls.number < 100_000


@pytest.mark.long
def test_the_history_limit_holds_at_every_moment_of_catching_up(s, monkeypatch):
    """Also where more schedules have missed something than rows may be kept."""
    play(s, set_up(history_limit=3), every_minute(250), off_for(YEAR))
    db, most = s.container.db, [0]
    write = db.write

    def counted(work, *values):
        written = write(work, *values)
        number = db.read().execute("SELECT count(*) FROM executions WHERE state IN ('missed', 'skipped')").fetchone()[0]
        most[0] = max(most[0], number)
        return written

    monkeypatch.setattr(db, "write", counted)
    s.run(3.0)
    [alarm] = [alarm for alarm in s.container.alarms.open() if alarm.code == "executions_missed"]
    assert (most[0], alarm.details["count"] > 250 * 525_000) == (3, True)


@pytest.mark.long
def test_a_start_that_may_still_go_leaves_within_35_seconds_whatever_else_was_missed(tmp_path):
    """With a window, which lists it for 30 seconds first."""
    s = Stage(tmp_path, "robot", 1, with_window=True)
    play(s, do(lambda s: s.keep_charged()), every_minute(100), plan("Once", "30T05:55", window=60), off_for(7 * DAY))
    back = s.seconds()
    s.run_until(lambda: any(row.schedule == "Once" and row.submitted_at for row in s.executions()), within=60)
    assert s.seconds() - back < 36.0
    s.switch_off()


@pytest.mark.long
def test_an_app_that_is_killed_while_it_catches_up_has_one_row_for_each_schedule(s, monkeypatch):
    play(s, every_minute(250), off_for(DAY))
    add = ExecutionRepository.add_each_once
    transactions = iter((True, True, False))

    def killed(self, c, rows):
        if rows and rows[0].state is State.MISSED and not next(transactions):
            monkeypatch.undo()
            raise KeyboardInterrupt
        return add(self, c, rows)

    monkeypatch.setattr(ExecutionRepository, "add_each_once", killed)
    with pytest.raises(KeyboardInterrupt):
        s.run(3.0)
    play(s, off_for(30), 3)
    assert Counter(row.schedule for row in s.executions(State.MISSED)) == {f"S{number}": 1 for number in range(250)}
