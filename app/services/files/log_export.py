"""The runs that the Logs show, as CSV where people look for their files."""
from __future__ import annotations

from pathlib import Path

from app.database.executions import ExecutionFilter
from app.services.files.exports import DataFiles
from app.services.files.history_export import write_history

STEM = "amr-scheduler-log"


class LogExport(DataFiles):
    """Writes the executions that a filter lets through."""

    def export(self, wanted: ExecutionFilter) -> tuple[Path, int]:
        """Returns the new file and how many executions it has. Raises InvalidInput when it can't be written."""
        with self._new_file(str(self.suggested(STEM, ".csv")), ".csv") as (target, file):
            return target, write_history(self._db.read(), file, wanted)
