"""The tablet's clocks."""

from __future__ import annotations

import ctypes
import runpy
from types import SimpleNamespace

import pytest

from app.domain import clock


def test_on_windows_the_time_that_it_slept_is_not_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    def ask(pointer: object) -> None:
        pointer._obj.value = 125_000_000  # type: ignore[attr-defined]

    kernel = SimpleNamespace(QueryUnbiasedInterruptTime=ask)
    monkeypatch.setattr("sys.platform", "win32")
    monkeypatch.setattr(ctypes, "windll", SimpleNamespace(kernel32=kernel), raising=False)
    assert runpy.run_path(str(clock.__file__))["SystemClock"]().monotonic() == 12.5
