"""How a one-shot command asks the app that is running on the same data directory: a request file in, an answer file out.

Only the process that holds the lock writes the database. A request is written beside and renamed, so it is read whole or not at all.
Bytes that belong to it lie in a file of their own, for their owner only, which is deleted as soon as it is read.
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

from app.database.files import NO_LINK
from app.failures import BadInput

log = logging.getLogger(__name__)

Handler = Callable[[Mapping[str, Any]], Mapping[str, Any] | None]     # None: not yet answered, ask again at the next tick


class NoAnswer(Exception):
    """The running app did not answer in time."""


class HolderGone(NoAnswer):
    """The process that held the data directory ended without an answer. The request is withdrawn; it may have been begun."""


class Inbox:
    """The running app's side: ``tick`` looks for requests and answers them.

    ``since``: when this app began, in s since the epoch. What lies there and is older was asked of one that is gone, and so is who asked.
    Looked at once, here: a clock that is set back later must not make new requests look old.
    """

    def __init__(self, data_dir: Path, handlers: Mapping[str, Handler], since: float = 0.0) -> None:
        self._directory = data_dir / "inbox"
        self._directory.mkdir(mode=0o700, exist_ok=True)
        self._handlers = handlers
        for path in (*self._directory.glob("*.request"), *self._directory.glob("*.content")):
            if path.stat().st_mtime < since:
                log.warning("%s was left by a command that is gone, and is not carried out", path.name)
                path.unlink(missing_ok=True)

    def tick(self) -> None:
        with os.scandir(self._directory) as entries:
            requests = sorted(entry.name for entry in entries if entry.name.endswith(".request"))
        for name in requests:
            self._take(self._directory / name)

    def _take(self, path: Path) -> None:
        answer: Mapping[str, Any] | None
        try:
            request = {**json.loads(path.read_text(encoding="utf-8")), "content": path.with_suffix(".content")}
            answer = self._handlers[request["kind"]](request)
        except Exception as error:       # the answer reports it; the app goes on
            log.exception("The request %s could not be served", path.name)
            answer = {"exit": 1, "error": f"the running app could not do it: {type(error).__name__}"}
        if answer is not None and path.exists():          # else nobody waits any more, who would take the answer away
            _write(path.with_suffix(".answer"), json.dumps(answer).encode())
            path.unlink(missing_ok=True)


def ask(data_dir: Path, kind: str, *, timeout: float, holder_is_gone: Callable[[], bool], content: bytes | None = None,
        **request: Any) -> dict[str, Any]:
    """The command's side: hand a request over, with bytes that the handler finds in the file ``request["content"]``, and wait for the
    answer.

    ``timeout`` in seconds bounds the whole wait. Raises NoAnswer when it passes, HolderGone when the other process ended first.
    """
    directory = data_dir / "inbox"
    directory.mkdir(mode=0o700, exist_ok=True)
    path = directory / f"{uuid.uuid4().hex}.request"
    try:
        if content is not None:
            _write(path.with_suffix(".content"), content)
        _write(path, json.dumps({"kind": kind, "id": path.stem, **request}).encode())
    except OSError as error:
        path.with_suffix(".content").unlink(missing_ok=True)
        raise BadInput(f"{directory} can't be written: {error.strerror}; nothing was changed") from error
    answer = path.with_suffix(".answer")
    deadline = time.monotonic() + timeout
    try:
        while time.monotonic() < deadline:
            if answer.exists():
                return dict(json.loads(answer.read_text(encoding="utf-8")))
            # An app that was started at once takes the request away, which was asked of the one before.
            if (holder_is_gone() or not path.exists()) and not answer.exists():
                raise HolderGone("the app that was running ended before it answered")
            time.sleep(0.05)
        raise NoAnswer(f"the running app did not answer within {timeout:.0f} s")
    finally:
        for left in (path, answer, path.with_suffix(".content")):
            left.unlink(missing_ok=True)


def _write(path: Path, content: bytes) -> None:
    draft = path.with_suffix(".draft")
    descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | NO_LINK, 0o600)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
        os.replace(draft, path)
    except OSError:
        draft.unlink(missing_ok=True)
        raise
