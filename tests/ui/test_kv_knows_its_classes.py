"""What kv uses is registered when the widgets are loaded, whatever else has been imported by then."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

CODE = """
import re
from tests.ui import headless
headless.install()
import app.widgets
app.widgets.load()
from kivy.factory import Factory
names = [f"widgets/{name}" for name in app.widgets.WIDGETS_KV] + ["common/pin"]
used = {name for file in names for name in re.findall(r"^ +([A-Z]\\w+):$", (app.widgets.KV_DIR / f"{file}.kv").read_text(), re.M)}
print(sorted(name for name in used if name not in Factory.classes and name not in ("Color", "Rectangle", "RoundedRectangle", "Line")))
"""


def test_the_widgets_kv_finds_every_class_in_a_new_process():
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run([sys.executable, "-c", CODE], cwd=root, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
