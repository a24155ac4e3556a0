"""How long suggestions take to compute, and how good they are: tried out in the month after the one that they were learned from.

    uv run python -m tests.benchmarks.bench_suggestions            # 579 schedules, 28 days
    uv run python -m tests.benchmarks.bench_suggestions --backtest [--sites 12]

Backtest: invented sites of four robots (``tests/benchmarks/hall``), half of them with robots chosen by chance. Each option of some findings
is accepted alone; ``helped``: at least 10 points and 40 % fewer late starts in the next month, ``useless``: less than 5 points fewer.
"""

from __future__ import annotations

import argparse
import copy
import random
import sqlite3
import statistics
import tempfile
import time
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

from app.container import Container
from app.database.activities import ActivityRepository
from app.database.connection import Database
from app.database.groups import GroupRepository
from app.domain.activity import ActivitySpan
from app.domain.models import Execution, Group, Mission, Robot, Schedule, State, Trigger
from app.services.suggestions.find import Finding, Kind, Option, findings, shifts
from app.services.suggestions.find import Rule as Known
from app.services.suggestions.replay import DAY, Busy, Past, Start
from tests.benchmarks.hall.day import Day
from tests.benchmarks.hall.day import Robot as Machine
from tests.benchmarks.hall.policies import FixedRobot, ThisApp
from tests.benchmarks.hall.site import CRITICAL, HOUR, Learned, Rule, Run, Site
from tests.support.clock import VirtualClock

DAYS, ROBOTS, SCHEDULES = 28, 10, 579
MONTH = 20  # working days
TRIED = 6  # findings of each site whose options are tried out
BY_HAND, URGENT = 0.10, 0.02  # shares of the runs


# ---------------------------------------------------------------------- good
class Watched(Day):
    """Notes what each robot did when."""

    def _end(self, robot: Machine) -> None:
        if not hasattr(self, "spans"):
            self.spans: list[tuple[int, float, float, Run | None]] = []
        assert robot.running is not None
        self.spans.append((robot.number, robot.began, self.now, robot.running[1]))
        super()._end(robot)


def a_site(seed: int, is_careful: bool) -> Site:
    site = Site(seed, 4, 0.52 if is_careful else 0.42, by_hand=BY_HAND, urgent=URGENT)
    rng = random.Random(f"careless/{seed}")
    for rule in site.rules:
        rule.is_fixed = True
        if not is_careful:
            rule.home = rng.randrange(4)
    tired = rng.randrange(4)  # one is never charged over night
    site.machines[tired] = replace(site.machines[tired], battery=45.0)
    return site


def runs_of(site: Site, rng: random.Random) -> tuple[list[Run], dict[int, int]]:
    """A day's runs, and the number of the rule of each by its id; what people do by hand is new every day."""
    end = site.hours * HOUR
    made = [
        (Run(0, rule.mission, at, rule.priority, rule.home, rule.is_fixed), number)
        for number, rule in enumerate(site.rules)
        for n in range(int(end / rule.period_s) + 1)
        if (at := rule.offset_s + n * rule.period_s) < end
    ]
    each = len(made) / (1 - BY_HAND - URGENT)
    made += [
        (Run(0, rng.choice(site.missions), rng.uniform(0, end), CRITICAL, is_urgent=True), -1)
        for _ in range(round(each * URGENT))
    ]
    site.by_hand = [
        (rng.uniform(0, end), rng.choice(site.missions), rng.randrange(len(site.machines)))
        for _ in range(round(each * BY_HAND))
    ]
    made.sort(key=lambda one: one[0].planned)
    for number, (run, _) in enumerate(made):
        run.id = number
    return [run for run, _ in made], {run.id: number for run, number in made}


def month(site: Site, learned: Learned, seed: int) -> list[tuple[Watched, dict[int, int]]]:
    has_group = any(not rule.is_fixed for rule in site.rules)
    days = []
    for n in range(MONTH):
        runs, rules = runs_of(site, random.Random(f"by hand/{seed}/{n}"))
        day = Watched(site, learned, ThisApp() if has_group else FixedRobot(), seed * 1000 + n, runs=runs)
        day.run()
        days.append((day, rules))
    return days


