"""Starts that people hold while the clock is ahead stay held until released, and follow every edit until their time has
come (D4, D5)."""

from __future__ import annotations

from dataclasses import replace

from app.domain.models import DayException, HandOver, Overlap
from tests.services.promises.test_clock_corrected import (
    BOTH,
    FAR,
    HOURS,
    LIMITS,
    OFF_AND_ON,
    OFTEN,
    PUT_BY_HAND,
    ahead,
    all_leave,
    right,
    started,
)
from tests.services.story import *


def held(s) -> list:
    return [row for row in s.executions(WAITING) if row.held and row.wait is HOLD]


@step
def let_go_of_all(s, seconds):
    """Every start that waits for a release is released, as long as there are any."""
    for _n in range(int(seconds / 5)):
        s.run(5)
        s.container.operator.hold_starts([row.id for row in held(s)], held=False)


test_held_while_the_clock_is_ahead = cases_of(
    Story(
        "it can be released after a small correction",
        [plan(**PUT_BY_HAND), 10, hold("R1"), 600, keep(), release()],
        each(*([clock(-back), back + 120] for back in (20, 180, 300))),
        [let_go(), 300, runs(1)],
        on=BOTH,
    ),
    Story(
        "a one-time start of a group too",
        [plan(at="06:10", window=120, workdays=False), 10, hold(), 620, keep(), release(), clock(-60), 120],
        [let_go(), 300, runs(1)],
        on="group",
        robots=2,
    ),
    Story(
        "listed as late, it can be released after the network has set the clock",
        [plan(**PUT_BY_HAND), 10, app_off(), do(lambda s: s.clock.sleep(530)), clock(90), app_on(), 5, keep()],
        [clock(-90), 180, let_go(), 300, runs(1)],
        with_window=True,
    ),
    Story(
        "listed as late by a clock far ahead, each start is sent once it is released",
        [
            plan(at="06:10", every=30, window=20, workdays=False),
            ahead(FAR),
            keep(),
            right(FAR),
            keep(False),
            all_leave(),
        ],
        with_window=True,
        stays_open=True,
    ),
    Story(
        "no start is lost because a later one is",
        OFTEN,
        each([ahead(FAR), keep(), right(FAR)], [ahead(HOURS), keep(), right(HOURS)]),
        [200, all_leave(5000)],
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "no start is lost by an edit after its release",
        [set_up(poll_interval_seconds=600)],
        each(
            *(plan(at="06:10", every=30, window=20, workdays=False, overlap=o) for o in (Overlap.SKIP, Overlap.QUEUE))
        ),
        [ahead(FAR), keep(), right(FAR), do(lambda s: s.container.operator.hold_starts([s.noted[0].id], held=False))],
        [OFF_AND_ON, all_leave()],
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "no start is lost if the clock is a quarter of an hour ahead for a moment",
        [plan(every=5, window=30, workdays=False), 10, hold("R1"), clock(840), 20],
        [
            do(lambda s: s.container.operator.hold_starts([s.executions(WAITING)[-1].id])),
            clock(-840),
            60,
            release(),
            500,
        ],
        sent(300),
        on="group",
        stays_open=True,
    ),
    Story(
        "the hold ends if it is edited before the clock is right",
        [OFTEN, ahead(HOURS), keep()],
        each(
            [OFF_AND_ON, right(HOURS), 300, all_leave(3 * 3600)],
            [delete(), right(HOURS), undo(), 300, all_leave(6000)],
        ),
        on="group",
        stays_open=True,
    ),
    Story(
        "held too long after a try it runs when a person starts it",
        [set_up(poll_interval_seconds=600), plan(at="06:10", every=30, window=6, workdays=False), ahead(HOURS), 100],
        [keep(), 300, right(HOURS), 60, unskip(), all_leave(4 * 3600)],
        stays_open=True,
    ),
    Story(
        "until it is too late: it is not sent",
        [plan(window=1), 10, hold("R1"), clock(300), 5, do(lambda s: s.container.operator.hold_starts([s.row().id]))],
        [60, release(), clock(-300), 900, sent()],
    ),
)


def kept(back=300, **values):
    """06:10 is held while the clock is ahead; the clock is corrected, and 06:10 is the next start again."""
    return [plan(**PUT_BY_HAND | values), 10, hold("R1"), 600, keep(), release(), clock(-back), 5, states()]


