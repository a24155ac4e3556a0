"""The Kivy application: hands the services to the screens, requests a poll cycle every poll interval, and survives errors of handlers.

What services publish reaches the screens as ``Changed`` on the UI thread.
"""

from __future__ import annotations

import ctypes
import importlib
import logging
import sys
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

from kivy.base import ExceptionHandler, ExceptionManager
from kivy.clock import Clock, ClockEvent
from kivy.core.window import Window
from kivy.factory import Factory
from kivy.metrics import Metrics
from kivy.uix.widget import Widget
from kivy.utils import platform
from kivymd.app import MDApp

import app.widgets
from app import NAME
from app.container import Container
from app.database.errors import DatabaseDamaged
from app.domain.models import Settings
from app.failures import Failure
from app.i18n import _, translator
from app.screens.common import formats
from app.screens.common.problems import sentence_of
from app.screens.common.sheets import Sheets
from app.screens.common.shell import SCREENS, Loudspeaker, Shell, pick
from app.screens.common.threads import Background, Changed, UiBus, forward
from app.screens.common.view_model import Dialogs, Navigator, ScreenBase, Snackbars, ViewModel
from app.screens.frame.controller import FrameController
from app.screens.rescue import Damage, NotStarted
from app.screens.settings.gate import Gate
from app.services.live.changes import Topic
from app.widgets.keyboard import DockedKeyboard, has_keyboard, lacks_keyboard
from app.widgets.tokens import apply_theme, tk
from app.window.key_focus import KeyFocus

log = logging.getLogger(__name__)
RESULT_SHOWN_FOR = 8.0  # s for the outcome of restoring a backup
SETTLED = 0.3  # s without another size of the window
LOGGED_AGAIN = 60.0  # s between two entries about one failure: that of each frame fills all log files in a minute
INPUT_DEVICES = Path("/proc/bus/input/devices")


