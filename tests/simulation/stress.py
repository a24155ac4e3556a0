"""Real threads, processes and sockets under stress: ``python -m tests.simulation.stress --minutes 60 [--seed 1]``.

The app is a process (``tests.simulation.stress_tablet`` with operators that act at random, now and then ``main.py --headless`` with an
import at the same time), which is killed and started again at random while simulated robots answer slowly, lose requests and answers, and
boot. At the end everything has to come to rest, and the robots' own histories are compared with the operators' diary and the app's ledger.
"""

from __future__ import annotations

import argparse
import json
import random
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mir_sim
from tests.support.process import (
    ROOT,
    App,
    begun,
    configuration_of,
    environment,
    import_configuration,
    once_now,
    wait_for,
    write_configuration,
)

MISSION = "Home"
TIME_SCALE = 20.0  # simulated seconds per second, so that a mission lasts a moment
QUIET = 5  # s, the shortest there is
LATEST = 1.0  # s, after which the network delivers at the latest
SLOWEST = 3.0  # s that a good answer takes at most
GRACE = 1.0 + LATEST + SLOWEST + 0.5  # s after which no withdrawn start arrives; the last for seeing it
LIFE = (0.5, 12.0)  # s
LONG_LIFE = 25.0  # s, one of eight: what the life before left in doubt is known 15 s after the start at the earliest
REBOOT = 1.0  # s that one takes: were robots away for as long as all tries last, starts would fail rightly
OPERATORS = 3
FAULTS = ("drop_request", "drop_response", "late", "status_503", "html", "truncate", "garbage")
WITHDRAWALS = ("off", "remove", "cancel", "clear", "robot off")


@dataclass
class Result:
    seconds: float = 0.0
    kills: int = 0
    acts: Counter[str] = field(default_factory=Counter)
    states: Counter[str] = field(default_factory=Counter)
    items: int = 0
    problems: list[str] = field(default_factory=list)

    def line(self) -> str:
        verdict = "ok" if not self.problems else f"{len(self.problems)} VIOLATIONS"
        return (
            f"{self.seconds / 60:.1f} min, {self.kills} kills, {sum(self.acts.values())} acts "
            f"({', '.join(f'{name} {count}' for name, count in sorted(self.acts.items()))}), {self.items} items on robots; rows: "
            f"{', '.join(f'{name} {count}' for name, count in sorted(self.states.items()))}; verdict: {verdict}"
        )


class Robots(threading.Thread):
    """What happens to the robots, and when each item was first seen there."""

    def __init__(self, fleet: mir_sim.Fleet, seed: int) -> None:
        super().__init__(daemon=True)
        self._fleet, self._rng = fleet, random.Random(f"robots/{seed}")
        self.first_seen: dict[tuple[str, int], float] = {}
        self._calm = threading.Event()
        self._end = threading.Event()

    def run(self) -> None:
        trouble_at = 0.0
        while not self._end.wait(0.05):
            for robot in self._fleet.robots:
                for item in list(robot.model.queue):
                    self.first_seen.setdefault((robot.name, item.id), time.time())
            if not self._calm.is_set() and time.monotonic() >= trouble_at:
                trouble_at = time.monotonic() + self._rng.uniform(0.2, 1.5)
                self._trouble(self._rng.choice(self._fleet.robots))

    def _trouble(self, robot: mir_sim.FleetRobot) -> None:
        rng = self._rng
        robot.control({"battery": 90, "fault": None})
        match rng.randrange(8):
            case 0:
                robot.control({"reboot_seconds": REBOOT})
            case 1:
                robot.control({"fault": {"kind": "drop_request", "count": None}})
            case 2 | 3:
                robot.control({"fault": {"kind": "delay", "count": None, "seconds": rng.uniform(0.2, SLOWEST)}})
            case 4:
                robot.control({"fault": {"kind": rng.choice(FAULTS), "count": 2, "seconds": LATEST}})
            case _:
                kind = rng.choice(FAULTS)
                robot.control(
                    {
                        "fault": {
                            "kind": kind,
                            "method": "POST",
                            "path": "/mission_queue",
                            "count": 3,
                            "seconds": rng.uniform(0.05, LATEST),
                        }
                    }
                )

    def calm_down(self) -> None:
        self._calm.set()
        time.sleep(0.2)
        for robot in self._fleet.robots:
            robot.control({"battery": 90, "fault": None})

    def stop(self) -> None:
        self._end.set()
        self.join()


