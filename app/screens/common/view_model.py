"""How a screen is written.

A screen is three things: a kv file (layout only), a widget class as thin as possible (``ScreenBase``), and a view model whose properties kv
reads. The view model asks services in the background and shows what comes back; it decides nothing that a service could decide, and keeps
no state of its own that a service has. It is made once and lives as long as the app; its screen is thrown away and built again for other
sizes. So what has to survive is in the view model: the tab, filters, a draft.

    @dataclass(frozen=True)
    class LogsServices:                                       # the services that this screen uses, named as in the container
        history: History

    class LogsViewModel(ViewModel):
        rows = ListProperty()

        def __init__(self, services, shell):
            super().__init__()
            self._services, self._shell = services, shell
            self._refresher = Refresher(shell, self._reading, self._take)

        def opened(self, execution_id=None):                  # on screen now; the intent of shell.go("logs", execution_id=7)
            self.keep(self._shell.bus.subscribe(Changed, self._changed))
            self.keep(self._refresher.start())
            self._refresher.read()

        def _changed(self, event):
            if event.topic is Topic.EXECUTIONS:
                self._refresher.request()

        def _reading(self):
            return lambda: read_facts(self._services)         # the work, run on another thread

        def _take(self, facts):
            self.rows = [log_row(run) for run in facts.runs]  # a pure function of plain values, tested without kivy

        def retranslated(self):                               # the language was switched: build the texts again
            self._refresher.request()

    class LogsScreen(ScreenBase):
        Services, Model = LogsServices, LogsViewModel         # the app makes LogsScreen(LogsViewModel(services, shell))

        def __init__(self, vm, **kwargs):
            super().__init__(vm=vm, **kwargs)
            self.vm.bind(story=self._show_tabs)               # not fbind, which would keep the screen as long as the view model

    # kv/logs/screen.kv
    <LogsScreen>:                                             # an MDScreen
        LongList:
            viewclass: "RunRow"
            data: root.vm.rows
            on_action: root.vm.toggle(args[1])                # args: list, key, action, values …

Rules
- Everything here runs on the UI thread. Other threads publish: ``bus.publish(event, key=robot_id)``; events with one key are coalesced,
  handlers get at most a hundred a frame. ``background.run(work, done, failed)`` runs ``work`` on another thread and the rest here; with
  ``key=`` newer work supersedes older. Setting a kivy property or building a widget on another thread crashes, sooner or later.
- Between ``opened`` and ``closed`` a view model subscribes (``keep``) and ticks (``every``); the base class ends both. A screen that is
  not shown costs nothing.
- In kv: ids directly (``field.text``), never ``root.ids.field.text`` (it leaks the widget); no arithmetic beyond layout; texts as
  ``tr._("Save")``; ``root.vm`` is rebindable. In Python: ``_("…")``, and ``ngettext`` for counts; never join parts of sentences.
- Work over 300 ms is shown: give the button ``busy: root.vm.saving``. Every action has a visible result: the new state, a sentence at the
  field, or ``shell.snackbars.show(_("Saved"))``. Deleting: do it, then ``shell.snackbars.undo(text, _("Undo"), undo)``.
- Ask only before what can't be undone, or takes more with it: ``shell.sheets.ask(title, text, action, done, keep)``.
  ``shell.dialogs`` has ``choose``, ``choose_many``, ``pick_time``, ``pick_date`` and ``menu``.
- A screen has no title of its own: the top bar has its ``tabs`` (``tab``, ``choose_tab``), else its name, and ``can_go_back`` an arrow.
- Sizes of targets come from ``tk.h_touch``, ``tk.h_field``, ``tk.h_foot``. Glove mode is another density, text size another font scale:
  then frame and screens are built again. Windows are ``root.tall``, ``root.low``, else wide, whatever a banner takes of the page.
- Fields go red with a sentence in ``problem``; fields of settings commit when the focus leaves them (``on_commit``).

Tests: ``tests/ui/conftest.py`` gives the fixture ``ui`` (taps, typing, virtual time); ``tests/screenshots`` takes the pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from kivy.clock import Clock
from kivy.core.window import Window
from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivymd.uix.screen import MDScreen
from kivymd.uix.screenmanager import MDScreenManager

from app.i18n import translator
from app.screens.common.overlays import Dialogs
from app.screens.common.threads import Background, Changed, Job, UiBus
from app.widgets.dock import dock, is_low, is_tall
from app.widgets.events import Fires
from app.widgets.places import places
from app.widgets.snackbar import Snackbars

if TYPE_CHECKING:
    from app.screens.common.shell import Shell

T = TypeVar("T")

__all__ = [
    "Background",
    "Changed",
    "Dialogs",
    "Job",
    "Navigator",
    "Refresher",
    "ScreenBase",
    "Snackbars",
    "UiBus",
    "ViewModel",
]


class ViewModel(EventDispatcher):
    """Properties for kv, and what has to be released when the screen is hidden. Override ``opened``, ``closed``, ``retranslated``."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self._kept: list[Callable[[], object]] = []
        self._language = translator.language  # of its texts
        self.is_open = False

    def opened(self, *_args: Any, **intent: Any) -> None:
        """The screen is shown: subscribe, tick, load. ``intent`` is what ``shell.go`` was given."""

    def closed(self) -> None:
        """The screen is hidden; kept things are already released."""

    def retranslated(self) -> None:
        """The language has changed: build the texts of the properties again."""

    def keep(self, release: Callable[[], object]) -> None:
        """Call ``release`` when the screen is hidden."""
        self._kept.append(release)

    def every(self, seconds: float, call: Callable[[], object]) -> None:
        """Call ``call()`` every ``seconds`` while the screen is shown."""
        self.keep(Clock.schedule_interval(lambda _dt: call(), seconds).cancel)

    def open(self, **intent: Any) -> None:
        """Called by the screen."""
        if self.is_open:
            self.close()
        self.is_open = True
        self.keep(translator.subscribe(self._translate))
        if self._language != translator.language:  # switched while it was hidden
            self._translate()
        self.opened(**intent)

    def _translate(self) -> None:
        self._language = translator.language
        self.retranslated()

    def close(self) -> None:
        """Called by the screen."""
        self.is_open = False
        while self._kept:
            self._kept.pop()()
        self.closed()


