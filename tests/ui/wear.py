"""Use the app as a shift does, screen after screen and dialog after dialog, turn it, and count what is alive afterwards.

What grows with the rounds leaks: a wall tablet runs for months.
"""

from __future__ import annotations

import gc
from collections import Counter
from collections.abc import Callable
from datetime import UTC, datetime, time
from unittest import mock

from kivy.clock import Clock
from kivy.core.window import Window
from kivy.event import EventDispatcher
from kivy.graphics.instructions import Instruction
from kivy.lang.builder import Builder, _delayed_start, _handlers
from kivy.metrics import Metrics
from kivy.uix.widget import Widget

from app.i18n import translator
from app.screens.settings.missions import MissionsPage
from app.widgets.items import Option
from app.widgets.tokens import tk
from app.widgets.tr import tr
from app.window.application import SchedulerApp
from tests.ui.driver import Driver

SCREENS = ("scheduler", "logs", "settings", "home")
SECTIONS = ("robots", "missions", "constraints", "idle", "scheduler", "display", "data", "about")
OPTIONS = [Option(n, f"Option {n}", "star") for n in range(20)]
ITEMS = [Option(n, f"Command {n}", "star") for n in range(4)]
SIZES = (
    (1280, 800),
    (800, 1280),
    (640, 900),
    (1000, 700),
    (1500, 1000),
    (600, 480),
)  # each of Home's arrangements, and turns
CACHED = 200.0  # s for which kivy's caches keep what they drew
DAY = datetime(2026, 11, 20, tzinfo=UTC).date()


