"""Pickers for gloved fingers: time of day (24 hours) and date. KivyMD's time picker knows only 12 hours.

Their words come from the caller; ``app.screens.common.overlays.Dialogs`` fills them in.
"""

from calendar import Calendar
from datetime import date, time

from kivy.properties import (
    BooleanProperty,
    ListProperty,
    NumericProperty,
    ObjectProperty,
    OptionProperty,
    StringProperty,
)

from app.widgets.dialogs import Dialog, FormDialog
from app.widgets.number_pad import BACKSPACE, NumberPad
from app.widgets.surfaces import Tap

ERASE = 8  # keys of a keyboard
ENTER = (13, 271)


class TimeEntry:
    """Hour and minute from digits typed one after the other: 0 6 3 0 is 06:30, 7 4 5 is 07:45.

    The first digit of a part may decide it alone (an hour never starts with 7); then the next part is typed at once.
    """

    def __init__(self, hour: int = 0, minute: int = 0) -> None:
        self.hour, self.minute = hour, minute
        self.part = "hour"
        self._half = False  # one digit of the present part has been typed

    def select(self, part: str) -> None:
        self.part, self._half = part, False

    def digit(self, number: int) -> None:
        limit = 23 if self.part == "hour" else 59
        value = getattr(self, self.part) * 10 + number if self._half else number
        if value > limit:  # the second digit cannot belong to the first: it begins the next part
            self._advance()
            self.digit(number)
            return
        setattr(self, self.part, value)
        if self._half or value * 10 > limit:
            self._advance()
        else:
            self._half = True

    def erase(self) -> None:
        """Zero the present part; on an untouched minute go back to the hour."""
        if self.part == "minute" and not self._half and self.minute == 0:
            self.select("hour")
        setattr(self, self.part, 0)
        self._half = False

    def nudge(self, part: str, direction: int) -> None:
        """One hour, or to the next multiple of five minutes, round the clock and without touching the other part."""
        self.select(part)
        if part == "hour":
            self.hour = (self.hour + direction) % 24
        else:
            steps = self.minute // 5 + 1 if direction > 0 else -(-self.minute // 5) - 1
            self.minute = steps * 5 % 60

    def _advance(self) -> None:
        self.part = "minute" if self.part == "hour" else "hour"
        self._half = False


class TimePart(Tap):
    """Hour or minute, large; tapped it is the one typed into."""

    text = StringProperty()
    selected = BooleanProperty(False)


class TimePad(NumberPad):
    """The digits of a time, which is confirmed elsewhere."""

    KEYS = (*"123456789", "", "0", BACKSPACE)


class TimeDialog(Dialog):
    """Steps, keypad or keyboard; fires ``on_pick(datetime.time)``."""

    hour = NumericProperty(0)
    minute = NumericProperty(0)
    part = OptionProperty("hour", options=("hour", "minute"))
    separator = StringProperty(":")
    hour_word = StringProperty()
    minute_word = StringProperty()
    confirm = StringProperty()
    decline = StringProperty()

    __events__ = ("on_pick",)

    def __init__(self, start: time | None = None, **kwargs):
        self._entry = TimeEntry(start.hour, start.minute) if start else TimeEntry()
        super().__init__(**kwargs)
        self._show()

    def on_pick(self, value):
        """The time was confirmed; the dialog is closing."""

    def select(self, part: str) -> None:
        self._entry.select(part)
        self._show()

    def digit(self, number: int) -> None:
        self._entry.digit(number)
        self._show()

    def erase(self) -> None:
        self._entry.erase()
        self._show()

    def nudge(self, part: str, direction: int) -> None:
        self._entry.nudge(part, direction)
        self._show()

    def picked(self) -> None:
        self.dispatch("on_pick", time(self._entry.hour, self._entry.minute))
        self.dismiss()

    def takes_key(self, key, text):
        if text.isdecimal():
            self.digit(int(text))
        elif key == ERASE:
            self.erase()
        elif key in ENTER:
            self.picked()
        else:
            return super().takes_key(key, text)
        return True

    def _show(self):
        self.hour, self.minute, self.part = self._entry.hour, self._entry.minute, self._entry.part


class DayCell(Tap):
    """A day of the month grid; empty text = a day of another month."""

    day = ObjectProperty(None, allownone=True)
    text = StringProperty()
    selected = BooleanProperty(False)
    today = BooleanProperty(False)


class DateDialog(FormDialog):
    """A month of days; fires ``on_pick(datetime.date)``.

    ``months`` are the twelve names, ``weekdays`` the seven short ones from Monday; days before ``first`` or after ``last`` (None = no
    limit) cannot be chosen; ``today`` is ringed.
    """

    chosen = ObjectProperty(None, allownone=True)
    today = ObjectProperty(None, allownone=True)
    first = ObjectProperty(None, allownone=True)
    last = ObjectProperty(None, allownone=True)
    months = ListProperty([""] * 12)
    weekdays = ListProperty([""] * 7)
    year = NumericProperty(2000)
    month = NumericProperty(1)
    month_title = StringProperty()
    today_word = StringProperty()
    confirm = StringProperty()
    decline = StringProperty()

    __events__ = ("on_pick",)

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        shown = self.chosen or self.first or self.today
        if shown is not None:
            self.year, self.month = shown.year, shown.month
        for name in ("chosen", "today", "first", "last", "months", "year", "month"):
            self.fbind(name, self._build)
        self._build()

    def on_pick(self, value):
        """The day was confirmed; the dialog is closing."""

    def turn(self, months: int) -> None:
        """Show the month that many months away, within the years a date can have."""
        index = min(max(self.year * 12 + self.month - 1 + months, 12), 9999 * 12 + 11)
        self.year, self.month = index // 12, index % 12 + 1

    def show_today(self) -> None:
        """Choose today, or the nearest day that may be chosen."""
        day = self.today
        if day is None:
            return
        day = max(day, self.first) if self.first else day
        day = min(day, self.last) if self.last else day
        self.year, self.month, self.chosen = day.year, day.month, day

    def choose(self, day: date) -> None:
        self.chosen = day

    def picked(self) -> None:
        if self.chosen is not None:
            self.dispatch("on_pick", self.chosen)
            self.dismiss()

    def takes_key(self, key, text):
        if key in ENTER:
            self.picked()
        return key in ENTER or super().takes_key(key, text)

    def allowed(self, day: date) -> bool:
        return not (self.first and day < self.first) and not (self.last and day > self.last)

    def _build(self, *_):
        grid = self.ids.days
        if len(grid.children) != 42:
            grid.clear_widgets()
            for _n in range(42):
                cell = DayCell()
                cell.bind(on_release=lambda cell: self.choose(cell.day))
                grid.add_widget(cell)
        year, month = int(self.year), int(self.month)
        self.month_title = f"{self.months[month - 1]} {year}"
        days = list(Calendar().itermonthdays2(year, month))
        days += [(0, 0)] * (42 - len(days))
        for cell, (number, _weekday) in zip(reversed(grid.children), days, strict=True):
            cell.day = date(year, month, number) if number else None
            cell.text = str(number) if number else ""
            cell.disabled = cell.day is None or not self.allowed(cell.day)
            cell.selected = cell.day is not None and cell.day == self.chosen
            cell.today = cell.day is not None and cell.day == self.today
