"""The machine of a data directory, and its place there. On another machine, or in another place, it is a copy, which sends
nothing until a person has decided its purpose."""

from __future__ import annotations

import logging
import os
import sqlite3
import uuid
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from app.database.connection import Database
from app.database.settings import SettingsRepository
from app.domain import rules
from app.domain.clock import Clock
from app.domain.execution import Execution
from app.domain.message import Message, message
from app.domain.models import InvalidInput
from app.services.live.holds import Holds
from app.services.live.windows import registry_value

log = logging.getLogger(__name__)

MACHINE, PLACE, MOVED, LOOKED_AT = "machine", "place", "moved", "looked_at_on"  # names in the settings
MACHINE_IDS = "/etc/machine-id", "/var/lib/dbus/machine-id"
IS_COPY = message("this data was copied from another tablet: say whether it moves here or is only looked at")
IS_VIEW_ONLY = message("this data is only looked at here, another copy of it starts its missions")


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
    node = uuid.getnode()  # of a network adapter, which a dock or a VPN may change
    return None if node & 1 << 40 else f"{node:012x}"  # a random number has that bit (uuid.getnode)


def _content(path: str) -> str:
    try:
        return Path(path).read_text(encoding="ascii").strip()
    except (OSError, ValueError):
        return ""


def place_of(directory: Path) -> dict[str, Any]:
    """Its path, and its number in its file system, which it keeps when it is renamed."""
    return {"path": os.path.normcase(directory.resolve()), "number": directory.stat().st_ino}


def _is_same(stored: Mapping[str, Any] | None, now: Mapping[str, Any]) -> bool:
    """Whether data that were in the first place are now in the second, and not in both. Not all file systems keep numbers,
    and none gives them only once."""
    if stored is None or stored["path"] == now["path"]:  # earlier versions know none
        return True
    return bool(now["number"]) and stored["number"] == now["number"] and not os.path.lexists(stored["path"])


class Tablet:
    def __init__(self, db: Database, clock: Clock, holds: Holds, machine: str | None) -> None:
        self._db, self._settings = db, SettingsRepository()
        self._clock, self._holds, self._machine, self._place = clock, holds, machine, place_of(db.path.parent)
        self.move: Move | None = None
        self.is_in_use: Callable[[Path], bool] = lambda _directory: False  # whether an app runs on a data directory
        self.has_no_network = False  # by tablet_troubles: no robot can be reached, whichever

    def begin(self) -> None:
        """At the start: a directory that no machine has yet becomes this one's; a copy is held. One that was renamed, or
        restored in its place, is none."""
        if self._stored(MACHINE) is None and self._machine is not None:
            self._db.write(lambda c: self._settings.put(c, MACHINE, self._machine))
        if self.is_copy:
            log.warning("This data directory is a copy: nothing is sent from here")
        elif self._stored(PLACE) != self._place:
            self._db.write(lambda c: self._settings.put(c, PLACE, self._place))
        self._judge()

    def _judge(self) -> None:
        self.move = stored_move(self._settings, self._db.read())
        why: Message = IS_COPY
        if self._stored(LOOKED_AT) == self._machine:
            why = IS_VIEW_ONLY
        elif original := self._original():
            why = message(
                "this data was copied from {directory}: say whether it moves here or is only looked at",
                directory=original,
            )
        self._holds.is_copy = why if self.is_copy else None
        self._holds.announce()

    @property
    def is_copy(self) -> bool:
        home, place = self._stored(MACHINE), self._stored(PLACE)
        return None not in (home, self._machine) and (home != self._machine or not _is_same(place, self._place))

    def _original(self) -> str | None:
        """The directory on this machine from which the data were copied, or this one."""
        is_here = self._stored(MACHINE) == self._machine
        return (self._stored(PLACE) or self._place)["path"] if is_here else None

    def _stored(self, name: str) -> Any:
        return self._settings.get(self._db.read(), name)

    def move_here(self) -> bool:
        """The old tablet is off: its starts are looked for by its tokens, and this one makes its own tokens from now
        on. Returns whether there was anything to decide. Raises InvalidInput while an app runs on the original."""
        if not self.is_copy:
            return False
        if (original := self._original()) and self.is_in_use(Path(original)):
            raise InvalidInput(
                "directory",
                "an app still runs on {directory}, from which this data was copied: close it first",
                directory=original,
            )

        def work(c: sqlite3.Connection) -> None:
            old, now = self._settings.install_id(c), self._clock.now()
            self._settings.put(c, MOVED, {"at": now.isoformat(), "old_install_id": old})
            self._settings.put(c, "install_id", str(uuid.uuid4()))
            self._settings.put(c, MACHINE, self._machine)
            self._settings.put(c, PLACE, self._place)

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
