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
from app.screens.settings.files import FileRow
from app.services.files import exports, file_access, places
from app.widgets.buttons import ChoiceChip, CommandButton, Segment
from app.widgets.dialogs import ChoiceDialog
from app.widgets.fields import Field
from app.widgets.rows import OptionRow
from tests.ui.integrator import enter_path, go, missions, page, press, reveal, section_row, settings
from tests.ui.whole_app import GUIDS


def file_row(ui, label: str, number: int = 0) -> FileRow:
    ui.wait(lambda: ui.find_all(FileRow, label=label) and ui.find_all(FileRow, label=label)[number].model.places)
    row = ui.find_all(FileRow, label=label)[number]
    reveal(ui, row)
    return row


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
    ui.wait(lambda: row.model.path != first)  # the next suggestion is free again
    ui.advance(1)
    enter_path(ui, row, first)
    press(ui, "Export", row)
    ui.wait(lambda: row.model.problem.endswith("exists already; choose another name"))


def test_the_log_goes_out_for_excel_where_that_is_chosen(site, app, ui):
    go(ui, "data")
    row = file_row(ui, "Export to", 1)
    ui.wait(lambda: row.model.path.startswith(str(site.documents)))
    excel = ui.find(Segment, text="For Excel")
    reveal(ui, excel)
    ui.tap(excel)
    press(ui, "Export", row)
    ui.wait(lambda: outcome(app, "log").text == "Log written")
    assert Path(outcome(app, "log").note).read_bytes().startswith(codecs.BOM_UTF8 + b"id;trigger;")


def test_a_file_that_came_while_none_was_there_is_found_by_a_tap_on_the_field(site, app, ui):
    go(ui, "data")
    row = file_row(ui, "Import from")
    ui.wait(lambda: row.model.places)
    assert row.model.name == "No file .json there"
    (site.documents / "late.json").write_text("{}", encoding="utf-8")
    ui.tap(ui.find(Field, root=row))
    ui.wait(lambda: ui.find_all(ChoiceDialog))
    assert [option.text for option in ui.find(ChoiceDialog).options] == ["late.json"]
    assert not ui.find(CommandButton, row, text="Import").disabled


def test_an_export_can_be_imported_at_once(site, app, ui):
    go(ui, "data")
    importing = file_row(ui, "Import from")
    assert importing.model.name == "No file .json there"
    row = file_row(ui, "Export to")
    ui.wait(lambda: row.model.path)
    press(ui, "Export", row)
    ui.wait(lambda: outcome(app, "configuration").text)
    ui.wait(lambda: importing.model.path == outcome(app, "configuration").note)


@pytest.mark.parametrize(("number", "name"), [(0, "configuration"), (1, "log")])
def test_the_second_tap_on_export_is_the_same_press(site, app, ui, number, name):
    go(ui, "data")
    row = file_row(ui, "Export to", number)
    ui.wait(lambda: row.model.path)
    press(ui, "Export", row)
    press(ui, "Export", row)
    ui.wait(lambda: outcome(app, name).text and app.shell.background.idle)
    written = outcome(app, name).note
    assert [str(file) for file in site.documents.iterdir()] == [written]
    assert outcome(app, name).note == written
    ui.advance(1)
    press(ui, "Export", row)
    ui.wait(lambda: len([*site.documents.iterdir()]) == 2)


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
    row = file_row(ui, "Import from")
    ui.wait(lambda: row.model.path == str(file))  # the newest configuration there is suggested
    press(ui, "Import", row)
    ui.wait(lambda: outcome(app, "configuration").text == "2 changes imported")
    assert settings(site).retry_limit == 3
    assert [mission.name for mission in missions(site)] == ["Deliver"]
    ui.advance(1)
    press(ui, "Import", row)
    ui.wait(lambda: outcome(app, "configuration").text == "The file contains nothing new")


def test_the_second_tap_on_import_leaves_the_list_of_what_the_first_has_changed(site, app, ui):
    robot = site.add_robots()[0]
    (site.documents / "plant.json").write_text(
        json.dumps(
            {
                "format": "amr-scheduler/1",
                "robots": [{"name": robot.name, "address": "http://192.0.2.7", "username": robot.username}],
            }
        ),
        encoding="utf-8",
    )
    go(ui, "data")
    row = file_row(ui, "Import from")
    ui.wait(lambda: row.model.path)
    press(ui, "Import", row)
    ui.wait(lambda: outcome(app, "configuration").text)
    changed = outcome(app, "configuration")
    assert changed.tone == "attention"  # the robot needs its password
    press(ui, "Import", row)
    ui.wait(lambda: app.shell.background.idle)
    assert outcome(app, "configuration") == changed


def test_an_unusable_configuration_is_one_sentence_and_changes_nothing(site, app, ui):
    file = site.documents / "broken.json"
    file.touch()
    before = settings(site)
    go(ui, "data")
    row = file_row(ui, "Import from")
    ui.wait(lambda: row.model.path == str(file))
    problems = set()
    for content in (
        "{",
        "[]",
        '{"format": "amr-scheduler/2"}',
        '{"format": "amr-scheduler/1", "robotz": []}',
        '{"format": "amr-scheduler/1", "settings": {"retry_limit": 99}}',
    ):
        file.write_text(content, encoding="utf-8")
        press(ui, "Import", row)
        ui.wait(lambda: row.model.problem and row.model.problem not in problems and app.shell.background.idle)
        problems.add(row.model.problem)
        assert settings(site) == before
        assert "Traceback" not in row.model.problem
        assert outcome(app, "configuration").text == ""


