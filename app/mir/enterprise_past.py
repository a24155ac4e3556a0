"""Orders of Fleet Enterprise before 1.5: their ids are those of active ones only. An ended one is known by what it is,
if the app has seen what there was before it, and no other could be meant."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Collection, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from typing import NamedTuple

from app.domain.message import message
from app.domain.robot import QueueState
from app.mir import enterprise_vocabulary as words
from app.mir import parse
from app.mir.credentials import Token
from app.mir.errors import Ambiguous
from app.mir.fleet_connection import FRESH, Notes

MOST_REMEMBERED = 500  # orders
LISTED_FOR = 3000.0  # s after it was sent in which it is listed for certain: those that ended within the hour are
ARRIVES_WITHIN = timedelta(minutes=10)  # after it was sent
CLOCK_STEPS = timedelta(minutes=2)  # of the fleet, that a search allows for
SEARCHED = (
    timedelta(hours=1),
    timedelta(days=1),
    timedelta(days=7),
)  # for an order that has ended long ago, one after the other

_KEYS = ("api-key-guid", "api-key-name")


class Sent(NamedTuple):
    """``vehicle``: "" for any. ``before``: ids of the orders that were listed before it was sent; None: an earlier run of the
    app has sent it. ``at``: when that was, in seconds, and ``date`` by the fleet, with the ``last`` time, if known. ``key``:
    what lists called the app's key then, "" for not known. ``is_taken``: the fleet has it for certain."""

    mission: str
    vehicle: str
    before: frozenset[str] | None
    at: float
    date: datetime | None = None
    last: datetime | None = None
    key: str = ""
    is_taken: bool = False


