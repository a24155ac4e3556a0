"""Texts from robots, cleaned before they are shown or stored."""
from __future__ import annotations

import json
import re
from typing import Any

LONGEST_TEXT = 500

# Lone surrogates (neither SQLite nor UTF-8 takes them), control characters, spaces without width, and marks that reverse the direction of
# what follows.
_UNWANTED = re.compile("[\ud800-\udfff\x00-\x1f\x7f-\x9f\u061c\u200b\u200e\u200f\u2060-\u2064\u202a-\u202e\u2066-\u2069\ufeff]")
_BREAKS = re.compile("[\t\n\v\f\r\x85\u2028\u2029]+")
# %(name)s, %(name)d, %(name).2f …; widths have two digits at most, so that no template can blow a text up.
_FIELD = re.compile(r"%\((?P<name>[^()]{1,80})\)(?P<format>[-+ 0#]{0,3}\d{0,2}(?:\.\d{1,2})?[sdiufFgGeExXr])|%%")


def clean(value: Any, limit: int = LONGEST_TEXT) -> str:
    """A text without control characters and lone surrogates, on one line, at most ``limit`` characters; "" for anything that is no text."""
    if not isinstance(value, str):
        return ""
    text = value[:4 * limit]
    if not text.isprintable():                       # nearly all are: then there is nothing of the kind
        text = _UNWANTED.sub("", _BREAKS.sub(" ", text))
    text = text.strip()
    return text if len(text) <= limit else text[:limit - 1] + "…"


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
    return clean(_FIELD.sub(lambda match: _filled(match, args), message[:4 * limit]), limit)


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
    if isinstance(value, dict | list):
        return match[0]
    try:
        return f"%{match['format']}" % (value,)
    except (TypeError, ValueError, OverflowError):
        return str(value)[:LONGEST_TEXT]
