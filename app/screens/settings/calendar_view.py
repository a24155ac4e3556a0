"""Texts and values that Settings shows of the calendar: the days of a month, its entries, the result of an import. Pure functions."""

from __future__ import annotations

from calendar import Calendar
from collections.abc import Collection, Iterable, Mapping, Sequence
from datetime import date

from app.domain.models import DayException
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.settings.country_names import in_language, translations
from app.screens.settings.facts import SettingsFacts
from app.services.files.calendar_days import FoundDays, LeftOut
from app.services.files.calendar_import import CalendarFile
from app.services.planning.working_days import DayStatus, Ground, spans
from app.widgets.items import Action, Day, Item, Option

YEARS = (1970, 2199)  # whose months are shown
CLOSED, HOLIDAY, EXTRA = "calendar-remove-outline", "calendar-star", "plus-circle-outline"

EntryKey = tuple[int, date]  # id of the exception, 0 for a public holiday; the first day


def month_title(year: int, month: int) -> str:
    name = formats.current().months[month - 1]
    return f"{name[:1].upper()}{name[1:]} {year}"


def turned(year: int, month: int, months: int) -> tuple[int, int]:
    """The month ``months`` later, within the years that are shown."""
    first, last = YEARS[0] * 12, YEARS[1] * 12 + 11
    index = min(max(year * 12 + month - 1 + months, first), last)
    return index // 12, index % 12 + 1


def month_days(facts: SettingsFacts, year: int, month: int, today: date) -> list[Day]:
    """In weeks from Monday; days of other months are blank."""
    return [
        Day() if day.month != month else _day(facts.calendar.day_status(day), day, today)
        for week in Calendar().monthdatescalendar(year, month)
        for day in week
    ]


def _day(found: DayStatus, day: date, today: date) -> Day:
    status, icon = ("work", "") if found.is_working else ("free", "")
    if found.ground is not Ground.WEEK:
        status, icon = (
            ("extra", EXTRA) if found.is_working else ("closed", HOLIDAY if found.ground is Ground.HOLIDAY else CLOSED)
        )
    return Day(day, str(day.day), status, icon, day == today)


def entries(facts: SettingsFacts, year: int, month: int, chosen: int | None = None) -> list[Item]:
    """The exceptions and public holidays of that month, in order of their days."""
    first, last = date(year, month, 1), max(day for day in Calendar().itermonthdates(year, month) if day.month == month)
    found = [
        (begins, _entry(exception, begins, ends, is_chosen=exception.id == chosen))
        for exception in facts.exceptions
        for begins, ends in spans(exception, year)
        if begins <= last and first <= ends
    ]
    found += [
        (day, _holiday(day, status.name))
        for day, status in facts.calendar.exceptional(first, last)
        if status.ground is Ground.HOLIDAY
    ]
    return [item for _begins, item in sorted(found, key=lambda entry: (entry[0], entry[1].title))]


def _entry(exception: DayException, begins: date, ends: date, *, is_chosen: bool) -> Item:
    notes = [span(begins, ends), *([_("extra working day")] if exception.is_working else [])]
    if exception.yearly:
        notes.append(_("every year"))
    if exception.source:
        notes.append(exception.source)
    return Item(
        (exception.id, begins),
        exception.name,
        " · ".join(notes),
        icon=EXTRA if exception.is_working else CLOSED,
        look="chosen" if is_chosen else "plain",
        actions=(Action("open", icon="chevron-right"),),
    )


def _holiday(day: date, name: str) -> Item:
    return Item((0, day), name, " · ".join((span(day, day), _("public holiday"))), icon=HOLIDAY)


def span(first: date, last: date) -> str:
    """ "Mon 6 Jul – Sun 19 Jul", or one day."""
    return formats.wall_day(first) if first == last else f"{formats.wall_day(first)} – {formats.wall_day(last)}"


# ---------------------------------------------------------------------- public holidays
def country_phrase(facts: SettingsFacts) -> str:
    return translations().get(facts.settings.holiday_country, facts.country) or _("No country")


