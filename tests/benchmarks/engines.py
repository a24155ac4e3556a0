"""The schedulers that bench_dispatch compares, each in a process of its own: ``python -m tests.benchmarks.engines NAME < spec``.

All are given the same jobs and send the same POST to the same stub. One line of JSON comes back when everything is planned (the instant
each job is due), another when ``stop`` is read from stdin (processor seconds spent since).

* ``app``: this app's Container and PollLoop over HTTP, with the durable database and its log file.
* ``apscheduler``: APScheduler 3.x as its guide shows it, jobs in SQLite, 10 threads, the default grace of 1 s; ``apscheduler-patient``
  the same with ``misfire_grace_time=None``.
* ``schedule``: the ``schedule`` library with its usual loop of one second (what rmf-web runs).
* ``thesis``: Algorithms 1 and 2 of the thesis: one background thread, a poll every 30 s, one POST after the other.
"""

from __future__ import annotations

import json
import os
import resource
import sqlite3
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from app.database.execution_history import ExecutionHistory
from tests.benchmarks.stub import API, MISSION_GUID

TIMEOUT = 5.0  # s: what the rivals give a robot to connect and to answer, as the app does to answer
_local = threading.local()


@dataclass(frozen=True)
class Job:
    name: str
    robot: int
    offset: float  # s after the beginning


@dataclass(frozen=True)
class Spec:
    """The jobs of a run. ``robots`` are base URLs, ``idle_jobs`` more jobs that are not due today."""

    robots: list[str]
    jobs: list[Job]
    idle_jobs: int
    groups: int = 0  # each of every so many-th robot; a job's robot is the number of its group then

    @classmethod
    def read(cls, text: str) -> Spec:
        data = json.loads(text)
        return cls(data["robots"], [Job(*job) for job in data["jobs"]], data["idle_jobs"], data["groups"])

    def write(self) -> str:
        return json.dumps(
            {
                "robots": self.robots,
                "jobs": [[job.name, job.robot, job.offset] for job in self.jobs],
                "idle_jobs": self.idle_jobs,
                "groups": self.groups,
            }
        )


@dataclass
class Planned:
    """Everything is prepared: when each job is due."""

    due: dict[str, float]
    moved: Callable[[], list[float]] = list  # s from a refused connection until another robot had it


def post(url: str, name: str) -> bool:
    """What the rivals do when a job is due: one POST over a kept-alive session of the thread."""
    import requests

    session = getattr(_local, "session", None)
    if session is None:
        session = _local.session = requests.Session()
        session.trust_env = False
    try:
        answer = session.post(
            f"{url}{API}/mission_queue",
            json={"mission_id": MISSION_GUID, "message": name, "priority": 0},
            timeout=TIMEOUT,
        )
    except requests.RequestException:
        return False
    return bool(answer.status_code == 201)


# ---------------------------------------------------------------------- this app
def app(spec: Spec, directory: Path) -> Planned:
    from app.container import Container
    from app.database.groups import GroupRepository
    from app.domain.models import Group, Mission, Robot, Schedule
    from app.mir.credentials import Token
    from app.process import log_file as logs

    logs.start(directory / "logs", stderr=False)
    container = Container.open(directory)
    r, now = container.repositories, container.clock.now()
    token = Token.derive("distributor", "distributor").header
    begin = time.time() + 12.0  # s: the first poll of every robot is over, those that hang included
    daily = (now + timedelta(days=3)).replace(tzinfo=None, second=0, microsecond=0)

    def furnish(c: sqlite3.Connection) -> dict[str, int]:
        robots = [r.robots.add(c, Robot(f"R{n}", url, "distributor", token)) for n, url in enumerate(spec.robots)]
        mission = r.missions.add(c, Mission("Deliver", MISSION_GUID))
        later = Schedule(
            "",
            robots[0].id,
            mission.id,
            daily,
            "UTC",
            "FREQ=DAILY",
            respect_working_days=False,
            changed_at=now,
            next_at=daily.replace(tzinfo=UTC),
        )
        for n in range(spec.idle_jobs):
            r.schedules.add(c, replace(later, name=f"later {n}", robot_id=robots[n % len(robots)].id))
        groups = [
            GroupRepository().add(c, Group(f"G{n}", tuple(robot.id for robot in robots[n :: spec.groups])))
            for n in range(spec.groups)
        ]
        where = [
            {"robot_id": None, "group_id": groups[job.robot].id} if groups else {"robot_id": robots[job.robot].id}
            for job in spec.jobs
        ]
        return {
            job.name: r.schedules.add(c, replace(later, name=job.name, **target)).id
            for job, target in zip(spec.jobs, where, strict=True)
        }

    ids = container.db.write(furnish)
    container.runner.start()
    begin = max(begin, time.time() + 10.0)
    due = {job.name: begin + job.offset for job in spec.jobs}

    def plan(c: sqlite3.Connection) -> None:  # the app plans whole minutes; the benchmark wants any instant
        for name, instant in due.items():
            r.schedules.advance(c, ids[name], datetime.fromtimestamp(instant, UTC))

    container.db.write(plan)
    container.runner.wake()

    def moved() -> list[float]:
        rows = [row for row in ExecutionHistory().stream(container.db.read()) if row.tried and row.submitted_at]
        return [
            (row.submitted_at - datetime.fromisoformat(each["at"])).total_seconds()
            for row in rows
            for each in row.tried.values()
        ]

    return Planned(due, moved)


