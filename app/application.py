"""The app as kivy runs it: hands the services to the screens, asks for a poll cycle every poll interval (Algorithm 1 of the thesis), and
keeps a wall tablet alive whatever a handler does. Results come back to the UI thread by ``container.changes``.
"""
from __future__ import annotations

import importlib
import logging
import threading
from collections.abc import Callable
from functools import partial

from kivy.base import ExceptionHandler, ExceptionManager
from kivy.clock import Clock, ClockEvent
from kivy.factory import Factory
from kivy.uix.widget import Widget
from kivymd.app import MDApp

import app.widgets
from app import NAME, compat
from app.container import Container
from app.i18n import translator
from app.models import Settings
from app.screens.base import Background, Dialogs, Navigator, Snackbars, UiBus
from app.screens.frame import FrameController
from app.screens.rescue import Damage, RescuePage
from app.screens.shell import SCREENS, Shell
from app.services.changes import Topic
from app.widgets.tokens import apply_theme

log = logging.getLogger(__name__)


class SchedulerApp(MDApp):
    """With a container the app; with ``damage`` the screen that restores the database, which then goes on as the app."""
    title = NAME

    def __init__(self, container: Container | None, damage: Damage | None = None, animate: bool = True) -> None:
        super().__init__()
        self.container: Container | None = None
        self.shell: Shell | None = None
        self._given, self._damage, self._animate = container, damage, animate
        self._frame: FrameController | None = None
        self._poll: ClockEvent | None = None
        self._bus: UiBus | None = None
        self._unsubscribe: Callable[[], object] = lambda: None
        self._shown: Settings | None = None      # as they look now
        self._survivor = Survivor(self._tell_unexpected)

    # ------------------------------------------------------------------ life
    def build(self) -> Widget:
        compat.apply()
        app.widgets.load()
        apply_theme(self.theme_cls, "light")
        self._bus = UiBus()
        self._bus.subscribe(_SettingsChanged, self._settings_changed)
        self.root_box = Factory.BoxLayout()
        if self._given is not None:
            self.begin(self._given)
        elif self._damage is not None:
            self.root_box.add_widget(RescuePage(self._damage, self._bus, self.begin))
        return self.root_box

    def begin(self, container: Container) -> None:
        """Show the app on these services."""
        assert self._bus is not None
        self.container = container
        self._appear(container.settings())
        frame = Factory.Frame()
        background = Background(self._bus, unexpected=self._tell_unexpected)
        builders = {name: partial(self._build_screen, name) for name in SCREENS}
        self.shell = Shell(Navigator(frame.ids.body.__self__, builders), Dialogs(self._animate), Snackbars(), self._bus, background)
        self._frame = FrameController(container, self.shell, frame)
        self.root_box.clear_widgets()
        self.root_box.add_widget(frame)
        self._unsubscribe = container.changes.subscribe(self._heard)
        self._frame.start()
        self._set_poll(container.settings())
        self.shell.go("home")

    def on_start(self) -> None:
        ExceptionManager.add_handler(self._survivor)
        threading.excepthook = self._thread_failed

    def on_stop(self) -> None:
        """Screens let go, then the work in the background; the host closes the services after the window."""
        ExceptionManager.remove_handler(self._survivor)
        threading.excepthook = threading.__excepthook__
        self._unsubscribe()
        if self._poll is not None:
            self._poll.cancel()
        if self.shell is not None and self._frame is not None:
            self._frame.stop()
            self.shell.dialogs.close_all()
            self.shell.snackbars.clear()
            self.shell.navigator.close()
            self.shell.background.close()

    def on_pause(self) -> bool:
        """Android: stay alive behind other apps."""
        return True

    def _build_screen(self, name: str) -> Widget:
        module, class_name = SCREENS[name]
        return getattr(importlib.import_module(module), class_name)(self.container, self.shell)

    # ------------------------------------------------------------------ the poll cycle
    def _set_poll(self, settings: Settings) -> None:
        """Every poll interval one cycle of all robots, each on its own thread; this only asks for it."""
        if self._poll is not None:
            self._poll.cancel()
        self._cycle()
        self._poll = Clock.schedule_interval(lambda _dt: self._cycle(), settings.poll_interval_seconds)

    def _cycle(self) -> None:
        if self.container is not None:
            self.container.loop.request_cycle(by_window=True)

    # ------------------------------------------------------------------ settings
    def _heard(self, topic: Topic, _about: int | None) -> None:
        """On the publisher's thread."""
        if topic is Topic.SETTINGS and self._bus is not None:
            self._bus.publish(_SettingsChanged(), key=_SettingsChanged)

    def _settings_changed(self, _event: _SettingsChanged) -> None:
        """On the UI thread: whatever was changed shows at once."""
        if self.container is not None:
            before, settings = self._shown, self.container.settings()
            self._appear(settings)
            if before is not None and before.poll_interval_seconds != settings.poll_interval_seconds:
                self._set_poll(settings)

    def _appear(self, settings: Settings) -> None:
        """Theme and language."""
        before, self._shown = self._shown, settings
        if before is None or before.theme != settings.theme:
            apply_theme(self.theme_cls, settings.theme)
        if translator.language != settings.language:
            translator.use(settings.language)

    # ------------------------------------------------------------------ what nobody foresaw
    def _tell_unexpected(self, problem: BaseException) -> None:
        """The traceback is in the log; here one sentence, and the app goes on."""
        if self.shell is not None:
            self.shell.say_problem(problem)

    def _thread_failed(self, args: threading.ExceptHookArgs) -> None:
        if args.exc_value is not None:
            log.error("The thread %s failed", args.thread and args.thread.name, exc_info=args.exc_value)


class _SettingsChanged:
    """The settings in the database are new."""


class Survivor(ExceptionHandler):
    """What a handler raises is logged and told, and the event loop goes on; a flood is told once a second."""

    def __init__(self, tell: Callable[[BaseException], object]) -> None:
        super().__init__()
        self._tell = tell
        self._told_at = float("-inf")

    def handle_exception(self, inst: BaseException) -> int:
        if not isinstance(inst, Exception):              # KeyboardInterrupt and SystemExit end the app
            return ExceptionManager.RAISE
        log.error("A handler of the window failed", exc_info=inst)
        now = Clock.get_time()
        if now - self._told_at >= 1:
            self._told_at = now
            try:
                self._tell(inst)
            except Exception:
                log.exception("It could not be told either")
        return ExceptionManager.PASS
