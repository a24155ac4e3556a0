"""Bugs to be planted in what gives starts of groups to robots, as in ``mutants``."""

from __future__ import annotations

from tests.simulation.mutants import IN_DOUBT, SENDING, Mutant
from tests.simulation.profile import Profile

BASE = {
    "fleet": "normal",
    "every_minutes": 20,
    "poll_interval": 30,
    "quiet_s": 90,
    "history_limit": None,
    "with_window": False,
}
LOST = (
    Profile(events_per_hour=60)
    .only(acts="", events="lost_request", fault_rate=0.0, crash_rate=0.0, site=BASE)
    .with_groups()
)
SILENT = (
    Profile(events_per_hour=120, longest_outage=300.0)
    .only(acts="", events="lost_request outage outage", fault_rate=0.0, crash_rate=0.0, site=BASE)
    .with_groups()
)
CRASHES = (
    Profile(events_per_hour=30, crash_rate=0.01)
    .only(acts="", events="lost_request", fault_rate=0.0, site=BASE)
    .with_groups()
)
CALM = Profile(acts_per_hour=0, events_per_hour=0).only(fault_rate=0.0, crash_rate=0.0, site=BASE).with_groups()

GROUP_MUTANTS = (
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
    ),
    Mutant(
        "looked for above another robot's numbers",
        "services.dispatch.own_items:OwnItems.of",
        "self._client.items_after(floor, ",
        "self._client.items_after(floor + (1000 if row.group_id else 0), ",
        "items with one token",
        LOST,
        hours=0.5,
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
