"""The process that takes pictures: one window size, real GL without a display, virtual time."""

from __future__ import annotations

import atexit
import gc
import logging
import os
import shutil
import sys
import tempfile
import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from tests.screenshots.registry import Picture, Size


def open_window(size: Size) -> None:
    """Make kivy's window ``size`` large; before anything else imports kivy."""
    home = tempfile.mkdtemp(prefix="kivy-home-")
    atexit.register(shutil.rmtree, home, ignore_errors=True)
    os.environ.update(
        KIVY_NO_ARGS="1",
        KIVY_NO_FILELOG="1",
        KIVY_NO_CONFIG="1",
        KIVY_NO_CONSOLELOG="1",
        KIVY_LOG_MODE="PYTHON",
        KIVY_CLIPBOARD="dummy",
        KIVY_METRICS_DENSITY=str(size.density),
        KIVY_METRICS_FONTSCALE=str(size.font_scale),
        KIVY_DPI=str(96 * size.density),
        KIVY_HOME=home,
    )
    os.environ.setdefault("SDL_VIDEODRIVER", "offscreen")
    quiet = logging.getLogger("kivy")  # missing input devices and clipboards of this machine are not logged
    quiet.addHandler(logging.NullHandler())
    quiet.propagate = False
    from kivy.config import Config

    Config.set("graphics", "width", str(size.width))
    Config.set("graphics", "height", str(size.height))
    Config.set("graphics", "multisamples", "0")  # as in the app
    for name, _value in Config.items("input"):
        Config.remove_option("input", name)
    from kivy.core.window import Window

    if Window is None:
        sys.exit("no window: real GL without a display needs the packages libgl1 libegl1 libgl1-mesa-dri")


class Studio:
    """What a picture is built with."""

    def __init__(self, size: Size, language: str = "en") -> None:
        from kivymd.app import MDApp

        import app.widgets
        from app.i18n import translator
        from app.screens.common.overlays import Dialogs
        from tests.ui.driver import Driver

        app.widgets.load()
        self.language = language
        translator.use(language)
        self.size = size
        self.theme = "light"
        self.app = type("Studio", (MDApp,), {})()
        self.app._run_prepare()
        self.driver = Driver(self.app)
        self.dialogs = Dialogs()
        self.shown: Any = None
        self._after = ExitStack()

    def show(self, widget: Any) -> Any:
        """Put ``widget`` into the empty window."""
        self.shown = self.driver.show(widget)
        return widget

    def use(self, theme: str) -> None:
        from kivy.core.window import Window

        from app.widgets.tokens import apply_theme, tk

        self.theme = theme
        apply_theme(self.app.theme_cls, theme, gloves=self.size.gloves)
        Window.clearcolor = tk.bg

    def afterwards(self, close: Callable[[], object]) -> None:
        """Called when the picture is taken."""
        self._after.callback(close)

    def directory(self) -> Path:
        """For what a picture needs on a disk; goes with it."""
        made = tempfile.TemporaryDirectory(prefix="amr-pictures-")
        self.afterwards(made.cleanup)
        return Path(made.name)

    def clear(self) -> None:
        """Close dialogs and services, empty the window."""
        from kivy.core.window import Window

        self.dialogs.close_all()
        self.dialogs.sheets.give_up()
        self.dialogs.sheets.frame_place = None
        self._after.close()
        for child in list(Window.children):
            Window.remove_widget(child)
        self.shown = None

    def take(self, path: Path) -> None:
        """Write what is in the window now."""
        from kivy.core.window import Window

        os.replace(Window.screenshot(name=str(path)), path)


def take_pictures(out: Path, size: Size, names: Sequence[str], themes: Sequence[str], language: str = "en") -> int:
    """Take all pictures of ``size`` (``names`` empty = all), print what the checks find; returns how many failed one."""
    open_window(size)
    from tests.screenshots.registry import PICTURES, find_pictures

    studio = Studio(size, language)
    broken = find_pictures()
    for problem in broken:
        traceback.print_exception(problem)
    failed = len(broken)
    gc.disable()  # each picture collects its own
    gc.freeze()
    for item in PICTURES.values():
        if size in item.sizes and (not names or item.name in names):
            failed += not _take_in_themes(studio, item, out, [theme for theme in themes if theme in item.themes])
    return failed


def _take_in_themes(studio: Studio, item: Picture, out: Path, themes: Sequence[str]) -> bool:
    """Build ``item`` once and switch its theme live, as the app does; False when that raised, or a check found something."""
    from tests.screenshots.registry import file_name
    from tests.ui import checks

    label = f"{item.name}-{studio.size.name}"
    widget, is_well = None, True
    try:
        for n, theme in enumerate(themes):
            studio.use(theme)
            if n == 0:
                widget = item.build(studio)
            studio.driver.advance(0.4)
            path = out / file_name(item.name, studio.size.name, theme, studio.language)
            studio.take(path)
            for line in checks.problems(widget if widget is not None else studio.shown):
                print(f"{label}-{theme}: {line}", file=sys.stderr, flush=True)
                is_well = False
            print("wrote", path, flush=True)
    except Exception:
        traceback.print_exc()
        print(f"{label}: not taken", file=sys.stderr, flush=True)
        return False
    finally:
        widget = None  # garbage too, or the whole screen stays to the end
        studio.clear()
        gc.collect()  # widgets of pictures before would be recoloured with every switch
        gc.freeze()  # what is left stays to the end
    return is_well
