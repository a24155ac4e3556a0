"""Where log lines go: one line per event, on stderr (headless) in brief and with tracebacks into a rotating file."""

from __future__ import annotations

import logging
import sys
import threading
from pathlib import Path
from time import monotonic
from types import TracebackType

from app.failures import BadInput
from app.process.log_sink import RotatingFile, Sink, unbuffered

FILE_NAME = "amr-scheduler.log"
BYTES, FILES = 1_000_000, 5
LONGEST, LONGEST_TRACE = 2000, 8000  # bytes of a message, and of one with a traceback
OF_A_ROBOT = "worker-"  # begins the name of a thread that talks to one robot
BURST, AN_HOUR = 64_000, 24_000  # bytes that such a thread may write at once, and on average: what a busy robot needs
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
    """Keeps a robot about which there is something to say at every poll from pushing everything else out of the file."""

    def __init__(self) -> None:
        self._shares: dict[
            str, tuple[float, float, int]
        ] = {}  # by thread: bytes left, when that was, lines left out since

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


def start(directory: Path, *, stderr: bool, only_to_read: bool = False) -> None:
    """Set the root logger up, once per process. If the file can't be written, ``only_to_read`` goes on without it; otherwise raises
    BadInput."""
    global _file
    root = logging.getLogger()
    root.setLevel(logging.INFO)
    path = directory / FILE_NAME
    try:
        directory.mkdir(mode=0o700, exist_ok=True)
        file = RotatingFile(path, BYTES, FILES)
    except OSError as error:
        if not only_to_read:
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
    """On stderr it would hold up the thread that it comes from, where that stands still."""
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


def note_crash(error: BaseException) -> str:
    """Write the traceback into the log file; returns the words that say where it is, or what went wrong where there is no file (any
    more: that of ``--demo`` goes with its directory)."""
    record = log.makeRecord(
        log.name, logging.CRITICAL, __file__, 0, "Unexpected error", (), (type(error), error, error.__traceback__)
    )
    if _file is not None:
        path, sink = _file
        sink.handle(record)
        if sink.is_written() and path.exists():
            return f"; details in {path}"
    return f" ({str(error)[:200]})"
