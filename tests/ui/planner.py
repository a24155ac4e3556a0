"""What the tests of the Scheduler share: the screen on real services at an invented plant on Friday 20 Nov 2026, 14:38, and a planner's
hands."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import date

from kivy.clock import Clock
from kivy.core.window import Window
from kivy.uix.scrollview import ScrollView

from app.container import Container
from app.domain.models import Schedule
from app.domain.robot import MissionParameter
from app.screens.scheduler import facts
from app.screens.scheduler.cards import FormSheet, ScheduleRow
from app.screens.scheduler.view import Listing
from app.widgets.buttons import CommandButton, IconButton, Segment
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.fields import Field, SearchField
from app.widgets.lanes import Lanes
from app.widgets.menu import Menu, MenuRow
from app.widgets.month import MonthDay
from app.widgets.pickers import DateSheet, TimeCell
from app.widgets.sheet import FOOT_RESTS
from app.widgets.snackbar import SECONDS, Snackbar
from tests.ui.driver import Driver
from tests.ui.whole_app import shown

KITS, WASTE = "Deliver kits to line 2", "Waste to compactor"
PALLETS = MissionParameter("count", "Pallets", "integer", 2, 1, 80)


@contextmanager
def opened(container: Container, ui: Driver) -> Iterator[object]:
    """The Scheduler on screen, everything read."""
    with shown(container, ui, "scheduler") as app:
        app.plan = app.shell.navigator.screen("scheduler").vm
        settle(app, ui)
        yield app


def rebuild_scheduler(app, ui) -> None:
    """The screen as when it was opened: what one test has entered or scrolled must not be there for the next one of the same app."""
    app.shell.dialogs.close_all()
    app.shell.snackbars.clear()
    app.shell.go("scheduler")
    app.plan.tab, app.plan.moving = "plan", None
    app.plan.listed.listing, app.plan.listed.searching = Listing(), False
    app.plan.form.is_open = False
    app.plan._show_window(facts.Window())
    settle(app, ui)
    for scrolled in ui.find_all(ScrollView):
        scrolled.scroll_y = 1
    ui.advance(0.6)  # where a sheet was takes no taps until then
    assert Window.children == [app.root]


def settle(app, ui) -> None:
    ui.advance(0.3)
    ui.wait(lambda: app.shell.background.idle)
    ui.advance(0.3)
    ui.wait(lambda: app.shell.background.idle)


def press(app, ui, word: str) -> None:
    ui.tap(ui.find(CommandButton, text=word))
    settle(app, ui)


def new(app, ui) -> None:
    """An empty form."""
    app.plan.begin()
    settle(app, ui)


def tab(app, ui, key: str) -> None:
    app.shell.navigator.screen("scheduler").choose_tab(key)
    settle(app, ui)


def field(ui, label: str) -> Field:
    return ui.find(Field, label=label)


def choose(app, ui, label: str, option: str) -> None:
    """Tap a field of the form, and in the list that opens one option."""
    if not app.plan.form.is_open:
        new(app, ui)
    reveal(ui, field(ui, label))
    ui.tap(field(ui, label))
    ui.advance(0.3)
    dialog = ui.find(ChoiceSheet)
    if dialog.searchable:
        ui.type(ui.find(SearchField, dialog), option)
        ui.advance(0.2)
    ui.tap(ui.find(OptionRow, dialog, title=option))
    settle(app, ui)


def kind(app, ui, word: str) -> None:
    ui.tap(ui.find(Segment, text=word))
    settle(app, ui)


def pick_day(app, ui, label: str, day: date) -> None:
    ui.tap(field(ui, label))
    dialog = ui.find(DateSheet)
    dialog.year, dialog.month = day.year, day.month
    ui.advance(0.1)
    ui.tap(ui.find(MonthDay, dialog, day=day))
    press(app, ui, dialog.foot)


def pick_time(app, ui, label: str, hour: int, minute: int) -> None:
    ui.tap(field(ui, label))
    ui.advance(0.3)
    for number in (hour, minute // 5 * 5):
        cells = [cell for cell in ui.find_all(TimeCell) if cell.text == f"{number:02d}"]
        ui.tap(cells[0 if number == hour else -1])
    settle(app, ui)
    ui.advance(FOOT_RESTS)


def save_button(ui) -> CommandButton:
    return ui.find(CommandButton, ui.find(FormSheet), text="Save")


def save(app, ui) -> None:
    sheet = ui.find(FormSheet)
    assert not save_button(ui).disabled, sheet.view.why
    ui.wait(lambda: Clock.get_time() >= sheet._rests_until)  # its foot was pressed before
    ui.tap(save_button(ui))
    settle(app, ui)


def schedules(container) -> list[Schedule]:
    return container.repositories.schedules.all(container.db.read())


def named(container, mission: str, robot: str) -> Schedule:
    return next(schedule for schedule in schedules(container) if schedule.name == f"{mission} on {robot}")


def row(ui, schedule: Schedule) -> ScheduleRow:
    return ui.find(ScheduleRow, key=schedule.id)


def menu(app, ui, schedule: Schedule, word: str) -> None:
    """In the list of schedules."""
    if app.plan.tab != "schedules":
        tab(app, ui, "schedules")
    ui.advance(1)  # rows that a press has moved take no tap for a moment
    ui.tap(ui.find(IconButton, row(ui, schedule), icon="dots-vertical"))
    ui.advance(0.3)
    ui.tap(ui.find(root=ui.find(Menu), text=word))
    settle(app, ui)


def tap_bar(ui, key) -> None:
    timeline = ui.find(Lanes)
    x, y, right, top, _key = next(hit for hit in timeline.boxes() if hit[4][: len(key)] == key)
    ui.tap_at(*timeline.to_window((x + right) / 2, (y + top) / 2))


def reveal(ui, widget) -> None:
    """Scroll the form's fields until it can be seen."""
    ui.advance(0.2)
    ui.find(FormSheet).ids.page.scroll_to(widget, animate=False)
    ui.advance(0.2)


