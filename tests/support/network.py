"""The network between the app and simulated robots: it drops and delays requests and answers, determined by a seed.

``Network`` decides what happens to each request and keeps a diary of the submissions that left; ``SimulatedTransport`` takes the place of
HTTP and calls a simulated robot's request handler directly, so that a request takes microseconds of real time and moves only the virtual
clock. What robots may do to a reader (items that can't be read, short lists, lost descriptions, other words) is declared on
``Network`` too.
"""

from __future__ import annotations

import json as json_module
import random
import threading
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from email.utils import format_datetime
from enum import StrEnum
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from app.mir.credentials import Token
from app.mir.errors import ConnectionLost, NotWanted, TimedOut, Unreachable
from app.mir.transport import Response, Timeouts
from mir_sim import SimulatedRobot, api
from mir_sim.fleets.enterprise import EnterpriseFleet
from mir_sim.machine import Machine
from mir_sim.messages import Request
from mir_sim.profile import FAITHFUL
from tests.support.clock import VirtualClock
from tests.support.targets import as_robots_have_it, each_item, numbers

if TYPE_CHECKING:
    from tests.support.site import Site

LATENCY = 0.02  # s
MANY = 20  # requests of one client without a pause
LONGEST_ANSWER = 9.0  # s, of a robot that answers slowly but well
QUEUE = "/mission_queue"


class Fate(StrEnum):
    """What happens to one request."""

    FINE = "fine"
    REFUSED = "refused"  # no connection
    LOST = "lost"  # connected, the request never arrives
    ANSWER_LOST = "answer_lost"  # handled, the answer never arrives
    LATE = "late"  # the app gives up, the request is handled later
    ERROR_BEFORE = "error_before"  # 5xx, not handled
    SAYS_WHY = "says_why"  # 500 with a sentence of the robot's, not handled
    ERROR_AFTER = "error_after"  # handled, then 5xx
    PAGE = "page"  # handled, then a web page instead of the answer
    CUT = "cut"  # handled, then half of the answer
    SLOW = "slow"  # handled, a good answer after ``seconds``, within the time-outs
    NOT_FOUND = "not_found"  # 404, not handled: a robot whose interface has only just come up
    ASLEEP = "asleep"  # connected, then the tablet sleeps for ``seconds``; the request leaves when it wakes


HARMFUL = tuple(fate for fate in Fate if fate not in (Fate.FINE, Fate.SLOW, Fate.NOT_FOUND, Fate.ASLEEP, Fate.SAYS_WHY))


@dataclass(frozen=True)
class Planned:
    """What the next request of a kind meets. ``*``: any method, path or robot. ``seconds``: of a slow answer, of the tablet's sleep, or
    until a late request is handled, counted from when it was sent; None: drawn by the seed."""

    method: str
    path: str
    fate: Fate
    seconds: float | None = None
    robot: str = "*"

    def fits(self, robot: str, method: str, path: str) -> bool:
        return self.path in ("*", path) and self.method in ("*", method) and self.robot in ("*", robot)


@dataclass
class Submission:
    """A POST to a robot's queue that left the tablet. ``at`` is true time in seconds since the site began."""

    at: float
    robot: str
    mission_id: str
    token: str
    fate: Fate = Fate.FINE
    lands_at: float | None = None  # of a late one: true time at which the robot handles it, later if the tablet sleeps


