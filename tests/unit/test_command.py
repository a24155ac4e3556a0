"""The commands that errors and hints name can be copied: by the name that the app was started by, quoted for the shell at hand."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import main
from app.command import command, program
from app.database.errors import DatabaseDamaged


@pytest.fixture
def on_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.command.os", SimpleNamespace(name="nt"))  # pathlib must not believe it
    monkeypatch.setattr(sys, "executable", r"C:\Program Files\AMR Scheduler\python\pythonw.exe")


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["/opt/venv/bin/amr-scheduler", "--headless"])
    monkeypatch.setenv("LOGNAME", "somebody")
    monkeypatch.setattr(shutil, "which", {"amr-scheduler": "/usr/bin/amr-scheduler"}.get)


@pytest.fixture(autouse=True)
def wide_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "500")


def test_a_checkout_is_started_by_its_file(monkeypatch: pytest.MonkeyPatch):
    for started_by in ("main.py", "/home/x/main.py", "-c"):
        monkeypatch.setattr(sys, "argv", [started_by])
        assert (program(), command("--data-dir", Path("/d"))) == ("main.py", "python main.py --data-dir /d")
        assert "which python -m mir_sim --profile takes" in main.parser().format_help()


@pytest.mark.usefixtures("installed")
def test_an_installed_one_is_started_by_its_name():
    assert (program(), command("--data-dir", Path("/my data"))) == (
        "amr-scheduler",
        "amr-scheduler --data-dir '/my data'",
    )
    usage = main.parser().format_help()
    assert usage.startswith("usage: amr-scheduler ")
    assert "which mir-sim --profile takes" in usage


@pytest.mark.usefixtures("installed")
def test_a_name_that_the_shell_does_not_find_is_replaced_by_its_python(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(shutil, "which", {}.get)
    monkeypatch.setattr(sys, "executable", "/opt/venv/bin/python")
    assert command("--remove-pin") == "/opt/venv/bin/python -m amr_scheduler --remove-pin"


@pytest.mark.usefixtures("installed")
def test_what_runs_as_the_packages_own_user_is_started_by_sudo(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("LOGNAME", "amr-scheduler")
    assert command("--remove-pin") == "sudo -u amr-scheduler amr-scheduler --remove-pin"


@pytest.mark.usefixtures("installed")
def test_a_user_without_a_name_starts_it_as_it_is(monkeypatch: pytest.MonkeyPatch):
    def fails() -> str:
        raise KeyError("getpwuid(): uid not found: 1234")

    monkeypatch.setattr("getpass.getuser", fails)
    assert command("--remove-pin") == "amr-scheduler --remove-pin"


@pytest.mark.usefixtures("installed", "on_windows")
def test_windows_quotes_with_double_quotes_and_names_the_python_that_prints(monkeypatch: pytest.MonkeyPatch):
    assert command("--data-dir", r"C:\R&D files\ä") == r'amr-scheduler --data-dir "C:\R&D files\ä"'
    assert command("--data-dir", r"C:\data\ö") == r"amr-scheduler --data-dir C:\data\ö"
    monkeypatch.setattr(shutil, "which", {}.get)
    assert command("--remove-pin") == (
        r'"C:\Program Files\AMR Scheduler\python\python.exe" -m amr_scheduler --remove-pin'
    )


def test_a_variable_that_is_not_set_names_no_data_directory(capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit, match="2"):
        main.main(["--data-dir", ""])
    assert capsys.readouterr().err.endswith(": argument --data-dir: needs the name of a directory; see --help\n")


def test_a_shell_reads_the_command_back(monkeypatch: pytest.MonkeyPatch):
    words = ["it's", 'a "b"', "$HOME", "ä ö", "&;|", ""]
    monkeypatch.setattr(sys, "argv", ["main.py"])
    shell = command(*words).replace("python main.py", "printf '%s\\n'", 1)
    assert subprocess.run(["sh", "-c", shell], capture_output=True, text=True, check=True).stdout == "\n".join(
        [*words, ""]
    )


@pytest.mark.usefixtures("installed")
def test_a_damaged_database_names_the_installed_command():
    damaged = DatabaseDamaged(Path("/my data/y.db"), "malformed", None, Path("/my data/backups/good.db"))
    assert str(damaged).endswith(
        "with: amr-scheduler --data-dir '/my data' --restore-backup '/my data/backups/good.db'"
    )
