"""A sentence as what it is made of: stored and handed on in no language, told in any.

``told("{address} doesn't answer", address="10.1.1.1")`` is ``{"msgid": "{address} doesn't answer", "params": {"address": "10.1.1.1"}}``,
plain JSON. A text of elsewhere – a robot's own words, a row of an older version – is a ``str`` and stays as it is. A param may be such a
sentence, too.
"""
from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, TypeGuard

Told = str | Mapping[str, Any]


class _Params(dict[str, Any]):
    """Values of a sentence; one that is missing must not hide the sentence behind an error."""

    def __missing__(self, key: str) -> str:
        return "?"


def told(msgid: str, /, **params: object) -> dict[str, Any]:
    """What a sentence is made of, as plain JSON. ``msgid`` is the English text with named placeholders."""
    return {"msgid": msgid, "params": {name: _plain(value) for name, value in params.items()}}


def made_of(error: BaseException) -> Told:
    """What an error says; one of ours has it as ``told``."""
    own = getattr(error, "told", None)
    return own if is_told(own) else str(error)


# What systems say most when a file can't be read or written (strerror of POSIX); anything else is told as the system has it.
SENTENCES = ("No such file or directory", "Permission denied", "Operation not permitted", "File exists", "Not a directory",
             "Is a directory", "No space left on device", "Disk quota exceeded", "Read-only file system", "Input/output error",
             "File name too long", "Too many open files", "Device or resource busy")


def of_system(error: OSError) -> Told:
    """What the operating system says about a file."""
    text = error.strerror or str(error)
    return {"msgid": text, "params": {}} if text in SENTENCES else text


def is_told(value: object) -> TypeGuard[Mapping[str, Any]]:
    """Whether it is a sentence in its parts."""
    return isinstance(value, Mapping) and isinstance(value.get("msgid"), str)


def tell(what: object, translate: Callable[[str], str] = lambda text: text) -> str:
    """The sentence in the language of ``translate``, in English without one. Never fails, whatever was stored."""
    if not is_told(what):
        return "" if what is None else str(what)
    msgid, given = what["msgid"], what.get("params")
    params = _Params({name: _in_words(value, translate) for name, value in given.items()} if isinstance(given, Mapping) else {})
    for text in (translate(msgid), msgid):                   # the second for a translation with a wrong placeholder
        try:
            return text.format_map(params)
        except (ValueError, TypeError, LookupError, AttributeError):
            continue
    return str(msgid)                                        # a sentence given whole, with braces of its own


def decimal(text: str, translate: Callable[[str], str]) -> str:
    """A number that is written with a point, as the language writes it."""
    whole, point, part = text.partition(".")
    return translate("{whole}.{part}").format(whole=whole, part=part) if point else text


class Decimal(float):
    """A number that stands in a sentence as the language writes it; without a format of its own no needless decimals."""

    def __new__(cls, value: float, translate: Callable[[str], str]) -> Decimal:
        new = super().__new__(cls, value)
        new._translate = translate
        return new

    _translate: Callable[[str], str]

    def __format__(self, spec: str) -> str:
        return decimal(float.__format__(self, spec) if spec else repr(float(self)).removesuffix(".0"), self._translate)


def _in_words(value: object, translate: Callable[[str], str]) -> object:
    if is_told(value):
        return tell(value, translate)
    return Decimal(value, translate) if isinstance(value, float) else value


def _plain(value: object) -> object:
    if isinstance(value, BaseException):
        return made_of(value)
    if is_told(value) or value is None or isinstance(value, str | int) or (isinstance(value, float) and math.isfinite(value)):
        return value
    return str(value)
