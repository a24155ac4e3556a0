"""Settings, Constraints: closed days and extra working days, by hand, by country, from a file."""
from __future__ import annotations

from dataclasses import replace
from datetime import date, datetime
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty

from app.domain.models import DayException, InvalidInput
from app.i18n import _
from app.screens.common import formats
from app.screens.common.problems import sentence_of
from app.screens.settings import calendar_view as words
from app.screens.settings.data import FileModel
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.page import BAR_BESIDE, Desk, OutcomeModel
from app.screens.settings.view import NoticeView
from app.services.files.calendar_import import CalendarFiles, Imported
from app.services.planning import public_holidays
from app.services.planning.working_days import Ground
from app.widgets import month  # noqa: F401  (kivy's Factory learns it)
from app.widgets.dialogs import FormDialog
from app.widgets.display import SectionCard
from app.widgets.lists import Row
from app.widgets.surfaces import Surface


class DaysRow(Row, Surface):
    """An entry of the calendar. Actions: "edit", "remove"."""
    text = StringProperty()
    note = StringProperty()
    icon = StringProperty()
    removable = BooleanProperty(False)


class CalendarPart(EventDispatcher):
    """What the card shows and does: one month at a time, its entries, the country, the import."""
    month_title = StringProperty()
    weekdays = ListProperty([""] * 7)
    days = ListProperty()
    rows = ListProperty()
    year_note = StringProperty()
    country = StringProperty()
    country_problem = StringProperty()
    region = StringProperty()
    has_regions = BooleanProperty(False)
    file = ObjectProperty(rebind=True)
    outcome = ObjectProperty(rebind=True)

    def __init__(self, desk: Desk) -> None:
        super().__init__(file=FileModel(), outcome=OutcomeModel())
        self._desk = desk
        self._shown: tuple[int, int] | None = None            # year and month; None: today's
        container = desk.container
        self._files = CalendarFiles(container.db, container.catalogue, container.clock)

    # ------------------------------------------------------------------ showing
    def show(self, facts: SettingsFacts, now: datetime) -> None:
        today = now.astimezone(ZoneInfo(facts.settings.timezone)).date()
        year, number = self._shown or (today.year, today.month)
        self.month_title, self.weekdays = words.month_title(year, number), formats.current().weekdays_short
        self.days = words.month_days(facts, year, number, today)
        self.rows = words.entry_rows(facts, year, number)
        self.year_note = words.year_note(facts, year)
        self.country, self.region, self.has_regions = words.country_phrase(facts), words.region_phrase(facts), facts.has_regions

    def reached(self) -> None:
        self.country_problem = self.file.problem = ""
        self.outcome.tell(NoticeView())
        self._desk.work(self._files.newest_calendar, self._suggest, key="settings calendars")

    def _suggest(self, newest: Path | None) -> None:
        if not self.file.path:
            self.file.path = str(newest or self._files.directory / "calendar.ics")

    def turn(self, months: int) -> None:
        today = self._today()
        self._shown = words.turned(*(self._shown or (today.year, today.month)), months)
        self._show_again()

    def _today(self) -> date:
        return self._desk.now().astimezone(ZoneInfo(self._desk.facts.settings.timezone)).date()

    def _show_again(self) -> None:
        self.show(self._desk.facts, self._desk.now())

    # ------------------------------------------------------------------ single entries
    def choose_day(self, day: date) -> None:
        """Change the entry of a day, or begin the one that would turn it into its contrary."""
        look = self._desk.facts.calendar.look(day)
        if look.ground is Ground.OWN:
            self._edit(look.exception_id)
        else:
            self._open(DayException(look.name, day, day, is_working=not look.is_working))

    def act(self, key: tuple[str, int, date], action: str) -> None:
        kind, number, day = key
        if action == "remove":
            self._remove(number)
        elif kind == "own":
            self._edit(number)
        else:
            self.choose_day(day)

    def add(self) -> None:
        today = self._today()
        year, number = self._shown or (today.year, today.month)
        day = today if (today.year, today.month) == (year, number) else date(year, number, 1)
        self._open(DayException("", day, day))

    def _edit(self, exception_id: int | None) -> None:
        if (exception := self._exception(exception_id)) is not None:
            self._open(exception)

    def _open(self, exception: DayException) -> None:
        self._desk.shell.dialogs.open(DaysDialog(self._desk, exception))

    def _exception(self, exception_id: int | None) -> DayException | None:
        return next((entry for entry in self._desk.facts.exceptions if entry.id == exception_id), None)

    def _remove(self, exception_id: int) -> None:
        exception, catalogue = self._exception(exception_id), self._desk.container.catalogue
        if exception is None:
            return

        def removed(what: Any) -> None:
            self._desk.refresh()
            self._desk.offer_undo(words.removed_sentence(exception), lambda: self._desk.work(
                lambda: catalogue.restore(what), lambda _none: self._desk.refresh()))
        self._desk.work(lambda: catalogue.remove_days(exception_id), removed)

    # ------------------------------------------------------------------ public holidays
    def choose_country(self) -> None:
        """The list of countries is in a large library: the first look at it takes a moment."""
        self._desk.work(public_holidays.countries, lambda names: self._desk.shell.dialogs.choose(
            _("Closed on the public holidays of"), words.country_options(names), self._country_chosen,
            selected=self._desk.facts.settings.holiday_country or words.NONE), key="settings countries")

    def _country_chosen(self, code: str) -> None:
        self._save_holidays("" if code == words.NONE else code, "")

    def choose_region(self) -> None:
        settings = self._desk.facts.settings
        self._desk.work(lambda: public_holidays.subdivisions(settings.holiday_country), lambda names: self._desk.shell.dialogs.choose(
            _("Region"), words.region_options(names),
            lambda code: self._save_holidays(settings.holiday_country, "" if code == words.NONE else code),
            selected=settings.holiday_subdivision or words.NONE), key="settings regions")

    def _save_holidays(self, country: str, region: str) -> None:
        self.country_problem = ""
        self._desk.work(lambda: self._desk.container.catalogue.set_public_holidays(country, region), lambda _settings: self._desk.refresh(),
                        self._holidays_refused)

    def _holidays_refused(self, problem: BaseException) -> None:
        self.country_problem = sentence_of(problem)

    # ------------------------------------------------------------------ a file
    def import_days(self) -> None:
        file = self.file
        if file.busy:
            return
        file.busy, file.problem = True, ""
        self.outcome.tell(NoticeView())
        path = file.path
        self._desk.work(lambda: self._files.import_days(path), self._imported, self._not_imported)

    def _imported(self, result: Imported) -> None:
        self.file.busy = False
        if result.added:
            first = result.added[0].first_day
            today = self._today()
            self._shown = (first.year, first.month) if first >= today else (today.year, today.month)
        self.outcome.tell(words.import_result(result))
        self._desk.refresh()

    def _not_imported(self, problem: BaseException) -> None:
        self.file.busy = False
        self.file.problem = sentence_of(problem)


