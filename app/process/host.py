"""The process that schedules on a data directory: holds the lock, runs the loop, serves the inbox. Used with a window and headless."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

from app import NAME, __version__
from app.container import Container
from app.failures import BadInput
from app.process.data_directory import DataDirectory
from app.process.demo import furnish
from app.process.inbox import Inbox
from app.process.lock import AlreadyRunning, InstanceLock
from app.process.opening import open_container
from app.process.requests import handlers
from app.process.watching import watch
from app.services.files.daily_backup import DailyBackup

log = logging.getLogger(__name__)


@contextmanager
def host(
    directory: DataDirectory,
    *,
    demo: tuple[Sequence[tuple[str, str]], Mapping[str, str]] | None = None,
    with_window: bool = False,
) -> Iterator[Container]:
    """Open the data and schedule until the block ends. Raises BadInput when another process does, or when the database is damaged."""
    began = time.time()
    lock = InstanceLock(directory.path)
    try:
        lock.acquire()
    except AlreadyRunning as error:
        raise BadInput(str(error)) from None
    try:
        container = open_container(directory, with_window=with_window)
        try:
            if demo is not None:
                furnish(container, *demo)
            container.engine.add_chore("Serving commands", Inbox(directory.path, handlers(container), began - 1.0).tick)
            container.engine.add_chore(
                "The daily backup", DailyBackup(container.db, container.clock, container.alarms).tick
            )
            container.engine.add_chore("Asking what missions do", container.mission_actions.tick)
            container.engine.add_chore("Putting back what a check-up left", container.check_ups.tick)
            watch(container, lock)
            log.info("%s %s schedules on %s", NAME, __version__, directory.path)
            container.runner.start()
            yield container
        finally:
            container.close()
            log.info("stopped")
    finally:
        lock.release()
