"""Idle automation starts a mission only if its robot's observed idle period still allows it at that moment (D14)."""

from __future__ import annotations

from datetime import timedelta

from app.domain.execution import Trigger
from app.domain.models import Place
from app.services.catalogue import group_edit
from mir_sim.mission_queue import MissionQueue
from tests.services.story import *
from tests.support.targets import number_in_paths

RESTING = [do(lambda s: s.add_mission("Home")), set_up(poll_interval_seconds=120), rest()]  # read every two minutes
TRIED = until(lambda s: s.executions() and s.row().attempts)
AT_HOME = until(lambda s: [str(item.state) for item in s.all_items()] == ["Done"])
TEN_OLDEST = do(lambda s: setattr(s.network, "short_lists", 10))
CLEANED_UP = do(lambda s: s.cancel_all())


def requests(number):
    """How many have left."""
    return true(lambda s: len(s.network.posts()) == number)


def sent_so_often(number, within=2400):
    return until(lambda s: len(s.network.posts()) == number, within)


def last_accepted(s):
    return s.container.repositories.robots.last_accepted(s.container.db.read(), 1)


@step
def plan_soon(s):
    soon = (s.clock.now() + timedelta(minutes=3)).replace(tzinfo=None, second=0, microsecond=0)
    play(s, plan("soon", f"23T{soon:%H:%M}"))


WITHDRAWN = [delete("robot"), robot_off(), rest(enabled=False), hold()]

test_begun = cases_of(
    Story("tried again after the quiet time, once", [RESTING, post(LOST), 1200, requests(2), items("Done")]),
    Story(
        "the mission without a connection is the one that is sent",
        RESTING,
        each(
            *(
                [post(REFUSED, count=refused), until(lambda s: s.network.posts()), 60, tries(refused + 1)]
                for refused in (1, 2)
            )
        ),
        ends(DONE),
    ),
    Story(
        "what was planned goes before it once a silent robot answers",
        [RESTING, post(REFUSED), TRIED, down(), plan_soon(), 240, up(), 120],
        true(lambda s: [item.description for item in s.items()] == [s.row("soon").token]),
        true(lambda s: s.executions()[0].reason.code is ReasonCode.OVERLAP),
        200,
    ),
    Story(
        "not tried again once somebody uses the robot",
        RESTING,
        each(post(LOST), post(ERROR_BEFORE)),
        [sent_so_often(1), later(60, stranger()), 180, requests(1)],
    ),
    Story(
        "a mission that waits for its next try is checked again",
        [RESTING, post(REFUSED, count=4), TRIED],
        each([stranger(), 60, items("Executing")], [rest(enabled=False), 120]),
        requests(0),
    ),
    Story(
        "withdrawn while the robot is read for it: no row is written",
        [RESTING, others_continue(), 330, meets("GET", "/mission_queue", SLOW, 8.0)],
        each(*(later(35, act) for act in WITHDRAWN)),
        [600, true(lambda s: s.network.counts[SLOW] == 1), items(), states()],
    ),
    Story(
        "withdrawn while the robot is read again: it is not sent",
        [
            RESTING,
            others_continue(),
            330,
            meets("GET", "/mission_queue", SLOW, 8.0),
            later(33, meets("GET", "/status", SLOW, 8.0)),
        ],
        later(39, true(lambda s: [row.trigger for row in s.executions()] == [Trigger.IDLE])),
        each(
            *(
                later(39, act)
                for act in (*WITHDRAWN, delete("Home"), set_up(working_days=("SU",)), plan_soon(), stranger())
            )
        ),
        [90, requests(0)],
        stays_open=True,
    ),
    Story(
        "a mission that waits for a place is checked again once there is room",
        do(
            lambda s: (
                s.add_mission("Home"),
                s.container.catalogue.edit(lambda edit: group_edit.save_place(edit, Place("Dock", 1, (1, 2)))),
            )
        ),
        [set_up(poll_interval_seconds=120), rest(), 330, do(lambda s: s.container.operator.run_now(2, 1))],
        [until(lambda s: any(row.wait is Wait.PLACE for row in s.executions()), 120), stranger()],
        [until(lambda s: s.executions(COMPLETED), 240), 60],
        true(lambda s: [row.reason.code for row in s.executions(State.SKIPPED)] == [ReasonCode.PLACE_BUSY]),
        true(lambda s: s.network.posts("R1") == []),
        robots=2,
    ),
)