@dataclass
class Network:
    """``rate`` of the requests meet a fault, drawn by ``seed``; outages of a robot are added by name."""

    rate: float = 0.0
    seed: int = 1
    latest: float = 60.0  # s after which a late request is handled at most
    fates: tuple[Fate, ...] = HARMFUL
    only: Callable[[str, str], bool] = lambda method, path: True
    site: Site | None = None
    counts: Counter[str] = field(default_factory=Counter)
    answered: dict[str, float] = field(
        default_factory=dict
    )  # by robot: when it was last asked about its queue, in true time
    down: set[str] = field(default_factory=set)
    planned: list[Planned] = field(default_factory=list)
    interrupt: Callable[[str], None] = lambda where: None  # the simulation crashes the app here
    submissions: list[Submission] = field(default_factory=list)  # every POST to a queue that left, arrived or not
    submitted: Callable[[Submission], None] = lambda submission: None  # called for each of them as it leaves
    met: Callable[[str, Planned], None] = lambda robot, planned: None  # called for every request that meets something
    others_wait: bool = True  # while one robot's worker waits for a time-out; as the app is, they don't
    # what robots are like
    forgets_descriptions: bool = False  # they don't give back what they were sent
    short_lists: int | None = None  # no search, and a list always has the oldest items, for any page
    unreadable: set[tuple[str, int]] = field(default_factory=set)  # (robot, queue id): asked for, that item answers 500
    shown: dict[tuple[str, int], dict[str, Any]] = field(
        default_factory=dict
    )  # fields of an item as the robot gives them
    words: dict[str, str] = field(default_factory=dict)  # its own words for states of items
    impostors: dict[str, SimulatedRobot] = field(
        default_factory=dict
    )  # other machines that answer at a robot's address

    def __post_init__(self) -> None:
        self.rng = random.Random(self.seed)

    def next(
        self, method: str, path: str, fate: Fate, seconds: float | None = None, *, robot: str = "*", count: int = 1
    ) -> None:
        """The next ``count`` requests of this kind meet this fate."""
        self.planned += [Planned(method, path, fate, seconds, robot)] * count

    def fate_of(self, robot: str, method: str, path: str) -> Planned:
        for entry in self.planned:
            if entry.fits(robot, method, path):
                self.planned.remove(entry)
                return self._counted(replace(entry, robot=robot))
        if robot in self.down:
            return self._counted(Planned(method, path, Fate.REFUSED, robot=robot))
        if self.rate and self.only(method, path) and self.rng.random() < self.rate:
            fate = self.rng.choice(self.fates)
            return self._counted(
                Planned(method, path, fate, self.rng.uniform(0.5, LONGEST_ANSWER) if fate is Fate.SLOW else None, robot)
            )
        return Planned(method, path, Fate.FINE)

    def _counted(self, planned: Planned) -> Planned:
        self.counts[planned.fate] += 1
        self.met(planned.robot, planned)
        return planned

    def time_out(self, seconds: float) -> None:
        """The app waits and gets no answer."""
        is_elsewhere = threading.current_thread() is not threading.main_thread()  # the site is on that one, and waits
        if self.others_wait or is_elsewhere:
            self.site.clock.advance(seconds)
        else:
            self.site.others_continue(seconds)

    def posts(self, robot: str = "*") -> list[Submission]:
        """The submissions to one robot, or to all."""
        return [one for one in self.submissions if robot in ("*", one.robot)]

    # ------------------------------------------------------------------ what robots give back
    def as_answered(self, robot: str, path: str, body: bytes, machine: Machine) -> bytes:
        """An answer as these robots give it."""
        if not body or not path.startswith(QUEUE) or not (self.forgets_descriptions or self.shown or self.words):
            return body
        return json_module.dumps(each_item(json_module.loads(body), machine, partial(self._changes, robot))).encode()

    def _changes(self, robot: str, number: int, item: dict[str, Any]) -> dict[str, Any]:
        own = {"state": self.words.get(item.get("state", ""), item.get("state"))} if "state" in item else {}
        if self.forgets_descriptions and "description" in item:
            own["description"] = ""
        return own | {name: value for name, value in self.shown.get((robot, number), {}).items() if name in item}


@lru_cache(maxsize=64)
def _http_date(at: datetime) -> str:
    return format_datetime(at, usegmt=True)


