"""One backup a day, on a thread of its own, because a million rows take a third of a second."""

from __future__ import annotations

import logging
import math
import threading
from contextlib import suppress
from datetime import date

from app.database.backups import daily_backup
from app.database.connection import Database
from app.database.errors import DatabaseError
from app.domain.clock import Clock
from app.services.live.alarms import Alarms

log = logging.getLogger(__name__)

AGAIN_AFTER = 3600.0  # s, after one that failed


class DailyBackup:
    """``tick`` is called every now and then (a chore of the poll loop) and returns at once."""

    def __init__(self, db: Database, clock: Clock, alarms: Alarms) -> None:
        self._db, self._clock, self._alarms = db, clock, alarms
        self._made_on: date | None = None
        self._not_before = -math.inf  # monotonic
        self._thread: threading.Thread | None = None

    def tick(self) -> None:
        if self._thread and self._thread.is_alive():
            return
        if self._clock.now().date() != self._made_on and self._clock.monotonic() >= self._not_before:
            self._thread = threading.Thread(target=self.run, name="backup", daemon=True)
            self._thread.start()

    def run(self) -> None:
        """Make today's backup unless it exists. There is an alarm as long as it can't be made."""
        now = self._clock.now()
        with suppress(DatabaseError):  # the alarm can't be written now
            try:
                made = daily_backup(self._db.path, now)
            except DatabaseError as error:
                log.warning("%s", error)
                self._not_before = self._clock.monotonic() + AGAIN_AFTER
                self._alarms.raise_("backup_failed", "backup", problem=error.message)
            else:
                if made:
                    log.info("Backup %s made", made.name)
                self._alarms.clear("backup_failed", "backup")  # if it fails, the next look does it
                self._made_on = now.date()
