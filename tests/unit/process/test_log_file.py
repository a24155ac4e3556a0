"""The log file: one physical line for each event, for any text of a robot and any error."""

from __future__ import annotations

import logging
import re
import shutil
import sys
import threading
import warnings

import pytest

from app.failures import BadInput
from app.process import log_file as logs
from tests.support.log import file_in, kept_apart, written

LINE = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3} (INFO   |WARNING|ERROR  |CRITICAL) \S+ \S+: .+")


@pytest.fixture
def directory(tmp_path, monkeypatch):
    with kept_apart(monkeypatch):
        yield tmp_path / "logs"


def lines_of(directory):
    content = file_in(directory)
    assert content.endswith("\n")
    lines = content.removesuffix("\n").split("\n")
    assert all(LINE.fullmatch(line) and line.isprintable() for line in lines), lines
    return lines


def breaks():
    raise ValueError("first\nsecond")


def test_every_event_is_one_line(directory, capfd):
    logs.start(directory, stderr=True)
    log = logging.getLogger("app.somewhere")
    log.info("R1 says: %s", "left\r\nwheel\x85\u2028again \x1b[31mred \u202eturned \udc80")
    try:
        breaks()
    except ValueError as error:
        log.exception("It broke")
        where = logs.log_crash(error)
        sys.excepthook(type(error), error, error.__traceback__)
    assert where == f"; details in {directory / logs.FILE_NAME}"
    robot, exception, crash, hook = lines_of(directory)
    assert robot.endswith("R1 says: left ⏎ wheel ⏎ again \\x1b[31mred \\u202eturned \\udc80")
    for line in (exception, crash, hook):
        assert " ⏎ Traceback (most recent call last): ⏎ " in line
        assert line.endswith(" ⏎ ValueError: first ⏎ second")
        assert ", in breaks ⏎ " in line
    written()
    watched = capfd.readouterr().err.splitlines()
    assert [line[20:] for line in watched] == [
        "INFO    R1 says: left wheel again \\x1b[31mred \\u202eturned \\udc80",
        "ERROR   It broke",
        "CRITICAL Unexpected error",
    ]


def test_a_long_line_is_shortened_where_it_is_watched_too(directory, capfd):
    logs.start(directory, stderr=True)
    logging.getLogger("app.somewhere").warning("begin %s end", "ö" * 5000)
    written()
    line = capfd.readouterr().err
    assert len(line.encode()) <= logs.LONGEST + 40
    assert "begin ö" in line
    assert line.endswith("ö end\n")


def test_the_traceback_that_urllib3_writes_for_each_broken_header_is_omitted(directory):
    logs.start(directory, stderr=False)
    logging.getLogger("urllib3.connection").warning("Failed to parse headers", exc_info=True)
    logging.getLogger("app.somewhere").warning("Kept")
    assert [line.split(": ")[-1] for line in lines_of(directory)] == ["Kept"]


def test_a_log_that_cannot_be_written_is_said_unless_it_is_only_read(directory):
    directory.write_text("a file where the directory should be")
    with pytest.raises(BadInput, match=r"amr-scheduler.log can't be written: .+; check the permissions"):
        logs.start(directory, stderr=False)
    logs.start(directory, stderr=False, read_only=True)
    assert logs.log_crash(ValueError("why")) == " (why)"


def test_a_crash_is_reported_without_the_log_file(directory):
    logs.start(directory, stderr=False)
    shutil.rmtree(directory)
    assert logs.log_crash(ValueError("why")) == " (why)"


def test_uncaught_python_errors_are_written_to_the_log(directory, capfd):
    logs.start(directory, stderr=False)

    class Breaks:
        def __del__(self):
            raise ValueError("at the end")

    Breaks()
    warnings.warn("old", stacklevel=1)
    thread = threading.Thread(target=breaks, name="reader")
    thread.start()
    thread.join()
    unraisable, warning, crash = lines_of(directory)
    assert "Exception ignored in" in unraisable
    assert "UserWarning: old" in warning
    assert crash.endswith("ValueError: first ⏎ second")
    assert capfd.readouterr().err == ""
