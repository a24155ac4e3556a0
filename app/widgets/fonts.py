"""Fonts of the machine for characters that the app's own lack, such as Chinese or Arabic names, which would be empty
boxes. Every text in labels, fields and charts is split into parts of one font each. ASCII texts, nearly all, cost
nothing; fonts are only searched when a missing character is met. If no font of the machine has it, the box stays.
"""

import os
import struct
import unicodedata
from bisect import bisect_right
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import TypeVar

from kivy import kivy_data_dir
from kivy.core.text import Label as CoreLabel

KINDS = (".ttf", ".otf", ".ttc")
SPECIAL = (
    "bold",
    "italic",
    "oblique",
    "mono",
    "serif",
    "condensed",
    "light",
    "thin",
    "black",
    "medium",
)  # looked into last
MOST_FONTS = 400  # of the machine that are looked into
DRAWN = (b"glyf", b"CFF ", b"CFF2")  # tables of outlines; colour pictures come in one size only
RIGHT_TO_LEFT = {"ARABIC": "Arab", "HEBREW": "Hebr"}  # ISO 15924 codes, by the first word of their characters' names
JOINING = (
    "Cc",
    "Cf",
    "Mn",
    "Zs",
    "Zl",
    "Zp",
)  # categories of characters that need no font of their own: spaces, accents

HINTING = "light"  # heights fit pixels, widths are as drawn by the font's makers

T = TypeVar("T")


class Characters:
    """Characters with glyphs in a font file; none if it can't be read or has no outlines."""

    def __init__(self, path: str) -> None:
        try:
            with open(path, "rb") as file:
                self._first, self._last = zip(*sorted(_ranges(file)), strict=True)
        except (OSError, ValueError, struct.error):
            self._first, self._last = (), ()

    def __contains__(self, character: str) -> bool:
        place = bisect_right(self._first, ord(character)) - 1
        return place >= 0 and ord(character) <= self._last[place]


def _ranges(file) -> Iterator[tuple[int, int]]:
    """First and last code point of each range, from the best character map of the font, or of the first one in a collection."""
    start = struct.unpack(">12xI", file.read(16))[0] if file.read(4) == b"ttcf" and not file.seek(0) else 0
    file.seek(start)
    (count,) = struct.unpack(">4xH6x", file.read(12))
    tables = {tag: (offset, length) for tag, offset, length in struct.iter_unpack(">4s4xII", file.read(16 * count))}
    if tables.keys().isdisjoint(DRAWN) or b"cmap" not in tables:
        return
    file.seek(tables[b"cmap"][0])
    data = file.read(tables[b"cmap"][1])
    maps = {
        struct.unpack_from(">H", data, offset)[0]: offset
        for platform, _encoding, offset in struct.iter_unpack(
            ">HHI", data[4 : 4 + 8 * struct.unpack_from(">2xH", data)[0]]
        )
        if platform in (0, 3)
    }
    if 12 in maps:
        (groups,) = struct.unpack_from(">12xI", data, maps[12])
        yield from (
            (first, last)
            for first, last, _glyph in struct.iter_unpack(">III", data[maps[12] + 16 : maps[12] + 16 + 12 * groups])
        )
    elif 4 in maps:
        segments = struct.unpack_from(">6xH", data, maps[4])[0] // 2
        last = struct.unpack_from(f">14x{segments}H", data, maps[4])
        first = struct.unpack_from(f">{16 + 2 * segments}x{segments}H", data, maps[4])
        yield from zip(first, last, strict=True)


characters_of = cache(Characters)  # by path


@dataclass(frozen=True)
class Run:
    """A part of a text in one font; ``script`` of one that is written from right to left."""

    text: str
    font: str  # path
    script: str = ""


@lru_cache(maxsize=1024)
def runs_of(text: str, font: str) -> tuple[Run, ...]:
    """The parts of ``text``; characters that the font at the path ``font`` has, or that no font has, stay in it."""
    parts: list[tuple[str, str]] = []
    for character in text:
        joins = unicodedata.category(character) in JOINING
        words, before = parts.pop() if parts else ("", font)
        needed = before if joins else font_for(character, font)
        if needed == before:
            parts.append((words + character, before))
        else:
            kept = (
                words if before == font else words.rstrip(" ")
            )  # a space at the end of right-to-left text comes after it
            parts += [(kept, before), (words[len(kept) :] + character, needed)]
    return tuple(Run(part, found, _script_of(part) if found != font else "") for part, found in parts if part)


@lru_cache(maxsize=20_000)
def font_for(character: str, font: str) -> str:
    if character.isascii() or character in characters_of(font):
        return font
    return next((path for path in fonts_at_hand() if character in characters_of(path) and _opens(path)), font)


@cache
def _opens(path: str) -> bool:
    """Whether SDL can draw with it; else each text in it would raise."""
    try:
        CoreLabel(text="a", font_name=path).refresh()
    except (OSError, ValueError):
        return False
    return True


def _script_of(text: str) -> str:
    names = (unicodedata.name(character, "").partition(" ")[0] for character in text)
    return next((RIGHT_TO_LEFT[name] for name in names if name in RIGHT_TO_LEFT), "")


@cache
def fonts_at_hand() -> tuple[str, ...]:
    """Files of fonts, kivy's own first, then the machine's, plain ones before bold and italic ones."""
    found = [
        Path(folder, name)
        for place in CoreLabel.get_system_fonts_dir()
        for folder, _folders, names in os.walk(place)
        for name in names
        if name.lower().endswith(KINDS) and os.path.isfile(os.path.join(folder, name))
    ]
    found.sort(key=lambda path: (sum(word in path.stem.lower() for word in SPECIAL), path.name))
    return str(Path(kivy_data_dir, "fonts", "DejaVuSans.ttf")), *map(str, found[:MOST_FONTS])


# ---------------------------------------------------------------------- in kivy
def apply() -> None:
    """Let kivy measure and draw every text run by run, all on one baseline, and open each font with one hinting:
    otherwise its first user would decide its widths for all. A second call changes nothing."""
    measure, draw, begin = CoreLabel.get_extents, CoreLabel._render_text, CoreLabel.__init__
    if measure.__module__ == __name__:
        return

    def __init__(self, *args, **options) -> None:
        begin(self, *args, **options | {"font_hinting": HINTING})

    def get_extents(self, text: str) -> tuple[int, int]:
        if text.isascii():
            return measure(self, text)
        sizes = [_in(run, self, measure, run.text) for run in runs_of(text, self.options["font_name_r"])]
        return sum(width for width, _height in sizes), max((height for _width, height in sizes), default=0)

    def render_text(self, text: str, x: float, y: float) -> None:
        if text.isascii():
            draw(self, text, x, y)
            return
        runs = runs_of(text, self.options["font_name_r"])
        ascents = [_in(run, self, CoreLabel.get_ascent) for run in runs]
        for run, ascent in zip(runs, ascents, strict=True):
            _in(run, self, draw, run.text, x, y + max(ascents) - ascent)
            x += _in(run, self, measure, run.text)[0]

    CoreLabel.__init__, CoreLabel.get_extents, CoreLabel._render_text = __init__, get_extents, render_text


def _in(run: Run, label: CoreLabel, call: Callable[..., T], *arguments: object) -> T:
    """``call(label, *arguments)`` while ``label`` has the font and direction of ``run``."""
    options = label.options
    label.options = options | {"font_name_r": run.font}
    if run.script:
        label.options |= {"font_direction": "rtl", "font_script_name": run.script}
    try:
        return call(label, *arguments)
    finally:
        label.options = options
