"""Operation with a window: kivy is configured before it is imported; closing the window ends the scheduling too."""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from types import FrameType

import platformdirs

from app import NAME
from app.command import quote
from app.container import Container
from app.database import backups
from app.database.errors import DatabaseDamaged
from app.failures import BadInput, Failure
from app.process import log_file
from app.process.data_directory import DataDirectory, restore_backup
from app.process.host import host
from app.process.service_manager import notify, watchdog
from app.process.terminal import STOPPING, print_error
from app.window.display import display_size
from app.window.garbage import Garbage, share_one_heap
from app.window.pace import IN_USE, slow_at_rest
from app.window.sound import Loudspeaker

log = logging.getLogger(__name__)

DemoFleet = tuple[Sequence[tuple[str, str]], Mapping[str, str]]
GoBack = Callable[[Path], tuple[Container, Failure | None]]

WIDTH, HEIGHT = 1280, 800  # of the window where it does not fill the screen
LEAST_WIDTH, LEAST_HEIGHT = 600, 480


def run(directory: DataDirectory, demo_robots: DemoFleet | None = None, kiosk: bool = False) -> int:
    """Returns the exit code 0 when the window was closed. Raises BadInput or Failure with one line. A damaged database
    has its own screen with a Restore button, and in a kiosk, which hides that line, so has all else that may keep the
    services from starting; closed on it, it raises the same as the other commands.
    """
    share_one_heap()
    log_file.start(directory.logs, stderr=False)
    configure(kiosk)
    has_begun = False
    with contextlib.ExitStack() as stack:

        def begin() -> Container:
            nonlocal has_begun
            container = stack.enter_context(host(directory, demo=demo_robots, with_window=True))
            has_begun = True
            return container

        def go_back(backup: Path) -> tuple[Container, Failure | None]:
            """Close the services, put the backup in place, and open them again on it, or on the old database if that failed."""
            stack.close()
            try:
                restore_backup(directory, backup)
            except BadInput as problem:
                return begin(), problem
            return begin(), None

        try:
            container = begin()
        except Exception as problem:
            if kiosk:
                print_error(str(problem))  # for systemd's journal, as the window stays
            elif not isinstance(problem.__cause__, DatabaseDamaged):
                raise
            log.error("The app can't start", exc_info=problem)
            _open_window()
            _run(_app_without_services(directory, problem, begin, go_back))
            if not has_begun:
                raise
            return 0
        _open_window()
        from app.window.application import SchedulerApp

        _run(SchedulerApp(container, restore=go_back, loudspeaker=Loudspeaker()))
    return 0


# ---------------------------------------------------------------------- the window
def configure(kiosk: bool) -> None:
    """Configure kivy for a tablet, before its first import. Nothing is written to a file. Raises Failure without kivy."""
    home = platformdirs.user_cache_path("amr-scheduler", appauthor=False) / "kivy"
    with contextlib.suppress(OSError):
        home.mkdir(mode=0o700, parents=True, exist_ok=True)
    for name, value in {
        "KIVY_NO_ARGS": "1",
        "KIVY_NO_CONFIG": "1",
        "KIVY_NO_FILELOG": "1",
        "KIVY_LOG_MODE": "PYTHON",
        "KIVY_HOME": str(home),
    }.items():
        os.environ.setdefault(name, value)
    logging.getLogger("kivy").addFilter(_is_no_optional_part)
    if missing := [name for name in ("kivy", "kivymd") if find_spec(name) is None]:
        get = f"pip install {quote('amr-scheduler[ui]')}"
        raise Failure(f"the window is not installed ({missing[0]} is missing): {get} adds it; --headless works without")
    from kivy.config import Config

    for section, values in _settings(kiosk).items():
        for name, value in values.items():
            Config.set(section, name, value)
    if sys.platform == "linux":
        Config.remove_option("input", "%(name)s")  # probesysfs: with SDL's own touch every tap would count twice


def _settings(kiosk: bool) -> dict[str, dict[str, str]]:
    """Of kivy, by section."""
    graphics = {
        "minimum_width": str(LEAST_WIDTH),
        "minimum_height": str(LEAST_HEIGHT),
        "multisamples": "0",
        "maxfps": str(IN_USE),
        "allow_screensaver": "0",
        "resizable": "1",
    }
    if kiosk:
        width, height = display_size() or (WIDTH, HEIGHT)
        graphics |= {"fullscreen": "auto", "show_cursor": "0", "width": str(width), "height": str(height)}
    else:
        graphics |= size_within(display_size(usable=True))
    return {
        "kivy": {"exit_on_escape": "0", "window_icon": ""},
        "graphics": graphics,
        "input": {"mouse": "mouse,disable_multitouch"},  # no red dots under the right button
        "widgets": {"scroll_distance": "12", "scroll_timeout": "120"},
    }


