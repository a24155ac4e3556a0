"""Installed without the extra ``ui``, it says how to get the window and that it works without."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from app.failures import Failure
from app.window.window import configure


@pytest.mark.parametrize("kiosk", [False, True])
def test_a_window_without_the_extra_is_refused_in_one_sentence(
    kiosk: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(os, "environ", {**os.environ, "XDG_CACHE_HOME": str(tmp_path)})
    monkeypatch.setitem(sys.modules, "kivy.config", None)  # as if it were not installed
    with pytest.raises(Failure, match=r"pip install .amr-scheduler\[ui\]. adds it; --headless works without"):
        configure(kiosk)
