"""iCalendar text (RFC 5545): the events of a file, by the library icalendar, and content lines to be written.

A file to import may be hostile: the library needs 10 s and hundreds of MiB for 5 MiB of text, and never comes back from a
time zone that changes every second. What is given to it is therefore limited first.
"""
from __future__ import annotations

import re
from calendar import monthrange
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from datetime import tzinfo

    from icalendar import Calendar, Event

MOST_BYTES = 1024 * 1024
MOST_LINES = 40_000
MOST_EVENTS = 5000
MOST_SEPARATORS = 30_000                 # between dates and other values, and between parameters
MOST_ZONE_PARTS = 60                     # and rules
LONGEST_ZONE_NAME = 80
FOLD_AT = 75                             # octets of a line without its end (section 3.1)

_ZONE_RULE = {"FREQ", "INTERVAL", "BYMONTH", "BYDAY", "BYMONTHDAY", "UNTIL", "COUNT", "WKST"}
_ZONE_WEEKDAY = re.compile(r"([+-]?[1-5])?[A-Z]{2}")
_MOST_DAYS = {month: monthrange(2028, month)[1] for month in range(1, 13)}
_LINE_END = re.compile(r"\r\n|\n|\r")
_FOLD = re.compile(r"(?:\r\n)+[ \t]")
_EVENT = re.compile(r"^BEGIN\b.*VEVENT", re.IGNORECASE | re.MULTILINE)


class NotACalendar(ValueError):
    """The text is no iCalendar file."""


class TooMuch(ValueError):
    """The file holds more than is read."""


# ---------------------------------------------------------------------- in
def events(content: bytes) -> list[Event]:
    """Every VEVENT of a file. Raises NotACalendar when it is something else or ends in the middle, and TooMuch."""
    from icalendar import Calendar  # 12 MiB and half a second, which nobody needs before this
    from icalendar.timezone import tzp
    from icalendar.timezone.zoneinfo import ZONEINFO

    class Zones(ZONEINFO):
        def timezone(self, name: str) -> tzinfo | None:
            """None for an unknown one, also where its name is that of a directory of zones, or endless."""
            try:
                return super().timezone(name) if len(name) <= LONGEST_ZONE_NAME else None
            except OSError:
                return None

    try:
        lines = _LINE_END.split(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise NotACalendar("is not UTF-8") from error
    if len(content) > MOST_BYTES or len(lines) > MOST_LINES or content.count(b",") + content.count(b";") > MOST_SEPARATORS:
        raise TooMuch("is too large")
    text = _FOLD.sub("", "\r\n".join(lines))
    if len(_EVENT.findall(text)) > MOST_EVENTS:
        raise TooMuch("has too many events")
    tzp.use(Zones())                                  # and forget the zones that an earlier file defined
    try:
        calendars = Calendar.from_ical(text, multiple=True)
    except (ValueError, LookupError, AttributeError, TypeError) as error:
        raise NotACalendar(str(error)) from error
    if not calendars or any(calendar.name != "VCALENDAR" for calendar in calendars):
        raise NotACalendar("is no VCALENDAR, or has no end")
    for calendar in calendars:
        _check_zones(calendar)
    return [event for calendar in calendars for event in calendar.events]


def _check_zones(calendar: Calendar) -> None:
    """Refuse zones that take long to evaluate: real ones change once or twice a year, on a day of a certain month."""
    parts = [part for zone in calendar.timezones for part in zone.subcomponents]
    rules = [rule for part in parts for rule in as_list(part.get("RRULE"))]
    if len(parts) > MOST_ZONE_PARTS or len(rules) > MOST_ZONE_PARTS or not all(map(_is_seldom, rules)) or any(
            "EXRULE" in part for part in parts):
        raise TooMuch("has a time zone that changes too often")


def as_list(value: Any) -> list[Any]:
    """Of a property that may be there never, once or several times."""
    return [] if value is None else value if isinstance(value, list) else [value]


def _is_seldom(rule: Mapping[str, list[Any]]) -> bool:
    """Whether a rule of a zone names a few days of a year, and days that come."""
    weekdays = [_ZONE_WEEKDAY.fullmatch(str(day)) for day in rule.get("BYDAY", [])]
    dates, months = [abs(date) for date in rule.get("BYMONTHDAY", [])], rule.get("BYMONTH", [])
    if rule.keys() - _ZONE_RULE or rule.get("FREQ") != ["YEARLY"] or rule.get("INTERVAL", [1]) != [1]:
        return False
    if len(weekdays) > 1 or len(months) > 1 or not all(weekdays) or (not months and (weekdays or dates)):
        return False
    if weekdays and weekdays[0] and weekdays[0][1]:              # "the second Sunday"
        return not dates
    return not dates or (min(dates) <= _MOST_DAYS.get(int(months[0]), 0) and (bool(weekdays) or len(dates) == 1))


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
