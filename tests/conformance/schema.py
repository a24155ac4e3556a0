"""Where an answer differs from its schema."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from jsonschema import Draft4Validator


@dataclass(frozen=True)
class Difference:
    field: str
    value: Any
    what: str
    missing: bool = False


def differences(document: dict[str, Any], schema: dict[str, Any], answer: Any) -> list[Difference]:
    """Values of the wrong type, as jsonschema finds them, and properties that the schema has and the answer has not."""
    validator = Draft4Validator({"allOf": [schema], "definitions": document["definitions"]})
    wrong = [
        Difference(_name(error.absolute_path), error.instance, error.message[:200])
        for error in validator.iter_errors(answer)
    ]
    return wrong + list(_missing(document, schema, answer, ""))


def _name(path: Any) -> str:
    return ".".join(str(part) for part in path if not isinstance(part, int))


def _missing(document: dict[str, Any], schema: dict[str, Any], answer: Any, field: str) -> Iterator[Difference]:
    while "$ref" in schema:
        schema = document["definitions"][schema["$ref"].rsplit("/", 1)[-1]]
    if schema.get("type") == "array" and isinstance(answer, list):
        for entry in answer[:3]:
            yield from _missing(document, schema.get("items", {}), entry, field)
    elif isinstance(answer, dict):
        for name, inner in schema.get("properties", {}).items():
            inner_field = f"{field}.{name}" if field else name
            if name not in answer:
                yield Difference(inner_field, None, "is missing", missing=True)
            else:
                yield from _missing(document, inner, answer[name], inner_field)
