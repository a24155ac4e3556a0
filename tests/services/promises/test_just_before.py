"""In the moment before its instant a start is on the disk and with its robot's worker: changes in that moment count,
and an obstacle prevents early writing."""

from __future__ import annotations

from app.services.dispatch.timing import LONGEST_WAIT, RECHECK
from tests.services.story import *

DUE, EARLIER = 300.0, 0.05  # s: the instant, and how long before it the start is in its worker's hand
IN_HAND = [plan(battery=20), DUE - EARLIER, states(SUBMITTING)]
MOMENT = do(lambda s: s.clock.advance(0.01))

PRESSED = "7c9e6679-7425-40de-944b-e07fc1f90ae7"  # the token of a press


def at_five_past(number):
    """So many rows are of that instant."""
    return true(lambda s: len([row for row in s.executions() if row.planned_at.minute == 5]) == number)


def as_a_chore(act):
    """It happens on the scheduler's own thread."""
    return do(lambda s: s.engine.add_chore("a chore", lambda: act(s)))


@step
def run_now_as(s, token):
    s.container.operator.run_now(1, s.mission().id, token=token)


test_in_hand = cases_of(
    Story(
        "a withdrawn start is not sent, and says so",
        [IN_HAND, MOMENT],
        each(
            [off(), 1, tries(0), 600, ends(CHANGED)],
            [delete(), 600, ends(CHANGED)],
            [edit(at="07:00"), 600, ends(CHANGED)],
            [pause(60), 600, ends(PAUSED)],
            [cancel(), 600, ends(CANCELLED)],
            [robot_off(), 600, ends(REMOVED)],
            [delete("robot"), 600, ends(REMOVED)],
        ),
        runs(0),
    ),
    Story("a hold stops it", [IN_HAND, hold(), 10, waits(HOLD), tries(0), runs(0)], stays_open=True),
    Story(
        "another schedule that is changed stops nothing",
        [IN_HAND, plan("another", "09:00"), 0.1, runs(1), 200],
    ),
    Story(
        "a clock that is set delays only until it is judged, and doubles nothing",
        [POLLED_OFTEN, IN_HAND],
        each(
            *(
                [
                    do(lambda s, by=by: s.clock.step(by)),
                    EARLIER + LONGEST_WAIT + RECHECK,
                    set_up(poll_interval_seconds=600),
                    max(0.0, -by),
                ]
                for by in (-3600.0, 40.0, -DAY)
            ),
        ),
        [runs(1), 7200, runs(1), ends(DONE)],
    ),
    Story(
        "it is not sent early if the clock is set back while its robot is slow to answer",
        [plan(window=20), DUE - 50, app_off(), 60, meets("GET", "/status", SLOW, 8.35, 4), app_on()],
        [later(24.5, do(lambda s: s.clock.step(-100))), 80, runs(0), sent(), 20, sent(400), 200],
        on=("robot", "group"),
    ),
    Story(
        "a power cut loses nothing and doubles nothing",
        [
            IN_HAND,
            app_off(cleanly=False),
            app_on(),
            45,
            runs(0),
            255,
            runs(1),
            tries(2),
            ends(DONE),
        ],  # it may be being sent
    ),
    Story(
        "those due together go in their order",
        [plan("late"), plan("early"), plan("first", priority=5), DUE - EARLIER, states(*[SUBMITTING] * 3), 2 * EARLIER],
        true(
            lambda s: (
                [item.description for item in s.items()] == [s.row(name).token for name in ("first", "early", "late")]
            )
        ),
        900,
    ),
    Story(
        "if the first of several fails the others wait for a reading of the robot",
        [plan("A"), plan("B"), plan("C"), DUE - EARLIER, states(*[SUBMITTING] * 3)],
        each(
            [down(), 0.1, states(WAITING, WAITING, WAITING)],
            [post(ANSWER_LOST), down(), 0.1, states(SUBMITTING, WAITING, WAITING)],
        ),
        [tries(1, 1, 1), up(), 900, ends(DONE, DONE, DONE), runs(3)],
    ),
    Story(
        "withdrawn by a chore it is not sent",
        plan(),
        as_a_chore(lambda s: s.executions(SUBMITTING) and play(s, off())),
        [DUE + 5, runs(0), ends(CHANGED)],
    ),
    Story(
        "a start made by a chore is sent at once",
        [
            20,
            as_a_chore(lambda s: play(s, run_now_as(PRESSED))),
            do(lambda s: s.engine.advance()),
            0.1,
        ],
        [true(lambda s: [item.description for item in s.items()] == [PRESSED]), 200],
    ),
)

DAILY = plan(rule="FREQ=DAILY", battery=0)

test_not_written_early = cases_of(
    Story(
        "a start with an obstacle",
        each(
            [DAILY, pause(65), DUE - EARLIER],
            [DAILY, hold(), DUE - EARLIER],
            [plan(rule="FREQ=DAILY", battery=50), battery(20), DUE - EARLIER],
            [DAILY, DUE - 5, meets("GET", "/status", REFUSED), 5 - EARLIER],
            [battery(20), plan("B", "06:04", battery=50), DAILY, DUE - EARLIER],
            [plan(at="06:04", every=1), 241, robot_pauses(), 59 - EARLIER],
            [DAILY, robot_off(), DUE - EARLIER],
        ),
        [at_five_past(0), 2 * EARLIER, at_five_past(1), true(lambda s: not s.executions(SUBMITTING))],
        stays_open=True,
    ),
)
