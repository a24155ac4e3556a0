"""docs/screens shows what ``python -m tests.screenshots docs/screens --documented`` takes: nothing more, nothing less, each of them."""

from __future__ import annotations

import re
from pathlib import Path

from tests.screenshots.registry import documented

SCREENS = Path(__file__).parents[2] / "docs" / "screens"


def test_every_picture_there_is_one_that_is_taken():
    assert {path.name for path in SCREENS.glob("*.png")} == documented()


def test_the_page_shows_each_of_them_with_words():
    shown = re.findall(r"!\[([^\]]*)\]\(([^)]*)\)", (SCREENS / "README.md").read_text("utf-8"))
    assert {path for _words, path in shown} == documented()
    assert all(words for words, _path in shown)
