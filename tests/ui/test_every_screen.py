"""Every widget of every screen and dialog keeps the numbers of the house: targets, gaps, contrast, text inside its box,
nothing that overlaps, icons that exist, texts from the catalogues.

Checks the four screens in all sizes and every other picture in one, with languages, themes and text sizes in turn; the default run has
Home where it is hardest, in a narrow window with large texts below an alarm.
Every picture in every size, language, theme and size of text: ``python -m tests.ui.walk``.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from kivymd.icon_definitions import md_icons

from tests.support.examples import first_of_each
from tests.ui import checks
from tests.ui.walk import SCREENS, covering_ways

ROOT = Path(__file__).parents[2]
ICON = re.compile(r"""\bicon["']?\s*[:=]\s*"([a-z0-9-]+)\"""")
GUID = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")
PARTS = 12
NAMES = {"Python", "SQLite", "Kivy", "KivyMD"}  # the same in every language


@pytest.mark.parametrize(
    ("name", "ways"),
    first_of_each({"home, hardest": ("home", slice(-1, None)), **{name: (name, slice(None)) for name in SCREENS}}),
)
def test_every_widget_keeps_its_place_its_size_and_its_language(ui, walk, name, ways):
    number, picture = next((n, picture) for n, picture in enumerate(walk.pictures) if picture.name == name)
    found = [f"{way}: {problem}" for way, problem in walk.look(picture, covering_ways(number, name)[ways])]
    assert not found, "\n".join(["", *found])


@pytest.mark.long
@pytest.mark.parametrize("part", range(PARTS))
def test_every_state_and_dialog_keeps_the_rules(ui, walk, part):
    pictures = [(number, picture) for number, picture in enumerate(walk.pictures) if picture.name not in SCREENS][
        part::PARTS
    ]
    assert len(pictures) > 5
    found = [
        f"{picture.name} {way}: {problem}"
        for number, picture in pictures
        for way, problem in walk.look(picture, covering_ways(number, picture.name))
    ]
    assert not found, "\n".join(["", *found])


def test_every_pair_of_colours_has_its_contrast():
    assert checks.contrast_problems() == []


def test_every_icon_that_is_named_exists():
    named = {
        name: path.name
        for folder, kind in (("app", "*.py"), ("kv", "*.kv"))
        for path in sorted((ROOT / folder).rglob(kind))
        for name in ICON.findall(path.read_text(encoding="utf-8"))
    }
    assert len(named) > 50
    assert {name: path for name, path in named.items() if name not in md_icons} == {}


def test_no_text_of_a_layout_is_outside_the_catalogues():
    """Letters between quotes in kv are values of options, names of classes and icons, or arguments, as of ``tr``."""
    shown = re.compile(
        r"^\s*(?:text|title|label|hint|help|note|action|message|value|unit|empty_text|problem|confirm|decline)\s*:\s*(.*)$"
    )
    found = []
    for path in sorted((ROOT / "kv").rglob("*.kv")):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            match = shown.match(line)
            if match is None:
                continue
            rest = re.sub(r"""\.\w+\((?:[^()]|\([^()]*\))*\)|== "\w*\"""", "", match[1])
            literals = [
                text
                for text in re.findall(r'"([^"]*)"', rest)
                if re.search(r"[A-Za-zÄÖäö]{2,}", text) and text not in NAMES
            ]
            found += [f"{path.name}:{number}: {text!r}" for text in literals if not GUID.fullmatch(text)]
    assert found == []
