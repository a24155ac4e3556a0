"""What the KPIs cost over a long history: ``uv run python -m tests.benchmarks.bench_kpi [ROWS …]`` (default 100,000 and 1,000,000).

Two years of ten robots; every figure is the best of several runs, in milliseconds of processor time. A plain scan by the same SQLite stands
next to it. Exits with 1 where a figure of all rows takes more than 500 ms.
"""

from __future__ import annotations

import random
import sqlite3
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from app.database.connection import Database
from app.database.execution_history import ExecutionFilter, ExecutionHistory
from app.database.executions import ExecutionRepository
from app.database.missions import DurationRepository
from app.database.settings import SettingsRepository
from app.domain.execution import Execution, Reason, ReasonCode, State, Trigger
from app.services.history.kpis import KpiFilter, Kpis
from tests.support.clock import VirtualClock

MOST_MS = 500.0
START, DAYS, ROBOTS = datetime(2024, 11, 21, tzinfo=UTC), 730, 10
END = START + timedelta(days=DAYS)
SCAN = """SELECT robot_id, count(*) FILTER (WHERE state = 'completed'), count(*) FILTER (WHERE state = 'failed'),
          avg(duration_s) FILTER (WHERE state = 'completed'), sum(duration_s), count(DISTINCT substr(ended_at, 1, 10))
          FROM executions NOT INDEXED WHERE ended_at >= ? AND ended_at < ? GROUP BY robot_id"""


def rows(number: int) -> Iterator[Execution]:
    rng = random.Random(1)
    for i in range(number):
        planned, took, luck = START + timedelta(days=DAYS * i / number), rng.lognormvariate(5, 0.6), rng.random()
        submitted, robot = planned + timedelta(seconds=rng.uniform(0.1, 2)), rng.randrange(ROBOTS) + 1
        row = Execution(
            Trigger.SCHEDULED,
            robot,
            f"R{robot}",
            "Deliver",
            f"guid-{i % 40}",
            planned,
            planned + timedelta(minutes=15),
            planned,
            f"{rng.getrandbits(128):032x}",
            "Europe/Helsinki",
            schedule_id=i % 500,
            schedule=f"Schedule {i % 500}",
        )
        if luck < 0.04:
            yield _ended(
                row, State.SKIPPED, row.closes_at, reason=Reason(ReasonCode.BATTERY_LOW, {"battery": 12, "minimum": 30})
            )
        else:
            state = State.FAILED if luck < 0.08 else State.CANCELLED if luck < 0.1 else State.COMPLETED
            code = {State.FAILED: ReasonCode.ROBOT_ABORTED, State.CANCELLED: ReasonCode.USER_CANCELLED}.get(state)
            yield _ended(
                row,
                state,
                submitted + timedelta(seconds=took),
                reason=Reason(code) if code else None,
                submitted_at=submitted,
                started_at=submitted,
                duration_s=took,
                robot_delay_s=rng.uniform(0, 30),
                queue_id=i,
                attempts=1,
            )


def _ended(row: Execution, state: State, at: datetime, **values: Any) -> Execution:
    return Execution(**{**vars(row), "state": state, "ended_at": at, **values})


def best_ms(work: Callable[[], object], times: int) -> float:
    spent = []
    for _ in range(times):
        before = time.process_time()
        work()
        spent.append(time.process_time() - before)
    return min(spent) * 1000


def measure(number: int, directory: Path) -> bool:
    """Whether every figure of all rows stays within MOST_MS."""
    db = Database.open(directory / f"{number}.db", durable=False)
    db.write(lambda c: SettingsRepository().save(c, timezone="Europe/Helsinki"))
    before = time.perf_counter()
    db.write(lambda c: ExecutionRepository().add_many(c, rows(number)))
    print(f"\n{number:,} rows in {time.perf_counter() - before:.0f} s, SQLite {sqlite3.sqlite_version}")
    kpis = Kpis(db, VirtualClock(END))
    month, one_robot = KpiFilter(END - timedelta(days=30), END), KpiFilter(END - timedelta(days=30), END, [1])
    history, c, is_fast = ExecutionHistory(), db.read(), True
    for name, work in {
        "what is counted": kpis.facts,
        "outcomes per day": kpis.per_day,
        "start delays": kpis.delays,
        "causes of failure": kpis.failures,
        "durations": kpis.trends,
    }.items():
        spent = best_ms(work, 3)
        is_fast = is_fast and spent <= MOST_MS
        print(
            f"  {name:18} all {spent:8.1f}   30 days {best_ms(lambda work=work: work(month), 10):7.1f}"
            f"   30 days of one robot {best_ms(lambda work=work: work(one_robot), 10):6.1f}"
        )
    print(f"  plain scan         all {best_ms(lambda: c.execute(SCAN, ('', '~')).fetchall(), 2):8.1f}")
    print(
        f"  page of 100        {best_ms(lambda: history.page(c, ExecutionFilter(), None, 100), 5):.1f},"
        f" usual duration {best_ms(lambda: DurationRepository().usual(c, 1, 'guid-0'), 5):.2f},"
        f" prune at the limit {best_ms(lambda: db.write(lambda w: history.drop_oldest(w, history.surplus(w, number))), 3):.1f}"
    )
    db.close()
    return is_fast


if __name__ == "__main__":
    results = []
    with tempfile.TemporaryDirectory() as name:
        for count in [int(text.replace(",", "").replace("_", "")) for text in sys.argv[1:]] or [100_000, 1_000_000]:
            results.append(measure(count, Path(name)))
    sys.exit(0 if all(results) else 1)
