"""Schedules made or changed while the tablet's clock is known to be wrong count from its correction: nothing before was
missed. The clock was wrong if it showed a time before the app existed, or was set ahead to that of robots that had
contradicted it. Every other start that its clock passes over has a row."""

from __future__ import annotations

from app.services.dispatch.timing import CLOCKS_AGREE
from tests.services.story import *

HOUR = 3600.0
NEVER_SET = datetime(1970, 1, 1, 0, 5, tzinfo=UTC)
OF_THE_IMAGE = datetime(2025, 1, 1, tzinfo=UTC)  # a small computer without a battery starts at the date of its image
BEHIND = datetime(2026, 11, 22, 23, 0, tzinfo=UTC)
IMPLAUSIBLE = raised("clock_implausible")
CONFIRM = do(lambda s: s.container.holds.confirm_clock())


@step
def robots_are_right(s):
    for machine in s.all_machines:
        machine.clock.start = BEGIN


@step
def right(s):
    s.clock.step((BEGIN - s.clock.now()).total_seconds() + s.seconds())
    s.kick()


@step
def robots_off_by(s, seconds, *names):
    for machine in [s.machines[name] for name in names] or s.all_machines:
        machine.clock.offset = seconds


def daily(at):
    return plan(at=at, rule="FREQ=DAILY", workdays=False)


def rows(*wanted):
    """Instants and states of all."""
    return true(lambda s: [(f"{row.planned_at:%dT%H:%M}", row.state) for row in s.executions()] == list(wanted))


def starts(number):
    return true(lambda s: [(row.state, row.starts) for row in s.executions()] == [(State.MISSED, number)])


RUNS_AT_FIVE_PAST = [600, rows(("23T06:05", COMPLETED))]

test_set_up = cases_of(
    *(
        Story(
            f"by a clock that shows {shows.year}",
            [robots_are_right()],
            each(
                [down(), daily("06:05"), 120, right(), up()],
                [daily("06:05"), 120, IMPLAUSIBLE, right()],
                [daily("06:05"), 120, app_off(), right(), app_on()],
                [down(), daily("06:05"), 120, app_off(), right(), up(), app_on()],
                [daily("06:05"), 120, CONFIRM, 60, right()],
            ),
            [RUNS_AT_FIVE_PAST, not_raised("executions_missed", "app_was_off")],
            now=shows,
        )
        for shows in (NEVER_SET, OF_THE_IMAGE)
    ),
    Story(
        "the schedule was changed when it was right",
        [robots_are_right(), down(), daily("06:05"), 120, right(), up(), 600],
        true(lambda s: s.schedule().changed_at >= BEGIN),
        now=NEVER_SET,
    ),
    Story(
        "by a clock that is hours behind",
        [POLLED_OFTEN, robots_are_right(), down()],
        each([up(), daily("00:05"), 120], [later(300, up()), daily("00:05"), 420]),
        [IMPLAUSIBLE, right(), 600, rows()],
        now=BEHIND,
    ),
    Story(
        "starts planned while it was right are missed",
        [POLLED_OFTEN, robots_are_right(), daily("07:05"), 60, clock(-7 * HOUR), 60, IMPLAUSIBLE],
        [plan("New", "08:05", rule="FREQ=DAILY", workdays=False), do(lambda s: s.clock.advance(4 * HOUR)), right(), 60],
        rows(("23T07:05", State.MISSED)),
        robots=2,
    ),
    Story(
        "a sleep of two days is not a wrong clock",
        [daily("07:05"), 60, asleep(2 * DAY), 60, starts(2), raised("app_was_off")],
    ),
    Story(
        "switched off for two days without any robot is missed",
        [down(), daily("07:05"), 60, app_off(), do(lambda s: s.clock.advance(2 * DAY)), app_on(), 60, starts(2)],
    ),
)

HALF_AN_HOUR = [30 * 60, IMPLAUSIBLE]
HAS_ITS_ROW = [60, rows(("23T06:10", State.MISSED))]
RESTART = [app_off(), do(lambda s: s.stay_off(90)), app_on()]

test_among_wrong_robots = cases_of(
    Story(
        "no start vanishes before a person or the robots correct the clock",
        [robots_off_by(HOUR), daily("06:10"), HALF_AN_HOUR],
        each(
            [],
            clock(6),
            asleep(20),
            asleep(HOUR),
            RESTART,
        ),
        60,
        each(CONFIRM, robots_off_by(0.0)),
        HAS_ITS_ROW,
    ),
    Story(
        "nor if the robot is corrected while the app is off",
        [robots_off_by(HOUR), daily("06:10"), 30 * 60, app_off(), do(lambda s: s.stay_off(HOUR)), robots_off_by(0.0)],
        [app_on(), HAS_ITS_ROW],
    ),
    Story(
        "a step of seconds is not what made the clocks agree",
        [robots_off_by(CLOCKS_AGREE + 3.0), daily("06:10"), HALF_AN_HOUR, clock(6), HAS_ITS_ROW],
    ),
    Story(
        "another robot that agrees has not contradicted the clock",
        [robots_off_by(HOUR, "R1"), daily("06:10"), down("R2"), HALF_AN_HOUR],
        [do(lambda s: setattr(s.network, "down", {"R1"})), asleep(HOUR), HAS_ITS_ROW],
        robots=2,
        mark=OWN_CLOCK,
    ),
    Story(
        "robots whose clocks go wrong later",
        [daily("06:10"), 60, robots_off_by(HOUR), 300, IMPLAUSIBLE, edit(priority=1), 30 * 60],
        each(
            asleep(HOUR),
            asleep(20),
        ),
        [60, CONFIRM, HAS_ITS_ROW],
        robots=2,
    ),
)
