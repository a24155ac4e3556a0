"""What the sections of Settings share: the desk they work at, and the base of a page."""
from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from datetime import datetime
from typing import Any

from kivy.event import EventDispatcher
from kivy.metrics import dp
from kivy.properties import BooleanProperty, ObjectProperty, OptionProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.widget import Widget

from app.container import Container
from app.database.errors import DatabaseError
from app.domain.models import InvalidInput
from app.i18n import _
from app.mir.errors import RobotError
from app.screens.common.shell import Shell
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.view import NoticeView
from app.services.files.exports import DataFiles
from app.services.robots.missions import RobotMissions
from app.widgets import panel_grid  # noqa: F401  (kivy's Factory learns it)
from app.widgets.surfaces import Toned
from app.widgets.tokens import TONES

log = logging.getLogger(__name__)

BAR_BESIDE = dp(-12)                         # the scroll bar stands in the margin, not on what scrolls
FORESEEN = (InvalidInput, RobotError, DatabaseError)     # each brings its sentence; anything else belongs into the log as well


class Desk:
    """Services, the last facts, and how work is done: off the UI thread, its outcome back on it."""

    def __init__(self, container: Container, shell: Shell, refresh: Callable[[], object]) -> None:
        self.container, self.shell, self.refresh = container, shell, refresh
        self.files = DataFiles(container.db, container.catalogue, container.clock)
        self.robot_missions = RobotMissions(lambda robot_id: container.repositories.robots.get(container.db.read(), robot_id),
                                            container.make_client, container.clock)
        self.facts = SettingsFacts()

    def now(self) -> datetime:
        return self.container.clock.now()

    def work(self, work: Callable[[], Any], done: Callable[[Any], object] | None = None,
             failed: Callable[[BaseException], object] | None = None, **kwargs: Any) -> None:
        """Run ``work`` on another thread. ``failed`` shows what went wrong where it was entered; without it a snackbar says it."""
        def told(problem: BaseException) -> None:
            if not isinstance(problem, FORESEEN):
                log.error("work for Settings failed", exc_info=problem)
            (failed or self.shell.say_problem)(problem)
        self.shell.background.run(work, done, told, **kwargs)

    def save(self, failed: Callable[[BaseException], object] | None = None, **changes: Any) -> None:
        """Change settings, at once."""
        self.work(lambda: self.container.catalogue.change_settings(**changes), lambda _settings: self.refresh(), failed)

    def say(self, text: str, icon: str = "check") -> None:
        self.shell.snackbars.show(text, icon=icon)

    def offer_undo(self, text: str, undo: Callable[[], object]) -> None:
        self.shell.snackbars.undo(text, _("Undo"), undo)


class SettingsPage(BoxLayout):
    """One section. ``show`` brings new facts, once a second and after every change; ``reached`` tells that it has come on screen."""
    vm = ObjectProperty(None, rebind=True, allownone=True)

    def __init__(self, desk: Desk, vm: EventDispatcher, **kwargs: Any) -> None:
        self.desk = desk
        super().__init__(vm=vm, orientation="vertical", **kwargs)

    def show(self, facts: SettingsFacts, now: datetime) -> None:
        raise NotImplementedError

    def show_one(self, wanted: Widget, of: Sequence[Widget]) -> None:
        """Of several widgets that take turns show this one, below what always stands."""
        for widget in of:
            if widget is not wanted:
                self.remove_widget(widget)
        if wanted.parent is None:
            self.add_widget(wanted)

    def reached(self, **intent: Any) -> None:
        """The section was opened, perhaps with what is wanted there (``add=True``, ``robot_id=3``)."""


class SwitchRow(BoxLayout):
    """A word, a note and a switch that shows what is saved: ``on_switch(wanted)``."""
    text = StringProperty()
    note = StringProperty()
    active = BooleanProperty(False)

    __events__ = ("on_switch",)

    def on_switch(self, wanted: bool) -> None:
        """The switch was tapped."""


class Outcome(Toned, BoxLayout):
    """What came of an action, as a block; without ``text`` it takes no room."""
    text = StringProperty()
    note = StringProperty()
    icon = StringProperty()


class OutcomeModel(EventDispatcher):
    """The properties of one Outcome, for view models."""
    text = StringProperty()
    note = StringProperty()
    icon = StringProperty()
    tone = OptionProperty("neutral", options=TONES)

    def tell(self, notice: NoticeView) -> None:
        self.tone, self.icon, self.note, self.text = notice.tone, notice.icon, notice.note, notice.text
