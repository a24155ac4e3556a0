"""Bugs to be planted in what gives starts of groups to robots, as the others."""

from __future__ import annotations

from dataclasses import replace

from tests.simulation.mutants.mutant import IN_DOUBT, SENDING, TAKES_ONCE, Mutant
from tests.simulation.mutants.worlds import world

SITE = {"every_minutes": 20, "poll_interval": 30, "quiet_s": 90, "history_limit": None, "with_window": False}
LOST = world("", "lost_request", (15, 60), **SITE).with_groups()
SILENT = replace(world("", "lost_request outage", (15, 120), **SITE), longest_outage=300.0).with_groups()
CRASHES = replace(world("", "lost_request", (15, 30), **SITE), crash_rate=0.01).with_groups()
CALM = world("", "", (0, 0), **SITE).with_groups()

MUTANTS = (
    Mutant(
        "given to another robot though the outcome at the first is unknown",
        f"{SENDING}._not_accepted",
        "if error.delivery is Delivery.NOT_SENT:",
        "if error.delivery is Delivery.NOT_SENT or (intent.group_id and error.delivery is not Delivery.REFUSED):",
        "before the first was read",
        LOST,
        hours=0.5,
    ),
    Mutant(
        "given to another robot after twenty seconds",
        f"{IN_DOUBT}.look_for",
        "quiet_left = self._seen.quiet_seconds - (",
        "quiet_left = (20 if row.group_id else self._seen.quiet_seconds) - (",
        "before the first was read",
        LOST,
        hours=0.5,
    ),
    Mutant(
        "given to another robot though the first could not be read",
        f"{IN_DOUBT}.look_for",
        "if quiet_left <= 0 and (is_closed",
        "if quiet_left <= 0 and row.group_id:\n            self._outcomes.failed([row], error.message, waited=True)\n"
        "        elif quiet_left <= 0 and (is_closed",
        "before the first was read",
        SILENT,
        hours=0.5,
        at={"classic": 2},
    ),
    Mutant(
        "looked for above another robot's numbers",
        "services.dispatch.own_items:OwnItems.of",
        "self._client.items_after(floor, ",
        "self._client.items_after(floor + (1000 if row.group_id else 0), ",
        "items with one token",
        LOST,
        hours=0.5,
        at={**TAKES_ONCE, "classic": "an order is found there by its token, whatever its number"},
    ),
    Mutant(
        "after a crash it is any robot's at once",
        f"{IN_DOUBT}.recover",
        "self.mark(",
        "self._outcomes.failed([row], 'x') if row.group_id else self.mark(",
        "before the first was read",
        CRASHES,
        seed=2,
        hours=0.5,
    ),
    Mutant(
        "a place has room for all",
        "database.group_executions:GroupExecutionRepository._at_place",
        "(place_id, but,",
        "(-1, but,",
        "at a place for",
        CALM,
        hours=0.5,
    ),
    Mutant(
        "what matters least goes first",
        "services.allocation.choose:_Assignment._rank",
        "-start.priority",
        "start.priority",
        "of higher priority waited",
        CALM,
        seed=2,
        hours=0.5,
    ),
    Mutant(
        "some robots are never free",
        "services.dispatch.group_state:GroupState._member",
        "free = ineligible is None and",
        "free = robot.id % 2 == 0 and ineligible is None and",
        "is free and",
        CALM,
        seed=3,
        hours=1.0,
    ),
    Mutant(
        "kept for anything planned",
        "services.allocation.choose:_Assignment._best_after_delays",
        "return best if least <= behind else None",
        "return None",
        "is free and",
        CALM,
        seed=3,
        hours=1.0,
    ),
)
