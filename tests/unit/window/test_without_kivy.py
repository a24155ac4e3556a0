"""Installed without the extra ``ui``, it says how to get the window and that it works without."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from app.failures import Failure
from app.window.window import configure


@pytest.mark.parametrize("missing", ["kivy", "kivymd"])
def test_a_window_without_the_extra_is_refused_in_one_sentence(
    missing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(os, "environ", {**os.environ, "XDG_CACHE_HOME": str(tmp_path)})
    monkeypatch.setattr("app.window.window.find_spec", lambda name: None if name == missing else name)
    with pytest.raises(
        Failure, match=rf"\({missing} is missing\): pip install .amr-scheduler\[ui\]. adds it; --headless works without"
    ):
        configure(False)
