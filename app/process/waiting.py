"""What ``--run-now`` says while it waits, whichever process carries it out: both write what holds the start up into the database."""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager

from app.database.executions import ExecutionRepository
from app.domain.reasons import waiting_sentence
from app.failures import Failure
from app.process.data_directory import DataDirectory
from app.process.opening import open_for_reading
from app.process.terminal import complain

SAID_EVERY = 10.0  # s


@contextmanager
def said_while_waiting(directory: DataDirectory, token: str) -> Iterator[None]:
    """On stderr, for the start with this token; by a thread of its own, as stderr may stand still."""
    is_over = threading.Event()
    threading.Thread(target=_say, args=(directory, token, is_over), name="waiting", daemon=True).start()
    try:
        yield
    finally:
        is_over.set()


def _say(directory: DataDirectory, token: str, is_over: threading.Event) -> None:
    while not is_over.wait(SAID_EVERY):
        if text := _waits_for(directory, token):
            complain(text)


def _waits_for(directory: DataDirectory, token: str) -> str:
    try:
        with closing(open_for_reading(directory)) as db:
            start = ExecutionRepository().by_token(db.read(), token)
    except (Failure, sqlite3.Error):
        return ""
    if start is None:
        return "waiting for the process that uses the data directory"
    sentence = waiting_sentence(start)
    return sentence and f"{start.mission} on {start.robot or start.robot_group}: {sentence}"
