"""Far ends: the last year of the calendar, a year of absence, a robot that moves or forgets (D15)."""

from __future__ import annotations

from dataclasses import replace

from tests.services.story import *
from tests.support.edits import import_file
from tests.support.effort import calls_of_this_thread
from tests.support.site import PASSWORD

LONGEST_TRANSACTION = 100_000  # calls of functions: about 50 ms of a tablet's processor
UNTIL = ("DAILY;UNTIL=99991231", "MINUTELY;INTERVAL=30;UNTIL=99991231T235959", "WEEKLY;UNTIL=99991231T235959Z")
FORGETS = do(lambda s: setattr(s.network, "forgets_descriptions", True))
ONE_OF_TWO = do(lambda s: s.container.catalogue.remove_robot(2))  # a second machine is on the network
RUNS = [ONE_OF_TWO, plan(), 320, items("Executing")]


def import_for_ever(s):
    values = {"name": "A", "robot": "R1", "mission": "Deliver", "start": "2026-11-23T06:05", "timezone": "UTC"}
    import_file(s.container.catalogue, schedules=[{**values, "recurrence": "FREQ=DAILY;UNTIL=99991231"}])


@step
def is_now(s, address="http://r1", machine="R1"):
    """A person enters the address, and accepts that machine as the robot."""
    known = s.robot("R1")
    serial_number = s.machines[machine].serial_number if machine else known.serial_number
    s.container.catalogue.save_robot(replace(known, address=address, serial_number=serial_number), PASSWORD)


UNKNOWN_AS_MOVED = [ends(UNKNOWN), true(lambda s: "address" in str(dict(s.row().reason.details)))]

test_extremes = cases_of(
    Story(
        "until the end of the calendar is for ever",
        each(*(plan(rule=f"FREQ={rule}") for rule in UNTIL), do(import_for_ever)),
        [600, true(lambda s: s.executions()[0].state is COMPLETED)],
        stays_open=True,
    ),
    Story(
        "a robot at a new address continues",
        [
            RUNS,
            do(lambda s: s.machines.update(R7=s.machines["R1"])),
            is_now("http://r7", None),
            off_for(),
            300,
            ends(DONE),
        ],
        robots=2,
        doubles=True,  # one machine at two addresses
        mark=OWN_ADDRESS,
    ),
    Story(
        "another machine at the address leaves the outcome unknown and says why",
        RUNS,
        each([is_now("http://r1", "R2"), is_now("http://r2", None)], is_now("http://r2", None)),
        [off_for(), 300, UNKNOWN_AS_MOVED, true(lambda s: len(s.queue("R2")) == 0)],
        robots=2,
        mark=OWN_ADDRESS,
    ),
    Story(
        "a start that may be on one machine is not sent to its replacement",
        [ONE_OF_TWO, stranger(robot="R2", count=3), plan()],
        each(post(LOST), post(ANSWER_LOST)),
        300.6,
        each(
            is_now("http://r2", "R2"),
            [do(lambda s: s.machines.update(R1=s.machines["R2"])), is_now("http://r1", "R2"), off_for()],
        ),
        [300, ends(UNKNOWN), tries(1), raised("unknown_outcome")],
        true(lambda s: len(s.queue("R2")) == 3),
        robots=2,
        mark=OWN_ADDRESS,
    ),
    Story(
        "the first lost answer of a robot that drops descriptions is reported and not sent again",
        [FORGETS, plan()],
        each(post(ANSWER_LOST), post(LATE), post(ERROR_AFTER)),
        [900, sent(300), items("Done"), ends(DONE), tries(1), true(lambda s: s.alarms())],
        mark=DESCRIBED,
    ),
    Story("a lost request to such a robot is sent again", [FORGETS, plan(), post(LOST), 900, ends(DONE), tries(2)]),
)


@pytest.mark.long
def test_a_long_absence_is_written_in_short_transactions(s, monkeypatch):
    """While many schedules find out what they missed in a year, others that want to write wait for 50 ms at most."""
    play(s, set_up(history_limit=None, poll_interval_seconds=3600))
    play(
        s,
        [plan(f"S{number}", rule="FREQ=MINUTELY", workdays=False) for number in range(60)],
        60,
        app_off(cleanly=False),
    )
    s.clock.advance(365 * DAY)
    play(s, app_on())
    lasted, write = [], s.container.db.write

    def counted(work, *values, **named):
        with calls_of_this_thread() as calls:
            result = write(work, *values, **named)
        lasted.append(calls.number)
        return result

    monkeypatch.setattr(s.container.db, "write", counted)
    s.run(60.0)
    assert sum(row.starts > 525_000 for row in s.executions()) == 60
    assert max(lasted) < LONGEST_TRANSACTION
