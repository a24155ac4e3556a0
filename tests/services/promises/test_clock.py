"""While the clock may be wrong nothing is sent and nothing written off, until robots or a person say that it is right; after an absence of
the app each start runs once or has its row (D3, D4)."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.database.connection import DatabaseUnavailable
from app.database.schedules import ScheduleRepository
from app.domain.models import Overlap
from tests.services.story import *
from tests.support.seen import covered

YEAR = 365 * DAY
DAILY = [set_up(poll_interval_seconds=1800), plan(rule="FREQ=DAILY", workdays=False)]
IN_DOUBT = true(lambda s: s.container.holds.active().clock)
BELIEVED = true(lambda s: s.container.holds.active() is None)
CONFIRM = do(lambda s: s.container.holds.confirm_clock())
ON_TIME = true(lambda s: all(post.at - 7500 <= 1.0 for post in s.network.posts()))


def glitch(seconds, lasts=60):
    """It jumps, and is corrected a while later."""
    return [clock(seconds), lasts, clock(-seconds)]


def of_the_robots(offset):
    def act(s):
        for machine in s.all_machines:
            machine.clock.offset = offset

    return do(act)


def days(*wanted):
    """Those of the starts that have run."""
    return true(lambda s: [row.planned_at.day for row in s.executions(COMPLETED)] == list(wanted))


def in_a_fleet(robots):
    """Each robot has a daily start at 08:05, which is 7500 s from the beginning."""
    fleet = [set_up(poll_interval_seconds=60)]
    fleet += [plan(f"S{n}", "08:05", on=n, rule="FREQ=DAILY", workdays=False) for n in range(1, robots + 1)]
    ahead = 3 * DAY + 7200.0
    return [
        Story(
            "begun three days ahead nothing is sent or missed",
            [fleet, 60, app_off(), clock(ahead), down(), app_on(), later(8.0, up()), 900],
            [sent(), ends(), raised("clock_implausible"), clock(-ahead), 7200],
            [sent(*[7500] * robots), ends(*[DONE] * robots)],
            true(lambda s: "clock_implausible" not in [a.code for a in s.container.alarms.open() if not a.cleared_at]),
            robots=robots,
        ),
        Story(
            "without robots the clock counts after half a minute",
            [fleet, 60, down(), off_for(3 * 3600.0), 25, ends(), 125, ends(*[MISSED] * robots)],
            robots=robots,
        ),
        Story(
            "a restart just before makes no start late",
            [fleet, 7485, off_for(), 60, true(lambda s: len(s.network.posts()) == robots), ON_TIME, 200],
            robots=robots,
        ),
        Story(
            "a person can say that it is right",
            [fleet, of_the_robots(-YEAR), off_for(), 120, IN_DOUBT, CONFIRM, BELIEVED, 7500, ends(*[DONE] * robots)],
            [off_for(), 120, BELIEVED],
            robots=robots,
        ),
        Story(
            "while it has jumped ahead nothing is sent or missed",
            [fleet, 60, clock(YEAR + 7200), 600, sent(), ends(), raised("clock_implausible")],
            robots=robots,
        ),
        Story(
            "an absence shown only by a wrong clock is not reported",
            [fleet, 60, app_off(), do(lambda s: s.stay_off(600)), clock(3 * DAY), app_on(), 60],
            [not_raised("app_was_off"), clock(-3 * DAY), 60, was_off_for(600, 800)],
            robots=robots,
        ),
    ]


@step
def was_off_for(s, least, most):
    [alarm] = [alarm for alarm in s.container.alarms.open() if alarm.code == "app_was_off"]
    start, end = (datetime.fromisoformat(alarm.details[name]) for name in ("start", "end"))
    assert timedelta(seconds=least) <= end - start < timedelta(seconds=most)


test_in_doubt = cases_of(
    *in_a_fleet(1),
    *in_a_fleet(2),
    Story(
        "a robot that answers late is asked for the time first",
        [plan(at="06:10", every=30, window=20), set_up(poll_interval_seconds=600), 10, app_off(), clock(2 * DAY + 900)],
        [down(), app_on()],
        each(
            [later(60, up()), 360, true(lambda s: {row.state for row in s.executions()} >= {State.MISSED, WAITING})],
            [later(1500, up()), 1800, true(lambda s: {row.state for row in s.executions()} >= {State.MISSED, FAILED})],
        ),
        [sent(), clock(-2 * DAY - 900), do(lambda s: s.noted.append(s.seconds())), 7200],
        true(lambda s: sent_at(s) == [at for at in range(600, 9000, 1800) if 0 < at - s.noted[-1] < 7200]),
        stays_open=True,
    ),
    Story(
        "a robot that has contradicted it and falls silent is believed",
        [POLLED_OFTEN, plan(at="06:10", every=30), 10, app_off(), clock(2 * DAY), down(), app_on(), 60, up(), 70],
        [down(), IN_DOUBT],
        [do(lambda s: s.noted.append(len(s.executions()))), 3600, IN_DOUBT],
        true(lambda s: len(s.executions()) == s.noted[-1]),
        stays_open=True,
    ),
    Story(
        "one robot with a wrong clock among three stops none",
        do(lambda s: setattr(s.machines["R2"].clock, "offset", YEAR)),
        [plan(f"S{n}", on=n) for n in (1, 2, 3)],
        [600, ends(DONE, DONE, DONE)],
        robots=3,
    ),
    Story(
        "before the last heartbeat everything is held",
        [plan(rule="FREQ=DAILY", workdays=False), 120, app_off(), clock(-10 * YEAR), app_on(), 600, ends()],
        [raised("clock_implausible"), IN_DOUBT, clock(10 * YEAR), 600, BELIEVED, ends(DONE)],
    ),
    Story(
        "a clock rightly set ahead counts once a person says so",
        [plan(rule="FREQ=DAILY", workdays=False), 60, down(), clock(2 * DAY + 7200), 600, ends(), CONFIRM, 120],
        [ends(MISSED), counts(3)],
    ),
)

test_jumped = cases_of(
    Story(
        "ahead and back: every day runs once",
        DAILY,
        60,
        each(glitch(3 * DAY), glitch(YEAR)),
        [DAY + 600, days(23, 24), runs(2)],
    ),
    Story(
        "days of a pause are not skipped in advance",
        [DAILY, pause(30 * 60), 60, glitch(3 * DAY), resume(), DAY + 600, days(23, 24), ends(DONE, DONE)],
    ),
    Story("a skipped start stays skipped", [DAILY, skip(), 60, glitch(3 * DAY), DAY + 600, sent(round(DAY + 300))]),
    Story(
        "edits while it is ahead are planned from the true time",
        plan(at="06:02", every=10),
        each(
            *(
                [
                    60,
                    clock(jump),
                    30,
                    act,
                    30,
                    clock(-jump),
                    2000,
                    true(lambda s, w=w: [a for a in sent_at(s) if a > 180] == w),
                ]
                for jump in (1500.0, 3 * DAY)
                for act, w in (
                    (edit(at="06:01"), [660, 1260, 1860]),
                    ([delete(), undo()], [720, 1320, 1920]),
                    ([off(), on()], [720, 1320, 1920]),
                    (skip(), [720, 1320, 1920]),
                    (set_up(working_days=("MO", "TU", "WE", "TH", "FR", "SA")), [720, 1320, 1920]),
                )
            ),
        ),
        stays_open=True,
    ),
    Story(
        "edits while it was ahead miss nothing after a restart of the app",
        [plan(every=10), 60, clock(7200), 30, off(), on(), 30, clock(-7200), 760, off_for(40), 120],
        true(lambda s: sent_at(s)[0] == 300 and 920 <= sent_at(s)[1] <= 930),
        stays_open=True,
    ),
    Story(
        "a waiting start waits for its instant after it is set back",
        [plan(), down(), 30, clock(500), 60, clock(-500), up(), 900, sent(300), ends(DONE)],
    ),
    Story(
        "days that become working days while it is ahead run when it is right",
        [plan(every=10), 30, set_up(working_days=("TU", "WE", "TH", "FR")), 30, clock(2 * DAY), 30],
        [set_up(working_days=("MO", "TU", "WE", "TH", "FR")), 30, clock(-2 * DAY), 1200, sent(300, 900)],
        stays_open=True,
    ),
    Story(
        "an absence by a wrong clock makes nothing late once it is right",
        [60, app_off(), clock(2 * DAY), app_on(), 60, clock(-2 * DAY), plan(at="06:10"), 900, sent(600)],
        with_window=True,
    ),
    Story(
        "instants that a wrong clock passed over keep their rows",
        [plan(at="06:00", every=2, overlap=Overlap.QUEUE), 130, glitch(600), 1200],
        true(
            lambda s: (
                sorted(at.minute for at in covered(s, s.schedule()) if at.hour == 6)
                == list(range(0, s.clock.now().minute + 1, 2))
            )
        ),
        stays_open=True,
    ),
    Story(
        "back over a start that ran: nothing runs twice",
        [plan(rule="FREQ=DAILY", workdays=False), 310],
        each(*([clock(-back), set_up(poll_interval_seconds=1800), back + 600] for back in (45, 3600, 3 * DAY))),
        [true(lambda s: [row.planned_at.day for row in s.executions()] == [23]), runs(1)],
    ),
    Story(
        "an absence ends at the app's start, not when the clock is set",
        [
            120,
            app_off(cleanly=False),
            do(lambda s: s.clock.advance(600)),
            clock(-3600),
            app_on(),
            2400,
            clock(3600),
            60,
        ],
        was_off_for(600, 690),
    ),
)


def test_a_step_back_that_can_not_be_written_at_once_is_made_up_for(s, monkeypatch):
    play(s, plan(window=1), 60, clock(600), 2, states(State.MISSED))

    def full(*_arguments):
        monkeypatch.undo()
        raise DatabaseUnavailable("the disk is full")

    monkeypatch.setattr(ScheduleRepository, "planned_beyond", full)
    play(s, clock(-600), 600, ends(DONE))


@pytest.mark.parametrize(
    ("begins", "at"), [("2027-03-27T12:00", "2027-03-28T01:30"), ("2027-10-30T12:00", "2027-10-31T00:30")]
)
def test_the_nights_in_which_helsinki_changes_its_clocks(tmp_path, begins, at):
    """03:30 does not exist in one, and comes twice in the other: once each, shifted and first."""
    s = Stage(tmp_path, "robot", 1, now=datetime.fromisoformat(begins).replace(tzinfo=UTC))
    play(s, set_up(poll_interval_seconds=600), plan(rule="FREQ=DAILY", workdays=False))
    night = replace(
        s.schedule(), start=datetime.fromisoformat(begins).replace(hour=3, minute=30), timezone="Europe/Helsinki"
    )
    s.container.catalogue.save_schedule(night)
    s.run(20 * 3600)
    assert [f"{row.planned_at:%Y-%m-%dT%H:%M}" for row in s.executions()] == [at]
    s.switch_off()
