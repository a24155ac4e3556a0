"""Errors between the app and a robot, as one tree of exceptions.

For a request that changes something, ``error.delivery`` says what is known about its effect; dispatch decides only by
it. Every error has a ``code``, the ``msgid`` of its English sentence and the ``params`` of that sentence, so that a
screen can translate it: ``render(error.message, _)``. No error carries a secret: neither the token nor a header of the
request.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Any, Self

from app.domain.message import Message, message, render


class Delivery(Enum):
    """What a failed request may have done on the robot."""

    NOT_SENT = "not_sent"  # no byte of it was sent: trying again is safe
    REFUSED = "refused"  # the robot read it and said no
    UNKNOWN = "unknown"  # it may have been carried out, or may still be


SENTENCES: Mapping[str, str] = {
    "robot_error": "something went wrong with {address}",
    "refused": "{address} refused the connection. Is it switched on and its address right?",
    "no_answer": "{address} doesn't answer. Is it switched on and on this network?",
    "no_route": "there is no route to {address}. Is the tablet on the robots' network?",
    "unknown_name": "the name {host} is not known on this network: check it or enter the IP address",
    "slow_name": "looking up the name {host} takes too long: enter the IP address instead",
    "unreachable": "{address} can't be reached",
    "not_wanted": "the connection to {address} was made too late, so nothing was sent",
    "tls_failed": "{address} doesn't speak HTTPS as it should: check the address (http or https) and the port",
    "tls_silent": "{address} takes the connection, but doesn't answer over HTTPS: check the address (http or https) and the port",
    "certificate_untrusted": "the certificate of {address} isn't trusted, so nothing was sent: compare and trust it in Settings",
    "certificate_mismatch": "{address} shows another certificate than the trusted one, so nothing was sent. Is it still the same robot?",
    "connection_lost": "the connection to {address} broke before its answer was complete",
    "lost_over_http": "the connection to {address} broke before its answer was complete, perhaps it wants https",
    "timed_out": "{address} didn't answer within {seconds} s",
    "too_slow": "the answer of {address} wasn't complete after {seconds} s",
    "unauthorized": "{address} doesn't accept the user name and password",
    "forbidden": "{address} doesn't allow this user to do that",
    "rejected": "{address} refused (status {status})",
    "rejected_with_reason": "{address} refused: {reason} (status {status})",
    "busy": "{address} is busy just now (status 503)",
    "robot_fault": "{address} failed on its side (status {status})",
    "robot_fault_with_reason": "{address} failed on its side: {reason} (status {status})",
    "not_a_mir": "{address} is not a MiR robot",
    "redirected": "{address} points to {target}, which is not followed: enter the robot's own address",
    "web_page": "{address} answers with a web page, not like a MiR robot",
    "no_interface": "{address} answers, but not like a MiR robot or fleet (status {status})",
    "no_status": "{address} answers, but not with the status of a MiR robot",
    "serial_number_hidden": "{address} doesn't show its serial number any more, so nothing was sent: check at the robot that it is the "
    "same one",
    "another_robot": "{address} has serial number {found} instead of {expected}, so nothing was sent. Is it still the same robot?",
    "another_robot_did_it": "{address} has serial number {found} instead of {expected}, and that machine got the command. Is it still the "
    "same robot?",
    "another_fleet": "another fleet ({found}) answers at {address} than the known one ({expected}), so nothing was sent: correct its "
    "address, or enter its password or key again if it is the right one",
    "not_a_fleet": "{address} is a single robot, not a fleet: add it as a robot",
    "vehicle_unavailable": "the fleet at {address} has no contact with the robot ({state})",
    "not_in_fleet": "the fleet at {address} doesn't have this robot any more",
    "not_shown_yet": "{address} took the mission, but doesn't show it yet",
    "old_fleet": "the fleet at {address} has software {version}: the app needs {least} or later",
    "ambiguous": "{address} does not show what became of it: {problem}",
    "unreadable": "{address} gave an answer that can't be read: {problem}",
    "unnumbered": "{address} took the mission, but didn't say under which number",
    "too_long": "{address} gave an answer longer than {limit} MiB, or in too many pieces",
    "too_large": "{address} gave an answer larger than {limit} KiB where a short one is expected",
}


class RobotError(Exception):
    """Anything that kept a call to a robot from succeeding. Every call of ``RobotClient`` raises only this."""

    code = "robot_error"
    delivery = Delivery.UNKNOWN

    def __init__(self, *, code: str = "", **params: Any) -> None:
        super().__init__(code, params)
        self.code = code or self.code
        self.msgid = SENTENCES[self.code]
        self.params: dict[str, Any] = {"address": message("the robot"), **params}

    @property
    def text(self) -> str:
        """One English sentence: the problem and, if possible, its remedy. Begins in lower case, without a full stop."""
        return render(self.message)

    @property
    def message(self) -> Mapping[str, Any]:
        """What its sentence is made of."""
        return message(self.msgid, **self.params)

    def __str__(self) -> str:
        return self.text

    def at(self, address: str) -> Self:
        """The same error, naming the robot's address."""
        self.params["address"] = address
        return self

    def unsent(self) -> Self:
        """A copy, as the reason why another request was not sent: others may have the same error."""
        copy = type(self).__new__(type(self), *self.args)
        copy.__dict__ |= self.__dict__ | {"delivery": Delivery.NOT_SENT}
        return copy

    @property
    def certainly_without_effect(self) -> bool:
        """Whether a request that should change something has certainly changed nothing."""
        return self.delivery is not Delivery.UNKNOWN


