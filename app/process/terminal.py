"""What a command prints; it asks before a robot moves, and ends cleanly when the terminal closes."""

from __future__ import annotations

import contextlib
import errno
import io
import logging
import os
import signal
import sys
import threading
from typing import NoReturn, TextIO

from app.command import program
from app.failures import BadInput
from app.process.log_file import Write, unbuffered

log = logging.getLogger(__name__)


def _known(*names: str) -> list[signal.Signals]:
    return [getattr(signal, name) for name in names if hasattr(signal, name)]


# SIGBREAK is Windows' Ctrl-Break, and its console being closed; SIGHUP the terminal being closed elsewhere
STOPPING, ENDING = _known("SIGINT", "SIGTERM", "SIGBREAK"), _known("SIGTERM", "SIGHUP", "SIGBREAK")


def use_utf8() -> None:
    """Every name can be printed in any locale. A closed stream is None and stays None."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(encoding="utf-8", errors="backslashreplace")


def say(text: str) -> None:
    """Print what a command has done. A failing stdout is only a warning, so that no script repeats the command."""
    try:
        if sys.stdout is None:
            raise OSError(errno.EBADF, os.strerror(errno.EBADF))
        print(text, flush=True)
    except OSError as error:
        _drop_rest_of(sys.stdout)
        problem = f"done, but stdout can't be written: {error.strerror}"
        log.warning(problem)
        print_error(problem)


def print_error(text: str) -> None:
    """One line on stderr, if possible. Unbuffered: a thread that hangs in the buffer would keep the process from
    ending."""
    if sys.stderr is not None:
        _write(unbuffered(sys.stderr), f"{program()}: {' '.join(text.split())}\n".encode(errors="backslashreplace"))


def _drop_rest_of(stream: TextIO | None) -> None:
    """Data still in its buffer would fail again when the process ends, and change its exit code."""
    if stream is None:
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def print_without_waiting(line: str) -> None:
    """On stdout, without waiting: it may be closed or blocked."""
    if sys.stdout is not None:
        threading.Thread(
            target=_write, args=(unbuffered(sys.stdout), f"{line}\n".encode()), name="stdout", daemon=True
        ).start()


def _write(write: Write, data: bytes) -> None:
    with contextlib.suppress(OSError):
        write(data)


def confirm(says: str) -> None:
    """People see what will happen on the robot. Without a terminal the option itself is the agreement. Raises BadInput
    unless they say yes."""
    answer = ""
    try:
        print(f"{says}\nGo on? [y/N] ", end="", file=sys.stderr, flush=True)
        answer = sys.stdin.readline()
    except KeyboardInterrupt:
        pass
    if not answer.endswith("\n"):
        print(file=sys.stderr)
    if answer.strip().casefold() not in ("y", "yes"):
        raise BadInput("nothing was asked of the robot")


def end_as_interrupted() -> None:
    """From now on all signals that end this process act like Ctrl-C, so that a trial on a robot is undone at once."""
    for number in ENDING:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _interrupt)


def _interrupt(_number: int, _frame: object) -> NoReturn:
    """A further one changes nothing."""
    for number in ENDING:
        signal.signal(number, signal.SIG_IGN)
    raise KeyboardInterrupt
