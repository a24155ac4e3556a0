"""Bugs to be planted: each is a small patch to one function, with the world in which an oracle notices it. ``test_mutants`` runs them."""

from __future__ import annotations
import __future__ as future

import importlib
import inspect
import sys
import textwrap
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from types import FunctionType
from typing import Any

from mir_sim.fleets import KINDS
from tests.simulation.__main__ import simulate
from tests.simulation.profile import Findings, Profile

DUPLICATES, ENGINE = "services.dispatch.duplicates:Duplicates", "services.dispatch.engine:Engine"
GUARD, HOLDS = "services.dispatch.clock_guard:ClockGuard", "services.live.holds:Holds"
MOVING, RULES, TRANSITIONS = "services.catalogue.moving", "domain.rules", "services.executions.transitions"
IN_DOUBT, OUTCOMES = "services.dispatch.in_doubt:InDoubt", "services.dispatch.outcomes:Outcomes"
OWN_ITEMS, PLANNER = "services.dispatch.own_items:OwnItems", "services.dispatch.planner:Planner"
ROW_MAKER, SCHEDULES = "services.dispatch.planned_rows:RowMaker", "database.schedules:ScheduleRepository"
SENDING, TRACKING = "services.dispatch.sending:Sending", "services.dispatch.tracking:Tracking"

# Why a bug does no harm there.
TAKES_ONCE = {"enterprise": "an id is taken only once"}
OWN_CODE = dict.fromkeys(KINDS, "what is broken is not used for robots of a fleet")


@dataclass(frozen=True)
class Patch:
    """``target`` is "module:name" of a function below app. ``old`` is replaced by ``new`` in its source."""

    name: str
    target: str
    old: str
    new: str


@dataclass(frozen=True)
class Mutant(Patch):
    """``oracle`` is in what is found. ``at``: by kind of fleet another seed than ``seed``, or why it isn't tried there."""

    oracle: str
    profile: Profile
    seed: int = 1
    hours: float = 3.0
    at: Mapping[str, int | str] = field(default_factory=dict)

    def find(self, target: str) -> Findings:
        """Run its world with it until it is noticed."""
        seed, world = self.at.get(target, self.seed), self.profile.through(target)
        assert isinstance(seed, int), seed
        world = replace(
            world, events={name: often for name, often in world.events.items() if name in self.profile.events}
        )
        with planted(self):
            return simulate(seed, self.hours, world, self.oracle)


def _function(found: Any) -> FunctionType:
    """Of a method or property."""
    return found.fget if isinstance(found, property) else getattr(found, "__func__", found)


@contextmanager
def planted(patch: Patch) -> Iterator[FunctionType]:
    """The bug is in this function."""
    module_name, _, path = patch.target.partition(":")
    module = importlib.import_module(f"app.{module_name}")
    *classes, name = path.split(".")
    owner = module
    for each in classes:
        owner = getattr(owner, each)
    original = vars(owner)[name]
    source = textwrap.dedent(inspect.getsource(_function(original)))
    if source.count(patch.old) != 1:
        raise LookupError(f"{patch.name}: {patch.old!r} is {source.count(patch.old)} times in {patch.target}")
    made: dict[str, Any] = {}
    code = compile(source.replace(patch.old, patch.new), patch.target, "exec", flags=future.annotations.compiler_flag)
    exec(code, vars(module), made)
    owners = [
        owner,
        *(each for key, each in [*sys.modules.items()] if key.startswith("app.") and vars(each).get(name) is original),
    ]
    for each in owners:
        setattr(each, name, made[name])
    try:
        yield _function(made[name])
    finally:
        for each in owners:
            setattr(each, name, original)
