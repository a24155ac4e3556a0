"""How a one-shot command asks the app that is running on the same data directory: a request file in, an answer file
out.

Only the process that holds the lock writes the database. A request is written under another name and renamed, so it is
read whole or not at all. Its data are in a separate file, only for their owner, which is deleted as soon as it is read.
A file without a request, left by a killed command, is deleted after a minute, as it may contain passwords.
"""

from __future__ import annotations

import json
import logging
import os
import time
import uuid
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from app.container import Container
from app.database.files import write_whole
from app.domain.models import InvalidInput
from app.failures import BadInput, Failure
from app.process.data_directory import DataDirectory, InstanceLock, open_container

log = logging.getLogger(__name__)

Handler = Callable[[Mapping[str, Any]], Mapping[str, Any] | None]  # None: not yet answered, ask again at the next tick


LEFT_FOR = 60.0  # s that a file without a request may exist: one being written, or an answer being fetched
WAIT_FOR_COMMAND = 0.1  # s between looks whether another command has ended
_IN_THE_WAY = "{} is not a directory: remove it"
_SUFFIXES = (".request", ".content", ".draft", ".answer", ".withdrawn")


class NoAnswer(Exception):
    """The running app did not answer in time."""


class HolderEnded(NoAnswer):
    """The process that held the data directory ended without an answer. The request is withdrawn; it may have been begun."""


class Interrupted(Exception):
    """Interrupted by a signal. ``answer``: the app's, after it had ended its work; None: none in time."""

    def __init__(self, answer: Mapping[str, Any] | None) -> None:
        super().__init__(answer)
        self.answer = answer


class Inbox:
    """The running app's side: ``tick`` looks for requests and answers them.

    ``since``: when this app began, in s since the epoch. Older requests were meant for an app that has ended, as have their commands.
    Decided once, here: a clock that is set back later must not make new requests look old.
    """

    def __init__(self, data_dir: Path, handlers: Mapping[str, Handler], since: float = 0.0) -> None:
        self._directory = _directory_in(data_dir)
        self._handlers = handlers
        self._seen: dict[str, float] = {}  # files without a request, and when they were first seen (monotonic)
        for name in self._files():
            path = self._directory / name
            if path.suffix in _SUFFIXES and path.stat().st_mtime < since:
                log.warning("%s was left by a command that has ended, and is not carried out", name)
                path.unlink(missing_ok=True)

    def tick(self) -> None:
        """Raises OSError, or BadInput where something else is in the way, until the directory is there again: a command makes it."""
        try:
            names = self._files()
        except NotADirectoryError:
            raise BadInput(_IN_THE_WAY.format(self._directory)) from None
        for name in sorted(name for name in names if name.endswith(".request")):
            self._take(self._directory / name)
        if self._seen or names:
            self._sweep(names)

    def _files(self) -> set[str]:
        with os.scandir(self._directory) as entries:
            return {entry.name for entry in entries if entry.is_file(follow_symlinks=False)}

    def _sweep(self, names: set[str]) -> None:
        """Timed by the monotonic clock, from when they were seen."""
        now = time.monotonic()
        left = {name for name in names if name.endswith(_SUFFIXES) and f"{name.partition('.')[0]}.request" not in names}
        self._seen = {name: self._seen.get(name, now) for name in left}
        for name in [name for name, since in self._seen.items() if now - since > LEFT_FOR]:
            log.warning("%s was left by a command that has ended, and is deleted", name)
            (self._directory / name).unlink(missing_ok=True)

    def _take(self, path: Path) -> None:
        answer: Mapping[str, Any] | None
        try:
            request = {**json.loads(path.read_text(encoding="utf-8")), "content": path.with_suffix(".content")}
            answer = self._handlers[request["kind"]](request)
        except (BadInput, InvalidInput) as error:
            answer = {"exit": 2, "error": str(error)}
        except Exception as error:  # the answer reports it; the app continues
            log.exception("The request %s could not be served", path.name)
            answer = {"exit": 1, "error": f"the running app could not do it: {type(error).__name__}"}
        if answer is not None and path.exists():  # else no command waits for the answer
            write_whole(path.with_suffix(".answer"), json.dumps(answer).encode())
            path.unlink(missing_ok=True)


