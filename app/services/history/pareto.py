"""Why runs failed, the most frequent cause first, so that one sees which few make up the most. Pure."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from app.domain.models import ReasonCode

MOST_PARTICULARS = 3
MOST_CAUSES = 6  # listed; the rest is summed up at the end

# what differs from one failure to the next of the same kind: names in quotes, numbers
_NAMES = re.compile(r"""['"]([^'"]+)['"]""")
_PARTICULARS = re.compile(r"""'[^']*'|"[^"]*"|\d+(?:[.,:]\d+)*""")


@dataclass(frozen=True)
class Cause:
    """``code`` None: all others together. ``words`` the robot's message, where the code alone is not enough."""

    code: ReasonCode | None
    words: str
    number: int
    share: float  # of all failures
    cumulative: float  # share of this one and those before it
    particulars: Sequence[
        tuple[str, int]
    ] = ()  # what the robot's messages named in quotes, such as goals, the most frequent first


def kind_of(message: str) -> str:
    """A robot's message without what is particular to one failure: "Failed to reach goal position 'Dock 3'" and 'Dock 1' are one kind."""
    return re.sub(r"…(?:[,;]?\s*…)+", "…", " ".join(_PARTICULARS.sub("…", message).split()))


def causes(counted: Iterable[tuple[str | None, str | None, int]], most: int = MOST_CAUSES) -> Sequence[Cause]:
    """Of (reason code, message, number). Runs that the robot ended are distinguished by its message; of two equally frequent causes the one
    whose code comes first in the alphabet is first. All others come last, as one, whatever their number."""
    found: Counter[tuple[str, str]] = Counter()
    named: defaultdict[tuple[str, str], Counter[str]] = defaultdict(Counter)
    for code, message, number in counted:
        aborted = code == ReasonCode.ROBOT_ABORTED
        kind = code or "", kind_of(message) if aborted and message else ""
        found[kind] += number
        if kind[1]:
            named[kind].update(dict.fromkeys(_NAMES.findall(message or ""), number))
    total = found.total()
    ordered = sorted(found.items(), key=lambda item: (-item[1], item[0]))
    if len(ordered) > most:
        ordered = [*ordered[:most], (("", ""), sum(number for _, number in ordered[most:]))]
    rows, so_far = [], 0
    for (code, words), number in ordered:
        so_far += number
        rows.append(
            Cause(
                ReasonCode(code) if code else None,
                words,
                number,
                number / total,
                so_far / total,
                tuple(sorted(named[code, words].items(), key=lambda item: (-item[1], item[0]))[:MOST_PARTICULARS]),
            )
        )
    return rows