def test_a_result_does_not_stay_after_a_later_failure(site, app, ui):
    file = site.documents / "plant.json"
    file.write_text(json.dumps({"format": "amr-scheduler/1", "settings": {"retry_limit": 3}}), encoding="utf-8")
    go(ui, "data")
    row = file_row(ui, "Import from")
    ui.wait(lambda: row.model.path == str(file))
    press(ui, "Import", row)
    ui.wait(lambda: outcome(app, "configuration").text)
    file.write_text("{", encoding="utf-8")
    ui.advance(1)
    press(ui, "Import", row)
    ui.wait(lambda: row.model.problem)
    assert outcome(app, "configuration").text == ""


def test_a_file_that_is_not_there(site, app, ui):
    go(ui, "data")
    row = file_row(ui, "Import from")
    enter_path(ui, row, "/nowhere/plant.json")
    press(ui, "Import", row)
    ui.wait(lambda: row.model.problem == "There is no file /nowhere/plant.json")
    enter_path(ui, file_row(ui, "Export to"), "/nowhere/plant.json")
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


def test_a_backup_added_later_is_listed_when_the_section_is_opened(site, app, ui):
    go(ui, "data")
    page(app).back_up()
    ui.wait(lambda: page(app).vm.backups.startswith("1 backup"))
    ui.tap(section_row(ui, "about"))
    made = page(app).context.facts.backups[0].path
    made.with_name("manual-2026-01-05T100000Z.db").write_bytes(made.read_bytes())
    ui.tap(section_row(ui, "data"))
    ui.wait(lambda: page(app).vm.backups.startswith("2 backups"))


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
    row = file_row(ui, "Import from")
    ui.wait(lambda: row.model.places)
    assert row.model.name == "No file .json there"  # in Documents
    assert ui.find(CommandButton, row, text="Import").disabled
    ui.tap(ui.find(ChoiceChip, row, text="USB: KINGSTON"))
    ui.wait(lambda: ui.find_all(ChoiceDialog))
    ui.advance(0.3)
    dialog = ui.find(ChoiceDialog)
    assert [option.text for option in dialog.options] == [
        "autumn.json",
        "spring.json",
    ]  # newest first, with day and size
    assert dialog.options[0].note == "Sun 15 Jun 2025 15:06 · 1 kB"
    ui.tap(ui.find(OptionRow, dialog, text="spring.json"))
    ui.wait(lambda: row.model.path == str(stick / "spring.json"))
    assert ui.find(Field, root=row).value == "spring.json"
    press(ui, "Import", row)
    ui.wait(lambda: settings(site).retry_limit == 3)


def test_an_export_goes_to_the_stick_that_was_tapped(site, app, stick, ui):
    go(ui, "data")
    row = file_row(ui, "Export to")
    ui.wait(lambda: row.model.places)
    ui.tap(ui.find(ChoiceChip, row, text="USB: KINGSTON"))
    ui.wait(lambda: row.model.path.startswith(str(stick)))
    press(ui, "Export", row)
    ui.wait(lambda: outcome(app, "configuration").text)
    assert Path(outcome(app, "configuration").note).parent == stick
    ui.wait(lambda: row.model.path.startswith(str(stick)) and row.model.path != outcome(app, "configuration").note)


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
    row = file_row(ui, "Import from")
    for _tap in range(4):
        ui.tap(ui.find(ChoiceChip, row, text="Share: plans"))
        ui.advance(0.2)
    ui.tap(ui.find(ChoiceChip, row, text="USB: KINGSTON"))
    ui.wait(lambda: ui.find_all(ChoiceDialog))
    ui.advance(0.3)
    ui.tap(ui.find(OptionRow, ui.find(ChoiceDialog), text="spring.json"))
    press(ui, "Import", row)
    ui.wait(lambda: settings(site).retry_limit == 3)


def test_an_import_from_a_share_that_hangs_delays_nothing_else(site, app, dead_share, ui):
    go(ui, "data")
    row = file_row(ui, "Import from")
    enter_path(ui, row, str(dead_share / "plant.json"))
    press(ui, "Import", row)
    assert row.model.busy
    done, all_there = [], threading.Barrier(4)  # as many as there are threads for what is pressed
    for _n in range(4):
        app.shell.background.run(lambda: all_there.wait(10), done.append)
    ui.wait(lambda: len(done) == 4)
    assert row.model.busy


def test_enter_writes_over_no_file_that_is_there(site, app, ui):
    there = site.documents / "PLANT.json"
    there.write_text("mine", encoding="utf-8")
    go(ui, "data")
    row = file_row(ui, "Export to")
    for typed in (str(there), str(there.with_suffix("")), "PLANT"):
        enter_path(ui, row, typed)
        ui.find(Field, root=row).dispatch("on_enter")
        ui.wait(lambda: row.model.problem.endswith("PLANT.json exists already; choose another name"))
        assert there.read_text(encoding="utf-8") == "mine"
