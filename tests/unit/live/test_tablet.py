"""Which machine this is, and whether a data directory is its own."""

from __future__ import annotations

import os
import uuid
from contextlib import closing
from pathlib import Path
from shutil import copytree, rmtree

import pytest

from app.database.connection import Database
from app.database.settings import SettingsRepository
from app.domain.message import render
from app.services.live import tablet
from app.services.live.tablet import LOOKED_AT, MACHINE, Tablet, machine_id
from app.services.live.windows import drives, registry_value
from tests.support.clock import VirtualClock

ADAPTER = 0x00155D012345
OF_ADAPTER = "00155d012345"


class NoHolds:
    is_copy = None

    def announce(self) -> None:
        """No one listens."""


@pytest.fixture
def db(tmp_path):
    db = Database.open(tmp_path / "a.db", clock=VirtualClock(), threaded=False, durable=False)
    yield db
    db.close()


@pytest.fixture(autouse=True)
def adapter(monkeypatch):
    monkeypatch.setattr(uuid, "getnode", lambda: ADAPTER)


def begun(db: Database, me: str | None, **stored: str) -> dict[str, object]:
    """What is stored after a start on the machine ``me``, and whether it is a copy."""
    settings = SettingsRepository()
    for name, value in stored.items():
        db.write(lambda c, name=name, value=value: settings.put(c, name, value))
    found = Tablet(db, VirtualClock(), NoHolds(), me)
    found.begin()
    return {
        "machine": settings.get(db.read(), MACHINE),
        "looked_at": settings.get(db.read(), LOOKED_AT),
        "is_copy": found.is_copy,
    }


def test_windows_says_it_in_its_registry(monkeypatch):
    monkeypatch.setattr(tablet, "registry_value", lambda _root, _path, name: f"{name} 1")
    assert machine_id() == str(uuid.uuid5(uuid.NAMESPACE_OID, "amr-scheduler/MachineGuid 1"))


def test_linux_says_it_in_a_file(tmp_path, monkeypatch):
    (tmp_path / "id").write_text("abc\n", encoding="ascii")
    monkeypatch.setattr(tablet, "registry_value", lambda *_names: "")
    monkeypatch.setattr(tablet, "MACHINE_IDS", (str(tmp_path / "none"), str(tmp_path / "id")))
    assert machine_id() == str(uuid.uuid5(uuid.NAMESPACE_OID, "amr-scheduler/abc"))


def test_the_last_way_is_a_network_adapter(monkeypatch):
    monkeypatch.setattr(tablet, "registry_value", lambda *_names: "")
    monkeypatch.setattr(tablet, "MACHINE_IDS", ())
    assert machine_id() == OF_ADAPTER
    monkeypatch.setattr(uuid, "getnode", lambda: ADAPTER | 1 << 40)
    assert machine_id() is None


def test_new_data_belong_to_this_machine(db):
    assert begun(db, "guid") == {"machine": "guid", "looked_at": None, "is_copy": False}


def test_data_that_are_only_looked_at_here_stay_so(db):
    stored = {MACHINE: "another", LOOKED_AT: "guid"}
    assert begun(db, "guid", **stored) == {"machine": "another", "looked_at": "guid", "is_copy": True}


def test_data_of_another_adapter_are_a_copy(db):
    assert begun(db, "guid", machine="00155d999999")["is_copy"]


@pytest.mark.parametrize("machine", [None, OF_ADAPTER])
def test_a_machine_that_has_nothing_better_keeps_its_network(db, machine):
    assert begun(db, machine, machine=OF_ADAPTER) == {"machine": OF_ADAPTER, "looked_at": None, "is_copy": False}


def place(directory) -> Path:
    """Data that were used there."""
    directory.mkdir()
    with closing(opened(directory)) as db:
        assert not begun(db, "guid")["is_copy"]
    return directory


def opened(directory) -> Database:
    return Database.open(directory / "a.db", clock=VirtualClock(), threaded=False, durable=False)


def is_copy(directory) -> bool:
    with closing(opened(directory)) as db:
        return bool(begun(db, "guid")["is_copy"])


def test_a_second_copy_of_the_data_on_this_machine_is_a_copy(tmp_path):
    first = place(tmp_path / "first")
    second = copytree(first, tmp_path / "second")
    assert [is_copy(first), is_copy(second)] == [False, True]
    with closing(opened(second)) as db:
        holds = NoHolds()
        found = Tablet(db, VirtualClock(), holds, "guid")
        found.begin()
        said = render(holds.is_copy)
        assert said.startswith(f"this data was copied from {os.path.normcase(first)}: say whether it moves here")
        found.move_here()
        assert holds.is_copy is None
    assert not is_copy(second)
    rmtree(first)
    assert is_copy(copytree(second, first))


def test_data_whose_directory_was_renamed_or_restored_are_no_copy(tmp_path):
    second = place(tmp_path / "first").rename(tmp_path / "second")
    assert not is_copy(second)
    copytree(second, tmp_path / "kept")
    rmtree(second)
    assert not is_copy(copytree(tmp_path / "kept", second))


def test_a_number_that_two_file_systems_have_given_proves_nothing(tmp_path, monkeypatch):
    first = place(tmp_path / "first")
    monkeypatch.setattr(tablet, "place_of", lambda found: {"path": str(found), "number": first.stat().st_ino})
    assert is_copy(copytree(first, tmp_path / "second"))


def test_other_systems_have_no_registry_and_no_drives(monkeypatch):
    monkeypatch.setattr("sys.platform", "linux")
    assert registry_value("HKEY_LOCAL_MACHINE", r"SOFTWARE\Microsoft\Cryptography", "MachineGuid") == ""
    assert list(drives()) == []