def past_of(site: Site, days: Sequence[tuple[Watched, dict[int, int]]]) -> Past:
    starts, busy = [], defaultdict[int, list[Busy]](list)
    for n, (day, rules) in enumerate(days):
        base = n * DAY
        ids = {}
        for run in day.runs:
            if (rule := rules[run.id]) >= 0:
                ids[run.id] = len(starts) + 1
                robot = (run.robot if run.robot is not None else run.home or 0) + 1
                starts.append(
                    Start(
                        len(starts) + 1,
                        rule + 1,
                        robot,
                        base + run.planned,
                        None if run.started is None else base + run.started,
                        None if run.ended is None else base + run.ended,
                        run.robot is None and run.state == "skipped",
                    )
                )
        for robot, begun, ended, run in day.spans:
            own = ids.get(run.id, 0) if run is not None else 0
            busy[robot + 1].append(
                Busy(
                    base + begun,
                    base + ended,
                    own,
                    base + run.planned if run is not None else None,
                    mission=str(run.mission.number) if run is not None else "",
                )
            )
    return Past(starts, busy)


def rules_of(site: Site) -> list[Known]:
    everyone = tuple(range(1, len(site.machines) + 1))
    return [
        Known(
            number,
            (rule.home + 1,),
            [s for s in shifts() if 0 <= rule.offset_s + s < rule.period_s],
            [robot for robot in everyone if robot != rule.home + 1],
            [(1, everyone)],
        )
        for number, rule in enumerate(site.rules, 1)
    ]


def accepted(site: Site, finding: Finding, option: Option) -> Site:
    changed = copy.copy(site)
    changed.rules = [replace(rule) for rule in site.rules]
    rule: Rule = changed.rules[finding.schedule - 1]
    if option.kind is Kind.TIME:
        rule.offset_s += option.value
    elif option.kind is Kind.ROBOT:
        rule.home = int(option.value) - 1
    else:
        rule.is_fixed = False
    return changed


def late_share(days: Sequence[tuple[Watched, dict[int, int]]], rule: int) -> float:
    own = [run for day, rules in days for run in day.runs if rules[run.id] == rule]
    return sum(run.late_s > 300 for run in own) / len(own)


def backtest(sites: int) -> None:
    of_all: list[bool] = []
    for is_careful in (False, True):
        results = defaultdict[Kind, list[tuple[float, float, float]]](list)
        schedules = found_in_all = 0
        for seed in range(sites):
            site = a_site(seed, is_careful)
            learned = Learned(site, seed)
            found = findings(past_of(site, month(site, learned, 1 + seed)), rules_of(site))
            schedules, found_in_all = schedules + len(site.rules), found_in_all + len(found)
            nothing = month(site, learned, 501 + seed) if found else []
            for finding in random.Random(seed).sample(found, min(TRIED, len(found))):
                was = late_share(nothing, finding.schedule - 1)
                for option in finding.options:
                    now = late_share(month(accepted(site, finding, option), learned, 501 + seed), finding.schedule - 1)
                    results[option.kind].append((was, now, option.late / finding.starts))
        print(
            f"\n{'careful' if is_careful else 'careless'} planner, {sites} sites: {schedules} schedules, {found_in_all} findings"
        )
        for kind, each in results.items():
            helped = sum(was - now >= 0.10 and now <= 0.6 * was for was, now, _ in each)
            useless = sum(was - now < 0.05 for was, now, _ in each)
            of_all += [was - now < 0.05 for was, now, _ in each]
            means = [100 * statistics.fmean(column) for column in zip(*each, strict=True)]
            print(
                f"{kind:6s} {len(each):3d} tried: late {means[0]:.0f} -> {means[1]:.0f} % (replay: {means[2]:.0f} %), helped {helped}, "
                f"useless {useless} ({100 * useless / len(each):.0f} %)",
                flush=True,
            )
    print(f"useless of all {len(of_all)}: {100 * sum(of_all) / len(of_all):.1f} %")


