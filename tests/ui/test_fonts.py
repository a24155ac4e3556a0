"""What the app's fonts lack is shown in one of kivy's or of the machine's that has it."""

from __future__ import annotations

import os
import shutil
import struct
import threading
from pathlib import Path

import pytest
from kivy import kivy_data_dir
from kivy.core.text import Label as CoreLabel
from kivymd import fonts_path
from kivymd.uix.label import MDLabel

from app.widgets import fonts
from app.widgets.fonts import Characters, Run, runs_of
from app.widgets.text import Body, Ico, line_width

ROBOTO, DEJAVU = (str(Path(kivy_data_dir, "fonts", name)) for name in ("Roboto-Regular.ttf", "DejaVuSans.ttf"))
ICONS = Path(fonts_path, "materialdesignicons-webfont.ttf")
ICON, UMBRELLA, NOWHERE = "\U000f01d9", "☂", "\U000e0fff"


@pytest.fixture
def machine(ui, tmp_path, monkeypatch):
    """A folder with all of the machine's own fonts."""

    def forget() -> None:
        for remembered in (fonts.fonts_at_hand, fonts.font_for, runs_of):
            remembered.cache_clear()

    monkeypatch.setattr(CoreLabel, "get_system_fonts_dir", staticmethod(lambda: [str(tmp_path)]))
    forget()
    yield tmp_path
    forget()


def collection(font: bytes) -> bytes:
    """A file of several fonts; this is the first."""
    head = b"ttcf" + struct.pack(">HHII", 1, 0, 1, 16)
    (count,) = struct.unpack_from(">4xH", font)
    moved = b"".join(
        struct.pack(">4sIII", tag, check, offset + len(head), length)
        for tag, check, offset, length in struct.iter_unpack(">4sIII", font[12 : 12 + 16 * count])
    )
    return head + font[:12] + moved + font[12 + 16 * count :]


# ---------------------------------------------------------------------- files
@pytest.mark.parametrize(
    ("path", "has", "lacks"),
    [
        (ROBOTO, "aÄжΩ–", UMBRELLA + "عא机"),
        (DEJAVU, "aÄж" + UMBRELLA + "عא", "机" + ICON),
        (str(ICONS), ICON, "机" + UMBRELLA),
    ],
)
def test_which_characters_a_font_has(path, has, lacks):
    found = Characters(path)
    assert [character for character in has + lacks if character in found] == list(has)


def test_the_first_of_several_fonts_in_a_file_counts(tmp_path):
    both = tmp_path / "both.ttc"
    both.write_bytes(collection(Path(DEJAVU).read_bytes()))
    assert UMBRELLA in Characters(str(both))


@pytest.mark.parametrize(
    "content", [b"", b"ttcf", b"no font at all, but long enough to be one", Path(DEJAVU).read_bytes()[:3000]]
)
def test_a_broken_font_has_no_characters(tmp_path, content):
    path = tmp_path / "broken.ttf"
    path.write_bytes(content)
    assert "a" not in Characters(str(path))


# ---------------------------------------------------------------------- texts
def test_only_what_is_missing_is_shown_in_another_font(machine):
    assert runs_of(f"Robot {UMBRELLA} 7", ROBOTO) == (Run("Robot ", ROBOTO), Run(UMBRELLA, DEJAVU), Run(" 7", ROBOTO))


def test_words_from_right_to_left_stay_together(machine):
    assert runs_of("Robot روبوت كبير 7", ROBOTO) == (
        Run("Robot ", ROBOTO),
        Run("روبوت كبير", DEJAVU, "Arab"),
        Run(" 7", ROBOTO),
    )


def test_a_font_of_the_machine_is_found_plain_ones_first(machine):
    for name in ("A-Bold.ttf", "Some.ttf"):
        shutil.copy(ICONS, machine / name)
    assert runs_of(ICON, ROBOTO) == (Run(ICON, str(machine / "Some.ttf")),)


def test_a_font_that_cannot_be_drawn_with_is_passed_over(machine):
    broken = machine / "Broken.ttf"
    broken.write_bytes(ICONS.read_bytes().replace(b"head", b"dead", 1))  # one of its tables is missing
    assert ICON in Characters(str(broken))
    assert runs_of(ICON, ROBOTO) == (Run(ICON, ROBOTO),)


def test_characters_that_no_font_has_stay_unchanged(machine):
    assert runs_of(f"a{NOWHERE}机", ROBOTO) == (Run(f"a{NOWHERE}机", ROBOTO),)


def test_for_usual_texts_no_font_is_looked_for(machine):
    for text in ("Deliver kits", "Jätteet – halliin Ä, 5 °C", "Привет"):
        Body(text=text).texture_update()
    assert fonts.fonts_at_hand.cache_info().misses == 0


# ---------------------------------------------------------------------- on screen
def test_a_text_is_as_wide_as_its_parts_in_their_fonts(machine):
    parts = line_width("Robot ", "Roboto", 40) + line_width(UMBRELLA, DEJAVU, 40) + line_width(" 7", "Roboto", 40)
    assert line_width(f"Robot {UMBRELLA} 7", "Roboto", 40) == parts
    assert line_width(UMBRELLA, "Roboto", 40) == line_width(UMBRELLA, DEJAVU, 40) != line_width(NOWHERE, "Roboto", 40)


def test_a_label_has_room_for_the_higher_font(machine, ui):
    plain, other = Body(text="Robot 7", fit=True), Body(text=f"Robot {UMBRELLA} 7", fit=True)
    for label in (plain, other):
        label.texture_update()
    assert (other.width, other.height) > (plain.width, plain.height)


def test_a_font_that_is_a_pipe_delays_nothing(machine):
    """Opening it would block until something writes into it."""
    os.mkfifo(machine / "Pipe.ttf")
    (machine / "Link.ttf").symlink_to(machine / "Pipe.ttf")
    (machine / "Folder.ttf").mkdir()
    (machine / "Nowhere.ttf").symlink_to(machine / "gone")
    found: list[object] = []
    searching = threading.Thread(
        target=lambda: found.extend([runs_of("Robot 机", ROBOTO), fonts.fonts_at_hand()]), daemon=True
    )
    searching.start()
    searching.join(20)
    assert found == [(Run("Robot 机", ROBOTO),), (DEJAVU,)]
    Body(text="Robot 机").texture_update()


@pytest.mark.parametrize("asked", ["normal", "mono", None])
def test_every_font_is_opened_with_one_hinting_as_kivy_keeps_it_for_all(ui, asked):
    assert CoreLabel(font_name="Roboto", font_size=17.25, font_hinting=asked).options["font_hinting"] == fonts.HINTING
    for label in (MDLabel(text="Deliver"), Body(text="Deliver"), Ico(icon="star")):
        assert label._label.options["font_hinting"] == fonts.HINTING
