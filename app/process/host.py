"""The process that schedules on a data directory, with a window or headless: holds the lock, runs the loop, serves the inbox, and watches
that its lock stays in place, that it may open enough files, and the tablet itself.
"""

from __future__ import annotations

import contextlib
import logging
import queue
import signal
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial

from app import NAME, __version__
from app.container import Container
from app.failures import BadInput
from app.process import log_file
from app.process.data_directory import DataDirectory, InstanceLock, open_container
from app.process.demo import furnish
from app.process.inbox import Inbox
from app.process.requests import handlers
from app.process.service_manager import notify, watchdog
from app.process.tablet_readings import readings
from app.process.terminal import STOPPING, print_without_waiting
from app.services.files.daily_backup import DailyBackup
from app.services.live.changes import CachedUntilChanged, Topic
from app.services.live.tablet_troubles import Details, TabletTroubles, Trouble

log = logging.getLogger(__name__)

FILES_OF_THE_APP = 100  # open at a time: database, log, commands, check-ups, the window
FILES_OF_A_ROBOT = 3  # its connection, and two of its thread's to the database

DemoFleet = tuple[Sequence[tuple[str, str]], Mapping[str, str]]  # names and addresses of robots, guids of missions


@contextmanager
def host(
    directory: DataDirectory,
    *,
    demo: DemoFleet | None = None,
    with_window: bool = False,
) -> Iterator[Container]:
    """Open the data and schedule until the block ends. Raises BadInput when another process does, or when the database is damaged."""
    began = time.time()
    watchdog.rest()
    lock = InstanceLock(directory.path)
    lock.acquire()
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
            container.engine.add_chore("Putting back what a fleet's check-up left", container.fleet_check_ups.tick)
            watch(container, lock)
            watch_tablet(container)
            log.info("%s %s schedules on %s", NAME, __version__, directory.path)
            container.runner.start()
            watchdog.watch(container)
            yield container
        finally:
            watchdog.rest()
            container.close()
            log.info("stopped")
    finally:
        lock.release()


def run_headless(directory: DataDirectory, demo_robots: DemoFleet | None = None) -> int:
    """Returns the exit code, 0, after a stop was asked for."""
    # Not an Event: its lock may be held by the very wait that the signal interrupts, which would then never return.
    stop: queue.SimpleQueue[int] = queue.SimpleQueue()
    for number in STOPPING:
        signal.signal(number, lambda number, _frame: stop.put(number))
    try:
        log_file.start(directory.logs, stderr=True)
        with host(directory, demo=demo_robots) as container:
            if stop.empty():
                _say_ready(container, stop)
            _wait_for(stop, container)
            if damage := container.runner.damage:
                raise BadInput(damage.text)
    except Exception:
        for number in STOPPING:
            signal.signal(number, signal.SIG_DFL)  # its error is printed next, perhaps to a blocked terminal
        raise
    return 0


def _wait_for(stop: queue.SimpleQueue[int], container: Container) -> None:
    """Until a signal, or the database is found damaged. Waits at most a second at a time: a signal that arrives just before a wait begins
    does not end it."""
    while container.runner.damage is None:
        with contextlib.suppress(queue.Empty):
            stop.get(timeout=1.0)
            return


def _say_ready(container: Container, stop: queue.SimpleQueue[int]) -> None:
    """Once every robot has answered its first poll, or 5 s after the start (docs/interfaces.md)."""
    deadline = container.clock.monotonic() + 5.0
    while not container.engine.is_ready and container.clock.monotonic() < deadline and stop.empty():
        time.sleep(0.02)
    if stop.empty():
        print_without_waiting("ready")
        notify("READY=1")


def watch(container: Container, lock: InstanceLock) -> None:
    """Check the lock and the limit of open files. Each problem is an alarm while it lasts."""
    robots = CachedUntilChanged(
        lambda: sum(robot.enabled for robot in container.catalogue.robots()), container.changes, Topic.ROBOTS
    )
    for name, code, find in (
        ("Watching the lock", "lock_lost", lambda _is_on: None if lock.is_in_place else {"path": str(lock.path)}),
        ("Counting open files", "too_few_files", lambda _is_on: too_few_files(robots(), most_open_files())),
    ):
        trouble = Trouble(container.alarms, code, find, 0, 0, key="app")
        chore = partial(trouble.look, 0.0)  # the alarm comes and ends at once, whatever the time
        chore()
        container.engine.add_chore(name, chore)


def watch_tablet(container: Container) -> None:
    """Its disk, clock, battery and network."""
    robots = CachedUntilChanged(
        lambda: [robot.id for robot in container.catalogue.robots() if robot.enabled], container.changes, Topic.ROBOTS
    )
    troubles = TabletTroubles(
        readings(container.db.path),
        clock=container.clock,
        alarms=container.alarms,
        snapshots=container.snapshots,
        tablet=container.tablet,
        robots=robots,
    )
    container.engine.add_chore("Watching the tablet", troubles.tick)


def too_few_files(robots: int, allowed: int | None) -> Details | None:
    """Details of the alarm if that many robots need more open files than ``allowed`` (None: any number)."""
    needed = FILES_OF_THE_APP + FILES_OF_A_ROBOT * robots
    return (
        {"robots": robots, "needed": needed, "allowed": allowed} if allowed is not None and needed > allowed else None
    )


if sys.platform == "win32":

    def open_more_files() -> None:
        """Windows has no such limit."""

    def most_open_files() -> int | None:
        return None
else:
    import resource

    def open_more_files() -> None:
        """As many as the system lets this process have: a robot needs three, and 1,024 are usual."""
        _soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        with contextlib.suppress(ValueError, OSError):  # some systems report no limit, and have one
            resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))

    def most_open_files() -> int | None:
        soft, _hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        return None if soft == resource.RLIM_INFINITY else soft