def region_phrase(facts: SettingsFacts) -> str:
    if not facts.has_regions:
        return "–"
    return facts.region or _("All of the country")


def country_options(names: Mapping[str, str]) -> list[Option]:
    """By code; an empty one for no country."""
    return [Option("", _("No country")), *(Option(code, name, note=code) for code, name in in_language(names).items())]


def region_options(names: Mapping[str, str]) -> list[Option]:
    """By code; an empty one for the whole country."""
    return [
        Option("", _("All of the country"), note=_("without the holidays of single regions")),
        *(Option(code, name, note=code) for code, name in names.items()),
    ]


# ---------------------------------------------------------------------- an import
def import_items(found: CalendarFile, today: date, chosen: Collection[int]) -> list[Item]:
    """The events by their number, ``chosen`` ones ticked: first those with whole days."""
    items = []
    for whole, head in ((True, _("Whole days")), (False, _("With times of day"))):
        rows = [
            Item(number, event.name, _days_found(event, today), ticked=number in chosen, strong=False)
            for number, event in enumerate(found.events)
            if event.whole is whole
        ]
        items += [Item(head, head, look="head"), *rows] if rows else []
    return items


def chosen_phrase(chosen: Collection[int], found: CalendarFile) -> str:
    return _("{n} of {count} chosen").format(n=len(chosen), count=len(found.events))


def _days_found(event: FoundDays, today: date) -> str:
    first, last = event.days[0], event.days[-1]
    if first.yearly:
        notes = [dated_span(*_next(first, today)), _("every year")]
        if (first.first_day.month, first.first_day.day) == (2, 29):
            notes.append(_("leap years only"))
    elif first == last:
        notes = [dated_span(first.first_day, first.last_day)]
    else:
        n = days_in(event.days)
        notes = [ngettext("{n} day", "{n} days", n).format(n=n), dated_span(first.first_day, last.last_day)]
    return " · ".join(notes)


def _next(yearly: DayException, today: date) -> tuple[date, date]:
    """Its next day: 29 February may take eight years."""
    coming = (span for year in range(today.year, today.year + 9) for span in spans(yearly, year) if span[1] >= today)
    return next(coming, (yearly.first_day, yearly.last_day))


def dated_span(first: date, last: date) -> str:
    """The same as ``span`` with the years."""
    begins, ends = (formats.wall_day(day, year=True) for day in (first, last))
    return begins if first == last else f"{begins} – {ends}"


def days_in(entries: Iterable[DayException]) -> int:
    """Of yearly ones those of one year."""
    return sum((entry.last_day - entry.first_day).days + 1 for entry in entries)


def import_notes(found: CalendarFile) -> str:
    """What a file contains apart from the days shown."""
    notes = [] if found.is_whole else [_("The file ends in the middle: days may be missing")]
    if found.known:
        notes.append(
            ngettext(
                "{n} event is in the calendar already", "{n} events are in the calendar already", found.known
            ).format(n=found.known)
        )
    if found.past:
        notes.append(ngettext("{n} past event left out", "{n} past events left out", found.past).format(n=found.past))
    notes += [_left_out(why, n).format(n=n) for why in LeftOut if (n := found.left_out.get(why, 0))]
    return "\n".join(notes)


def _left_out(why: LeftOut, n: int) -> str:
    match why:
        case LeftOut.ENDLESS:
            return ngettext(
                "{n} event left out: it repeats without end, and more often than yearly",
                "{n} events left out: they repeat without end, and more often than yearly",
                n,
            )
        case LeftOut.OUT_OF_RANGE:
            return ngettext(
                "{n} event left out: it lasts more than a year, or is after 2199",
                "{n} events left out: they last more than a year, or are after 2199",
                n,
            )
        case LeftOut.UNREADABLE:
            return ngettext("{n} event left out: it can't be read", "{n} events left out: they can't be read", n)


def imported_sentence(added: Sequence[DayException]) -> str:
    n = days_in(added)
    return ngettext("{n} day off imported", "{n} days off imported", n).format(n=n)
