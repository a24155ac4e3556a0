"""The sentences of an import for each added or changed object; none for unchanged ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import reduce
from types import MappingProxyType

from app.domain.message import Message, message, render
from app.domain.models import Fleet, Robot
from app.services.catalogue.fields import SECTIONS, Fields, differing

# By section of the file: for new objects, and for changed ones.
SENTENCES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "fleets": ("fleet {name} added", "fleet {name} changed: {what}"),
        "fleets.waiting": (
            "fleet {name} added, it is switched off and needs a password",
            "fleet {name} changed: {what}. It is switched off and needs a password",
        ),
        "robots": ("robot {name} added", "robot {name} changed: {what}"),
        "robots.waiting": (
            "robot {name} added, it is switched off and needs a password",
            "robot {name} changed: {what}. It is switched off and needs a password",
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
    """Numbers and yes or no with both values; others are long, or names of the format."""
    for field in differing(before, after, fields):
        was, is_now = getattr(before, field.attribute), getattr(after, field.attribute)
        if not field.special and all(value is None or isinstance(value, int | float) for value in (was, is_now)):
            yield message("{name} from {before} to {after}", name=field.name, before=_shown(was), after=_shown(is_now))
        else:
            yield field.name


def of_robot(before: Robot | None, after: Robot) -> Iterator[Message]:
    if after.fleet is not None:  # what has changed of that is said of the fleet
        yield from line("robots", before and before.within(after.fleet), after, name=after.name)
        return
    not_encrypted = message("the connection to robot {name} is no longer encrypted", name=after.name)
    not_pinned = message("the certificate of robot {name} is no longer the only trusted one", name=after.name)
    yield from _of_connection("robots", before, after, not_encrypted, not_pinned)


def of_fleet(before: Fleet | None, after: Fleet) -> Iterator[Message]:
    not_encrypted = message("the connection to fleet {name} is no longer encrypted", name=after.name)
    not_pinned = message("the certificate of fleet {name} is no longer the only trusted one", name=after.name)
    yield from _of_connection("fleets", before, after, not_encrypted, not_pinned)


def _of_connection(
    kind: str, before: Robot | Fleet | None, after: Robot | Fleet, not_encrypted: Message, not_pinned: Message
) -> Iterator[Message]:
    has_new_password = after.token not in (None, before and before.token)
    kind = f"{kind}.waiting" if after.needs_password else kind
    yield from line(kind, before, after, [message("password")] * has_new_password, name=after.name)
    if before is None:
        return
    if before.address.startswith("https:") and after.address.startswith("http:"):
        yield not_encrypted
    elif before.certificate_sha256 and not after.certificate_sha256:
        yield not_pinned


def of_setting(name: Message, before: object, after: object) -> Message:
    return message(
        "setting {name} changed from {before} to {after}", name=name, before=_shown(before), after=_shown(after)
    )


def _shown(value: object) -> Message | int | float:
    if value is None or value == "":
        return message("none")
    if isinstance(value, bool):
        return message("yes") if value else message("no")
    return " ".join(value) if isinstance(value, tuple) else value if isinstance(value, int | float) else str(value)


def stops_a_robot(line: Message) -> bool:
    """Whether a line says that a robot is switched off until its password is entered."""
    return "needs a password" in render(line)
