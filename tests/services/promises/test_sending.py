"""Constraints, refusals and the ways a request can go wrong: what each start ends as, and what the robot really has."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

from app.domain.models import Connection, DayException, Mission, Overlap
from app.domain.reasons import sentence, waiting_sentence
from app.domain.rules import in_dispatch_order
from app.services.dispatch import messages
from mir_sim import SimulatedRobot, world
from mir_sim.mission_queue import MissionQueue
from tests.services.story import *

LINE_1 = world.BY_NAME["Line 1"].guid
CUT_OFF = [plan(window=5), post(ANSWER_LOST), 306, down("R1")]
REPLACED = do(lambda s: s.network.impostors.update(R1=SimulatedRobot("X", clock=s.seconds, start=s.clock.now())))
BACK = do(lambda s: s.network.impostors.clear())
CANCEL_THERE = do(lambda s: s.container.make_client(s.robot("R1")).cancel(s.row().queue_id))

test_constraints = cases_of(
    Story(
        "a low battery waits and runs when charged",
        [battery(12), plan(battery=30), 310, waits(BATTERY), tries(0), battery(80), 10, runs(1), 200],
    ),
    Story(
        "a battery low all window long is skipped with the numbers",
        [battery(12), plan(battery=30, window=5), 700, ends((State.SKIPPED, ReasonCode.BATTERY_LOW)), runs(0)],
        true(
            lambda s: (
                (s.row().reason.details["minimum"], round(s.row().reason.details["battery"])) in ((30, 11), (30, 12))
            )
        ),
    ),
    Story(
        "an emergency stop hides the battery, so that no minimum is met",
        [do(lambda s: s.machines["R1"].press_emergency_stop(True)), plan(battery=1), 310, waits(BATTERY)],
        stays_open=True,
    ),
    Story(
        "the general minimum holds unless the schedule says none",
        [battery(12), set_up(minimum_battery_percent=30), plan("inherits"), plan("none", battery=0), 310],
        true(lambda s: [row.schedule for row in s.executions(WAITING)] == ["inherits"]),
        stays_open=True,
    ),
    Story(
        "the previous run is still open",
        each(
            *(
                [
                    plan(every=1, overlap=overlap),
                    305,
                    robot_pauses(),
                    60,
                    true(
                        lambda s, end=end: (
                            (s.executions()[1].state, s.executions()[1].reason and s.executions()[1].reason.code) == end
                        )
                    ),
                ]
                for overlap, end in (
                    (Overlap.SKIP, (State.SKIPPED, ReasonCode.OVERLAP)),
                    (Overlap.QUEUE, (QUEUED, None)),
                )
            )
        ),
        true(lambda s: s.executions()[0].state.is_open),
        stays_open=True,
    ),
    Story(
        "a busy robot gets it in its own queue",
        READ_OFTEN,
        [
            plan(),
            298,
            run_now(),
            do(lambda s: s.kick()),
            4,
            states(EXECUTING, QUEUED),
            items("Executing", "Pending"),
            300,
        ],
    ),
    Story(
        "the more important one goes first among those due together",
        [plan("a"), plan("b", priority=5), 305],
        [true(lambda s: [item.priority for item in s.items()] == [s.priority(5), 0])],
        [true(lambda s: [item.id for item in s.items()] == [s.row("b").queue_id, s.row("a").queue_id]), 300],
    ),
    Story(
        "what waits for a silent robot goes in the order in which it was wanted, whatever was tried last",
        [down(), run_now(), 7, plan("b", at="06:00:10"), 20, run_now(), 11, up(), 90],
        true(
            lambda s: (
                [item.description for item in s.items()] == [row.token for row in in_dispatch_order(s.executions())]
            )
        ),
        300,
    ),
    Story(
        "what waits for a silent robot goes as soon as a poll finds that it answers",
        [set_up(poll_interval_seconds=300), plan(window=30), down(), 560, up()],
        until(lambda s: s.container.snapshots.get(1).connection is Connection.CONNECTED),
        [2, runs(1), 200],
    ),
    Story(
        "parameters travel by input name",
        do(lambda s: s.container.operator.run_now(1, s.add_mission("Go to position").id, {"Position": LINE_1})),
        [do(lambda s: s.kick()), 5],
        true(lambda s: [(p["input_name"], p["value"]) for p in s.items()[0].parameters] == [("Position", LINE_1)]),
        300,
    ),
    Story(
        "a start held until the window closes is skipped",
        [hold(), plan(window=5), 310, waits(HOLD), 300, ends(PAUSED), runs(0)],
    ),
    Story(
        "the end of a hold releases it",
        do(lambda s: s.container.holds.hold("meeting", until=BEGIN + timedelta(minutes=10))),
        [plan(), 590, runs(0), 20, runs(1), 200],
    ),
)

test_refused = cases_of(
    Story(
        "the robot does not have the mission",
        do(lambda s: s.container.catalogue.save_mission(Mission("Gone", "00000000-0000-0000-0000-000000000000"))),
        [do(lambda s: s.container.operator.run_now(1, 2)), do(lambda s: s.kick()), 5],
        [ends((FAILED, ReasonCode.UNKNOWN_MISSION)), tries(1)],
    ),
    Story(
        "a wrong password",
        do(lambda s: s.container.catalogue.save_robot(s.robot("R1"), password="changed on the robot")),
        [app_off(), app_on(), plan(), 305, ends((FAILED, ReasonCode.UNAUTHORIZED))],
        true(lambda s: s.alarms().count("unauthorized") == 1),
        mark=OWN_ADDRESS,
    ),
    Story(
        "another machine at the address gets nothing",
        [60, do(lambda s: setattr(s.machines["R1"], "serial_number", "somebody else")), plan(), 400, runs(0)],
        [ends((FAILED, ReasonCode.WRONG_ROBOT)), raised("wrong_robot")],
        true(lambda s: s.row().reason.details["found"] == "somebody else"),
    ),
    Story(
        "what another machine takes at the last moment is not a person's item with the same number on the robot",
        [stranger(count=2), plan(), 299.9, REPLACED, 10, true(lambda s: s.row().queue_id == 1), BACK, 120],
        [items("Done", "Done"), ends((FAILED, ReasonCode.VANISHED)), tries(1)],
        mark=OWN_ADDRESS,
    ),
    Story(
        "a retry limit of zero means no second try",
        [set_up(retry_limit=0), plan(), down(), 330, ends((FAILED, ReasonCode.RETRY_LIMIT)), tries(1)],
    ),
    Story(
        "the window ends the tries too",
        [plan(window=1), down(), 400, ends((FAILED, ReasonCode.WINDOW_CLOSED))],
        true(lambda s: s.row().ended_at - s.row().planned_at < timedelta(seconds=80)),
    ),
)

UNKNOWN_FATES = (LOST, ANSWER_LOST, LATE, ERROR_BEFORE, ERROR_AFTER, Fate.PAGE, Fate.CUT)

test_unknown = cases_of(
    Story(
        "it ends as exactly one item",
        plan(),
        each(*([post(fate), 900, tries(2 if fate in (LOST, ERROR_BEFORE) else 1)] for fate in UNKNOWN_FATES)),
        [ends(DONE), runs(1), true(lambda s: s.items()[0].id == s.row().queue_id)],
    ),
    Story(
        "the tablet dies during it",
        plan(),
        each(*(post(fate) for fate in UNKNOWN_FATES)),
        [306, off_for(20), 900, ends(DONE), runs(1)],
    ),
    Story(
        "cancelled in doubt it is never sent again", [plan(), post(LOST), 306, cancel(), 600, ends(CANCELLED), runs(0)]
    ),
    Story(
        "a copy that arrives after all is cancelled and reported",
        [plan(), post(LOST), 306, robot_pauses(), 120],
        do(lambda s: s.container.make_client(s.robot("R1")).enqueue(s.row().mission_guid, description=s.row().token)),
        [60, items("Pending", "Aborted"), raised("duplicate_healed")],
        stays_open=True,
        mark=NUMBERED,
    ),
    Story(
        "an item missing on the robot has vanished",
        [plan(), 306, do(lambda s: setattr(s.machines["R1"], "queue", MissionQueue())), 60],
        ends((FAILED, ReasonCode.VANISHED)),
        mark=OWN_QUEUE,
    ),
    Story(
        "the robot stays silent until the window is over",
        [plan(window=5), post(LOST), 306, down(), 600, ends(UNKNOWN), not_raised("execution_failed")],
        true(lambda s: s.alarms().count("unknown_outcome") == 1),
    ),
    Story(
        "once it is known no alarm asks about it",
        [POLLED_OFTEN, CUT_OFF],
        each(
            [],
            do(
                lambda s: s.container.alarms.raise_(
                    "unknown_outcome", "execution:99", robot="R1", mission="Home", problem="none"
                )
            ),
        ),
        [600, raised("unknown_outcome"), up(), 60, ends(DONE)],
        true(
            lambda s: (
                {a.key for a in s.container.alarms.open() if a.code in ("unknown_outcome", "execution_failed")}
                <= {"execution:99"}
            )
        ),
    ),
    Story(
        "an item found late counts as sent with its request",
        [POLLED_OFTEN, plan(window=60), post(ANSWER_LOST), 306, down(), 600, up(), 60, ends(DONE)],
        true(lambda s: 0 <= (s.row().submitted_at - s.row().planned_at).total_seconds() < 40),
    ),
    Story(
        "the alarm of a disproved failure ends",
        [set_up(retry_limit=1, unknown_outcome_quiet_seconds=5), plan(), post(LATE, 60), post(REFUSED), 340],
        [ends((FAILED, ReasonCode.RETRY_LIMIT)), raised("execution_failed"), 120, ends(DONE), not_raised()],
    ),
)

WHY = "the robot answered: Position mirconst-guid not found (status 500)"
SAYS_WHY = [plan(), post(Fate.SAYS_WHY), until(lambda s: s.executions(SUBMITTING) and s.network.posts()), 5]
REFUSED_SO = true(lambda s: sentence(s.row().reason, "UTC") == f"It was refused: {WHY}")
SENT_ONCE = true(lambda s: len(s.network.posts()) == 1)

test_answered_why = cases_of(
    Story(
        "it is shown while it is looked for, and then refused and not sent again",
        [SAYS_WHY, true(lambda s: waiting_sentence(s.row()) == f"Asking whether it has arrived: {WHY}")],
        each([95], [off_for(1), 190]),
        [ends((FAILED, ReasonCode.REFUSED)), REFUSED_SO, 900, SENT_ONCE],
    ),
    Story("cancelled it ends as cancelled", [SAYS_WHY, cancel(), 95, ends(CANCELLED)]),
    Story(
        "a robot with a general error is tried again",
        [plan(window=2), post(ERROR_BEFORE, count=2), 900, states(FAILED), true(lambda s: len(s.network.posts()) == 2)],
        true(lambda s: "the robot answered: Internal server error (status 500)" in sentence(s.row().reason, "UTC")),
    ),
    Story(
        "of a group another robot gets it",
        [plan(), post(Fate.SAYS_WHY), 1200, ends(DONE)],
        true(
            lambda s: (
                [(t["code"], t["robot"] != s.row().robot) for t in s.row().tried.values() if t.get("is_for_good")]
                == [("refused", True)]
            )
        ),
        on="group",
        robots=3,
    ),
)

test_followed = cases_of(
    Story(
        "an unreachable robot leaves running starts open",
        [plan(), until(lambda s: s.executions(EXECUTING)), down(), 4 * 3600, states(EXECUTING), up(), 60, ends(DONE)],
    ),
    Story(
        "Clear queue cancels running, queued and waiting starts",
        [
            plan(),
            plan("B"),
            plan("C", battery=99),
            310,
            clear_queue(),
            do(lambda s: s.kick()),
            30,
            ends(CLEARED, CLEARED, CLEARED),
        ],
    ),
    Story(
        "cancelled on the robot it is cancelled here",
        [plan(), until(lambda s: s.executions(EXECUTING)), CANCEL_THERE, 60, ends(CANCELLED)],
    ),
)


def test_a_poll_in_the_moment_of_aborting_waits_for_what_the_robot_says(s):
    """``Abort`` has no message yet: judged then, a cancellation would look like a failure."""
    play(s, plan(), until(lambda s: s.executions(EXECUTING)), CANCEL_THERE)
    assert str(s.items()[0].state) == "Abort"
    worker = s.container.make_worker(s.robot("R1"))
    worker.handle(messages.Poll())
    worker.advance()
    play(s, states(EXECUTING), 60, ends(CANCELLED))


# ---------------------------------------------------------------------- switched or edited, and that undone
@step
def switch(s, enabled=False):
    s.noted.append(s.container.catalogue.switch_schedule(s.schedule().id, enabled))


@step
def change(s, **values):
    s.noted.append(s.container.catalogue.change_schedule(s.schedule(), replace(s.schedule(), **fields(values))))


UNDO = do(lambda s: s.container.catalogue.undo_change(s.noted[0]))
IS_ON = true(lambda s: s.schedule().enabled)
FORGOTTEN = each(
    0, do(lambda s: s.container.db.write(lambda c: c.execute("DELETE FROM executions WHERE ended_at > 0")))
)
FLAT = each(
    [battery(12), plan(battery=30, window=20), 310, waits(BATTERY)],
    [battery(12), plan(battery=30, window=20, rule="FREQ=DAILY"), 310, waits(BATTERY)],
)
CHARGED = [battery(80), 600]
TODAY_OFF = do(
    lambda s: s.container.catalogue.save_days(DayException("outing", s.clock.now().date(), s.clock.now().date()))
)

test_undone = cases_of(
    Story(
        "a waiting start runs once",
        FLAT,
        [switch(), true(lambda s: not s.schedule().enabled)],
        each(0, 3),
        [UNDO, IS_ON, CHARGED, ends(DONE), runs(1)],
    ),
    Story("while it is off nothing is sent", FLAT, [switch(), CHARGED, runs(0)]),
    Story(
        "a second undo is refused, and it runs once",
        FLAT,
        [switch(), UNDO, refused(UNDO, "changed again"), CHARGED, refused(UNDO, "changed again"), 600, runs(1)],
    ),
    Story(
        "a start that waited before an edit waits again",
        FLAT,
        each(change(at="06:15"), change(robot_id=2), change(rule="FREQ=WEEKLY;BYDAY=TU")),
        [UNDO, 3, waits(BATTERY), CHARGED, ends(DONE), runs(1)],
        robots=2,
    ),
    Story(
        "what ran on another robot before the undo does not run again",
        [battery(12), plan(battery=30, window=60), 310, waits(BATTERY)],
        [change(robot_id=2), battery(80, "R2"), 300, runs(1)],
        FORGOTTEN,
        [UNDO, CHARGED, runs(1)],
        robots=2,
    ),
    Story(
        "a start that fell due while it was off by mistake runs",
        [plan(rule="FREQ=DAILY", window=20), 298, switch(), 5, UNDO, 600, ends(DONE), minutes(5)],
    ),
    Story(
        "a start that fell due before an edit was undone runs",
        [plan(rule="FREQ=DAILY", window=20), 298],
        each(change(at="06:15"), change(rule="FREQ=WEEKLY;BYDAY=TU"), change(robot_id=2, at="06:15")),
        [5, UNDO, 1200, ends(DONE), runs(1), minutes(5)],
        robots=2,
    ),
    Story(
        "a start that waits on another robot when an edit is undone runs on its own",
        [battery(12, "R2"), plan(rule="FREQ=DAILY", battery=30, window=20), 298, change(robot_id=2), 5, waits(BATTERY)],
        [UNDO, 600, ends(DONE), true(lambda s: s.row().robot == "R1")],
        robots=2,
    ),
    Story(
        "what was sent before an edit was undone is not sent again",
        [plan(rule="FREQ=DAILY", window=20), 298],
        each(change(robot_id=2), change(rule="FREQ=MINUTELY", start_window_minutes=1)),
        [100, runs(1)],
        FORGOTTEN,
        [UNDO, 600, runs(1)],
        robots=2,
    ),
    Story(
        "a start that fell due before an edit was undone runs though the edited one waited",
        [battery(12), plan(battery=30, window=20), 298],
        each(change(at="06:06"), change(at="06:07", rule="FREQ=DAILY")),
        [130, waits(BATTERY), UNDO, CHARGED, ends(DONE), minutes(5)],
    ),
    Story(
        "a start whose window was over before an edit was undone writes no row",
        each(plan(rule="FREQ=DAILY", window=5), plan(window=5)),
        [298, change(at="08:00")],
        each(390, 900),
        [UNDO, 60, states()],
        true(lambda s: s.container.alarms.open() == []),
    ),
    Story(
        "a start that fell due in a pause before an edit was undone says so",
        [plan(rule="FREQ=DAILY", window=20), 298, change(at="06:15"), pause(5), 100, UNDO, 900, ends(PAUSED)],
    ),
    Story(
        "starts that fell due while the tablet slept are missed though an edit is undone before they are noticed",
        [plan(rule="FREQ=MINUTELY", window=1), 290, change(priority=4), 1, asleep(1500), UNDO, 5],
        true(lambda s: [row.starts for row in s.executions() if row.state is State.MISSED] == [24]),
        stays_open=True,
    ),
    Story(
        "a start of a day that was closed before an edit was undone does not run",
        [plan(rule="FREQ=DAILY", window=20, respect_working_days=True), 298, change(at="06:15")],
        [TODAY_OFF, 5, UNDO, 900, runs(0)],
    ),
    Story(
        "what ended because its robot was switched off does not wait again",
        [
            battery(12),
            plan(battery=30, window=20),
            310,
            change(priority=4),
            robot_off("R1"),
            robot_on("R1"),
            UNDO,
            CHARGED,
            runs(0),
        ],
    ),
    Story(
        "a start that fell due while it was off runs on the robot that somebody has chosen since",
        [plan(rule="FREQ=DAILY", window=20), 298, switch(), edit(robot_id=2), 5, UNDO, 600, ends(DONE)],
        true(lambda s: s.row().robot == "R2"),
        robots=2,
    ),
    Story(
        "a start that was held on another robot is held on its own",
        [
            battery(12),
            plan(battery=30, window=30),
            310,
            change(robot_id=2),
            2,
            keep(),
            UNDO,
            true(lambda s: s.row().held),
        ],
        [CHARGED, runs(0), let_go(), 300, ends(DONE), runs(1)],
        robots=2,
    ),
    Story(
        "it is switched on even if it is too late for a waiting start",
        [
            battery(12),
            plan(rule="FREQ=DAILY", battery=30, window=20),
            310,
            switch(),
            1500,
            UNDO,
            CHARGED,
            IS_ON,
            runs(0),
        ],
    ),
    Story(
        "switching on is undone by switching off",
        [plan(rule="FREQ=DAILY", enabled=False), switch(True), IS_ON, UNDO, 600, states()],
        true(lambda s: not s.schedule().enabled),
    ),
    Story(
        "later changes stay",
        FLAT,
        [switch(), edit(priority=3), UNDO, IS_ON, true(lambda s: s.schedule().priority == 3)],
        stays_open=True,
    ),
    Story(
        "a deleted one is not switched",
        FLAT,
        [switch(), delete(), refused(UNDO, "this schedule no longer exists")],
    ),
)
