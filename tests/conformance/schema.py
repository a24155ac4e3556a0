"""Where an answer differs from its schema, in a definition of Swagger 2 (robots, the classic fleet) or of OpenAPI 3."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

from jsonschema import Draft4Validator, FormatChecker

# What OpenAPI 3 documents write as formats. Robots' times have no zone, whatever their definition calls them.
FORMATS = {
    "uuid": r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}",
    "date-time": r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?Z",
    "date-span": r"(\d+\.)?\d\d:\d\d:\d\d",
}


@dataclass(frozen=True)
class Difference:
    field: str
    value: Any
    what: str
    missing: bool = False


def schemas_of(document: dict[str, Any]) -> dict[str, Any]:
    """The named schemas of a definition."""
    found: dict[str, Any] = document["definitions"] if "swagger" in document else document["components"]["schemas"]
    return found


def resolved(document: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    while "$ref" in schema:
        schema = schemas_of(document)[schema["$ref"].rsplit("/", 1)[-1]]
    return schema


def differences(document: dict[str, Any], schema: dict[str, Any], answer: Any) -> list[Difference]:
    """Values of the wrong type, as jsonschema finds them, and properties that the schema has and the answer has not."""
    checked = {"allOf": [schema], "definitions": schemas_of(document), "components": document.get("components")}
    is_swagger = "swagger" in document
    validator = Draft4Validator(
        checked if is_swagger else with_null(checked), format_checker=None if is_swagger else format_checker()
    )
    wrong = [
        Difference(_name(error.absolute_path), error.instance, error.message[:200])
        for error in validator.iter_errors(answer)
    ]
    return wrong + list(_missing(document, schema, answer, ""))


def with_null(schema: Any) -> Any:
    """``nullable`` as JSON schemas say it."""
    if isinstance(schema, list):
        return [with_null(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    inner = {name: with_null(one) for name, one in schema.items()}
    return {"anyOf": [{"type": "null"}, inner]} if schema.get("nullable") is True else inner


def format_checker() -> FormatChecker:
    checker = FormatChecker(formats=())
    for name, pattern in FORMATS.items():
        checker.checks(name)(partial(_has_format, re.compile(pattern)))
    return checker


def _has_format(pattern: re.Pattern[str], value: object) -> bool:
    return not isinstance(value, str) or pattern.fullmatch(value) is not None


def _name(path: Any) -> str:
    return ".".join(str(part) for part in path if not isinstance(part, int))


def _missing(document: dict[str, Any], schema: dict[str, Any], answer: Any, field: str) -> Iterator[Difference]:
    schema = resolved(document, schema)
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
