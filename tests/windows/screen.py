"""A display in memory, and the picture on it."""

from __future__ import annotations

import os
import struct
import subprocess
from pathlib import Path

from PIL import Image


class Screen:
    """Of X, in px. Its memory is a file in the format of xwd."""

    def __init__(self, size: tuple[int, int], directory: Path) -> None:
        directory.mkdir()
        self._memory = directory / "Xvfb_screen0"
        reader, writer = os.pipe()
        self._process = subprocess.Popen(
            ["Xvfb", "-displayfd", str(writer), "-screen", "0", "{}x{}x24".format(*size), "-fbdir", str(directory)],
            pass_fds=[writer],
            stderr=subprocess.DEVNULL,
        )
        os.close(writer)
        with os.fdopen(reader) as file:
            self.name = f":{file.readline().strip()}"  # "" after a failed start

    def picture(self) -> Image.Image:
        content = self._memory.read_bytes()
        head = struct.unpack(">25L", content[:100])
        width, height, per_line, colours = head[4], head[5], head[12], head[19]
        pixels = content[head[0] + 12 * colours :]
        return Image.frombuffer("RGB", (width, height), pixels, "raw", "BGRX", per_line, 1)

    def close(self) -> None:
        self._process.terminate()
        self._process.wait(10)