test_rest = cases_of(
    Story(
        "a queue that really begins again ends it",
        [RESTING, stranger(count=3), sent_so_often(1), 300],
        [do(lambda s: setattr(s.machines["R1"], "queue", MissionQueue())), 900, requests(2)],
        mark=OWN_QUEUE,
    ),
    *(
        Story(
            f"an item that can't be read does not make the queue seem to begin again, {others} before it",
            [
                RESTING,
                do(lambda s, others=others: setattr(s.network, "short_lists", others)),
                stranger(count=others),
                120,
            ],
            until(lambda s, n=others + 1: [str(item.state) for item in s.all_items()] == ["Done"] * n, 1800),
            do(lambda s: s.network.unreadable.add(("R1", number_in_paths(s.items()[-1])))),
            [2400, requests(1)],
            stays_open=mark is UNSORTED,  # whether it has ended is in no list that can be trusted
            mark=mark,
        )
        for others, mark in ((1, SORTED), (2, UNSORTED))
    ),
    Story(
        "a robot that is deleted and restored is not sent home again",
        [
            RESTING,
            AT_HOME,
            do(lambda s: s.noted.append(last_accepted(s))),
            delete("robot"),
            20,
            undo(),
            1800,
            requests(1),
        ],
        true(lambda s: last_accepted(s) == s.noted[-1] is not None),
    ),
    Story(
        "a late copy of the idle mission ends no idle period",
        [RESTING, post(LATE, 400.0), until(lambda s: s.all_items(), 1800)],
        each(
            [3600, items("Done", "Aborted")],
            [60, down("R1"), later(400, up()), 3600, items("Done", "Done")],
            [60, down("R1"), later(1500, up()), 3600, items("Done", "Done")],
        ),
        requests(2),
        doubles=True,
        mark=NUMBERED,
    ),
    Story(
        "a late copy of a cancelled one ends no idle period",
        [
            RESTING,
            post(LATE, 400.0),
            until(lambda s: s.executions()),
            20,
            cancel(),
            3600,
            items("Aborted"),
            requests(1),
        ],
    ),
    Story(
        "one that was not needed but still arrives begins no other",
        [
            RESTING,
            post(LATE, 400.0),
            sent_so_often(1),
            later(60, stranger()),
            until(lambda s: not s.row().state.is_open),
        ],
        [app_off(), do(lambda s: s.stay_off(500)), app_on(), 3600, items("Done", "Done"), requests(1)],
    ),
    Story(
        "even if the robot has done much since",
        [RESTING, AT_HOME, stranger(count=150), CLEANED_UP, TEN_OLDEST, 1200, requests(2)],
        mark=SORTED,
    ),
    Story(
        "not where it can't be known that a fleet's robot has done anything since",
        [RESTING, AT_HOME, stranger(count=150), CLEANED_UP, TEN_OLDEST, 1200, requests(1)],
        mark=UNSORTED,
    ),
    Story(
        "a skipped start prevents no idle mission",
        [RESTING, plan(at="06:04", every=4)],
        each(pause(120), [skip(f"{6 + m // 60:02}:{m % 60:02}") for m in range(4, 84, 4)]),
        [1200, requests(1)],
    ),
    Story(
        "what the robot did between two polls ends it",
        [RESTING, later(125, stranger()), 240, items("Done"), 270, requests(0), 390, requests(1)],
    ),
    Story("time asleep does not count as idle", [RESTING, 250, asleep(7200), 280, requests(0), 400, requests(1), 200]),
    Story("work while the tablet slept ends it", [RESTING, 130, stranger(), asleep(7200), 280, requests(0)]),
)
