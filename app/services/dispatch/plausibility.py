"""Whether the tablet's clock can be right.

Judged at the start only; a step while running is an event, not a hold.
"""
from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta

from app.domain.message import Message, message

TOLERANCE = timedelta(minutes=10)
BACKWARDS = timedelta(minutes=2)        # a tablet that lost some seconds over a restart is not a tablet that lost its clock


def clock_problem(now: datetime, last_heartbeat: datetime | None, offsets: Sequence[float | None]) -> Message | None:
    """A part of a sentence when the clock is not plausible, else None.

    ``offsets`` are the robots' HTTP ``Date`` minus the tablet's clock in seconds, None where unknown. Two or more robots that mostly agree
    with the tablet overrule a heartbeat from the future; two or more that mostly differ by over ten minutes overrule the tablet.
    """
    known = [offset for offset in offsets if offset is not None]
    differing = [offset for offset in known if abs(offset) > TOLERANCE.total_seconds()]
    if len(known) >= 2 and len(differing) * 2 > len(known):
        minutes = round(sorted(differing)[len(differing) // 2] / 60)
        if minutes > 0:
            return message("most robots' clocks are {minutes} min ahead of it", minutes=minutes)
        return message("most robots' clocks are {minutes} min behind it", minutes=-minutes)
    robots_agree = len(known) >= 2
    if last_heartbeat is not None and now < last_heartbeat - BACKWARDS and not robots_agree:
        return message("it shows {now} UTC, but the app already ran on {then} UTC",
                    now=f"{now:%Y-%m-%d %H:%M}", then=f"{last_heartbeat:%Y-%m-%d %H:%M}")
    return None
