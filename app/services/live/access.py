"""The PIN before Settings: optional, stored only as a salted scrypt hash with the settings, never exported and never
logged.

It guards against accidental changes of the configuration, not against somebody who can read the database's file.
"""

from __future__ import annotations

import hashlib
import hmac
import itertools
import logging
import re
import secrets
import threading
from dataclasses import dataclass
from typing import Any

from app.database.connection import Database
from app.database.settings import WRONG_PINS, SettingsRepository
from app.domain.clock import Clock
from app.domain.models import InvalidInput
from app.services.live.alarms import Alarms
from app.services.live.changes import CachedUntilChanged, Changes, Topic

log = logging.getLogger(__name__)

SHORTEST, ADVISED, LONGEST = 4, 6, 8  # digits
TRIES = 5  # wrong tries in a row, after which every try is refused for WAIT_S; for twice as long after
WAIT_S, LONGEST_WAIT_S = (
    30.0,
    3600.0,
)  # each further one. Of the monotonic clock: setting the tablet's clock shortens nothing
ALARM_AFTER = 10  # wrong tries in a row
PIN = "settings_pin"  # of the row in the table of settings; not a field of ``Settings``, so never in a file
_ALARM = ("pin_guessed", "settings")
_DIGITS = (("salt", 32), ("hash", 64))  # hexadecimal
_COST = {"n": 2**14, "r": 8, "p": 1}  # scrypt as RFC 7914 recommends for logging in: 16 MiB and some 50 ms


def is_hash(stored: Any) -> bool:
    """Whether it has the form that ``set_pin`` stores: a backup may contain one whose comparison takes hours."""
    return (
        isinstance(stored, dict)
        and {name: stored.get(name) for name in _COST} == _COST
        and all(
            isinstance(stored.get(name), str) and re.fullmatch(f"[0-9a-f]{{{digits}}}", stored[name])
            for name, digits in _DIGITS
        )
    )


@dataclass(frozen=True)
class Verdict:
    """Result of one try: whether it was right; otherwise how many tries are left, or for how many seconds all tries are
    refused."""

    is_right: bool
    tries_left: int = TRIES
    wait_s: float = 0.0


def is_easy_to_guess(pin: str) -> bool:
    """One repeated digit, or consecutive digits: tried first by guessers."""
    steps = {(int(after) - int(before)) % 10 for before, after in itertools.pairwise(pin)}
    return len(steps) == 1 and steps <= {0, 1, 9}


class Access:
    """Asks for a PIN if one is set. A restart does not shorten a waiting time: it begins again."""

    def __init__(self, db: Database, clock: Clock, changes: Changes, alarms: Alarms) -> None:
        self._settings = settings = SettingsRepository()
        self._db, self._clock, self._changes, self._alarms = db, clock, changes, alarms
        self._wrong: int = settings.get(db.read(), WRONG_PINS, 0)
        self._closed_until = clock.monotonic() + _wait_after(self._wrong)
        self._stored = CachedUntilChanged(lambda: settings.get(db.read(), PIN), changes, Topic.SETTINGS)
        self._trying = threading.Lock()
        self._warn()  # a restored backup knows nothing of it

    def is_set(self) -> bool:
        return self._stored() is not None

    def set_pin(self, pin: str) -> None:
        """Set or change it. Raises InvalidInput."""
        if not (SHORTEST <= len(pin) <= LONGEST and pin.isascii() and pin.isdecimal()):
            raise InvalidInput("pin", "a PIN has {least} to {most} digits", least=SHORTEST, most=LONGEST)
        salt = secrets.token_bytes(16)
        self._put({"salt": salt.hex(), "hash": _hash(pin, salt), **_COST})
        log.info("A PIN for Settings was set")

    def remove(self) -> bool:
        """Whether there was one."""
        was_set = self.is_set()
        if was_set:
            self._put(None)
            log.info("The PIN for Settings was removed")
        return was_set

    def check(self, pin: str) -> Verdict:
        """One try after the other, each of some 50 ms. During the waiting time a right one is refused, too."""
        with self._trying:
            if (wait_s := self.wait_s()) > 0:
                return Verdict(False, 0, wait_s)
            stored = self._stored()
            if stored is None or hmac.compare_digest(_hash(pin, bytes.fromhex(stored["salt"])), stored["hash"]):
                self._reset()
                return Verdict(True)
            self._wrong += 1
            wait_s = _wait_after(self._wrong)
            self._closed_until = self._clock.monotonic() + wait_s
            self._db.write(lambda c: self._settings.put(c, WRONG_PINS, self._wrong))
            if wait_s:
                log.warning("%d wrong PINs for Settings in a row; none is taken for %d s", self._wrong, wait_s)
            self._warn()
            return Verdict(False, max(0, TRIES - self._wrong), wait_s)

    def wait_s(self) -> float:
        """Seconds for which every try is still refused."""
        return max(0.0, self._closed_until - self._clock.monotonic())

    # ------------------------------------------------------------------ inside
    def _warn(self) -> None:
        if self._wrong >= ALARM_AFTER:
            self._alarms.raise_(*_ALARM, tries=ALARM_AFTER)

    def _reset(self) -> None:
        """A right PIN, or none needed, ends the count of wrong ones."""
        if self._wrong:
            self._wrong, self._closed_until = 0, self._clock.monotonic()
            self._db.write(lambda c: self._settings.put(c, WRONG_PINS, 0))
            self._alarms.clear(*_ALARM)

    def _put(self, value: dict[str, Any] | None) -> None:
        self._db.write(lambda c: self._settings.put(c, PIN, value))
        self._reset()
        self._changes.publish(Topic.SETTINGS)


def _wait_after(wrong: int) -> float:
    """Seconds for which no PIN is accepted after this many wrong ones in a row: trying all of four digits then takes
    more than a year."""
    return min(WAIT_S * 2.0 ** min(wrong - TRIES, 20), LONGEST_WAIT_S) if wrong >= TRIES else 0.0


def _hash(pin: str, salt: bytes) -> str:
    return hashlib.scrypt(pin.encode(), salt=salt, **_COST, dklen=32).hex()
