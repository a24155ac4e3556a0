"""Files in and out of the tablet: where they go, what is refused, and that nothing is ever half written or written over."""

from __future__ import annotations

import json
import os
from datetime import UTC, datetime
from pathlib import Path

import pytest

from app.database.connection import Database
from app.domain.models import InvalidInput, Mission, Robot
from app.services.catalogue.catalogue import Catalogue
from app.services.files import exports as data_files
from app.services.files import file_access, places
from app.services.files.about import components
from app.services.files.exports import DataFiles
from app.services.files.places import PlaceKind
from app.services.live import windows
from app.services.live.windows import REMOTE, REMOVABLE, Drive
from tests.support.clock import VirtualClock
from tests.support.modes import is_private

NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)


@pytest.fixture
def catalogue(tmp_path):
    db = Database.open(tmp_path / "data" / "amr-scheduler.db", threaded=False, durable=False)
    yield Catalogue(db, VirtualClock(NOW))
    db.close()


@pytest.fixture
def files(tmp_path, catalogue, monkeypatch):
    monkeypatch.setattr(windows, "drives", lambda: iter(()))
    documents = tmp_path / "Documents"
    documents.mkdir()
    return DataFiles(catalogue._db, catalogue, VirtualClock(NOW), documents)


def refused(files, action: str, path) -> str:
    with pytest.raises(InvalidInput) as problem:
        getattr(files, action)(str(path))
    assert problem.value.field == "path"
    return problem.value.text


# ---------------------------------------------------------------------- out
def test_an_export_says_where_it_went_and_is_its_owners_alone(files, catalogue, tmp_path):
    catalogue.save_robot(Robot("R1", "10.0.0.1", "user"), "secret")
    path = files.export_configuration("plant.json")
    assert path == tmp_path / "Documents" / "plant.json"
    text = path.read_text(encoding="utf-8")
    assert json.loads(text)["robots"][0]["name"] == "R1"
    assert "secret" not in text
    assert "Basic" not in text
    assert is_private(path)


def test_the_history_goes_out_as_csv(files):
    path = files.export_history("runs")
    assert path.name == "runs.csv"  # a missing ending is added
    assert path.read_bytes().startswith(b"id,trigger,schedule,")
    assert path.read_bytes().endswith(b"\r\n")


def test_a_suggestion_is_free_and_named_after_the_day(files, tmp_path):
    first = files.suggested("amr-scheduler", ".json")
    assert first == tmp_path / "Documents" / "amr-scheduler-2026-11-20.json"
    files.export_configuration(str(first))
    assert files.suggested("amr-scheduler", ".json").name == "amr-scheduler-2026-11-20-2.json"
    assert files.suggested("amr-scheduler", ".json", tmp_path) == tmp_path / first.name


def test_a_home_without_documents_exports_into_the_data_directory(catalogue, tmp_path):
    files = DataFiles(catalogue._db, catalogue, VirtualClock(NOW), tmp_path / "nowhere")
    assert files.directory == tmp_path / "data" / "exports"
    assert files.export_configuration("a.json") == tmp_path / "data" / "exports" / "a.json"


def test_an_export_never_writes_over_a_file(files, tmp_path):
    kept = tmp_path / "Documents" / "kept.json"
    kept.write_text("mine", encoding="utf-8")
    assert refused(files, "export_configuration", kept) == f"{kept} exists already: choose another name"
    assert kept.read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize(
    ("path", "sentence"),
    [
        ("", "enter the name of a file"),
        ("   ", "enter the name of a file"),
        ("a\0b", "is not the name of a file"),
        ("/nowhere/at/all.json", f"there is no directory {Path('/nowhere/at').absolute()}"),
        (".", "is a directory: add the name of a file"),
    ],
)
def test_a_path_that_cannot_be_is_one_sentence(files, path, sentence):
    assert sentence in refused(files, "export_configuration", path)


def test_a_failed_export_leaves_nothing_behind(files, tmp_path, monkeypatch):
    def full(_connection, file, **_options):
        file.write("half a")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(data_files, "write_history", full)
    assert "can't be written: No space left on device" in refused(files, "export_history", "log.csv")
    assert list((tmp_path / "Documents").iterdir()) == []


# ---------------------------------------------------------------------- in
def test_an_import_lists_what_changed(files, catalogue, tmp_path):
    file = tmp_path / "Documents" / "in.json"
    file.write_text(
        json.dumps({"format": "amr-scheduler/1", "missions": [{"name": "Deliver", "guid": "g-1"}]}), encoding="utf-8"
    )
    assert len(files.import_configuration("in.json")) == 1
    assert files.import_configuration(str(file)) == []
    assert catalogue.save_mission(Mission("Other", "g-2")).id == 2


def test_an_unusable_import_is_reported(files, tmp_path, monkeypatch):
    assert (
        refused(files, "import_configuration", "missing.json")
        == f"there is no file {tmp_path / 'Documents' / 'missing.json'}"
    )
    assert "can't be read" in refused(files, "import_configuration", tmp_path / "Documents")
    monkeypatch.setattr(file_access, "LARGEST_FILE", 10)
    (tmp_path / "Documents" / "big.json").write_text("x" * 11, encoding="utf-8")
    assert refused(files, "import_configuration", "big.json").endswith("is larger than 5 MiB")


