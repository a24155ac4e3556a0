"""A robot asked for its check-up: what it answers, as it came, and what it doesn't answer.

Requests take the client's way, so credentials go to the known machine only. ``PATIENT`` time-outs let a slow answer be measured instead of
being taken for none.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from app.domain.robot import Identity, RobotStatus
from app.mir import parse
from app.mir.client import RobotClient
from app.mir.errors import Refusal, RobotError
from app.mir.transport import Timeouts

QUEUE = "/mission_queue"
EVERY = 0.4  # s between two questions
SPARING = 1.5  # times the pause between requests that a robot does not bear
PATIENT = Timeouts(connect=5.0, read=30.0, total=60.0)


@dataclass(frozen=True)
class Answer:
    """``found``: the parsed JSON, None where there is none. ``error``: why there is no answer of success."""

    status: int | None = None
    found: Any = None
    error: RobotError | None = None

    @property
    def is_good(self) -> bool:
        return self.error is None

    def checked(self, *fine: int) -> Answer:
        """This answer. Raises its error, unless its status is one of those that are ``fine`` as well."""
        if self.error is not None and self.status not in fine:
            raise self.error
        return self

    @property
    def is_list(self) -> bool:
        return isinstance(self.found, list)

    @property
    def rows(self) -> list[parse.Object]:
        """The objects of a list; [] where it is none."""
        return [each for each in self.found if isinstance(each, dict)] if self.is_list else []

    @property
    def one(self) -> parse.Object:
        """The object, also where it comes as the only one of a list; {} where it is none."""
        found = self.found[0] if isinstance(self.found, list) and len(self.found) == 1 else self.found
        return found if isinstance(found, dict) else {}


class RawClient:
    """At most a question every ``every_s`` seconds: there are robots that boot when they are asked too much. ``clock``: monotonic, in
    seconds; ``pause`` lets so many pass."""

    def __init__(
        self,
        client: RobotClient,
        clock: Callable[[], float] = time.monotonic,
        pause: Callable[[float], None] = time.sleep,
        every_s: float = EVERY,
    ) -> None:
        self.client, self.clock, self._pause, self._every = client, clock, pause, every_s
        self._last = -math.inf

    def spare(self, requests: int, seconds: float) -> None:
        """From now on it is asked clearly less often than so many times within so many seconds."""
        self._every = max(self._every, SPARING * seconds / requests)

    def ask(
        self, method: str, path: str, query: Mapping[str, str] | None = None, json: Any = None, *, at_once: bool = False
    ) -> Answer:
        """Raises nothing: an error is part of the answer. ``at_once``: without the pause before it, right after what was asked last."""
        if not at_once:
            self._wait()
        try:
            response = self.client.ask(method, path, query=query, json=json)
            return Answer(response.status, parse.loads(response.body) if response.body else None)
        except RobotError as error:
            status = error.status if isinstance(error, Refusal) else None
            return Answer(status, error=error.at(self.client.address.netloc))

    def _wait(self) -> None:
        self._pause(max(0.0, self._last + self._every - self.clock()))
        self._last = self.clock()

    def get(self, path: str, **query: str) -> Answer:
        return self.ask("GET", path, query)

    def queue(self, **query: str) -> Answer:
        """Of the list of queue items."""
        return self.ask("GET", QUEUE, query)

    def search(self, filters: Sequence[Mapping[str, Any]], **query: str) -> Answer:
        """Of the search in it: a POST that reads."""
        return self.ask("POST", f"{QUEUE}/search", query, {"filters": list(filters)})

    def status(self) -> RobotStatus:
        """Without a pause before it. Raises RobotError."""
        return self.client.status()

    def paced_status(self) -> RobotStatus:
        """The status, asked for at the pace of the other questions. Raises RobotError."""
        self._wait()
        return self.client.status()

    def identity(self) -> Identity:
        """Raises RobotError."""
        return self.client.identify()


def ids_of(answer: Answer) -> list[int]:
    """Ids of queue items, in the order of the answer; what has none is left out."""
    return [
        entry["id"]
        for entry in answer.rows
        if isinstance(entry.get("id"), int) and not isinstance(entry["id"], bool) and entry["id"] > 0
    ]
