"""Suggestions in words: what was, never what will be. Codes and numbers come from ``Suggestion``, rendered in any language."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import time
from types import MappingProxyType

from app.domain import writing
from app.domain.models import Schedule
from app.domain.writing import Translate
from app.services.suggestions.find import Cause, Finding, Kind, Option

_CAUSES: Mapping[Cause, str] = MappingProxyType(
    {
        Cause.BUSY: "{robot} was busy with {mission}",
        Cause.OTHER: "{robot} was busy with something that was not planned here",
        Cause.STOPPED: "{robot} stood still",
        Cause.SILENT: "{robot} did not answer",
        Cause.BATTERY: "the battery of {robot} was too low",
    }
)
_FOUND = "{schedule} came late in {late} of its last {starts} starts"
_TYPICALLY = "{found}, typically {minutes} min"
_BECAUSE = "{found}: {cause}"
_PLACES: Mapping[str, str] = MappingProxyType(
    {
        "at": "At {time}",
        "later": "{minutes} min later",
        "earlier": "{minutes} min earlier",
        "robot": "On {robot}",
        "group": "On any robot of {group}",
    }
)
_TIMES: Mapping[int, str] = MappingProxyType(
    {0: "{where} it would never have been late", 1: "{where} it would have been late once"}
)
_OFTEN = "{where} it would have been late {late} times"
_DONE: Mapping[str, str] = MappingProxyType(
    {
        "at": "Move to {time}",
        "later": "Move {minutes} min later",
        "earlier": "Move {minutes} min earlier",
        "robot": "Use {robot}",
        "group": "Any of {group}",
    }
)
_SINCE = "{schedule}: since then late {late} of {starts} (before {late_before} of {starts_before}, replayed {replayed} of {starts_before})"


@dataclass(frozen=True)
class Change:
    """An option with the names of its sentence. ``draft``: the schedule as it would be, to be shown in the form; ``at``: its new time of
    day, None where it comes several times a day."""

    option: Option
    draft: Schedule
    robot: str = ""
    group: str = ""
    at: time | None = None


@dataclass(frozen=True)
class Suggestion:
    """``whose``: its robot, or its group."""

    finding: Finding
    schedule: Schedule
    whose: str
    changes: tuple[Change, ...] = ()


@dataclass(frozen=True)
class Result:
    """What came of a suggestion that was accepted at least two weeks ago: ``late`` of ``starts`` since then. ``replayed``: how many of
    those before would have been late by the replay, which is what was promised."""

    schedule: Schedule
    late: int
    starts: int
    late_before: int
    starts_before: int
    replayed: int
    answer_id: int = field(default=0, compare=False)


def sentence(suggestion: Suggestion, translate: Translate = lambda text: text, called: str = "") -> str:
    """What was found: "Kits to line 2 came late in 16 of its last 20 starts, typically 9 min: Aino was busy with Waste". ``called``: what
    people call the schedule; empty: by its name."""
    one = suggestion.finding
    text = translate(_FOUND).format(schedule=called or suggestion.schedule.name, late=one.late, starts=one.starts)
    if one.typical_s is not None:
        text = translate(_TYPICALLY).format(found=text, minutes=max(1, round(one.typical_s / 60)))
    if one.cause in _CAUSES:
        cause = translate(_CAUSES[one.cause]).format(robot=suggestion.whose, mission=one.mission)
        text = translate(_BECAUSE).format(found=text, cause=cause)
    return text


def promise(change: Change, translate: Translate = lambda text: text) -> str:
    """What would have been: "At 07:50 it would have been late once"."""
    where = _named(_PLACES, change, translate)
    return translate(_TIMES.get(change.option.late, _OFTEN)).format(where=where, late=change.option.late)


def action(change: Change, translate: Translate = lambda text: text) -> str:
    """What its button says: "Move to 07:50"."""
    return _named(_DONE, change, translate)


def since_then(result: Result, translate: Translate = lambda text: text, called: str = "") -> str:
    return translate(_SINCE).format(
        schedule=called or result.schedule.name,
        late=result.late,
        starts=result.starts,
        late_before=result.late_before,
        starts_before=result.starts_before,
        replayed=result.replayed,
    )


def _named(texts: Mapping[str, str], change: Change, translate: Translate) -> str:
    option, key = change.option, str(change.option.kind)
    if option.kind is Kind.TIME:
        key = "at" if change.at is not None else "later" if option.value > 0 else "earlier"
    at = "" if change.at is None else writing.time_of_day(change.at, translate)
    return translate(texts[key]).format(
        time=at, minutes=round(abs(option.value) / 60), robot=change.robot, group=change.group
    )
