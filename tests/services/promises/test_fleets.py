"""Some promises with a fleet above the robots, for each kind; with ``--target`` all stories are about it."""

from __future__ import annotations

from mir_sim.fleets import KINDS
from tests.services.story import *


def of_each_fleet(name, *steps, **site):
    return cases_of(*(Story(f"{kind}: {name}", *steps, target=kind, **site) for kind in KINDS))


test_exactly_one = of_each_fleet(
    "a start ends as one order",
    plan(),
    each(*([post(fate), 900] for fate in (LOST, ANSWER_LOST, LATE, ERROR_AFTER)), quick=1),
    [ends(DONE), runs(1)],
)
test_clear = of_each_fleet(
    "clearing cancels the app's own orders and leaves those of others",
    [plan(window=60), 295, stranger(), 30, states(QUEUED), clear_queue(), 300, items("Done", "Aborted"), ends(CLEARED)],
)
