"""The machine of a data directory. On another machine it is a copy, which sends nothing until a person has decided its
purpose."""

from __future__ import annotations

import logging
import sqlite3
import uuid
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from app.database.connection import Database
from app.database.settings import SettingsRepository
from app.domain import rules
from app.domain.clock import Clock
from app.domain.message import message
from app.domain.models import Execution
from app.services.live.holds import Holds
from app.services.live.windows import registry_value

log = logging.getLogger(__name__)

MACHINE, MOVED, LOOKED_AT = "machine", "moved", "looked_at_on"  # names in the settings
MACHINE_IDS = "/etc/machine-id", "/var/lib/dbus/machine-id"
IS_COPY = message("this data was copied from another tablet: say whether it moves here or is only looked at")
IS_VIEW_ONLY = message("this data is only looked at here, another tablet starts its missions")


@dataclass(frozen=True)
class Move:
    """The plan moved here from another tablet, whose tokens were made with ``old_install_id``."""

    at: datetime
    old_install_id: str


def machine_id() -> str | None:
    """An identifier of this machine that survives a restart; None if the system has none."""
    guid = registry_value("HKEY_LOCAL_MACHINE", r"SOFTWARE\Microsoft\Cryptography", "MachineGuid")
    if found := guid or next(filter(None, map(_content, MACHINE_IDS)), ""):
        return str(
            uuid.uuid5(uuid.NAMESPACE_OID, f"amr-scheduler/{found}")
        )  # itself it is not to be shown (machine-id(5))
    return network_id()


def network_id() -> str | None:
    """Of a network adapter, which a dock or a VPN may change. None if the system has none."""
    node = uuid.getnode()
    return None if node & 1 << 40 else f"{node:012x}"  # a random number has that bit (uuid.getnode)


def _content(path: str) -> str:
    try:
        return Path(path).read_text(encoding="ascii").strip()
    except (OSError, ValueError):
        return ""


class Tablet:
    def __init__(self, db: Database, clock: Clock, holds: Holds, machine: str | None) -> None:
        self._db, self._settings = db, SettingsRepository()
        self._clock, self._holds, self._machine = clock, holds, machine
        self.move: Move | None = None
        self.has_no_network = False  # by tablet_troubles: no robot can be reached, whichever

    def begin(self) -> None:
        """At the start: a directory that no machine has yet becomes this one's; a copy is held."""
        c = self._db.read()
        stored = {name: self._settings.get(c, name) for name in (MACHINE, LOOKED_AT)}
        names = [name for name, value in stored.items() if self._is_my_network(value)]
        if stored[MACHINE] is None:
            names.append(MACHINE)
        if names and self._machine is not None:
            self._db.write(lambda c: self._put_machine(c, names))
        if self.is_copy:
            log.warning("This data directory was copied from another tablet: nothing is sent from here")
        self._judge()

    def _is_my_network(self, stored: object) -> bool:
        """Earlier versions knew a machine with Windows by its network only."""
        return isinstance(stored, str) and len(stored) == 12 and stored == network_id() != self._machine

    def _put_machine(self, c: sqlite3.Connection, names: Iterable[str]) -> None:
        for name in names:
            self._settings.put(c, name, self._machine)

    def _judge(self) -> None:
        c = self._db.read()
        self.move = stored_move(self._settings, c)
        why = IS_VIEW_ONLY if self._settings.get(c, LOOKED_AT) == self._machine else IS_COPY
        self._holds.is_copy = why if self.is_copy else None
        self._holds.announce()

    @property
    def is_copy(self) -> bool:
        home = self._settings.get(self._db.read(), MACHINE)
        return None not in (home, self._machine) and home != self._machine

    def move_here(self) -> bool:
        """The old tablet is off: its starts are looked for by its tokens, and this one makes its own tokens from now
        on. Returns whether there was anything to decide."""
        if not self.is_copy:
            return False

        def work(c: sqlite3.Connection) -> None:
            old, now = self._settings.install_id(c), self._clock.now()
            self._settings.put(c, MOVED, {"at": now.isoformat(), "old_install_id": old})
            self._settings.put(c, "install_id", str(uuid.uuid4()))
            self._settings.put(c, MACHINE, self._machine)

        self._db.write(work)
        self._judge()
        return True

    def view_only(self) -> None:
        """The old tablet continues: nothing is ever sent from here."""
        if self.is_copy:
            self._db.write(lambda c: self._settings.put(c, LOOKED_AT, self._machine))
            self._judge()


def stored_move(settings: SettingsRepository, c: sqlite3.Connection) -> Move | None:
    """Raises ValueError, LookupError or TypeError when it can't be read."""
    stored = settings.get(c, MOVED)
    return stored and Move(datetime.fromisoformat(stored["at"]), stored["old_install_id"])


def old_token(move: Move | None, row: Execution) -> str | None:
    """The token with which the old tablet would have sent this start; None: none."""
    if move is None or row.schedule_id is None:
        return None
    return rules.token_of(move.old_install_id, row.schedule_id, row.planned_at)
