"""Whoever sits at the terminal of a command: asked before something moves, and what it begins is ended well when they leave."""
from __future__ import annotations

import signal
import sys
from typing import NoReturn

from app.failures import BadInput

ENDING = [signal.SIGTERM, *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else ())]        # the last one: its terminal was closed


def ask(says: str) -> None:
    """They are told what will happen on the robot. Elsewhere the option itself is the agreement. Raises BadInput unless they say yes."""
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
    """From now on what ends this process does so as Ctrl-C does, so that a robot is put back at once."""
    for number in ENDING:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _interrupt)


def _interrupt(_number: int, _frame: object) -> NoReturn:
    """A further one changes nothing."""
    for number in ENDING:
        signal.signal(number, signal.SIG_IGN)
    raise KeyboardInterrupt
