"""Logs: what happened, and how well. Facts are read in the background and turned into words by the view modules."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar
from zoneinfo import ZoneInfo

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivy.uix.widget import Widget

from app.domain.models import Trigger
from app.i18n import _, ngettext
from app.screens.common.mission_names import MissionNameLookup
from app.screens.common.options import MenuItem
from app.screens.common.places import choose_place
from app.screens.common.shell import Shell
from app.screens.common.start_now import start_now
from app.screens.common.started import StartReports, as_it_is, say_not_started
from app.screens.common.view_model import Changed, Job, Refresher, ScreenBase, ViewModel
from app.screens.logs import activity, cards, key_figures, numbers, of_groups, report_page, view  # noqa: F401  (kv's Factory learns the cards)
from app.screens.logs.activity import ActivityFacts, Window
from app.screens.logs.facts import (
    PAGE,
    LogsFacts,
    LogsServices,
    execution_filter,
    period_with,
    read_facts,
    read_next_page,
    read_story,
)
from app.screens.logs.figures import Figures, read_figures
from app.screens.logs.key_figures import FiguresPage
from app.screens.logs.numbers import Explanation
from app.screens.logs.of_groups import OfGroup
from app.screens.logs.story import Story, StoryFacts, story
from app.screens.logs.view import Filters, Period
from app.services.history.shift_report import ReportPeriod, ShiftReport
from app.services.live.changes import Topic
from app.widgets import load_kv
from app.widgets.figures import FigureDialog
from app.widgets.items import Item
from app.widgets.snackbar import Message
from app.widgets.tabs import Tab

T = TypeVar("T")
Deep = tuple[Filters, Window, Figures | None, ActivityFacts | None]

MAX_ROWS = 5000  # kept in the list; older runs are found with the filters
SEARCH_DELAY_S = 0.3  # after the last key
REFRESH_S = 60.0  # the figures depend on the time of day too
PATH_SHOWN_S = 12.0  # long enough to read where a file was written


class LogsViewModel(ViewModel):
    """What kv reads."""

    part = StringProperty("runs")
    period = StringProperty()  # its words
    robot = StringProperty()
    one_robot = BooleanProperty(False)
    counts = ListProperty()
    filters = ListProperty()  # that narrow the list
    rows = ListProperty()
    opened_run = ObjectProperty(None, allownone=True)  # id of the run whose story is shown, or being read
    story = ObjectProperty(Story(), rebind=True)
    like = ObjectProperty(Item(None), rebind=True)  # the row that leads to the runs of the same cause
    covers = BooleanProperty(False)  # the story covers the list: the window is low or narrow
    empty_text = StringProperty()
    searching = BooleanProperty(False)
    query = StringProperty()
    exporting = BooleanProperty(False)
    reporting = BooleanProperty(False)
    figures = ObjectProperty(FiguresPage(), rebind=True)
    lanes = ListProperty()
    ticks = ListProperty()
    legend = ListProperty()
    mark = ObjectProperty(None, allownone=True)  # the band whose details are shown
    window = StringProperty()  # the length of the time that the lanes show
    when = StringProperty()
    is_now = BooleanProperty(True)

    def __init__(self, services: LogsServices, shell: Shell) -> None:
        super().__init__()
        self._services, self._shell = services, shell
        self._filters, self._window = Filters(), Window()
        self._facts = LogsFacts()
        self._story_facts: StoryFacts | None = None
        self._is_linked = False  # the story was asked for by another screen: its list has to have it
        self._figures: Figures | None = None
        self._activity: ActivityFacts | None = None
        self._open_group: Hashable = None
        self._row_cache = view.RowCache()
        self._names = MissionNameLookup(services.robot_missions, services.clock, shell, self._learnt)
        self._next_page: Job | None = None
        self._runs_refresher = Refresher(shell, self._start_reading, self._take)
        self._story_refresher = Refresher(shell, self._start_reading_story, self._take_story)
        self._deep_refresher = Refresher(shell, self._start_reading_deep, self._take_deep)
        self._started = StartReports(shell, as_it_is(services.history, services.holds))
        self._search_soon = Clock.create_trigger(lambda _dt: self.set_filters(text=self.query), SEARCH_DELAY_S)

    # ------------------------------------------------------------------ reading
    def opened(self, execution_id: int | None = None, unfiltered: bool = False) -> None:
        """``execution_id``: show the story of that run; ``unfiltered``: the runs, without filters."""
        self.keep(self._shell.bus.subscribe(Changed, self._changed))
        self.keep(self._started.open())
        for refresher in (self._runs_refresher, self._story_refresher, self._deep_refresher):
            self.keep(refresher.start())
        self.every(REFRESH_S, self._read)
        if execution_id is not None:
            self._is_linked, self.opened_run = True, execution_id
            self._story_refresher.read()
        elif unfiltered:
            self._show_runs(Filters())
        else:
            self._read()

    def closed(self) -> None:
        self._forget_link()

    def retranslated(self) -> None:
        self._show()

    def _changed(self, event: Changed) -> None:
        """Robots report many times a second; what they do becomes history only with the executions."""
        if event.topic is not Topic.SNAPSHOT:
            self._runs_refresher.request()

    def _read(self) -> None:
        self._runs_refresher.read()

    def _start_reading(self) -> Callable[[], tuple[int, LogsFacts]]:
        """With the names known now: robots may report more while a search is open."""
        self._filters = filters = replace(
            self._filters, values=self._shell.mission_names.known.positions_with(self._filters.text)
        )
        rows = min(MAX_ROWS, max(PAGE, len(self._facts.rows)))
        return lambda: (rows, read_facts(self._services, filters, rows))

    def _take(self, reading: tuple[int, LogsFacts]) -> None:
        rows, facts = reading
        if facts.filters != self._filters:  # they are being read again
            return
        if min(len(self._facts.rows), MAX_ROWS) > max(rows, len(facts.rows)):  # more were loaded since
            self._runs_refresher.request()
            return
        self._facts = facts
        self._show()
        if self.part != "runs":
            self._deep_refresher.read()
        elif self.opened_run is not None:
            self._story_refresher.read()

    def _start_reading_deep(self) -> Callable[[], Deep]:
        """Figures and lanes are computed from many rows: only those of the present part."""
        services, filters, window, part = self._services, self._filters, self._window, self.part
        now, zone = services.clock.now(), self._facts.zone
        return lambda: (
            filters,
            window,
            read_figures(services, filters, now, zone) if part == "figures" else None,
            activity.read_activity(services, filters, window, now) if part == "activity" else None,
        )

    def _take_deep(self, found: Deep) -> None:
        filters, window, figures, lanes = found
        if (filters, window) == (self._filters, self._window):
            self._figures, self._activity = figures or self._figures, lanes or self._activity
            self._show_deep()

    def load_more(self) -> None:
        """The end of the list is near."""
        facts, is_loading = self._facts, self._next_page is not None and not self._next_page.finished
        if is_loading or facts.next is None or len(facts.rows) >= MAX_ROWS:
            return

        def loaded(page: LogsFacts) -> None:
            if self._facts is facts:
                self._facts = facts.with_more(page)
                self._show_rows()
            elif facts.filters == self._filters == self._facts.filters:
                self.load_more()  # the list was read again since: this page does not follow its last row

        self._next_page = self._shell.background.run(
            lambda: read_next_page(self._services, facts), loaded, self._shell.say_problem
        )

    # ------------------------------------------------------------------ the story of one run
    def _start_reading_story(self) -> Callable[[], tuple[int | None, StoryFacts | None]]:
        services, run = self._services, self.opened_run
        return lambda: (run, None if run is None else read_story(services, run))

    def _take_story(self, found: tuple[int | None, StoryFacts | None]) -> None:
        run, facts = found
        if run != self.opened_run or run is None:
            return
        if facts is None:
            self._shell.snackbars.show(_("This run is no longer in the history"), icon="information-outline")
            self.close_story()
            self._read()
            return
        self._story_facts = facts
        if self._is_linked:
            self._is_linked = False
            zone = ZoneInfo(self._services.settings().timezone)
            self._show_runs(Filters(period_with(facts.run.planned_at, self._services.clock.now(), zone)), run)
        self._show_story()

    def _show_story(self) -> None:
        if self._story_facts is not None and self._story_facts.run.id == self.opened_run:
            now = self._services.clock.now()
            self.story = story(self._story_facts, now, self._facts.zone, self._shell.mission_names.known)
            self.like = Item("like", self.story.like, meta_icon="chevron-right", strong=False)

    def close_story(self) -> None:
        self.opened_run, self._story_facts, self._is_linked, self.story = None, None, False, Story()
        self._show_rows()

    def _forget_link(self) -> None:
        """The user has moved on: it must not undo a newer choice."""
        if self._is_linked:
            self.close_story()

    def _show_runs(self, filters: Filters, opened_run: int | None = None) -> None:
        """Their part of the screen, without a search."""
        self._search_soon.cancel()
        self.part, self.searching, self.query = "runs", False, ""
        self._use(filters, opened_run)

    # ------------------------------------------------------------------ showing
    def _show(self) -> None:
        facts, filters = self._facts, self._filters
        self.period, self.robot = view.period_word(filters.period), view.robot_word(filters, facts.robots)
        self.one_robot = filters.robot_ids is not None
        self.counts, self.filters = view.counts(facts.counts, filters), view.set_filters(filters, facts.robots)
        self.empty_text = view.empty_text(filters)
        self._show_rows()
        self._show_story()
        self._show_deep()

    def _show_rows(self) -> None:
        facts, now, names = self._facts, self._services.clock.now(), self._shell.mission_names.known
        pairs = [(run, 1) for run in facts.rows]
        if facts.filters.folds:
            pairs = list(view.folded(facts.rows, facts.zone))
        runs = [run for run, _number in pairs]
        items = [
            view.several(item, like, number) if number > 1 and (like := view.like_of(run, facts.zone)) else item
            for item, (run, number) in zip(
                self._row_cache.rows(runs, now, facts.zone, facts.expected, names), pairs, strict=True
            )
        ]
        today = now.astimezone(facts.zone).date()
        self.rows = view.with_days(runs, items, today, facts.zone, self.opened_run)
        self._names.look(facts.robots, ((row.robot_id, row.mission_guid, row.parameters) for row in facts.rows))

    def _learnt(self) -> None:
        """Names of positions: a search may find more."""
        self._show_rows()
        if self._filters.text:
            self._runs_refresher.request()

    def _show_deep(self) -> None:
        if self.part == "figures":
            self.figures = key_figures.page(self._figures)
        found = self._activity
        self.window = activity.window_word(self._window)
        self.is_now = self._window.end is None
        if self.part == "activity" and found is not None:
            self.lanes, self.ticks = activity.lanes(found, self._open_group), activity.ticks(found, self._facts.zone)
            self.legend, self.when = activity.legend(found), activity.when(found, self._facts.zone)

    def explain(self, key: str) -> None:
        """What a figure means, and the numbers behind it."""
        if self._figures is not None:
            self._open_explanation(numbers.explanation(key, self._figures))

    def _open_explanation(self, found: Explanation) -> FigureDialog:
        return self._shell.dialogs.open(FigureDialog(title=found.title, text=found.text, rows=found.lines))

    # ------------------------------------------------------------------ the rows
    def row_action(self, key: int, _action: str = "open") -> None:
        """A row was tapped: its story is shown; of several of one cause, all of them."""
        run = next((row for row in self._facts.rows if row.id == key), None)
        if run is not None and self._facts.filters.folds and self._stands_for_several(key):
            self.set_filters(like=view.like_of(run, self._facts.zone))
        elif run is not None:
            self.open_story(key)

    def _stands_for_several(self, key: int) -> bool:
        return any(run.id == key and number > 1 for run, number in view.folded(self._facts.rows, self._facts.zone))

    def open_story(self, key: int) -> None:
        self.opened_run = key
        self._show_rows()
        self._story_refresher.reread()

    def step_story(self, by: int) -> None:
        """The story of the next run in the list: -1 above, 1 below."""
        runs = [row.key for row in self.rows if row.opens]
        pairs = pairwise(runs if by > 0 else runs[::-1])
        if (key := next((after for before, after in pairs if before == self.opened_run), None)) is not None:
            self.open_story(key)

    def show_like(self) -> None:
        """All runs that ended for the same cause as the opened one, in 30 days."""
        if self._story_facts is not None:
            self._show_runs(
                Filters(Period.MONTH, like=view.like_of(self._story_facts.run, self._facts.zone)), self.opened_run
            )

    def run_again(self) -> None:
        """Ask first: the reader may not see the robot. Not asked if nothing can be started now."""
        if self._story_facts is None:
            return
        run = self._story_facts.run
        mission, where = self._shell.mission_names.known.run(run), of_groups.any_of(run) or run.robot
        target = self._facts.target(run)  # if it is no longer there, starting it says so
        why_not, instead = (
            start_now(self._services, self._facts.settings, self._facts.robots, target)
            if target is not None
            else ("", "")
        )
        if why_not:
            say_not_started(self._shell, mission, where, why_not)
            return
        question = _("Run {mission} on {robot} now?").format(mission=mission, robot=where)
        self._shell.dialogs.confirm(
            question,
            "",
            instead or _("Run now"),
            lambda: self._shell.background.run(
                lambda: self._services.operator.run_again(run.id), self._started.follow, self._shell.say_problem
            ),
        )

    # ------------------------------------------------------------------ from the figures to their runs
    def show_cause(self, key: view.Like | None) -> None:
        """The failed runs of one cause, or of all the others."""
        self._show_runs(replace(self._of_figures(), outcomes=("failed",), like=key))

    def show_day(self, day: Any) -> None:
        self._show_runs(replace(self._of_figures(), day=day))

    def show_robot(self, robot_id: int) -> None:
        self._show_runs(replace(self._of_figures(), robot_id=robot_id, group=None))

    def show_mission(self, mission: str) -> None:
        self._show_runs(replace(self._of_figures(), mission=mission))

    def _of_figures(self) -> Filters:
        """What the figures count."""
        return Filters(self._filters.period, self._filters.robot_id, group=self._filters.group)

    # ------------------------------------------------------------------ the lanes
    def show_moment(self, robot_id: int, place: float) -> None:
        """What a robot did at ``place`` 0..1 of the time, from when to when."""
        facts = self._activity
        found = activity.span_at(facts, robot_id, place) if facts else None
        if facts is not None and found is not None:
            self.mark = robot_id, facts.place(found[1].start), facts.place(found[1].end)
            dialog = self._open_explanation(activity.span_details(*found, facts.end, self._facts.settings.timezone))
            dialog.bind(on_dismiss=lambda _dialog: setattr(self, "mark", None))

    def show_group(self, key: Hashable) -> None:
        self._open_group = key
        self._show_deep()

    def move(self, by: int) -> None:
        """The time before (-1) or after (1); 0: now."""
        now = self._services.clock.now()
        self._look(self._window.moved(by > 0, now) if by else Window(self._window.length))

    def choose_window(self) -> None:
        self._shell.dialogs.choose(
            _("Time"),
            activity.window_options(),
            lambda length: self._look(Window(length, self._window.end)),
            selected=self._window.length,
        )

    def _look(self, window: Window) -> None:
        self._window = window
        self._show_deep()
        self._deep_refresher.reread()

    # ------------------------------------------------------------------ the filters
    def set_filters(self, **changes: Any) -> None:
        """Fields of ``Filters`` by name; the others stay."""
        self._use(replace(self._filters, **changes))

    def _use(self, filters: Filters, opened_run: int | None = None) -> None:
        if opened_run is None:
            self.close_story()
        if filters != self._filters:
            self._filters = filters
            self._facts = replace(self._facts, rows=())
        self._show()
        self._read()

    def choose_part(self, part: str) -> None:
        """What a tab shows."""
        if part != self.part:
            if self._is_linked:
                self._forget_link()
                self._read()  # which would have followed it
            self.part = part
            self._show_deep()
            self._deep_refresher.read()

    def choose_period(self) -> None:
        self._shell.dialogs.choose(
            _("Period"),
            view.period_options(),
            lambda period: self.set_filters(period=Period(period), day=None),
            selected=self._filters.period,
        )

    def show_only(self, outcome: str) -> None:
        """The runs that ended so; again: all."""
        self.set_filters(outcomes=() if self._filters.outcomes == (outcome,) else (outcome,))

    def clear(self, name: str) -> None:
        """End one of the filters that are set."""
        self._use(view.cleared(self._filters, name))

    def choose_filter(self, anchor: Widget) -> None:
        choices: dict[str, Callable[[], object]] = {
            "problems": lambda: self.set_filters(outcomes=view.PROBLEMS, like=None),
            "outcomes": self._choose_outcomes,
            "robot": self.choose_robot,
            "mission": self._choose_mission,
            "triggers": self._choose_triggers,
        }
        self._shell.dialogs.menu(anchor, "", view.filter_menu(), lambda key: choices[key]())

    def choose_robot(self) -> None:
        self._shell.dialogs.choose(
            _("Robot"),
            of_groups.target_options(self._facts.groups, self._facts.robots),
            self._choose_whose,
            selected=self._filters.group or self._filters.robot_id or 0,
        )

    def _choose_whose(self, key: OfGroup | int) -> None:
        is_group = isinstance(key, OfGroup)
        self.set_filters(group=key if is_group else None, robot_id=None if is_group else key or None)

    def _choose_outcomes(self) -> None:
        self._shell.dialogs.choose_many(
            _("Outcome"),
            view.outcome_options(),
            _("Show"),
            lambda keys: self.set_filters(outcomes=tuple(keys)),
            selected=self._filters.outcomes,
        )

    def _choose_triggers(self) -> None:
        self._shell.dialogs.choose_many(
            _("Started by"),
            view.trigger_options(),
            _("Show"),
            lambda keys: self.set_filters(triggers=tuple(Trigger(key) for key in keys)),
            selected=self._filters.triggers,
        )

    def _choose_mission(self) -> None:
        self._shell.dialogs.choose(
            _("Mission"),
            view.mission_options(self._facts.missions),
            lambda name: self.set_filters(mission=name or None),
            selected=self._filters.mission or "",
        )

    def toggle_search(self) -> None:
        """Closing the search also clears it."""
        self.searching = not self.searching
        if not self.searching:
            self.search("")

    def search(self, text: str) -> None:
        """Search once typing has paused."""
        if text != self.query:
            self._forget_link()
            self.query = text
            self._search_soon.cancel()
            self._search_soon()

    # ------------------------------------------------------------------ files
    def choose_more(self, anchor: Widget) -> None:
        """Commands for the list."""
        count = self._facts.count
        export = MenuItem(
            "export", view.export_text(count), "file-export-outline", disabled=not count or self.exporting
        )
        self._shell.dialogs.menu(anchor, "", [export], lambda _key: self.export())

    def export(self) -> None:
        """Write the runs that the filters let through as a table, in the form and to the place that are asked for."""
        wanted = execution_filter(self._filters, self._services.clock.now(), self._facts.zone)

        def said(found: tuple[Path, int]) -> str:
            path, runs = found
            return ngettext("{n} run written to {path}", "{n} runs written to {path}", runs).format(n=runs, path=path)

        def write(for_excel: bool, directory: Path) -> None:
            self._write(
                "exporting", lambda: self._services.files.export_runs(wanted, directory, for_excel=for_excel), said
            )

        self._shell.dialogs.choose(
            view.export_text(self._facts.count),
            view.table_options(),
            lambda for_excel: choose_place(self._shell, self._services.files, partial(write, for_excel)),
        )

    def choose_report(self) -> None:
        """Ask for the period of a shift report, then write it as a page to print."""
        services, robot_id, group = self._services, self._filters.robot_id, self._filters.group
        robot, mission_names = view.robot_word(self._filters, self._facts.robots), self._shell.mission_names.known

        def make(key: str) -> ShiftReport:
            if group is None:
                return services.shift_reports.make(ReportPeriod(key), robot_id)
            return services.shift_reports.make(ReportPeriod(key), group=group.name, members=group.members)

        def work(key: str, directory: Path) -> tuple[ShiftReport, Path]:
            report = make(key)
            return report, services.files.write_text(
                report_page.page(report, mission_names), "report", ".html", directory
            )

        def write(key: str, directory: Path) -> None:
            self._write(
                "reporting",
                partial(work, key, directory),
                lambda done: _("Report written to {path}").format(path=done[1]),
                lambda done: self._open_explanation(report_page.on_screen(done[0], mission_names)),
            )

        self._shell.dialogs.choose(
            _("Shift report, {robot}").format(robot=robot),
            view.report_options(),
            lambda key: choose_place(self._shell, services.files, partial(write, key)),
        )

    def _write(
        self, busy: str, work: Callable[[], T], text: Callable[[T], str], show: Callable[[T], object] | None = None
    ) -> None:
        """Write a file and show its path, with a button to ``show`` its content; the property ``busy`` is True while it
        is written."""
        if getattr(self, busy):
            return
        setattr(self, busy, True)

        def written(result: T) -> None:
            setattr(self, busy, False)
            self._shell.snackbars.post(
                Message(
                    text(result),
                    "file-check-outline",
                    _("Show") if show else "",
                    partial(show, result) if show else None,
                    seconds=PATH_SHOWN_S,
                )
            )

        def failed(problem: BaseException) -> None:
            setattr(self, busy, False)
            self._shell.say_problem(problem)

        self._shell.background.run(work, written, failed)


class LogsScreen(ScreenBase):
    """Three tabs. In a low or narrow window the story of a run takes the place of them and of the list."""

    Services, Model = LogsServices, LogsViewModel

    def __init__(self, vm: LogsViewModel, **kwargs: Any) -> None:
        load_kv("logs/screen", "logs/figures", "logs/activity")
        super().__init__(vm=vm, **kwargs)
        vm.bind(part=self._show_tabs, story=self._show_tabs)
        for name in ("tall", "low"):
            self.fbind(name, self._show_tabs)
        self._show_tabs()

    def shown(self, **intent: Any) -> None:
        self._show_tabs()  # in the language of now
        super().shown(**intent)

    def _show_tabs(self, *_args: object) -> None:
        story = self.vm.story
        self.vm.covers = self.tall or self.low
        self.can_go_back = self.vm.covers and self.vm.part == "runs" and bool(story.key)
        words = {"runs": _("Runs"), "figures": _("Key figures"), "activity": _("Activity")}
        self.tabs = [Tab("story", story.title)] if self.can_go_back else [Tab(key, word) for key, word in words.items()]
        self.tab = "story" if self.can_go_back else self.vm.part

    def choose_tab(self, key: str) -> None:
        self.vm.choose_part(key)

    def go_back(self) -> None:
        self.vm.close_story()
