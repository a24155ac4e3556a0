"""The sound of an alarm, and tablets that have none."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from app.window.sound import RATE, TONES, samples


def test_the_sound_is_short_and_neither_clicks_nor_is_cut_off():
    found = samples()
    assert 0.5 < len(found) / RATE < 1.5
    assert max(found) > 15000
    start = 0
    for _pitch, seconds in TONES:
        end = start + int(RATE * seconds)
        assert abs(found[start]) < 500
        assert abs(found[end - 1]) < 500
        start = end


@pytest.mark.parametrize(("driver", "exists"), [("dummy", True), ("nothing", False)])
def test_whether_there_is_a_loudspeaker_is_found_out_and_silence_is_not_an_error(tmp_path, driver, exists):
    """In its own process: SDL opens the sound once."""
    code = "from app.window.sound import Loudspeaker; l = Loudspeaker(); l.play(); print(l.exists)"
    environment = {
        **os.environ,
        "SDL_AUDIODRIVER": driver,
        "KIVY_NO_ARGS": "1",
        "KIVY_NO_CONSOLELOG": "1",
        "KIVY_HOME": str(tmp_path),
    }
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.split() == [str(exists)]
