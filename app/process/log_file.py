"""Destinations of log lines: one line per event, in brief on stderr (headless) and with tracebacks in a rotating file.
Each has a bounded queue and its own thread, so that one that hangs delays nothing else.
"""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import queue
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from io import FileIO, RawIOBase
from itertools import pairwise
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, TextIO

from app.database.files import NO_LINK
from app.failures import BadInput

FILE_NAME = "amr-scheduler.log"
BYTES, FILES = 1_000_000, 5
LONGEST, LONGEST_TRACE = 2000, 8000  # bytes of a message, and of one with a traceback
OF_A_ROBOT = "worker-"  # begins the name of a thread that talks to one robot
BURST, AN_HOUR = 64_000, 24_000  # bytes that such a thread may write at once, and on average: the need of a busy robot
OF_ALL, OF_ALL_AN_HOUR = (
    800_000,
    100_000,
)  # the same for all of them together: in a day not much more than half of the files
NEW_LINE = " ⏎ "  # where a line of a traceback or of a robot's text ended

log = logging.getLogger(__name__)

_file: tuple[Path, Sink] | None = None


def shortened(text: str, longest: int) -> str:
    """Its begin and its end, in at most so many bytes of UTF-8."""
    encoded = text.encode()
    if len(encoded) <= longest:
        return text
    half = longest // 2 - 4
    return encoded[:half].decode(errors="ignore") + " … " + encoded[-half:].decode(errors="ignore")


def one_line(text: str) -> str:
    """All lines joined into one, unprintable characters escaped: a robot's text could move a terminal's cursor or reverse its writing."""
    if text.isprintable():
        return text
    line = NEW_LINE.join(part.rstrip() for part in text.splitlines() if part.strip())
    return "".join(
        character if character.isprintable() else character.encode("unicode_escape").decode("ascii")
        for character in line
    )


class _OneLine(logging.Formatter):
    """For the terminal: no traceback, no line break."""

    def format(self, record: logging.LogRecord) -> str:
        text = shortened(one_line(" ".join(record.getMessage().split())), LONGEST)
        return f"{self.formatTime(record, '%Y-%m-%d %H:%M:%S')} {record.levelname:<7} {text}"


class _FileLine(logging.Formatter):
    """Everything, tracebacks too, on one line for each event."""

    def __init__(self) -> None:
        super().__init__("%(asctime)s %(levelname)-7s %(threadName)s %(name)s: %(message)s")

    def format(self, record: logging.LogRecord) -> str:
        return shortened(one_line(super().format(record)), LONGEST_TRACE if record.exc_info else LONGEST)


class _FairShare:
    """Keeps a robot with a message at every poll from pushing everything else out of the file."""

    def __init__(self) -> None:
        self._shares: dict[
            str, tuple[float, float, int]
        ] = {}  # by thread: bytes left, when that was, lines dropped since

    def __call__(self, record: logging.LogRecord, line: str) -> str | None:
        name = record.threadName or ""
        if not name.startswith(OF_A_ROBOT):
            return line
        now = monotonic()
        left, since, left_out = self._shares.setdefault(name, (BURST, now, 0))
        robots = len(self._shares)
        left = min(BURST, OF_ALL / robots, left + (now - since) * min(AN_HOUR, OF_ALL_AN_HOUR / robots) / 3600)
        if left_out:
            line = f"{line} (before it {left_out} lines of this robot were left out)"
        size = len(line.encode(errors="backslashreplace")) + 1
        fits = size <= left
        self._shares[name] = (left - size, now, 0) if fits else (left, now, left_out + 1)
        return line if fits else None


def start(directory: Path, *, stderr: bool, read_only: bool = False) -> None:
    """Set the root logger up, once per process. If the file can't be written, ``read_only`` continues without it;
    otherwise raises BadInput."""
    global _file
    root = logging.getLogger()
    root.setLevel(logging.INFO)
    path = directory / FILE_NAME
    try:
        directory.mkdir(mode=0o700, exist_ok=True)
        file = RotatingFile(path, BYTES, FILES)
    except OSError as error:
        if not read_only:
            raise BadInput(
                f"{path} can't be written: {error.strerror}; check the permissions of the data directory"
            ) from None
    else:
        sink = Sink("file", file.write, _FileLine(), _FairShare())
        root.addHandler(sink)
        _file = path, sink
    logging.getLogger("urllib3").setLevel(
        logging.ERROR
    )  # debug lines carry headers, warnings a traceback for each broken one
    if stderr and sys.stderr is not None:
        root.addHandler(Sink("stderr", unbuffered(sys.stderr), _OneLine()))
    _log_what_python_prints()


def _log_what_python_prints() -> None:
    """On a blocked stderr it would block the thread that logs."""
    logging.captureWarnings(True)
    sys.excepthook = _crashed
    threading.excepthook = lambda crash: _crashed(
        crash.exc_type, crash.exc_value or crash.exc_type(), crash.exc_traceback
    )
    sys.unraisablehook = lambda found: log.error(
        "%s %r",
        found.err_msg or "Exception ignored in",
        found.object,
        exc_info=(found.exc_type, found.exc_value or found.exc_type(), found.exc_traceback),
    )


def _crashed(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    log.critical("Unexpected error", exc_info=(kind, error, trace))


def log_crash(error: BaseException) -> str:
    """Write the traceback into the log file; returns the words that say where it is, or what went wrong without a file
    (that of ``--demo`` is removed with its directory)."""
    record = log.makeRecord(
        log.name, logging.CRITICAL, __file__, 0, "Unexpected error", (), (type(error), error, error.__traceback__)
    )
    if _file is not None:
        path, sink = _file
        sink.handle(record)
        if sink.is_written() and path.exists():
            return f"; details in {path}"
    return f" ({str(error)[:200]})"


MOST_WAITING = 1000  # lines that wait to be written; further ones are dropped and counted
WRITTEN_WITHIN = 0.5  # s that the end of the process waits for them

Write = Callable[[bytes], None]  # raises OSError
Edit = Callable[[logging.LogRecord, str], str | None]


class _LeftOut:
    """Represents dropped lines in the queue."""

    lines = 0


class Sink(logging.Handler):
    """Formats on the logging thread, as arguments may change afterwards, and writes on its own. Dropped or unwritten
    lines are counted and reported as soon as it works again. ``edit`` may change a line, or drop it (None). The thread
    holds no lock of ``logging``, whose shutdown would wait for it.
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
        """Older ones are renumbered only if the present one could be renamed, which on Windows fails while another
        process has it open; if one of those is open, all continues in the present one."""
        if self._file is not None:
            self._file.close()  # Windows renames no open file
            self._file = None
        names = [self._path.with_name(f"{self._path.name}.{number}") for number in range(self._kept + 1)]
        try:
            os.replace(self._path, names[0])
        except OSError:
            return  # and continues in it
        try:
            for newer, older in reversed(list(pairwise(names))):
                with contextlib.suppress(FileNotFoundError):
                    os.replace(newer, older)
        except OSError:
            os.replace(names[0], self._path)


def _private(path: str, flags: int) -> int:
    return os.open(path, flags | NO_LINK, 0o600)