# ---------------------------------------------------------------------- the others
def apscheduler(spec: Spec, directory: Path, grace: int | None = 1) -> Planned:
    import logging

    from apscheduler.executors.pool import ThreadPoolExecutor
    from apscheduler.jobstores.sqlalchemy import SQLAlchemyJobStore
    from apscheduler.schedulers.background import BackgroundScheduler

    logging.disable(logging.CRITICAL)
    scheduler = BackgroundScheduler(
        timezone=UTC,
        jobstores={"default": SQLAlchemyJobStore(url=f"sqlite:///{directory}/jobs.db")},
        executors={"default": ThreadPoolExecutor(10)},
        job_defaults={"misfire_grace_time": grace},
    )
    scheduler.start(paused=True)
    far, began = datetime.now(UTC) + timedelta(days=3), time.time()
    idle_jobs = max(spec.idle_jobs, 200)
    for n in range(idle_jobs):
        scheduler.add_job(post, "date", run_date=far, args=[spec.robots[0], f"later {n}"], id=f"later {n}")
    seconds_each = (time.time() - began) / idle_jobs  # one commit each: jobs can't be stored in another way
    begin = time.time() + 5.0 + 3 * seconds_each * len(spec.jobs)
    due = {job.name: begin + job.offset for job in spec.jobs}
    for job in spec.jobs:
        scheduler.add_job(
            post,
            "date",
            run_date=datetime.fromtimestamp(due[job.name], UTC),
            args=[spec.robots[job.robot], job.name],
            id=job.name,
        )
    if time.time() > begin:
        raise RuntimeError("storing the jobs took longer than expected")
    scheduler.resume()
    return Planned(due)


def apscheduler_patient(spec: Spec, directory: Path) -> Planned:
    return apscheduler(spec, directory, grace=None)


def schedule(spec: Spec, directory: Path) -> Planned:
    import schedule as library

    scheduler = library.Scheduler()
    begin = float(int(time.time() + 4.0 + (len(spec.jobs) + spec.idle_jobs) * 0.001))
    due = {job.name: float(int(begin + job.offset)) for job in spec.jobs}  # a second is the finest the library has

    def job_of(job: Job) -> Callable[[], Any]:
        def run() -> Any:
            post(spec.robots[job.robot], job.name)
            return library.CancelJob

        return run

    for n in range(spec.idle_jobs):
        scheduler.every(3 + n % 5).days.do(post, spec.robots[0], f"later {n}")
    for job in spec.jobs:
        scheduler.every().day.at(datetime.fromtimestamp(due[job.name]).strftime("%H:%M:%S")).do(job_of(job))

    def loop() -> None:
        while True:
            scheduler.run_pending()
            time.sleep(1)

    threading.Thread(target=loop, daemon=True).start()
    return Planned(due)


def thesis(spec: Spec, directory: Path, poll: float = 30.0, tries: int = 3) -> Planned:
    db = sqlite3.connect(directory / "thesis.db", check_same_thread=False)
    db.execute("CREATE TABLE scheduled (name TEXT PRIMARY KEY, robot INTEGER, due REAL, tries INTEGER DEFAULT 0)")
    begin = time.time() + 4.0
    due = {job.name: begin + job.offset for job in spec.jobs}
    rows = [(job.name, job.robot, due[job.name]) for job in spec.jobs]
    rows += [(f"later {n}", 0, begin + 3 * 86400) for n in range(spec.idle_jobs)]
    db.executemany("INSERT INTO scheduled (name, robot, due) VALUES (?, ?, ?)", rows)
    db.commit()

    def poll_scheduler() -> None:
        for name, robot, instant, tried in db.execute("SELECT name, robot, due, tries FROM scheduled").fetchall():
            if time.time() < instant:
                continue
            if post(spec.robots[robot], name) or tried + 1 >= tries:
                db.execute("DELETE FROM scheduled WHERE name = ?", (name,))
            else:
                db.execute("UPDATE scheduled SET tries = tries + 1 WHERE name = ?", (name,))
            db.commit()

    def loop() -> None:
        next_poll = begin - poll / 2  # the poll's phase: due instants lie anywhere between two polls
        while True:
            time.sleep(max(0.0, next_poll - time.time()))
            poll_scheduler()
            next_poll = max(next_poll + poll, time.time())

    threading.Thread(target=loop, daemon=True).start()
    return Planned(due)


ENGINES: dict[str, Callable[[Spec, Path], Planned]] = {
    "app": app,
    "apscheduler": apscheduler,
    "apscheduler-patient": apscheduler_patient,
    "schedule": schedule,
    "thesis": thesis,
}


def _cpu() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def main() -> None:
    engine, spec = ENGINES[sys.argv[1]], Spec.read(sys.stdin.readline())
    with tempfile.TemporaryDirectory(prefix="bench-") as directory:
        planned = engine(spec, Path(directory))
        before = _cpu()
        print(json.dumps({"due": planned.due}), flush=True)
        sys.stdin.readline()
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(json.dumps({"cpu": _cpu() - before, "moved": planned.moved(), "megabytes": peak}), flush=True)
    os._exit(0)  # requests that still hang end with the process


if __name__ == "__main__":
    main()
