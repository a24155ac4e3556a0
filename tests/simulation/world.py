"""Hours of operation in seconds: the real services, simulated robots, and everything that can go wrong drawn by one seed.

The app is killed between any two steps (before a commit, after it, before a request leaves, after the robot has it), requests meet
every fate of ``tests.support.network``, robots reboot and go silent, the wall clock is moved. The oracle never looks into the app's code:
it knows the plan by counting minutes, and what ran by the robots' own histories.
"""
from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

from app.domain.models import OPEN_STATES, Overlap, Schedule, State
from app.mir.errors import RobotError
from tests.support.network import Network
from tests.support.site import Site

START = datetime(2026, 10, 24, 12, 0, tzinfo=UTC)        # the night of the autumn change comes first
ZONE = "Europe/Helsinki"


class Crash(BaseException):
    """The app is gone. Not an Exception, so that nothing in the app can catch it."""


class ShakyWriter:
    """The database's writer, in front of and behind which the app may die."""

    def __init__(self, writer: Any, interrupt: Callable[[str], None]) -> None:
        self._writer, self._interrupt = writer, interrupt

    def run(self, work: Callable[[Any], Any], patient: bool = False) -> Any:
        self._interrupt("before commit")
        result = self._writer.run(work, patient)
        self._interrupt("after commit")
        return result

    def close(self) -> None:
        self._writer.close()


@dataclass(frozen=True)
class Profile:
    """How rough the world is."""
    robots: int = 5
    every_minutes: int = 3                # one schedule per robot and this interval
    poll_interval: int = 120
    fault_rate: float = 0.03
    crash_rate: float = 0.004              # per step at which the app can die
    outage_every: float = 6 * 3600.0       # s, per robot
    longest_outage: float = 1200.0
    longest_off: float = 1500.0            # s that the tablet stays off after a crash
    clock_steps_every: float = 12 * 3600.0
    reboots_every: float = 24 * 3600.0
    operator_every: float = 2 * 3600.0


@dataclass
class Findings:
    """What the run brought, and everything that should not be."""
    hours: float = 0.0
    occurrences: int = 0
    crashes: int = 0
    steps: int = 0
    faults: Counter[str] = field(default_factory=Counter)
    states: Counter[str] = field(default_factory=Counter)
    violations: list[str] = field(default_factory=list)

    def line(self, profile: Profile, seed: int) -> str:
        verdict = "ok" if not self.violations else f"{len(self.violations)} VIOLATIONS"
        states = ", ".join(f"{name} {count}" for name, count in sorted(self.states.items()))
        return (f"seed {seed}: {profile.robots} robots, poll every {profile.poll_interval} s, {self.hours:.0f} simulated hours, "
                f"{self.occurrences} occurrences, {sum(self.faults.values())} faults, {self.crashes} app crashes, {self.steps} steps; "
                f"{states}; verdict: {verdict}")


