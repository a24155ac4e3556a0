"""Some promises with a fleet above the robots, for each kind; with ``--target`` all stories are about it."""

from __future__ import annotations

from app.mir.transport import Timeouts
from app.services.dispatch.timing import RECONCILE_EVERY
from mir_sim.fleets import KINDS
from tests.services.story import *
from tests.support.network import LATENCY


def of_each_fleet(name, *steps, **site):
    return cases_of(*(Story(f"{kind}: {name}", *steps, target=kind, **site) for kind in KINDS))


test_exactly_one = of_each_fleet(
    "a start ends as one order",
    plan(),
    each(
        *([post(fate), 900] for fate in (LOST, ANSWER_LOST, LATE, ERROR_AFTER)),
    ),
    [ends(DONE), runs(1)],
)
test_clear = of_each_fleet(
    "clearing cancels the app's own orders and leaves those of others",
    [plan(window=60), 295, stranger(), 30, states(QUEUED), clear_queue(), 300, items("Done", "Aborted"), ends(CLEARED)],
)
test_no_contact = of_each_fleet(
    "an order is found at the fleet, which has lost contact with the robot",
    plan(window=3),
    each(
        *([post(fate), 301] for fate in (ANSWER_LOST, ERROR_AFTER)),
    ),
    do(lambda s: s.fleet.cut_off({"R1"})),
    [600, true(lambda s: s.row().state in (QUEUED, EXECUTING) and s.row().queue_id)],
    [do(lambda s: s.fleet.cut_off(set())), 900, ends(DONE), runs(1)],
)

NO_ANSWER = 300.0 + Timeouts().read
test_soon_certain = cases_of(
    Story(
        "Fleet Enterprise says by its id what happened to an order within two seconds",
        plan(),
        each([post(ANSWER_LOST), NO_ANSWER - 0.1], [post(ERROR_AFTER), 299.9]),
        [
            states(SUBMITTING),
            0.1 + RECONCILE_EVERY / 2 + 10 * LATENCY,
            true(lambda s: s.row().state in (QUEUED, EXECUTING) and s.row().queue_id),
        ],
        [300, sent(300), ends(DONE), tries(1)],
        target="enterprise",
    )
)
