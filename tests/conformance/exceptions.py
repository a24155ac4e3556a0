"""Known differences from MiR's definitions, each with its reason. The tests fail on one that isn't needed."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Deviation:
    """One allowed difference of an answer from its schema.

    Attributes:
        operation: "GET /status".
        field: dotted path of the field within the answer, list positions left out; empty for the answer as a whole.
        instead: "null" (may be null), "absent" (may be missing), or the JSON type that it has instead of the definition's.
        software: the first part of the software that it holds for, "3." for all of that generation; empty for all.
        reason: where it comes from.
    """

    operation: str
    field: str
    instead: str
    reason: str
    software: str = ""

    def allows(self, operation: str, software: str, field: str, value: Any, missing: bool) -> bool:
        if self.operation != operation or self.field != field or not software.startswith(self.software):
            return False
        if self.instead == "absent" or missing:
            return self.instead == "absent" and missing
        return {
            "null": lambda: value is None,
            "array": lambda: isinstance(value, list),
            "object": lambda: isinstance(value, dict),
            "number": lambda: isinstance(value, int | float),
            "string": lambda: isinstance(value, str),
        }[self.instead]()


def load(name: str = "exceptions.json") -> list[Deviation]:
    """Those of robots, or those in another file beside it."""
    return [Deviation(**entry) for entry in json.loads((Path(__file__).parent / name).read_text(encoding="utf-8"))]
