"""Settings, Data: every file says where it is, and no bad file changes anything."""
from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from app.domain.models import Execution, State, Trigger
from app.screens.common.shell import Shell, pick
from app.screens.common.threads import forward
from app.screens.common.view_model import Background, Dialogs, Navigator, Snackbars, UiBus
from app.screens.settings.page import FileRow
from app.screens.settings.screen import SettingsScreen
from app.widgets.buttons import CommandButton
from app.widgets.dialogs import ConfirmDialog
from app.widgets.fields import FormField
from app.widgets.rows import OptionRow
from tests.ui.integrator import enter, go, missions, page, press, says, settings
from tests.ui.whole_app import GUIDS


@pytest.fixture
def first_screen() -> str:
    return "settings"


def file_row(ui, label: str, number: int = 0) -> FileRow:
    return ui.find_all(FileRow, label=label)[number]


def outcome(app, name: str):
    return getattr(page(app).vm, f"{name}_outcome")


def test_the_configuration_goes_out_without_secrets_and_says_where(site, app, ui):
    site.add_robots()
    go(ui, "data")
    row = file_row(ui, "Export to")
    ui.wait(lambda: row.model.path.startswith(str(site.documents)))
    press(ui, "Export", row)
    ui.wait(lambda: outcome(app, "configuration").text == "Configuration written, without passwords")
    written = json.loads(Path(outcome(app, "configuration").note).read_text(encoding="utf-8"))
    assert [robot["name"] for robot in written["robots"]] == ["Aino", "Veikko"]
    assert "password" not in written["robots"][0]
    first = outcome(app, "configuration").note
    ui.wait(lambda: row.model.path != first)                  # the next suggestion is free again
    enter(ui, ui.find(FormField, root=row), first)
    press(ui, "Export", row)
    ui.wait(lambda: row.model.problem.endswith("exists already; choose another name"))


def test_a_configuration_comes_in_with_a_list_of_what_changed(site, app, ui):
    file = site.documents / "plant.json"
    file.write_text(json.dumps({"format": "amr-scheduler/1", "settings": {"retry_limit": 3},
                                "missions": [{"name": "Deliver", "guid": GUIDS["Deliver"]}]}), encoding="utf-8")
    go(ui, "data")
    row = file_row(ui, "Import from")
    ui.wait(lambda: row.model.path == str(file))              # the newest configuration there is suggested
    press(ui, "Import", row)
    ui.wait(lambda: outcome(app, "configuration").text == "2 changes imported")
    assert settings(site).retry_limit == 3
    assert [mission.name for mission in missions(site)] == ["Deliver"]
    press(ui, "Import", row)
    ui.wait(lambda: outcome(app, "configuration").text == "The file contains nothing new")


def test_a_configuration_that_deletes_runs_asks_first(site, app, ui):
    now, repository = site.container.clock.now(), site.container.repositories.executions
    rows = [Execution(trigger=Trigger.MANUAL, robot_id=1, robot="R1", mission="Deliver", mission_guid="guid", timezone="UTC", token=str(n),
                      planned_at=now, closes_at=now, created_at=now, state=State.COMPLETED, ended_at=now) for n in range(3)]
    site.container.db.write(lambda c: repository.add_many(c, rows))
    file = site.documents / "plant.json"
    file.write_text('{"format": "amr-scheduler/1", "settings": {"history_limit": 1}}', encoding="utf-8")
    go(ui, "data")
    row = file_row(ui, "Import from")
    ui.wait(lambda: row.model.path == str(file))
    press(ui, "Import", row)
    ui.wait(lambda: says(ui, "Delete 2 runs of the history?"))
    press(ui, "Cancel", ui.find(ConfirmDialog))
    assert settings(site).history_limit == 100_000
    press(ui, "Import", row)
    ui.wait(lambda: says(ui, "Delete 2 runs of the history?"))
    press(ui, "Import and delete", ui.find(ConfirmDialog))
    ui.wait(lambda: outcome(app, "configuration").text == "1 change imported")
    assert settings(site).history_limit == 1


