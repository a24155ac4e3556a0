"""The thesis's own test scenarios (section 6.2), end to end under a virtual clock: real services, simulated robot."""

from __future__ import annotations

from datetime import timedelta

from app.domain.execution import ReasonCode, Trigger
from app.domain.reasons import sentence
from mir_sim.mission_queue import ItemState
from tests.services.story import *

CHARGED, KICK = do(lambda s: s.keep_charged()), do(lambda s: s.kick())
RUNS = until(lambda s: s.executions(EXECUTING))
ABORTED = (FAILED, ReasonCode.ROBOT_ABORTED)


def days(name, *wanted):
    """On which its schedule has run."""
    return true(
        lambda s: [f"{row.planned_at:%a}" for row in s.executions(COMPLETED) if row.schedule == name] == list(wanted)
    )


test_started = cases_of(
    Story(
        "by hand a mission is submitted, executed and recorded",
        [run_now(), KICK, 900, ends(DONE), tries(1), robots("R1"), did("Deliver")],
        true(lambda s: (s.row().trigger, s.row().mission) == (Trigger.MANUAL, "Deliver")),
        true(lambda s: s.row().planned_at <= s.row().submitted_at <= s.row().started_at < s.row().ended_at),
        true(lambda s: [(item.id, item.description) for item in s.items()] == [(s.row().queue_id, s.row().token)]),
    ),
    Story(
        "once a mission runs at its time and only then",
        [plan(), 299, states(), 3],
        true(
            lambda s: s.row().submitted_at - s.row().planned_at < timedelta(seconds=1)
        ),  # at once, not at the next poll
        true(lambda s: (s.row().trigger, s.schedule().next_at) == (Trigger.SCHEDULED, None)),
        [2 * 3600, ends(DONE), runs(1)],
    ),
    Story(
        "repeated missions run on each working day, and the next entry follows",
        [CHARGED, set_up(poll_interval_seconds=1800)],  # a week in seconds; dispatch does not wait for polls
        [plan("daily", rule="FREQ=DAILY"), plan("weekly", "07:00", rule="FREQ=WEEKLY;BYDAY=MO,WE"), 8 * DAY],
        [days("daily", "Mon", "Tue", "Wed", "Thu", "Fri", "Mon"), days("weekly", "Mon", "Wed", "Mon"), runs(9)],
        true(lambda s: f"{s.schedule('daily').next_at:%a %H:%M}" == "Tue 06:05"),
        true(lambda s: f"{s.schedule('weekly').next_at:%a %H:%M}" == "Wed 07:00"),
    ),
    Story(
        "by rest its mission is started once after the set time, and again after anything else",
        [rest(), 290, states(), 60, 600, ends(DONE), did("Home"), true(lambda s: s.row().trigger is Trigger.IDLE)],
        [3600, runs(1), run_now(), KICK, 3600, did("Home", "Deliver", "Home")],
    ),
)

test_trouble = cases_of(
    Story(
        "a communication failure is retried until the robot answers",
        [plan(), 290, down(), 30, up(), 900, ends(DONE), runs(1), true(lambda s: s.row().attempts > 1)],
    ),
    Story(
        "the retry limit ends it as failed, and the next start is untouched",
        [CHARGED, set_up(retry_limit=3, poll_interval_seconds=600), plan(rule="FREQ=DAILY"), down(), 420],
        [ends((FAILED, ReasonCode.RETRY_LIMIT)), tries(4), runs(0)],
        true(lambda s: s.row().ended_at - s.row().planned_at < timedelta(minutes=2)),
        [up(), DAY, states(FAILED, COMPLETED)],
    ),
    Story(
        "a mission that fails is recorded with the robot's message",
        do(lambda s: setattr(s.machines["R1"], "fail_next", "Failed to reach goal position 'Dock 3'")),
        [plan(), 900, ends(ABORTED), true(lambda s: "Dock 3" in s.row().reason.details["message"])],
    ),
    Story(
        "what the app called it is not taken for the robot's message, where the robot writes none",
        [plan("SE214 50 %"), RUNS, do(lambda s: s.machines["R1"].controller.end(ItemState.ABORTED, "SE214 50 %")), 60],
        true(lambda s: sentence(s.row().reason, "UTC") == "The robot ended it without saying why"),
    ),
    Story(
        "a scheduled mission is cancelled by hand",
        [plan(), RUNS, cancel(), KICK, 60, ends(CANCELLED), items("Aborted")],
    ),
    Story(
        "a lost answer does not run the mission twice, as the thesis's retry would have",
        [plan(), post(ANSWER_LOST), 600, ends(DONE), runs(1)],
    ),
)