class World:
    def __init__(self, directory: Path, seed: int, profile: Profile) -> None:
        self.rng = random.Random(f"world/{seed}")
        self.profile, self.findings = profile, Findings()
        network = Network(rate=profile.fault_rate, seed=seed)
        self.site = Site(directory, robots=profile.robots, now=START, network=network, timezone=ZONE, robot_speed=16.0)
        self.wall_shift = 0.0
        self._furnish()
        network.interrupt = self._maybe_crash
        self._armed = True
        self.site.switched_on = self._make_shaky
        self._make_shaky()
        self._plan_trouble()

    # ------------------------------------------------------------------ the plan
    def _furnish(self) -> None:
        site, profile = self.site, self.profile
        mission = site.add_mission("Deliver")
        catalogue = site.container.catalogue
        catalogue.change_settings(poll_interval_seconds=profile.poll_interval, history_limit=None, timezone=ZONE,
                                  working_days=("MO", "TU", "WE", "TH", "FR", "SA", "SU"))
        local = START.astimezone(ZoneInfo(ZONE)).replace(tzinfo=None)
        for number, robot in enumerate(site.add_robots()):
            first = local + timedelta(minutes=1 + number)
            often = f"FREQ=MINUTELY;INTERVAL={profile.every_minutes}"
            catalogue.save_schedule(Schedule(f"often {robot.name}", robot.id, mission.id, first, ZONE, often, overlap=Overlap.QUEUE,
                                             start_window_minutes=8))
            catalogue.save_schedule(Schedule(f"nightly {robot.name}", robot.id, mission.id, first.replace(hour=3, minute=30), ZONE,
                                             "FREQ=DAILY", priority=5))

    def expected(self, schedule: Schedule, until: datetime) -> Iterator[datetime]:
        """Every instant of a schedule up to ``until``, counted by hand."""
        first = schedule.start.replace(tzinfo=ZoneInfo(ZONE)).astimezone(UTC)
        instant, day = first, schedule.start
        while instant <= until:
            if instant > START:
                yield instant
            if "MINUTELY" in (schedule.recurrence or ""):
                instant += timedelta(minutes=self.profile.every_minutes)
            else:
                day += timedelta(days=1)
                instant = day.replace(tzinfo=ZoneInfo(ZONE)).astimezone(UTC)

    # ------------------------------------------------------------------ trouble
    def _plan_trouble(self) -> None:
        p = self.profile
        for name in self.site.machines:
            self._again(p.outage_every, lambda name=name: self._outage(name))  # type: ignore[misc]
            self._again(p.reboots_every, lambda name=name: self._reboot(name))  # type: ignore[misc]
        self.site.at(900.0, self._attend)
        self._again(p.clock_steps_every, self._step_clock)
        self._again(p.operator_every, self._operator)

    def _again(self, mean: float, what) -> None:  # type: ignore[no-untyped-def]
        def happen() -> None:
            what()
            self.site.at(self.rng.expovariate(1 / mean), happen)
        self.site.at(self.rng.expovariate(1 / mean), happen)

    def _attend(self) -> None:
        """Somebody on the floor: clears errors, lets robots go on, plugs them in."""
        for machine in self.site.machines.values():
            machine.clear_errors()
            machine.resume()
            machine.set_battery(90.0)
        self.site.at(900.0, self._attend)

    def _outage(self, name: str) -> None:
        self.site.network.down.add(name)
        self.findings.faults["outage"] += 1
        self.site.at(self.rng.uniform(10, self.profile.longest_outage), lambda: self.site.network.down.discard(name))

    def _reboot(self, name: str) -> None:
        self.findings.faults["reboot"] += 1
        self.site.machines[name].reboot(self.rng.uniform(10, 60))

    def _step_clock(self) -> None:
        """NTP corrections; the shift stays small, or the plan itself would be another."""
        shift = self.rng.uniform(-45, 45) - self.wall_shift
        self.wall_shift += shift
        self.findings.faults["clock step"] += 1
        self.site.clock.step(shift)

    def _operator(self) -> None:
        """Somebody at the tablet: cancels, clears, runs now."""
        container = self.site.container
        open_ones = container.history.open()
        robot = self.rng.choice(container.repositories.robots.all(container.db.read()))
        try:
            match self.rng.randrange(8):
                case 0 if open_ones:
                    container.operator.cancel_execution(self.rng.choice(open_ones).id)
                case 1:
                    container.operator.clear_queue(robot.id)
                case 2:
                    container.operator.run_now(robot.id, container.repositories.missions.all(container.db.read())[0].id)
                    self.site.kick()                          # as the app's own loop does when the ledger tells it
        except RobotError:
            pass                                              # shown to the operator, who may press again

    def _make_shaky(self) -> None:
        db = self.site.container.db
        db._writer = ShakyWriter(db._writer, self._maybe_crash)

    def _maybe_crash(self, where: str) -> None:
        self.findings.steps += 1
        if self._armed and self.rng.random() < self.profile.crash_rate:
            raise Crash(where)

    # ------------------------------------------------------------------ running
    def run(self, hours: float) -> Findings:
        end = self.site.clock.monotonic() + hours * 3600
        while self.site.clock.monotonic() < end:
            try:
                self.site.run(min(600.0, end - self.site.clock.monotonic()))
            except Crash:
                self._recover()
            self._check_doubles()
        self._settle()
        self.findings.hours = hours
        self.findings.faults.update(self.site.network.counts)
        self._verdict()
        return self.findings

    def _recover(self) -> None:
        """Power is back after a while; the start itself may be cut short too."""
        while True:
            self.findings.crashes += 1
            self.site.switch_off(cleanly=False)
            self.site.clock.advance(self.rng.uniform(1, self.profile.longest_off if self.rng.random() < .2 else 60))
            try:
                self.site.switch_on()
                return
            except Crash:
                continue

    def _settle(self) -> None:
        """Calm weather until everything has ended."""
        self._armed = False
        network = self.site.network
        network.rate = 0.0
        network.down.clear()
        self.site.run(1000)                                    # time to see what was missed while it was off
        schedules = self.site.container.repositories.schedules.all(self.site.container.db.read())
        for schedule in schedules:
            self.site.container.catalogue.set_schedule_enabled(schedule.id, False)
        self.stopped_at = self.site.clock.now()
        self.schedules = schedules
        self.site.run(3600)

    # ------------------------------------------------------------------ the oracle
    def _items(self) -> Iterator[tuple[str, object]]:
        for name, machine in self.site.machines.items():
            for item in machine.queue:
                yield name, item

    def _check_doubles(self) -> None:
        tokens = Counter(item.description for _, item in self._items() if item.description)      # type: ignore[attr-defined]
        self.findings.violations += [f"{count} items with one token {token}" for token, count in tokens.items() if count > 1]

    def _verdict(self) -> None:
        rows = self.site.executions()
        self.findings.states = Counter(row.state.value for row in rows)
        self.findings.violations += [f"stuck: {row}" for row in rows if row.state in OPEN_STATES]
        self._every_occurrence_has_its_row(rows)
        self._rows_agree_with_robots(rows)
        self._kpis_agree(rows)

    def _every_occurrence_has_its_row(self, rows: list) -> None:
        found = Counter((row.schedule, row.planned_at) for row in rows if row.schedule)
        slack = timedelta(seconds=120)                       # around the moment when the plan was switched off, and clock steps
        wanted = {(s.name, instant) for s in self.schedules for instant in self.expected(s, self.stopped_at - slack)}
        self.findings.occurrences = len(found)
        self.findings.violations += [f"no row: {key}" for key in wanted - found.keys()]
        self.findings.violations += [f"{count} rows: {key}" for key, count in found.items() if count > 1]
        possible = {(s.name, instant) for s in self.schedules for instant in self.expected(s, self.stopped_at + slack)}
        self.findings.violations += [f"never planned: {key}" for key in found.keys() - possible]

    def _rows_agree_with_robots(self, rows: list) -> None:
        items = {item.description: str(item.state) for _, item in self._items() if item.description}     # type: ignore[attr-defined]
        for row in rows:
            item = items.pop(row.token, None)
            match row.state:
                case State.COMPLETED:
                    agrees = item == "Done"
                case State.FAILED | State.CANCELLED:
                    agrees = item in ("Aborted", None) or row.reason.code in ("vanished", "unknown_outcome")
                case _:
                    agrees = item is None
            if not agrees:
                self.findings.violations.append(f"row says {row.state} ({row.reason}), robot says {item}")
        self.findings.violations += [f"an item without a row: {token}" for token in items]

    def _kpis_agree(self, rows: list) -> None:
        completed = [row for row in rows if row.state is State.COMPLETED]
        failed = [row for row in rows if row.state is State.FAILED]
        kpis = self.site.container.kpis.thesis()
        if kpis.completed != len(completed) or kpis.failed != len(failed):
            self.findings.violations.append(f"KPIs count {kpis.completed}/{kpis.failed}, the ledger {len(completed)}/{len(failed)}")
