"""The size of the display, before kivy makes a window on it."""

from __future__ import annotations

import contextlib
import ctypes
import ctypes.util
import importlib
import importlib.util
from pathlib import Path

_VIDEO = 0x20  # SDL_INIT_VIDEO


def display_size(usable: bool = False) -> tuple[int, int] | None:
    """Width and height of the first display in pixels, as SDL sees it; None if SDL can't be asked. ``usable``: without
    the desktop's own bars.

    A kiosk's compositor shows a full-screen window in the display's size without telling kivy, which would keep drawing
    in the window's first size.
    """
    library = _sdl()
    if library is None:
        return None
    try:
        sdl = ctypes.CDLL(library)
        if sdl.SDL_InitSubSystem(_VIDEO) != 0:
            return None
        try:
            bounds = (ctypes.c_int * 4)()  # x, y, width, height
            ask = sdl.SDL_GetDisplayUsableBounds if usable else sdl.SDL_GetDisplayBounds
            return (bounds[2], bounds[3]) if ask(0, bounds) == 0 else None
        finally:
            sdl.SDL_QuitSubSystem(_VIDEO)
    except (OSError, AttributeError):
        return None


def _sdl() -> str | None:
    """The library that kivy uses: the one in its wheel, or on Windows in that of kivy-deps.sdl2, else the system's."""
    kivy = importlib.util.find_spec("kivy")
    bundled = [Path(kivy.origin).parents[1] / "Kivy.libs"] if kivy is not None and kivy.origin is not None else []
    with contextlib.suppress(ImportError):
        bundled += map(Path, importlib.import_module("kivy_deps.sdl2").dep_bins)
    found = [
        file
        for directory in bundled
        for name in ("libSDL2-2*.so*", "SDL2.dll")
        for file in sorted(directory.glob(name))
    ]
    return str(found[0]) if found else ctypes.util.find_library("SDL2-2.0")
