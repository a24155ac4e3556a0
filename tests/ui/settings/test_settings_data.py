"""Settings, Data: every file says where it is, and no bad file changes anything."""

from __future__ import annotations

import codecs
import json
import os
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.screens.settings import files
from app.screens.settings.data import ImportSheet
from app.services.files import exports, file_access, places
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.fields import Field
from app.widgets.list_row import ListRow
from tests.ui.integrator import (
    choose_row,
    enter,
    enter_path,
    file_sheet,
    go,
    missions,
    page,
    press,
    row_of,
    settings,
)
from tests.ui.whole_app import GUIDS


def what_changes(ui, sheet) -> ImportSheet:
    press(ui, "Show changes", sheet)
    ui.wait(lambda: ui.find_all(ImportSheet))
    return ui.find(ImportSheet)


def outcome(app):
    return page(app).vm.outcome


def has_written(site, app, ui) -> Path:
    """The file that the page says was written."""
    ui.wait(lambda: outcome(app).text and app.shell.background.idle)
    return Path(outcome(app).note)


def test_the_configuration_goes_out_without_secrets_and_says_where(site, app, ui):
    site.add_robots()
    go(ui, "data")
    press(ui, "Export", file_sheet(ui, "Configuration", "Export"))
    file = has_written(site, app, ui)
    assert (outcome(app).text, file.parent) == ("Configuration written, without passwords", site.documents)
    written = json.loads(file.read_text(encoding="utf-8"))
    assert [robot["name"] for robot in written["robots"]] == ["Aino", "Veikko"]
    assert "password" not in written["robots"][0]
    sheet = file_sheet(ui, "Configuration", "Export")
    assert sheet.file not in ("", file.name)  # the next suggestion is free again
    enter(ui, ui.find(Field, root=sheet), file.name)
    press(ui, "Export", sheet)
    ui.wait(lambda: sheet.problem.endswith("exists already: choose another name"))


@pytest.mark.parametrize(
    ("action", "begins"), [("For Excel", codecs.BOM_UTF8 + b"id;trigger;"), ("With commas", b"id,trigger,schedule")]
)
def test_the_log_goes_out_in_the_form_that_is_chosen(site, app, ui, action, begins):
    go(ui, "data")
    press(ui, "Export", file_sheet(ui, "Runs", action))
    assert has_written(site, app, ui).read_bytes().startswith(begins)


def test_the_second_tap_on_export_is_the_same_press(site, app, ui):
    go(ui, "data")
    button = ui.find(CommandButton, file_sheet(ui, "Configuration", "Export"), text="Export")
    ui.tap(button)
    ui.tap(button)
    written = has_written(site, app, ui)
    assert [*site.documents.iterdir()] == [written]


def test_a_configuration_comes_in_with_a_list_of_what_changed(site, app, ui):
    file = site.documents / "plant.json"
    file.write_text(
        json.dumps(
            {
                "format": "amr-scheduler/1",
                "settings": {"retry_limit": 3},
                "missions": [{"name": "Deliver", "guid": GUIDS["Deliver"]}],
            }
        ),
        encoding="utf-8",
    )
    go(ui, "data")
    sheet = file_sheet(ui, "Configuration", "Import")
    assert sheet.path == str(file)  # the newest configuration there is suggested
    before, changes = settings(site), what_changes(ui, sheet)
    assert changes.title == "2 changes"
    assert [row.item.title for row in ui.find_all(ListRow, changes)][1] == "Mission Deliver added"
    assert (settings(site), missions(site)) == (before, [])
    press(ui, "Import", changes)
    ui.wait(lambda: outcome(app).text == "2 changes imported")
    assert settings(site).retry_limit == 3
    assert [mission.name for mission in missions(site)] == ["Deliver"]
    (backup,) = site.container.files.backups()
    assert outcome(app).note == f"Backup from before it: {backup.path.name}"
    press(ui, "Show changes", file_sheet(ui, "Configuration", "Import"))
    ui.wait(lambda: outcome(app).text == "The file contains nothing new")


def test_an_unusable_configuration_is_one_sentence_and_changes_nothing(site, app, ui):
    file = site.documents / "broken.json"
    file.touch()
    before = settings(site)
    go(ui, "data")
    sheet = file_sheet(ui, "Configuration", "Import")
    problems = set()
    for content in (
        "{",
        "[]",
        '{"format": "amr-scheduler/2"}',
        '{"format": "amr-scheduler/1", "robotz": []}',
        '{"format": "amr-scheduler/1", "settings": {"retry_limit": 99}}',
    ):
        file.write_text(content, encoding="utf-8")
        ui.advance(1)
        press(ui, "Show changes", sheet)
        ui.wait(lambda: sheet.problem and sheet.problem not in problems and app.shell.background.idle)
        problems.add(sheet.problem)
        assert settings(site) == before
        assert "Traceback" not in sheet.problem
        assert outcome(app).text == ""


def test_a_file_that_is_not_there(site, app, ui):
    go(ui, "data")
    sheet = file_sheet(ui, "Configuration", "Import")
    assert sheet.foot_off == "No file .json there"
    enter_path(ui, sheet, "/nowhere/plant.json")
    press(ui, "Show changes", sheet)
    ui.wait(lambda: sheet.problem == "There is no file /nowhere/plant.json")
    ui.tap(ui.find(IconButton, sheet, icon="close"))
    sheet = file_sheet(ui, "Configuration", "Export")
    enter_path(ui, sheet, "/nowhere/plant.json")
    press(ui, "Export", sheet)
    ui.wait(lambda: sheet.problem == "There is no directory /nowhere")


