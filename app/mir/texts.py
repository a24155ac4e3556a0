"""Texts from robots, cleaned before they are shown or stored, and without credentials, in case a robot sent some back.
Every text of a robot goes through ``clean``. The credential of a robot user is the SHA-256 sum of the password, in 64
hexadecimal digits after the user name and a colon, and all of that in base64: both are recognised by their form for any
user, also with invisible characters in between. Credentials that a robot splits or encodes in other ways are not
recognised.
"""

from __future__ import annotations

import json
import re
import string
from typing import Any

from app.domain import names

LONGEST_TEXT = 500
MOST_FIELDS = 50  # of a template that are filled in; robots' own have a few
SHORTEST_SECRET = 64  # characters of a password's SHA-256 sum
HIDDEN = "***"
LARGEST_NUMBER = 2**63  # one of hundreds of digits takes long to be written, and a robot has none

_BASE64 = string.ascii_letters + string.digits + "+/="
_LONG_RUN = re.compile(f"(?<![{_BASE64}])[{_BASE64}]{{{SHORTEST_SECRET},}}")
_BREAKS = re.compile("[\t\n\v\f\r\x85\u2028\u2029]+")
# %(name)s, %(name)d, %(name).2f …; widths have at most two digits, so that no template can make a huge text.
_FIELD = re.compile(r"%\((?P<name>[^()]{1,80})\)(?P<format>[-+ 0#]{0,3}\d{0,2}(?:\.\d{1,2})?[sdiufFgGeExXr])|%%")


def clean(value: Any, limit: int = LONGEST_TEXT) -> str:
    """A text without anything invisible (lone surrogates included, which neither SQLite nor UTF-8 takes), on one line,
    at most ``limit`` characters; "" for anything that is not text. 64 and more letters and digits in a row, of both
    kinds, are taken for a credential and hidden."""
    if not isinstance(value, str):
        return ""
    text = value[: 4 * limit]
    text = names.visible(text if text.isprintable() else _BREAKS.sub(" ", text)).strip()  # breaks are not printable
    if len(text) >= SHORTEST_SECRET:
        text = _LONG_RUN.sub(_hidden, text)
    if len(text) <= limit and len(value) > 4 * limit:
        text = text.rstrip(_BASE64) + "…"  # the cut part may be the rest of one
    return text if len(text) <= limit else text[: limit - 1] + "…"


def _hidden(run: re.Match[str]) -> str:
    """An endless word is hidden: a robot's own words are shorter, or of letters only."""
    return HIDDEN if any(map(str.isdigit, run[0])) and any(map(str.isalpha, run[0])) else run[0]


def resolve(value: Any, limit: int = LONGEST_TEXT) -> str:
    """A cleaned text with the robot's template filled in: ``{"message": "Failed to reach '%(name)s'", "args": {"name": "Dock"}}``.

    Recorded on robots with software 2.x in mission texts, error descriptions and messages, at times with backslash-escaped quotes.
    Any other text, and a broken template, stays as it is.
    """
    if not isinstance(value, str):
        return ""
    template = _template(value)
    if template is None:
        return clean(value, limit)
    message, args = template
    return clean(_FIELD.sub(lambda match: _filled(match, args), message[: 4 * limit + 1], count=MOST_FIELDS), limit)


def _template(text: str) -> tuple[str, dict[str, Any]] | None:
    stripped = text.strip()
    if not stripped.startswith("{") or "message" not in stripped or len(stripped) > 20_000:
        return None
    for candidate in (stripped, stripped.replace('\\"', '"').replace("\\'", "'")):
        try:
            found = json.loads(candidate, strict=False)
        except (ValueError, RecursionError):
            continue
        if isinstance(found, dict) and isinstance(found.get("message"), str):
            args = found.get("args")
            return found["message"], args if isinstance(args, dict) else {}
    return None


def _filled(match: re.Match[str], args: dict[str, Any]) -> str:
    if match[0] == "%%":
        return "%"
    name = match["name"]
    if name not in args:
        return match[0]
    value = args[name]
    if isinstance(value, dict | list) or (isinstance(value, int | float) and abs(value) > LARGEST_NUMBER):
        return match[0]
    if isinstance(value, str) and len(value) > LONGEST_TEXT:
        value = args[name] = clean(value)
    try:
        return f"%{match['format']}" % (value,)
    except (TypeError, ValueError, OverflowError):
        return str(value)
