"""Logs: what happened, and how well. Facts are read in the background, words made by logs_view and kpi_view."""
from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty

from app.container import Container
from app.domain.models import Execution, Trigger
from app.i18n import _, ngettext
from app.screens.common.shell import Shell
from app.screens.common.view_model import ScreenBase, ViewModel
from app.screens.logs import facts as logs_facts
from app.screens.logs import figures as logs_figures
from app.screens.logs import kpi_view, more_view, report_page, robot_states, view
from app.screens.logs.cards import FilterBar, LogsBody, MoreCard, OutcomesCard, RunsCard, UtilisationCard  # noqa: F401  (kv's Factory learns them)
from app.screens.logs.facts import LogsFacts
from app.screens.logs.figures import Figures, MoreFigures
from app.screens.logs.robot_states import StatesFacts
from app.screens.logs.view import Chosen, Period
from app.services.files.log_export import LogExport
from app.services.history.runs import Page
from app.services.history.shift_report import ReportPeriod, ShiftReports
from app.services.live.changes import Topic
from app.widgets import load_kv
from app.widgets.figures import FigureDialog

MOST_ROWS = 5000             # kept in the list; who wants older ones filters
AFTER_TYPING = 0.3           # s of rest before the search begins
LOOKS_AGAIN = 60.0           # s after which the figures are read anew although nothing was said to have changed
TOLD_FOR = 12.0              # s that the place of an export stays readable


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
    utilisation_note = StringProperty()
    days = ListProperty()
    rows = ListProperty()
    adherence = ObjectProperty({}, rebind=True)                    # of the page of figures: texts and rows by name
    waiting = ObjectProperty({}, rebind=True)
    causes = ObjectProperty({}, rebind=True)
    durations = ObjectProperty({}, rebind=True)
    lanes = ListProperty()                            # of the page of robots
    ticks = ListProperty()
    marked = ListProperty()                           # [robot, from, to] of the span that is told
    legend = ListProperty()
    told = ObjectProperty(None, allownone=True)       # id of the run whose story is told
    found = StringProperty()
    outcome_chip = StringProperty()
    mission_chip = StringProperty()
    trigger_chip = StringProperty()
    narrows = BooleanProperty(False)
    searching = BooleanProperty(False)
    query = StringProperty()
    empty_title = StringProperty()
    empty_text = StringProperty()
    exporting = BooleanProperty(False)
    reporting = BooleanProperty(False)
    narrow = BooleanProperty(False)

    def __init__(self, container: Container, shell: Shell) -> None:
        super().__init__()
        self._container, self._shell = container, shell
        self._chosen = Chosen()
        self._facts = LogsFacts()
        self._figures: Figures | None = None
        self._more = MoreFigures()
        self._row_cache = view.RowCache()
        self._states: StatesFacts | None = None
        self._reading = self._stale = self._loading_more = False
        self._refresh = Clock.create_trigger(lambda _dt: self._read(), 0)
        self._search_soon = Clock.create_trigger(lambda _dt: self._choose(text=self.query), AFTER_TYPING)
        self.fbind("narrow", lambda *_args: self._show_rows())

    # ------------------------------------------------------------------ reading
    def opened(self, execution_id: int | None = None) -> None:
        """``execution_id`` tells the story of that run."""
        self.keep(self._container.changes.subscribe(self._heard))
        self.every(LOOKS_AGAIN, self._read)
        if execution_id is None:
            self._read()
        else:
            self._shell.background.run(lambda: self._container.ledger.get(execution_id), self._tell_story, self._shell.say_problem)

    def _heard(self, topic: Topic, _about: int | None) -> None:
        """On the publisher's thread. What robots say many times a second becomes history only with the executions."""
        if topic is not Topic.SNAPSHOT:
            self._refresh()

    def retranslated(self) -> None:
        self._row_cache.forget()
        self._show()

    def _read(self) -> None:
        """One reading at a time; what changes meanwhile asks for one more."""
        if self._reading:
            self._stale = True
            return
        self._reading, self._stale = True, False
        chosen, rows = self._chosen, min(MOST_ROWS, max(logs_facts.PAGE, len(self._facts.rows)))
        self._shell.background.run(lambda: logs_facts.read(self._container, chosen, rows), lambda facts: self._take(chosen, facts),
                                   self._not_read)

    def _take(self, chosen: Chosen, facts: LogsFacts) -> None:
        self._reading = False
        if self._stale or chosen != self._chosen:
            self._refresh()
        if chosen == self._chosen:
            self._facts = facts
            self._show()
            self._read_figures()

    def _read_figures(self) -> None:
        """They rest on many rows, so the list does not wait for them."""
        chosen, facts, now = self._chosen, self._facts, self._container.clock.now()
        robot = next((robot for robot in facts.robots if robot.id == chosen.robot_id), facts.robot)
        part = self.part

        def work() -> tuple[Figures, MoreFigures | None, StatesFacts | None]:
            figures = logs_figures.read(self._container, chosen, robot, now, facts.zone)
            return figures, logs_figures.read_more(self._container, chosen, now, facts.zone) if part == "figures" else None, \
                robot_states.read(self._container, chosen, now, facts.zone) if part == "robots" else None

        self._shell.background.run(work, lambda found: self._take_figures(*found), self._shell.say_problem, key=("logs", "figures"))

    def _take_figures(self, figures: Figures, more: MoreFigures | None, states: StatesFacts | None) -> None:
        self._figures, self._more, self._states = figures, more or self._more, states or self._states
        self._show_figures()

    def _not_read(self, problem: BaseException) -> None:
        self._reading = False
        self._shell.say_problem(problem)

    def load_more(self) -> None:
        """The end of the list is near."""
        facts, chosen = self._facts, self._chosen
        if self._loading_more or facts.next is None or len(facts.rows) >= MOST_ROWS:
            return
        self._loading_more = True

        def work() -> tuple[Page, Any]:
            page = logs_facts.read_more(self._container, chosen, facts.next)
            return page, logs_facts.usual_durations(self._container, page.rows, facts.usual_s)

        self._shell.background.run(work, lambda found: self._append(chosen, *found), self._no_more)

    def _append(self, chosen: Chosen, page: Page, usual: Any) -> None:
        self._loading_more = False
        if chosen == self._chosen:
            known = {row.id for row in self._facts.rows}
            new = tuple(row for row in page.rows if row.id not in known)
            self._facts = replace(self._facts, rows=self._facts.rows + new, next=page.next, usual_s=usual)
            self._show_rows()

    def _no_more(self, problem: BaseException) -> None:
        self._loading_more = False
        self._shell.say_problem(problem)

    def _tell_story(self, execution: Execution | None) -> None:
        """Show the run of an intent, in a list that has it."""
        if execution is None:
            self._shell.snackbars.show(_("This run is no longer in the history"), icon="information-outline")
            self._read()
            return
        zone = ZoneInfo(self._container.settings().timezone)
        period = logs_facts.period_with(execution.planned_at, self._container.clock.now(), zone)
        self.told, self.part = execution.id, "runs"
        self._choose(Chosen(period=period))

    # ------------------------------------------------------------------ showing
    def _show(self) -> None:
        facts, chosen = self._facts, self._chosen
        self.periods, self.period, self.parts = view.periods(), chosen.period, view.parts()
        self.robot, self.all_robots = view.robot_chip(chosen, facts.robots), chosen.robot_id is None
        self.outcome_chip, self.trigger_chip = view.outcome_chip(chosen), view.trigger_chip(chosen)
        self.mission_chip, self.narrows = view.mission_chip(chosen), chosen.narrows
        self.found = view.found(facts.count, chosen)
        self.empty_title, self.empty_text = view.nothing(chosen)
        self._show_rows()
        self._show_figures()

    def _show_figures(self) -> None:
        if self._figures is not None:
            self.kpis, self.utilisation = kpi_view.cards(self._figures), kpi_view.utilisation_rows(self._figures)
            self.utilisation_note, self.days = kpi_view.total_note(self._figures), kpi_view.outcome_days(self._figures.days)
            if self.part == "figures":
                pages = more_view.pages(self._figures, self._more)
                self.adherence, self.waiting, self.causes, self.durations = pages
        if self._states is not None and self.part == "robots":
            self.lanes, self.ticks = robot_states.lanes(self._states), robot_states.ticks(self._states, self._facts.zone)
            self.legend = robot_states.legend()

    def explain(self, key: str) -> None:
        """What a figure means, and the numbers behind it."""
        if key == "states":
            self._explain(*robot_states.explanation(self._states))
        elif self._figures is not None:
            title, text, rows = more_view.explanation(key, self._figures, self._more) if key in more_view.MORE else \
                kpi_view.explanation(key, self._figures)
            self._explain(title, text, rows)

    def _explain(self, title: str, text: str, rows: list[dict[str, Any]]) -> FigureDialog:
        return self._shell.dialogs.open(FigureDialog(title=title, text=text, rows=[{**row, "key": n} for n, row in enumerate(rows)]))

    def tell_moment(self, robot_id: int, place: float) -> None:
        """What a robot did there, from when to when."""
        found = robot_states.span_at(self._states, robot_id, place) if self._states else None
        if found is None or self._states is None:
            return
        self.marked = [robot_id, self._states.place(found[1].start), self._states.place(found[1].end)]
        dialog = self._explain(*robot_states.story(*found, self._states.end, self._facts.settings.timezone))
        dialog.bind(on_dismiss=lambda _dialog: setattr(self, "marked", []))

    def _show_rows(self) -> None:
        facts, now = self._facts, self._container.clock.now()
        self.rows = self._row_cache.rows(facts.rows, now, facts.zone, facts.usual_s, self.told, self.narrow, facts.expected)

    # ------------------------------------------------------------------ the filters
    def _choose(self, chosen: Chosen | None = None, **values: Any) -> None:
        chosen = chosen or replace(self._chosen, **values)
        if chosen != self._chosen:
            self._chosen = chosen
            self._facts = replace(self._facts, rows=())
        self._show()
        self._read()

    def choose_period(self, period: str) -> None:
        self._choose(period=Period(period))

    def choose_part(self, part: str) -> None:
        """What stands below the figures."""
        if part != self.part:
            self.part = part
            self._read_figures()

    def choose_robot(self) -> None:
        self._shell.dialogs.choose(_("Robot"), view.robot_options(self._facts.robots), lambda key: self._choose(robot_id=key or None),
                                   selected=self._chosen.robot_id or 0)

    def choose_outcomes(self) -> None:
        self._shell.dialogs.choose_many(_("Outcome"), view.outcome_options(), _("Show"),
                                        lambda keys: self._choose(outcomes=tuple(keys)), selected=self._chosen.outcomes)

    def choose_triggers(self) -> None:
        self._shell.dialogs.choose_many(_("Started by"), view.trigger_options(), _("Show"),
                                        lambda keys: self._choose(triggers=tuple(Trigger(key) for key in keys)),
                                        selected=self._chosen.triggers)

    def choose_mission(self) -> None:
        self._shell.dialogs.choose(_("Mission"), view.mission_options(self._facts.missions),
                                   lambda name: self._choose(mission=name or None), selected=self._chosen.mission or "")

    def toggle_search(self) -> None:
        """Closing the search forgets what was searched for."""
        self.searching = not self.searching
        if not self.searching:
            self.search("")

    def search(self, text: str) -> None:
        """Typed; asked for when typing rests."""
        if text != self.query:
            self.query = text
            self._search_soon.cancel()
            self._search_soon()

    def show_everything(self) -> None:
        """Take the filters of the list away; period and robot stay."""
        self.searching, self.query = False, ""
        self._choose(Chosen(period=self._chosen.period, robot_id=self._chosen.robot_id))

    # ------------------------------------------------------------------ the rows
    def toggle(self, execution_id: int) -> None:
        """Tell the story of a run, or no more."""
        self.told = None if self.told == execution_id else execution_id
        self._show_rows()

    def export(self) -> None:
        """Write what is filtered as CSV and say where it went."""
        if self.exporting:
            return
        self.exporting = True
        wanted = logs_facts.filter_of(self._chosen, self._container.clock.now(), self._facts.zone)
        export = LogExport(self._container.db, self._container.catalogue, self._container.clock)
        self._shell.background.run(lambda: export.export(wanted), lambda outcome: self._exported(*outcome), self._not_exported)

    def _exported(self, path: Path, count: int) -> None:
        self.exporting = False
        text = ngettext("{n} run written to {path}", "{n} runs written to {path}", count).format(n=count, path=path)
        self._shell.snackbars.show(text, icon="file-check-outline", seconds=TOLD_FOR)

    def _not_exported(self, problem: BaseException) -> None:
        self.exporting = False
        self._shell.say_problem(problem)

    def choose_report(self) -> None:
        """Ask for which time; then write the report."""
        robot = view.robot_chip(self._chosen, self._facts.robots)
        self._shell.dialogs.choose(_("Shift report, {robot}").format(robot=robot), view.report_options(),
                                   lambda key: self._report(ReportPeriod(key)))

    def _report(self, period: ReportPeriod) -> None:
        """Write it as a page to print, and say where it went."""
        if self.reporting:
            return
        self.reporting = True
        robot_id = self._chosen.robot_id
        reports = ShiftReports(self._container.db, self._container.clock)
        export = LogExport(self._container.db, self._container.catalogue, self._container.clock)
        self._shell.background.run(lambda: export.write_page(report_page.page(reports.make(period, robot_id))), self._reported,
                                   self._not_reported)

    def _reported(self, path: Path) -> None:
        self.reporting = False
        self._shell.snackbars.show(_("Report written to {path}").format(path=path), icon="file-check-outline", seconds=TOLD_FOR)

    def _not_reported(self, problem: BaseException) -> None:
        self.reporting = False
        self._shell.say_problem(problem)


class LogsScreen(ScreenBase):
    """Filters, figures, charts and runs."""
    lower_height = NumericProperty(0)    # least, of charts and runs

    def __init__(self, container: Container, shell: Shell, **kwargs: Any) -> None:
        load_kv("widgets/slots", "logs/screen", "logs/figures", "logs/robot_states")
        super().__init__(vm=LogsViewModel(container, shell), **kwargs)
        self.fbind("portrait", self._tell_width)

    def _tell_width(self, *_: Any) -> None:
        self.vm.narrow = self.portrait
