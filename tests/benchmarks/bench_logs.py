"""How soon the Logs can be read on a long history: ``uv run python -m tests.benchmarks.bench_logs [ROWS]`` (default
1,000,000; or the directory of a database made earlier).

Milliseconds, best of several, for the readings of the screen when it opens (the first page) and of its other tabs.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from zoneinfo import ZoneInfo

from app.container import DATABASE_NAME, Container
from app.database.connection import Database
from app.database.executions import ExecutionRepository
from app.database.settings import SettingsRepository
from app.domain.models import Robot
from app.screens.common.shell import pick
from app.screens.logs.activity import Window, read_activity
from app.screens.logs.facts import LogsServices, execution_filter, read_facts
from app.screens.logs.figures import read_figures
from app.screens.logs.view import Filters, Period
from app.services.history.shift_report import ReportPeriod, ShiftReports
from tests.benchmarks.bench_kpi import DAYS, END, ROBOTS, START, best_ms, rows
from tests.support.clock import VirtualClock

ZONE = ZoneInfo("Europe/Helsinki")


def make(number: int, directory: Path) -> None:
    """Two years of ten robots."""
    db = Database.open(directory / DATABASE_NAME, clock=VirtualClock(END), durable=False)
    db.write(lambda c: SettingsRepository().save(c, timezone=ZONE.key))
    db.write(lambda c: ExecutionRepository().add_many(c, rows(number)))
    db.close()


def measure(directory: Path) -> None:
    clock = VirtualClock(END)
    container = Container(Database.open(directory / DATABASE_NAME, clock=clock, durable=False), clock)
    services = pick(LogsServices, container)
    known = {robot.name for robot in container.catalogue.robots()}
    for number in range(1, ROBOTS + 1):
        if f"R{number}" not in known:
            container.catalogue.save_robot(Robot(f"R{number}", f"10.0.0.{number}", "user"), "secret")
    number = sum(container.history.counts(execution_filter(Filters(Period.ALL), clock.now(), ZONE)).values())
    print(f"{number:,} rows since {START:%Y-%m-%d}, {DAYS} days")
    for period in (Period.WEEK, Period.TODAY, Period.MONTH, Period.ALL):
        filters = Filters(period)
        steps = {
            "first page": lambda filters=filters: read_facts(services, filters),
            "figures": lambda filters=filters: read_figures(services, filters, clock.now(), ZONE),
            "activity": lambda filters=filters: read_activity(services, filters, Window(), clock.now()),
        }
        spent = {name: best_ms(work, 2 if period is Period.ALL else 5) for name, work in steps.items()}
        opens = spent["first page"]
        print(f"  {period:6} opens in {opens:7.1f}   " + "   ".join(f"{name} {ms:.1f}" for name, ms in spent.items()))
    report = ShiftReports(container.db, clock)
    print(
        "  report of "
        + ", ".join(f"{period} {best_ms(lambda period=period: report.make(period), 3):.1f}" for period in ReportPeriod)
    )
    container.close()


if __name__ == "__main__":
    count_or_directory = sys.argv[1] if len(sys.argv) > 1 else "1000000"
    if Path(count_or_directory).is_dir():
        measure(Path(count_or_directory))
    else:
        with tempfile.TemporaryDirectory() as name:
            make(int(count_or_directory.replace(",", "").replace("_", "")), Path(name))
            measure(Path(name))
