"""What the process watches of its own while it schedules: the lock of its data, and how many files it may open."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any

from app.container import CachedUntilChanged, Container
from app.process.lock import InstanceLock
from app.services.live.alarms import Alarms
from app.services.live.changes import Topic

FILES_OF_THE_APP = 100  # open at a time: database, log, commands, check-ups, the window
FILES_OF_A_ROBOT = 3  # its connection, and two of its thread's to the database

Details = Mapping[str, Any]


def watch(container: Container, lock: InstanceLock) -> None:
    """Begin to, before there are none left to open. Both are alarms as long as they last."""
    robots = CachedUntilChanged(
        lambda: sum(robot.enabled for robot in container.catalogue.robots()), container.changes, Topic.ROBOTS
    )
    for name, code, look in (
        ("Watching the lock", "lock_lost", lambda: None if lock.is_in_place else {"path": str(lock.path)}),
        ("Counting open files", "too_few_files", lambda: too_few_files(robots(), most_open_files())),
    ):
        chore = _while_it_lasts(container.alarms, code, look)
        chore()
        container.engine.add_chore(name, chore)


def _while_it_lasts(alarms: Alarms, code: str, look: Callable[[], Details | None]) -> Callable[[], None]:
    """A chore that raises the alarm when ``look`` returns its details, and ends it when that returns None."""
    before: list[Details | None] = []

    def chore() -> None:
        now = look()
        if before == [now]:
            return
        if now is None:
            alarms.clear(code, "app")
        else:
            alarms.raise_(code, "app", **now)
        before[:] = [now]

    return chore


def too_few_files(robots: int, allowed: int | None) -> Details | None:
    """Details of the alarm where that many robots need more open files than are ``allowed`` (None: any number)."""
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
    import contextlib
    import resource

    def open_more_files() -> None:
        """As many as the system lets this process have: a robot needs three, and 1,024 are usual."""
        _soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        with contextlib.suppress(ValueError, OSError):  # some systems say there is no limit, and have one
            resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))

    def most_open_files() -> int | None:
        soft, _hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        return None if soft == resource.RLIM_INFINITY else soft
