"""A single start that a person moved runs once, where it was moved to, whatever happens on the way."""

from __future__ import annotations

from app.domain.execution import ReasonCode
from tests.services.story import *

DAILY = plan(at="06:05", rule="FREQ=DAILY")
MOVED_OVER = each([move("06:05", "06:10")], [move("06:05", "06:20"), move("06:20", "06:10")])
PASSED = "the time of this start has passed"


def once_at(second):
    return [runs(1), sent(second)]


test_a_moved_start = cases_of(
    Story(
        "it leaves at its new instant", [DAILY], MOVED_OVER, [900, once_at(600), items("Done")], on=["robot", "group"]
    ),
    Story(
        "it leaves on another robot", [DAILY, move("06:05", "06:10", on=2), 900, once_at(600), robots("R2")], robots=2
    ),
    Story("it is back where it was", [DAILY, move("06:05", "06:10"), move_back(), 900, once_at(300)]),
    Story(
        "where the next one of its schedule starts both run",
        [plan(at="06:05", every=5, overlap="queue"), move("06:05", "06:10"), 660, sent(600, 600)],
        stays_open=True,
    ),
    Story(
        "moved or not, none runs while an earlier one of its schedule is open",
        [plan(at="06:05", every=10, battery=30, window=60), battery(12)],
        each(
            [move("06:15", "06:07"), 450],
            [move("06:15", "06:07", on=2), 450],
            [move("06:05", "06:14"), 930],
            [move("06:05", "06:15"), 910],
        ),
        [true(lambda s: [row.reason and row.reason.code for row in s.executions()] == [None, ReasonCode.OVERLAP])],
        stays_open=True,
        robots=2,
    ),
    Story(
        "of a group it waits for the end of an earlier one of its schedule",
        [plan(at="06:05", every=10, battery=30, window=60, overlap="queue"), battery(12), move("06:15", "06:06"), 400],
        true(lambda s: ["before" in row.wait_details for row in s.executions()] == [False, True]),
        on=["group"],
        stays_open=True,
    ),
    Story(
        "undo when it is due comes too late",
        [DAILY, move("06:05", "06:02"), 120, refused(move_back(), PASSED), 600, once_at(120)],
    ),
    Story(
        "undo when its old time has passed too",
        [DAILY, move("06:05", "06:10"), 310, refused(move_back(), PASSED), 600, once_at(600)],
    ),
    Story(
        "a power cut between both times",
        [DAILY],
        MOVED_OVER,
        each(off_for(30), [280, off_for(60)], [570, off_for(60)]),
        [900, runs(1), items("Done")],
    ),
    Story(
        "in doubt it runs once",
        [DAILY, move("06:05", "06:02", on=2)],
        each(post(LOST), post(LATE, 30.0), post(ANSWER_LOST)),
        [600, runs(1)],
        robots=2,
    ),
    Story(
        "in a hold it waits for its end",
        [DAILY, move("06:05", "06:10"), hold(), 700, waits(HOLD), release(), 300, runs(1)],
    ),
    Story("missed while the app is off it says so", [DAILY, move("06:05", "06:10"), off_for(3600), 60, ends(MISSED)]),
    Story("the clock is set back after it ran", [DAILY, move("06:05", "06:02"), 200, clock(-180), 900, runs(1)]),
    Story(
        "edited, off and deleted while it waits, and undone",
        [
            plan(at="06:05", rule="FREQ=DAILY", battery=30, window=60),
            battery(12),
            move("06:05", "06:02"),
            150,
            waits(BATTERY),
        ],
        each(
            [off(), 5, on()],
            [delete(), 5, undo()],
            [edit(name="B"), edit("B", name="A")],
            [delete("mission"), 5, undo()],
        ),
        [5, battery(80), 600, runs(1)],
    ),
    Story(
        "while it waits its schedule is moved where it has no such start",
        [plan(at="06:05", rule="FREQ=DAILY", battery=30, window=60), battery(12), move("06:05", "06:02"), 150],
        each(edit(at="24T06:06"), off(), delete()),
        [5, battery(80), 900, runs(0), ends(CHANGED)],
    ),
    Story(
        "edited onto its new time it runs once", [DAILY, move("06:05", "06:10"), edit(at="06:10"), 900, once_at(600)]
    ),
)