class Wear:
    """``app`` is shown in the window of ``ui``."""

    def __init__(self, app: SchedulerApp, ui: Driver) -> None:
        self._app, self._ui = app, ui
        self._shell = app.shell
        self._switched = self._opened = self._resized = 0
        self._dialogs: tuple[Callable[[], object], ...] = (
            lambda: self._shell.navigator.screen("home").vm.sending.open_all(),
            lambda: self._shell.sheets.ask("Clear the queue?", "Everything goes.", "Clear", lambda: None, "Keep"),
            lambda: self._shell.dialogs.choose_many("Missions", OPTIONS, "Add", lambda _keys: None),
            lambda: self._shell.dialogs.pick_time("Time", time(6, 30), lambda _time: None),
            lambda: self._shell.dialogs.pick_date("Day", DAY, lambda _day: None, today=DAY),
            lambda: self._shell.dialogs.menu(app.root_box, "Menu", ITEMS, lambda _key: None),
            lambda: app._frame._show_alarms(None),
            lambda: self._shell.go("settings", section="robots", add=True),
        )

    def round(self) -> None:
        """Show the next screen and the next dialog."""
        self.switch()
        self.dialog()

    def switch(self) -> None:
        """One screen further; every now and then a section of Settings, the story of a run, and a message."""
        n, shell = self._switched, self._shell
        self._switched += 1
        name = SCREENS[n % len(SCREENS)]
        intent = {"section": SECTIONS[n // len(SCREENS) % len(SECTIONS)]} if name == "settings" else {}
        shell.go(name, **intent)
        self._ui.wait(lambda: shell.background.idle)
        if name == "logs":
            logs = shell.navigator.screen("logs").vm
            if runs := [item.key for item in logs.rows if item.opens]:
                logs.open_story(runs[n % min(4, len(runs))])
        shell.snackbars.show(f"Round {n}", icon="check")
        self._ui.advance(0.1)
        shell.snackbars.clear()
        self._ui.advance()

    def see_sections(self, robot_id: int) -> None:
        """All parts of the Scheduler and the Logs, Home with all robots and with one, then each section of Settings,
        with a long list and a month above it, while missions are fetched, which keeps their page open: the
        fullest possible window."""
        scheduler, logs = self._seen("scheduler"), self._seen("logs")
        for tab in ("schedules", "suggestions", "plan"):
            self._seen("scheduler")
            scheduler.choose_tab(tab)
            self._ui.wait(lambda: self._shell.background.idle)
        for part in ("figures", "activity", "runs"):
            self._seen("logs")
            logs.vm.choose_part(part)
            self._ui.wait(lambda: self._shell.background.idle)
        self._seen("home")
        self._seen("home", robot_id=robot_id)
        with mock.patch.object(MissionsPage, "is_busy", True):
            for section in SECTIONS:
                self._see_section(section)

    def _see_section(self, section: str) -> None:
        self._seen("settings", section=section)
        self._shell.dialogs.choose_many("Missions", OPTIONS, "Add", lambda _keys: None)
        self._ui.advance(0.1)
        self._shell.dialogs.pick_date("Day", DAY, lambda _day: None, today=DAY)
        self._ui.advance(0.1)
        self._shell.dialogs.close_all()
        self._ui.advance(0.1)

    def _seen(self, name: str, **intent: object) -> Widget:
        self._shell.go(name, **intent)
        self._ui.wait(lambda: self._shell.background.idle)
        self._ui.advance(0.1)
        screen: Widget = self._shell.navigator.screen(name)
        return screen

    def dialog(self) -> None:
        """Open and close the next dialog."""
        shell = self._shell
        self._dialogs[self._opened % len(self._dialogs)]()
        self._opened += 1
        self._ui.wait(lambda: shell.background.idle)
        self._ui.advance(0.1)
        shell.dialogs.close_all()
        self._ui.advance(0.1)

    def resize(self) -> None:
        """Another size of the window; often the other orientation."""
        self._resized += 1
        Window.size = SIZES[self._resized % len(SIZES)]
        self._ui.wait(lambda: self._shell.background.idle)
        self._ui.advance(0.1)

    def turn(self, count: int) -> int:
        """Turn the window this often, which rebuilds Home; returns how often it was rebuilt."""
        built = 0
        self._ui.wait(lambda: self._shell.navigator.screen("home").children)  # made in a frame after its first facts
        for _n in range(count):
            shown = self._shell.navigator.screen("home").children[0]
            Window.size = Window.height, Window.width
            self._ui.advance()
            built += self._shell.navigator.screen("home").children[0] is not shown
        return built

    def rounds(self, count: int) -> None:
        """This many times, then back on Home with nothing left to free."""
        for n in range(count):
            self.round()
            if n % 12 == 11:
                gc.collect()
        self.settle()

    def settle(self) -> None:
        """Back on Home in the usual size, with nothing left to free."""
        Window.size = SIZES[0]
        self._shell.go("home")
        self._ui.wait(lambda: self._shell.background.idle)
        self._ui.advance(1)
        self._ui.skip(CACHED)
        for _n in range(3):
            gc.collect()
            self._ui.advance()

    def counts(self) -> dict[str, int]:
        """How much of what leaks in kivy is alive: widgets and what holds on to them."""
        objects = gc.get_objects()
        return {
            "widgets": sum(issubclass(type(thing), Widget) for thing in objects),
            "dispatchers": sum(issubclass(type(thing), EventDispatcher) for thing in objects),
            "canvas instructions": sum(issubclass(type(thing), Instruction) for thing in objects),
            "kv rules' bindings": sum(len(bound) for properties in _handlers.values() for bound in properties.values()),
            "kv widgets bound": len(_handlers),
            "kv delayed": 0 if _delayed_start is None else 1,
            "kv rules": len(Builder.rules),
            "texts that follow the language": _observers(tr),
            "followers of the language": len(translator._observers),
            "followers of the theme": len(tk._followers) + _observers(tk),
            "followers of the window": _observers(Window),
            "followers of the metrics": _observers(Metrics),
            "followers of KivyMD's theme": _observers(self._app.theme_cls),
            "clock events": len(Clock.get_events()),
            "open dialogs": len(self._shell.dialogs._open),
        }


def _observers(source: EventDispatcher) -> int:
    """Callbacks bound to its properties, the dead ones too: they are only removed when the property changes."""
    return sum(len(source.get_property_observers(name)) for name in source.properties())


def kinds() -> Counter[str]:
    """Python objects by class."""
    return Counter(f"{type(thing).__module__}.{type(thing).__qualname__}" for thing in gc.get_objects())


def widgets() -> Counter[str]:
    return Counter(type(thing).__name__ for thing in gc.get_objects() if issubclass(type(thing), Widget))
