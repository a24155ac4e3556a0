"""Checks of values that people write: commands of /sim, profiles. Each raises ``WrongValue`` with a sentence."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TypeVar
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from mir_sim.definition import is_number

T = TypeVar("T")


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


def span(value: Any, name: str) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise WrongValue(f"{name} must be a list of the least and the most seconds.")
    least, most = (number(one, f"each of {name}", 0, 3600) for one in value)
    if least > most:
        raise WrongValue(f"{name} must begin with the smaller number.")
    return least, most


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


def read_json(path: Path, check: Callable[[Any], T]) -> T:
    """What ``check`` makes of the content of a JSON file. Raises WrongValue, which names the file."""
    try:
        return check(json.loads(path.read_text(encoding="utf-8-sig")))
    except WrongValue as error:
        raise WrongValue(f"{path}: {error}") from None
    except OSError as error:
        raise WrongValue(f"{path} cannot be read: {error.strerror or error}.") from None
    except UnicodeDecodeError:
        raise WrongValue(f"{path} is not UTF-8.") from None
    except (ValueError, RecursionError) as error:
        raise WrongValue(f"{path} is not JSON: {error}.") from None
