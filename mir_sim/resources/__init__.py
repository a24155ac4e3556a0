"""What stands behind each path of the API. ``handler`` finds it: a hand-written one where the robot does something, else the generic one."""
from __future__ import annotations

from mir_sim.resources import batch, mission_queue, status, system, users
from mir_sim.resources.collections import generic
from mir_sim.resources.registry import Handler

_WRITTEN: dict[tuple[str, str], Handler] = {}
for _module in (batch, mission_queue, status, system, users):
    _WRITTEN.update(_module.HANDLERS)

# Paths that robots answer but MiR's definition doesn't list (recorded).
UNLISTED = sorted({template for _, template in _WRITTEN if template in ("/batch",)})


def handler(verb: str, template: str) -> Handler:
    return _WRITTEN.get((verb, template), generic)


__all__ = ["UNLISTED", "Handler", "handler"]
