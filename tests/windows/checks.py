"""What only a machine with Windows can show. Runs in its Python, started by lane.py, on a machine with a stick at E:."""

from __future__ import annotations

import subprocess
import sys
import time
import uuid
import winreg
from dataclasses import dataclass
from pathlib import Path

import pytest

from app.database.backups import BACKUPS
from app.database.connection import DATABASE_NAME
from app.domain.clock import SystemClock
from app.process.log_file import RotatingFile
from app.process.tablet_readings import battery
from app.services.files.places import Place, PlaceKind, found_in, mounted
from app.services.live.tablet import machine_id
from app.services.live.tablet_zone import TabletZone, tablet_zone
from app.window.display import display_size
from tests.support.process import ROOT, answer, refusal, running, wait_for

# ---------------------------------------------------------------------- processes
BREAKS = """
import pathlib, signal, sys, threading, time
import main

def press():
    while not pathlib.Path(sys.argv[1]).exists():
        time.sleep(0.1)
    signal.raise_signal(signal.SIGBREAK)

threading.Thread(target=press, daemon=True).start()
sys.exit(main.main(sys.argv[2:]))
"""


def test_ctrl_break_ends_it(tmp_path):
    """The app presses it itself: wine has no console here."""
    pressed = tmp_path / "pressed"
    words = [sys.executable, "-c", BREAKS, str(pressed), "--headless", "--data-dir", str(tmp_path / "data")]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=ROOT) as app:
        assert app.stdout.readline().strip() == "ready"
        pressed.touch()
        assert app.wait(30) == 0


@dataclass(frozen=True)
class Killed:
    """What a demo left that was killed."""

    data: Path
    plan: str
    pid: int
    refusal: str  # of a second process on its data
    queued: str  # by a command


@pytest.fixture(scope="module")
def killed(tmp_path_factory) -> Killed:
    data = tmp_path_factory.mktemp("one") / "Käyttö ä ö"
    with running(data, "--demo") as app:
        refused = refusal(data, "--headless")
        queued = answer(data, "--run-now", "Aino", "Deliver kits to line 2")
        plan = answer(data, "--export-config", "-")
        wait_for(lambda: list((data / BACKUPS).glob("*.db")))
        app.kill()
        return Killed(data, plan, app.process.pid, refused, queued)


def test_a_second_process_is_refused_and_names_the_first(killed):
    assert f"is in use by process {killed.pid}" in killed.refusal


def test_a_running_app_serves_a_command(killed):
    assert killed.queued.strip().isdecimal()


def test_after_a_kill_it_continues_with_its_data(killed):
    with running(killed.data):
        assert answer(killed.data, "--export-config", "-") == killed.plan


def test_a_backup_takes_the_place_of_a_damaged_database(killed):
    (killed.data / DATABASE_NAME).write_bytes(b"damaged" * 1000)
    answer(killed.data, "--restore-backup", next((killed.data / BACKUPS).glob("*.db")))
    assert answer(killed.data, "--export-config", "-") == killed.plan


def test_a_log_that_another_process_has_open_is_written_on_and_followed_later(tmp_path):
    mine, others = RotatingFile(tmp_path / "log", most=4, kept=2), RotatingFile(tmp_path / "log", most=4, kept=2)
    for text in (b"1111", b"2222", b"3333"):
        mine.write(text)
    assert (tmp_path / "log").read_bytes() == b"111122223333"
    others._file.close()
    mine.write(b"4444")
    assert (tmp_path / "log.1").read_bytes() == b"111122223333"
    with (tmp_path / "log.1").open("rb"):
        mine.write(b"5555")
    assert (tmp_path / "log").read_bytes() == b"44445555"


# ---------------------------------------------------------------------- what Windows is asked
@pytest.mark.parametrize(
    ("key", "country", "name"),
    [
        ("FLE Standard Time", "FI", "Europe/Helsinki"),
        ("W. Europe Standard Time", "DE", "Europe/Berlin"),
        ("US Mountain Standard Time", "US", "America/Phoenix"),
        ("UTC", "FI", "Etc/UTC"),
    ],
)
def test_the_zone_is_that_of_the_registry(key, country, name):
    set_value(
        winreg.HKEY_LOCAL_MACHINE, r"SYSTEM\CurrentControlSet\Control\TimeZoneInformation", "TimeZoneKeyName", key
    )
    set_value(winreg.HKEY_CURRENT_USER, r"Control Panel\International\Geo", "Name", country)
    assert tablet_zone(environ={}) == TabletZone(name, "Windows", name != "Etc/UTC")


def test_the_machine_is_the_guid_of_the_registry():
    with winreg.OpenKey(winreg.HKEY_LOCAL_MACHINE, r"SOFTWARE\Microsoft\Cryptography") as key:
        guid = winreg.QueryValueEx(key, "MachineGuid")[0]
    assert machine_id() == str(uuid.uuid5(uuid.NAMESPACE_OID, f"amr-scheduler/{guid}"))


def test_a_stick_is_a_place():
    stick = Place(PlaceKind.USB, Path("E:\\"), "STICK (E:)")
    assert stick in list(mounted())
    (stick.path / "plan.json").write_text("{}", encoding="ascii")
    assert [file.path for file in found_in(stick.path, ".json")] == [stick.path / "plan.json"]


def test_sdl_knows_the_display():
    width, height = display_size()
    assert width >= 640
    assert height >= 480


def test_the_battery_is_there_or_not():
    found = battery()
    assert found is None or 0 <= found.percent <= 100


def test_the_monotonic_clock_runs_as_pythons_while_nothing_sleeps():
    clock = SystemClock()
    began, pythons = clock.monotonic(), time.monotonic()
    time.sleep(1)
    assert clock.monotonic() - began == pytest.approx(time.monotonic() - pythons, abs=0.2)


def set_value(root: int, path: str, name: str, value: str) -> None:
    with winreg.CreateKey(root, path) as key:
        winreg.SetValueEx(key, name, 0, winreg.REG_SZ, value)
