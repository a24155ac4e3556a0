"""Settings alone in the window, without the rest of the app: upright, and where the window can put a backup in place
and continue."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.screens.common.shell import Shell, pick
from app.screens.common.threads import forward
from app.screens.common.view_model import Background, Dialogs, Navigator, Snackbars, UiBus
from app.screens.settings.files import FileSheet
from app.screens.settings.screen import SettingsScreen, SettingsViewModel
from app.widgets.fields import Field
from app.widgets.sheet import AskSheet
from tests.ui.integrator import file_sheet, forget_all, press, row_of, says, section_row, section_rows

pytestmark = pytest.mark.long

PLACES = ["This tablet", "Another place"]


@pytest.fixture
def site(shared_site, ui):
    forget_all(shared_site, ui)
    return shared_site


@pytest.fixture
def asked() -> list[Path]:
    """What the window was asked to restore."""
    return []


@pytest.fixture
def screen(site, ui, asked):
    bus = UiBus()
    shell = Shell(Navigator(None, {}), Dialogs(), Snackbars(), bus, Background(bus), asked.append)
    unsubscribe = forward(site.container.changes, bus)
    screen = SettingsScreen(SettingsViewModel(pick(SettingsScreen.Services, site.container), shell))
    yield screen
    screen.hidden()
    unsubscribe()
    shell.dialogs.close_all()
    shell.snackbars.clear()
    shell.background.close()


@pytest.fixture
def restored(screen, ui, asked):
    """In Settings, Data."""
    ui.show(screen)
    screen.shown(section="data")
    ui.wait(lambda: row_of(ui, "Backups"))
    return asked


@pytest.mark.parametrize("size", [(752, 790), (552, 360)])  # portrait, and where the words of the list would be broken
def test_where_it_is_narrow_list_and_section_take_turns(screen, ui, size):
    ui.show(screen, size=size)
    screen.shown()
    ui.wait(lambda: section_rows(ui))
    assert not [field for field in ui.find_all(Field) if field.kind == "step"]
    ui.tap(section_row(ui, "constraints"))
    ui.wait(lambda: [field for field in ui.find_all(Field) if field.kind == "step"])
    assert not section_rows(ui)
    assert screen.can_go_back
    screen.go_back()
    ui.advance(0.1)
    assert section_rows(ui)
    assert not [row for row in section_rows(ui) if row.item.look == "chosen"]


def test_a_backup_is_restored_only_after_a_question(site, ui, restored):
    press(ui, "Back up", file_sheet(ui, "Backups", "Back up"))
    ui.wait(lambda: says(ui, "Backup made"))
    sheet = file_sheet(ui, "Backups", "Restore")
    press(ui, "Restore", sheet)
    press(ui, "Keep", ui.find(AskSheet))
    assert restored == []
    ui.advance(1)
    press(ui, "Restore", sheet)
    press(ui, "Restore", ui.find(AskSheet))
    ui.wait(lambda: restored)
    assert restored[0].parent == site.container.db.path.parent / "backups"


def test_a_backup_that_is_damaged_stops_nothing(site, ui, restored):
    backups = site.container.db.path.parent / "backups"
    backups.mkdir(exist_ok=True)
    (backups / "daily-2026-01-01.db").write_bytes(b"no database")
    sheet = file_sheet(ui, "Backups", "Restore")
    press(ui, "Restore", sheet)
    press(ui, "Restore", ui.find(AskSheet))
    ui.wait(lambda: "can't be restored" in sheet.problem)
    assert restored == []


def test_restore_of_a_first_start_leads_to_the_backups(screen, ui, restored):
    screen.shown(section="data", restore=True)
    ui.wait(lambda: ui.find_all(FileSheet) and [item.title for item in ui.find(FileSheet).items] == PLACES)
