"""A stick or a folder with odd things in it: what can be chosen is offered, and reading it delays no one."""

from __future__ import annotations

import os

import pytest

from app.services.files import places
from app.services.files.places import found_in
from app.window.sound import Loudspeaker


def test_a_name_in_no_known_encoding_is_omitted(tmp_path):
    (tmp_path / "good.json").write_text("{}")
    with open(os.fsencode(tmp_path) + b"/caf\xe9.json", "w"):
        pass
    assert [file.path.name for file in found_in(tmp_path, ".json")] == ["good.json"]


@pytest.mark.parametrize("day", [10**12, -(10**12)])
def test_a_day_that_no_calendar_has_hides_that_file_alone(tmp_path, day):
    (tmp_path / "good.json").write_text("{}")
    odd = tmp_path / "odd.json"
    odd.write_text("{}")
    try:
        os.utime(odd, (day, day))
    except OSError:
        odd.unlink()  # this file system has no such days either
    assert "good.json" in [file.path.name for file in found_in(tmp_path, ".json")]


def test_hidden_files_take_no_room_of_those_that_are_seen(tmp_path, monkeypatch):
    monkeypatch.setattr(places, "MOST_SEEN", 3)
    for name in ("good.json", "better.json", "._good.json", "._better.json", ".a.json", ".b.json"):
        (tmp_path / name).write_text("{}")
    (tmp_path / ".trash").mkdir()
    (tmp_path / ".trash" / "gone.json").write_text("{}")
    assert {file.path.name for file in found_in(tmp_path, ".json")} == {"good.json", "better.json"}


def test_a_sound_system_that_fails_ends_nothing():
    class Broken:
        def play(self) -> None:
            raise RuntimeError("device gone")

    speaker = Loudspeaker()
    speaker.__dict__["_sound"] = Broken()  # as if it had been opened
    speaker.play()
