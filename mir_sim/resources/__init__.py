"""What stands behind each path of the API: code of its own where the robot does something, else the generic handler."""
from __future__ import annotations

from mir_sim.resources import batch, error_reports, mission_queue, missions, status, system, users
from mir_sim.resources.registry import Handler
from mir_sim.resources.stored import generic

_WRITTEN: dict[tuple[str, str], Handler] = {
    operation: handler for module in (batch, error_reports, mission_queue, missions, status, system, users)
    for operation, handler in module.HANDLERS.items()}

# Paths that robots answer although MiR's definition doesn't list them (recorded).
UNLISTED = ("/batch",)


def handler(verb: str, template: str) -> Handler:
    return _WRITTEN.get((verb, template), generic)


__all__ = ["UNLISTED", "Handler", "handler"]
