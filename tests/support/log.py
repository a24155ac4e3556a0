"""The log as a process has it, for tests in this one: the root logger and Python's hooks are restored afterwards."""

from __future__ import annotations

import logging
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from app.process import log_file
from app.process.log_file import Sink


@contextmanager
def kept_apart(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    root = logging.getLogger()
    before, level = list(root.handlers), root.level
    monkeypatch.setattr(log_file, "_file", None)
    for owner, hook in ((sys, "excepthook"), (sys, "unraisablehook"), (threading, "excepthook")):
        monkeypatch.setattr(owner, hook, getattr(owner, hook))
    yield
    logging.captureWarnings(False)
    for handler in set(root.handlers) - set(before):
        root.removeHandler(handler)
        handler.close()
    root.setLevel(level)


def written() -> None:
    """Wait until the threads of the log have caught up."""
    assert all(handler.is_written() for handler in logging.getLogger().handlers if isinstance(handler, Sink))


def file_in(directory: Path) -> str:
    """What the log file says."""
    written()
    return (directory / log_file.FILE_NAME).read_text(encoding="utf-8")
