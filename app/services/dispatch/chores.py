"""Small tasks done again and again on the scheduler's thread: exports, backups, requests of commands; and one of them, which watches for
robots of the list that are one machine."""

from __future__ import annotations

import logging
import math
import sqlite3
from collections.abc import Callable, Mapping, Sequence

from app.database.connection import DatabaseError
from app.domain.clock import Clock
from app.domain.message import message_of
from app.services.dispatch.timing import CHORES_EVERY
from app.services.live.alarms import Alarms

log = logging.getLogger(__name__)

SAME_MACHINE = "same_machine"


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


class SameMachine:
    """A chore: an alarm for each serial number that several robots have, as long as they have it. ``read``: names of these robots by serial
    number."""

    def __init__(self, read: Callable[[], Mapping[str, Sequence[str]]], alarms: Alarms) -> None:
        self._read, self._alarms = read, alarms
        self._known: Mapping[str, Sequence[str]] | None = None  # None: the list of alarms has earlier ones

    def tick(self) -> None:
        found = self._read()
        if found == self._known:
            return
        known = self._before() if self._known is None else self._known.keys()
        for number in known - found.keys():
            self._alarms.clear(SAME_MACHINE, _key(number))
        for number, names in found.items():  # an existing one only follows the names
            self._alarms.raise_(SAME_MACHINE, _key(number), robot=names[0], robots=", ".join(names), number=number)
        self._known = found

    def _before(self) -> set[str]:
        return {
            alarm.key.removeprefix(_key(""))
            for alarm in self._alarms.open()
            if alarm.code == SAME_MACHINE and alarm.cleared_at is None
        }


def _key(serial_number: str) -> str:
    return f"serial:{serial_number}"
