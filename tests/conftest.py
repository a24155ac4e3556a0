"""Of all tests: how many run at once, and how many examples hypothesis tries."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Generator
from pathlib import Path

# pytest compiles the assertions of every test module, and all of hypothesis, again in every process, if it may not keep what it compiled:
# seconds each time. The variable would forbid it to the processes that are started from here.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# Apps of tests begin in this zone, not in the machine's own.
os.environ["TZ"] = "Etc/UTC"

gc.disable()  # until all is collected

import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

from app.database import connection  # noqa: E402
from tests import budget  # noqa: E402
from tests.support import targets  # noqa: E402
from tests.support.new_database import migrate  # noqa: E402
from tests.support.targets import TARGETS  # noqa: E402

# No example is too slow, even on a busy machine. `.ci/night` uses the profile "thorough", with examples that are new each time.
settings.register_profile("quick", deadline=None, max_examples=12, derandomize=True)
settings.register_profile("thorough", deadline=None, max_examples=100)
settings.load_profile("quick")

# Thousands of small databases: in memory nothing waits for a disk.
if os.access("/dev/shm", os.W_OK):
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", "/dev/shm")

# Thousands of databases begin empty, and four fifths of the time to open one are the migrations that each goes through.
connection.migrate = migrate


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--target", choices=TARGETS, default=TARGETS[0], help="what takes the missions of simulated sites")
    parser.addoption("--write-budget", action="store_true", help="note in tests/budget.json how long each file takes")


def pytest_configure(config: pytest.Config) -> None:
    """A file that is named is run with its long tests, unless ``-m`` says otherwise or the default run is measured."""
    targets.chosen = config.option.target
    files = all(Path(argument.partition("::")[0]).is_file() for argument in config.args)
    if config.option.write_budget:
        config.pluginmanager.register(budget.Recorder())
    elif files and "-m" not in config.invocation_params.args:
        config.option.markexpr = ""


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Some tests can't be about a fleet."""
    marks = {item: item.get_closest_marker("only_for") for item in items}
    left_out = [item for item, mark in marks.items() if mark is not None and targets.chosen not in mark.args]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int | None:
    """The tests of one file run in this process: they answer sooner, and a debugger works. Others have one process per core, and all of
    them one more, as those of threads, processes and windows wait; each takes ten seconds of a core before its first test."""
    files = {argument.partition("::")[0] for argument in config.args}
    if files == {"tests"}:
        return (os.cpu_count() or 1) + 1
    return 0 if len(files) == 1 and Path(*files).is_file() else None


def pytest_collection_finish() -> None:
    """What was imported and collected stays to the end: to search it for garbage again and again is a tenth of the time of quick tests,
    and a fifth of the time to collect them."""
    gc.enable()
    gc.freeze()
    gc.set_threshold(50_000, 20, 10)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """What a test logged travels to another process, and a lone surrogate, which robots may say, would end the whole run."""
    report = yield
    report.sections = [(title, text.encode(errors="backslashreplace").decode()) for title, text in report.sections]
    return report
