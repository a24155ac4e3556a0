"""What is installed: the app and the simulator below one name, nothing that only develops them, and two commands."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
# What the launchers of the .deb do, for both in one process; others put the path of the command in argv.
LAUNCH = """import sys
from importlib.metadata import entry_points
sys.path[:0] = [sys.argv[1]]
for name in ("amr-scheduler", "mir-sim"):
    (command,) = entry_points(group="console_scripts", name=name)
    sys.argv = ["-c", "--wrong"]
    try:
        command.load()()
    except SystemExit as end:
        print(command.module, end.code)"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, unpacked as an installer does it."""
    out = tmp_path_factory.mktemp("wheel")
    (wheel,) = WheelBuilder(str(ROOT)).build(directory=str(out), versions=["standard"])
    with zipfile.ZipFile(wheel) as file:
        file.extractall(out / "site")
    return out / "site"


def run(installed: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=installed.parent, env=environment, capture_output=True, text=True, timeout=60)


def test_the_wheel_has_all_that_runs_and_nothing_else(installed: Path):
    there = [path for part in ("app", "kv", "locale", "mir_sim") for path in (ROOT / part).rglob("*") if path.is_file()]
    runs = {path.relative_to(ROOT).as_posix() for path in there if path.suffix not in (".pyc", ".po", ".pot")}
    package = installed / "amr_scheduler"
    files = {path.relative_to(package).as_posix() for path in package.rglob("*") if path.is_file()}
    assert files == runs | {"__init__.py", "__main__.py", "main.py"}
    assert {path.name for path in installed.iterdir()} == {
        "amr_scheduler",
        f"amr_scheduler-{PROJECT['project']['version']}.dist-info",
    }


def test_both_commands_start_what_was_installed_and_go_by_their_name(installed: Path):
    done = run(installed, "-I", "-c", LAUNCH, str(installed))
    assert done.stdout == "amr_scheduler.__main__ 2\n" * 2
    assert done.stderr.splitlines() == [
        "amr-scheduler: unrecognized arguments: --wrong; see --help",
        "mir-sim: unrecognized arguments: --wrong",
    ]


def test_it_starts_as_a_module_too(installed: Path):
    done = run(installed, "-m", "amr_scheduler", "--version")
    assert (done.stdout, done.stderr) == (f"AMR Scheduler {PROJECT['project']['version']}\n", "")


def test_extra_and_group_ask_for_the_same_window():
    assert PROJECT["project"]["optional-dependencies"]["ui"] == PROJECT["dependency-groups"]["ui"]


def test_the_versions_of_app_and_wheel_agree():
    from app import __version__

    assert PROJECT["project"]["version"] == __version__
