"""Where finished log lines are written: each place has a bounded queue and a thread of its own, so that one that hangs delays nothing."""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from io import FileIO, RawIOBase
from itertools import pairwise
from pathlib import Path
from typing import Any, TextIO

from app.database.files import NO_LINK

MOST_WAITING = 1000  # lines that wait to be written; what comes then is left out and counted
WRITTEN_WITHIN = 0.5  # s that the end of the process waits for them

Write = Callable[[bytes], None]  # raises OSError
Edit = Callable[[logging.LogRecord, str], str | None]


class _LeftOut:
    """Stands in the queue for lines that found no room in it."""

    lines = 0


class Sink(logging.Handler):
    """Formats on the thread that logs, as arguments may change afterwards, and writes on its own.

    Lines that found no room, or could not be written, are counted, and said as soon as it works again. ``edit`` may change a line, or leave
    it out: None. The thread holds no lock of ``logging``, whose end would wait for it.
    """

    def __init__(
        self, name: str, write: Write, formatter: logging.Formatter, edit: Edit = lambda _record, line: line
    ) -> None:
        super().__init__()
        self.setFormatter(formatter)
        self._write, self._edit = write, edit
        self._waiting: queue.SimpleQueue[str | _LeftOut | Future[bool] | None] = queue.SimpleQueue()
        self._left_out: _LeftOut | None = None  # the newest thing in the queue, if that is one
        threading.Thread(target=self._run, name=f"log-{name}", daemon=True).start()

    def emit(self, record: logging.LogRecord) -> None:
        line = self._edit(record, self._line(record))
        if line is None:
            return
        if self._waiting.qsize() < MOST_WAITING:
            self._left_out = None
            self._waiting.put(line)
            return
        if self._left_out is None:
            self._left_out = _LeftOut()
            self._waiting.put(self._left_out)
        self._left_out.lines += 1

    def _line(self, record: logging.LogRecord) -> str:
        try:
            return self.format(record)
        except (
            Exception
        ) as error:  # of a call whose arguments don't fit its text: never an error of the thread that logs
            return self.format(_record(record.levelno, f"{record.msg!r} could not be formatted: {error!r}"))

    def flush(self) -> None:
        self.is_written()

    def is_written(self, within: float = WRITTEN_WITHIN) -> bool:
        """Whether the last line is. Waits so many seconds for that, at most."""
        written: Future[bool] = Future()
        self._waiting.put(written)
        try:
            return written.result(within)
        except TimeoutError:
            return False

    def close(self) -> None:
        self._waiting.put(None)
        super().close()

    def _run(self) -> None:
        left_out, works = 0, True
        while (waiting := self._waiting.get()) is not None:
            line = ""
            if isinstance(waiting, Future):
                waiting.set_result(works)
            elif isinstance(waiting, _LeftOut):
                left_out += waiting.lines
            else:
                line = waiting
            try:
                if left_out:
                    self._write(_encoded(self.format(_record(logging.WARNING, f"{left_out} lines were left out"))))
                    left_out = 0
                if line:
                    self._write(_encoded(line))
                    works = True
            except OSError:
                left_out, works = left_out + (1 if line else 0), False


def _record(level: int, text: str) -> logging.LogRecord:
    return logging.LogRecord(__name__, level, __file__, 0, text, (), None)


def _encoded(line: str) -> bytes:
    return f"{line}\n".encode(errors="backslashreplace")


def unbuffered(stream: TextIO) -> Write:
    """Past Python's buffer, whose lock, held by a thread that hangs, would abort the process at its end."""
    raw: Any = getattr(stream.buffer, "raw", stream.buffer)
    return lambda data: write_all(raw, data)


def write_all(raw: RawIOBase, data: bytes) -> None:
    """Raises OSError, also where it would have to wait in a file that must not."""
    while data:
        if not (written := raw.write(data)):
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        data = data[written:]


class RotatingFile:
    """A file that only its owner can read. At ``most`` bytes a new one is begun, and ``kept`` older ones stay: ``name.1`` is the newest.

    Raises OSError when it can't be opened.
    """

    def __init__(self, path: Path, most: int, kept: int) -> None:
        self._path, self._most, self._kept = path, most, kept
        self._file: FileIO | None = self._open()

    def write(self, data: bytes) -> None:
        """Raises OSError."""
        if self._file is not None and self._size >= self._most:
            self._rotate()
        if self._file is None:
            self._file = self._open()
        write_all(self._file, data)
        self._size += len(data)

    def _open(self) -> FileIO:
        file = FileIO(self._path, "a", opener=_private)
        self._size = os.fstat(file.fileno()).st_size
        return file

    def _rotate(self) -> None:
        """The older ones move up only when the present one could be renamed: on Windows another process may have it open."""
        if self._file is not None:
            self._file.close()  # Windows renames no open file
            self._file = None
        names = [self._path.with_name(f"{self._path.name}.{number}") for number in range(self._kept + 1)]
        try:
            os.replace(self._path, names[0])
        except OSError:
            return  # and goes on in it
        for newer, older in reversed(list(pairwise(names))):
            with contextlib.suppress(FileNotFoundError):
                os.replace(newer, older)


def _private(path: str, flags: int) -> int:
    return os.open(path, flags | NO_LINK, 0o600)
