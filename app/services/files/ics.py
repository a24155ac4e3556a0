"""iCalendar text (RFC 5545): the events and time zones of a file, as they are written, and content lines to be written.

Files come from many programs, and may be hostile. Only the needed lines are parsed: anything else in a file costs
nothing and spoils nothing.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TypeVar

T = TypeVar("T")

MOST_COMPONENTS = 50_000  # events, time zones, and the parts of these
FOLD_AT = 75  # octets of a line without its end (section 3.1)

COMPONENTS = {
    "VEVENT",
    "VTODO",
    "VJOURNAL",
    "VFREEBUSY",
    "VTIMEZONE",
    "VAVAILABILITY",
}  # that lie in the calendar itself
PARTS = {"VALARM", "STANDARD", "DAYLIGHT", "AVAILABLE", "PARTICIPANT", "VLOCATION", "VRESOURCE"}
STATES = {"TENTATIVE", "CONFIRMED", "CANCELLED"}
HEAD = {"METHOD", "X-WR-TIMEZONE"}
READ = {"VEVENT", "VTIMEZONE"}
PROPERTIES = {
    "VEVENT": {
        "UID",
        "SUMMARY",
        "DTSTART",
        "DTEND",
        "DURATION",
        "RRULE",
        "EXRULE",
        "RDATE",
        "EXDATE",
        "RECURRENCE-ID",
        "STATUS",
        "SEQUENCE",
        "DTSTAMP",
        "LAST-MODIFIED",
        "X-MICROSOFT-CDO-ALLDAYEVENT",
        "X-MICROSOFT-MSNCALENDAR-ALLDAYEVENT",
    },
    "VTIMEZONE": {"TZID", "X-LIC-LOCATION"},
    "STANDARD": {"DTSTART", "TZOFFSETFROM", "TZOFFSETTO", "RRULE", "RDATE"},
    "DAYLIGHT": {"DTSTART", "TZOFFSETFROM", "TZOFFSETTO", "RRULE", "RDATE"},
}

_MARKS_OF_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_MARK_OF_UTF_8 = b"\xef\xbb\xbf"
_FOLD = re.compile(rb"(?<![\r\n])[\r\n]+[ \t]")
_LINE = re.compile(rb"[^\r\n]+")
_NAME = re.compile(rb"\s*([\w-]{1,40})\s*[:;]")
_TEXT = re.compile(
    rb"\s*[\w-]*[a-z][\w-]*\s*:\s"
)  # such as "Status: cancelled", behind a raw line end in a description
_BEGINS = re.compile(rb"BEGIN\s*:\s*VCALENDAR\s*$", re.IGNORECASE)
_ENDS = re.compile(rb"\s*END\s*:\s*VCALENDAR", re.IGNORECASE)
_OTHER_COMPONENT = re.compile(r"V[A-Z]+|[Xx]-[\w-]+", re.ASCII)
_PARTS = re.compile(r'[^:;]*((?:;(?:"[^"]*"|[^":])*)?):(.*)', re.DOTALL)
_ESCAPED = re.compile(r"\\(.)", re.DOTALL)
_LINE_END = re.compile(r"\r\n|\n|\r")


class NotACalendar(ValueError):
    """The text is not an iCalendar file."""


class TooMuch(Exception):
    """The file holds more than is read."""


class Budget:
    """Limits of the work for a file: a number of dates, and seconds."""

    def __init__(self, dates: int, seconds: float) -> None:
        self._dates, self._ends_at = dates, time.monotonic() + seconds

    def spend(self) -> None:
        """For a date, or before a step that may take a second. Raises TooMuch."""
        self._dates -= 1
        if self._dates < 0 or time.monotonic() > self._ends_at:
            raise TooMuch("is too much work")

    def each(self, items: Iterable[T]) -> Iterator[T]:
        """These, each spent for. Raises TooMuch."""
        for item in items:
            self.spend()
            yield item


@dataclass(frozen=True)
class Property:
    """A value, and the parameters before it, as they are written."""

    parameters: str
    value: str

    def parameter(self, name: str) -> str:
        """Without quotes; "" if it is missing."""
        found = re.search(rf';\s*{name}\s*=\s*("[^"]*"|[^;]*)', self.parameters, re.IGNORECASE)
        return found[1].strip().strip('"') if found else ""

    @property
    def text(self) -> str:
        """The value of a text property."""
        return _ESCAPED.sub(lambda match: "\n" if match[1] in "nN" else match[1], self.value)


@dataclass
class Component:
    """An event, or a time zone with its parts: its needed properties, by name. From the calendar around it:
    ``in_cancellation``, whether it cancels its events, and ``usual_zone``, the name of its own time zone."""

    name: str
    properties: dict[str, list[Property]] = field(default_factory=dict)
    parts: list[Component] = field(default_factory=list)
    in_cancellation: bool = False
    usual_zone: str = ""

    def all(self, name: str) -> list[Property]:
        """Those with a value."""
        return [each for each in self.properties.get(name, ()) if each.value]

    def first(self, name: str) -> Property | None:
        return next(iter(self.all(name)), None)

    def text(self, name: str) -> str:
        """Of the first such property, without space around it; "" if it is missing."""
        found = self.first(name)
        return found.text.strip() if found else ""

    @property
    def is_cancelled(self) -> bool:
        """By the first valid STATUS: in capitals, as programs write it, or else in any case."""
        written = [found.text for found in self.all("STATUS")]
        found = [state for state in [*written, *map(str.upper, written)] if state in STATES]
        return self.in_cancellation or found[:1] == ["CANCELLED"]


# ---------------------------------------------------------------------- in
def components(content: bytes) -> tuple[list[Component], bool]:
    """The events and time zones of a file, and whether the file is whole. Raises NotACalendar and TooMuch."""
    reader = _Reader()
    for match in _LINE.finditer(_unfolded(content)):
        reader.take(match[0])
    if not reader.has_begun:
        raise NotACalendar("has no calendar")
    return reader.finish()


def _unfolded(content: bytes) -> bytes:
    """UTF-8 or an 8-bit encoding, each content line on one line: joined as octets, since a line may be folded inside a character."""
    if content.startswith(_MARKS_OF_UTF_16):
        content = content.decode("utf-16", "replace").encode("utf-8", "replace")
    return _FOLD.sub(b"", content.replace(b"\0", b"").replace(_MARK_OF_UTF_8, b""))


def _decoded(line: bytes) -> str:
    try:
        return line.decode()
    except UnicodeDecodeError:
        return line.decode("windows-1252", "replace")


class _Reader:
    """Takes line after line, then ``finish``. A missing end is where the next component begins; text outside calendars,
    or in other components, is ignored."""

    def __init__(self) -> None:
        self._found: list[Component] = []
        self.has_begun = self.is_inside = False  # of a calendar
        self._calendar: list[Component] = []
        self._head: dict[str, str] = {}  # what the calendar says of itself
        self._path: list[str] = []  # names of what is open: a component, and a part of it
        self._open: Component | None = None  # takes the properties
        self._count = 0

    def take(self, line: bytes) -> None:
        """Other text may precede a calendar on its first line, and follow it on its last."""
        if match := _ENDS.match(line):
            self._end("VCALENDAR")
            line = line[match.end() :]
        if self.is_inside:
            self._take(line)
        elif _BEGINS.search(line):
            self._begin("VCALENDAR")

    def _take(self, line: bytes) -> None:
        match = None if _TEXT.match(line) else _NAME.match(line)
        name = match[1].decode("ascii", "replace").upper() if match else ""
        if name in ("BEGIN", "END"):
            component = _property(line).value
            if _is_component(component):
                (self._begin if name == "BEGIN" else self._end)(component.upper())
        elif name in HEAD and not self._path:
            self._head[name] = _property(line).text
        elif self._open is not None and name in PROPERTIES[self._open.name]:
            self._open.properties.setdefault(name, []).append(_property(line))

    def finish(self) -> tuple[list[Component], bool]:
        """The components, and whether the file is complete; the unfinished component is not included."""
        is_whole = not self.is_inside
        if READ.intersection(self._path):
            self._calendar.pop()
        self._end("VCALENDAR")
        return self._found, is_whole

    def _begin(self, name: str) -> None:
        if name == "VCALENDAR":
            self._end(name)
            self.has_begun = self.is_inside = True
        elif not self._path or name in COMPONENTS:
            self._path, self._open = [name], self._new(name, self._calendar) if name in READ else None
        elif len(self._path) == 1:
            self._path.append(name)
            zone = self._open if self._path[0] == "VTIMEZONE" and name in PROPERTIES else None
            self._open = self._new(name, zone.parts) if zone else None

    def _new(self, name: str, among: list[Component]) -> Component:
        self._count += 1
        if self._count > MOST_COMPONENTS:
            raise TooMuch("has too many events")
        among.append(Component(name))
        return among[-1]

    def _end(self, name: str) -> None:
        if name == "VCALENDAR":
            for component in self._calendar:
                component.in_cancellation = self._head.get("METHOD", "").upper() == "CANCEL"
                component.usual_zone = self._head.get("X-WR-TIMEZONE", "")
            self._found += self._calendar
            self._calendar, self._head, self.is_inside = [], {}, False
            self._path, self._open = [], None
        elif name in self._path:
            self._path = self._path[:-1] if name == self._path[-1] else []
            self._open = self._calendar[-1] if READ.intersection(self._path) else None


def _is_component(name: str) -> bool:
    """And no text, such as "Begin: 9 am"."""
    return name.upper() in COMPONENTS | PARTS | {"VCALENDAR"} or _OTHER_COMPONENT.fullmatch(name) is not None


def _property(line: bytes) -> Property:
    text = _decoded(line)
    match = _PARTS.fullmatch(text)  # none if a quotation mark has no second one
    parameters, value = match.groups() if match else text.split(":", 1) if ":" in text else (text, "")
    return Property(parameters, value.strip())


# ---------------------------------------------------------------------- out
def text_line(name: str, text: str) -> str:
    """A text property, escaped and folded, with its line end."""
    text = _LINE_END.sub("\n", text)
    return line(name, text.replace("\\", "\\\\").replace(";", "\\;").replace(",", "\\,").replace("\n", "\\n"))


def line(name: str, value: str) -> str:
    """A content line, folded between characters so that none has more than 75 octets, with its line end."""
    text, parts = f"{name}:{value}", list[str]()
    while text:
        end = next(end for end in range(FOLD_AT - 1, 0, -1) if len(text[:end].encode()) < FOLD_AT)
        parts.append(text[:end])
        text = text[end:]
    return "\r\n ".join(parts) + "\r\n"
