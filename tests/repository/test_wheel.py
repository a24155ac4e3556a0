"""What is installed: the app and the simulator below one name, nothing that only develops them, and two commands."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
# What an installed launcher does, with the wheel's own list of commands.
LAUNCH = """import sys
from importlib.metadata import entry_points
name, sys.path[:0], sys.argv = sys.argv[1], [sys.argv[2]], [f"/bin/{sys.argv[1]}", *sys.argv[3:]]
(command,) = entry_points(group="console_scripts", name=name)
start = command.load()
print(start.__module__, flush=True)
sys.exit(start())"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, unpacked as an installer does it."""
    out = tmp_path_factory.mktemp("wheel")
    build = f"import hatchling.build; print(hatchling.build.build_wheel({str(out)!r}))"
    name = subprocess.run([sys.executable, "-c", build], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    with zipfile.ZipFile(out / name.strip()) as wheel:
        wheel.extractall(out / "site")
    return out / "site"


def started(installed: Path, name: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-I", "-c", LAUNCH, name, str(installed), *arguments],
        cwd=installed.parent,
        capture_output=True,
        text=True,
        timeout=60,
    )


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
    window, robots = (started(installed, name, "--wrong") for name in ("amr-scheduler", "mir-sim"))
    assert window.stdout == robots.stdout == "amr_scheduler.__main__\n"
    assert window.stderr == "amr-scheduler: unrecognized arguments: --wrong; see --help\n"
    assert robots.stderr == "mir-sim: unrecognized arguments: --wrong\n"


def test_it_starts_as_a_module_too(installed: Path):
    done = subprocess.run(
        [sys.executable, "-m", "amr_scheduler", "--version"],
        cwd=installed.parent,
        env={**os.environ, "PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
    )
    assert (done.stdout, done.stderr) == (f"AMR Scheduler {PROJECT['project']['version']}\n", "")


def test_extra_and_group_ask_for_the_same_window():
    assert PROJECT["project"]["optional-dependencies"]["ui"] == PROJECT["dependency-groups"]["ui"]


def test_the_versions_of_app_and_wheel_agree():
    from app import __version__

    assert PROJECT["project"]["version"] == __version__
