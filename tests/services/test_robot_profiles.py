"""What the app does otherwise because a check-up has found out how a robot differs; and what happens while such a robot is waited for."""

from __future__ import annotations

import math
from collections.abc import Iterable

from app.domain.check_up import Rest
from app.domain.execution import ReasonCode
from app.services.dispatch import messages
from mir_sim import Profile, deviant
from mir_sim.mission_queue import ItemState
from tests.services.story import *
from tests.support.expected_findings import checked_up
from tests.support.seen import requests
from tests.support.site import USER


def of(robot: str, name: str, *steps, **site) -> Story:
    """A story of R1 that differs in that way."""
    profile = Profile(timezone="UTC") if robot == "faithful" else deviant(robot)
    return Story(f"{robot}: {name}", 60, *steps, profiles={"R1": profile}, **site)


def of_each(robots: Iterable[str], name: str, steps, **site) -> list[Story]:
    """``steps`` are made of the robot's name."""
    return [of(robot, name, *steps(robot), **site) for robot in robots]


@step
def known(s, name="faithful", **values):
    """A check-up has found out that, and ``values`` otherwise."""
    robot = s.robot("R1")
    profile = replace(checked_up(name, robot.serial_number, robot.software), **values)
    s.check_up(robot, profile)
    s.run(1)
    assert s.robot("R1").known == profile


def fate(fate, attempts, *seconds):
    return [post(fate, *seconds), 900, tries(attempts)]


def alarms(*codes):
    return true(lambda s: s.alarms() == list(codes))


def during_the_wait(act):
    """Once, as a request of a start waits because the robot has to rest."""

    def arrange(s):
        pace = s._paces["R1"]
        pause = pace._pause

        def paused(seconds):
            if s.executions(SUBMITTING) and not s.removed:
                play(s, act)
            pause(seconds)

        pace._pause = paused

    return do(arrange)


ONE, TAKEN = [ends(DONE), runs(1), not_raised()], until(lambda s: s.executions(QUEUED, EXECUTING), 400)
FORGETS, SEEN = "forgets-descriptions", do(lambda s: s.noted.append(requests(s)))
NOT_FOUND_AT_ALL = do(
    lambda s: setattr(
        s.network, "as_answered", lambda _robot, path, body, _machine: b"[]" if path.startswith("/mission_q") else body
    )
)
DOUBLED = do(lambda s: s.stranger_queues(description=s.row().token, user=USER))
UPDATED = do(lambda s: setattr(s.machines["R1"], "software", "3.8.1"))


@step
def fails(s):
    controller = s.machines["R1"].controller
    controller.end(ItemState.ABORTED, "Failed to reach goal position 'Dock'")
    controller.finish_abort()


test_reading = cases_of(
    of(
        "no-search",
        "a search that is known to be missing is never tried",
        [known("no-search"), app_off(), app_on(), SEEN, plan(), 900, ends(DONE)],
        true(lambda s: "GET /mission_queue" in s.noted[0] and "POST /mission_queue/search" not in s.noted[0]),
    ),
    of(
        "pages-of-50",
        "pages that end early are no proof that a start did not arrive: its item is beyond 60 others",
        each([], known("pages-of-50")),
        [plan(), post(ANSWER_LOST), until(lambda s: s.executions(SUBMITTING), 400)],
        [down("R1"), 1, do(lambda s: [s.stranger_queues(description="another's", user=USER) for _n in range(60)])],
        [up(), 900, tries(1)],
        true(lambda s: [i.id for i in s.items() if i.description == s.row().token] == [s.row().queue_id]),
    ),
)

test_which_item_is_ours = cases_of(
    of(
        "moves-descriptions",
        "a token that comes back in another field is found there",
        [known("moves-descriptions"), plan()],
        each(fate(ANSWER_LOST, 1), fate(LOST, 2)),
        ONE,
    ),
    *of_each(
        (FORGETS, "renames-descriptions"),
        "the first start is not doubled and needs no alarm",
        lambda _robot: [
            [known(FORGETS), plan()],
            each(fate(ANSWER_LOST, 1), fate(LATE, 1, 20.0), fate(LOST, 2)),
            ONE,
        ],
    ),
    of(
        FORGETS,
        "a copy that arrives late is an alarm and is left alone",
        each([], known(FORGETS)),
        [plan(), post(LATE, 200.0), 900, runs(2), alarms("unmarked_copy")],
        doubles=True,
    ),
    of(
        FORGETS,
        "an item of another user is no copy",
        [known(FORGETS), plan(), post(LOST), 450, stranger(), 600, runs(2), not_raised()],
    ),
    *of_each(
        (FORGETS, "german-states"),
        "a start that the network has doubled is an alarm",
        lambda robot: [
            each([], known(robot)),
            [plan(), TAKEN, DOUBLED, 95],
            true(lambda s: {"unmarked_copy", "duplicate_running", "duplicate_healed"} & set(s.alarms())),
        ],
        doubles=True,
        stays_open=True,
    ),
    of(
        "no-id",
        "a start that was taken without a number is looked for at once",
        [known("no-id"), plan(), TAKEN, tries(1)],
        true(lambda s: (s.row().submitted_at - s.row().planned_at).total_seconds() < 1),
        stays_open=True,
    ),
    of(
        "no-id",
        "a start that was taken and can't be found is never sent again",
        each([], known("no-id")),
        [plan(), NOT_FOUND_AT_ALL, until(lambda s: s.network.posts()), 2],
        each([], off_for(5)),
        [900, ends(UNKNOWN), tries(1), raised("unknown_outcome")],
    ),
)

