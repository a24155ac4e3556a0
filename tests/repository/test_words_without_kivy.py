"""Words of the screens are made without kivy: they are tested, and budgeted, where there is no window."""
from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
MODULES = ("home.facts", "home.view", "scheduler.facts", "scheduler.view", "logs.view", "settings.view", "common.alarms_view",
           "common.holding", "frame.view")


def test_views_and_facts_import_no_kivy() -> None:
    program = f"import sys\nfor name in {MODULES!r}: __import__('app.screens.' + name)\nprint('kivy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "False"