RULES = ("FREQ=MONTHLY", None, "FREQ=DAILY")
BACK_AND_RULES = [
    (back, rule) for turn in range(3) for back, rule in zip((20, 180, 300), RULES[turn:] + RULES[:turn], strict=True)
]
WAITS_ON = [
    [600, true(lambda s: [row.planned_at.minute for row in held(s)] == [10]), runs(0)],
    [let_go_of_all(60), runs(1)],
]
SEVERAL = plan(at="06:08", every=1, window=60, workdays=False, overlap=Overlap.QUEUE)

test_held_and_still_in_the_future = cases_of(
    Story(
        "it waits for its release when its time has come",
        each(
            *(kept(back, rule=rule) for back, rule in BACK_AND_RULES),
        ),
        [clock(-10), app_off(cleanly=False), app_on()],
        true(lambda s: [(run.at.minute, run.held) for run in s.container.plan.next(1)] == [(10, True)]),
        WAITS_ON,
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "it waits for its release after any other action",
        [kept(), states()],
        LIMITS,
        each(
            [delete(), 2, undo()],
            [delete("mission"), 2, undo()],
            [delete("robot"), 2, undo()],
            OFF_AND_ON,
            [robot_off("R1"), 20, robot_on("R1"), 20],
            [edit(robot_id=2), edit(robot_id=1)],
            pause(1),
            [pause(60), 2, resume()],
        ),
        WAITS_ON,
        robots=2,
        stays_open=True,
    ),
    Story(
        "it waits for its release if its deletion or cancellation was undone before the clock was corrected",
        LIMITS,
        [plan(**PUT_BY_HAND), 10, hold("R1"), 600, keep()],
        each(
            [delete(), release(), clock(-300), 5, undo()],
            [cancel(), release(), clock(-300), 5, want_again()],
        ),
        WAITS_ON,
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "a held start can be skipped and unskipped",
        [kept(), skip(), 2, unskip(), 600, runs(1)],
        on=BOTH,
        stays_open=True,
    ),
    Story("skipped it is not sent", [kept(), skip(), let_go_of_all(600), runs(0)], on=BOTH),
    Story(
        "moved to an earlier time it runs then",
        each(kept(), kept(rule=None)),
        [edit(at="06:08"), 600, minutes(8)],
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "another rule has its own starts",
        [kept(), edit(at="06:00", rule="FREQ=MINUTELY;INTERVAL=7"), 600, minutes(7, 14)],
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "moved an hour earlier it is planned as usual",
        set_up(poll_interval_seconds=600),
        each(*(plan(**PUT_BY_HAND | {"at": "08:00", "rule": rule}) for rule in ("FREQ=DAILY", None))),
        [ahead(7500.0), 30, keep(), right(7500.0), edit(at="07:00"), 9000, sent(3600)],
        stays_open=True,
    ),
    Story(
        "on a day off it does not run",
        kept(workdays=True),
        do(lambda s: s.container.catalogue.save_days(DayException("outing", BEGIN.date(), BEGIN.date()))),
        [5, let_go_of_all(600), runs(0)],
    ),
    Story(
        "of several one is cancelled and restored, and two are held",
        [SEVERAL, 10, hold("R1"), 595, cancel(0), keep(), clock(-300), 5],
        each([], [app_off(), app_on(), 5]),
        do(lambda s: s.container.catalogue.wait_again(next(row.id for row in s.noted if row.planned_at.minute == 8))),
        [release(), 440, true(lambda s: [row.planned_at.minute for row in held(s)] == [9, 10])],
        [let_go_of_all(400), do(lambda s: play(s, minutes(*range(8, 8 + len(s.all_items())))))],
        true(lambda s: len(s.all_items()) >= 5),
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "other schedules go before it",
        each(
            *(
                do(lambda s, h=h: s.container.catalogue.save_robot(replace(s.robot("R1"), hand_over=h)))
                for h in HandOver
            )
        ),
        [2, plan(at="06:40", rule="FREQ=DAILY", window=120, workdays=False), ahead(2700.0), keep(), right(2700.0)],
        [
            plan("B", every=10, window=9, workdays=False),
            1370,
            sent(300, 900),
            1600,
            true(lambda s: 40 not in started(s)),
        ],
        [let_go_of_all(60), true(lambda s: 40 in started(s))],
        on=BOTH,
        stays_open=True,
    ),
)
