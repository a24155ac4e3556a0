"""Logs: what happened, and how well. Facts are read in the background and turned into words by the view modules."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any
from zoneinfo import ZoneInfo

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, StringProperty
from kivy.uix.widget import Widget

from app.i18n import _
from app.screens.common.mission_names import MissionNameLookup, MissionNames
from app.screens.common.name_order import with_id
from app.screens.common.shell import Shell
from app.screens.common.view_model import Changed, Job, Refresher, ScreenBase, ViewModel
from app.screens.logs import cards, of_groups, view  # noqa: F401  (kv's Factory learns the cards)
from app.screens.logs.activity_tab import ActivityTab
from app.screens.logs.facts import PAGE, LogsFacts, LogsServices, read_facts, read_next_page
from app.screens.logs.figures_tab import FiguresTab
from app.screens.logs.files import LogsFiles
from app.screens.logs.of_groups import OfGroup
from app.screens.logs.run_story import RunStory
from app.screens.logs.view import Filters, Period
from app.services.live.changes import Topic
from app.widgets import load_kv
from app.widgets.items import Item, Option
from app.widgets.tabs import Tab

MAX_ROWS = 5000  # kept in the list; older runs are found with the filters
SEARCH_DELAY_S = 0.3  # after the last key
REFRESH_S = 60.0  # the figures depend on the time of day too


class LogsViewModel(ViewModel):
    """The runs, and the filters that all tabs go by; ``figures``, ``activity``, ``story`` and ``files`` have their own properties."""

    part = StringProperty("runs")
    period = StringProperty()  # its words
    robot = StringProperty()
    one_robot = BooleanProperty(False)
    counts = ListProperty()
    filters = ListProperty()  # that narrow the list
    rows = ListProperty()
    empty_text = StringProperty()
    searching = BooleanProperty(False)
    query = StringProperty()

    def __init__(self, services: LogsServices, shell: Shell) -> None:
        super().__init__()
        self._services, self._shell = services, shell
        self.wanted = Filters()
        self.facts = LogsFacts()
        self.story, self.files = RunStory(services, shell, self), LogsFiles(services, shell, self)
        self.figures, self.activity = FiguresTab(services, shell, self), ActivityTab(services, shell, self)
        self._items: list[Item] = []  # of the facts' runs
        self._names = MissionNameLookup(services.robot_missions, services.clock, shell, self._learnt)
        self._next_page: Job | None = None
        self._refresher = Refresher(shell, self._start_reading, self._take, wanted=lambda: self.wanted)
        self._search_soon = Clock.create_trigger(lambda _dt: self.set_filters(text=self.query), SEARCH_DELAY_S)

    @property
    def zone(self) -> ZoneInfo:
        return self.facts.zone

    # ------------------------------------------------------------------ reading
    def opened(self, execution_id: int | None = None, unfiltered: bool = False) -> None:
        """``execution_id``: show the story of that run; ``unfiltered``: the runs, without filters."""
        self.keep(self._shell.bus.subscribe(Changed, self._changed))
        self.story.start()
        for refresher in (self._refresher, self.figures.refresher, self.activity.refresher):
            self.keep(refresher.start())
        self.every(REFRESH_S, self.read)
        self._name_filters()
        if execution_id is not None:
            self.story.follow(execution_id)
        elif unfiltered:
            self.show_runs(Filters())
        else:
            self.read()

    def closed(self) -> None:
        self.close_story()

    def retranslated(self) -> None:
        first = replace(self.facts, rows=self.facts.rows[:PAGE])  # the others when they are read
        self._items = self._listed(first, self._shell.mission_names.known)
        self._show()
        self.read()

    def _changed(self, event: Changed) -> None:
        """Robots report many times a second; what they do becomes history only with the executions."""
        if event.topic is not Topic.SNAPSHOT:
            self._refresher.request()

    def read(self) -> None:
        self._refresher.read()

    def _start_reading(self) -> Callable[[], tuple[int, LogsFacts, list[Item]]]:
        """With the names known now: robots may report more while a search is open."""
        names = self._shell.mission_names.known
        self.wanted = filters = replace(self.wanted, values=names.positions_with(self.wanted.text))
        rows = min(MAX_ROWS, max(PAGE, len(self.facts.rows)))

        def read() -> tuple[int, LogsFacts, list[Item]]:
            facts = read_facts(self._services, filters, rows)
            return rows, facts, self._listed(facts, names)

        return read

    def _listed(self, facts: LogsFacts, names: MissionNames) -> list[Item]:
        """Off the UI thread, as there may be thousands."""
        return view.listed(
            facts.rows, facts.filters.folds, self._services.clock.now(), facts.zone, facts.expected, names
        )

    def _take(self, reading: tuple[int, LogsFacts, list[Item]]) -> None:
        rows, facts, items = reading
        if min(len(self.facts.rows), MAX_ROWS) > max(rows, len(facts.rows)):  # more were loaded since
            self._refresher.request()
            return
        self.facts, self._items = facts, items
        self._show()
        self._look_for_names()
        self._read_part()

    def _read_part(self) -> None:
        """What the present tab shows next to the filters and the runs."""
        if self.part != "runs":
            getattr(self, self.part).refresher.read()
        elif self.story.run is not None:
            self.story.refresher.read()

    def load_more(self) -> None:
        """The end of the list is near."""
        facts, is_loading = self.facts, self._next_page is not None and not self._next_page.finished
        if is_loading or facts.next is None or len(facts.rows) >= MAX_ROWS:
            return
        names = self._shell.mission_names.known

        def read() -> tuple[LogsFacts, list[Item]]:
            more = facts.with_more(read_next_page(self._services, facts))
            return more, self._listed(more, names)

        def loaded(reading: tuple[LogsFacts, list[Item]]) -> None:
            if self.facts is facts:
                self.facts, self._items = reading
                self._show_rows()
                self._look_for_names()
            elif facts.filters == self.wanted == self.facts.filters:
                self.load_more()  # the list was read again since: this page does not follow its last row

        self._next_page = self._shell.background.run(read, loaded, self._shell.say_problem)

    # ------------------------------------------------------------------ showing
    def _show(self) -> None:
        self._name_filters()
        self.counts = view.counts(self.facts.counts, self.wanted)
        self.empty_text = view.empty_text(self.wanted)
        self._show_rows()
        self.story.show()
        self._show_part()

    def _show_part(self) -> None:
        if self.part != "runs":
            getattr(self, self.part).show()

    def _name_filters(self) -> None:
        filters, robots = self.wanted, self.facts.robots
        self.period, self.robot = view.period_word(filters.period), view.robot_word(filters, robots)
        self.one_robot, self.filters = filters.robot_ids is not None, view.set_filters(filters, robots)

    def _show_rows(self) -> None:
        """The one whose story is shown is marked."""
        self.rows = [replace(item, look="chosen") if item.key == self.story.run else item for item in self._items]

    def _look_for_names(self) -> None:
        rows = ((row.robot_id, row.mission_guid, row.parameters) for row in self.facts.rows)
        self._names.look(self.facts.robots, rows)

    def _learnt(self) -> None:
        """Names of positions: they stand in rows, and a search may find more."""
        self._refresher.request()

    # ------------------------------------------------------------------ the rows
    def row_action(self, key: int, _action: str = "open") -> None:
        """A row was tapped: its story is shown; of several of one cause, all of them."""
        facts = self.facts
        run = with_id(facts.rows, key)
        if run is None:
            return
        if facts.filters.folds and {each.id: n for each, n in view.folded(facts.rows, facts.zone)}[key] > 1:
            self.set_filters(like=view.like_of(run, facts.zone))
        else:
            self.open_story(key)

    def open_story(self, key: int) -> None:
        self.story.open(key)
        self._show_rows()

    def close_story(self) -> None:
        self.story.close()
        self._show_rows()

    def show_runs(self, filters: Filters, opened_run: int | None = None) -> None:
        """Their tab, without a search."""
        self._search_soon.cancel()
        self.part, self.searching, self.query = "runs", False, ""
        self._use(filters, opened_run)

    # ------------------------------------------------------------------ the filters
    def set_filters(self, **changes: Any) -> None:
        """Fields of ``Filters`` by name; the others stay."""
        self._use(replace(self.wanted, **changes))

    def _use(self, filters: Filters, opened_run: int | None = None) -> None:
        if opened_run is None:
            self.close_story()
        if filters != self.wanted:
            self.wanted = filters
            self.facts, self._items = replace(self.facts, rows=()), []
        self._show()
        self.read()

    def choose_part(self, part: str) -> None:
        """What a tab shows."""
        if part != self.part:
            if self.story.forget_link():
                self.read()  # which would have followed it
            self.close_story()
            self.part = part
            self._show_part()
            self._read_part()

    def choose_period(self) -> None:
        self._shell.dialogs.choose(
            _("Period"),
            view.period_options(),
            lambda period: self.set_filters(period=Period(period), day=None),
            selected=self.wanted.period,
        )

    def show_only(self, outcome: str) -> None:
        """The runs that ended so; again: all."""
        self.set_filters(outcomes=() if self.wanted.outcomes == (outcome,) else (outcome,))

    def clear(self, name: str) -> None:
        """End one of the filters that are set."""
        self._use(view.cleared(self.wanted, name))

    def choose_filter(self, anchor: Widget) -> None:
        choices: dict[str, Callable[[], object]] = {
            "problems": lambda: self.set_filters(outcomes=view.PROBLEMS, like=None),
            "outcomes": lambda: self._choose_some("outcomes", _("Outcome"), view.outcome_options()),
            "robot": self.choose_robot,
            "mission": self._choose_mission,
            "triggers": lambda: self._choose_some("triggers", _("Started by"), view.trigger_options()),
        }
        self._shell.dialogs.menu(anchor, "", view.filter_menu(), lambda key: choices[key]())

    def choose_robot(self) -> None:
        self._shell.dialogs.choose(
            _("Robot"),
            of_groups.target_options(self.facts.groups, self.facts.robots),
            self._choose_whose,
            selected=self.wanted.group or self.wanted.robot_id or 0,
        )

    def _choose_whose(self, key: OfGroup | int) -> None:
        is_group = isinstance(key, OfGroup)
        self.set_filters(group=key if is_group else None, robot_id=None if is_group else key or None)

    def _choose_some(self, name: str, title: str, options: list[Option]) -> None:
        """Values of a filter; none: all."""
        self._shell.dialogs.choose_many(
            title,
            options,
            _("Show"),
            lambda keys: self.set_filters(**{name: tuple(keys)}),
            selected=getattr(self.wanted, name),
        )

    def _choose_mission(self) -> None:
        self._shell.dialogs.choose(
            _("Mission"),
            view.mission_options(self.facts.missions),
            lambda name: self.set_filters(mission=name or None),
            selected=self.wanted.mission or "",
        )

    def toggle_search(self) -> None:
        """Closing the search also clears it."""
        self.searching = not self.searching
        if not self.searching:
            self.search("")

    def search(self, text: str) -> None:
        """Search once typing has paused."""
        if text != self.query:
            self.story.forget_link()
            self.query = text
            self._search_soon.cancel()
            self._search_soon()

    def choose_more(self, anchor: Widget) -> None:
        """Commands for the list."""
        off = _("Being exported") if self.files.exporting else "" if self.facts.count else _("Nothing to export")
        export = Option("export", view.export_text(self.facts.count), "file-export-outline", off=off)
        self._shell.dialogs.menu(anchor, "", [export], lambda _key: self.files.export())


class LogsScreen(ScreenBase):
    """Three tabs."""

    Services, Model = LogsServices, LogsViewModel

    def __init__(self, vm: LogsViewModel, **kwargs: Any) -> None:
        load_kv("logs/screen", "logs/figures", "logs/activity")
        super().__init__(vm=vm, **kwargs)
        vm.bind(part=self._show_tabs)
        self._show_tabs()

    def shown(self, **intent: Any) -> None:
        self._show_tabs()  # in the language of now
        super().shown(**intent)

    def _show_tabs(self, *_args: object) -> None:
        words = {"runs": _("Runs"), "figures": _("Key figures"), "activity": _("Activity")}
        self.tabs = [Tab(key, word) for key, word in words.items()]
        self.tab = self.vm.part

    def choose_tab(self, key: str) -> None:
        self.vm.choose_part(key)
