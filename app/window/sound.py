"""The sound of an alarm, made here: two falling tones, twice."""

from __future__ import annotations

import atexit
import logging
import math
import os
import tempfile
import wave
from array import array
from functools import cached_property
from typing import Any

log = logging.getLogger(__name__)
RATE = 22050  # samples per second
TONES = ((880.0, 0.18), (660.0, 0.24), (0.0, 0.12), (880.0, 0.18), (660.0, 0.24))  # Hz (0: silence), s
FADE = 0.01  # s at both ends of a tone, which would click without
LOUDNESS = 0.6  # of what is possible; the tablet's own volume does the rest


def samples() -> array[int]:
    """16 bits each, one channel."""
    found = array("h")
    for pitch, seconds in TONES:
        count = int(RATE * seconds)
        found.extend(
            int(
                32767
                * LOUDNESS
                * math.sin(2 * math.pi * pitch * n / RATE)
                * min(1.0, n / RATE / FADE, (count - n) / RATE / FADE)
            )
            for n in range(count)
        )
    return found


class Loudspeaker:
    """Opened when it is first asked for."""

    @property
    def exists(self) -> bool:
        """Whether this tablet can make a sound."""
        return self._sound is not None

    def play(self) -> None:
        """Without waiting for its end; does nothing without a sound system."""
        try:
            if self._sound is not None:
                self._sound.play()
        except Exception as problem:  # as below
            log.warning("There is no sound: %s", problem)

    @cached_property
    def _sound(self) -> Any:
        from kivy.core.audio import SoundLoader

        try:
            file, path = tempfile.mkstemp(".wav", "amr-alarm-")
            atexit.register(os.unlink, path)
            with os.fdopen(file, "wb") as raw, wave.open(raw, "wb") as wav:
                wav.setparams((1, 2, RATE, 0, "NONE", ""))
                wav.writeframes(samples().tobytes())
            found = SoundLoader.load(path)
            return found if found is not None and found.length > 0 else None  # 0: no device to play it on
        except Exception as problem:  # any error of the tablet's sound system: alarms are still shown
            log.warning("There is no sound: %s", problem)
            return None
