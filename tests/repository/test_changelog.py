"""The changelog is for users: what they notice, in a page that they read."""

from __future__ import annotations

import re
from pathlib import Path

CHANGELOG = (Path(__file__).parents[2] / "CHANGELOG.md").read_text(encoding="utf-8")


def test_a_release_has_forty_lines_at_most() -> None:
    _head, *releases = re.split(r"^## (?=\d)", CHANGELOG, flags=re.MULTILINE)
    assert releases
    for release in releases:
        entries = [line for line in release.splitlines()[1:] if line and not line.startswith("### ")]
        assert len(entries) <= 40, release.splitlines()[0]
        assert all(line.startswith("- ") and len(line) <= 180 for line in entries), release.splitlines()[0]
