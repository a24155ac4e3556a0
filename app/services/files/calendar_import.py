"""Days off from an .ics file, such as a company's calendar or a list of school holidays: read first, and taken as a person chooses."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from zoneinfo import ZoneInfo

from app.database.settings import CalendarRepository, SettingsRepository
from app.domain import names
from app.domain.models import DayException, InvalidInput
from app.services.catalogue import settings_edit
from app.services.catalogue.edit import Edit
from app.services.files import ics
from app.services.files.calendar_days import Found, FoundDays, LeftOut, read_days
from app.services.files.exports import DataFiles
from app.services.files.file_access import read_file


@dataclass(frozen=True, kw_only=True)
class CalendarFile(Found):
    """What can be taken of a file: ``events`` with days that are not in the calendar yet; ``known`` counts those without."""

    name: str
    known: int


class CalendarFiles(DataFiles):
    """Imports calendar files."""

    def read(self, path: str) -> CalendarFile:
        """The days of a file that are not in the calendar yet. Raises InvalidInput("path", …) with one sentence."""
        source = self._resolved(path)
        content = read_file(source)
        c = self._db.read()
        zone = ZoneInfo(SettingsRepository().load(c).timezone)
        try:
            found = read_days(content, names.of_file(source.stem), zone, self._clock.now().astimezone(zone).date())
        except ics.NotACalendar:
            raise InvalidInput("path", "{path} is not a calendar file (.ics)", path=source) from None
        except ics.TooMuch:
            raise InvalidInput(
                "path",
                "{path} is too large for a calendar of days off: export only those, and for a few years",
                path=source,
            ) from None
        if not found.events:
            raise _nothing_in(found, source)
        there = set(map(_identity, CalendarRepository().all(c)))
        shown = names.of_file(source.name)
        new = [
            FoundDays(
                tuple(replace(day, source=shown) for day in event.days if _identity(day) not in there), event.whole
            )
            for event in found.events
        ]
        events = [event for event in new if event.days]
        known = len(new) - len(events)
        return CalendarFile(**vars(replace(found, events=events)), name=shown, known=known)

    def take(self, chosen: Iterable[FoundDays]) -> list[DayException]:
        """Add the days of these events to the calendar, all or none. Returns the new ones."""
        days = [day for event in chosen for day in event.days]

        def add(edit: Edit) -> list[DayException]:
            there = set(map(_identity, edit.days.all(edit.c)))
            return settings_edit.save_days(edit, [day for day in days if _identity(day) not in there])

        return self._catalogue.edit(add)


def _nothing_in(found: Found, path: Path) -> InvalidInput:
    if not found.is_whole:
        return InvalidInput("path", "{path} ends in the middle, before any days: copy it again", path=path)
    if found.left_out.get(LeftOut.ENDLESS):
        return InvalidInput(
            "path", "{path} has no days to import: repeated days are imported if they are yearly or end", path=path
        )
    if found.left_out:
        return InvalidInput("path", "{path} has no readable days to import", path=path)
    return InvalidInput("path", "{path} has no days to import", path=path)


def _identity(day: DayException) -> DayException:
    """Regardless of its file."""
    return replace(day, id=0, source="")