class Refresher(Generic[T]):
    """Reads for a screen off the UI thread, one reading at a time; a change during a reading requests one more.

    ``work()`` is called on the UI thread and returns what runs on another one; ``take(result)`` or
    ``failed(exception)`` follow on the UI thread. Several requests within a frame are one reading. Before ``start`` and
    after ``stop`` nothing is read. A result is dropped if ``wanted()`` has changed since, for which another reading was asked.
    """

    def __init__(
        self,
        shell: Shell,
        work: Callable[[], Callable[[], T]],
        take: Callable[[T], object],
        failed: Callable[[BaseException], object] | None = None,
        wanted: Callable[[], object] = lambda: None,
    ) -> None:
        self._shell, self._work, self._take, self._failed = shell, work, take, failed or shell.say_problem
        self._wanted = wanted
        self._job: Job | None = None
        self._is_stale = self._is_started = False
        self._soon = Clock.create_trigger(lambda _dt: self.read(), 0)

    def request(self, *_args: object) -> None:
        """Read in the next frame. On the UI thread, as everything here."""
        if self._is_started:
            self._soon()

    def read(self) -> None:
        """Read now, or again after the current reading."""
        if not self._is_started:
            return
        self._is_stale = self._job is not None
        if self._job is None:
            work, wanted = self._work(), self._wanted()

            def done(result: T) -> None:
                self._ended()
                if wanted == self._wanted():
                    self._take(result)

            def not_done(problem: BaseException) -> None:
                self._ended()
                self._failed(problem)

            self._job = self._shell.background.run(work, done, not_done)

    def reread(self) -> None:
        """Something was just stored: a reading under way may have been begun before, and is dropped."""
        if self._job is not None:
            self._job.cancel()
            self._job = None
        self.request()

    def start(self) -> Callable[[], None]:
        """From now on it reads when it is asked to; returns ``stop``."""
        self._is_started = True
        return self.stop

    def stop(self) -> None:
        """A reading under way is dropped."""
        self._is_started = False
        self._soon.cancel()
        if self._job is not None:
            self._job.cancel()
            self._job = None

    def _ended(self) -> None:
        self._job = None
        if self._is_stale:
            self.request()


