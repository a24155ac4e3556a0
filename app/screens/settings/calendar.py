"""Settings, Conditions: days off and extra working days, by hand, by country, from a file."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from typing import Any

from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivymd.uix.boxlayout import MDBoxLayout

from app.domain.models import DayException
from app.i18n import _
from app.screens.common import formats
from app.screens.common.name_order import with_id
from app.screens.settings import calendar_view as view
from app.screens.settings.edit_sheet import EditSheet
from app.screens.settings.files import FileSheet
from app.screens.settings.page import ValuesPage
from app.services.catalogue.edit import Removed
from app.services.files.calendar_import import CalendarFile
from app.services.planning import public_holidays
from app.services.planning.working_days import Ground
from app.widgets import month  # noqa: F401  (registers kivy classes)
from app.widgets.sheet import Sheet


class CalendarPart(MDBoxLayout):
    """One month at a time, its entries, the country, the import."""

    month_title = StringProperty()
    weekdays = ListProperty([""] * 7)
    days = ListProperty()
    rows = ListProperty()
    page = ObjectProperty(rebind=True)
    country = StringProperty()
    region = StringProperty()
    has_regions = BooleanProperty(False)

    def __init__(self, page: ValuesPage) -> None:
        self._context, self._services = page.context, page.context.services
        self._chosen_month: tuple[int, int] | None = None  # year and month; None: today's
        super().__init__(page=page)

    # ------------------------------------------------------------------ showing
    @property
    def _month(self) -> tuple[int, int]:
        today = self._context.today()
        return self._chosen_month or (today.year, today.month)

    def show(self) -> None:
        facts = self._context.facts
        year, number = self._month
        self.month_title, self.weekdays = view.month_title(year, number), formats.current().weekdays_short
        self.days = view.month_days(facts, year, number, self._context.today())
        self.rows = view.entries(facts, year, number, self._context.opened("exceptions"))
        self.country, self.region, self.has_regions = (
            view.country_phrase(facts),
            view.region_phrase(facts),
            facts.has_regions,
        )

    def turn(self, months: int) -> None:
        self._chosen_month = view.turned(*self._month, months)
        self.show()

    # ------------------------------------------------------------------ single entries
    def choose_day(self, day: date) -> None:
        """Edit the entry of a day, or begin one that turns a working day into a day off or the other way round."""
        status = self._context.facts.calendar.day_status(day)
        if status.ground is Ground.OWN:
            self._edit(status.exception_id)
        else:
            self._open(DayException(status.name, day, day, is_working=not status.is_working))

    def open(self, key: view.EntryKey) -> None:
        exception_id, day = key
        if exception_id:
            self._edit(exception_id)
        else:
            self.choose_day(day)

    def add(self) -> None:
        today = self._context.today()
        day = today if (today.year, today.month) == self._month else date(*self._month, 1)
        self._open(DayException("", day, day))

    def _edit(self, exception_id: int | None) -> None:
        if (exception := with_id(self._context.facts.exceptions, exception_id)) is not None:
            self._open(exception)

    def _open(self, exception: DayException) -> None:
        self._context.shell.sheets.show(DaysSheet(self._context, exception))
        self.show()

    # ------------------------------------------------------------------ public holidays
    def choose_country(self) -> None:
        """The list of countries is in a large library: loading it takes a moment."""
        self._context.run(
            public_holidays.countries,
            lambda names: self._context.shell.dialogs.choose(
                _("Public holidays"),
                view.country_options(names),
                lambda code: self._save_holidays(code, ""),
                selected=self._context.facts.settings.holiday_country,
            ),
            key="settings countries",
        )

    def choose_region(self) -> None:
        settings = self._context.facts.settings
        self._context.run(
            lambda: public_holidays.subdivisions(settings.holiday_country),
            lambda names: self._context.shell.dialogs.choose(
                _("Region"),
                view.region_options(names),
                lambda code: self._save_holidays(settings.holiday_country, code),
                selected=settings.holiday_subdivision,
            ),
            key="settings regions",
        )

    def _save_holidays(self, country: str, region: str) -> None:
        self.page.problems.pop("holidays", None)
        self._context.change(
            lambda: self._services.catalogue.set_public_holidays(country, region),
            lambda problem: self.page.refuse("holidays", problem),
        )

    # ------------------------------------------------------------------ a file
    def import_days(self) -> None:
        """Read a file, and ask which of its days are closed."""
        files, sheets = self._services.calendar_files, self._context.shell.sheets

        def read(found: CalendarFile) -> bool:
            if sheets.top is not sheet:
                return False  # it was closed before the file was read
            if not found.events:
                sheet.problem = "\n".join(filter(None, (_("The file contains nothing new"), view.import_notes(found))))
                return False
            chooser = EventsSheet(found, self._context.today())
            chooser.bind(on_done=lambda sheet: self._take(found, sheet))
            sheets.show(chooser)
            return True

        sheet = FileSheet(
            self._context,
            files.places,
            ".ics",
            lambda sheet: sheet.run(files.read, read),
            what=_("Days off"),
            foot=_("Import"),
        )
        sheets.show(sheet)

    def _take(self, found: CalendarFile, sheet: EventsSheet) -> None:
        files, chosen = self._services.calendar_files, [found.events[number] for number in sorted(sheet.chosen)]
        self._context.shell.sheets.close(sheet)
        self._context.run(lambda: files.take(chosen), self._taken)

    def _taken(self, added: Sequence[DayException]) -> None:
        self._context.refresh()
        if added:
            day = max(min(entry.first_day for entry in added), self._context.today())
            self._chosen_month = day.year, day.month
            ids = [entry.id for entry in added]
            self._context.offer_undo(view.imported_sentence(added), lambda: self._services.catalogue.remove_days(*ids))


class EventsSheet(Sheet):
    """The events of a calendar file; those that are ticked close their days."""

    scrolls = BooleanProperty(False)
    items = ListProperty()
    notes = StringProperty()  # what the file has besides
    all_chosen = BooleanProperty(False)

    def __init__(self, found: CalendarFile, today: date, **kwargs: Any) -> None:
        self._found, self._today = found, today
        self.chosen = {number for number, event in enumerate(found.events) if event.whole}
        super().__init__(notes=view.import_notes(found), **kwargs)
        self._show()

    def tick(self, number: int) -> None:
        self.chosen ^= {number}
        self._show()

    def on_other(self) -> None:
        """All, or none if all are ticked."""
        self.chosen = set() if self.all_chosen else set(range(len(self._found.events)))
        self._show()

    def _show(self) -> None:
        self.items = view.import_items(self._found, self._today, self.chosen)
        self.title = view.chosen_phrase(self.chosen, self._found)
        self.all_chosen = len(self.chosen) == len(self._found.events)


class DaysSheet(EditSheet):
    """Days off or extra working days: the first and the last day, and their name."""

    kind = "exceptions"
    at_once = ("name", "is_working", "first_day", "last_day", "yearly")
    fields = ("name", "first_day", "last_day")

    def delete(self, it: DayException) -> Removed:
        return self.context.services.catalogue.remove_days(it.id)

    def pick_first(self) -> None:
        """The number of days stays."""
        days, today = self.it, self.context.today()
        length = days.last_day - days.first_day
        self.context.shell.dialogs.pick_date(
            _("First day"), days.first_day, lambda day: self.choose(first_day=day, last_day=day + length), today=today
        )

    def pick_last(self) -> None:
        self.context.shell.dialogs.pick_date(
            _("Last day"),
            self.it.last_day,
            lambda day: self.choose(last_day=day),
            today=self.context.today(),
            first=self.it.first_day,
        )
