"""A limit for JSON of unknown origin, checked before it is parsed.

The parser builds everything between the ends of two objects without letting another thread run: a second for 8 MiB of
empty lists or for the keys of one object. At the end of each object it calls Python code, where other threads get their
turn.
"""

from __future__ import annotations

import re

MOST_PARTS = 500_000  # values and keys: what they take in memory
MOST_AT_ONCE = 30_000  # of them between the ends of two objects: what takes some 30 ms

# Up to the end of an object, or 2,000 strings further. A brace inside a string is no end.
_STRETCH = re.compile(rb'(?:[^"}]++|"(?:[^"\\]++|\\.)*+"?){,4000}+\}?', re.DOTALL)


def has_too_many_parts(content: bytes) -> bool:
    """Whether this text holds more than can be parsed without holding up other threads. It need not be JSON."""
    parts = _parts(content)
    if not MOST_AT_ONCE < parts <= MOST_PARTS:
        return parts > MOST_PARTS
    at_once = 0
    for stretch in _STRETCH.finditer(content):
        at_once += _parts(stretch[0])
        if at_once > MOST_AT_ONCE:
            return True
        if stretch[0].endswith(b"}"):
            at_once = 0
    return False


def _parts(content: bytes) -> int:
    """An upper bound, as each needs a separator or an opening sign; those inside strings count too."""
    return content.count(b",") + content.count(b"[") + content.count(b"{")
