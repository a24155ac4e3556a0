"""Reports of check-ups as files where people look for theirs: a page to print, and what the robot was found to be."""
from __future__ import annotations

from pathlib import Path

from app.services.files.exports import DataFiles

STEM = "amr-scheduler-check-up"


class CheckUpFiles(DataFiles):
    """Never writes over a file that is there."""

    def write_page(self, html: str) -> Path:
        """An HTML file; returns it. Raises InvalidInput when it can't be written."""
        return self._write(html, ".html")

    def write_profile(self, document: str) -> Path:
        """A JSON file that ``python -m mir_sim --profile`` takes; returns it. Raises InvalidInput when it can't be written."""
        return self._write(document, ".json")

    def _write(self, text: str, suffix: str) -> Path:
        with self._new_file(str(self.suggested(STEM, suffix)), suffix) as (target, file):
            file.write(text.encode("utf-8", "replace").decode())
        return target