# ---------------------------------------------------------------------- fast
def furnish(container: Container) -> None:
    """Ten robots that are busy most of the working day, each with what it was seen doing; schedules of one to four starts a day."""
    r, now, chance = container.repositories, container.clock.now(), random.Random(3)
    first, long_ago = now - timedelta(days=DAYS), now - timedelta(days=400)

    def configured(c: sqlite3.Connection) -> tuple[list[Robot], list[Schedule]]:
        robots = [r.robots.add(c, Robot(f"R{n}", f"http://10.0.0.{n}", "d", "t")) for n in range(ROBOTS)]
        missions = [r.missions.add(c, Mission(f"M{n}", f"g{n}")) for n in range(30)]
        GroupRepository().add(c, Group("Hall", tuple(robot.id for robot in robots)))
        return robots, [
            r.schedules.add(
                c,
                Schedule(
                    f"S{n}",
                    robots[chance.randrange(ROBOTS)].id,
                    missions[n % 30].id,
                    datetime(2026, 1, 1, 6, 5 * chance.randrange(12)),
                    "UTC",
                    chance.choice(("FREQ=DAILY", "FREQ=DAILY;BYHOUR=7,9,11,13")),
                    changed_at=long_ago,
                    next_at=now + timedelta(days=1),
                ),
            )
            for n in range(SCHEDULES)
        ]

    robots, schedules = container.db.write(configured)
    rows, spans = [], defaultdict[int, list[ActivitySpan]](list)
    for day in range(DAYS):
        midnight = (first + timedelta(days=day)).replace(hour=0, minute=0, second=0, microsecond=0)
        due = [
            (midnight + timedelta(minutes=60 * hour + each.start.minute), each)
            for each in schedules
            for hour in ((7, 9, 11, 13) if "BYHOUR" in (each.recurrence or "") else (6 + each.id % 9,))
        ]
        free = dict.fromkeys((robot.id for robot in robots), midnight)
        for at, each in sorted(due, key=lambda one: (one[0], one[1].id)):
            assert each.robot_id is not None
            begins = max(at, free[each.robot_id])
            ends = free[each.robot_id] = begins + timedelta(seconds=chance.uniform(60, 300))
            rows.append(
                Execution(
                    Trigger.SCHEDULED,
                    each.robot_id,
                    "R",
                    f"M{each.id % 30}",
                    "g",
                    at,
                    at + timedelta(hours=1),
                    at,
                    f"{each.id} {at}",
                    "UTC",
                    State.COMPLETED,
                    schedule_id=each.id,
                    schedule=each.name,
                    submitted_at=at,
                    started_at=begins,
                    ended_at=ends,
                    robot_delay_s=(begins - at).total_seconds(),
                    duration_s=(ends - begins).total_seconds(),
                )
            )
            spans[each.robot_id].append(
                ActivitySpan("executing", begins, ends + timedelta(seconds=chance.uniform(0, 90)))
            )
    container.db.write(lambda c: r.executions.add_many(c, rows))
    for robot_id, seen in spans.items():
        container.db.write(lambda c, robot_id=robot_id, seen=seen: ActivityRepository().save(c, robot_id, seen))


def speed() -> None:
    with tempfile.TemporaryDirectory() as directory:
        container = Container(Database.open(Path(directory, "amr-scheduler.db"), durable=False), VirtualClock())
        furnish(container)
        rows = container.db.read().execute("SELECT count(*) FROM executions").fetchone()[0]
        took = []
        for _ in range(3):
            began, used = time.perf_counter(), time.process_time()
            advice = container.suggestions.compute()
            took.append((time.perf_counter() - began, time.process_time() - used))
        print(
            f"{SCHEDULES} schedules x {DAYS} days, {rows:,} starts, {ROBOTS} robots: "
            f"{statistics.median(wall for wall, _ in took):.2f} s, of the processor {min(used for _, used in took):.2f} s; "
            f"{len(advice.suggestions)} suggestions"
        )
        container.close()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--backtest", action="store_true")
    parser.add_argument("--sites", type=int, default=12)
    wanted = parser.parse_args()
    if wanted.backtest:
        backtest(wanted.sites)
    else:
        speed()


if __name__ == "__main__":
    main()
