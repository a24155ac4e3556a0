"""A time of day (24 hours) and a date, each in a sheet. KivyMD's time picker knows only 12 hours.

What depends on the language comes from the caller; ``app.screens.common.overlays.Dialogs`` fills it in.
"""

from calendar import Calendar
from datetime import date, time

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.gridlayout import GridLayout

from app.widgets.children import refill
from app.widgets.choices import Picker
from app.widgets.events import Fires
from app.widgets.items import Day
from app.widgets.month import MonthDay
from app.widgets.rest import rest
from app.widgets.scrolling import turn_to
from app.widgets.surfaces import Tap

ENTER = (13, 271)  # keys of a keyboard


class TimeCell(Tap):
    """An hour, a minute, or a day of every month."""

    number = NumericProperty(0)
    text = StringProperty()
    selected = BooleanProperty(False)


class TimeCells(Fires, GridLayout):
    """A cell for each of ``numbers``, the ``chosen`` one marked: ``on_choose(number)``. ``word(number)`` is on it."""

    numbers = ListProperty()
    chosen = NumericProperty(-2)
    word = ObjectProperty("{:02d}".format)

    __events__ = ("on_choose",)

    def on_numbers(self, *_):
        refill(self, self.numbers, self._cell)
        self.on_chosen()

    def _cell(self, number):
        return TimeCell(
            number=number, text=self.word(number), on_release=lambda _cell: self.dispatch("on_choose", number)
        )

    def on_chosen(self, *_):
        for cell in self.children:
            cell.selected = cell.number == self.chosen


class EnterPicks(Picker):
    """Enter picks what is chosen."""

    def takes_key(self, key, text):
        if key in ENTER:
            self.on_done()
        return key in ENTER


class TimeSheet(EnterPicks):
    """Picks a datetime.time: an hour and a minute, in any order, or the button."""

    hour = NumericProperty(0)
    minute = NumericProperty(0)
    separator = StringProperty(":")

    def __init__(self, start: time | None = None, **kwargs):
        self._tapped = set()
        super().__init__(**kwargs)
        if start is not None:
            self.hour, self.minute = start.hour, start.minute

    def choose(self, part: str, number: int) -> None:
        """The ``hour`` or the ``minute`` was tapped: with the other one it is whole. Until then the minutes come in sight."""
        setattr(self, part, number)
        self._tapped.add(part)
        if len(self._tapped) == 2:
            self.on_done()
        elif part == "hour" and self.ids.page.do_scroll_y:
            turn_to(self.ids.minutes.__self__)
            rest.after_moving()

    def turn(self, minutes: int) -> None:
        """That much later: before 17:00 is 16:59."""
        self.hour, self.minute = divmod(int(self.hour * 60 + self.minute + minutes) % (24 * 60), 60)

    def on_done(self):
        self.dispatch("on_pick", time(int(self.hour), int(self.minute)))


class DateSheet(EnterPicks):
    """Picks a datetime.date in a month of days.

    ``months`` are the twelve names, ``weekdays`` the seven short ones from Monday, ``written(day)`` a day in words; days before ``first``
    (None = no limit) cannot be chosen; ``today`` is ringed.
    """

    chosen = ObjectProperty(None)
    today = ObjectProperty(None, allownone=True)
    first = ObjectProperty(None, allownone=True)
    months = ListProperty([""] * 12)
    weekdays = ListProperty([""] * 7)
    written = ObjectProperty(str)
    year = NumericProperty(2000)
    month = NumericProperty(1)
    month_title = StringProperty()
    days = ListProperty()

    def __init__(self, **kwargs):
        self._reveal = Clock.create_trigger(self._bring_in_sight, 0.05)  # once the days have their places
        super().__init__(**kwargs)
        self.year, self.month = self.chosen.year, self.chosen.month
        self.bind(chosen=self._build, first=self._build, year=self._build, month=self._build)
        self._build()

    def turn(self, months: int) -> None:
        """Show the month that many months away, within the years a date can have."""
        index = min(max(self.year * 12 + self.month - 1 + months, 12), 9999 * 12 + 11)
        self.year, self.month = index // 12, index % 12 + 1

    def show_today(self) -> None:
        """Choose today, or the nearest day that may be chosen."""
        day = max(self.today, self.first or date.min)
        self.year, self.month, self.chosen = day.year, day.month, day

    def on_done(self):
        self.dispatch("on_pick", self.chosen)

    def _build(self, *_):
        year, month = int(self.year), int(self.month)
        self.month_title = f"{self.months[month - 1]} {year}"
        found = [date(year, month, number) if number else None for number in Calendar().itermonthdays(year, month)]
        self.days = [Day() if day is None else self._day(day) for day in [*found, *[None] * (42 - len(found))]]
        self._reveal()

    def _bring_in_sight(self, _dt):
        """The chosen day, if it is of this month."""
        for cell in self.walk(restrict=True):
            if isinstance(cell, MonthDay) and cell.item.chosen:
                turn_to(cell)

    def _day(self, day: date) -> Day:
        is_off = day < (self.first or date.min)
        return Day(day, str(day.day), today=day == self.today, chosen=day == self.chosen, off=is_off)
