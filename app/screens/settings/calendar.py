"""Settings, Constraints: closed days and extra working days, by hand, by country, from a file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from datetime import date
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty

from app.domain.models import DayException, InvalidInput
from app.i18n import _
from app.screens.common import formats
from app.screens.common.problems import sentence_of
from app.screens.settings import calendar_view as view
from app.screens.settings.files import FileSheet
from app.screens.settings.page import PageContext
from app.screens.settings.view import NoticeView, went_wrong
from app.services.files.calendar_import import CalendarFile
from app.services.planning import public_holidays
from app.services.planning.working_days import Ground
from app.widgets import month  # noqa: F401  (registers kivy classes)
from app.widgets.dialogs import FormDialog
from app.widgets.display import SectionCard, Tile
from app.widgets.lists import Row
from app.widgets.sheet import Sheet


class DaysRow(Row, Tile):
    """An entry of the calendar. Actions: "edit", "remove"."""

    text = StringProperty()
    note = StringProperty()
    icon = StringProperty()
    removable = BooleanProperty(False)


class CalendarPart(EventDispatcher):
    """View model of the card: one month at a time, its entries, the country, the import."""

    month_title = StringProperty()
    weekdays = ListProperty([""] * 7)
    days = ListProperty()
    rows = ListProperty()
    year_note = StringProperty()
    country = StringProperty()
    country_problem = StringProperty()
    region = StringProperty()
    has_regions = BooleanProperty(False)

    def __init__(self, context: PageContext) -> None:
        super().__init__()
        self._context, self._services = context, context.services
        self._chosen_month: tuple[int, int] | None = None  # year and month; None: today's

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
        self.rows = view.entries(facts, year, number)
        self.year_note = view.year_note(facts, year)
        self.country, self.region, self.has_regions = (
            view.country_phrase(facts),
            view.region_phrase(facts),
            facts.has_regions,
        )

    def reached(self) -> None:
        self.country_problem = ""

    def turn(self, months: int) -> None:
        self._chosen_month = view.turned(*self._month, months)
        self.show()

    # ------------------------------------------------------------------ single entries
    def choose_day(self, day: date) -> None:
        """Edit the entry of a day, or begin one that turns a working day into a closed day or the other way round."""
        status = self._context.facts.calendar.day_status(day)
        if status.ground is Ground.OWN:
            self._edit(status.exception_id)
        else:
            self._open(DayException(status.name, day, day, is_working=not status.is_working))

    def act(self, key: view.EntryKey, action: str) -> None:
        exception_id, day = key
        if action == "remove":
            self._remove(exception_id)
        elif exception_id:
            self._edit(exception_id)
        else:
            self.choose_day(day)

    def add(self) -> None:
        today = self._context.today()
        day = today if (today.year, today.month) == self._month else date(*self._month, 1)
        self._open(DayException("", day, day))

    def _edit(self, exception_id: int | None) -> None:
        if (exception := self._exception(exception_id)) is not None:
            self._open(exception)

    def _open(self, exception: DayException) -> None:
        self._context.shell.dialogs.open(DaysDialog(self._context, exception))

    def _exception(self, exception_id: int | None) -> DayException | None:
        return next((entry for entry in self._context.facts.exceptions if entry.id == exception_id), None)

    def _remove(self, exception_id: int) -> None:
        if (exception := self._exception(exception_id)) is not None:
            self._context.remove(
                lambda: self._services.catalogue.remove_days(exception_id), view.removed_sentence(exception)
            )

    # ------------------------------------------------------------------ public holidays
    def choose_country(self) -> None:
        """The list of countries is in a large library: loading it takes a moment."""
        self._context.run(
            public_holidays.countries,
            lambda names: self._context.shell.dialogs.choose(
                _("Closed on the public holidays of"),
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
        self.country_problem = ""
        self._context.change(
            lambda: self._services.catalogue.set_public_holidays(country, region), self._holidays_refused
        )

    def _holidays_refused(self, problem: BaseException) -> None:
        self.country_problem = sentence_of(problem)

    # ------------------------------------------------------------------ a file
    def import_days(self) -> None:
        """Read a file, and ask which of its days are closed."""
        files, sheets = self._services.calendar_files, self._context.shell.sheets
        sheet = FileSheet(self._context, files.places, ".ics", what=_("Closed days"), foot=_("Import"))

        def read(found: CalendarFile) -> bool:
            if not found.events:
                sheet.problem = "\n".join(filter(None, (_("The file contains nothing new"), view.import_notes(found))))
                return False
            chooser = EventsSheet(found, self._context.today())
            chooser.bind(on_done=lambda sheet: self._take(found, sheet.chosen))
            sheets.show(chooser)
            return True

        sheet.bind(on_done=lambda sheet: sheet.run(files.read, read))
        sheets.show(sheet)

    def _take(self, found: CalendarFile, numbers: Iterable[int]) -> None:
        files, chosen = self._services.calendar_files, [found.events[number] for number in sorted(numbers)]
        self._context.shell.sheets.close()
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


class CalendarCard(SectionCard):
    """The calendar on its card; ``wide``: month and entries side by side."""

    part = ObjectProperty(None, rebind=True, allownone=True)
    wide = BooleanProperty(True)


class DaysForm(EventDispatcher):
    title = StringProperty()
    name = StringProperty()
    is_working = BooleanProperty(False)
    yearly = BooleanProperty(False)
    first_day = StringProperty()
    last_day = StringProperty()
    name_problem = StringProperty()
    first_day_problem = StringProperty()
    last_day_problem = StringProperty()
    outcome = ObjectProperty(NoticeView())
    saving = BooleanProperty(False)


class DaysDialog(FormDialog):
    """Closed days or extra working days: the first and the last day, and their name."""

    vm = ObjectProperty(None, rebind=True, allownone=True)

    def __init__(self, context: PageContext, exception: DayException, **kwargs: Any) -> None:
        self._context, self._exception = context, exception
        form = DaysForm(
            title=_("Edit days") if exception.id else _("Add days"),
            name=exception.name,
            is_working=exception.is_working,
            yearly=exception.yearly,
        )
        super().__init__(vm=form, **kwargs)
        self._show_days()
        form.fbind("name", lambda *_args: setattr(form, "name_problem", ""))

    def choose_kind(self, is_working: bool) -> None:
        self.vm.is_working = is_working

    def _show_days(self) -> None:
        self.vm.first_day = formats.wall_day(self._exception.first_day, year=True)
        self.vm.last_day = formats.wall_day(self._exception.last_day, year=True)
        self.vm.first_day_problem = self.vm.last_day_problem = ""

    def pick_first(self) -> None:
        self._context.shell.dialogs.pick_date(
            _("First day"), self._exception.first_day, self._first_picked, today=self._context.today()
        )

    def pick_last(self) -> None:
        self._context.shell.dialogs.pick_date(
            _("Last day"),
            self._exception.last_day,
            self._last_picked,
            today=self._context.today(),
            first=self._exception.first_day,
        )

    def _first_picked(self, day: date) -> None:
        """The number of days stays."""
        length = self._exception.last_day - self._exception.first_day
        self._exception = replace(self._exception, first_day=day, last_day=day + length)
        self._show_days()

    def _last_picked(self, day: date) -> None:
        self._exception = replace(self._exception, last_day=day)
        self._show_days()

    def save(self) -> None:
        form = self.vm
        if form.saving:
            return
        form.saving, form.outcome = True, NoticeView()
        exception = replace(self._exception, name=form.name, is_working=form.is_working, yearly=form.yearly)
        self._context.run(lambda: self._context.services.catalogue.save_days(exception), self._saved, self._refused)

    def _saved(self, exception: DayException) -> None:
        self.dismiss()
        self._context.was_saved("exceptions", exception)
        self._context.say(_("{name} is in the calendar").format(name=exception.name), icon="calendar-check")

    def _refused(self, problem: BaseException) -> None:
        self.vm.saving = False
        field = problem.field if isinstance(problem, InvalidInput) else ""
        if field in ("name", "first_day", "last_day"):
            setattr(self.vm, f"{field}_problem", sentence_of(problem))
        else:
            self.vm.outcome = went_wrong(problem)
