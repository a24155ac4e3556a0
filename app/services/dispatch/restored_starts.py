"""Starts that a robot may have though the ledger does not say so: a backup was restored, or the plan moved here from
another tablet.

Starts planned up to ``uncertain_until`` may have been sent already, also to another robot than planned now. It is
looked for by its token on every configured robot, and sent only when each of them has answered after the quiet time, in
which a request of before may still arrive. Robots are asked only while a start waits for that. Used by the engine and
by all robots' workers, each on its own thread.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta

from app.database.connection import Database
from app.database.settings import SettingsRepository
from app.database.values import to_instant, to_text
from app.domain import rules
from app.domain.clock import Clock
from app.domain.models import Robot, Settings
from app.domain.robot import QueueItem
from app.services.dispatch.timing import AWAITED_FOR, CLOCKS_AGREE
from app.services.live.changes import Changes, Topic
from app.services.live.tablet import Tablet

SETTLED = "uncertain_through"  # name in the settings: until when, and from which restore and move


@dataclass(frozen=True)
class Found:
    """``item`` is on ``robot``; None: on no robot, as far as known. ``is_certain``: no robot can have it unseen.
    ``silent``: names of robots that have not answered."""

    robot: Robot | None = None
    item: QueueItem | None = None
    is_certain: bool = True
    silent: Sequence[str] = ()


@dataclass(frozen=True)
class _Answer:
    robot: Robot
    asked_at: float
    items: dict[str, QueueItem]  # by description
    tokens: frozenset[str] | None = None  # those that it was asked for; None: it has listed all of its newest
    shows_since: datetime | None = None  # what was sent before may have ended and be forgotten there


@dataclass
class _Search:
    """What robots have answered since the restore or move that was ``noted``. Times on the monotonic clock."""

    noted: list[datetime]
    since: float
    answers: dict[tuple[int, str], _Answer] = field(default_factory=dict)  # by robot and address
    awaited_until: float = -math.inf
    called_at: float = -math.inf
    sought: dict[str, float] = field(default_factory=dict)  # until when these tokens are looked for

    def answer_of(self, robot: Robot) -> _Answer | None:
        return self.answers.get((robot.id, robot.address))

    def tokens(self, mono: float) -> frozenset[str]:
        return frozenset(token for token, until in self.sought.items() if until >= mono)

    def answered_at(self, robot: Robot, mono: float) -> float:
        answer = self.answer_of(robot)
        if answer is None or (answer.tokens is not None and not self.tokens(mono) <= answer.tokens):
            return -math.inf
        return answer.asked_at


class RestoredStarts:
    def __init__(
        self,
        db: Database,
        clock: Clock,
        changes: Changes,
        tablet: Tablet,
        robots: Callable[[], list[Robot]],
        settings: Callable[[], Settings],
    ) -> None:
        self._repository = repository = SettingsRepository()
        self._db, self._clock, self._changes = db, clock, changes
        self._tablet, self._robots, self._settings = tablet, robots, settings
        self._lock = threading.Lock()
        self._restored_at = repository.restored_at(db.read())  # a restore opens everything again
        self._former_ran_until = repository.former_ran_until(db.read())
        self._settled = repository.get(db.read(), SETTLED) or {}
        self._right_since: datetime | None = None
        self._search = _Search(self._noted, clock.monotonic())

    # ------------------------------------------------------------------ which starts
    @property
    def _noted(self) -> list[datetime]:
        move = self._tablet.move
        ends = self._restored_at, self._former_ran_until, move.at if move else None
        return [at for at in ends if at is not None]

    @property
    def uncertain_until(self) -> datetime | None:
        """Starts planned up to then may be on a robot although their rows do not say so; None: none. The clock at the
        restore may have been wrong, so this covers everything planned before it was found right."""
        noted = self._noted
        if not noted:
            return None
        if self._settled.get("of") == [to_text(at) for at in noted]:
            return to_instant(self._settled["through"])
        return max([*noted, self._right_since or noted[0]])

    def clock_is_right(self, is_proven: bool) -> None:
        """From now on. ``is_proven``: by a robot or a person; then later starts are certain, also in later runs of the
        app, even if a clock that was far ahead has stored a later time."""
        self._right_since = self._clock.now()
        noted = [to_text(at) for at in self._noted]
        if is_proven and noted and self._settled.get("of") != noted:
            latest = min(max(self._noted), self._right_since + timedelta(seconds=2 * CLOCKS_AGREE))
            settled = {"of": noted, "through": to_text(max(self._right_since, latest))}
            self._db.write(lambda c: self._repository.put(c, SETTLED, settled))
            self._settled = settled

    # ------------------------------------------------------------------ asking robots
    def find(self, tokens: Sequence[str | None], robot_id: int | None, planned_at: datetime) -> Found:
        """The place of an item with one of these tokens, sent at ``planned_at`` at the earliest: on one robot, or (None)
        on any. While it is uncertain, the robots are asked."""
        robots = [robot for robot in self._robots() if robot_id in (None, robot.id)]
        mono = self._clock.monotonic()
        with self._lock:
            search, final_from = self._current_search(), self._final_from()
            search.sought |= dict.fromkeys(filter(None, tokens), mono + AWAITED_FOR)
            answers = [answer for robot in robots if (answer := search.answer_of(robot)) is not None]
            for answer in answers:
                if found := next((answer.items[token] for token in tokens if token in answer.items), None):
                    return Found(answer.robot, found)
            if all(search.answered_at(robot, mono) >= final_from for robot in robots):
                may_be_forgotten = any(
                    each.shows_since is not None and planned_at < each.shows_since for each in answers
                )
                return Found(is_certain=not may_be_forgotten)
            calls = mono > search.awaited_until or search.called_at < final_from <= mono
            search.awaited_until = mono + AWAITED_FOR
            if calls:
                search.called_at = mono
            silent = [robot.name for robot in robots if search.answered_at(robot, mono) == -math.inf]
        if calls:
            self._changes.publish(Topic.EXECUTIONS)  # wakes every worker
        return Found(is_certain=False, silent=silent)

    def wants(self, robot: Robot) -> bool:
        """Whether a start waits for this robot's answer."""
        mono = self._clock.monotonic()
        if mono > self._search.awaited_until:
            return False
        with self._lock:
            answered_at, final_from = self._current_search().answered_at(robot, mono), self._final_from()
        return answered_at < final_from and (answered_at == -math.inf or mono >= final_from)

    def sought(self) -> frozenset[str]:
        """The tokens that are looked for now."""
        with self._lock:
            return self._current_search().tokens(self._clock.monotonic())

    def answer(
        self,
        robot: Robot,
        asked_at: float,
        items: Sequence[QueueItem],
        tokens: frozenset[str] | None = None,
        shows_since: datetime | None = None,
    ) -> None:
        """A robot's newest items, by ascending id; ``asked_at`` on the monotonic clock. ``tokens``: it was asked for
        these only, and shows those that were sent since then."""
        earliest = {item.description: item for item in reversed(items)}
        with self._lock:
            self._current_search().answers[robot.id, robot.address] = _Answer(
                robot, asked_at, earliest, tokens, shows_since
            )

    def _current_search(self) -> _Search:
        """A new one when the plan has moved here since."""
        if self._search.noted != self._noted:
            self._search = _Search(self._noted, self._clock.monotonic())
        return self._search

    def _final_from(self) -> float:
        return self._search.since + rules.quiet_seconds(self._settings(), *self._robots())
