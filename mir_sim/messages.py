"""HTTP requests and responses as plain values, so that a robot can be asked without a socket."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import parse_qsl, unquote, urlsplit


@dataclass(frozen=True)
class Request:
    """One HTTP request. ``path`` is decoded and has no query; header names are lower case. ``pairs`` is the query with repeated names."""

    method: str
    path: str
    query: Mapping[str, str] = field(default_factory=dict)
    headers: Mapping[str, str] = field(default_factory=dict)
    body: bytes = b""
    pairs: tuple[tuple[str, str], ...] = ()

    @classmethod
    def of(cls, method: str, target: str, headers: Mapping[str, str] | None = None, body: bytes = b"") -> Request:
        """Build a request from its parts as sent: ``target`` is path and query, or a whole URL."""
        parts = urlsplit(target)
        pairs = tuple(parse_qsl(parts.query, keep_blank_values=True))
        lowered = {name.lower(): value for name, value in (headers or {}).items()}
        return cls(method.upper(), unquote(parts.path) or "/", dict(pairs), lowered, body, pairs)

    def values(self, name: str) -> list[str]:
        """All values that a name has in the query."""
        return [value for one, value in self.pairs if one == name]


@dataclass(frozen=True)
class Response:
    """One HTTP response without the headers that belong to the connection."""

    status: int
    headers: Mapping[str, str] = field(default_factory=dict)
    body: bytes = b""

    @classmethod
    def json_of(cls, status: int, value: Any, headers: Mapping[str, str] | None = None) -> Response:
        body = json.dumps(value).encode()  # ASCII only: a lone surrogate that a client sent could not be encoded
        return cls(status, {"Content-Type": "application/json", **(headers or {})}, body)

    def json(self) -> Any:
        """The body, parsed. Raises ValueError when it isn't JSON."""
        return json.loads(self.body)
