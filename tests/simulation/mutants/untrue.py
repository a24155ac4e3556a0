"""Bugs whose rows don't say what the robots did."""

from __future__ import annotations

from tests.simulation.mutants.mutant import SENDING, TRACKING, Mutant
from tests.simulation.mutants.worlds import LOST, ROBOTS, SOME_FAULTS

MUTANTS = (
    Mutant(
        "an aborted mission was completed",
        f"{TRACKING}._states",
        "if item.state is QueueState.DONE:",
        "if item.state in (QueueState.DONE, QueueState.ABORTED):",
        "truth",
        ROBOTS,
    ),
    Mutant(
        "one answer 404 and it has vanished",
        f"{TRACKING}._has_been_missing",
        "return mono - ",
        "return True or mono - ",
        "truth",
        SOME_FAULTS,
    ),
    Mutant(
        "a lost answer is a refusal",
        f"{SENDING}._not_accepted",
        "elif error.delivery is Delivery.REFUSED:",
        "elif True:",
        "truth",
        LOST,
    ),
)