def test_sticks_and_shares_are_found_in_the_table_of_mounts(files, tmp_path, monkeypatch):
    table = tmp_path / "mounts"
    monkeypatch.setattr(places, "MOUNTS", table)
    assert [place.kind for place in files.places()] == [PlaceKind.DOCUMENTS]  # no such table
    table.write_text(
        "\n".join(
            (
                "/dev/sda1 / ext4 rw 0 0",
                "tmpfs /run/media tmpfs rw 0 0",
                "//plant/plans /mnt/plans cifs rw 0 0",
                "/dev/sdb1 /media/operator/KING\\040STON vfat rw 0 0",
                "/dev/sdc1 /run/media/me/BLUE exfat rw 0 0",
                "cut",
            )
        )
    )
    assert [(place.kind, place.path, place.name) for place in files.places()] == [
        (PlaceKind.DOCUMENTS, tmp_path / "Documents", ""),
        (PlaceKind.USB, Path("/run/media/me/BLUE"), "BLUE"),
        (PlaceKind.USB, Path("/media/operator/KING STON"), "KING STON"),
        (PlaceKind.SHARE, Path("/mnt/plans"), "plans"),
    ]


def test_on_windows_sticks_and_shares_are_drives(files, tmp_path, monkeypatch):
    fixed, no_medium, of_a_share = 3, None, ""
    monkeypatch.setattr(places, "MOUNTS", tmp_path / "none")
    monkeypatch.setattr(
        windows,
        "drives",
        lambda: iter(
            (
                Drive("C:\\", fixed, "System"),
                Drive("D:\\", REMOVABLE, no_medium),
                Drive("E:\\", REMOVABLE, "KINGSTON"),
                Drive("F:\\", REMOVABLE, ""),
                Drive("P:\\", REMOTE, of_a_share),
            )
        ),
    )
    assert [(place.kind, place.path, place.name) for place in files.places()[1:]] == [
        (PlaceKind.USB, Path("F:\\"), "F:"),
        (PlaceKind.USB, Path("E:\\"), "KINGSTON (E:)"),
        (PlaceKind.SHARE, Path("P:\\"), "P:"),
    ]


def test_without_a_directory_for_documents_the_place_is_the_tablet(files, tmp_path):
    (tmp_path / "Documents").rmdir()
    assert [(place.kind, place.path.name) for place in files.places()] == [(PlaceKind.TABLET, "exports")]


def test_files_of_a_place_are_listed_newest_first(tmp_path):
    for name, at in (
        ("OLD.JSON", 1_000),
        ("plans/new.json", 2_000),
        ("other.txt", 3_000),
        (".hidden.json", 4_000),
        ("a/b/c.json", 5_000),
    ):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("{}", encoding="utf-8")
        os.utime(path, (at, at))
    found = places.found_in(tmp_path, ".json")
    assert [(file.path.relative_to(tmp_path), file.changed_at.timestamp(), file.size) for file in found] == [
        (Path("plans/new.json"), 2_000, 2),
        (Path("OLD.JSON"), 1_000, 2),
    ]
    assert places.found_in(tmp_path / "gone", ".json") == []


# ---------------------------------------------------------------------- backups
def test_a_backup_in_capitals_is_listed_and_hidden_files_are_not_counted(files):
    made = files.back_up_now().path
    brought = made.with_name("BROUGHT.DB")
    brought.write_bytes(made.read_bytes())
    for name in (f"._{made.name}", ".hidden.db", f"{made.name}.part"):
        made.with_name(name).write_bytes(b"x")
    assert {backup.path for backup in files.backups()} == {made, brought}
    files.check_backup(brought)


def test_a_backup_goes_to_a_new_file_in_a_directory_that_exists(files, tmp_path):
    files.check_backup(files.back_up_to(str(tmp_path / "stick.db")).path)
    assert refused(files, "back_up_to", tmp_path / "stick").endswith("exists already: choose another name")
    assert "there is no directory" in refused(files, "back_up_to", "/nowhere/a.db")
    assert files.backups() == []


def test_backups_are_made_listed_and_checked(files, tmp_path):
    assert files.backups() == []
    first = files.back_up_now()
    second = files.back_up_now()  # in the same second: both are kept
    assert first.path.name == "manual-2026-11-20T123800Z.db"
    assert {backup.path for backup in files.backups()} == {first.path, second.path}
    assert all(backup.size > 0 for backup in files.backups())
    files.check_backup(first.path)
    broken = first.path.with_name("broken.db")
    broken.write_bytes(b"not a database")
    with pytest.raises(InvalidInput, match="can't be restored"):
        files.check_backup(broken)


def test_about_names_every_part_with_version_and_licence():
    found = {component.name: component for component in components()}
    assert {"Python", "SQLite", "Kivy", "KivyMD", "requests", "Roboto"} <= set(found)
    assert all(component.licence for component in found.values())
    assert found["SQLite"].version.startswith("3.")