def _is_no_optional_part(record: logging.LogRecord) -> bool:
    """Kivy writes a traceback for each kind of touch screen and clipboard that this system doesn't have."""
    return record.levelno < logging.ERROR or not record.getMessage().startswith(("Input: ", "Cutbuffer: "))


def size_within(usable: tuple[int, int] | None) -> dict[str, str]:
    """Kivy's settings of a window no larger than the ``usable`` part of the display, in px. A window without enough
    room is maximised: only the desktop knows the size of its frame."""
    width, height = usable or (WIDTH, HEIGHT)
    fits = usable is None or (width > WIDTH and height > HEIGHT)
    return {
        "width": str(min(width, WIDTH)),
        "height": str(min(height, HEIGHT)),
        "window_state": "visible" if fits else "maximized",
    }


def _open_window() -> None:
    """Make the window, or say why there is none: without a display SDL would silently draw into memory."""
    chosen = "SDL_VIDEODRIVER" in os.environ
    if sys.platform == "linux" and not chosen and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise Failure("there is no display; start it in a desktop session (DISPLAY is not set), or with --headless")
    try:
        from kivy.core.window import Window
    except ImportError as error:
        raise Failure(f"the window can't be opened: {error}; --headless works without") from error
    if Window is None:
        raise Failure(
            "the window can't be opened: no OpenGL, or the display can't be reached; --headless works without"
        )
    if sys.platform == "linux" and not chosen and Window.get_window_info() is None:
        raise Failure(
            f"the display {os.environ.get('DISPLAY', '')} can't be reached; --headless works without a window"
        )
    Window.set_title(NAME)


def _run(app) -> None:  # type: ignore[no-untyped-def]
    """Until the window is closed, or somebody asks the process to stop."""
    from kivy.clock import Clock

    def stop(_number: int, _frame: FrameType | None) -> None:
        Clock.schedule_once(lambda _dt: app.stop(), 0)

    for number in STOPPING:
        signal.signal(number, stop)
    _after_first_frame(partial(notify, "READY=1"))
    Clock.schedule_interval(lambda _dt: watchdog.window_works(), 1)
    with quiet_garbage(app), slow_at_rest():
        app.run()


def _after_first_frame(call: Callable[[], object]) -> None:
    from kivy.clock import Clock
    from kivy.core.window import Window

    def drawn(_window: object) -> None:  # and is shown when this returns
        Window.funbind("on_flip", drawn)
        Clock.schedule_once(lambda _dt: call(), 0)

    Window.fbind("on_flip", drawn)


@contextlib.contextmanager
def quiet_garbage(app=None) -> Iterator[None]:  # type: ignore[no-untyped-def]
    """Collect garbage between frames while the block lasts; ``app`` reports when it removes its screens."""
    from kivy.clock import Clock
    from kivy.core.window import Window

    garbage = Garbage(Clock.get_time)
    garbage.begin()
    if app is not None:
        app.much_has_gone = garbage.much_has_gone
    Window.fbind("on_touch_down", garbage.touched)
    collections = Clock.schedule_interval(garbage.collect_due, 0)
    try:
        yield
    finally:
        collections.cancel()
        Window.funbind("on_touch_down", garbage.touched)
        garbage.end()


# ---------------------------------------------------------------------- a start that fails
def _app_without_services(
    directory: DataDirectory, problem: Exception, begin: Callable[[], Container], go_back: GoBack
):  # type: ignore[no-untyped-def]
    from app.screens.rescue import Damage, NotStarted
    from app.window.application import SchedulerApp

    def restore(backup: Path) -> Container:
        restore_backup(directory, backup)
        return begin()

    found = problem.__cause__
    damage: Damage | NotStarted
    if isinstance(found, DatabaseDamaged):
        damage = Damage(found, restore, backups.settings_in(found.backup or directory.database).language)
    else:
        damage = NotStarted(problem, begin, backups.settings_in(directory.database).language)
    return SchedulerApp(None, damage, restore=go_back, loudspeaker=Loudspeaker())
