"""What the Logs show, as files where people look for theirs: the runs as CSV, a report as a page to print."""

from __future__ import annotations

from pathlib import Path

from app.database.executions import ExecutionFilter
from app.services.files.exports import DataFiles
from app.services.files.history_export import write_history

STEM, REPORT_STEM = "amr-scheduler-log", "amr-scheduler-report"


class LogExport(DataFiles):
    """Writes into a directory of ``places``; None: where people look for their files."""

    def export(
        self, wanted: ExecutionFilter, directory: Path | None = None, *, for_excel: bool = False
    ) -> tuple[Path, int]:
        """The executions that a filter lets through. Returns the new file and how many it has. Raises InvalidInput when it can't be
        written."""
        with self._new_file(str(self.suggested(STEM, ".csv", directory)), ".csv") as (target, file):
            return target, write_history(self._db.read(), file, wanted, for_excel=for_excel)

    def write_page(self, html: str, directory: Path | None = None) -> Path:
        """A report as an HTML file; returns it. Raises InvalidInput when it can't be written."""
        with self._new_file(str(self.suggested(REPORT_STEM, ".html", directory)), ".html") as (target, file):
            file.write(html.encode("utf-8", "replace").decode())
        return target