test_its_words = cases_of(
    *of_each(
        ("cancelled", "german-states", "german-texts", "faithful"),
        "how a run ended is understood",
        lambda robot: [
            [known(robot), plan(), until(lambda s: s.executions(EXECUTING), 400)],
            each(
                [do(lambda s: s.machines["R1"].cancel_all()), 900, ends(CANCELLED)],
                [fails(), 900, ends((FAILED, ReasonCode.ROBOT_ABORTED))],
                [900, ends(DONE)],
            ),
        ],
    )
)


def apart(seconds):
    """The last two requests to start a mission."""
    return true(lambda s: s.network.posts()[-1].at - s.network.posts()[-2].at > seconds)


test_its_pace = cases_of(
    of(
        "slow-disk",
        "a robot that was seen to be slow is waited for",
        [known("slow-disk", quiet_s=120.0), plan(), 900, ends(DONE), tries(1), not_raised("unreachable")],
    ),
    of(
        "faithful",
        "the quiet time is the longer of the two",
        [known(quiet_s=200.0), plan(), post(LOST), 900, apart(200)],
        [known(quiet_s=5.0), plan("B", "07:00"), post(LOST), 3600, apart(90)],
    ),
    of(
        "reboots-under-load",
        "a robot that boots when it is asked too much is asked less",
        [known("reboots-under-load"), do(lambda s: s.noted.append(s.machines["R1"].reboots)), plan()],
        [10, do(lambda s: s.container.make_client(s.robot("R1")).open_items())] * 30,
        [600, ends(DONE), tries(1), true(lambda s: s.machines["R1"].reboots == s.noted[0])],
    ),
    of(
        "faithful",
        "requests never come closer than the robot bears",
        [
            known(rest=Rest(8, 10.0)),
            do(lambda s: setattr(s.network, "interrupt", lambda _at: s.noted.append(s.seconds()))),
        ],
        [[plan(f"at {minute}", f"06:0{minute}") for minute in range(5, 9)], 900, ends(*[DONE] * 4)],
        true(lambda s: all(later - at >= 10.0 for at, later in zip(s.noted[::2], s.noted[16::2], strict=False))),
    ),
)

test_while_it_is_waited_for = cases_of(
    of(
        "faithful",
        "a start withdrawn during a question about a refusal changes no other",
        [known(rest=Rest(1, 10.0)), plan("A"), plan("B"), plan("C"), post(NOT_FOUND)],
        during_the_wait(do(lambda s: s.removed.append(s.container.catalogue.remove_schedule(2)))),
        [900, true(lambda s: s.removed and len(s.executions(COMPLETED)) == 2), runs(2), not_raised()],
    ),
    of(
        "faithful",
        "a start withdrawn while it waits for its turn is not sent",
        [known(rest=Rest(1, 10.0)), plan(), during_the_wait(delete()), 900, ends(CHANGED), sent()],
    ),
    of(
        FORGETS,
        "a start that is sent while the robot is read is no copy of another",
        [known(FORGETS), plan(), plan("B", "06:06"), until(lambda s: len(s.network.posts()) == 1, 400)],
        do(lambda s: s.run(359.9 - s.seconds())),
        until(lambda s: math.isfinite(s._workers[1]._sending.attempts.next_ready_at())),
        [meets("GET", "/status", SLOW, 0.5), do(lambda s: s.post(1, messages.Poll()))],
        [900, ends(DONE, DONE), runs(2), not_raised()],
    ),
    of(
        "faithful",
        "a robot that has come back is asked for its software before its queue proves anything",
        [known(), plan(), post(ANSWER_LOST), until(lambda s: s.executions(SUBMITTING) and s.network.posts(), 400)],
        [down("R1"), 100, UPDATED, up(), SEEN, TAKEN],
        true(lambda s: s.noted[0].index("GET /users/me") < s.noted[0].index("POST /mission_queue/search")),
        stays_open=True,
    ),
)

test_no_longer_what_was_checked_up = cases_of(
    of(
        "faithful",
        "other software ends the profile with an alarm until the next check-up",
        [known(), UPDATED, 120, alarms("check_up_outdated"), true(lambda s: s.robot("R1").known is None)],
        do(lambda s: s.noted.append([(alarm.id, 1) for alarm in s.container.alarms.open()])),
        [3600, true(lambda s: [(alarm.id, alarm.count) for alarm in s.container.alarms.open()] == s.noted[0])],
        [known(), 95, true(lambda s: all(alarm.cleared_at for alarm in s.container.alarms.open()))],
    ),
)