class SimulatedTransport:
    def __init__(self, machine: Machine, network: Network, clock: VirtualClock, name: str, token: Token) -> None:
        self._machine, self._network, self._clock, self._name = machine, network, clock, name
        self._in_a_row, self._asked_at = 0, 0.0
        self._slowness = random.Random(name)  # of a robot whose every answer takes long
        self._headers = {"content-type": "application/json", "accept-language": "en_US"}
        self._credentials = {name.lower(): value for name, value in token.headers.items()}

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
        network, body = self._network, b"" if json is None else json_module.dumps(json).encode()
        known_as = as_robots_have_it(path, self._machine)
        asked_by = "POST" if known_as == f"{QUEUE}/search" else method
        network.interrupt(f"before {asked_by} {known_as}")
        planned = network.fate_of(self._name, asked_by, known_as)
        fate = planned.fate
        if fate is Fate.LATE and planned.seconds is None:
            planned = replace(planned, seconds=timeout.read + network.rng.uniform(0, network.latest))
        self._take_time()
        if fate is Fate.REFUSED:
            raise Unreachable(code="refused", address=self._name)
        if fate is Fate.ASLEEP:
            self._clock.suspend(planned.seconds or 0.0)
        if is_wanted is not None and not is_wanted():
            raise NotWanted(address=self._name)
        submission = self._note(planned, json) if (method, known_as) == ("POST", QUEUE) else None

        def handle() -> Response:
            if submission is not None and fate is Fate.LATE:
                submission.lands_at = self._clock.elapsed()
            return self._handle(
                method, path, query or {}, body, self._headers | (self._credentials if with_credentials else {})
            )

        match fate:
            case Fate.LOST:
                network.time_out(timeout.read)
                raise TimedOut(address=self._name, seconds=timeout.read)
            case Fate.LATE:
                network.site.at(planned.seconds or 0.0, handle)
                network.time_out(timeout.read)
                raise TimedOut(address=self._name, seconds=timeout.read)
            case Fate.ERROR_BEFORE:
                return Response(500, b'{"error_code": "internal", "error_human": "Internal server error"}', {})
            case Fate.SAYS_WHY:
                return Response(500, b'{"error_human": "Position mirconst-guid not found"}', {})
            case Fate.NOT_FOUND:
                return Response(404, b'{"error_code": "not_found", "error_human": "Not found"}', {})
        answer = handle()
        if latency := getattr(self._machine, "profile", FAITHFUL).latency:
            self._answer_takes(self._slowness.uniform(*latency), timeout)
        if fate in (Fate.FINE, Fate.SLOW) and known_as.startswith(QUEUE) and self._name not in network.impostors:
            network.answered[self._name] = self._clock.elapsed()
        network.interrupt(f"after {asked_by} {known_as}")
        match fate:
            case Fate.ANSWER_LOST:
                network.time_out(timeout.read)
                raise TimedOut(address=self._name, seconds=timeout.read)
            case Fate.ERROR_AFTER:
                return Response(503, b'{"error_code": "service_unavailable", "error_human": "busy"}', {})
            case Fate.PAGE:
                return Response(
                    200, b"<html><body>Sign in to the guest network</body></html>", {"Content-Type": "text/html"}
                )
            case Fate.CUT:
                raise ConnectionLost(address=self._name)
            case Fate.SLOW:
                network.site.others_continue(planned.seconds or 0.0)
        return answer

    def _take_time(self) -> None:
        """The time that a request takes. Others get a turn when there are very many without a pause."""
        network = self._network
        self._in_a_row = self._in_a_row + 1 if self._clock.monotonic() == self._asked_at else 0
        if self._in_a_row < MANY or network.others_wait or network.site is None:
            self._clock.advance(LATENCY)
        else:
            network.site.others_continue(LATENCY)
        self._asked_at = self._clock.monotonic()

    def _answer_takes(self, seconds: float, timeout: Timeouts) -> None:
        self._network.time_out(min(seconds, timeout.read))
        if seconds > timeout.read:
            raise TimedOut(address=self._name, seconds=timeout.read)

    def _note(self, planned: Planned, json: Any) -> Submission:
        """A submission leaves."""
        at = self._clock.elapsed()
        lands_at = at + (planned.seconds or 0.0) if planned.fate is Fate.LATE else None
        if serial := json.get("serial-order"):
            mission, token = serial["phases"][0]["mission-id"], serial["id"]
        else:
            mission, token = json["mission_id"], json.get("description", "")
        submission = Submission(at, self._name, mission, token, planned.fate, lands_at)
        self._network.submissions.append(submission)
        self._network.submitted(submission)
        return submission

    def _handle(
        self, method: str, path: str, query: Mapping[str, str], body: bytes, headers: Mapping[str, str]
    ) -> Response:
        """What the robot answers now."""
        network, machine = self._network, self._network.impostors.get(self._name, self._machine)
        known_as = as_robots_have_it(path, self._machine)
        number = known_as.removeprefix(f"{QUEUE}/")
        asked = numbers(int(number), self._machine) if method == "GET" and number.isdigit() else set()
        if any((self._name, each) in network.unreadable for each in asked):
            return Response(500, b'{"error_code": "internal", "error_human": "Internal server error"}', self._date())
        is_short = network.short_lists is not None and not isinstance(machine, EnterpriseFleet)  # which has no pages
        if is_short and known_as == f"{QUEUE}/search":
            return Response(404, b'{"error_code": "not_found", "error_human": "Not found"}', self._date())
        if is_short and (method, known_as) == ("GET", QUEUE):
            whitelist = {name: value for name, value in query.items() if name == "whitelist"}
            query = {**whitelist, "sort_by": "id", "limit": str(network.short_lists)}
        answer = api.handle(machine, Request(method, unquote(f"{machine.base}{path}"), query, headers, body))
        found = network.as_answered(self._name, known_as, answer.body, self._machine)
        return Response(answer.status, found, {**answer.headers, **self._date()})

    def _date(self) -> dict[str, str]:
        """The header with the robot's clock: true time and that clock's error, at any speed of the simulation."""
        clock, elapsed = self._machine.clock, self._clock.elapsed()
        return {
            "Date": _http_date((clock.start + timedelta(seconds=elapsed + clock.error(elapsed))).replace(microsecond=0))
        }

    def read_connection(self) -> object:
        """As if the connection to a machine stayed open until another one answers."""
        return self._network.impostors.get(self._name, self._machine)

    def close(self) -> None:
        """Nothing is held."""
