"""A kivy window that needs no X server, no libGL and no system package.

``install()`` runs before anything imports kivy.core.window. It uses kivy's "mock" GL backend, whose calls do nothing, and a WindowBase that
never touches SDL's video. What it changes in the environment is put back, so that child processes of other tests see none of it; what
kivy would do to the root logger and to the home directory is kept off.
"""

from __future__ import annotations

import atexit
import logging
import os
import shutil
import sys
import tempfile

COMMON = {
    "KIVY_NO_ARGS": "1",
    "KIVY_NO_CONFIG": "1",
    "KIVY_NO_ENV_CONFIG": "1",
    "KIVY_NO_FILELOG": "1",
    "KIVY_NO_CONSOLELOG": "1",
    "KIVY_LOG_MODE": "PYTHON",
    "KIVY_CLIPBOARD": "dummy",
    "KIVY_METRICS_DENSITY": "1",
    "KIVY_METRICS_FONTSCALE": "1",
    "KIVY_DPI": "96",
}
MOCK = {"KIVY_GL_BACKEND": "mock", "KIVY_WINDOW": ""}
OFFSCREEN = {"SDL_VIDEODRIVER": "offscreen"}
LANE = os.environ.get("UI_LANE", "mock")  # or offscreen: real GL without a display


class _MockNoise(logging.Filter):
    """A mock GL compiles no shaders; that kivy says so is expected."""

    def filter(self, record: logging.LogRecord) -> bool:
        return not record.getMessage().startswith(("Shader", "GL", "OpenGL"))


def install(width: int = 1280, height: int = 800):
    """Make the one window of this process and return it; a second call returns the same."""
    if "kivy.core.window" in sys.modules:
        from kivy.core.window import Window

        return Window
    before = dict(os.environ)
    home = tempfile.mkdtemp(prefix="kivy-home-")
    atexit.register(shutil.rmtree, home, ignore_errors=True)
    os.environ.update(COMMON, KIVY_HOME=home, **(MOCK if LANE == "mock" else OFFSCREEN))
    try:
        return _install(width, height)
    finally:
        os.environ.clear()
        os.environ.update(before)


def _install(width: int, height: int):
    logging.getLogger("kivy").addHandler(logging.NullHandler())  # missing clipboards of this machine are not logged
    from kivy.config import Config

    Config.set("graphics", "width", str(width))
    Config.set("graphics", "height", str(height))
    Config.set("graphics", "multisamples", "0")
    Config.set("kivy", "exit_on_escape", "0")
    for name, _value in Config.items("input"):
        Config.remove_option("input", name)

    import kivy.core.window as core_window

    if LANE == "mock":
        from kivy.logger import Logger

        Logger.addFilter(_MockNoise())
        core_window.Window = _headless(core_window.WindowBase)()
    _read_environment()
    return core_window.Window


def _read_environment() -> None:
    """Make kivy read, while they are set, what it would otherwise ask the environment for later."""
    import kivy.core.clipboard
    import kivy.core.text  # noqa: F401
    from kivy.metrics import Metrics

    assert (Metrics.dpi, Metrics.density, Metrics.fontscale) == (96, 1, 1)


def _headless(base: type) -> type:
    class HeadlessWindow(base):
        def create_window(self, *args):
            self._density = 1.0
            self.dpi = 96.0
            super().create_window(*args)

        def set_title(self, title): ...
        def set_icon(self, filename): ...
        def close(self): ...
        def mainloop(self): ...
        def _set_cursor_state(self, value): ...
        def _set_window_pos(self, x, y): ...

        def screenshot(self, *args, **kwargs):
            return None

        def set_system_cursor(self, cursor_name):
            return True

        def _get_window_pos(self):
            return 0, 0

    return HeadlessWindow
