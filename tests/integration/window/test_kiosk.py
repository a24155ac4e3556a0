"""A window that fills the screen is made in the size of the display, in a process of its own: kivy reads its settings once."""
from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
SDL_DUMMY_DISPLAY = "1024 768"           # what SDL's driver without a display pretends to have
PROGRAM = """
from app.window.window import configure
configure({kiosk})
from kivy.config import Config
print(*(Config.get("graphics", name) for name in ("width", "height", "fullscreen", "show_cursor")))
"""


def configured(tmp_path: Path, kiosk: bool) -> str:
    environment = {**os.environ, "SDL_VIDEODRIVER": "dummy", "XDG_CACHE_HOME": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", PROGRAM.format(kiosk=kiosk)], cwd=ROOT, env=environment, capture_output=True, text=True,
                          check=True)
    return done.stdout.strip()


def test_a_kiosk_has_the_size_of_its_display(tmp_path):
    assert configured(tmp_path, True) == f"{SDL_DUMMY_DISPLAY} auto 0"


def test_a_window_has_its_own(tmp_path):
    assert configured(tmp_path, False) == "1280 800 0 1"
