"""Sends a request through the faults of a robot or fleet: it is handled or not, and answered now, late or never.

The HTTP server and clients in the same process share this code, so that a fault does the same in both.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from enum import Enum

from mir_sim.api import below_base, handle, refuse
from mir_sim.errors import ApiError
from mir_sim.faults import Fault, FaultKind
from mir_sim.machine import Machine
from mir_sim.messages import Request, Response


class Fate(Enum):
    """What the client sees."""

    ANSWERED = "answered"
    REFUSED = "refused"  # no connection: the machine is offline
    CLOSED = "closed"  # the connection ends without an answer
    CUT = "cut"  # the answer ends before its Content-Length
    HELD = "held"  # nothing ever comes


@dataclass
class Exchange:
    """The outcome of one request.

    Attributes:
        response: what comes back, if anything does; for ``CUT`` the half of the body that arrives; its Content-Length is ``full_length``.
        seconds: real seconds that the client waits for it.
        pending: the machine handles the request only after ``seconds``; ``response`` is None until then.
    """

    fate: Fate
    response: Response | None = None
    seconds: float = 0.0
    full_length: int = 0
    pending: bool = False


def exchange(machine: Machine, request: Request) -> Exchange:
    """Send one request through the machine's faults. A late request is handled when the machine's clock gets there."""
    with machine.lock:
        machine.catch_up()
        if not machine.online:
            return Exchange(Fate.REFUSED)
        fault = take_fault(machine, request)
        if fault is not None and fault.kind is FaultKind.LATE:
            late = Exchange(Fate.ANSWERED, None, fault.seconds, pending=True)

            def arrive() -> None:
                late.response, late.pending = handle(machine, request), False

            machine.call_at(machine.in_real(fault.seconds), arrive)
            return late
        return handle_with_fault(machine, request, fault)


def take_fault(machine: Machine, request: Request) -> Fault | None:
    """Take the fault that hits this request, if any. Only requests to the API are hit."""
    path = below_base(machine, request.path)
    with machine.lock:
        return None if path is None else machine.faults.take(request.method, path)


def handle_with_fault(machine: Machine, request: Request, fault: Fault | None) -> Exchange:
    """Handle a request as its fault demands. For ``late``, the caller waits before it calls this."""
    kind = fault.kind if fault is not None else None
    if kind is FaultKind.DROP_REQUEST:
        return Exchange(Fate.CLOSED)
    if kind is FaultKind.HANG:
        return Exchange(Fate.HELD)
    if kind is FaultKind.STATUS_503:
        return Exchange(Fate.ANSWERED, refuse(machine, ApiError(503)))
    if kind is FaultKind.TWICE:
        handle(machine, request)
    api_was_down_until = machine.api_down_until
    response = handle(machine, request)
    if machine.api_down_until > api_was_down_until:
        return Exchange(Fate.HELD)  # setting the clock restarts the API, and the answer is lost (reported)
    if kind is FaultKind.DROP_RESPONSE:
        return Exchange(Fate.CLOSED)
    if kind is FaultKind.DELAY and fault is not None:
        return Exchange(Fate.ANSWERED, response, fault.seconds)
    if kind is FaultKind.HTML:
        return Exchange(Fate.ANSWERED, Response(200, {"Content-Type": "text/html; charset=utf-8"}, PAGE))
    if kind is FaultKind.TRUNCATE:
        half = Response(response.status, response.headers, response.body[: len(response.body) // 2])
        return Exchange(Fate.CUT, half, full_length=max(1, len(response.body)))
    if kind is FaultKind.GARBAGE:
        noise = random.Random(f"{machine.serial_number}/{machine.now}").randbytes(max(16, len(response.body)))
        return Exchange(
            Fate.ANSWERED, Response(200 if response.status == 204 else response.status, response.headers, noise)
        )
    return Exchange(Fate.ANSWERED, response)


PAGE = (
    b"<!DOCTYPE html>\n<html><head><title>Sign in</title></head><body><h1>Sign in to the network</h1>"
    b'<form><input name="user"></form></body></html>\n'
)
