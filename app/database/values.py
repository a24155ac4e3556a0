"""How Python values are stored in columns: instants as UTC text of fixed width (text order is time order), mappings as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from typing import Any


def to_text(instant: datetime) -> str:
    """``2026-11-23T04:30:00.000000Z`` of a timezone-aware instant."""
    if instant.tzinfo is None:
        raise ValueError(f"an instant needs a time zone: {instant!r}")
    return instant.astimezone(UTC).isoformat(timespec="microseconds")[:26] + "Z"


def to_optional_text(instant: datetime | None) -> str | None:
    return None if instant is None else to_text(instant)


def to_instant(text: str) -> datetime:
    return datetime.fromisoformat(text)


def to_optional_instant(text: str | None) -> datetime | None:
    return None if text is None else datetime.fromisoformat(text)


def to_json(value: Any) -> str:
    return "{}" if value == {} else json.dumps(value, ensure_ascii=False, default=_plain)  # most are


def _plain(value: Any) -> Any:
    """For ``json.dumps``, of types that JSON does not have: read-only mappings become objects, sets lists, instants and the rest
    their text."""
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, frozenset):
        return sorted(value)
    if isinstance(value, datetime):
        return value.isoformat()
    return str(value)


def from_json(text: str) -> Any:
    return {} if text == "{}" else json.loads(text)  # most are, and this would be most of the time of reading a row


def placeholders(values: Iterable[object]) -> str:
    """``?,?,?``: as many placeholders as there are values."""
    return ",".join("?" for _ in values)
