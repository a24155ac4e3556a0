"""A clock that was ahead is corrected, by little or much, once or in steps: each start is sent once, at its instant,
despite people's actions, and starts that they held, skipped or cancelled stay so until they decide otherwise (D4,
D5)."""

from __future__ import annotations

from app.domain.models import InvalidInput, Overlap
from app.screens.scheduler.facts import SchedulerServices, Window, read
from tests.services.story import *
from tests.support.edits import skip_next

BOTH = ("robot", "group")
LIMITS = each(set_up(history_limit=None), set_up(history_limit=1))
FAR, HOURS = 2 * DAY + 900.0, 7800.0
OFTEN = [set_up(poll_interval_seconds=600), plan(at="06:10", every=30, window=20, workdays=False)]
QUICK = plan(every=5, window=60, workdays=False)
OFF_AND_ON = [off(), 20, on(), 20]
CHANGES = (
    [],
    OFF_AND_ON,
    [robot_off(), 20, robot_on(), 20],
    [pause(55), 20, resume()],
    [edit(at="06:11"), 20, edit(at="06:10")],
    [delete(), undo()],
    [app_off(), app_on()],
    [clock(-900, 900), 5],
    [clock(900, -900), 5],
)
PUT_BY_HAND = {"at": "06:10", "rule": "FREQ=DAILY", "window": 60, "workdays": False}


def ahead(seconds):
    """The app starts with a clock that is ahead, and no robot can contradict it."""
    return [10, app_off(), clock(seconds), down(), app_on(), 45]


def right(seconds):
    return [up(), clock(-seconds), 60]


def all_leave(seconds=7200):
    """Each of ``OFTEN``, from now on."""

    def leave(s):
        begun = s.seconds()
        s.run(seconds)
        wanted = [at for at in range(600, int(begun + seconds), 1800) if at > begun]
        found = [at for at in sent_at(s) if at > begun]
        assert found == wanted, f"{found} and not {wanted}"

    return do(leave)


def started(s) -> set[int]:
    """Minutes of the instants for which robots have a start."""
    return {row.planned_at.minute for row in s.executions() if row.queue_id}


@step
def is_offered_after_all(s):
    """Its card on the timeline says "Start it after all"."""
    services = SchedulerServices(
        **{name: getattr(s.container, name) for name in SchedulerServices.__dataclass_fields__}
    )
    facts, now = read(services, Window()), s.clock.now()
    assert [facts.may_start_after_all(each, now) for each in facts.past if each.id == s.noted[-1].id] == [True]


