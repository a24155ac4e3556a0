"""Small repeated work on the scheduler's thread: exports, backups, requests of commands."""

from __future__ import annotations

import logging
import math
import sqlite3
from collections.abc import Callable

from app.database.connection import DatabaseError
from app.domain.clock import Clock
from app.domain.message import message_of
from app.services.dispatch.timing import CHORES_EVERY
from app.services.live.alarms import Alarms

log = logging.getLogger(__name__)


class Chores:
    def __init__(self, clock: Clock, alarms: Alarms) -> None:
        self._clock, self._alarms = clock, alarms
        self._chores: dict[str, Callable[[], None]] = {}
        self._failing: set[str] = set()  # that failed the last time
        self._done_at = -math.inf

    def add(self, name: str, chore: Callable[[], None]) -> None:
        self._chores[name] = chore

    def do(self) -> None:
        """At most ten times a second. A failing one is tried again and does not delay others."""
        mono = self._clock.monotonic()
        if mono - self._done_at < CHORES_EVERY:
            return
        self._done_at = mono
        for name, chore in self._chores.items():
            try:
                chore()
            except (DatabaseError, sqlite3.Error):
                raise
            except Exception as error:
                if name not in self._failing:
                    self._failing.add(name)
                    log.exception("%s failed and is tried again", name)
                    self._alarms.raise_("chore_failed", f"chore:{name}", problem=message_of(error))
            else:
                if name in self._failing:
                    self._failing.discard(name)
                    self._alarms.clear("chore_failed", f"chore:{name}")
