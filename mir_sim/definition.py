"""MiR's own definition of the REST API: operations, the schemas of their bodies and answers, and values that fit those schemas."""

from __future__ import annotations

import json
import math
import re
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeGuard

from mir_sim.errors import argument_error

SOFTWARE = ("2.14.7", "3.5.4", "3.8.1")  # of robots
FLEET_SOFTWARE = "2.13.5.3"  # of classic fleets
Schema = Mapping[str, Any]


@dataclass(frozen=True)
class Operation:
    """One verb on one path template. ``schema`` is None if the answer has no body. ``refusals``: the other status
    codes."""

    verb: str
    template: str
    success: int
    schema: Schema | None
    body_schema: Schema | None
    refusals: frozenset[int] = frozenset()

    @property
    def is_list(self) -> bool:
        return self.schema is not None and self.schema.get("type") == "array"


class Definition:
    """The parsed definition of one software version."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.document = document
        self._schemas: dict[str, Schema] = document["definitions"]
        self._operations = {
            (verb, template): self._operation(verb, template, raw)
            for template, verbs in document["paths"].items()
            for verb, raw in verbs.items()
        }

    @staticmethod
    def _operation(verb: str, template: str, raw: dict[str, Any]) -> Operation:
        success = next(code for code in raw["responses"] if code.startswith("2"))
        bodies = [parameter["schema"] for parameter in raw["parameters"] if parameter["in"] == "body"]
        return Operation(
            verb,
            template,
            int(success),
            raw["responses"][success].get("schema"),
            bodies[0] if bodies else None,
            frozenset(int(code) for code in raw["responses"] if code != success),
        )

    def operation(self, verb: str, template: str) -> Operation | None:
        return self._operations.get((verb, template))

    def templates(self) -> list[str]:
        return list(self.document["paths"])

    def resolve(self, schema: Schema) -> Schema:
        """Follow a ``$ref``; other schemas are returned unchanged."""
        return self._schemas[schema["$ref"].rsplit("/", 1)[-1]] if "$ref" in schema else schema

    def properties(self, schema: Schema | None) -> Mapping[str, Schema]:
        """The properties of an object schema, or of the items of a list."""
        if schema is None:
            return {}
        schema = self.resolve(schema)
        if schema.get("type") == "array":
            schema = self.resolve(schema["items"])
        properties: Mapping[str, Schema] = schema.get("properties", {})
        return properties

    def blank(self, schema: Schema) -> Any:
        """An empty value that fits the schema, shown for equipment that the robot doesn't have."""
        schema = self.resolve(schema)
        kind = schema.get("type", "object")
        if kind == "object":
            return {name: self.blank(inner) for name, inner in schema.get("properties", {}).items()}
        if schema.get("format") == "date-time":
            return "1970-01-01T00:00:00"
        return {"string": "", "integer": 0, "number": 0.0, "boolean": False, "array": []}[kind]

    def check_body(self, schema: Schema, body: Any) -> dict[str, Any]:
        """Return the known fields of a request body.

        Unknown fields are ignored: clients in use send some, and robots accept them.

        Raises:
            ApiError: 400 when a required field is missing or a value has the wrong type, is too long or is not one of the choices.
        """
        schema = self.resolve(schema)
        if not isinstance(body, dict):
            raise argument_error()
        properties: Mapping[str, Schema] = schema.get("properties", {})
        if missing := [name for name in schema.get("required", ()) if name not in body]:
            raise argument_error(*missing)
        known = {name: value for name, value in body.items() if name in properties}
        if wrong := [name for name, value in known.items() if not fits(value, properties[name])]:
            raise argument_error(*wrong)
        return known


def declared(fields: Mapping[str, Schema], value: dict[str, Any]) -> dict[str, Any]:
    """The same with lists and objects as texts of JSON, where a text is declared."""
    return {
        name: json.dumps(one) if isinstance(one, list | dict) and fields.get(name, {}).get("type") == "string" else one
        for name, one in value.items()
    }


def is_number(value: Any) -> TypeGuard[int | float]:
    """Whether a parsed JSON value is a number that fits into a float; Python also reads NaN, Infinity and integers of any length."""
    try:
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        return False


def fits(value: Any, schema: Schema) -> bool:
    """Whether a value has the type of a schema, its length and one of its choices. Fields of objects are not looked at."""
    kind = schema.get("type")
    if kind == "string":
        of_type = isinstance(value, str) and schema.get("minLength", 0) <= len(value) <= schema.get(
            "maxLength", math.inf
        )
    elif kind == "boolean":
        of_type = isinstance(value, bool)
    elif kind == "integer":
        of_type = isinstance(value, int) and is_number(value)
    elif kind == "number":
        of_type = is_number(value)
    elif kind == "array":
        items = schema.get("items", {})
        of_type = isinstance(value, list) and all(fits(item, items) for item in value)
    else:
        of_type = isinstance(value, dict) if kind == "object" else True
    return of_type and ("enum" not in schema or value in schema["enum"])


class Routes:
    """Finds the path template that a path belongs to; literal segments win over placeholders (``/users/me`` over ``/users/{guid}``)."""

    def __init__(self, templates: list[str]) -> None:
        self._exact = {template: template for template in templates if "{" not in template}
        self._patterns: dict[tuple[str, int], list[tuple[re.Pattern[str], str]]] = defaultdict(
            list
        )  # every first segment is literal
        for template in sorted(templates, key=lambda t: (t.count("{"), t)):
            if "{" in template:
                self._patterns[_shape(template)].append(
                    (re.compile(re.sub(r"\{(\w+)\}", r"(?P<\1>[^/]+)", template)), template)
                )

    def find(self, path: str) -> tuple[str, dict[str, str]] | None:
        """Return the template and the values of its placeholders, or None when no template matches."""
        path = path.rstrip("/") or "/"
        if path in self._exact:
            return path, {}
        for pattern, template in self._patterns.get(_shape(path), ()):
            if match := pattern.fullmatch(path):
                return template, match.groupdict()
        return None


def _shape(path: str) -> tuple[str, int]:
    """Its first segment and the number of them."""
    return path.split("/", 2)[1] if "/" in path else "", path.count("/")


@lru_cache(maxsize=len(SOFTWARE) + 1)
def load(version: str) -> Definition:
    """Read the definition of a software version of robots or fleets. Raises ValueError for an unknown version."""
    if version not in (*SOFTWARE, FLEET_SOFTWARE):
        raise ValueError(f"unknown software {version}: choose one of {', '.join(SOFTWARE)}")
    return Definition(_document(version))


def _document(version: str) -> dict[str, Any]:
    """The file of a version. One that names another as ``same_as`` holds only what is new in it or differs."""
    kind = "fleet" if version == FLEET_SOFTWARE else "robot"
    text = (Path(__file__).parent / "definitions" / f"{kind}-{version}.json").read_text(encoding="utf-8")
    document: dict[str, Any] = json.loads(text)
    older = document.pop("same_as", None)
    return document if older is None else _merged(_document(older), document)


def _merged(older: dict[str, Any], newer: dict[str, Any]) -> dict[str, Any]:
    both = {
        name: _merged(older[name], newer[name])
        for name in older.keys() & newer.keys()
        if isinstance(older[name], dict) and isinstance(newer[name], dict)
    }
    return {**older, **newer, **both}
