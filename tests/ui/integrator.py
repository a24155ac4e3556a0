"""What the tests of Settings share: a tablet with two robots and a home directory, and an integrator's hands."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from kivy.clock import Clock
from kivy.core.window import Window

from app.database.backups import BACKUPS
from app.database.execution_history import ExecutionHistory
from app.domain.models import Mission, Robot, Schedule, Settings
from app.i18n import SOURCE_LANGUAGE, translator
from app.screens.settings.connection_sheet import ConnectionSheet
from app.screens.settings.files import FileSheet
from app.screens.settings.page import SettingsPage
from app.services.files import places
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.fields import Field
from app.widgets.frame import Banner, NavItem
from app.widgets.items import Item
from app.widgets.keyboard import BoardKey, DockedKeyboard
from app.widgets.list_row import ListRow
from app.widgets.menu import Menu, MenuRow
from app.widgets.scrolling import ScrollPage
from app.widgets.sheet import Sheet
from app.widgets.snackbar import Snackbar
from app.widgets.tokens import tk
from app.window.application import SchedulerApp
from tests.ui.driver import Driver
from tests.ui.whole_app import Plant, plant


@contextmanager
def tablet(directory: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Plant]:
    """Two robots that answer and services that run; ``documents`` is where people keep their files."""
    documents = directory / "Documents"
    documents.mkdir()
    monkeypatch.setattr("platformdirs.user_documents_path", lambda: documents)
    monkeypatch.setattr(places, "MOUNTS", directory / "mounts")  # no stick and no share
    with plant(directory / "data", robots=2) as site:
        site.documents = documents
        yield site


def restart(site: Plant, app: SchedulerApp, ui: Driver, screen: str) -> None:
    """Show ``screen`` as at a first start, without the entries, changes and dialogs of the previous test."""
    app.shell.dialogs.close_all()
    app.shell.sheets.give_up()
    app.shell.snackbars.clear()
    app.shell.navigator.close()
    app.models = {"alarms": app.models["alarms"]}  # the others are made again: nothing that was typed or chosen is left
    Window.release_all_keyboards()
    ui.advance()
    ui.wait(lambda: app.shell.background.idle)
    forget_all(site, ui)
    app.shell.go(screen)
    ui.wait(lambda: app.shell.background.idle)
    ui.wait(lambda: not [widget for kind in (Menu, Snackbar, Banner, DockedKeyboard) for widget in ui.find_all(kind)])
    assert (tk.theme, tk.gloves, translator.language) == (site.first_settings.theme, False, SOURCE_LANGUAGE)


def forget_all(site: Plant, ui: Driver) -> None:
    """Remove everything that was saved, except acknowledged alarms, which stay."""
    for robot in site.fleet.robots:
        robot.control({"fault": None})
    for file in (*site.documents.iterdir(), *(site.container.db.path.parent / BACKUPS).glob("*")):
        file.unlink()
    site.container.access.remove()
    site.container.holds.release()
    _forget_catalogue(site)
    history = ExecutionHistory()
    site.container.db.write(lambda c: history.drop_oldest(c, history.surplus(c, 0)))
    assert (robots(site), missions(site), schedules(site), settings(site)) == ([], [], [], site.first_settings)
    ui.wait(lambda: _is_calm(site))  # a worker may just have noted something about a deleted robot


def _forget_catalogue(site: Plant) -> None:
    catalogue, first, now = site.container.catalogue, site.first_settings, settings(site)
    for schedule in schedules(site):
        catalogue.remove_schedule(schedule.id)
    for group in catalogue.groups():
        catalogue.remove_group(group.id)
    for place in catalogue.places():
        catalogue.remove_place(place.id)
    for fleet in catalogue.fleets():
        catalogue.remove_fleet(fleet.id)
    for robot in robots(site):
        catalogue.remove_robot(robot.id)
    for mission in missions(site):
        catalogue.remove_mission(mission.id)
    if days := catalogue.day_exceptions():
        catalogue.remove_days(*(entry.id for entry in days))
    if now != first:
        catalogue.change_settings(**{name: value for name, value in vars(first).items() if value != getattr(now, name)})


def _is_calm(site: Plant) -> bool:
    """Nothing is wrong and nothing is held; alarms are acknowledged, as an operator would."""
    alarms = site.container.alarms
    for alarm in alarms.open():
        alarms.clear(alarm.code, alarm.key)
        alarms.acknowledge(alarm.id)
    return not alarms.open() and site.container.holds.active() is None


def go(ui: Driver, section: str) -> None:
    ui.tap(ui.find(NavItem, name="settings"))
    ui.wait(lambda: section_row(ui, section))
    ui.tap(section_row(ui, section))


def section_row(ui: Driver, section: str) -> ListRow | None:
    """The row of a section in the list at the left."""
    return next((row for row in section_rows(ui) if row.key == section), None)


def section_rows(ui: Driver) -> list[ListRow]:
    return [row for row in ui.find_all(ListRow) if type(row).__name__ == "SectionRow"]


def row_of(ui: Driver, title: str) -> ListRow | None:
    """The row with that title."""
    return next((row for row in ui.find_all(ListRow) if row.item.title == title), None)


def item_of(ui: Driver, title: str) -> Item | None:
    """What the row with that title shows."""
    return next((row.item for row in ui.find_all(ListRow) if row.item.title == title), None)


def titles(ui: Driver) -> list[str]:
    """Of the rows of robots or groups that are listed."""
    return [row.item.title for row in ui.find_all(ListRow) if isinstance(row.key, int) and row.item.ticked is None]


def open_row(ui: Driver, title: str) -> Sheet:
    """Tap the row with that title; returns its sheet."""
    ui.wait(lambda: item_of(ui, title))
    ui.tap(next(row for row in ui.find_all(ListRow) if row.item.title == title))
    ui.wait(lambda: ui.find_all(Sheet))
    return ui.find(Sheet)


def choose(ui: Driver, word: str, sheet: Sheet) -> None:
    """In the menu of a sheet."""
    ui.tap(ui.find(IconButton, sheet, icon="dots-vertical"))
    ui.wait(lambda: ui.find_all(MenuRow, text=word))
    ui.tap(ui.find(MenuRow, text=word))


def page(app: SchedulerApp) -> SettingsPage:
    """The section that is open."""
    return app.shell.navigator.screen("settings").page


def press(ui: Driver, word: str, root=None) -> None:
    """A button; that of a sheet once it takes another press."""
    ui.wait(lambda: all(Clock.get_time() >= sheet._rests_until for sheet in ui.find_all(Sheet)))
    ui.tap(ui.find(CommandButton, root=root, text=word))


def add(ui: Driver, word: str) -> None:
    """With the menu of the page of the robots."""
    press(ui, "Add")
    ui.wait(lambda: ui.find_all(MenuRow, text=word))
    ui.tap(ui.find(MenuRow, text=word))


def enter(ui: Driver, field, text: str) -> None:
    """Type ``text`` in place of what is in the field."""
    field.text = ""
    ui.type(field, text)


def reveal(ui: Driver, widget) -> None:
    """Scroll the page until it can be seen."""
    scroll = next(parent for parent in widget.walk_reverse() if isinstance(parent, ScrollPage))
    scroll.scroll_to(widget, animate=False)
    ui.advance(0.3)


def file_sheet(ui: Driver, title: str, action: str) -> FileSheet:
    """Press a button in the row with that title, and wait for the places of its files."""
    ui.wait(lambda: row_of(ui, title))
    press(ui, action, row_of(ui, title))
    ui.wait(lambda: ui.find_all(FileSheet) and ui.find(FileSheet).items)
    ui.advance(0.5)  # until it takes touches
    return ui.find(FileSheet)


def choose_row(ui: Driver, sheet: Sheet, title: str) -> None:
    ui.wait(lambda: [row for row in ui.find_all(ListRow, sheet) if row.item.title == title])
    ui.advance(1.1)  # a row that has just slid takes no touch
    ui.tap(next(row for row in ui.find_all(ListRow, sheet) if row.item.title == title))
    ui.advance(0.2)


def enter_path(ui: Driver, sheet: FileSheet, path: str) -> None:
    """Type a path where places are offered."""
    if not sheet.typed:
        choose_row(ui, sheet, "Another place")
    enter(ui, ui.find(Field, root=sheet), path)


def fill_in(ui: Driver, **values: str) -> ConnectionSheet:
    """Type into the sheet of a robot or fleet that is open, field by field."""
    dialog = ui.find(ConnectionSheet)
    for name, text in values.items():
        enter(ui, entry(dialog, name), text)
    return dialog


def entry(sheet: ConnectionSheet, name: str) -> Field:
    """A field of the sheet of a robot or fleet."""
    ids = sheet.ids if name == "name" else sheet.ids.connection.children[0].ids
    return ids[f"{name}_field"]


def keyboard(ui) -> DockedKeyboard:
    ui.wait(lambda: ui.find_all(DockedKeyboard))
    ui.advance(0.1)
    return ui.find(DockedKeyboard)


def key(ui, name: str) -> BoardKey:
    return ui.find(BoardKey, keyboard(ui), key=name)


def tap_keys(ui, *names: str) -> None:
    for name in names:
        ui.tap(key(ui, name))


def says(ui: Driver, text: str) -> bool:
    return any(text in found for found in ui.texts())


def undo(ui: Driver) -> None:
    ui.wait(lambda: ui.find_all(Snackbar))
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))


# ---------------------------------------------------------------------- what is saved
def robots(site: Plant) -> list[Robot]:
    return site.container.catalogue.robots()


def missions(site: Plant) -> list[Mission]:
    return site.container.catalogue.missions()


def schedules(site: Plant) -> list[Schedule]:
    return site.container.catalogue.schedules()


def settings(site: Plant) -> Settings:
    return site.container.settings()


def is_saved(site: Plant, app: SchedulerApp) -> bool:
    """Settings has read what is saved."""
    return page(app).context.facts.settings == settings(site)