class Tablet:
    """The process under stress."""

    def __init__(self, data_dir: Path, diary: Path, name: str, operators: int) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.simulation.stress_tablet", str(data_dir), str(diary), name, str(operators)],
            cwd=ROOT,
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=environment(),
        )
        self.stderr: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        self.stderr += self.process.stderr

    def wait_ready(self) -> None:
        line = self.process.stdout.readline()
        if line != "ready\n":
            self.end(kill=True)
            raise AssertionError("".join(self.stderr))

    def end(self, *, kill: bool) -> None:
        if kill:
            self.process.kill()
            self.process.wait()
        else:
            self.process.communicate("", timeout=30)
        self._reader.join(10)


class Stress:
    def __init__(self, directory: Path, seed: int, robots: int = 3) -> None:
        self._data, self._diary, self._seed, self._count = directory / "data", directory / "diary", seed, robots
        self._rng = random.Random(f"stress/{seed}")
        self.result = Result()

    def run(self, seconds: float, patience: float = 120.0) -> Result:
        began = time.monotonic()
        with mir_sim.serve(robots=self._count, time_scale=TIME_SCALE, seed=self._seed) as fleet:
            settings = {"poll_interval_seconds": 2, "unknown_outcome_quiet_seconds": QUIET, "retry_limit": 20}
            import_configuration(self._data, configuration_of(fleet, **settings))
            robots = Robots(fleet, self._seed)
            robots.start()
            life = 0
            while time.monotonic() - began < seconds:
                life += 1
                self._live(life, fleet, LONG_LIFE if life % 8 == 0 else self._rng.uniform(*LIFE))
            robots.calm_down()
            self._come_to_rest(patience)
            robots.stop()
            self.result.seconds = time.monotonic() - began
            self._judge(fleet, robots.first_seen)
        return self.result

    def _live(self, life: int, fleet: mir_sim.Fleet, for_seconds: float) -> None:
        if life % 5 == 0:
            self._live_headless(life, fleet, for_seconds)
        else:
            tablet = Tablet(self._data, self._diary, f"{self._seed}.{life}", OPERATORS)
            tablet.wait_ready()
            time.sleep(for_seconds)
            tablet.end(kill=True)
            self._read_errors(tablet.stderr)
        self.result.kills += 1

    def _live_headless(self, life: int, fleet: mir_sim.Fleet, for_seconds: float) -> None:
        """The app itself, with an import at the same time, which it may take over just as it dies."""
        schedules = [
            once_now(self._rng.choice(fleet.robots).name, MISSION, f"import-{life}-{number}") for number in range(5)
        ]
        path = write_configuration(self._data.with_name("import.json"), {"schedules": schedules})
        app = App(self._data)
        importing = begun(self._data, "--import-config", path)
        time.sleep(for_seconds)
        app.kill()
        importing.communicate(timeout=300)  # a bound, no measure: the machine may be busy
        self._read_errors(app.stderr)

    def _come_to_rest(self, patience: float) -> None:
        tablet = Tablet(self._data, self._diary, f"{self._seed}.calm", 0)
        tablet.wait_ready()
        try:
            wait_for(
                lambda: (
                    not self._rows(
                        "SELECT 1 FROM executions WHERE ended_at IS NULL UNION ALL SELECT 1 FROM current_schedules"
                        " WHERE next_at IS NOT NULL"
                    )
                ),
                patience,
                "everything has ended",
            )
        except AssertionError as error:
            self.result.problems.append(str(error))
        finally:
            tablet.end(kill=False)
            self._read_errors(tablet.stderr)

    def _read_errors(self, stderr: list[str]) -> None:
        for number, line in enumerate(stderr):
            if "Traceback" in line:
                self.result.problems.append("".join(stderr[number : number + 40]))
                return

    # ------------------------------------------------------------------ the judgement
    def _rows(self, sql: str) -> list[sqlite3.Row]:
        with closing(sqlite3.connect(f"{(self._data / 'amr-scheduler.db').as_uri()}?mode=ro", uri=True)) as c:
            c.row_factory = sqlite3.Row
            return c.execute(sql).fetchall()

    def _judge(self, fleet: mir_sim.Fleet, first_seen: dict[tuple[str, int], float]) -> None:
        events = [json.loads(line) for line in self._diary.read_text().splitlines()]
        rows = self._rows("SELECT * FROM executions")
        items: dict[str, list[tuple[str, Any]]] = {}
        for robot in fleet.robots:
            for item in robot.model.queue:
                items.setdefault(item.description, []).append((robot.name, item))
        self.result.acts = Counter(event["act"] for event in events if event["event"] == "done")
        self.result.states = Counter(row["state"] for row in rows)
        self.result.items = sum(map(len, items.values()))
        if (found := self._rows("PRAGMA integrity_check")[0][0]) != "ok":
            self.result.problems.append(found)
        problems = self.result.problems
        problems += [
            f"{len(copies)} items with one token: {token}" for token, copies in items.items() if len(copies) > 1
        ]
        problems += [f"an item without a row: {token}" for token in items.keys() - {row["token"] for row in rows}]
        problems += list(_about_rows(rows, items))
        problems += list(_not_run(events, rows, items))
        problems += list(_sent_though_withdrawn(events, rows, items, first_seen))


