"""Where log lines go: one line per event on stderr (headless), everything with tracebacks into a rotating file."""
from __future__ import annotations

import logging
import logging.handlers
import os
import sys
import threading
import traceback
from pathlib import Path
from types import TracebackType

FILE_NAME = "amr-scheduler.log"
BYTES, FILES = 1_000_000, 5

_file: Path | None = None


class _OneLine(logging.Formatter):
    """Never a traceback, never a line break (a robot's text could carry one)."""

    def format(self, record: logging.LogRecord) -> str:
        text = " ".join(record.getMessage().split())
        return f"{self.formatTime(record, '%Y-%m-%d %H:%M:%S')} {record.levelname:<7} {text}"


class _OwnerOnly(logging.handlers.RotatingFileHandler):
    def _open(self):  # type: ignore[no-untyped-def]
        return open(self.baseFilename, self.mode, encoding=self.encoding, opener=lambda path, flags: os.open(path, flags, 0o600))


def start(directory: Path, *, stderr: bool) -> None:
    """Set the root logger up. Called once per life."""
    global _file
    directory.mkdir(mode=0o700, exist_ok=True)
    _file = directory / FILE_NAME
    handler = _OwnerOnly(_file, maxBytes=BYTES, backupCount=FILES, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)-7s %(threadName)s %(name)s: %(message)s"))
    root = logging.getLogger()
    root.setLevel(logging.INFO)
    root.addHandler(handler)
    logging.getLogger("urllib3").setLevel(logging.WARNING)       # its debug lines carry headers
    if stderr:
        console = logging.StreamHandler(sys.stderr)
        console.setFormatter(_OneLine())
        root.addHandler(console)
    sys.excepthook = _crashed
    threading.excepthook = lambda crash: _crashed(crash.exc_type, crash.exc_value or crash.exc_type(), crash.exc_traceback)


def _crashed(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    logging.getLogger(__name__).critical("Unexpected error", exc_info=(kind, error, trace))


def note_crash(error: BaseException) -> str:
    """Write the traceback into the log file; returns the words that say where it is."""
    if _file is None:
        return f" ({str(error)[:200]})"
    with open(_file, "a", encoding="utf-8") as file:
        file.write("".join(traceback.format_exception(error)))
    return f"; details in {_file}"
