"""How many examples: of hypothesis, and of cases that differ little."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import pytest
from _pytest.mark.structures import ParameterSet
from hypothesis import settings


def examples(number: int, **others: Any) -> settings:
    """``number`` examples in the profile "thorough", and in any other a share of them."""
    return settings(max_examples=max(5, number * settings().max_examples // 100), **others)


def first_of_each(cases: Mapping[str, Any], kind: Callable[[Any], object] = lambda _case: None) -> list[ParameterSet]:
    """Parameters by their names: of each kind, which may be one only, the default run has the first, and the night all."""
    seen: set[object] = set()
    found = []
    for name, case in cases.items():
        marks = pytest.mark.long if kind(case) in seen else ()
        seen.add(kind(case))
        found.append(pytest.param(*_values(case), id=name, marks=marks))
    return found


def every_fourth(cases: Iterable[Any]) -> list[ParameterSet]:
    """Of many cases through a whole app, the default run has every fourth, and the night all."""
    return [
        pytest.param(*_values(case), marks=pytest.mark.long if number % 4 else ()) for number, case in enumerate(cases)
    ]


def at_night(*cases: Any) -> list[ParameterSet]:
    """Parameters that the default run leaves out, as others that differ little are in it."""
    return [pytest.param(case, marks=pytest.mark.long) for case in cases]


def _values(case: Any) -> tuple[Any, ...]:
    return case if isinstance(case, tuple) else (case,)
