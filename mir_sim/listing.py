"""What all lists of the API support: whitelist, sort_by, limit and offset, and the filters of POST …/search."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol

from mir_sim.errors import ApiError

FIELDS, FILTERS, ORDERING, LIMITS = "Wrong output fields", "Invalid filters", "Invalid ordering", "Invalid limits"


class Listed(Protocol):
    """An entry of a list."""

    def summary(self) -> dict[str, Any]:
        """What the bare list shows of it."""

    def full(self) -> dict[str, Any]:
        """All its fields."""

    def value(self, name: str) -> Any:
        """One field."""


def show(
    entries: Iterable[Listed],
    query: Mapping[str, str],
    fields: set[str],
    filters: Sequence[Any] = (),
    largest_page: int | None = None,
) -> list[dict[str, Any]]:
    """Filter, sort, page and reduce a list as the client asks.

    Args:
        query: the URL's query; unknown parameters are ignored.
        fields: every field an entry may have.
        filters: the ``filters`` of a search.
        largest_page: most entries shown, even if the client asks for more; None: any number.

    Raises:
        ApiError: 400 with the text that MiR's definition gives for it.
    """
    found = list(entries)
    for accepts, name in [_filter(one, fields) for one in filters]:
        found = [entry for entry in found if accepts(entry.value(name))]
    found = _sorted(found, query.get("sort_by"), fields)
    found = _page(found, query)[:largest_page]
    whitelist = query.get("whitelist")
    if whitelist is None:
        return [entry.summary() for entry in found]
    names = _names(whitelist, fields)
    if names is None:
        return [entry.full() for entry in found]
    return [
        {name: value for name, value in (entry.full() | entry.summary()).items() if name in names} for entry in found
    ]


def pick(value: dict[str, Any], query: Mapping[str, str], fields: set[str]) -> dict[str, Any]:
    """Reduce a single object to its whitelist."""
    whitelist = query.get("whitelist")
    names = _names(whitelist, fields | set(value)) if whitelist is not None else None
    return value if names is None else {name: inner for name, inner in value.items() if name in names}


def _names(whitelist: str, fields: set[str]) -> set[str] | None:
    """The top-level fields to show; None means all."""
    names = {name.strip() for name in whitelist.split(",")}
    if names == {"all"}:
        return None
    if not names <= fields:
        raise ApiError(400, FIELDS)
    return names


def _sorted(entries: list[Listed], sort_by: str | None, fields: set[str]) -> list[Listed]:
    if sort_by is None:
        return entries
    name, _, direction = (part.strip() for part in sort_by.partition(","))
    if name not in fields or direction.lower() not in ("", "asc", "desc"):
        raise ApiError(400, ORDERING)
    values = [entry.value(name) for entry in entries]
    keys = (
        values if set(map(type, values)) <= {int} else [_sort_key(value) for value in values]
    )  # queues are long and have numbers
    return [
        entries[index] for index in sorted(range(len(keys)), key=keys.__getitem__, reverse=direction.lower() == "desc")
    ]


def _sort_key(value: Any) -> tuple[int, float, str]:
    """Nulls first, then numbers, then texts, as databases sort (guess)."""
    if value is None:
        return 0, 0.0, ""
    if isinstance(value, int | float):
        return 1, float(value), ""
    return 2, 0.0, str(value)


def _page(entries: list[Listed], query: Mapping[str, str]) -> list[Listed]:
    bounds = []
    for name in ("offset", "limit"):
        text = query.get(name)
        if text is not None and not re.fullmatch(r"\d{1,9}", text):
            raise ApiError(400, LIMITS)
        bounds.append(None if text is None else int(text))
    offset, limit = bounds[0] or 0, bounds[1]
    return entries[offset:] if limit is None else entries[offset : offset + limit]


Predicate = Callable[[Any], bool]


def _filter(one: Any, fields: set[str]) -> tuple[Predicate, str]:
    """Turn {"fieldname", "operator", "value"} into a predicate and the name of the field that it tests."""
    if (
        not isinstance(one, dict)
        or not {"fieldname", "operator", "value"} <= set(one)
        or one["fieldname"] not in fields
    ):
        raise ApiError(400, FILTERS)
    wanted, make = one["value"], OPERATORS.get(str(one["operator"]).upper())
    if make is None:
        raise ApiError(400, FILTERS)
    return make(wanted), one["fieldname"]


def _number(value: Any) -> float | None:
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return None


def _comparing(compare: Callable[[Any, Any], bool]) -> Callable[[Any], Predicate]:
    """As numbers if the field is one, otherwise as texts (guess). A comparison with null is never true."""

    def make(wanted: Any) -> Predicate:
        text, number = str(wanted), _number(wanted)

        def accepts(value: Any) -> bool:
            if value is None or wanted is None:
                return False
            if isinstance(value, str) or number is None or (left := _number(value)) is None:
                return compare(str(value), text)
            return compare(left, number)

        return accepts

    return make


def _like(wanted: Any) -> Predicate:
    pattern = re.compile(
        "".join({"%": ".*", "_": "."}.get(char, re.escape(char)) for char in str(wanted)), re.IGNORECASE | re.DOTALL
    )
    return lambda value: value is not None and pattern.fullmatch(str(value)) is not None


def _in(wanted: Any) -> Predicate:
    if not isinstance(wanted, list):
        raise ApiError(400, FILTERS)
    accepted, texts = [_equal_to(one) for one in wanted], {str(one) for one in wanted if one is not None}
    return lambda value: value in texts if isinstance(value, str) else any(accepts(value) for accepts in accepted)


def _equal_or_both_null(wanted: Any) -> Predicate:
    return (lambda value: value is None) if wanted is None else _equal_to(wanted)


def _is(wanted: Any) -> Predicate:
    return _equal_or_both_null(None if str(wanted).upper() == "NULL" else wanted)


def _not(make: Callable[[Any], Predicate]) -> Callable[[Any], Predicate]:
    """The negation, which doesn't accept null either."""

    def opposite(wanted: Any) -> Predicate:
        accepts = make(wanted)
        return lambda value: value is not None and not accepts(value)

    return opposite


def _is_not(wanted: Any) -> Predicate:
    accepts = _is(wanted)
    return lambda value: not accepts(value)


_equal_to = _comparing(operator.eq)
OPERATORS: dict[str, Callable[[Any], Predicate]] = {
    "=": _equal_to,
    "<=>": _equal_or_both_null,
    "<>": _not(_equal_to),
    "!=": _not(_equal_to),
    ">": _comparing(operator.gt),
    ">=": _comparing(operator.ge),
    "<": _comparing(operator.lt),
    "<=": _comparing(operator.le),
    "LIKE": _like,
    "NOT LIKE": _not(_like),
    "IN": _in,
    "NOT IN": _not(_in),
    "IS": _is,
    "IS NOT": _is_not,
}
