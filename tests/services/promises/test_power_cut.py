"""With a window, everything that would start late after an absence is listed with its Hold button first (D10)."""

from __future__ import annotations

from tests.services.story import *

OFF = 300.0
LISTED = 28.0  # s of the 30 in which the list is shown
PLANNED = plan(battery=30)
BATTERY_LOW = [battery(12), 310, battery(80)]
NEXT_TRY = [down(), 310, up()]
HELD = [do(lambda s: s.container.holds.hold("meeting", until=instant("06:08").replace(tzinfo=UTC))), 310]
BY_HAND = [down(), run_now(), 100, up()]
WAITS = (BATTERY_LOW, NEXT_TRY, HELD, BY_HAND)

test_listed = cases_of(
    Story(
        "a start that waited for any reason is listed for half a minute, and then starts once",
        PLANNED,
        each(*WAITS, 200),
        [do(lambda s: s.noted.append(len(s.executions()) or 1))],
        each(app_off(), app_off(cleanly=False)),
        [do(lambda s: s.clock.advance(OFF)), app_on(), LISTED, sent()],
        true(
            lambda s: (
                [row.wait for row in s.executions()[: s.noted[0]] if row.state is WAITING]
                == [Wait.LATE_START] * s.noted[0]
            )
        ),
        [300, true(lambda s: {row.state for row in s.executions()[: s.noted[0]]} == {COMPLETED})],
        true(lambda s: len(s.all_items()) == len(s.executions())),
        with_window=True,
        stays_open=True,
    ),
    Story(
        "the very first run may end before its first heartbeat",
        [PLANNED, off_for(OFF + 60), LISTED, sent(), 60, runs(1), 200],
        with_window=True,
    ),
    Story(
        "a hold that is set on the list keeps it from starting",
        PLANNED,
        each(*WAITS),
        [off_for(OFF), 10, hold(), 300, sent()],
        with_window=True,
        stays_open=True,
    ),
    Story("without a window it starts at once", PLANNED, each(BATTERY_LOW, NEXT_TRY), [off_for(OFF), 200, ends(DONE)]),
    Story(
        "a restart of ten seconds lists nothing",
        PLANNED,
        each(BATTERY_LOW, NEXT_TRY),
        [off_for(10), LISTED, true(lambda s: len(sent_at(s)) == 1), 200],
        with_window=True,
    ),
    Story(
        "a sleep of the tablet is an absence too",
        [PLANNED, BATTERY_LOW, asleep(OFF), LISTED, sent(), 300, ends(DONE), tries(1)],
        with_window=True,
    ),
    Story(
        "a start that may be on the robot is not sent late without the list either",
        [PLANNED, post(LOST), 301, off_for(OFF), LISTED, true(lambda s: len(sent_at(s)) == 1), 200],
        with_window=True,
    ),
)