def ask(
    data_dir: Path,
    kind: str,
    *,
    timeout: float,
    has_holder_ended: Callable[[], bool],
    content: bytes | None = None,
    put_back_within: float = 0.0,
    **request: Any,
) -> dict[str, Any]:
    """The command's side: send a request, with bytes that the handler finds in the file ``request["content"]``, and
    wait for the answer.

    ``timeout`` in seconds bounds the whole wait. Raises NoAnswer when it passes, HolderEnded when the other process
    ended first. A command that is interrupted withdraws its request, and waits ``put_back_within`` s for the app to end
    its work: then it raises Interrupted.
    """
    directory = _directory_in(data_dir)
    path = directory / f"{uuid.uuid4().hex}.request"
    try:
        if content is not None:
            write_whole(path.with_suffix(".content"), content)
        write_whole(path, json.dumps({"kind": kind, "id": path.stem, **request}).encode())
    except OSError as error:
        path.with_suffix(".content").unlink(missing_ok=True)
        raise BadInput(f"{directory} can't be written: {error.strerror}; nothing was changed") from error
    try:
        return _answer_to(path, timeout, has_holder_ended)
    except KeyboardInterrupt:
        if not put_back_within:
            raise
        withdrawn(path).touch()
        try:
            answer = _answer_to(path, put_back_within, has_holder_ended)
        except NoAnswer:
            answer = None
        raise Interrupted(answer) from None
    finally:
        for suffix in _SUFFIXES:
            path.with_suffix(suffix).unlink(missing_ok=True)


def here_or_by_the_running_app(
    directory: DataDirectory,
    here: Callable[[Container], dict[str, Any]],
    kind: str,
    timeout: float,
    *,
    is_taken_over: bool = True,
    **request: Any,
) -> dict[str, Any]:
    """Run it in this process if no other one holds the data directory, else ask the holder. Waits for a command that
    holds it, as commands serve no requests. If an app ends without an answer, this process tries again: running a
    request twice must give the same result. Long ones are not ``is_taken_over``: the app could not be started again in
    that time. Raises NoAnswer if a running app does not answer within ``timeout`` s, or ends without a successor.
    """
    while True:
        lock = InstanceLock(directory.path)
        if lock.try_acquire():
            try:
                container = open_container(directory)
                try:
                    return here(container)
                except InvalidInput as error:
                    raise BadInput(str(error)) from None
                finally:
                    container.db.close()
            finally:
                lock.release()
        if lock.is_held_by_command:
            time.sleep(WAIT_FOR_COMMAND)
            continue
        try:
            return ask(directory.path, kind, timeout=timeout, has_holder_ended=lambda: _is_free(directory), **request)
        except HolderEnded:
            if not is_taken_over:
                raise


def _is_free(directory: DataDirectory) -> bool:
    """Whether no process holds the data directory at this moment."""
    probe = InstanceLock(directory.path)
    free = probe.try_acquire()
    probe.release()
    return free


def raise_for(answer: dict[str, Any]) -> None:
    if error := answer.get("error"):
        raise BadInput(error) if answer.get("exit") == 2 else Failure(error)


def withdrawn(request: Path) -> Path:
    """The file that marks the request as withdrawn."""
    return request.with_suffix(".withdrawn")


def _answer_to(path: Path, timeout: float, has_holder_ended: Callable[[], bool]) -> dict[str, Any]:
    answer, deadline = path.with_suffix(".answer"), time.monotonic() + timeout
    while time.monotonic() < deadline:
        if answer.exists():
            return dict(json.loads(answer.read_text(encoding="utf-8")))
        # An app that was started at once takes the request away, which was asked of the one before.
        if (has_holder_ended() or not path.exists()) and not answer.exists():
            raise HolderEnded("the app that was running ended before it answered")
        time.sleep(0.05)
    raise NoAnswer(f"the running app did not answer within {timeout:.0f} s")


def _directory_in(data_dir: Path) -> Path:
    """Made if it is missing. Raises BadInput."""
    directory = data_dir / "inbox"
    try:
        directory.mkdir(mode=0o700, exist_ok=True)
    except FileExistsError:
        raise BadInput(_IN_THE_WAY.format(directory)) from None
    except OSError as error:
        raise BadInput(
            f"{directory} can't be made: {error.strerror}; check the permissions of the data directory"
        ) from None
    return directory
