"""The plan as a file for other calendars (RFC 5545): the starts of the next days, each as long as its mission usually
takes.

An event's UID is the token of its occurrence, so importing a new export updates the earlier events instead of doubling
them, and moves those of moved starts.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import islice
from pathlib import Path
from typing import TextIO

from app import __version__
from app.database.connection import Database
from app.database.settings import SettingsRepository
from app.domain import names, rules
from app.domain.clock import Clock
from app.services.catalogue.catalogue import Catalogue
from app.services.files.exports import DataFiles
from app.services.files.ics import line, text_line
from app.services.planning import sentences
from app.services.planning.plan import Plan
from app.services.planning.planned import ASSUMED_S, PlannedRun

DAYS = 30
MOST_EVENTS = 10_000  # calendars take long over more: a mission every minute would be 43 200
STEM = "amr-scheduler-plan"
DOMAIN = "amr-scheduler"  # behind the @ of a UID


@dataclass(frozen=True)
class PlanExport:
    """The file, the number and end of its starts; ``is_cut``: there were more than a calendar takes."""

    path: Path
    count: int
    until: datetime
    is_cut: bool


class PlanFiles(DataFiles):
    """Writes the plan where people look for their files."""

    def __init__(
        self, db: Database, catalogue: Catalogue, clock: Clock, plan: Plan, documents: Path | None = None
    ) -> None:
        super().__init__(db, catalogue, clock, documents)
        self._plan = plan

    def export(self, days: int = DAYS) -> PlanExport:
        """The starts from now on. Raises InvalidInput when the file can't be written."""
        now = self._clock.now()
        until = now + timedelta(days=days)
        runs = list(islice(self._plan.until(until), MOST_EVENTS + 1))
        is_cut = len(runs) > MOST_EVENTS
        install_id = self._db.write(SettingsRepository().install_id)  # is made if it is missing
        with self._new_file(str(self.suggested(STEM, ".ics")), ".ics") as (target, file):
            write_plan(file, runs[:MOST_EVENTS], install_id, now)
        return PlanExport(target, min(len(runs), MOST_EVENTS), runs[MOST_EVENTS - 1].at if is_cut else until, is_cut)


def write_plan(file: TextIO, runs: Iterable[PlannedRun], install_id: str, now: datetime) -> None:
    """Times in UTC, line ends CRLF (``file`` must not translate them)."""
    file.write(
        line("BEGIN", "VCALENDAR")
        + line("VERSION", "2.0")
        + text_line("PRODID", f"-//AMR Scheduler//{__version__}//EN")
        + line("CALSCALE", "GREGORIAN")
        + line("METHOD", "PUBLISH")
    )
    for run in runs:
        ends = run.at + timedelta(seconds=max(60, round(run.usual_s or ASSUMED_S)))
        file.write(
            line("BEGIN", "VEVENT")
            + line("UID", f"{_occurrence(install_id, run)}@{DOMAIN}")
            + line("DTSTAMP", _instant(now))
            + line("DTSTART", _instant(run.at))
            + line("DTEND", _instant(ends))
            + text_line("SUMMARY", f"{run.mission.name} · {run.whose}")
            + text_line("DESCRIPTION", _description(run))
            + text_line("CATEGORIES", run.whose)
            + line("TRANSP", "TRANSPARENT")
            + line("END", "VEVENT")
        )
    file.write(line("END", "VCALENDAR"))


def _occurrence(install_id: str, run: PlannedRun) -> str:
    """Of a moved start the one that it had before, so that a calendar moves its event."""
    schedule = run.schedule
    return rules.token_of(install_id, schedule.whole_id, schedule.moved_from or run.at)


def _description(run: PlannedRun) -> str:
    """Mission and robot, or group, are in the summary."""
    name = names.own_schedule_name(run.schedule.name, run.mission.name, run.whose)
    return ": ".join(filter(None, (name, sentences.sentence(run.schedule))))


def _instant(moment: datetime) -> str:
    return f"{moment.astimezone(UTC):%Y%m%dT%H%M%SZ}"
