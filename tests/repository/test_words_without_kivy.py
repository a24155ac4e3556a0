"""Words of the screens are made without kivy: they are tested, and budgeted, where there is no window."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MODULES = (
    "home.facts",
    "home.view",
    "scheduler.facts",
    "scheduler.view",
    "logs.view",
    "settings.view",
    "common.alarms_view",
    "common.formats",
    "common.holding",
    "frame.view",
)


def test_views_and_facts_import_no_kivy() -> None:
    program = f"import sys\nfor name in {MODULES!r}: __import__('app.screens.' + name)\nprint('kivy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "False"


@pytest.mark.long
def test_unit_tests_import_no_kivy() -> None:
    """It takes over the root logger and writes into the home directory, so other tests in the process would fail."""
    modules = [
        ".".join(path.relative_to(ROOT).with_suffix("").parts) for path in sorted((ROOT / "tests/unit").rglob("*.py"))
    ]
    program = f"import sys\nsys.modules['kivy'] = None\nfor name in {modules!r}: __import__(name)"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
