"""Finds the handler of an operation: a function of its own where the robot does something, otherwise plain storage."""

from __future__ import annotations

from mir_sim.definition import Operation
from mir_sim.resources import batch, error_reports, mission_queue, missions, status, system, users
from mir_sim.resources.call import Handler, Handlers
from mir_sim.resources.stored import generic

HANDLERS: Handlers = {
    operation: handler
    for module in (batch, error_reports, mission_queue, missions, status, system, users)
    for operation, handler in module.HANDLERS.items()
}

# Operations that robots have although MiR's definition doesn't list them (recorded).
UNLISTED = {("post", "/batch"): Operation("post", "/batch", 201, None, None)}


def handler(verb: str, template: str) -> Handler:
    return HANDLERS.get((verb, template), generic)
