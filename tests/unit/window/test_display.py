"""Where SDL is looked for."""

from __future__ import annotations

import sys
from types import ModuleType

from app.window import display


def test_on_windows_it_is_in_the_wheel_of_kivy_deps(tmp_path, monkeypatch):
    package, sdl2 = ModuleType("kivy_deps"), ModuleType("kivy_deps.sdl2")
    sdl2.dep_bins = [str(tmp_path / "none"), str(tmp_path)]
    (tmp_path / "SDL2.dll").touch()
    monkeypatch.setitem(sys.modules, "kivy_deps", package)
    monkeypatch.setitem(sys.modules, "kivy_deps.sdl2", sdl2)
    monkeypatch.setattr(display.importlib.util, "find_spec", lambda _name: None)
    assert display._sdl() == str(tmp_path / "SDL2.dll")


def test_without_any_there_is_no_size(monkeypatch):
    monkeypatch.setattr(display, "_sdl", lambda: None)
    assert display.display_size() is None
    monkeypatch.setattr(display, "_sdl", lambda: "libno-such-sdl.so")
    assert display.display_size() is None