class ScreenBase(MDScreen):
    """A screen: a view model, and a widget that fills it. The navigator says when it is shown. The frame shows its ``tabs``, with the
    chosen ``tab`` marked, and an arrow if it ``can_go_back``; without tabs its name.

    ``tall`` and ``low`` (as in app/widgets/dock.py) are the window's, whatever the frame takes of it.
    """

    vm = ObjectProperty(None, rebind=True, allownone=True)
    tabs = ListProperty()
    tab = ObjectProperty(None, allownone=True)
    can_go_back = BooleanProperty(False)
    tall = BooleanProperty(False)
    low = BooleanProperty(False)

    def shown(self, **intent: Any) -> None:
        if self.vm is not None:
            self.vm.open(**intent)

    def hidden(self) -> None:
        if self.vm is not None:
            self.vm.close()

    def choose_tab(self, key: Any) -> None:
        """A tab was tapped."""
        self.tab = key

    def go_back(self) -> None:
        """The arrow was tapped."""

    def on_size(self, *_: Any) -> None:
        self.tall, self.low = is_tall(*Window.size), is_low(Window.height)


class Navigator(Fires, EventDispatcher):
    """Shows one screen at a time in ``manager``, built on its first visit by ``builders[name]()``.

    Going to the present screen shows it again with the new intent.
    """

    current = StringProperty()
    all_robots = BooleanProperty(False)  # were looked at last, and not the selected one alone
    robot_id = NumericProperty(None, allownone=True)  # of the robot that Home shows, before its choice is stored
    guard: Callable[[str, Callable[[], object]], object] | None = (
        None  # asked before a screen is shown; proceeds, or not
    )

    __events__ = ("on_hide",)

    def __init__(
        self, manager: MDScreenManager, builders: Mapping[str, Callable[[], ScreenBase]], **kwargs: Any
    ) -> None:
        super().__init__(**kwargs)
        self._manager = manager
        self._builders = dict(builders)
        self._shown: ScreenBase | None = None

    def go(self, name: str, **intent: Any) -> None:
        """Show the screen ``name``, unless the guard asks for something first. Raises KeyError for an unknown one."""
        self.past_guard(name, lambda: self.show(name, **intent))

    def past_guard(self, name: str, proceed: Callable[[], object]) -> None:
        """Run an action allowed only to users who may see the screen ``name``: perhaps after the guard has asked,
        perhaps never."""
        if self.guard is None:
            proceed()
        else:
            self.guard(name, proceed)

    def show(self, name: str, **intent: Any) -> None:
        """Past its guard."""
        screen = self.screen(name)
        self._hide()
        self._manager.current = self.current = name
        self._shown = screen
        screen.shown(**intent)

    def screen(self, name: str) -> ScreenBase:
        """The screen ``name``, built if it was never visited."""
        if not self._manager.has_screen(name):
            new = self._builders[name]()
            new.name = name
            self._manager.add_widget(new)
        screen: ScreenBase = self._manager.get_screen(name)
        return screen

    @property
    def built(self) -> list[str]:
        return list(self._manager.screen_names)

    def rebuild(self, manager: MDScreenManager | None = None, gone: Callable[[], object] = lambda: None) -> None:
        """Remove all screens and build the present one again (glove mode, text size), in another ``manager`` if there is a new one; the
        others follow when visited. ``gone`` is called in between."""
        self._clear()
        self._manager = manager or self._manager
        gone()
        if self.current:
            self.show(self.current)

    def close(self) -> None:
        """The window is closing: hide the present screen."""
        self._clear()
        self.current = ""

    def _clear(self) -> None:
        self._hide()
        self._manager.clear_widgets()

    def _hide(self) -> None:
        if self._shown is not None:
            self.dispatch("on_hide")
            places.let_go()  # a finger on it presses nothing any more
            dock.leave(self._shown)
            self._shown.hidden()
            self._shown = None
