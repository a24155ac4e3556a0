"""The app was off, the tablet slept: each start runs once or has its row, and what is late is listed first."""

from __future__ import annotations

from functools import partial

import pytest

from tests.services.story import *
from tests.support.clock import VirtualClock

TWO_LATE = [plan("R1", on=1), plan("R2", on=2), 60, off_for(600), 15]


@step
def keep_r1(s, held=True, number=1):
    assert s.container.operator.hold_starts([s.row("R1").id], held=held) == number


def of(name, *wanted):
    """How many items the robot has, and what its start waits for."""
    return true(lambda s: (len(s.queue(name)), *[s.row(name).wait] * len(wanted[1:])) == wanted)


test_absent = cases_of(
    Story("back within the window it runs once", [plan(), 60, off_for(600), 300, ends(DONE), raised("app_was_off")]),
    Story("longer than the window it is missed", [plan(), 60, off_for(3600), 300, ends(MISSED)]),
    Story(
        "of many only the latest runs",
        [plan(rule="FREQ=HOURLY"), 60, off_for(5 * 3600 + 400), 600, ends(MISSED, DONE), counts(5, 1)],
    ),
    Story("a short restart is not an absence", [plan(), 280, off_for(10), 300, ends(DONE), not_raised()]),
    Story(
        "a tablet asleep over the window misses it",
        plan(),
        60,
        each(asleep(7200), asleep(3 * DAY)),
        [300, ends(MISSED)],
    ),
    Story(
        "after a sleep robots confirm the clock and missed starts are written",
        [plan(every=60), 60, asleep(7200), 600, ends(MISSED, DONE), counts(2, 1)],
    ),
    Story(
        "with a window late starts are first listed for half a minute",
        [plan(), 60],
        each(
            [off_for(600), 25],
            [app_off(cleanly=False), do(lambda s: s.clock.advance(600)), clock(-DAY), app_on(), 2, clock(DAY), 20],
        ),
        [waits(Wait.LATE_START), runs(0), 300, ends(DONE), raised("app_was_off")],
        with_window=True,
    ),
    Story(
        "one of two on the list is held until it is released",
        [TWO_LATE, keep_r1(), 120, of("R1", 0, HOLD), true(lambda s: not s.container.holds.current())],
        [of("R2", 1), keep_r1(False), 5, of("R1", 1), 200],
        robots=2,
        with_window=True,
    ),
    Story(
        "released from the list it starts at once",
        [TWO_LATE, keep_r1(False), 2, of("R1", 1), of("R2", 0), 300],
        robots=2,
        with_window=True,
    ),
    Story(
        "held beyond its window it is skipped",
        [
            TWO_LATE,
            keep_r1(),
            900,
            of("R1", 0),
            true(lambda s: (s.row("R1").reason.code, s.row("R1").attempts) == (ReasonCode.HOLD, 0)),
        ],
        robots=2,
        with_window=True,
    ),
    Story(
        "a held start is not sent because its schedule was edited there and back",
        [TWO_LATE, keep_r1()],
        each([off("R1"), 5, on("R1"), 5], [edit("R1", at="08:05"), 5, edit("R1", at="06:05"), 5]),
        [200, of("R1", 0)],
        robots=2,
        with_window=True,
        stays_open=True,
    ),
    Story(
        "after another sleep it is listed again",
        [TWO_LATE, asleep(90), 20, waits(Wait.LATE_START, Wait.LATE_START), 60, runs(2), 200],
        robots=2,
        with_window=True,
    ),
    Story(
        "a held start stays held over another absence",
        [TWO_LATE, keep_r1(), 10, off_for(120), 60, of("R1", 0), true(lambda s: s.row("R1").held)],
        robots=2,
        with_window=True,
        stays_open=True,
    ),
    Story(
        "Hold pressed in the last moment reports the true outcome",
        TWO_LATE,
        each(
            *(
                later(at, do(lambda s: s.noted.append(s.container.operator.hold_starts([s.row("R1").id]))))
                for at in (14.9, 15.0, 15.1)
            )
        ),
        [120, true(lambda s: len(s.queue("R1")) == 1 - s.noted[-1])],
        robots=2,
        with_window=True,
        stays_open=True,
    ),
    Story(
        "held while its robot is asked for its status it is not sent",
        [TWO_LATE, 10, meets("GET", "/status", SLOW, 4.0, robot="R1"), later(7.0, keep_r1()), 120],
        [of("R1", 0, HOLD), of("R2", 1)],
        robots=2,
        with_window=True,
        stays_open=True,
    ),
    Story("a start being sent is not held", [TWO_LATE, 60, keep_r1(number=0), 200], robots=2, with_window=True),
)

JUST_BEFORE = each(
    *(300.0 - before for before in (0.3, 0.05, 1.0, 0.5, 0.2)),
)
NEEDS_HALF = plan(battery=50)

test_asleep_just_before = cases_of(
    Story(
        "the battery is read before anything is sent",
        NEEDS_HALF,
        JUST_BEFORE,
        battery(10),
        each(asleep(5), asleep(600), do(lambda s: s.clock.advance(600.0))),
        [60, sent(), waits(BATTERY)],
        stays_open=True,
    ),
    Story("a charged robot gets its start once", NEEDS_HALF, JUST_BEFORE, [asleep(600), 60, runs(1), 200]),
    Story(
        "a clock that is set looks the same",
        NEEDS_HALF,
        JUST_BEFORE,
        [battery(10), do(lambda s: s.as_for_a_second())],
        each(clock(-600), clock(600)),
        [700, sent()],
        stays_open=True,
    ),
)


def woken_first(s, seconds):
    """The scheduler's thread is quicker than the robot's."""
    VirtualClock.suspend(s.clock, seconds)
    s.engine.advance()


def stopped(s, seconds):
    """Both clocks kept running."""
    s.clock.advance(seconds)


@pytest.mark.parametrize("sleep", [woken_first, stopped])
def test_asleep_between_connecting_and_sending_the_battery_is_read_again(s, monkeypatch, sleep):
    monkeypatch.setattr(s.clock, "suspend", partial(sleep, s))
    play(s, NEEDS_HALF, 60, post(Fate.ASLEEP, 300.0), later(239.99, battery(10)), 300, sent(), waits(BATTERY))


def test_what_was_missed_says_between_when_the_app_was_off(s):
    play(s, plan(), 60, off_for(3600), 300, ends(MISSED))
    details = s.row().reason.details
    assert details["start"] < s.row().planned_at.isoformat() < details["end"]