class CalendarCard(SectionCard):
    """The calendar on its card; ``wide``: month and entries beside each other."""
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
    first_problem = StringProperty()
    last_problem = StringProperty()
    problem = StringProperty()
    saving = BooleanProperty(False)


PROBLEMS = {"name": "name_problem", "first_day": "first_problem", "last_day": "last_problem"}


class DaysDialog(FormDialog):
    """Closed days or extra working days: from when to when, under which name."""
    vm = ObjectProperty(None, rebind=True, allownone=True)

    def __init__(self, desk: Desk, exception: DayException, **kwargs: Any) -> None:
        self._desk, self._exception = desk, exception
        form = DaysForm(title=_("Edit days") if exception.id else _("Add days"), name=exception.name, is_working=exception.is_working,
                        yearly=exception.yearly)
        super().__init__(vm=form, **kwargs)
        self.ids.page.bar_margin = BAR_BESIDE
        self._say_days()
        form.fbind("name", lambda *_args: setattr(form, "name_problem", ""))

    def choose_kind(self, is_working: bool) -> None:
        self.vm.is_working = is_working

    def _say_days(self) -> None:
        self.vm.first_day = formats.wall_day(self._exception.first_day, year=True)
        self.vm.last_day = formats.wall_day(self._exception.last_day, year=True)
        self.vm.first_problem = self.vm.last_problem = ""

    def pick_first(self) -> None:
        self._desk.shell.dialogs.pick_date(_("First day"), self._exception.first_day, self._first_picked, today=self._today())

    def pick_last(self) -> None:
        self._desk.shell.dialogs.pick_date(_("Last day"), self._exception.last_day, self._last_picked, today=self._today(),
                                           first=self._exception.first_day)

    def _first_picked(self, day: date) -> None:
        """As many days as before, from that one on."""
        length = self._exception.last_day - self._exception.first_day
        self._exception = replace(self._exception, first_day=day, last_day=day + length)
        self._say_days()

    def _last_picked(self, day: date) -> None:
        self._exception = replace(self._exception, last_day=day)
        self._say_days()

    def _today(self) -> date:
        return self._desk.now().astimezone(ZoneInfo(self._desk.facts.settings.timezone)).date()

    def save(self) -> None:
        form = self.vm
        if form.saving:
            return
        form.saving, form.problem = True, ""
        exception = replace(self._exception, name=form.name, is_working=form.is_working, yearly=form.yearly)
        self._desk.work(lambda: self._desk.container.catalogue.save_days(exception), self._saved, self._refused)

    def _saved(self, exception: DayException) -> None:
        self.dismiss()
        self._desk.refresh()
        self._desk.say(_("{name} is in the calendar").format(name=exception.name), icon="calendar-check")

    def _refused(self, problem: BaseException) -> None:
        form = self.vm
        form.saving = False
        field = problem.field if isinstance(problem, InvalidInput) else ""
        setattr(form, PROBLEMS.get(field, "problem"), sentence_of(problem))
