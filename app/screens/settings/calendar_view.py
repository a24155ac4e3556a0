"""The exception calendar in words: a month of days, the entries of it, what an import brought. Pure."""
from __future__ import annotations

from calendar import Calendar
from collections.abc import Mapping
from datetime import date
from typing import Any

from app.domain.models import DayException
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.settings.country_names import in_language, translations
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.view import NoticeView
from app.services.files.calendar_import import Imported
from app.services.planning.working_days import DayLook, Ground, spans

Row = dict[str, Any]

YEARS = (1970, 2199)                     # whose months are shown
CLOSED, HOLIDAY, EXTRA = "lock-outline", "flag-outline", "plus-circle-outline"
NONE = "none"                            # key of the option without holidays


def month_title(year: int, month: int) -> str:
    name = formats.current().months[month - 1]
    return f"{name[:1].upper()}{name[1:]} {year}"


def turned(year: int, month: int, months: int) -> tuple[int, int]:
    """The month so many further, within the years that are shown."""
    first, last = YEARS[0] * 12, YEARS[1] * 12 + 11
    index = min(max(year * 12 + month - 1 + months, first), last)
    return index // 12, index % 12 + 1


def month_days(facts: SettingsFacts, year: int, month: int, today: date) -> list[Row]:
    """Properties of MonthDay, in weeks from Monday; days of other months are blank."""
    return [_blank() if day.month != month else _day(facts.calendar.look(day), day, today)
            for week in Calendar().monthdatescalendar(year, month) for day in week]


def _blank() -> Row:
    return {"day": None, "text": "", "look": "work", "icon": "", "today": False}


def _day(look: DayLook, day: date, today: date) -> Row:
    shown, icon = ("work", "") if look.is_working else ("free", "")
    if look.ground is not Ground.WEEK:
        shown, icon = ("extra", EXTRA) if look.is_working else ("closed", HOLIDAY if look.ground is Ground.HOLIDAY else CLOSED)
    return {"day": day, "text": str(day.day), "look": shown, "icon": icon, "today": day == today}


def entry_rows(facts: SettingsFacts, year: int, month: int) -> list[Row]:
    """Rows of DaysRow: what was entered and the public holidays, in order of their days in that month."""
    first, last = date(year, month, 1), max(day for day in Calendar().itermonthdates(year, month) if day.month == month)
    found = [(begins, _entry(exception, begins, ends)) for exception in facts.exceptions for begins, ends in spans(exception, year)
             if begins <= last and first <= ends]
    found += [(day, _holiday(day, look.name)) for day, look in facts.calendar.exceptional(first, last) if look.ground is Ground.HOLIDAY]
    return [row for _begins, row in sorted(found, key=lambda entry: (entry[0], entry[1]["text"]))]


def _entry(exception: DayException, begins: date, ends: date) -> Row:
    notes = [span(begins, ends), _("extra working day") if exception.is_working else _("closed")]
    if exception.yearly:
        notes.append(_("every year"))
    if exception.source:
        notes.append(exception.source)
    return {"key": ("own", exception.id, begins), "text": exception.name, "note": " · ".join(notes),
            "icon": EXTRA if exception.is_working else CLOSED, "removable": True}


def _holiday(day: date, name: str) -> Row:
    return {"key": ("holiday", 0, day), "text": name, "note": " · ".join((span(day, day), _("public holiday"))), "icon": HOLIDAY,
            "removable": False}


def span(first: date, last: date) -> str:
    """"Mon 6 Jul – Sun 19 Jul", or one day."""
    return formats.wall_day(first) if first == last else f"{formats.wall_day(first)} – {formats.wall_day(last)}"


def year_note(facts: SettingsFacts, year: int) -> str:
    """By how many days the calendar differs from the week's rule in a year."""
    weekly = facts.settings.is_working_day
    found = list(facts.calendar.exceptional(date(year, 1, 1), date(year, 12, 31)))
    closed = sum(weekly(day) and not look.is_working for day, look in found)
    extra = sum(look.is_working and not weekly(day) for day, look in found)
    if not found:
        return _("{year}: no special days").format(year=year)
    words = [ngettext("{n} working day closed", "{n} working days closed", closed).format(n=closed)]
    if extra:
        words.append(ngettext("{n} extra", "{n} extra", extra).format(n=extra))
    return _("{year}: {what}").format(year=year, what=", ".join(words))


# ---------------------------------------------------------------------- public holidays
def country_phrase(facts: SettingsFacts) -> str:
    return translations().get(facts.settings.holiday_country, facts.country) or _("No country")


def region_phrase(facts: SettingsFacts) -> str:
    if not facts.has_regions:
        return "–"
    return facts.region or _("All of the country")


def country_options(names: Mapping[str, str]) -> list[Row]:
    return [{"key": NONE, "text": _("No country"), "note": ""},
            *({"key": code, "text": name, "note": code} for code, name in in_language(names).items())]


def region_options(names: Mapping[str, str]) -> list[Row]:
    return [{"key": NONE, "text": _("All of the country"), "note": _("without the holidays of single regions")},
            *({"key": code, "text": name, "note": code} for code, name in names.items())]


# ---------------------------------------------------------------------- an import
def import_result(result: Imported) -> NoticeView:
    """How many days were taken, and what was left."""
    notes = []
    if result.added:
        text = ngettext("{n} closed day imported", "{n} closed days imported", result.days).format(n=result.days)
        names = [f"{entry.name}: {span(entry.first_day, entry.last_day)}" for entry in result.added[:3]]
        more = len(result.added) - len(names)
        notes.append(", ".join(names) + (ngettext(" and {n} more", " and {n} more", more).format(n=more) if more else ""))
    else:
        text = _("Everything in the file is here already")
    if result.known and result.added:
        notes.append(ngettext("{n} entry was here already", "{n} entries were here already", result.known).format(n=result.known))
    if result.past:
        notes.append(ngettext("{n} entry is past", "{n} entries are past", result.past).format(n=result.past))
    if result.left_out:
        notes.append(ngettext("{n} event can't be taken: it has no date, or repeats otherwise than yearly",
                              "{n} events can't be taken: they have no date, or repeat otherwise than yearly",
                              result.left_out).format(n=result.left_out))
    return NoticeView(text, "\n".join(notes), "attention" if result.left_out else "done", "alert" if result.left_out else "check-circle")


def removed_sentence(exception: DayException) -> str:
    return _("{name} is no longer in the calendar").format(name=exception.name)
