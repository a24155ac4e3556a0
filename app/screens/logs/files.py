"""Files of the Logs: the runs that are seen as a table, a shift report as a page to print."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty

from app.i18n import _, ngettext
from app.screens.common.places import choose_place
from app.screens.common.shell import Shell
from app.screens.logs import report_page, view
from app.screens.logs.facts import LogsServices, execution_filter
from app.screens.logs.numbers import Explanation
from app.services.history.shift_report import ReportPeriod, ShiftReport
from app.widgets.figure_charts import FigureSheet
from app.widgets.items import Item
from app.widgets.snackbar import Message

if TYPE_CHECKING:
    from app.screens.logs.screen import LogsViewModel

T = TypeVar("T")

PATH_SHOWN_S = 12.0  # long enough to read where a file was written


def explain(shell: Shell, found: Explanation) -> None:
    rows = [
        Item(n, line.label, line.note, meta=line.value, strong=False, opens=False) for n, line in enumerate(found.lines)
    ]
    shell.sheets.show(FigureSheet(title=found.title, text=found.text, rows=rows))


class LogsFiles(EventDispatcher):
    exporting = BooleanProperty(False)
    reporting = BooleanProperty(False)

    def __init__(self, services: LogsServices, shell: Shell, logs: LogsViewModel) -> None:
        super().__init__()
        self._services, self._shell, self._logs = services, shell, logs

    def export(self) -> None:
        """Write the runs that the filters let through as a table, in the form and to the place that are asked for."""
        wanted = execution_filter(self._logs.wanted, self._services.clock.now(), self._logs.zone)

        def said(found: tuple[Path, int]) -> str:
            path, runs = found
            return ngettext("{n} run written to {path}", "{n} runs written to {path}", runs).format(n=runs, path=path)

        def write(for_excel: bool, directory: Path) -> None:
            self._write(
                "exporting", lambda: self._services.files.export_runs(wanted, directory, for_excel=for_excel), said
            )

        self._shell.dialogs.choose(
            view.export_text(self._logs.facts.count),
            view.table_options(),
            lambda for_excel: choose_place(self._shell, self._services.files, partial(write, for_excel)),
        )

    def report(self) -> None:
        """Ask for the period of a shift report, then write it."""
        services, filters = self._services, self._logs.wanted
        robot = view.robot_word(filters, self._logs.facts.robots)
        mission_names = self._shell.mission_names.known

        def make(key: str) -> ShiftReport:
            if filters.group is None:
                return services.shift_reports.make(ReportPeriod(key), filters.robot_id)
            return services.shift_reports.make(
                ReportPeriod(key), group=filters.group.name, members=filters.group.members
            )

        def work(key: str, directory: Path) -> tuple[ShiftReport, Path]:
            report = make(key)
            page = report_page.page(report, mission_names)
            return report, services.files.write_text(page, "report", ".html", directory)

        def write(key: str, directory: Path) -> None:
            self._write(
                "reporting",
                partial(work, key, directory),
                lambda done: _("Report written to {path}").format(path=done[1]),
                lambda done: explain(self._shell, report_page.on_screen(done[0], mission_names)),
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
