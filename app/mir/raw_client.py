"""A client for check-ups: raw answers, and missing ones. Requests go through the robot client, so credentials go only
to the known machine. ``PATIENT`` time-outs allow slow answers to be measured.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from app.domain.clock import Clock
from app.domain.message import Message, message
from app.domain.robot import RobotStatus
from app.mir import parse
from app.mir.classic_requests import ORDERS
from app.mir.classic_vehicle import ClassicVehicle
from app.mir.client import RobotClient
from app.mir.enterprise_vehicle import EnterpriseVehicle
from app.mir.errors import Refusal, RobotError
from app.mir.transport import Timeouts

QUEUE = "/mission_queue"
EVERY = 0.4  # s between two questions
SPARING = 1.5  # times the pause between requests that a robot does not bear
PATIENT = Timeouts(connect=5.0, read=30.0, total=60.0)

Client = RobotClient | ClassicVehicle | EnterpriseVehicle


@dataclass(frozen=True)
class Answer:
    """``found``: the parsed JSON, None without any. ``error``: why the request did not succeed. ``date``: when it was
    answered, by the clock of who answers."""

    status: int | None = None
    found: Any = None
    error: RobotError | None = None
    date: datetime | None = None

    @property
    def is_good(self) -> bool:
        return self.error is None

    @property
    def problem(self) -> Message:
        """The sentence of the problem, if it is not the requested list."""
        return self.error.message if self.error is not None else message("its answer is no list")

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
        """The objects of a list; [] if it is not a list."""
        return [each for each in self.found if isinstance(each, dict)] if self.is_list else []

    @property
    def ids(self) -> list[int]:
        """Of queue items, in the order of the answer; items without an id are omitted."""
        ids = (entry.get("id") for entry in self.rows)
        return [each for each in ids if isinstance(each, int) and not isinstance(each, bool) and each > 0]

    @property
    def id(self) -> int | None:
        """Of the queue item that it is about."""
        return next(iter(Answer(found=[self.one]).ids), None)

    @property
    def one(self) -> parse.Object:
        """The object, also if it is the only one of a list; {} otherwise."""
        found = self.found[0] if isinstance(self.found, list) and len(self.found) == 1 else self.found
        return found if isinstance(found, dict) else {}


class RawClient:
    """At most a question every ``EVERY`` seconds: there are robots that boot when they are asked too much. ``queue``: the
    path of its queue."""

    def __init__(self, client: Client, clock: Clock) -> None:
        self.client, self._clock = client, clock
        self.queue = ORDERS if isinstance(client, ClassicVehicle) else QUEUE
        self._every, self._last = EVERY, -math.inf
        self.get_once = functools.cache(self.get)  # read once, then the same answer

    def spare(self, requests: int, seconds: float) -> None:
        """From now on, ask it clearly less often than this number of times within these seconds."""
        self._every = max(self._every, SPARING * seconds / requests)

    def ask(
        self, method: str, path: str, query: Mapping[str, str] | None = None, json: Any = None, *, at_once: bool = False
    ) -> Answer:
        """Never raises: an error is part of the answer. ``at_once``: without a pause after the last request."""
        if not at_once:
            self._wait()
        try:
            response = self.client.ask(method, path, query=query, json=json)
            date = parse.http_date(response.headers.get("Date"))
            return Answer(response.status, parse.loads(response.body) if response.body else None, date=date)
        except RobotError as error:
            status = error.status if isinstance(error, Refusal) else None
            return Answer(status, error=error.at(self.client.address.netloc))

    def _wait(self) -> None:
        self._clock.sleep(max(0.0, self._last + self._every - self._clock.monotonic()))
        self._last = self._clock.monotonic()

    def get(self, path: str, **query: str) -> Answer:
        return self.ask("GET", path, query)

    def search(self, filter_: Mapping[str, Any], **query: str) -> Answer:
        """Queue items: a POST that reads."""
        return self.ask("POST", f"{self.queue}/search", query, {"filters": [filter_]})

    def paced_status(self) -> RobotStatus:
        """The status, asked for at the pace of the other questions. Raises RobotError."""
        self._wait()
        return self.client.status()