@pytest.mark.parametrize("content", [
    "{", "[]", '{"format": "amr-scheduler/2"}', '{"format": "amr-scheduler/1", "robotz": []}',
    '{"format": "amr-scheduler/1", "settings": {"retry_limit": 99}}'])
def test_an_unusable_configuration_is_one_sentence_and_changes_nothing(site, app, ui, content):
    file = site.documents / "broken.json"
    file.write_text(content, encoding="utf-8")
    before = settings(site)
    go(ui, "data")
    row = file_row(ui, "Import from")
    ui.wait(lambda: row.model.path == str(file))
    press(ui, "Import", row)
    ui.wait(lambda: row.model.problem)
    assert settings(site) == before
    assert "Traceback" not in row.model.problem
    assert outcome(app, "configuration").text == ""


def test_a_file_that_is_not_there(site, app, ui):
    go(ui, "data")
    row = file_row(ui, "Import from")
    enter(ui, ui.find(FormField, root=row), "/nowhere/plant.json")
    press(ui, "Import", row)
    ui.wait(lambda: row.model.problem == "There is no file /nowhere/plant.json")
    enter(ui, ui.find(FormField, root=file_row(ui, "Export to")), "/nowhere/plant.json")
    press(ui, "Export", file_row(ui, "Export to"))
    ui.wait(lambda: file_row(ui, "Export to").model.problem == "There is no directory /nowhere")


def test_log_and_backup_say_where_they_are(site, app, ui):
    go(ui, "data")
    row = file_row(ui, "Export to", 1)
    ui.wait(lambda: row.model.path)
    press(ui, "Export", row)
    ui.wait(lambda: outcome(app, "log").text == "Log written")
    assert Path(outcome(app, "log").note).read_text(encoding="utf-8").startswith("id,trigger,schedule")
    page(app).back_up()
    ui.wait(lambda: outcome(app, "backup").text == "Backup made")
    assert outcome(app, "backup").note.startswith(str(site.container.db.path.parent))
    ui.wait(lambda: page(app).vm.backups.startswith("1 backup"))


@dataclass(frozen=True)
class ShellThatRestores(Shell):
    """A window that can put a backup in place and go on."""
    restore: Callable[[Path], object] = print


@pytest.fixture
def restored(site, ui):
    """Settings, Data, in such a window; what it was asked to restore."""
    asked: list[Path] = []
    bus = UiBus()
    shell = ShellThatRestores(Navigator(None, {}), Dialogs(animate=False), Snackbars(), bus, Background(bus), asked.append)
    unsubscribe = forward(site.container.changes, bus)
    screen = SettingsScreen(pick(SettingsScreen.Services, site.container), shell)
    ui.show(screen)
    screen.shown(section="data")
    ui.wait(lambda: ui.find_all(FileRow))
    yield asked
    screen.hidden()
    unsubscribe()
    shell.background.close()


def test_a_backup_is_restored_only_after_a_question(site, ui, restored):
    assert ui.find(CommandButton, text="Restore …").disabled          # there is none yet
    press(ui, "Back up now")
    ui.wait(lambda: not ui.find(CommandButton, text="Restore …").disabled)
    press(ui, "Restore …")
    ui.tap(ui.find(OptionRow))
    press(ui, "Cancel", ui.find(ConfirmDialog))
    assert restored == []
    press(ui, "Restore …")
    ui.tap(ui.find(OptionRow))
    press(ui, "Restore", ui.find(ConfirmDialog))
    ui.wait(lambda: restored)
    assert restored[0].parent == site.container.db.path.parent / "backups"


def test_a_backup_that_is_damaged_stops_nothing(site, ui, restored):
    backups = site.container.db.path.parent / "backups"
    backups.mkdir(exist_ok=True)
    (backups / "daily-2026-01-01.db").write_bytes(b"no database")
    site.container.catalogue.change_settings(retry_limit=4)            # anything: Settings reads again
    ui.wait(lambda: not ui.find(CommandButton, text="Restore …").disabled)
    press(ui, "Restore …")
    ui.tap(ui.find(OptionRow))
    press(ui, "Restore", ui.find(ConfirmDialog))
    ui.wait(lambda: says(ui, "can't be restored"))
    assert restored == []
