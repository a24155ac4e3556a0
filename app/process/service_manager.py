"""What systemd hears from the app that it started: that it is ready, and for its watchdog that it still works (sd_notify(3)).

Without NOTIFY_SOCKET or WATCHDOG_USEC, which systemd sets, nothing happens.
"""

from __future__ import annotations

import contextlib
import logging
import math
import os
import socket
import threading
import time
from collections.abc import Callable

from app.container import Container
from app.database.errors import DatabaseError

log = logging.getLogger(__name__)

TAKEN_WITHIN = 5.0  # s for systemd to take a message
FED_PER_TIMEOUT = 4  # times: one round that takes long is no reason to start again


def notify(state: str) -> None:
    """Without waiting. ``state`` is one assignment, such as READY=1. A message that can't be delivered is a line in the log."""
    threading.Thread(target=_send, args=(state,), name="systemd", daemon=True).start()


def _send(state: str) -> None:
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address:
        return
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as messages:
            messages.settimeout(TAKEN_WITHIN)
            messages.connect(f"\0{address[1:]}" if address.startswith("@") else address)
            messages.send(state.encode())
    except OSError as error:
        log.warning("systemd did not take %s: %s", state, error.strerror or error)


class Progress:
    """Of the engine's loop and of the database's writer. A round that fails, as on a full disk, is one too: starting again
    would not help."""

    def __init__(self, container: Container) -> None:
        self._container = container
        self._seen = (0, 0)

    def is_made(self) -> bool:
        """Whether both made some since the last call. Waits for an answer of the writer, for ever if there is none."""
        runner, db = self._container.runner, self._container.db
        if runner.damage is not None:  # both have ended, and a person is asked for a backup
            return True
        with contextlib.suppress(DatabaseError):
            db.write(lambda _connection: None)  # it may have nothing else to do
        seen, self._seen = self._seen, (runner.rounds, db.rounds)
        return all(now > before for now, before in zip(self._seen, seen, strict=True))


class Watchdog:
    """Feeds systemd's watchdog from a thread of its own: while nothing is watched, such as when a backup is asked for or restored, and
    otherwise only while what is watched makes progress, and always only while the window works, if there is one."""

    def __init__(self) -> None:
        self._is_fed: Callable[[], bool] = lambda: True
        self._thread: threading.Thread | None = None
        self._window_worked_at = math.inf  # there is none, or it is still being built

    def window_works(self) -> None:
        """The window calls it every second, from the loop that draws it and takes touches."""
        self._window_worked_at = time.monotonic()

    def watch(self, container: Container) -> None:
        self.feed_while(Progress(container).is_made)

    def rest(self) -> None:
        """Nothing is watched, and it is fed."""
        self.feed_while(lambda: True)

    def feed_while(self, is_fed: Callable[[], bool]) -> None:
        """``is_fed`` is called four times within the time-out that systemd has set."""
        self._is_fed = is_fed
        timeout = int(os.environ.get("WATCHDOG_USEC") or 0) / 1e6
        if timeout and self._thread is None:
            self._thread = threading.Thread(
                target=self._run, args=(timeout / FED_PER_TIMEOUT,), name="watchdog", daemon=True
            )
            self._thread.start()

    def _run(self, every: float) -> None:
        while True:
            time.sleep(every)
            is_window_stuck = time.monotonic() - self._window_worked_at > every
            if self._is_fed() and not is_window_stuck:
                _send("WATCHDOG=1")


watchdog = Watchdog()  # of this process
