"""Menus, and sheets that ask for a value, as calls.

Screens get a ``Dialogs`` injected; tests may give them a fake with the same methods."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from datetime import date, time
from typing import Any

from kivy.uix.widget import Widget

from app.screens.common import formats
from app.screens.common.sheets import Sheets
from app.widgets.choices import ChoiceSheet, Picker
from app.widgets.items import Option
from app.widgets.menu import Menu
from app.widgets.pickers import DateSheet, TimeSheet
from app.widgets.sheet import Sheet


class Dialogs:
    """Opens menus and remembers which are open; what asks for a value is one of the ``sheets``."""

    def __init__(self, sheets: Sheets | None = None) -> None:
        self.sheets = sheets or Sheets()
        self._open: list[Menu] = []

    @property
    def top(self) -> Menu | Sheet | None:
        """The topmost open menu, or what asks for a value."""
        return self._open[-1] if self._open else self.sheets.picker

    def close_all(self) -> None:
        for menu in reversed(self._open[:]):
            menu.dismiss()
        self.sheets.close(self.sheets.picker)

    def choose(
        self,
        title: str,
        options: Sequence[Option],
        done: Callable[[Any], object],
        *,
        selected: Hashable | None = None,
        last: Option | None = None,
    ) -> Picker:
        """Choose one of ``options``, or the ``last`` one, which every search shows; ``done(key)``. Eight or more can be
        searched."""
        chosen = [] if selected is None else [selected]
        return self.sheets.pick(ChoiceSheet(title=title, options=list(options), last=last, selected=chosen), done)

    def choose_many(
        self,
        title: str,
        options: Sequence[Option],
        action: str,
        done: Callable[[list[Any]], object],
        *,
        selected: Iterable[Hashable] = (),
        can_all: bool = False,
        needs_one: bool = False,
    ) -> Picker:
        """Tick any of ``options``, at least one if it ``needs_one``, or all at once if it ``can_all``; ``action`` is
        the word on the confirming button; ``done(keys)``."""
        picker = ChoiceSheet(
            title=title,
            options=list(options),
            selected=list(selected),
            multiple=True,
            needs_one=needs_one,
            can_all=can_all,
            confirm=action,
        )
        return self.sheets.pick(picker, done)

    def pick_time(self, title: str, start: time | None, done: Callable[[time], object]) -> Picker:
        """Ask for a time of day (24 hours)."""
        picker = TimeSheet(start, title=title, separator=formats.current().time_separator)
        return self.sheets.pick(picker, done)

    def pick_date(
        self,
        title: str,
        start: date,
        done: Callable[[date], object],
        *,
        today: date,
        first: date | None = None,
    ) -> Picker:
        """Ask for a day, not before ``first``; ``today`` is ringed."""
        words = formats.current()
        picker = DateSheet(
            title=title,
            chosen=start,
            today=today,
            first=first,
            months=words.months,
            weekdays=words.weekdays_short,
            written=formats.wall_day,
        )
        return self.sheets.pick(picker, done)

    def menu(
        self, anchor: Widget, title: str, items: Sequence[Option], done: Callable[[Any], object], text: str = ""
    ) -> Menu:
        """Open a menu at ``anchor``; ``done(key)``. ``title``, and ``text`` below it, say what it is about."""
        menu = Menu(items=list(items), anchor=anchor, title=title, text=text)
        menu.bind(on_choose=lambda _menu, key: done(key))
        return self._show(menu)

    def explain(self, anchor: Widget, title: str, text: str) -> Menu:
        """Words about what is at ``anchor``."""
        return self.menu(anchor, title, (), lambda _key: None, text)

    def _show(self, menu: Menu) -> Menu:
        self._open.append(menu)
        menu.bind(on_dismiss=self._open.remove)
        menu.open()
        return menu
