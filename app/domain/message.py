"""A sentence as its text and parameters: stored and passed on without a language, rendered in any.

``message("{address} doesn't answer", address="10.1.1.1")`` is ``{"msgid": "{address} doesn't answer", "params": {"address": "10.1.1.1"}}``,
plain JSON. A text from outside – a robot's, a row of an older version – is a ``str`` and stays as it is. A param may be a message, too;
and, in a sentence that isn't stored, a function of ``translate`` that writes it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, TypeGuard

from app.domain import names

Message = str | Mapping[str, Any]
LONGEST = 10_000  # characters of a sentence; stored ones may be hostile, with parts nested many times
_PLACEHOLDERS = re.compile(r"(?:[^{}]++|\{\w*(?:!r|:\.[0-9]f)?\}|\{\{|\}\})*+")  # without a width, which may be huge


class _Params(dict[str, Any]):
    """Values of the placeholders; a missing one stays as written instead of raising KeyError."""

    def __missing__(self, key: str) -> str:
        return "?"


def message(msgid: str, /, **params: object) -> dict[str, Any]:
    """A message as plain JSON. ``msgid`` is the English text with named placeholders."""
    return {"msgid": msgid, "params": {name: _plain(value) for name, value in params.items()}}


def message_of(error: BaseException) -> Message:
    """The message of an exception: its ``message`` if it is one of this app's, else its text."""
    own = getattr(error, "message", None)
    return own if is_message(own) else str(error)


# The most frequent reasons why a file can't be read or written (strerror of POSIX); any other is shown with the system's own text.
SENTENCES = (
    "No such file or directory",
    "Permission denied",
    "Operation not permitted",
    "File exists",
    "Not a directory",
    "Is a directory",
    "No space left on device",
    "Disk quota exceeded",
    "Read-only file system",
    "Input/output error",
    "File name too long",
    "Too many open files",
    "Device or resource busy",
)


def message_of_system(error: OSError) -> Message:
    """What the operating system says about a file."""
    text = error.strerror or str(error)
    return {"msgid": text, "params": {}} if text in SENTENCES else text


def is_message(value: object) -> TypeGuard[Mapping[str, Any]]:
    """Whether it is text and parameters, not a plain text."""
    return isinstance(value, Mapping) and isinstance(value.get("msgid"), str)


def render(what: object, translate: Callable[[str], str] = lambda text: text) -> str:
    """The sentence in the language of ``translate``, in English without one. Never fails on stored values."""
    try:
        return _rendered(what, translate)[:LONGEST]
    except RecursionError:
        return ""


def _rendered(what: object, translate: Callable[[str], str]) -> str:
    if not is_message(what):
        return "" if what is None else str(what)
    msgid, values = what["msgid"][:LONGEST], what.get("params")
    params = _Params(
        {name: _in_words(value, translate) for name, value in values.items()} if isinstance(values, Mapping) else {}
    )
    text = translate(msgid)
    if _PLACEHOLDERS.fullmatch(text):
        with suppress(ValueError, TypeError, LookupError, AttributeError):
            return text.format_map(params)
    return str(msgid)  # a sentence given whole, with braces of its own


def decimal(text: str, translate: Callable[[str], str]) -> str:
    """A number that is written with a point, as the language writes it."""
    whole, point, part = text.partition(".")
    return translate("{whole}.{part}").format(whole=whole, part=part) if point else text


class Decimal(float):
    """A number formatted in a sentence as the language writes it; without a format of its own no needless decimals."""

    def __new__(cls, value: float, translate: Callable[[str], str]) -> Decimal:
        new = super().__new__(cls, value)
        new._translate = translate
        return new

    _translate: Callable[[str], str]

    def __format__(self, spec: str) -> str:
        return decimal(float.__format__(self, spec) if spec else repr(float(self)).removesuffix(".0"), self._translate)


def _in_words(value: object, translate: Callable[[str], str]) -> object:
    if is_message(value):
        return render(value, translate)
    if callable(value):
        return value(translate)
    if isinstance(value, int):
        return value
    return Decimal(value, translate) if isinstance(value, float) else str(value)[:LONGEST]


def _plain(value: object) -> object:
    if isinstance(value, BaseException):
        return message_of(value)
    if (
        is_message(value)
        or callable(value)
        or value is None
        or isinstance(value, str | int)
        or (isinstance(value, float) and math.isfinite(value))
    ):
        return value
    return names.of_file(str(value))  # it may be a path