class SchedulerApp(MDApp):
    """With a container the app, opened on the screen ``first`` (None: Home, or the steps of the set-up where there is no
    robot); with ``damage`` the screen that restores the database, or says why the app can't start, which then becomes the
    app. ``restore`` closes the services, puts a backup in place and opens them again, off the UI thread; it returns the
    opened services with any problem, and raises Failure if it could open none.
    """

    title = NAME

    def __init__(
        self,
        container: Container | None,
        damage: Damage | NotStarted | None = None,
        restore: Callable[[Path], tuple[Container, Failure | None]] | None = None,
        first: str | None = None,
        loudspeaker: Loudspeaker | None = None,
    ) -> None:
        app.widgets.load()  # before KivyMD's part of the start, which is repaired there
        super().__init__()
        self.container: Container | None = None
        self.shell: Shell | None = None
        self._given, self._damage, self._restorer, self._first = container, damage, restore, first
        self._loudspeaker = loudspeaker
        self.models: dict[str, ViewModel] = {}  # by the name of their screens
        self._frame: FrameController | None = None
        self._gate: Gate | None = None
        self._keyboard: DockedKeyboard | None = None
        self._keys = KeyFocus()
        self._poll: ClockEvent | None = None
        self._bus = UiBus()
        self._unsubscribe: Callable[[], object] = lambda: None  # from the services
        self._forget: Callable[[], object] = lambda: None  # unsubscribes from their changes
        self._shown: Settings | None = None  # as they look now
        self._resized = Clock.create_trigger(self._fit_gloves, SETTLED)
        self._font_scale = Metrics.fontscale  # the system's own, that the setting multiplies
        self._exception_handler = UiExceptionHandler(self._show_unexpected)
        self.much_has_gone: Callable[[], object] = lambda: None  # to be called when all screens were thrown away

    # ------------------------------------------------------------------ life
    def build(self) -> Widget:
        self._use("light")
        Window.bind(size=self._resized)
        self._forget = self._bus.subscribe(Changed, self._changed)
        self.root_box = Factory.BoxLayout()
        if self._given is not None:
            self.begin(self._given)
        elif self._damage is not None:
            if translator.language != self._damage.language:
                translator.use(self._damage.language)
            self.root_box.add_widget(self._damage.page(self._bus, self.begin))
            self._keys.start()
        return self.root_box

    def begin(self, container: Container) -> None:
        """Show the app on these services."""
        self.container = container
        self._appear(container.settings())
        frame = Factory.Frame()
        background = Background(self._bus, unexpected=self._show_unexpected)
        self.models.clear()
        builders = {name: partial(self._build_screen, name) for name in SCREENS}
        navigator, snackbars = Navigator(frame.ids.body.__self__, builders), Snackbars()
        sheets = Sheets(frame.ids.sheets.__self__, snackbars, navigator)
        self.shell = Shell(
            navigator,
            Dialogs(sheets),
            snackbars,
            self._bus,
            background,
            self._restore if self._restorer is not None else None,
            self._loudspeaker,
            sheets=sheets,
        )
        self._frame = FrameController(pick(FrameController.Services, container), self.shell, frame)
        self.models["alarms"] = self._frame.alarms
        self.root_box.clear_widgets()
        self.root_box.add_widget(frame)
        self._unsubscribe = forward(container.changes, self._bus)
        self._frame.start()
        self._keys.start()  # before the gate, which wants to know of every key
        self._gate = Gate(pick(Gate.Services, container), self.shell)
        self._gate.start()
        self._start_keyboard()
        self._set_poll(container.settings())
        container.runner.on_damage = lambda damage: self._bus.post(lambda: self._show_damage(damage))
        self.shell.go(self._first or "home")
        if self._first is None and not container.catalogue.robots():
            self.shell.go("settings", section="setup")  # a PIN is asked for over Home

    def _start_keyboard(self) -> None:
        self._keyboard = DockedKeyboard(self._wants_keyboard, lambda: formats.current().decimal)
        self._keyboard.start()

    def _rebuild(self) -> None:
        """Everything in the sizes of now. What it shows is in the view models. A picker stays where its form does."""
        shell, controller, keyboard = self.shell, self._frame, self._keyboard
        if shell is None or controller is None or keyboard is None:
            return
        frame, picker = Factory.Frame(), shell.sheets.picker
        shell.snackbars.rebuild()
        keyboard.stop()
        self._start_keyboard()
        self.root_box.clear_widgets()
        self.root_box.add_widget(frame)

        def gone() -> None:
            shell.sheets.frame_place = frame.ids.sheets.__self__
            self.much_has_gone()

        shell.navigator.rebuild(frame.ids.body.__self__, gone)
        if picker is not None and shell.sheets.top is not None:
            shell.sheets.over(picker)
        controller.use(frame)

    def on_start(self) -> None:
        ExceptionManager.add_handler(self._exception_handler)
        threading.excepthook = self._thread_failed

    def on_stop(self) -> None:
        """Release the screens, then the background work; the host closes the services after the window."""
        ExceptionManager.remove_handler(self._exception_handler)
        threading.excepthook = threading.__excepthook__
        Window.unbind(size=self._resized)
        self._resized.cancel()
        self._forget()
        self._release()
        Metrics.fontscale = self._font_scale

    def _release(self) -> None:
        """Release the services and everything that shows them."""
        self._unsubscribe()
        self._unsubscribe = lambda: None
        if self._poll is not None:
            self._poll.cancel()
        if self.shell is not None and self._frame is not None:
            self._frame.stop()
        if self._gate is not None:
            self._gate.stop()
        if self._keyboard is not None:
            self._keyboard.stop()
        self._keys.stop()
        if self.shell is not None:
            self.shell.dialogs.close_all()
            self.shell.navigator.close()  # a screen may show a message when it is left
            self.shell.snackbars.clear()
            self.shell.background.close()
        self.container = self.shell = self._frame = self._gate = self._keyboard = self._poll = None
        self.much_has_gone()

    # ------------------------------------------------------------------ going back to a backup
    def _restore(self, path: Path) -> None:
        """Requested by a screen, which is removed before the restore begins."""
        Clock.schedule_once(lambda _dt: self._go_back(path), 0)

    def _go_back(self, path: Path) -> None:
        """Close everything, put the backup in place, build everything again on it; a message reports the outcome."""
        assert self._restorer is not None
        restorer = self._restorer
        self._release()
        page = Factory.EmptyState(
            icon="backup-restore",
            title=_("Restoring {name} …").format(name=path.name),
            text=_("Until then nothing is scheduled."),
        )
        self.root_box.clear_widgets()
        self.root_box.add_widget(page)
        background = Background(self._bus, workers=1)

        def restored(opened: tuple[Container, Failure | None]) -> None:
            background.close()
            container, problem = opened
            self.begin(container)
            assert self.shell is not None
            text = _("{name} was restored").format(name=path.name) if problem is None else sentence_of(problem)
            self.shell.snackbars.show(
                text, icon="backup-restore" if problem is None else "alert-circle-outline", seconds=RESULT_SHOWN_FOR
            )

        def failed(problem: BaseException) -> None:
            background.close()
            page.title = _("The database can't be opened")
            page.text = sentence_of(problem)

        background.run(lambda: restorer(path), restored, failed)

    def _show_damage(self, damage: DatabaseDamaged) -> None:
        """The database was found damaged while running: what a start on it would show."""
        restorer = self._restorer
        if self.container is None or restorer is None:
            return

        def restore(backup: Path) -> Container:
            container, problem = restorer(backup)
            if problem is not None:
                raise problem
            return container

        self._release()
        self.root_box.clear_widgets()
        self.root_box.add_widget(Damage(damage, restore, translator.language).page(self._bus, self.begin))
        self._keys.start()

    def open_settings(self, *_args: object) -> bool:
        """Kivy's own page of settings, which F1 opens otherwise, past the PIN."""
        return False

    def on_pause(self) -> bool:
        """Android: stay alive behind other apps."""
        return True

    def _build_screen(self, name: str) -> ScreenBase:
        """Its view model is made once."""
        module, class_name = SCREENS[name]
        kind = getattr(importlib.import_module(module), class_name)
        if name not in self.models:
            self.models[name] = kind.Model(pick(kind.Services, self.container), self.shell)
        screen: ScreenBase = kind(self.models[name])
        return screen

    # ------------------------------------------------------------------ the poll cycle
    def _set_poll(self, settings: Settings) -> None:
        """Every poll interval one cycle of all robots, each on its own thread; this only asks for it."""
        if self._poll is not None:
            self._poll.cancel()
        self._cycle()
        self._poll = Clock.schedule_interval(lambda _dt: self._cycle(), settings.poll_interval_seconds)

    def _cycle(self) -> None:
        if self.container is not None:
            self.container.engine.request_cycle(by_window=True)

    # ------------------------------------------------------------------ settings
    def _changed(self, event: Changed) -> None:
        """Changed settings show at once."""
        if self.container is not None and event.topic is Topic.SETTINGS:
            before, settings = self._shown, self.container.settings()
            self._appear(settings)
            if before is not None and before.poll_interval_seconds != settings.poll_interval_seconds:
                self._set_poll(settings)

    def _appear(self, settings: Settings) -> None:
        """Theme, size of texts and targets, and language. Other sizes need new screens, which use them while they are built."""
        before, self._shown = self._shown, settings
        sizes = [(seen.gloves, seen.font_scale_percent) for seen in (before, settings) if seen is not None]
        if before is None or before.theme != settings.theme or before.gloves != settings.gloves:
            self._use(settings.theme, settings.gloves)
        scale = self._font_scale * settings.font_scale_percent / 100
        if Metrics.fontscale != scale:  # kivy announces it to every widget, changed or not
            Metrics.fontscale = scale
        if translator.language != settings.language:
            translator.use(settings.language)
            if self.shell is not None:
                self.shell.snackbars.clear()  # in the old one
        if len(set(sizes)) > 1:
            self._rebuild()

    def _use(self, theme: str, gloves: bool | None = None) -> None:
        apply_theme(self.theme_cls, theme, gloves=gloves)
        Window.clearcolor = tk.bg  # behind pages that have no other ground

    def _fit_gloves(self, *_args: object) -> None:
        """A window of another size may have room for less, or for more."""
        before = tk.h_touch
        self._use(tk.theme, tk.gloves)
        if tk.h_touch != before:
            self._rebuild()

    def _wants_keyboard(self) -> bool:
        """On the screen. Linux and Windows say whether the tablet has one; Windows shows its own for no field of kivy. Other systems,
        Android among them, bring up their own."""
        wanted = self._shown.keyboard if self._shown is not None else "off"
        if wanted == "auto" and sys.platform == "win32":
            return lacks_keyboard(ctypes.windll.user32.GetSystemMetrics)
        if wanted != "auto" or platform != "linux":
            return wanted == "on"
        try:
            return not has_keyboard(INPUT_DEVICES.read_text(encoding="utf-8", errors="replace"))
        except OSError:
            return False

    # ------------------------------------------------------------------ unexpected errors
    def _show_unexpected(self, problem: BaseException) -> None:
        """One sentence on screen; the traceback is in the log."""
        if self.shell is not None:
            self.shell.say_problem(problem)

    def _thread_failed(self, args: threading.ExceptHookArgs) -> None:
        if args.exc_value is not None:
            log.error("The thread %s failed", args.thread and args.thread.name, exc_info=args.exc_value)


class UiExceptionHandler(ExceptionHandler):
    """Logs what a handler raises and shows it, at most once a second, and keeps the event loop running."""

    def __init__(self, show: Callable[[BaseException], object]) -> None:
        super().__init__()
        self._show = show
        self._reported_at = self._logged_at = float("-inf")
        self._logged = ""

    def handle_exception(self, inst: BaseException) -> int:
        if not isinstance(inst, Exception):  # KeyboardInterrupt and SystemExit end the app
            return ExceptionManager.RAISE
        now = Clock.get_time()
        if repr(inst) != self._logged or now - self._logged_at >= LOGGED_AGAIN:
            self._logged, self._logged_at = repr(inst), now
            log.error("A handler of the window failed", exc_info=inst)
        if now - self._reported_at >= 1:
            self._reported_at = now
            try:
                self._show(inst)
            except Exception:
                log.exception("The error could not be shown either")
        return ExceptionManager.PASS
