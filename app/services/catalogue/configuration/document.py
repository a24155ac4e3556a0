"""Reads a configuration file and checks its form; the import compares it with the stored configuration.

Every problem is an InvalidInput whose field is the place in the file, such as ``schedules[2].start``.
"""

from __future__ import annotations

import json
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, NoReturn

from app.domain.json_parts import has_too_many_parts
from app.domain.models import InvalidInput
from app.services.catalogue.checks import shown
from app.services.catalogue.fields import SECTIONS, Item, check_keys, read_object, read_objects

FORMAT = "amr-scheduler/1"
OBJECTS = ("settings", "display", "calendar")  # sections that are not lists
LARGEST_FILE = 5 * 1024 * 1024  # bytes


class Document(NamedTuple):
    """By section. The "days" of the calendar are a list of Item."""

    objects: Mapping[str, Item]
    lists: Mapping[str, Sequence[Item]]


def read(content: bytes) -> Document:
    """Raises InvalidInput at the first thing that is wrong with its form."""
    root = _parsed(content)
    if not isinstance(root, dict):
        raise InvalidInput("file", "the file has to hold one JSON object")
    _check_format(root)
    check_keys("", root, {"format", *SECTIONS})
    return Document(
        {section: read_object(section, root.get(section, {}), SECTIONS[section]) for section in OBJECTS},
        {
            section: read_objects(section, root.get(section, []), fields)
            for section, fields in SECTIONS.items()
            if section not in OBJECTS
        },
    )


# ---------------------------------------------------------------------- JSON
def _parsed(content: bytes) -> Any:
    if len(content) > LARGEST_FILE:
        raise InvalidInput("file", "the file is larger than 5 MiB")
    try:
        text = content.decode("utf-16" if content.startswith((BOM_UTF16_LE, BOM_UTF16_BE)) else "utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput(
            "file", "the file is not UTF-8 text (byte {byte}): save it as UTF-8", byte=error.start
        ) from None
    if has_too_many_parts(text.encode()):
        raise InvalidInput("file", "the file has too many parts")
    try:
        return json.loads(text, object_pairs_hook=_object, parse_constant=_no_constant)
    except json.JSONDecodeError as error:
        raise InvalidInput(
            "file",
            "the file is not JSON: line {line}, column {column}: {problem}",
            line=error.lineno,
            column=error.colno,
            problem=error.msg,
        ) from None
    except RecursionError:
        raise InvalidInput("file", "the file is nested too deeply") from None
    except InvalidInput:
        raise
    except ValueError:  # a number of thousands of digits
        raise InvalidInput("file", "the file has a number that can't be read") from None


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        key = Counter(name for name, _ in pairs).most_common(1)[0][0]
        raise InvalidInput("file", "{key} appears twice in one object", key=shown(key))
    return found


def _no_constant(text: str) -> NoReturn:
    raise InvalidInput("file", "{text} is no number that can be used", text=text)


def _check_format(root: Mapping[str, Any]) -> None:
    if "format" not in root:
        raise InvalidInput(
            "format", 'the file is no configuration of this app: it lacks "format": "{format}"', format=FORMAT
        )
    if root["format"] != FORMAT:
        raise InvalidInput(
            "format",
            "format: the file says {found}, this app reads {format}",
            found=shown(root["format"]),
            format=FORMAT,
        )
