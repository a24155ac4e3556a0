"""A console, pipe or disk that blocks: logging never waits, and dropped lines are reported once it works again."""

from __future__ import annotations

import errno
import logging
import os
import threading
from pathlib import Path

import pytest

from app.process.log_file import MOST_WAITING, RotatingFile, Sink, unbuffered
from tests.support.modes import is_private

WITHIN = 60.0


class Place:
    """Somewhere to write to that can be made to hang, and to fail."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.works = threading.Event()
        self.hangs = threading.Event()
        self.error: OSError | None = None

    def write(self, data: bytes) -> None:
        self.hangs.set()
        assert self.works.wait(WITHIN)
        if self.error is not None:
            raise self.error
        self.lines.append(data.decode())


@pytest.fixture
def place():
    place = Place()
    yield place
    place.works.set()


@pytest.fixture
def log(place):
    """A separate logger that writes only here."""
    logger = logging.Logger("robots")
    logger.addHandler(Sink("place", place.write, logging.Formatter("%(message)s")))
    yield logger
    logger.handlers[0].close()


def written(log) -> bool:
    return log.handlers[0].is_written(WITHIN)


def test_logging_never_blocks_and_dropped_lines_are_counted(log, place):
    log.info("first")
    assert place.hangs.wait(WITHIN)  # the thread has taken it, so that the whole queue is free
    for number in range(MOST_WAITING + 212):
        log.info("%d", number)
    assert not log.handlers[0].is_written()  # nor does the end of the process wait for long
    place.works.set()
    assert written(log)
    log.info("last")
    assert written(log)
    assert place.lines == [
        "first\n",
        *(f"{number}\n" for number in range(MOST_WAITING)),
        "212 lines were left out\n",
        "last\n",
    ]


def test_lines_that_could_not_be_written_are_counted_until_it_works(log, place):
    place.works.set()
    place.error = OSError(errno.ENOSPC, "No space left on device")
    for number in range(3):
        log.info("%d", number)
    assert not written(log)
    place.error = None
    log.info("last")
    assert written(log)
    assert place.lines == ["3 lines were left out\n", "last\n"]


def test_a_place_that_hangs_delays_no_other(log, place):
    lines: list[bytes] = []
    other = Sink("other", lines.append, logging.Formatter("%(message)s"))
    log.addHandler(other)
    log.info("both")
    assert other.is_written(WITHIN)
    assert (lines, place.lines) == ([b"both\n"], [])
    other.close()


def test_arguments_that_change_afterwards_change_no_line(log, place):
    robots = ["Aino"]
    log.info("known: %s", robots)
    robots.append("Sisu")
    place.works.set()
    assert written(log)
    assert place.lines == ["known: ['Aino']\n"]


def test_a_line_whose_arguments_do_not_fit_is_not_an_error_of_the_thread_that_logs(log, place):
    place.works.set()
    log.info("%d robots", "two")
    assert written(log)
    (line,) = place.lines
    assert line.startswith("'%d robots' could not be formatted: TypeError(")


def test_a_pipe_gets_whole_lines_past_the_buffer_and_one_that_is_closed_is_an_error():
    reader, writer = os.pipe()
    with os.fdopen(writer, "w") as stream:
        unbuffered(stream)(b"line\n")
        assert os.read(reader, 100) == b"line\n"
        os.close(reader)
        with pytest.raises(BrokenPipeError):
            unbuffered(stream)(b"line\n")


def test_a_full_pipe_that_must_not_wait_is_an_error_too():
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    with os.fdopen(writer, "w") as stream, pytest.raises(BlockingIOError):
        unbuffered(stream)(b"x" * 1_000_000)
    os.close(reader)


def test_a_full_file_is_followed_by_a_new_one_and_the_oldest_goes(tmp_path):
    path = tmp_path / "log"
    path.write_bytes(b"0 older\n")
    for number in range(1, 5):
        RotatingFile(path, most=8, kept=2).write(f"{number} line\n".encode() + b"x" * 8)
    assert {file.name: file.read_bytes()[:6] for file in tmp_path.iterdir()} == {
        "log": b"4 line",
        "log.1": b"3 line",
        "log.2": b"2 line",
    }
    assert is_private(*tmp_path.iterdir())


@pytest.fixture
def full(tmp_path):
    """A file that the next line would not fit into, beside an older one."""
    file = RotatingFile(tmp_path / "log", most=4, kept=2)
    (tmp_path / "log.1").write_bytes(b"older")
    file.write(b"full")
    return file


def contents(directory):
    return {path.name: path.read_bytes() for path in directory.iterdir()}


def test_older_files_stay_while_no_new_one_can_be_opened(full, tmp_path, monkeypatch):
    monkeypatch.setattr("app.process.log_file.os.open", refuse)
    for _line in range(5):
        with pytest.raises(OSError, match="No space"):
            full.write(b"lost")
    assert contents(tmp_path) == {"log.1": b"full", "log.2": b"older"}


def test_a_file_that_can_not_be_renamed_is_written_on(full, tmp_path, monkeypatch):
    monkeypatch.setattr("app.process.log_file.os.replace", refuse)
    for _line in range(5):
        full.write(b"+")
    assert contents(tmp_path) == {"log": b"full+++++", "log.1": b"older"}


def test_nothing_is_lost_while_an_older_file_is_open_on_windows(full, tmp_path, monkeypatch):
    def replace_unless_open(old: Path, new: Path) -> None:
        if "log.1" in (old.name, new.name):
            raise PermissionError(errno.EACCES, "used by another process")
        old.rename(new)

    with monkeypatch.context() as patch:
        patch.setattr("app.process.log_file.os.replace", replace_unless_open)
        full.write(b"+")
        full.write(b"+")
    assert contents(tmp_path) == {"log": b"full++", "log.1": b"older"}
    full.write(b"next")
    assert contents(tmp_path) == {"log": b"next", "log.1": b"full++", "log.2": b"older"}


def refuse(*_arguments: object) -> int:
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_directory_that_is_made_again_gets_a_file_again(tmp_path):
    directory = tmp_path / "logs"
    directory.mkdir()
    file = RotatingFile(directory / "log", most=1, kept=1)
    file.write(b"a")
    (directory / "log").unlink()
    directory.rmdir()
    with pytest.raises(FileNotFoundError):
        file.write(b"b")
    directory.mkdir()
    file.write(b"c")
    assert (directory / "log").read_bytes() == b"c"
