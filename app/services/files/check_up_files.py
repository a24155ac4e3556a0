"""Reports of check-ups as files where people look for theirs: a page to print, and what the robot was found to be."""

from __future__ import annotations

import re
from pathlib import Path

from app.services.files.exports import DataFiles

STEM = "amr-scheduler-check-up"


class CheckUpFiles(DataFiles):
    """Files have the robot in their names and lie where exports do unless another directory is chosen. Never writes over one."""

    def write_page(self, html: str, robot: str, directory: Path | None = None) -> Path:
        """An HTML file; returns it. Raises InvalidInput when it can't be written."""
        return self._write(html, robot, ".html", directory)

    def write_profile(self, document: str, robot: str, directory: Path | None = None) -> Path:
        """A JSON file that ``python -m mir_sim --profile`` takes; returns it. Raises InvalidInput when it can't be written."""
        return self._write(document, robot, ".json", directory)

    def _write(self, text: str, robot: str, suffix: str, directory: Path | None) -> Path:
        stem = "-".join([STEM, *re.findall(r"\w+", robot.lower())])  # a name is no path
        with self._new_file(str(self.suggested(stem, suffix, directory)), suffix) as (target, file):
            file.write(text.encode("utf-8", "replace").decode())
        return target