test_corrected_clock = cases_of(
    Story(
        "each start is sent despite any change after it",
        OFTEN,
        each([ahead(FAR), right(FAR)], [ahead(HOURS), right(HOURS)]),
        200,
        each(
            *CHANGES[:5],
            [edit(rule="FREQ=MINUTELY;INTERVAL=7"), 20, edit(every=30)],
        ),
        all_leave(3 * 3600),
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "what falls due while the clock is a year behind is sent when it is right",
        plan(rule="FREQ=DAILY", window=60, workdays=False),
        200,
        each(*([clock(-days * DAY), 400, clock(days * DAY)] for days in (300, 400))),
        300,
        [items("Done"), ends(DONE), true(lambda s: sent_at(s)[0] < 605)],
    ),
    Story(
        "each start is sent after an undo",
        [OFTEN, ahead(FAR), delete(), right(FAR), undo(), all_leave()],
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "only the start that a person cancelled is missing",
        LIMITS,
        [OFTEN, ahead(HOURS), cancel(), right(HOURS), 4 * 3600],
        [left_out(), true(lambda s: len(sent_at(s)) == s.seconds() // 1800 - 1 and s.schedule().next_at)],
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "runs that must not overlap do not, though the later of two was planned first",
        [plan(every=10, overlap=Overlap.SKIP, window=20), 10, hold("R1"), clock(900), 20, clock(-900), 5, release()],
        [later(266, robot_pauses()), 1400, raised("execution_skipped")],
        true(lambda s: len([item for item in s.all_items() if str(item.state) in ("Pending", "Executing")]) == 1),
        stays_open=True,
    ),
    Story(
        "nothing is sent twice if another start waited behind the sent one",
        LIMITS,
        [set_up(poll_interval_seconds=300, retry_limit=10)],
        [plan(at="06:10", every=2, overlap=Overlap.PARALLEL, window=20), 10, clock(570), 15],
        [post(REFUSED, count=6), 128, clock(-570), 10],
        each([], OFF_AND_ON),
        720,
        on="group",
        stays_open=True,
    ),
    Story(
        "nothing is sent twice if a later one was refused",
        LIMITS,
        [set_up(retry_limit=20, poll_interval_seconds=300)],
        [plan(at="06:10", every=5, window=30, overlap=Overlap.QUEUE), 10, plan("B", "06:12", rule="FREQ=DAILY")],
        [clock(560), 260, post(REFUSED, count=4), 85, clock(-590), 3],
        each(OFF_AND_ON, [edit(rule="FREQ=MINUTELY;INTERVAL=7"), 20, edit(every=5)]),
        400,
        stays_open=True,
    ),
    Story(
        "tries by the wrong clock do not count",
        [OFTEN, set_up(retry_limit=3), ahead(HOURS), right(HOURS)],
        do(
            lambda s: (
                s.at(7799 - s.seconds(), lambda: play(s, down())),
                s.at(7806 - s.seconds(), lambda: play(s, up())),
            )
        ),
        [9000, true(lambda s: {row.state for row in s.executions()} == {COMPLETED})],
        on=BOTH,
    ),
    Story(
        "future starts keep no robot from its group",
        [set_up(poll_interval_seconds=600), plan("own", on=1, **PUT_BY_HAND | {"window": 20}), ahead(FAR), right(FAR)],
        [plan("G", "06:20", workdays=False), 3600, sent(600, 1200)],
        on="group",
    ),
    Story(
        "steps double nothing and lose nothing",
        LIMITS,
        [plan(at="06:10", every=10, window=9, workdays=False), 1000],
        each(
            *(clock(*steps) for steps in ((-30, -30), (300, -300, 300, -300), (-400, 3000, -2600))),
            [[clock(step), 1, app_off(), app_on(), 5] for step in (1200, -1200, 1200, -1200)],
            [[clock(step), 1, app_off(), app_on(), 5] for step in (-400, 3000, -2600)],
            *(clock(*steps) for steps in ((-300, 300), (1200, -1200, 1200, -1200), (-3, -3, -3))),
        ),
        [3005, true(lambda s: len(s.items()) >= 4)],
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "idle missions continue after a step back",
        [rest("Deliver"), 280, clock(-3600), 1800, true(lambda s: len(sent_at(s)) == 1)],
    ),
)

test_run_now = cases_of(
    Story(
        "it outlives a clock that was behind for a moment",
        [10, hold(), run_now(), 5],
        each(
            *([clock(-3600 * hours), 20, clock(3600 * hours), 60] for hours in (0.5, 2, 26)),
            *([clock(*steps), 5] for steps in ((-7200, 3600, 3600), (-300, -300, 600), (-DAY, DAY, -DAY, DAY))),
            [[clock(step), 5, app_off(cleanly=False), app_on(), 5] for step in (-7200, 3600, 3600)],
        ),
        [release(), 120, runs(1)],
        on=BOTH,
    ),
    Story(
        "a start in doubt outlives it too", [10, post(LOST), run_now(), 5, clock(-7200), 20, clock(7200), 300, runs(1)]
    ),
    Story(
        "it starts once the clock is right again",
        10,
        each(*([ahead(by), run_now(), 20, clock(-by), up()] for by in (600, 7200, DAY))),
        [60, runs(1), 200],
        on=BOTH,
        robots=3,
    ),
    Story(
        "it is not lost between two steps of one correction",
        [10, app_off(), clock(DAY + 1200), app_on(), 60, true(lambda s: s.container.holds.active().clock), clock(-DAY)],
        each([2, run_now(), 2], [20, run_now(), 20]),
        [clock(-1200), 120, runs(1)],
    ),
    Story(
        "it gets no second window from a clock that is set back",
        each(
            [10, hold(), run_now(), 13 * 60, clock(-7200), 10 * 60],
            [post(LOST), run_now(), 2, down(), 5, clock(-7200), 120, app_off(cleanly=False), app_on(), 32 * 60],
            [set_up(poll_interval_seconds=600), ahead(FAR), hold(), run_now(), 5, right(FAR), 2 * 3600],
            [hold(), run_now(), 5, clock(-300), 120, app_off(cleanly=False), app_on(), 32 * 60],
            *([hold(), run_now(), 5, clock(-back), 120, 32 * 60] for back in (300, 7200)),
            *([post(LOST), run_now(), 2, down(), 5, clock(-back), 120, 32 * 60] for back in (300, 7200)),
        ),
        [up(), release(), 200, runs(0)],
        on=BOTH,
        robots=3,
        stays_open=True,  # where the clock is in doubt
    ),
)

test_skipped = cases_of(
    Story(
        "a skip is undone",
        LIMITS,
        [plan(at="06:10", every=30, window=20, workdays=False), 10, skip(), 30],
        each(*CHANGES),
        [30, unskip(), 700, sent(600)],
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "a skip stays",
        LIMITS,
        [plan(every=5, window=20, workdays=False), 10, skip("06:05"), 30],
        each(
            *CHANGES[:-1],
        ),
        [700, left_out()],
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "a skip passed over by a clock ahead stays",
        LIMITS,
        [plan(every=5, window=20, workdays=False), 310, skip("06:10"), 5, clock(595), 20, clock(-595), 20],
        each(
            *CHANGES[:-2],
        ),
        [900, left_out(), true(lambda s: len(s.items()) >= 3)],
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "it stays when a later start is withdrawn",
        LIMITS,
        [set_up(retry_limit=20, poll_interval_seconds=300), plan(every=5, window=30, overlap=Overlap.QUEUE)],
        [plan("B", "06:40", rule="FREQ=DAILY"), 10, skip("06:10"), do(lambda s: skip_next(s.container, 2))],
        [clock(560), post(REFUSED, count=16), 345, clock(-590), 3, OFF_AND_ON],
        true(lambda s: s.noted[0] not in [run.at for run in s.container.plan.next(3)]),
        [400, left_out()],
        stays_open=True,
    ),
)

test_cancelled = cases_of(
    Story(
        "a skipped start runs when a person starts it",
        LIMITS,
        [OFTEN, ahead(HOURS), cancel(), right(HOURS), 100, is_offered_after_all(), unskip(), all_leave(4 * 3600)],
        on=BOTH,
        stays_open=True,
    ),
    Story(
        "no start is lost by its undo, which waits two days ahead",
        [OFTEN, ahead(FAR), cancel(), right(FAR), want_again(), 100],
        each([], OFF_AND_ON),
        all_leave(),
        on="group",
        stays_open=True,
    ),
    Story(
        "an undo survives a correction",
        [plan(**PUT_BY_HAND), 10, hold("R1"), 600, cancel(), want_again(), release(), clock(-120), 400, runs(1)],
    ),
    Story(
        "its undo passes over no start that is due just then",
        each(
            [plan(at="06:10", every=1, window=60, workdays=False), 10, hold("R1"), 610, cancel(), clock(-120), 10],
            [
                [plan(at="06:10", every=1, window=60, workdays=False), 10, hold("R1"), 610, cancel(), clock(-120)],
                [app_off(), app_on(), 10],
            ],
        ),
        [want_again(), release(), 400, left_out(False)],
        stays_open=True,
    ),
    Story(
        "nor with a quarter of an hour between",
        [QUICK, 10, clock(890), hold("R1"), 20, cancel(), clock(-890), 269.5, do(lambda s: s.clock.sleep(1.0))],
        [
            want_again(),
            release(),
            900,
            true(lambda s: {5, 10, 15} <= started(s)),
        ],
        stays_open=True,
    ),
    Story(
        "an undone start does not wait together with a future one",
        [plan(every=10, overlap=Overlap.SKIP, window=20), 10, hold("R1"), clock(900), 20, clock(-900), 285],
        [cancel(-1), want_again(), release(), 60, minutes(5)],
        stays_open=True,
    ),
    Story(
        "a group's start, held and cancelled, never runs",
        LIMITS,
        [plan(at="06:10", every=10, window=30, workdays=False), 10, hold(), 610, keep(), 5, cancel(), release()],
        each(clock(-120, 120, -120), [[clock(by), 3, app_off(cleanly=False), app_on()] for by in (-120, 120, -120)]),
        [2500, left_out(), true(lambda s: len(s.items()) >= 3)],
        on="group",
        robots=2,
        stays_open=True,
    ),
)


def test_a_start_cancelled_by_a_clock_ahead_is_refused_later_or_runs(s):
    """A later start of the right clock has been sent: its undo never says that it runs when it doesn't."""
    play(s, QUICK, 10, clock(590), hold("R1"), 20, cancel(), clock(-590), 20, off(), 5)
    try:
        play(s, want_again())
    except InvalidInput:
        return
    play(s, on(), release(), 900, left_out(False))
