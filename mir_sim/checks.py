"""Checks of values that people write: commands of /sim, profiles. Each raises ``WrongValue`` with a sentence."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from mir_sim.definition import is_number


class WrongValue(ValueError):
    """A value can't be used; the text is a sentence that says why."""


def number(value: Any, name: str, low: float, high: float = math.inf) -> float:
    if not is_number(value) or not low <= value <= high:
        raise WrongValue(f"{name} must be a number {_span(low, high)}.")
    return float(value)


def whole(value: Any, name: str, low: int, high: float = math.inf) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise WrongValue(f"{name} must be a whole number {_span(low, high)}.")
    return value


def _span(low: float, high: float) -> str:
    return f"from {low:.10g}{f' to {high:.10g}' if high < math.inf else ''}"


def text(value: Any, name: str) -> str:
    if not isinstance(value, str) or not value:
        raise WrongValue(f"{name} must be a text.")
    return value


def boolean(value: Any, name: str) -> bool:
    if not isinstance(value, bool):
        raise WrongValue(f"{name} must be true or false.")
    return value


def zone(value: Any, name: str) -> str:
    key = text(value, name)
    try:
        ZoneInfo(key)
    except (ZoneInfoNotFoundError, ValueError, OSError):
        raise WrongValue(f"{name} must be a time zone such as Europe/Helsinki, not {key!r}.") from None
    return key


def one_of(value: Any, name: str, known: Iterable[str]) -> str:
    choices = list(known)
    if not isinstance(value, str) or value not in choices:
        raise WrongValue(f"{name} must be one of {', '.join(choices)}.")
    return value
