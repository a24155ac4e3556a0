"""How much processor time each file of tests takes: ``uv run pytest --write-budget`` notes it in tests/budget.json.

With some files only, their figures change, and those of files that no longer exist leave. Counted are the tests of the default run and the
processes that they start; processor time depends less than wall time on what else the machine does.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Generator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PATH = ROOT / "tests" / "budget.json"
LIMIT = 148.0  # s, of all files together; it only goes down, and at 196 the default run takes 2.5 minutes on two cores


def read() -> dict[str, float]:
    """Seconds by file, as "tests/unit/test_connector.py"."""
    found: dict[str, float] = json.loads(PATH.read_text(encoding="utf-8"))
    return found


def test_files() -> set[str]:
    """All there are, as ``read`` names them."""
    return {path.relative_to(ROOT).as_posix() for path in (ROOT / "tests").rglob("test_*.py")}


class Recorder:
    """A plugin of pytest, in the process that runs tests and in the one that collects results."""

    def __init__(self) -> None:
        self._before = 0.0
        self._spent: Counter[str] = Counter()

    def pytest_collection_finish(self) -> None:
        self._before = _used()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        now = _used()
        report.processor_s = now - self._before  # travels with the report
        self._before = now
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._spent[report.nodeid.partition("::")[0]] += report.processor_s

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if hasattr(session.config, "workerinput"):
            return
        known = {**read(), **self._spent}
        kept = {name: round(known.get(name, 0.0), 2) for name in sorted(test_files())}
        PATH.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


def _used() -> float:
    """Processor time so far, in s, of this process and of those that it waited for."""
    return sum(os.times()[:4])
