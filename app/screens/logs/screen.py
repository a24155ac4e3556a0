"""Logs: what happened, and how well. Facts are read in the background and turned into words by the view modules."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar
from zoneinfo import ZoneInfo

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty

from app.domain.models import Execution, Trigger
from app.i18n import _, ngettext
from app.screens.common.mission_names import MissionNameLookup
from app.screens.common.places import choose_place
from app.screens.common.shell import Shell
from app.screens.common.start_now import start_now
from app.screens.common.started import StartReports, as_it_is, say_not_started
from app.screens.common.view_model import Changed, Job, Refresher, ScreenBase, ViewModel
from app.screens.logs import cards, kpi_view, more_view, of_groups, report_page, robot_states, view  # noqa: F401  (kv's Factory learns the cards)
from app.screens.logs.facts import (
    PAGE,
    LogsFacts,
    LogsServices,
    execution_filter,
    period_with,
    read_facts,
    read_next_page,
)
from app.screens.logs.figures import Figures, MoreFigures, read_figures, read_more_figures
from app.screens.logs.kpi_view import Explanation
from app.screens.logs.of_groups import OfGroup
from app.screens.logs.robot_states import Mark, StatesFacts, Steps, read_states
from app.screens.logs.view import Filters, Period
from app.services.history.shift_report import ReportPeriod, ShiftReport
from app.services.live.changes import Topic
from app.widgets import load_kv
from app.widgets.figures import FigureDialog
from app.widgets.snackbar import Message

T = TypeVar("T")

MAX_ROWS = 5000  # kept in the list; older runs are found with the filters
SEARCH_DELAY_S = 0.3  # after the last key
REFRESH_S = 60.0  # the figures depend on the time of day too
PATH_SHOWN_S = 12.0  # long enough to read where a file was written


class LogsViewModel(ViewModel):
    """What kv reads."""

    period = StringProperty(Period.WEEK)
    periods = ListProperty()
    part = StringProperty("runs")
    parts = ListProperty()
    robot = StringProperty()
    all_robots = BooleanProperty(True)
    kpis = ListProperty()
    utilisation = ListProperty()
    days_note = StringProperty()
    utilisation_note = StringProperty()
    days = ListProperty()
    rows = ListProperty()
    figures = ObjectProperty(more_view.FiguresPage(), rebind=True)
    lanes = ListProperty()  # of the page of robots
    ticks = ListProperty()
    mark = ObjectProperty(None, allownone=True)  # of the span whose details are shown
    legend = ListProperty()
    steps = ObjectProperty(Steps(), rebind=True)  # that the bands can be moved and zoomed by
    opened_run = ObjectProperty(None, allownone=True)  # id of the run whose story is shown
    count_text = StringProperty()
    export_text = StringProperty()
    reach = StringProperty()  # what the figures count: since when, and without the list's filters
    outcome_chip = StringProperty()
    mission_chip = StringProperty()
    trigger_chip = StringProperty()
    is_filtered = BooleanProperty(False)  # whether the filters of the list leave something out
    searching = BooleanProperty(False)
    query = StringProperty()
    empty_title = StringProperty()
    empty_text = StringProperty()
    exporting = BooleanProperty(False)
    reporting = BooleanProperty(False)
    portrait = BooleanProperty(False)

    def __init__(self, services: LogsServices, shell: Shell) -> None:
        super().__init__()
        self._services, self._shell = services, shell
        self._filters = Filters()
        self._facts = LogsFacts()
        self._figures: Figures | None = None
        self._more = MoreFigures()
        self._states: StatesFacts | None = None
        self._row_cache = view.RowCache()
        self._given = MissionNameLookup(services.robot_missions, services.clock, shell, self._learnt)
        self._next_page: Job | None = None
        self._story: Job | None = None  # of the run that was asked for
        self._runs_refresher = Refresher(shell, self._start_reading, self._take)
        self._figures_refresher = Refresher(shell, self._start_reading_figures, self._take_figures)
        self._started = StartReports(shell, as_it_is(services.history, services.holds))
        self._search_soon = Clock.create_trigger(lambda _dt: self.set_filters(text=self.query), SEARCH_DELAY_S)

    # ------------------------------------------------------------------ reading
    def opened(
        self, execution_id: int | None = None, unfiltered: bool = False, seen: tuple[str, Filters] | None = None
    ) -> None:
        """``execution_id``: show the story of that run; ``unfiltered``: the runs, without filters; ``seen``: the part and
        filters to return to."""
        if seen is not None:
            self.part, self._filters = seen
            self.query, self.searching = self._filters.text, bool(self._filters.text)
        self.keep(self._shell.bus.subscribe(Changed, self._changed))
        self.keep(self._started.open())
        self.keep(self._runs_refresher.start())
        self.keep(self._figures_refresher.start())
        self.every(REFRESH_S, self._runs_refresher.read)
        if unfiltered:
            self._show_runs(Filters())
        elif execution_id is None:
            self._runs_refresher.read()
        else:
            self._story = self._shell.background.run(
                lambda: self._services.ledger.get(execution_id), self._open_run, self._shell.say_problem
            )

    def closed(self) -> None:
        self._forget_story()

    def retranslated(self) -> None:
        self._show()

    def _changed(self, event: Changed) -> None:
        """Robots report many times a second; what they do becomes history only with the executions."""
        if event.topic is not Topic.SNAPSHOT:
            self._runs_refresher.request()

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
        if min(len(self._facts.rows), MAX_ROWS) > rows:  # more were loaded since
            self._runs_refresher.request()
            return
        self._facts = facts
        self._show()
        self._figures_refresher.read()

    def _start_reading_figures(self) -> Callable[[], tuple[Filters, Figures, MoreFigures | None, StatesFacts | None]]:
        """They are computed from many rows, so the list does not wait for them."""
        services, filters, facts, part = self._services, self._filters, self._facts, self.part
        now, zone = services.clock.now(), facts.zone
        return lambda: (
            filters,
            read_figures(services, filters, now, zone),
            read_more_figures(services, filters, now, zone) if part == "figures" else None,
            read_states(services, filters, now, zone) if part == "robots" else None,
        )

    def _take_figures(self, found: tuple[Filters, Figures, MoreFigures | None, StatesFacts | None]) -> None:
        filters, figures, more, states = found
        if filters == self._filters:
            self._figures, self._more = figures, more or self._more
            self._states = states.as_before(self._states) if states else self._states
            self._show_figures()

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

    def _open_run(self, execution: Execution | None) -> None:
        """Show the story of this run, in a list that contains it."""
        if execution is None:
            self._shell.snackbars.show(_("This run is no longer in the history"), icon="information-outline")
            self._runs_refresher.read()
            return
        zone = ZoneInfo(self._services.settings().timezone)
        self.opened_run = execution.id
        self._show_runs(Filters(period_with(execution.planned_at, self._services.clock.now(), zone)))

    def _forget_story(self) -> None:
        """The user has moved on: it must not undo a newer choice."""
        if self._story is not None:
            self._story.cancel()

    def _show_runs(self, filters: Filters) -> None:
        """Their part of the screen, without a search."""
        self._search_soon.cancel()
        self.part, self.searching, self.query = "runs", False, ""
        self._use(filters)

    # ------------------------------------------------------------------ showing
    def _show(self) -> None:
        facts, filters = self._facts, self._filters
        self.periods, self.period, self.parts = view.periods(), filters.period, view.parts()
        self.robot, self.all_robots = view.robot_chip(filters, facts.robots), filters.robot_ids is None
        self.outcome_chip, self.trigger_chip = view.outcome_chip(filters), view.trigger_chip(filters)
        self.mission_chip, self.is_filtered = view.mission_chip(filters), filters.narrow_list
        self.count_text, self.export_text = view.count_text(facts.count, filters), view.export_text(facts.count)
        self.empty_title, self.empty_text = view.empty_texts(filters)
        self._show_rows()
        self._show_figures()

    def _show_rows(self) -> None:
        facts, now = self._facts, self._services.clock.now()
        self.rows = self._row_cache.rows(
            facts.rows,
            now,
            facts.zone,
            facts.usual_s,
            self.opened_run,
            facts.expected,
            facts.replacements,
            self._shell.mission_names.known,
        )
        self._given.look(facts.robots, ((row.robot_id, row.mission_guid, row.parameters) for row in facts.rows))

    def _learnt(self) -> None:
        """Names of positions: a search may find more."""
        self._show_rows()
        if self._filters.text:
            self._runs_refresher.request()

    def _show_figures(self) -> None:
        if self._figures is None:
            self.kpis = kpi_view.pending_cards()
        else:
            self.kpis, self.utilisation = kpi_view.cards(self._figures), kpi_view.utilisation_bars(self._figures)
            self._show_reach()
            self.utilisation_note, self.days = (
                kpi_view.total_note(self._figures),
                kpi_view.outcome_days(self._figures.days),
            )
            self.days_note = kpi_view.days_note(self.days)
            if self.part == "figures":
                self.figures = more_view.page(self._figures, self._more)
        if self._states is not None and self.part == "robots":
            robots = self._figures.facts.robots if self._figures is not None else ()
            self.lanes, self.ticks = (
                robot_states.lanes(self._states, robots),
                robot_states.ticks(self._states, self._facts.zone),
            )
            self.legend, self.steps = robot_states.legend(), self._states.steps

    def _show_reach(self) -> None:
        if self._figures is not None:
            self.reach = kpi_view.reach(self._figures, self.part == "runs" and self._filters.narrow_list)

    def explain(self, key: str) -> None:
        """What a figure means, and the numbers behind it."""
        if key == "states":
            self._open_explanation(robot_states.explanation(self._states))
        elif self._figures is not None:
            self._open_explanation(
                more_view.explanation(key, self._figures, self._more)
                if key in more_view.MORE
                else kpi_view.explanation(key, self._figures)
            )

    def _open_explanation(self, found: Explanation) -> FigureDialog:
        return self._shell.dialogs.open(FigureDialog(title=found.title, text=found.text, rows=found.lines))

    def show_moment(self, robot_id: int, place: float) -> None:
        """What a robot did at ``place`` 0..1 of the period, from when to when."""
        states = self._states
        found = robot_states.span_at(states, robot_id, place) if states else None
        if states is not None and found is not None:
            self.mark = Mark(robot_id, states.place(found[1].start), states.place(found[1].end))
            dialog = self._open_explanation(
                robot_states.span_details(*found, states.period[1], self._facts.settings.timezone)
            )
            dialog.bind(on_dismiss=lambda _dialog: setattr(self, "mark", None))

    def zoom(self, further: bool) -> None:
        """The bands of half or twice the time."""
        if self._states is not None:
            self._states = self._states.zoomed(further)
            self._show_figures()

    def move(self, later: bool) -> None:
        """The bands of half a view earlier or later."""
        if self._states is not None:
            self._states = self._states.moved(later)
            self._show_figures()

    def row_action(self, execution_id: int, action: str) -> None:
        """A row of the list was used."""
        if action == "again":
            self.run_again(execution_id)
        else:
            self.toggle(execution_id)

    def run_again(self, execution_id: int) -> None:
        """Ask first: the reader may not see the robot. Not asked if nothing can be started now."""
        run = next((row for row in self._facts.rows if row.id == execution_id), None)
        if run is None:
            return
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
                lambda: self._services.operator.run_again(execution_id), self._started.follow, self._shell.say_problem
            ),
        )

    def toggle(self, execution_id: int) -> None:
        """Open or close the story of a run."""
        self.opened_run = None if self.opened_run == execution_id else execution_id
        self._show_rows()

    # ------------------------------------------------------------------ the filters
    @property
    def seen(self) -> tuple[str, Filters]:
        """The part that is shown, and of what."""
        return self.part, self._filters

    def set_filters(self, **changes: Any) -> None:
        """Fields of ``Filters`` by name; the others stay."""
        self._use(replace(self._filters, **changes))

    def _use(self, filters: Filters) -> None:
        self._forget_story()
        if filters != self._filters:
            if filters.period is not self._filters.period:
                self._states = None  # all of it is looked at first
            self._filters = filters
            self._facts = replace(self._facts, rows=())
        self._show()
        self._runs_refresher.read()

    def choose_period(self, period: str) -> None:
        self.set_filters(period=Period(period))

    def choose_part(self, part: str) -> None:
        """What is shown below the figures."""
        if part != self.part:
            if self._story is not None and not self._story.finished:
                self._forget_story()
                self._runs_refresher.read()  # which would have followed it
            self.part = part
            self._show_reach()
            self._figures_refresher.read()

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

    def choose_outcomes(self) -> None:
        self._shell.dialogs.choose_many(
            _("Outcome"),
            view.outcome_options(),
            _("Show"),
            lambda keys: self.set_filters(outcomes=tuple(keys)),
            selected=self._filters.outcomes,
        )

    def choose_triggers(self) -> None:
        self._shell.dialogs.choose_many(
            _("Started by"),
            view.trigger_options(),
            _("Show"),
            lambda keys: self.set_filters(triggers=tuple(Trigger(key) for key in keys)),
            selected=self._filters.triggers,
        )

    def choose_mission(self) -> None:
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
            self._forget_story()
            self.query = text
            self._search_soon.cancel()
            self._search_soon()

    def show_everything(self) -> None:
        """Clear the filters of the list; period and robot stay."""
        self._show_runs(Filters(self._filters.period, self._filters.robot_id, group=self._filters.group))

    # ------------------------------------------------------------------ files
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
            self.export_text,
            view.table_options(),
            lambda for_excel: choose_place(self._shell, self._services.files, partial(write, for_excel)),
        )

    def choose_report(self) -> None:
        """Ask for the period of a shift report, then write it as a page to print."""
        services, robot_id, group = self._services, self._filters.robot_id, self._filters.group
        robot, mission_names = view.robot_chip(self._filters, self._facts.robots), self._shell.mission_names.known

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
    """Tabs, filters, figures, and one of the parts."""

    Services = LogsServices
    lower_height = NumericProperty(0)  # least, of the part

    def __init__(self, services: LogsServices, shell: Shell, **kwargs: Any) -> None:
        load_kv("logs/screen", "logs/figures", "logs/robot_states")
        super().__init__(vm=LogsViewModel(services, shell), **kwargs)
        self.fbind("portrait", lambda *_args: setattr(self.vm, "portrait", self.portrait))

    def place(self) -> dict[str, Any]:
        """With its part and filters."""
        return {"seen": self.vm.seen}
