"""iCalendar text (RFC 5545): the events of a file, by the library icalendar, and content lines to be written.

A file to import may be hostile: the library needs 10 s and hundreds of MiB for 5 MiB of text, and never comes back from a
time zone that changes every second. What is given to it is therefore limited first.
"""
from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from icalendar import Calendar, Event

MOST_BYTES = 1024 * 1024
MOST_LINES = 40_000
MOST_ZONE_PARTS = 60
FOLD_AT = 75                             # octets of a line without its end (section 3.1)

_LINE_END = re.compile(r"\r\n|\n|\r")


class NotACalendar(ValueError):
    """The text is no iCalendar file."""


class TooMuch(ValueError):
    """The file holds more than is read."""


# ---------------------------------------------------------------------- in
def events(content: bytes) -> list[Event]:
    """Every VEVENT of a file. Raises NotACalendar when it is something else or ends in the middle, and TooMuch."""
    from icalendar import Calendar  # 12 MiB and half a second, which nobody needs before this
    from icalendar.timezone import tzp

    try:
        lines = _LINE_END.split(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise NotACalendar("is not UTF-8") from error
    if len(content) > MOST_BYTES or len(lines) > MOST_LINES:
        raise TooMuch("is too large")
    tzp.use_default()                                 # forget the zones that an earlier file defined
    try:
        calendars = Calendar.from_ical("\r\n".join(lines), multiple=True)
    except (ValueError, LookupError, AttributeError, TypeError) as error:
        raise NotACalendar(str(error)) from error
    if not calendars or any(calendar.name != "VCALENDAR" for calendar in calendars):
        raise NotACalendar("is no VCALENDAR, or has no end")
    for calendar in calendars:
        _check_zones(calendar)
    return [event for calendar in calendars for event in calendar.events]


def _check_zones(calendar: Calendar) -> None:
    """Refuse zones that take long to evaluate: real ones change once or twice a year."""
    zones = calendar.timezones
    rules = [rule for zone in zones for part in zone.standard for rule in part.rrules]
    rules += [rule for zone in zones for part in zone.daylight for rule in part.rrules]
    if sum(len(zone.subcomponents) for zone in zones) > MOST_ZONE_PARTS or any(
            rule.get("FREQ") != ["YEARLY"] or {"BYHOUR", "BYMINUTE", "BYSECOND"} & rule.keys() for rule in rules):
        raise TooMuch("has a time zone that changes too often")


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
