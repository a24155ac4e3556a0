"""The sentences of an import for each added or changed object; none for unchanged ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime, time
from functools import partial, reduce
from types import MappingProxyType

from app.domain import writing
from app.domain.message import Message, message, render
from app.domain.models import Between, Fleet, HandOver, Overlap, Robot, Schedule, Settings
from app.services.catalogue.fields import SECTIONS, Field, Fields, differing
from app.services.planning import public_holidays, sentences

LONG = {"guid", "certificate_sha256", "parameters"}  # attributes whose values say nothing to a reader
WORDS: Mapping[str, Mapping[object, Message]] = MappingProxyType(
    {
        "theme": {"light": message("Light"), "dark": message("Dark"), "contrast": message("High contrast")},
        "keyboard": {"auto": message("When needed"), "on": message("Always"), "off": message("Never")},
        "language": {"en": "English", "fi": "Suomi"},
        "overlap": {
            Overlap.SKIP: message("Not run"),
            Overlap.QUEUE: message("Waits"),
            Overlap.PARALLEL: message("Beside it"),
        },
        "hand_over": {HandOver.AT_ONCE: message("At once"), HandOver.WHEN_FREE: message("When it is free")},
        "respect_working_days": {True: message("no"), False: message("yes")},
        "history_limit": {None: message("All")},
        "dim_from": {None: message("Never")},
    }
)  # of values, by attribute

# By section of the file: for new objects, and for changed ones.
SENTENCES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "fleets": ("fleet {name} added", "fleet {name} changed: {what}"),
        "fleets.waiting": (
            "fleet {name} added, it is switched off and needs a password",
            "fleet {name} changed: {what}. It is switched off and needs a password",
        ),
        "fleets.weaker": (
            "the connection to fleet {name} is no longer encrypted",
            "the certificate of fleet {name} is no longer the only trusted one",
        ),
        "robots": ("robot {name} added", "robot {name} changed: {what}"),
        "robots.waiting": (
            "robot {name} added, it is switched off and needs a password",
            "robot {name} changed: {what}. It is switched off and needs a password",
        ),
        "robots.weaker": (
            "the connection to robot {name} is no longer encrypted",
            "the certificate of robot {name} is no longer the only trusted one",
        ),
        "groups": ("group {name} added", "group {name} changed: {what}"),
        "places": ("place {name} added", "place {name} changed: {what}"),
        "missions": ("mission {name} added", "mission {name} changed: {what}"),
        "missions.own": ("mission {name} of {robot} added", "mission {name} of {robot} changed: {what}"),
        "schedules": ("schedule {name} added", "schedule {name} changed: {what}"),
    }
)


def line(kind: str, before: object, after: object, more: Sequence[Message] = (), **names: str) -> Iterator[Message]:
    """``before``: None if it is new. ``more``: changes besides its fields. ``names``: values of the sentence."""
    added, changed = SENTENCES[kind]
    if before is None:
        yield message(added, **names)
    elif words := [*_changes(before, after, SECTIONS[kind.partition(".")[0]]), *more]:
        what = reduce(lambda so_far, word: message("{words}, {word}", words=so_far, word=word), words)
        yield message(changed, what=what, **names)


def _changes(before: object, after: object, fields: Fields) -> Iterator[Message]:
    """With both values, unless those are long or belong to other objects."""
    for field in differing(before, after, fields):
        if field.special or field.attribute in LONG:
            yield field.label
        else:
            was, is_now = (_value(each, field) for each in (before, after))
            yield message("{name} {before} → {after}", name=field.label, before=was, after=is_now)


def _value(of: object, field: Field) -> object:
    value = getattr(of, field.attribute)
    if field.attribute == "recurrence" and isinstance(of, Schedule):
        return partial(sentences.sentence, of)
    if field.attribute == "holiday_country" and value:
        return {"msgid": public_holidays.countries().get(value, value), "params": {}}  # as Settings has it
    if field.attribute == "holiday_subdivision" and isinstance(of, Settings):
        value = public_holidays.subdivisions(of.holiday_country).get(value, value)
    return _shown(field.attribute, value)


def of_machine(kind: str, before: Robot | Fleet | None, after: Robot | Fleet) -> Iterator[Message]:
    if isinstance(after, Robot) and after.fleet is not None:  # what has changed of that is said of the fleet
        own = before.within(after.fleet) if isinstance(before, Robot) else None
        yield from line(kind, own and _by_its_own_switch(own), _by_its_own_switch(after), name=after.name)
        return
    has_new_password = after.token not in (None, before and before.token)
    state = f"{kind}.waiting" if after.needs_password else kind
    yield from line(state, before, after, [message("Password")] * has_new_password, name=after.name)
    not_encrypted, not_pinned = SENTENCES[f"{kind}.weaker"]
    if before and before.address.startswith("https:") and after.address.startswith("http:"):
        yield message(not_encrypted, name=after.name)
    elif before and before.certificate_sha256 and not after.certificate_sha256:
        yield message(not_pinned, name=after.name)


def _by_its_own_switch(robot: Robot) -> Robot:
    return replace(robot, enabled=robot.is_on_by_itself)


def of_setting(field: Field, before: object, after: object) -> Message:
    was, is_now = (_value(each, field) for each in (before, after))
    return message("{name}: {before} → {after}", name=field.label, before=was, after=is_now)


def _shown(attribute: str, value: object) -> object:
    """As screens write it."""
    words = WORDS.get(attribute, {})
    match value:
        case _ if value in words:
            return words[value]
        case None | "":
            return message("none")
        case bool():
            return message("yes") if value else message("no")
        case int() if attribute.startswith("dim_"):
            return partial(writing.time_of_day, time(value))
        case int() | float():
            return _measured(attribute, partial(writing.count, value) if isinstance(value, int) else value)
        case datetime():
            return partial(writing.end_in_words, value)
        case Between(start, end):
            return partial(writing.times, start, end)
        case tuple():
            return partial(sentences.weekdays, value)
    return value.removeprefix("http://") if isinstance(value, str) else value


def _measured(attribute: str, n: object) -> object:
    """With its unit."""
    match attribute.rpartition("_")[2]:
        case "minutes":
            return message("{n} min", n=n)
        case "seconds":
            return message("{n} s", n=n)
        case "percent":
            return message("{n} %", n=n)
    return n


def stops_a_robot(line: Message) -> bool:
    """Whether a line says that a robot is switched off until its password is entered."""
    return "needs a password" in render(line)
