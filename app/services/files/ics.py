"""iCalendar text (RFC 5545) as far as the app speaks it: content lines in and out, and the events of a file.

Reading is lenient about line ends and blank lines, as files of many programs are; writing is to the letter: CRLF, folded at 75 octets.
"""
from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

FOLD_AT = 75                             # octets of a line without its end (section 3.1)

_LINE_END = re.compile(r"\r\n|\n|\r")
_NAME = re.compile(r"[A-Za-z0-9-]+", re.ASCII)
_PARAMETER = re.compile(r';([A-Za-z0-9-]+)=((?:"[^"]*"|[^";:,]*)(?:,(?:"[^"]*"|[^";:,]*))*)', re.ASCII)
_ESCAPED = re.compile(r"\\(.)", re.DOTALL)


class NotACalendar(ValueError):
    """The text is no iCalendar file."""


@dataclass(frozen=True)
class Property:
    """One content line. Names and parameters' names are in capitals, parameters' values without quotes."""
    name: str
    value: str
    parameters: Mapping[str, str] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """The value of a text property as people read it."""
        return _ESCAPED.sub(lambda match: "\n" if match[1] in "nN" else match[1], self.value)


Event = Mapping[str, Property]
"""A VEVENT's own properties by name, of several alike the first; what stands in its alarms is left out."""


# ---------------------------------------------------------------------- in
def events(text: str) -> Iterator[Event]:
    """Every VEVENT of a file. Raises NotACalendar when it is something else, or ends in the middle."""
    lines = list(content_lines(text))
    if not lines or (lines[0].name, lines[0].value.strip().upper()) != ("BEGIN", "VCALENDAR"):
        raise NotACalendar("does not begin with BEGIN:VCALENDAR")
    inside: list[str] = []
    event: dict[str, Property] = {}
    for line in lines:
        if line.name == "BEGIN":
            inside.append(line.value.strip().upper())
            if inside[-1] == "VEVENT":
                event = {}
        elif line.name == "END":
            if not inside or inside.pop() != line.value.strip().upper():
                raise NotACalendar(f"END:{line.value} has no beginning")
            if line.value.strip().upper() == "VEVENT":
                yield event
        elif inside and inside[-1] == "VEVENT":
            event.setdefault(line.name, line)
    if inside:
        raise NotACalendar(f"{inside[-1]} has no end")


def content_lines(text: str) -> Iterator[Property]:
    """The unfolded lines. Raises NotACalendar for one that is none."""
    for line in _unfolded(text.removeprefix("\ufeff")):
        if line.strip():
            yield _property(line)


def _unfolded(text: str) -> Iterator[str]:
    parts: list[str] = []
    for line in _LINE_END.split(text):
        if line[:1] in (" ", "\t") and parts:
            parts.append(line[1:])
            continue
        if parts:
            yield "".join(parts)
        parts = [line]
    yield "".join(parts)


def _property(line: str) -> Property:
    name = _NAME.match(line)
    if name is None:
        raise NotACalendar(f"{line[:40]!r} is no content line")
    position, parameters = name.end(), {}
    while (found := _PARAMETER.match(line, position)) is not None:
        parameters[found[1].upper()] = found[2].replace('"', "")
        position = found.end()
    if line[position:position + 1] != ":":
        raise NotACalendar(f"{line[:40]!r} is no content line")
    return Property(name[0].upper(), line[position + 1:], parameters)


# ---------------------------------------------------------------------- out
def text_line(name: str, text: str) -> str:
    """A text property, escaped and folded, with its line end."""
    text = _LINE_END.sub("\n", text)
    return line(name, text.replace("\\", "\\\\").replace(";", "\\;").replace(",", "\\,").replace("\n", "\\n"))


def line(name: str, value: str) -> str:
    """A content line, folded between characters so that none has more than 75 octets, with its line end."""
    folded: list[str] = []
    part, octets = "", 0
    for character in f"{name}:{value}":
        size = len(character.encode())
        if octets + size > FOLD_AT:
            folded.append(part)
            part, octets = " ", 1
        part += character
        octets += size
    return "\r\n".join([*folded, part]) + "\r\n"