def test_a_backup_says_where_it_is(site, app, ui):
    go(ui, "data")
    ui.wait(lambda: row_of(ui, "Backups"))
    button = ui.find(CommandButton, file_sheet(ui, "Backups", "Back up"), text="Back up")
    for _tap in range(2):  # one press
        ui.tap(button)
    ui.wait(lambda: outcome(app).text == "Backup made")
    (backup,) = site.container.files.backups()
    assert outcome(app).note.startswith(str(backup.path))
    ui.wait(lambda: row_of(ui, "Backups").item.support.startswith("last backup "))


# ---------------------------------------------------------------------- a stick
@pytest.fixture
def stick(app, tmp_path, monkeypatch) -> Path:
    """A USB stick with two configurations."""
    stick = tmp_path / "media" / "KINGSTON"
    stick.mkdir(parents=True)
    for name, at, retries in (("spring.json", 1_700_000_000, 3), ("autumn.json", 1_750_000_000, 4)):
        (stick / name).write_text(
            json.dumps({"format": "amr-scheduler/1", "settings": {"retry_limit": retries}}), encoding="utf-8"
        )
        os.utime(stick / name, (at, at))
    monkeypatch.setattr(places, "MEDIA", (tmp_path / "media",))
    table = tmp_path / "mounts"
    table.write_text(f"/dev/sdb1 {stick} vfat rw 0 0\n", encoding="utf-8")
    monkeypatch.setattr(places, "MOUNTS", table)
    return stick


def test_a_file_on_a_stick_is_chosen_from_a_list_and_imported(site, stick, ui):
    go(ui, "data")
    sheet = file_sheet(ui, "Configuration", "Import")
    assert sheet.foot_off == "No file .json there"  # in Documents
    choose_row(ui, sheet, "USB: KINGSTON")
    ui.wait(lambda: len(sheet.items) == 5)
    assert [(item.title, item.support) for item in sheet.items[3:]] == [
        ("autumn.json", "Sun 15 Jun 2025 15:06 · 1 kB"),  # newest first, with day and size
        ("spring.json", "Tue 14 Nov 2023 22:13 · 1 kB"),
    ]
    choose_row(ui, sheet, "spring.json")
    press(ui, "Import", what_changes(ui, sheet))
    ui.wait(lambda: settings(site).retry_limit == 3)


def test_an_export_goes_to_the_stick_that_was_tapped(site, app, stick, ui):
    go(ui, "data")
    sheet = file_sheet(ui, "Configuration", "Export")
    choose_row(ui, sheet, "USB: KINGSTON")
    ui.wait(lambda: sheet.file)
    press(ui, "Export", sheet)
    assert has_written(site, app, ui).parent == stick


def test_a_backup_goes_to_the_stick_that_was_tapped(site, app, stick, ui):
    go(ui, "data")
    sheet = file_sheet(ui, "Backups", "Back up")
    choose_row(ui, sheet, "USB: KINGSTON")
    ui.wait(lambda: sheet.file)
    press(ui, "Back up", sheet)
    ui.wait(lambda: outcome(app).text == "Backup made")
    (backup,) = stick.glob("*.db")
    site.container.files.check_backup(backup)


@pytest.fixture
def dead_share(stick, tmp_path, monkeypatch) -> Iterator[Path]:
    """A share whose server is offline, and a stick: reading the files of the share waits."""
    share, back = tmp_path / "plans", threading.Event()
    share.mkdir()
    with open(places.MOUNTS, "a", encoding="utf-8") as table:
        table.write(f"//plant/plans {share} cifs rw 0 0\n")

    def listed(directory: Path, suffix: str):
        if directory == share:
            back.wait(300)
        return places.found_in(directory, suffix)

    def read(path: Path):
        if share in path.parents:
            back.wait(300)
        return file_access.read_file(path)

    monkeypatch.setattr(files, "found_in", listed)
    monkeypatch.setattr(exports, "read_file", read)
    yield share
    back.set()


def test_a_share_that_hangs_delays_no_other_folder(site, app, dead_share, ui):
    go(ui, "data")
    sheet = file_sheet(ui, "Configuration", "Import")
    for _tap in range(4):
        choose_row(ui, sheet, "Share: plans")
    assert sheet.foot_off == "Looking for files"
    choose_row(ui, sheet, "USB: KINGSTON")
    choose_row(ui, sheet, "spring.json")
    press(ui, "Import", what_changes(ui, sheet))
    ui.wait(lambda: settings(site).retry_limit == 3)


def test_an_import_from_a_share_that_hangs_delays_nothing_else(site, app, dead_share, ui):
    go(ui, "data")
    sheet = file_sheet(ui, "Configuration", "Import")
    enter_path(ui, sheet, str(dead_share / "plant.json"))
    press(ui, "Show changes", sheet)
    assert sheet.running
    done, all_there = [], threading.Barrier(4)  # as many as there are threads for what is pressed
    for _n in range(4):
        app.shell.background.run(lambda: all_there.wait(30), done.append)
    ui.wait(lambda: len(done) == 4)
    assert sheet.running


def test_enter_writes_over_no_file_that_is_there(site, app, ui):
    there = site.documents / "PLANT.json"
    there.write_text("mine", encoding="utf-8")
    go(ui, "data")
    sheet = file_sheet(ui, "Configuration", "Export")
    for typed in (str(there), str(there.with_suffix("")), "PLANT"):
        enter_path(ui, sheet, typed)
        ui.find(Field, root=sheet).dispatch("on_enter")
        ui.wait(lambda: sheet.problem.endswith("PLANT.json exists already: choose another name"))
        assert there.read_text(encoding="utf-8") == "mine"
