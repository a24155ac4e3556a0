"""Conflicts of the plan, in words: stored as codes and numbers, shown in any language. Traffic is not considered.

Instants in ``details`` are UTC ``datetime``. Nothing here ever fails, as in ``reasons``.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime, tzinfo
from enum import StrEnum
from types import MappingProxyType
from typing import Any

from app.domain import writing
from app.domain.reasons import known_zone
from app.domain.writing import Translate


class ConflictCode(StrEnum):
    TOO_FEW_ROBOTS = "too_few_robots"  # at: more starts than robots of a group: group, starts, robots, until
    PLACE_FULL = "place_full"  # at: more missions than a place takes: place, starts, most, until
    PLACE_CROWDED = "place_crowded"  # at: an hour in which a place is in use most of the time: place, percent, until
    CRITICAL_BEHIND = (
        "critical_behind"  # at: in nine of ten cases a run has not ended when a more important one is planned there:
    )
    # mission, behind (the other), robot, start (of the other)
    FINISH_BY_SHORT = "finish_by_short"  # it usually takes longer than it is given: mission, minutes, usual_minutes


_SENTENCES: Mapping[str, str] = MappingProxyType(
    {
        "too_few_robots": "At {time}, {starts} starts need the {robots} robots of {group}",
        "too_few_robots.one": "At {time}, {starts} starts need the only robot of {group}",
        "too_few_robots.none": "No robot of {group} is switched on: nothing will be sent",
        "place_full": "At {time}, {starts} missions need {place}, which takes {most} at a time",
        "place_crowded": "From {time} to {until} {place} is in use {percent} % of the time: starts will often wait for it",
        "critical_behind": "{mission} at {time} usually still runs on {robot} when the more important {behind} starts at {start}",
        "finish_by_short": "{mission} usually takes {usual_minutes} min, but only {minutes} min are allowed",
    }
)
_UNTIL = "{what}, until about {until}"
_END = ("too_few_robots", "too_few_robots.one", "place_full")  # as far as their end is known
_LINES: Mapping[str, str] = MappingProxyType(
    {
        "too_few_robots": "{starts} starts, {robots} robots: {time}",
        "too_few_robots.one": "{starts} starts, one robot: {time}",
        "too_few_robots.none": "No robot of {group} is switched on",
        "place_full": "{place} is full at {time}",
        "place_crowded": "{place} is in use {percent} % of an hour",
        "critical_behind": "{behind} would start late",
        "finish_by_short": "Usually takes longer: {usual_minutes} min",
    }
)


def sentence(
    code: str,
    at: datetime | None,
    details: Mapping[str, Any],
    zone: tzinfo | str,
    translate: Translate = lambda text: text,
) -> str:
    """The whole sentence; empty for an unknown code."""
    text = _said(_SENTENCES, code, at, details, zone, translate)
    until = details.get("until")
    if not isinstance(until, datetime) or _kind(code, details) not in _END:
        return text
    return translate(_UNTIL).format(what=text, until=_time(until, zone, translate))


def line(
    code: str,
    at: datetime | None,
    details: Mapping[str, Any],
    zone: tzinfo | str,
    translate: Translate = lambda text: text,
) -> str:
    """In a few words."""
    return _said(_LINES, code, at, details, zone, translate)


def _said(
    texts: Mapping[str, str],
    code: str,
    at: datetime | None,
    details: Mapping[str, Any],
    zone: tzinfo | str,
    translate: Translate,
) -> str:
    if (text := texts.get(_kind(code, details))) is None:
        return ""
    values = {
        name: _time(value, zone, translate) if isinstance(value, datetime) else value for name, value in details.items()
    }
    return translate(text).format_map(writing.Dashes(values, time=_time(at, zone, translate) if at else "–"))


def _kind(code: str, details: Mapping[str, Any]) -> str:
    few = {0: ".none", 1: ".one"}.get(details.get("robots", 2), "") if code == ConflictCode.TOO_FEW_ROBOTS else ""
    return f"{code}{few}"


def _time(instant: datetime, zone: tzinfo | str, translate: Translate) -> str:
    return writing.time_of_day(instant.astimezone(known_zone(zone)), translate)
