"""What the sections of Settings share: their context, the base of a page, and the widgets that several of them use."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from datetime import date, datetime
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar, cast
from zoneinfo import ZoneInfo

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, DictProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.database.errors import DatabaseError
from app.domain.check_up import Report
from app.domain.models import InvalidInput, Settings
from app.i18n import _
from app.mir.errors import RobotError
from app.screens.common.problems import sentence_of
from app.screens.common.shell import Shell
from app.screens.common.threads import Job
from app.screens.settings.facts import SettingsFacts, SettingsServices
from app.screens.settings.view import NoticeView
from app.widgets.display import Notice
from app.widgets.events import Fires
from app.widgets.slots import PartSlot

if TYPE_CHECKING:
    from app.screens.settings.check_up import CheckUp

log = logging.getLogger(__name__)
T = TypeVar("T")

EXPECTED = (InvalidInput, RobotError, DatabaseError)  # each has its sentence; other errors are logged too


class _InTime:
    """The window's dialogs or sheets. What a late answer of a robot or the disk would ask on another page, or without the PIN on another
    screen, is not asked, and a message says so."""

    OPENS = ("ask", "choose", "choose_many", "over", "show")

    def __init__(self, context: PageContext, those: object) -> None:
        self._context, self._those = context, those

    def __getattr__(self, name: str) -> Any:
        return self._say if name in self.OPENS and self._context.is_late else getattr(self._those, name)

    def _say(self, asked: Any, *_args: Any, **_named: Any) -> None:
        what = asked if isinstance(asked, str) else asked.title
        self._context.say(_("Not asked, as the page was left: {what}").format(what=what), "information-outline")


class PageContext:
    """What every section works with: the services, the window, the latest facts, and a way to run work in the
    background.

    ``refresh()`` reads the facts again, and drops the present reading, which may be outdated. ``show()`` shows the facts. ``is_late``: what
    is called now was begun on a page that was left since.
    """

    def __init__(
        self,
        services: SettingsServices,
        shell: Shell,
        refresh: Callable[[], object],
        show: Callable[[], object],
    ) -> None:
        self.services, self.refresh, self.show = services, refresh, show
        asking = {name: _InTime(self, getattr(shell, name)) for name in ("dialogs", "sheets")}
        self.shell = replace(shell, **cast(Any, asking))
        self.facts = self._known = SettingsFacts()  # as they are shown; as they are stored
        self.model: EventDispatcher | None = None  # of the open section: its page may be built again
        self.check_ups: dict[int | str, CheckUp] = {}  # those that run, by ``key_of`` what is checked up
        self.ended_early: dict[int | str, Report] = {}  # of those that no one saw end
        self._unwritten: list[Callable[[SettingsFacts], SettingsFacts]] = []  # how each change is shown
        self._last_written = threading.Event()  # the change before
        self._last_written.set()
        self._pages_left = 0
        self.is_late = False

    def now(self) -> datetime:
        return self.services.clock.now()

    def today(self) -> date:
        """In the time zone of the settings."""
        return self.now().astimezone(ZoneInfo(self.facts.settings.timezone)).date()

    def run(
        self,
        work: Callable[[], T],
        done: Callable[[T], object] | None = None,
        failed: Callable[[BaseException], object] | None = None,
        *,
        key: Hashable | None = None,
        apart: str = "",
    ) -> Job:
        """Run ``work`` on another thread, then ``done(result)`` or ``failed(exception)`` on the UI thread; without ``failed`` a snackbar
        shows the problem. Of several runs with one ``key`` only the newest delivers."""

        page = self._pages_left

        def tell(call: Callable[[Any], object], said: Any) -> None:
            self.is_late = page != self._pages_left
            try:
                call(said)
            finally:
                self.is_late = False

        def not_done(problem: BaseException) -> None:
            if not isinstance(problem, EXPECTED):
                log.error("work for Settings failed", exc_info=problem)
            tell(failed or self.shell.say_problem, problem)

        return self.shell.background.run(work, done and partial(tell, done), not_done, key=key, apart=apart)

    def change(
        self,
        work: Callable[[], object],
        failed: Callable[[BaseException], object] | None = None,
        undo: tuple[str, Callable[[], object]] | None = None,
        shown: Callable[[SettingsFacts], SettingsFacts] = lambda facts: facts,
        done: Callable[[Any], object] = lambda _result: None,
    ) -> None:
        """Make a change after those before it, ``done(its result)``, then read the facts again. Until it is written they
        are ``shown(facts)``, and the next choice starts from that. Errors are also shown as a message if the page has been
        left. ``undo``: what has happened, and how to take it back."""
        before, written = self._last_written, threading.Event()
        self._last_written = written

        def write() -> object:
            before.wait()  # of two quick taps the last counts, and the first has a thread already
            try:
                return work()
            finally:
                written.set()

        def ended(known: SettingsFacts) -> None:
            self._unwritten.remove(shown)
            self.take(known)
            self.show()
            self.refresh()

        def is_done(result: object) -> None:
            ended(shown(self._known))
            if undo is not None:
                self.offer_undo(*undo)
            done(result)

        def not_done(problem: BaseException) -> None:
            if failed is not None:
                failed(problem)
            ended(self._known)
            if failed is None or self.is_late:
                self.shell.say_problem(problem)

        self._unwritten.append(shown)
        self.facts = shown(self.facts)
        self.run(write, is_done, not_done)
        self.show()

    def save(
        self,
        failed: Callable[[BaseException], object] | None = None,
        undo: tuple[str, Callable[[], object]] | None = None,
        **changes: Any,
    ) -> None:
        """Change settings, at once."""
        catalogue = self.services.catalogue
        self.change(
            lambda: catalogue.change_settings(**changes),
            failed,
            undo,
            lambda facts: replace(facts, settings=replace(facts.settings, **changes)),
        )

    def take(self, facts: SettingsFacts) -> None:
        """They are stored; a choice that is not written yet stays."""
        self.facts = self._known = facts
        for shown in self._unwritten:
            self.facts = shown(self.facts)

    def was_saved(self, kind: str, it: Any) -> None:
        """The next edit starts from it."""
        self.take(self._known.having(kind, it))
        self.show()
        self.refresh()

    def opened(self, kind: str) -> int | None:
        """The id of what of that kind is in the sheet."""
        sheet: Any = self.shell.sheets.top
        return sheet.stored_id if getattr(sheet, "kind", "") == kind else None

    def page_left(self) -> None:
        """The open page, for another one or for another screen."""
        self.shell.sheets.give_up()
        self._pages_left += 1

    def offer_undo(self, text: str, undo: Callable[[], object]) -> None:
        """Show ``text`` with Undo, which asks for the PIN like Settings."""
        self.shell.offer_undo(text, undo, self.refresh, behind="settings")

    def say(self, text: str, icon: str = "check") -> None:
        self.shell.snackbars.show(text, icon=icon)


class SettingsPage(BoxLayout):
    """One section. Its properties for kv are in ``vm``, an instance of ``Model``."""

    vm = ObjectProperty(None, rebind=True, allownone=True)
    Model: type[EventDispatcher] = EventDispatcher

    def __init__(self, context: PageContext) -> None:
        self.context = context
        if type(context.model) is not self.Model:
            context.model = self.Model()
        super().__init__(vm=context.model, orientation="vertical")

    def show(self) -> None:
        """Show the facts of the context; called once a second and after every change."""

    @property
    def parts(self) -> Sequence[tuple[str, str]]:
        """Keys and words of the parts that it can show in place of each other; ``vm.part`` is the one that it shows."""
        return ()

    def turn_to(self, part: str) -> None:
        """Show another of its parts."""
        self.vm.part = part
        self.show()

    @property
    def is_busy(self) -> bool:
        """Whether something is under way whose end it has to show."""
        return False

    def reached(self, **intent: Any) -> None:
        """The section was opened, with what ``shell.go`` was given (``add=True``, ``robot_id=3``)."""


class ValuesPage(SettingsPage):
    """Some of the ``settings``; ``problems`` says by their names why one was not saved."""

    settings = ObjectProperty(Settings(), rebind=True)
    problems = DictProperty(rebind=True)

    def show(self) -> None:
        self.settings = self.context.facts.settings

    def reached(self, **intent: Any) -> None:
        self.problems = {}

    def set(self, name: str, value: Any) -> None:
        """Save it at once."""
        self.problems.pop(name, None)
        self.context.save(lambda problem: self.refuse(name, problem), **{name: value})

    def refuse(self, name: str, problem: BaseException) -> None:
        self.problems[name] = sentence_of(problem)


class SwitchRow(Fires, BoxLayout):
    """A label, a note and a switch that shows what is saved: ``on_switch(wanted)``."""

    text = StringProperty()
    note = StringProperty()
    active = BooleanProperty(False)

    __events__ = ("on_switch",)


class Outcome(PartSlot):
    """The result of an action; hidden without a text."""

    notice = ObjectProperty(NoticeView(), rebind=True)


class OutcomeNotice(Notice):
    """Says it; ``card`` is the outcome."""

    card = ObjectProperty(None, rebind=True)
