"""A window is as large as the display or smaller; in its own process, as kivy reads its settings once."""

from __future__ import annotations

import contextlib
import os
import socket
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.database.connection import Database
from app.database.schema import MIGRATIONS
from app.window.window import size_within
from tests.support.process import PATIENCE, command

ROOT = Path(__file__).parents[3]
SDL_DUMMY_DISPLAY = "1024 768"  # what SDL's driver without a display pretends to have
PROGRAM = """
from app.window.window import configure
configure({kiosk})
from kivy.config import Config
print(*(Config.get("graphics", name) for name in ("width", "height", "fullscreen", "show_cursor", "window_state")))
"""


def printed(tmp_path: Path, program: str, **variables: str) -> str:
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path), **variables}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, env=environment, capture_output=True, text=True, check=True
    )
    return done.stdout


def configured(tmp_path: Path, kiosk: bool) -> str:
    return printed(tmp_path, PROGRAM.format(kiosk=kiosk), SDL_VIDEODRIVER="dummy").strip()


def test_a_kiosk_has_the_size_of_its_display(tmp_path):
    assert configured(tmp_path, True) == f"{SDL_DUMMY_DISPLAY} auto 0 visible"


@pytest.mark.long
def test_a_window_is_no_larger_than_the_display(tmp_path):
    assert configured(tmp_path, False) == f"{SDL_DUMMY_DISPLAY} 0 1 maximized"


@pytest.mark.parametrize(
    ("usable", "expected"),
    [
        (None, ("1280", "800", "visible")),
        ((1920, 1040), ("1280", "800", "visible")),
        ((1280, 800), ("1280", "800", "maximized")),  # its frame would be outside
        ((1366, 728), ("1280", "728", "maximized")),
        ((1024, 573), ("1024", "573", "maximized")),
    ],
)
def test_a_window_has_its_own_size_where_there_is_room(usable, expected):
    assert tuple(size_within(usable).values()) == expected


@pytest.mark.long
def test_parts_of_kivy_that_this_system_lacks_are_not_logged_as_errors(tmp_path):
    """Neither kinds of touch screens nor, where PATH has no programs for it, a clipboard of its own."""
    program = (
        "import logging, sys; logging.basicConfig(stream=sys.stdout, format='%(levelname)s %(message)s', level='INFO')\n"
        "from app.window.window import configure; configure(False)\nimport kivy.core.window, kivy.core.clipboard, kivy.input"
    )
    lines = printed(tmp_path, program, SDL_VIDEODRIVER="offscreen", PATH=str(tmp_path))
    assert "INFO Clipboard: Provider: " in lines
    assert [line for line in lines.splitlines() if not line.startswith("INFO ")] == []


@contextlib.contextmanager
def drawn(tmp_path: Path, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """The window, once systemd was notified that it has drawn."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        systemd.settimeout(PATIENCE)
        environment = {
            **os.environ,
            "NOTIFY_SOCKET": str(tmp_path / "notify"),
            "SDL_VIDEODRIVER": "offscreen",
            "XDG_CACHE_HOME": str(tmp_path / "cache"),
        }
        window = subprocess.Popen(
            command(tmp_path / "data", *arguments), cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True
        )
        try:
            assert systemd.recv(100) == b"READY=1"
            yield window
        finally:
            window.kill()
            window.communicate()


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="systemd runs on Linux only")
def test_systemd_hears_that_the_window_is_ready_once_it_has_drawn(tmp_path):
    with drawn(tmp_path) as window:
        window.terminate()
        assert window.wait(PATIENCE) == 0


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="systemd runs on Linux only")
def test_a_kiosk_that_may_not_start_shows_its_window_and_a_line(tmp_path):
    path = tmp_path / "data" / "amr-scheduler.db"
    Database.open(path).close()
    with contextlib.closing(sqlite3.connect(path)) as database:
        database.execute("PRAGMA user_version = 9999")
    with drawn(tmp_path, "--kiosk") as window:
        window.terminate()
        _out, said = window.communicate(timeout=PATIENCE)
    assert window.returncode == 2
    assert {line.partition(": ")[2] for line in said.splitlines()} == {
        f"{path} was written by a newer version (database version 9999, here {len(MIGRATIONS)}): update the app"
    }
