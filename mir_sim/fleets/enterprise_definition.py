"""MiR's OpenAPI 3 definitions of Fleet Enterprise: which operations a version has, and what in a body doesn't fit."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from datetime import datetime
from functools import lru_cache
from pathlib import Path
from typing import Any

from mir_sim.definition import Routes, Schema, fits

VERSIONS = ("1.3.1", "1.4.2", "1.5.0")
JSON = "application/json"
_UUID = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", re.IGNORECASE)


class Definition:
    """The parsed definition of one version, with the operations that are simulated. Paths have /api/v1 in them."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.document = document
        self._schemas: Mapping[str, Schema] = document["components"]["schemas"]
        self._routes = Routes(list(document["paths"]))

    def find(self, verb: str, path: str) -> tuple[str, dict[str, str], Mapping[str, Any]] | None:
        """The path template, the values of its placeholders and the operation; None where there is no such operation."""
        template, params = self._routes.find(path) or ("", {})
        operation = self.document["paths"].get(template, {}).get(verb)
        return None if operation is None else (template, params, operation)

    def has(self, schema: str, field: str) -> bool:
        """Whether this version has a field in a named schema."""
        return field in self._schemas[schema]["properties"]

    def misfits(self, schema: Schema, value: Any, name: str) -> Iterator[str]:
        """The dotted names of the values that don't fit, and of required ones that are missing. Fields that the schema
        doesn't have are ignored (guess)."""
        if "$ref" in schema:
            schema = self._schemas[schema["$ref"].rsplit("/", 1)[-1]]
        if value is None and schema.get("nullable"):
            return
        if not fits(value, schema) or not _has_format(value, schema.get("format", "")):
            yield name
        elif isinstance(value, list):
            for number, one in enumerate(value):
                yield from self.misfits(schema["items"], one, f"{name}[{number}]")
        elif isinstance(value, dict):
            yield from (f"{name}.{one}" for one in schema.get("required", ()) if one not in value)
            for one, inner in schema.get("properties", {}).items():
                if one in value:
                    yield from self.misfits(inner, value[one], f"{name}.{one}")


def is_uuid(text: str) -> bool:
    return _UUID.fullmatch(text) is not None


def moment(text: str) -> datetime | None:
    """The time that a text means; None when it is none, or has no zone."""
    try:
        found = datetime.fromisoformat(text)
    except ValueError:
        return None
    return found if found.tzinfo else None


def _has_format(value: Any, kind: str) -> bool:
    if kind == "uuid":
        return is_uuid(value)
    return kind != "date-time" or moment(value) is not None


@lru_cache(maxsize=len(VERSIONS))
def load(version: str) -> Definition:
    """Read the definition of one of ``VERSIONS``."""
    path = Path(__file__).parent.parent / "definitions" / f"fleet-enterprise-{version}.json"
    return Definition(json.loads(path.read_text(encoding="utf-8")))
