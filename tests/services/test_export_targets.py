"""Where an export may go, and how it ends where it can't (exit codes: docs/interfaces.md)."""

from __future__ import annotations

import os
import resource
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from app.failures import BadInput
from app.process.commands import export_target
from tests.support.examples import at_night
from tests.support.process import ROOT, answer, command, configuration_of, environment, is_one_line, prepared, refusal

EXPORTS = pytest.mark.parametrize("option", ["--export-config", *at_night("--export-log")])


@pytest.fixture
def data(tmp_path) -> Path:
    prepared(tmp_path / "data", configuration_of())
    return tmp_path / "data"


@EXPORTS
@pytest.mark.parametrize("is_there", [True, *at_night(False)])
def test_a_data_directory_without_data_is_bad_input_and_stays_as_it_is(tmp_path, option, is_there):
    """Such as a name that was mistyped."""
    directory, target = tmp_path / "dtaa", tmp_path / "out"
    if is_there:
        directory.mkdir()
    problem = "holds no data yet" if is_there else "there is no data directory"
    assert problem in refusal(directory, option, target)
    assert not target.exists()
    assert sorted(tmp_path.iterdir()) == ([directory] if is_there else [])
    assert not is_there or not list(directory.iterdir())


@pytest.mark.long
@pytest.mark.parametrize(
    "arguments",
    [("--run-now", "R1", "Home"), ("--check-up", "R1"), ("--remove-pin",), ("--move-here",), ("--clock-is-right",)],
)
def test_nor_does_a_command_that_needs_data_make_one(tmp_path, arguments):
    assert "there is no data directory" in refusal(tmp_path / "dtaa", *arguments)
    assert not list(tmp_path.iterdir())


@EXPORTS
@pytest.mark.parametrize(
    "name",
    [
        "amr-scheduler.db",
        "link",
        *at_night(
            "amr-scheduler.db-wal", "scheduler.lock", "logs/amr-scheduler.log", "backups/daily.db", "inbox/x.request"
        ),
    ],
)
def test_an_export_takes_the_place_of_nothing_that_the_app_keeps(data, tmp_path, option, name):
    """Nor of another installation's, nor through a link."""
    (data / "link").symlink_to(data / "amr-scheduler.db")
    other = tmp_path / "other"
    prepared(other, configuration_of())
    before = (data / "amr-scheduler.db").read_bytes()
    for directory in (data, other):
        assert "belongs to the data of the app" in refusal(directory, option, data / name)
    assert (data / "amr-scheduler.db").read_bytes() == before


def test_an_export_may_lie_next_to_them(data):
    answer(data, "--export-log", data / "exports.csv")
    assert (data / "exports.csv").exists()


@EXPORTS
@pytest.mark.parametrize(
    ("stdout", "problem"),
    [
        ("/dev/full", "stdout can't be written: No space left on device"),
        pytest.param("&-", "stdout can't be written", marks=pytest.mark.long),
    ],
    ids=["full", "closed"],
)
def test_a_stdout_that_takes_nothing_is_bad_input(data, option, stdout, problem):
    ended = subprocess.run(
        ["sh", "-c", f'"$@" >{stdout}', "sh", *command(data, option, "-")],
        stderr=subprocess.PIPE,
        text=True,
        timeout=60.0,
        env=environment(),
        cwd=ROOT,
        check=False,
    )
    assert (ended.returncode, is_one_line(ended.stderr)) == (2, True)
    assert problem in ended.stderr


@pytest.fixture
def file(tmp_path) -> Path:
    """A former export."""
    file = tmp_path / "log.csv"
    file.write_text("old", encoding="utf-8")
    return file


@contextmanager
def full_disk() -> Iterator[None]:
    """A limit on the size of files simulates the full disk; for a moment only, because what pytest prints may go to a file too."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def write(path: Path, text: str) -> None:
    with export_target(str(path)) as target:
        target.write(text)


def test_a_disk_that_fills_up_leaves_the_former_export_and_no_draft(file):
    with pytest.raises(BadInput, match="can't be written: File too large"), full_disk():
        write(file, "x" * 1000)
    assert list(file.parent.iterdir()) == [file]
    assert file.read_text(encoding="utf-8") == "old"


def test_a_pipe_is_written_into_and_stays_a_pipe(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write(pipe, "new")
    assert pipe.is_fifo()
    assert os.read(reader, 100) == b"new"
    os.close(reader)
