"""The intents that one worker holds until their instants, and how everything else gives way to them.

An intent is on disk up to ``INTENT_LEAD`` before its instant, so that then nothing but the POST is left to do. That is why a worker that
is sending knows what it has to send next: whatever takes long is done in between.
"""
from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from datetime import datetime, timedelta

from app.domain.clock import Clock
from app.domain.models import Execution
from app.domain.rules import INTENT_LEAD, in_dispatch_order

ROUND_TAKES = 0.04              # s that a round takes; what is due sooner goes first
PUT_OFF_AT_MOST = 0.5           # s that a round gives way to what is due


class Intents:
    """Used by the worker's thread only."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._held: dict[int, tuple[float, Execution]] = {}      # by id, and when each is to be sent, on the monotonic clock
        self._changed_at: datetime | None = None
        self._put_off_at = math.inf                              # since when rounds have given way

    @property
    def held(self) -> list[Execution]:
        return [intent for _at, intent in self._held.values()]

    def take(self, intents: Iterable[Execution]) -> None:
        """Each until its instant, however the wall clock is set meanwhile."""
        wall, mono = self._clock.now(), self._clock.monotonic()
        for intent in intents:
            self._held[intent.id] = (mono + min(max(timedelta(), intent.planned_at - wall), INTENT_LEAD).total_seconds(), intent)

    def pop_due(self) -> Iterator[Execution]:
        """Those whose instant has come, in dispatch order."""
        now = self._clock.monotonic()
        for intent in in_dispatch_order(intent for at, intent in self._held.values() if at <= now):
            del self._held[intent.id]
            yield intent

    def next_at(self) -> float:
        """When the next one is to be sent, on the monotonic clock; inf when there is none."""
        return min((at for at, _intent in self._held.values()), default=math.inf)

    # ------------------------------------------------------------------ what happens in between
    def invalidate(self) -> None:
        """Ledger or plan have changed: intents held by now may have been revoked."""
        self._changed_at = self._clock.now()

    def needs_recheck(self, intent: Execution) -> bool:
        return self._changed_at is not None and intent.created_at <= self._changed_at

    def leave_time(self) -> bool:
        """Whether a round would make no intent late, or has been put off for long enough."""
        now = self._clock.monotonic()
        if self.next_at() - now <= ROUND_TAKES:
            self._put_off_at = min(self._put_off_at, now)
            if now - self._put_off_at < PUT_OFF_AT_MOST:
                return False
        self._put_off_at = math.inf
        return True