def _about_rows(rows: list[sqlite3.Row], items: dict[str, list[tuple[str, Any]]]) -> Iterator[str]:
    for row in rows:
        states = [str(item.state) for _robot, item in items.get(row["token"], ())]
        if (row["state"] == "completed") != ("Done" in states) or row["ended_at"] is None:
            yield f"the robot says {states}, the row {_describe(row)}"


def _not_run(
    events: list[dict[str, Any]], rows: list[sqlite3.Row], items: dict[str, list[tuple[str, Any]]]
) -> Iterator[str]:
    """What was certainly added, and what was never even partly withdrawn, has been on its robot."""
    by_name = {row["schedule"]: row for row in rows if row["schedule"]}
    by_token = {row["token"]: row for row in rows}
    touched = {event["about"] for event in events if event["act"] in WITHDRAWALS}
    for event in events:
        if event["act"] in ("add", "run") and event["event"] == "done" and event["robot"] not in touched:
            row = (by_name if event["act"] == "add" else by_token).get(event["about"])
            if row is None:
                if event["about"] not in touched:
                    yield f"no row of {event['about']}"
            elif not {event["about"], row["token"]} & touched and row["token"] not in items:
                yield f"never ran: {_describe(row)}"


def _sent_though_withdrawn(
    events: list[dict[str, Any]],
    rows: list[sqlite3.Row],
    items: dict[str, list[tuple[str, Any]]],
    first_seen: dict[tuple[str, int], float],
) -> Iterator[str]:
    """Starts that arrived at their robot this long after they were withdrawn, under a hold, or at a robot that was
    switched off."""
    schedule_of = {row["token"]: row["schedule"] for row in rows}
    arrived = [
        (first_seen.get((robot, item.id), 0.0), robot, token)
        for token, copies in items.items()
        for robot, item in copies
    ]
    ends = {"off": None, "remove": "undo", "hold": "release", "robot off": "robot on"}
    for number, event in enumerate(events):
        if event["event"] != "done" or event["act"] not in ends:
            continue
        until = next(
            (
                later["at"]
                for later in events[number:]
                if later["act"] == ends[event["act"]] and later["about"] == event["about"]
            ),
            float("inf"),
        )
        for at, robot, token in arrived:
            is_about = event["act"] == "hold" or event["about"] in (robot, schedule_of.get(token))
            if is_about and event["at"] + GRACE < at < until:
                yield f"arrived {at - event['at']:.1f} s after {event['act']} of {event['about']}: {token}"


def _describe(row: sqlite3.Row) -> str:
    what = row["schedule"] or row["trigger"]
    return f"#{row['id']} {what} on {row['robot']}: {row['state']} {row['reason_code']}, {row['attempts']} attempts"


def stress(seconds: float, seed: int = 1) -> Result:
    with tempfile.TemporaryDirectory(prefix="amr-stress-") as directory:
        return Stress(Path(directory), seed).run(seconds)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.simulation.stress", description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    result = stress(options.minutes * 60, options.seed)
    print("\n".join([*result.problems[:40], result.line()]))
    return 1 if result.problems else 0


if __name__ == "__main__":
    sys.exit(main())