class Unreachable(RobotError):
    """No connection was made, so nothing was sent: refused, no route, unknown name, time-out while connecting."""

    code = "unreachable"
    delivery = Delivery.NOT_SENT


class NotWanted(RobotError):
    """The request was too late, or no longer wanted, when the connection was open, so nothing was sent."""

    code = "not_wanted"
    delivery = Delivery.NOT_SENT


class CertificateProblem(Unreachable):
    """The TLS handshake failed or its certificate is not trusted. Nothing was sent."""

    code = "tls_failed"


class CertificateMismatch(CertificateProblem):
    """Another certificate than the pinned one. Nothing was sent."""

    code = "certificate_mismatch"


class ConnectionLost(RobotError):
    """The connection broke after the request had begun to leave. ``is_stale``: it was an open one, and a read got no byte of an answer:
    most likely the robot was just closing it."""

    code = "connection_lost"
    is_stale = False


class TimedOut(RobotError):
    """Connected, but no complete answer in time."""

    code = "timed_out"


class Refusal(RobotError):
    """The robot answered with a ``status`` of failure (HTTP). ``reason``: its own words, often empty."""

    def __init__(self, *, status: int, reason: Message = "", code: str = "", **params: Any) -> None:
        self.status, self.reason = status, reason
        code = code or self.code
        if reason and f"{code}_with_reason" in SENTENCES:
            code += "_with_reason"
        super().__init__(code=code, status=status, reason=reason, **params)


class Unauthorized(Refusal):
    """401 or 403: the user, the password or the user's rights are wrong."""

    code = "unauthorized"
    delivery = Delivery.REFUSED

    def __init__(self, *, status: int = 401, **params: Any) -> None:
        super().__init__(status=status, code="forbidden" if status == 403 else "unauthorized", **params)


MAY_STILL_HAPPEN = frozenset(
    {408, 425, 429}
)  # of the 4xx: "too slow", "too early", "too many" don't say that it was not done


class Rejected(Refusal):
    """Any other 4xx: the robot says no (400 wrong argument, 404 no such thing, 409 exists already …)."""

    code = "rejected"

    def __init__(self, *, status: int, **params: Any) -> None:
        super().__init__(status=status, **params)
        self.delivery = Delivery.UNKNOWN if status in MAY_STILL_HAPPEN else Delivery.REFUSED


class Busy(Refusal):
    """503: while docking or while its REST API restarts (seen by clients on robots). It may still have taken the
    request."""

    code = "busy"


class RobotFault(Refusal):
    """Any other 5xx."""

    code = "robot_fault"


class NotAMir(RobotError):
    """Something else answers at this address: a web page, a redirect, a device without MiR's interface."""

    code = "not_a_mir"


class AnotherRobot(NotAMir):
    """Another serial number (``found``) than the ``expected`` one answers, so the request was not sent."""

    code = "another_robot"
    delivery = Delivery.NOT_SENT


class AnotherFleet(AnotherRobot):
    """Another fleet (``found``) answers than the ``expected`` one, so the request was not sent."""

    code = "another_fleet"


class AnotherRobotDidIt(AnotherRobot):
    """The same, but that machine received the request."""

    code = "another_robot_did_it"
    delivery = Delivery.UNKNOWN


class SerialNumberHidden(NotAMir):
    """The robot at this address has always shown its serial number, ``expected``; what answers now does not."""

    code = "serial_number_hidden"


class VehicleUnavailable(RobotError):
    """The fleet answers, but has no contact with the robot, or no such robot."""

    code = "vehicle_unavailable"
    delivery = Delivery.NOT_SENT


class NotShownYet(RobotError):
    """The fleet has taken a mission that it does not show: it may still come, or never."""

    code = "not_shown_yet"


class OldFleet(NotAMir):
    """The fleet's software lacks what is needed to order a mission exactly once."""

    code = "old_fleet"
    delivery = Delivery.NOT_SENT


class Unreadable(RobotError):
    """The answer is not what this call's answer has to be: not JSON, wrong shape, too long."""

    code = "unreadable"


class Ambiguous(Unreadable):
    """What is looked for may be one of several, or somebody else's; asking again does not help."""

    code = "ambiguous"


class Unnumbered(Unreadable):
    """The robot has taken a mission without telling under which number."""

    code = "unnumbered"


class HasAlready(Unnumbered):
    """The fleet refuses an order because it has that already, which it does not show."""

    code = "not_shown_yet"


# The machine answers, but not with a list that can be read: what is known by its number or id is asked for by that.
NO_LIST = (NotAMir, Unreadable, RobotFault, Rejected)
