"""How a request travels to a robot: over HTTP (app.mir.http), or straight into a simulated robot in simulations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

API = "/api/v2.0.0"
LONGEST_ANSWER = 30.0  # s that a robot is waited for at most, whatever was measured


@dataclass(frozen=True)
class Timeouts:
    """Seconds: to connect, between two parts of an answer, and for everything together."""

    connect: float = 3.0
    read: float = 5.0
    total: float = 10.0

    def at_least(self, seconds: float | None) -> Timeouts:
        """The same, but so long at least for an answer, of a robot that was seen to need it; never longer than ``LONGEST_ANSWER``."""
        wanted = min(seconds or 0.0, LONGEST_ANSWER)
        return Timeouts(self.connect, max(self.read, wanted), max(self.total, wanted))


@dataclass(frozen=True)
class Response:
    """A complete answer. Names of headers are as MiR's, or matched in any case."""

    status: int
    body: bytes = field(default=b"", repr=False)
    headers: Mapping[str, str] = field(default_factory=dict, repr=False)


class Transport(Protocol):
    """Carries one request at a time. Used by one thread at a time."""

    def send(
        self,
        method: str,
        path: str,
        *,
        query: Mapping[str, str] | None = None,
        json: Any = None,
        timeout: Timeouts,
        is_wanted: Callable[[], bool] | None = None,
        with_credentials: bool = True,
    ) -> Response:
        """Send and return the answer, whatever its status. ``path`` is below ``/api/v2.0.0``; ``json`` None means no body. ``is_wanted``,
        for what changes something, is asked once the connection is open. ``with_credentials``: with the credentials.

        Raises Unreachable or NotWanted when nothing was sent, TimedOut, ConnectionLost or Unreadable when something was.
        """

    def kept(self) -> object:
        """The open connection that reads share, None where their last answer ended it, False where the robot has hung up since."""

    def close(self) -> None:
        """Let go of connections. A later ``send`` opens new ones."""