class PastOrders:
    """``notes``: of the connection, which its clients share. ``ask`` lists the orders that run, or have ended within the
    hour, as they were at most so many seconds ago. ``ask_since`` lists those that have ended since then."""

    def __init__(
        self,
        notes: Notes,
        ask: Callable[[float], list[parse.Object]],
        ask_since: Callable[[datetime], list[parse.Object]],
        clock: Callable[[], float],
        token: Token,
    ) -> None:
        self._notes, self._ask, self._ask_since, self._clock, self._token = notes, ask, ask_since, clock, token

    def rows(self, within: float = FRESH) -> Sequence[parse.Object]:
        return self._ask(within)

    def token_of(self, phase_id: str) -> str:
        """Empty where it is not known."""
        return next((token for token, phase in list(self._notes.phases.items()) if phase == phase_id), "")

    def token_with(self, number: int) -> str:
        """The same by the app's number for the order."""
        return next((token for token in list(self._notes.phases) if words.number_of(token) == number), "")

    def note(self, token: str, mission: str, vehicle: str) -> None:
        """This order is about to be sent."""
        before, now = frozenset(_id(row) for row in self.rows(0.0)), self._notes.time
        self._note(token, Sent(mission, vehicle, before, self._clock(), now, now, self._own_key))

    def note_earlier(self, token: str, mission: str, vehicle: str, ago: float, date: datetime) -> None:
        """An earlier run of the app has sent this order, so many seconds ago by the tablet, after ``date`` by the fleet."""
        self._note(token, Sent(mission, vehicle, None, self._clock() - ago, date, None, self._own_key))

    @property
    def _own_key(self) -> str:
        return self._notes.own_keys.get(self._token, "")

    def _note(self, token: str, new: Sent) -> None:
        sent = self._notes.sent
        sent[token] = sent.get(token, new)._replace(last=new.last)
        for old in list(sent)[:-MOST_REMEMBERED]:
            sent.pop(old, None)

    def took(self, token: str) -> None:
        """The fleet has this order."""
        if (sent := self._notes.sent.get(token)) is not None and not sent.is_taken:
            self._notes.sent[token] = sent._replace(is_taken=True)

    def saw(self, token: str, event: parse.Object) -> None:
        """It is active. Once it runs, it is the order that its robot runs."""
        self.took(token)
        if token in self._notes.phases or words.state_of(event.get("state")) is not QueueState.EXECUTING:
            return
        running = [
            row
            for row in self.rows()
            if words.state_of(row.get("order-status")) is QueueState.EXECUTING
            and all(row.get(name) == event.get(name) for name in ("robot-id", "mission-id"))
        ]
        if len(running) == 1:
            self.remember(token, _id(running[0]))
            self._notes.own_keys[self._token] = _key(running[0])  # known once an order of ours has run

    def remember(self, token: str, phase_id: str) -> None:
        """The order with this token has the phase with this id."""
        known = self._notes.phases
        known[token] = phase_id
        for old in list(known)[:-MOST_REMEMBERED]:
            known.pop(old, None)

    def shown_for(self, is_found: Callable[[str], bool], enough: float) -> float:
        """Seconds for which an order is shown once it has ended, at least: that long ago the oldest one has that is listed, and is
        found by its id; longer ago than ``enough`` is not searched. 0.0: none is, or the fleet does not report its time."""
        self.rows(0.0)
        now = self._notes.time
        longest = 0.0
        for back in SEARCHED if now else ():
            assert now is not None
            rows = self._ask_since(now - back)
            ended = sorted(
                (at, _id(row)) for row in rows if (at := parse.instant(row.get("order-finished"))) is not None
            )
            oldest = bisect_left(ended, True, key=lambda row: is_found(row[1]))
            if oldest < len(ended):
                longest = max(longest, (now - ended[oldest][0].replace(tzinfo=UTC)).total_seconds())
            if longest > enough:
                break
        return longest

    def find(self, token: str, vehicle: str, active: Collection[str] = ()) -> parse.Object | None:
        """One that is not active. None: it is not there. ``vehicle``: of the robot that asks, "" for any. ``active``: tokens
        of others. Raises Ambiguous if several may be meant."""
        rows, known, sent = {_id(row): row for row in self.rows()}, self._notes.phases, self._notes.sent.get(token)
        since = self._since(sent) if sent is not None else None
        if known.get(token) not in rows and sent is not None and self._seconds_since(sent, since) > LISTED_FOR:
            if since is None:
                raise Ambiguous(problem=message("what has ended more than an hour ago can't be told"))
            rows |= {_id(row): row for row in self._ask_since(since)}
        if token in known:
            return rows.get(known[token])
        others, own = {phase for of, phase in list(known.items()) if of != token}, sent.key if sent else self._own_key
        earliest = since if sent is not None and sent.before is None else None
        free = {
            key: row
            for key, row in rows.items()
            if key not in others and _may_be(row, sent, key, vehicle, own) and not _is_made_before(row, earliest)
        }
        if not free:
            return None
        ((phase_id, row), *more) = free.items()
        rivals = [] if sent is None else self._rivals(token, sent, row, () if _runs(row) else active)
        if sent is None or more or (since is None and sent.before is None) or _is_meant_by_one(rivals, sent):
            raise Ambiguous(problem=message("which of {n} ended orders is meant can't be told", n=len(free)))
        if not own or _key(row) != own:
            raise Ambiguous(problem=message("whether an ended order is the app's can't be told"))
        if not rivals:
            self.remember(token, phase_id)
        return row

    def _rivals(self, token: str, sent: Sent, row: parse.Object, active: Collection[str]) -> list[Sent]:
        """Other orders of the app to which this one of a list may belong as well."""
        return [
            other
            for of, other in list(self._notes.sent.items())
            if of not in (token, *active)
            and of not in self._notes.phases
            and other.mission == sent.mission
            and (not other.vehicle or not sent.vehicle or other.vehicle == sent.vehicle)
            and not _is_made_before(row, other.date and other.date - CLOCK_STEPS)
            and not _is_made_since(row, other.last and other.last + ARRIVES_WITHIN + CLOCK_STEPS)
        ]

    def _since(self, sent: Sent) -> datetime | None:
        """The fleet's time before which it was certainly not sent: the earlier one of what two clocks say. None: not known."""
        now = self._notes.time
        return now and min(sent.date or now, now - timedelta(seconds=self._clock() - sent.at)) - CLOCK_STEPS

    def _seconds_since(self, sent: Sent, since: datetime | None) -> float:
        """How many seconds ago it was sent, at the most: by the fleet's clock where that is known, else by the tablet's."""
        now = self._notes.time
        return (now - since).total_seconds() if now and since else self._clock() - sent.at

    def key_of(self, mission: str, vehicle: str) -> str | None:
        """What lists call the app's key, by the order that it has just made. None: not certain."""
        rows = [row for row in self.rows(0.0) if (row.get("mission-id"), row.get("robot-id")) == (mission, vehicle)]
        now = self._notes.time
        keys = {_key(row) for row in rows if _is_made_since(row, now and now - CLOCK_STEPS)}
        return keys.pop() or None if len(keys) == 1 else None


def _is_made_since(row: Mapping[str, object], since: datetime | None) -> bool:
    made = parse.instant(row.get("order-created"))
    return since is not None and made is not None and made.replace(tzinfo=UTC) >= since


def _is_made_before(row: Mapping[str, object], since: datetime | None) -> bool:
    made = parse.instant(row.get("order-created"))
    return since is not None and made is not None and made.replace(tzinfo=UTC) < since


def _runs(row: Mapping[str, object]) -> bool:
    return words.state_of(row.get("order-status")) is QueueState.EXECUTING


def _is_meant_by_one(rivals: Sequence[Sent], sent: Sent) -> bool:
    """Whether the only order that could be this one's may be a rival's: one that was taken is there for certain."""
    return any(rival.is_taken or not sent.is_taken for rival in rivals)


def _id(row: Mapping[str, object]) -> str:
    return str(row.get("order-id"))


def _key(row: Mapping[str, object]) -> str:
    """Of the API client that made it; "" for none, or where it is not shown."""
    return next((str(row[name]) for name in _KEYS if row.get(name)), "")


def _may_be(row: parse.Object, sent: Sent | None, key: str, vehicle: str, own: str) -> bool:
    """Only the robot counts where no more is known of the order than its id."""
    made_by = _key(row)
    if (made_by and own and made_by != own) or (not made_by and any(name in row for name in _KEYS)):
        return False
    robot = sent.vehicle if sent else vehicle
    if robot and row.get("robot-id") not in (robot, None):
        return False
    return sent is None or (row.get("mission-id") == sent.mission and key not in (sent.before or ()))
