"""Faults without another test: rows of the fault matrix in docs/reliability.md."""

from __future__ import annotations

from mir_sim.mission_queue import MissionQueue
from tests.services.story import *

FORGETS = do(lambda s: setattr(s.network, "forgets_descriptions", True))
BEGINS_AGAIN = do(lambda s: setattr(s.machines["R1"], "queue", MissionQueue()))


def put_there(description=""):
    """The mission of the start is put on R1 by the app's own user, but not by the app; its number is noted."""
    return do(lambda s: s.noted.append(s.stranger_queues(description=description, user="distributor")))


def in_between(act):
    """It happens as the robot is read for a start that waits already."""

    def met(s, where):
        if where == "after GET /status" and s.executions(WAITING):
            s.network.interrupt = lambda where: None
            play(s, act)

    return do(lambda s: setattr(s.network, "interrupt", lambda where: met(s, where)))


test_copies_and_others = cases_of(
    Story(
        "a copy that runs already is left alone, and a person decides",
        [POLLED_OFTEN, plan(), until(lambda s: s.executions(COMPLETED))],
        [do(lambda s: play(s, put_there(s.row().token))), 35, items("Done", "Executing")],
        true(lambda s: s.alarms() == ["duplicate_running"]),
        doubles=True,
        mark=NUMBERED,
    ),
    Story(
        "the same mission put there by somebody else is not taken for ours, even while ours is unknown",
        [plan("first", "06:02"), plan(), 295, states(COMPLETED), post(LOST), 11],
        each(put_there(), put_there("7c9e6679-7425-40de-944b-e07fc1f90ae7"), put_there("Kuljeta")),
        [900, states(COMPLETED, COMPLETED), runs(3)],
        true(lambda s: s.noted[-1] not in [row.queue_id for row in s.executions()]),
    ),
    Story(
        "while it is not known whether tokens come back, what may be ours is taken for it",
        [FORGETS, plan(), post(LOST), 306, put_there(), 900, ends(DONE)],
        true(lambda s: (s.row().queue_id, s.alarms()) == (s.noted[-1], ["adopted_unproven"])),
        mark=OWN_WORDS,
    ),
    Story(
        "where the last item can't be read it is known from before that descriptions are forgotten",
        [FORGETS, plan(), plan("B", "06:15"), 600],
        each(
            do(lambda s: s.network.unreadable.add(("R1", 1))),
            do(lambda s: s.network.shown.update({("R1", 1): {"state": None}})),
        ),
        [post(ANSWER_LOST), 600, ends(DONE, DONE), runs(2)],
    ),
    Story(
        "a robot that forgets descriptions is judged by mission, user and number",
        [FORGETS, plan(at="06:02", every=5), 200],
        each(
            *([post(fate), 780, tries(1, 1, 1)] for fate in (ANSWER_LOST, LATE, ERROR_AFTER)),
            *([post(fate), 780, tries(1, 2, 1)] for fate in (LOST, ERROR_BEFORE)),
        ),
        [ends(DONE, DONE, DONE), runs(3)],
    ),
    Story(
        "a forgetful robot is known after a restart too",
        [FORGETS, plan(at="06:02", every=5), 200, post(ANSWER_LOST), until(lambda s: s.executions(SUBMITTING))],
        [app_off(cleanly=False), app_on(), 200, runs(2), tries(1, 1)],
    ),
)

test_robots_that_begin_again = cases_of(
    Story(
        "queue numbers that start again are an unknown outcome, and nothing is sent instead",
        [stranger(count=3), clear_queue(), plan(), post(ANSWER_LOST), until(lambda s: len(s.all_items()) == 4, 310)],
        [BEGINS_AGAIN, 200, ends(UNKNOWN), tries(1), raised("unknown_outcome"), runs(0)],
        mark=OWN_QUEUE,
    ),
    Story(
        "idle automation goes on when queue numbers start again",
        [stranger(count=5), clear_queue(), rest("Deliver"), 1200, ends(DONE), true(lambda s: s.row().queue_id == 6)],
        [BEGINS_AGAIN, 1200, ends(DONE, DONE), true(lambda s: s.row().queue_id == 1)],
        mark=OWN_QUEUE,
    ),
    Story(
        "a robot that reboots in the middle gets nothing twice",
        [plan(), until(lambda s: s.executions(EXECUTING)), do(lambda s: s.machines["R1"].reboot(40.0)), 1200, runs(1)],
    ),
)

test_withdrawn = cases_of(
    Story(
        "between falling due and the POST it is not sent",
        [plan(battery=20), 295, meets("GET", "/status", REFUSED)],  # it could not be read ahead
        each(*(in_between(act) for act in (off(), delete(), cancel(), delete("robot")))),
        [300, states(State.CANCELLED), tries(0), runs(0)],
    ),
)
