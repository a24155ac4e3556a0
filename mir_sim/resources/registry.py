"""Finds the handler of an operation: a function of its own where the machine does something, otherwise plain storage."""

from __future__ import annotations

from functools import singledispatch

from mir_sim.definition import Operation
from mir_sim.resources import batch, error_reports, mission_queue, missions, status, system, users
from mir_sim.resources.call import Handler, Handlers
from mir_sim.resources.stored import generic
from mir_sim.rest_machine import RestMachine
from mir_sim.robot import SimulatedRobot

SHARED: Handlers = batch.HANDLERS | error_reports.HANDLERS | missions.HANDLERS | users.HANDLERS
OF_ROBOTS: Handlers = SHARED | mission_queue.HANDLERS | status.HANDLERS | system.HANDLERS

# Operations that exist although MiR's definition doesn't list them (recorded on robots, and in MiR's document on fleets).
UNLISTED = {("post", "/batch"): Operation("post", "/batch", 201, None, None)}


@singledispatch
def handlers(machine: RestMachine) -> Handlers:
    """The operations in which a kind of machine does something; each kind registers its own."""
    return SHARED


@handlers.register
def _(robot: SimulatedRobot) -> Handlers:
    return OF_ROBOTS


def handler(machine: RestMachine, verb: str, template: str) -> Handler:
    return handlers(machine).get((verb, template), generic)
