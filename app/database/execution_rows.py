"""How an execution is stored: the columns of its row in the ledger."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Mapping
from dataclasses import fields
from operator import attrgetter
from types import MappingProxyType
from typing import Any

from app.database.values import from_json, to_instant, to_json, to_text
from app.domain.execution import Execution, Reason, ReasonCode, State, Trigger, Wait

OPEN = "state IN ('waiting', 'submitting', 'queued', 'executing')"

_INSTANTS = (
    "listed_until",
    "finish_by",
    "bound_at",
    "begun_at",
    "planned_at",
    "moved_from",
    "closes_at",
    "created_at",
    "submitted_at",
    "started_at",
    "ended_at",
)
_OBJECTS = ("parameters", "wait_details", "choice", "tried")
_FIELDS = tuple(field.name for field in fields(Execution) if field.name != "id")
_PLAIN = tuple(name for name in _FIELDS if name != "reason")  # one column each
_COLUMN_OF = {"listed_until": "hold_until", "withdrawn": "revoked"}  # where it has another name than its field
_COLUMNS = (*(_COLUMN_OF.get(name, name) for name in _PLAIN), "reason_code", "reason_details")

PLACES = f"(?, {', '.join('?' for _ in _COLUMNS)})"
INSERT = f"INSERT INTO executions (id, {', '.join(_COLUMNS)}) VALUES {PLACES}"


def with_values(execution: Execution, **values: Any) -> Execution:
    """The same with other values. ``dataclasses.replace`` takes six times as long, three times for each start."""
    made = object.__new__(Execution)
    made.__dict__.update(execution.__dict__, **values)
    return made


def _reason_to_text(reason: Reason) -> str:
    return to_json({"code": reason.code, "details": reason.details})


def text_to_reason(text: str | None) -> Reason | None:
    if text is None:
        return None
    stored = from_json(text)
    return Reason(ReasonCode(stored["code"]), stored["details"])


_TO_COLUMN: Mapping[str, Callable[[Any], Any]] = MappingProxyType(
    {**dict.fromkeys(_INSTANTS, to_text), **dict.fromkeys(_OBJECTS, to_json), "withdrawn": _reason_to_text}
)
_CONVERTERS = tuple(_TO_COLUMN.get(name) for name in _PLAIN)
_plain_values = attrgetter(*_PLAIN)


def stored_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Columns and their stored values, of fields and their values."""
    stored: dict[str, Any] = {}
    for name, value in values.items():
        if name == "reason":
            stored["reason_code"] = value and value.code
            stored["reason_details"] = to_json(value.details if value else {})
        elif name not in _FIELDS:
            raise ValueError(f"an execution has no {name!r}")
        else:
            convert = _TO_COLUMN.get(name)
            stored[_COLUMN_OF.get(name, name)] = value if convert is None or value is None else convert(value)
    return stored


def row_of(execution: Execution) -> tuple[Any, ...]:
    reason = execution.reason
    plain = [
        value if convert is None or value is None else convert(value)
        for convert, value in zip(_CONVERTERS, _plain_values(execution), strict=True)
    ]
    return execution.id or None, *plain, reason and reason.code, to_json(reason.details) if reason else "{}"


_FROM_COLUMN: Mapping[str, Callable[[Any], Any]] = MappingProxyType(
    {
        **dict.fromkeys(_INSTANTS, to_instant),
        **dict.fromkeys(_OBJECTS, from_json),
        "trigger": Trigger,
        "state": State,
        "wait": Wait,
        "cancel_code": ReasonCode,
        "withdrawn": text_to_reason,
        "held": bool,
    }
)


def execution_of(row: sqlite3.Row) -> Execution:
    """The execution in a row of all columns."""
    values = dict(zip(row.keys(), row, strict=True))  # a row looks for each name among all of them
    code, details = values.pop("reason_code"), values.pop("reason_details")
    values["reason"] = Reason(ReasonCode(code), from_json(details)) if code else None
    for name, column in _COLUMN_OF.items():
        values[name] = values.pop(column)
    for name, convert in _FROM_COLUMN.items():
        if (stored := values[name]) is not None:
            values[name] = convert(stored)
    made = object.__new__(Execution)  # as in ``with_values``
    made.__dict__.update(values)
    return made


def select(c: sqlite3.Connection, rest: str, *values: object) -> list[Execution]:
    """Those that the ``rest`` of a statement finds."""
    return [execution_of(row) for row in c.execute(f"SELECT * FROM executions {rest}", values)]