def card_of(ui) -> Menu:
    ui.wait(lambda: ui.find_all(Menu))
    ui.advance(0.3)
    return ui.find(Menu)


def take(app, ui, word: str) -> None:
    """A command of an open card."""
    ui.tap(ui.find(MenuRow, text=word))
    settle(app, ui)


# ---------------------------------------------------------------------- drafts of the form
def said(app) -> list[str]:
    return app.shell.snackbars.texts


def stock(container) -> Schedule:
    return named(container, "Night stock count", "Aino")


def stored(container, schedule: Schedule) -> Schedule:
    return container.repositories.schedules.get(container.db.read(), schedule.id)


def other(app, container, ui) -> None:
    """Open a schedule to look at it."""
    app.plan.edit(named(container, KITS, "Aino").id)
    settle(app, ui)


def leave_entries(app, container, ui, **values) -> None:
    """Entries for the stock count, which another schedule takes the place of."""
    app.plan.edit(stock(container).id)
    app.plan.form.set(**(values or {"priority": 2}))
    other(app, container, ui)


def bring_back(app, ui) -> None:
    """The message about them offers it; a later one is on top of it."""
    for _message in range(2):
        bar = ui.find(Snackbar)
        if "not saved" not in bar.text and len(said(app)) > 1:
            ui.advance(SECONDS + 0.6)
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(app, ui)


@contextmanager
def larger_controls(app, container, ui) -> Iterator[None]:
    """Build the screen again."""

    def switch(on: bool) -> None:
        old = app.shell.navigator.screen("scheduler")
        container.catalogue.change_settings(gloves=on)
        ui.wait(lambda: app.shell.navigator.screen("scheduler") is not old)

    switch(True)
    try:
        yield
    finally:
        switch(False)
