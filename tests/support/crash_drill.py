"""The real app, killed at random moments while it sends to simulated robots over a bad network; then its ledger against their histories."""

from __future__ import annotations

import random
import sqlite3
import subprocess
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mir_sim
from tests.support.process import (
    App,
    begun,
    configuration_of,
    import_configuration,
    once_now,
    wait_for,
    write_configuration,
)

MISSION = "Home"  # the shortest
TIME_SCALE = 50.0  # simulated seconds per second, so that a mission lasts a moment
QUIET = 5  # s, the shortest there is: after it the app may send again what it did not find
LATEST = 1.0  # s, after which the network delivers at the latest
KINDS = ("drop_request", "drop_response", "delay", "late", "status_503", "html", "truncate", "garbage")


@dataclass
class Verdict:
    """What became of the occurrences. ``doubled`` and ``lost`` must be empty."""

    occurrences: int
    kills: int
    starts: int = 0
    doubled: list[str] = field(default_factory=list)  # tokens with more than one item on the robots
    lost: list[str] = field(
        default_factory=list
    )  # schedules without exactly one row that is completed and on its robot
    strange: list[str] = field(default_factory=list)  # items that no row knows, rows whose item says something else
    tracebacks: list[str] = field(default_factory=list)
    integrity: str = ""
    attempts: int = 0

    @property
    def is_good(self) -> bool:
        return not (self.doubled or self.lost or self.strange or self.tracebacks) and self.integrity == "ok"


def drill(
    data_dir: Path, seed: int, *, kills: int = 8, occurrences: int = 60, robots: int = 3, patience: float = 60.0
) -> Verdict:
    """Kill the app ``kills`` times, each time after a random moment of life; then let it finish and compare."""
    chance = random.Random(seed)
    verdict = Verdict(occurrences, kills)
    with mir_sim.serve(robots=robots, time_scale=TIME_SCALE, seed=seed) as fleet:
        import_configuration(
            data_dir, configuration_of(fleet, poll_interval_seconds=1, unknown_outcome_quiet_seconds=QUIET)
        )
        schedules = [once_now(fleet.robots[n % robots].name, MISSION, f"S{n}") for n in range(occurrences)]
        batches = [schedules[n::3] for n in range(3)]
        for life in range(kills):
            _make_trouble(fleet, chance)
            app = App(data_dir)
            importing = _start_import(data_dir, batches.pop()) if life % 3 == 0 and batches else None
            time.sleep(chance.uniform(0.3, 2.0))
            app.kill()
            verdict.tracebacks += [line for line in app.stderr if "Traceback" in line]
            if importing:
                importing.communicate(timeout=30)
        for robot in fleet.robots:
            robot.control({"fault": None})
        # the app died during an import: importing again adds the missing parts and fires nothing twice
        import_configuration(data_dir, {"schedules": schedules})
        app = App(data_dir).wait_ready()
        try:
            wait_for(lambda: _all_ended(data_dir, occurrences), patience, "every execution ended")
        finally:
            app.stop()
        verdict.starts = kills + 1
        verdict.tracebacks += [line for line in app.stderr if "Traceback" in line]
        _compare(data_dir, fleet, [schedule["name"] for schedule in schedules], verdict)
    return verdict


def _make_trouble(fleet: mir_sim.Fleet, chance: random.Random) -> None:
    """Answers to a POST come slowly, so that many kills fall between sending and noting it; some don't come at all."""
    for robot in fleet.robots:
        robot.control({"fault": None})
        for _ in range(6):
            kind = chance.choice([*KINDS, "delay", "delay"])
            robot.control(
                {
                    "fault": {
                        "kind": kind,
                        "method": "POST",
                        "path": "/mission_queue",
                        "seconds": chance.uniform(0.05, LATEST),
                    }
                }
            )
        robot.control(
            {"fault": {"kind": "delay", "method": "POST", "path": "/mission_queue", "count": None, "seconds": 0.1}}
        )


def _start_import(data_dir: Path, schedules: Sequence[dict[str, Any]]) -> subprocess.Popen[str]:
    """Handed to the app that is just starting, which may die over it."""
    path = write_configuration(data_dir.with_name(f"batch-{schedules[0]['name']}.json"), {"schedules": schedules})
    return begun(data_dir, "--import-config", path)


def rows_of(data_dir: Path, sql: str) -> list[sqlite3.Row]:
    with closing(sqlite3.connect(f"{(data_dir / 'amr-scheduler.db').as_uri()}?mode=ro", uri=True)) as c:
        c.row_factory = sqlite3.Row
        return c.execute(sql).fetchall()


def _all_ended(data_dir: Path, occurrences: int) -> bool:
    return [tuple(row) for row in rows_of(data_dir, "SELECT count(*), count(ended_at) FROM executions")] == [
        (occurrences, occurrences)
    ]


def _compare(data_dir: Path, fleet: mir_sim.Fleet, names: Sequence[str], verdict: Verdict) -> None:
    verdict.integrity = rows_of(data_dir, "PRAGMA integrity_check")[0][0]
    items = {(robot.name, item["id"]): item for robot in fleet.robots for item in robot.state()["queue"]}
    copies = Counter(item["description"] for item in items.values())
    verdict.doubled = [token for token, count in copies.items() if count > 1]
    rows = rows_of(data_dir, "SELECT * FROM executions")
    verdict.attempts = sum(row["attempts"] for row in rows)
    of_schedule = Counter(row["schedule"] for row in rows)
    good = set()
    for row in rows:
        item = items.get((row["robot"], row["queue_id"]))
        if row["state"] == "completed" and item and item["description"] == row["token"] and item["state"] == "Done":
            good.add(row["schedule"])
        else:
            verdict.strange.append(
                f"{row['schedule']}: {row['state']} {row['reason_code']}, on the robot {item and item['state']}"
            )
    verdict.lost = [name for name in names if of_schedule[name] != 1 or name not in good]
    verdict.strange += [f"item without a row: {token}" for token in copies.keys() - {row["token"] for row in rows}]
