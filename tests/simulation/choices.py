"""A small site at which something else may happen at every step: two starts on one robot, or for two robots of a group, driven through the
real engine and workers.

``Decisions`` is asked at every request, before and after every commit, and whenever the app is at rest. The site knows how to carry out
each answer, what of its state matters for what comes next, and whether what came out is right. The judgement reads the robot's own history
and a diary of the operator's acts, and of the app only its rows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, Protocol

from app.domain.execution import Execution, ReasonCode, State
from app.domain.models import Group, Schedule
from app.mir.errors import RobotError
from tests.simulation.memory import memory_of, rounded
from tests.simulation.world import shaky
from tests.support.edits import switch_robot
from tests.support.network import Fate, Network, Planned, Submission
from tests.support.site import Site
from tests.support.targets import ROBOT

BEGIN = datetime.fromisoformat("2026-11-23T06:00:50+00:00")  # a Monday, ten seconds before the first start
FIRST = BEGIN + timedelta(seconds=10)
READ_TIMEOUT = 5.0  # s, the client's
GRACE = 1.0  # s after which a withdrawn start must not be sent
OFF_FOR = (1.0, 45.0)  # s that the tablet is off after a crash
SETTLES_WITHIN = 900.0  # s of virtual time in which everything has ended
LOOKED_AFTER = 35.0  # s that the site is watched once everything has ended


@dataclass(frozen=True)
class Scenario:
    """``apart``: minutes between the two starts. ``quiet``: s after which a start that was not found may be sent again. ``robots``: of
    more than one, as a group, the starts are. ``target``: what takes the missions."""

    apart: int = 0
    robots: int = 1
    quiet: int = 8
    window_minutes: int = 6
    poll_interval: int = 30
    robot_speed: float = 30.0
    target: str = ROBOT

    @property
    def beyond(self) -> tuple[float, ...]:
        """Seconds after which a late request arrives: within the quiet time, just before it ends, and beyond it."""
        return READ_TIMEOUT + 3.0, READ_TIMEOUT + self.quiet - 1.0, READ_TIMEOUT + self.quiet + 4.0


class Decisions(Protocol):
    def fate(self, method: str, path: str, robot: str) -> str:
        """What this request to a robot meets: "fine", "refused", "lost", "answer_lost", or "late …" with its seconds."""

    def point(self, where: str) -> str:
        """What else happens here: "", "crash …" with the seconds off, "restart", or an operator's act."""


@dataclass
class Wanted:
    """A start as the plan has it. ``withdrawn_at``: seconds of true time at which the operator's act was over."""

    schedule: str
    instant: datetime
    withdrawn_at: float = math.inf


class _ChosenNetwork(Network):
    """Each request meets what the decisions say."""

    decisions: Decisions

    def fate_of(self, robot: str, method: str, path: str) -> Planned:
        name, _, seconds = self.decisions.fate(method, path, robot).partition(" ")
        return Planned(method, path, Fate(name), float(seconds) if seconds else None)


class ChoiceSite(Site):
    """Two schedules A and B on one robot, from ten seconds before they fall due until everything has ended."""

    def __init__(self, directory: Path, scenario: Scenario, decisions: Decisions) -> None:
        network = _ChosenNetwork(others_wait=False)
        self.decisions: Decisions = Undisturbed()
        self.scenario, self.is_operator_acting = scenario, False
        self.wanted: list[Wanted] = []
        self.off: list[tuple[float, float]] = []  # true times between which the tablet was off
        network.decisions = self.decisions
        super().__init__(
            directory,
            robots=scenario.robots,
            now=BEGIN,
            network=network,
            robot_speed=scenario.robot_speed,
            target=scenario.target,
        )
        self._furnish()
        self.run(5.0)
        self.switched_on = self._watch_commits
        self._watch_commits()
        network.interrupt = lambda where: self._point(where)
        self.decisions = network.decisions = decisions

    def _furnish(self) -> None:
        scenario, catalogue = self.scenario, self.container.catalogue
        robots, mission = self.add_robots(), self.add_mission("Deliver")
        group = catalogue.save_group(Group("Any", tuple(robot.id for robot in robots))) if len(robots) > 1 else None
        catalogue.change_settings(
            poll_interval_seconds=scenario.poll_interval,
            unknown_outcome_quiet_seconds=scenario.quiet,
            start_window_minutes=scenario.window_minutes,
            timezone="UTC",
        )
        for number, name in enumerate("AB"):
            instant = FIRST + timedelta(minutes=number * scenario.apart)
            catalogue.save_schedule(
                Schedule(
                    name,
                    None if group else robots[0].id,
                    mission.id,
                    instant.replace(tzinfo=None),
                    "UTC",
                    group_id=group and group.id,
                )
            )
            self.wanted.append(Wanted(name, instant))

    # ------------------------------------------------------------------ where something else may happen
    def _watch_commits(self) -> None:
        db: Any = self.container.db
        db.write = shaky(db.write, self._point)

    def _step(self) -> None:
        self._point("at rest")
        super()._step()

    def _point(self, where: str) -> None:
        if self.is_operator_acting:
            return
        what = self.decisions.point(where)
        if what.startswith("crash"):
            raise Crash(what)
        if what == "restart":
            raise Restart
        if what:
            self._act(what)

    def _act(self, what: str) -> None:
        """As another thread would: the engine's round and the worker's current step do not know of it and do not continue during it."""
        engine: Any = self.engine
        acting, self._acting = self._acting, None
        inserting, engine._inserting = engine._inserting, None
        self.is_operator_acting = self.network.others_wait = True
        try:
            {**ACTS, **GROUP_ACTS}[what](self)
        finally:
            self.is_operator_acting = self.network.others_wait = False
            self._acting, engine._inserting = acting, inserting

    # ------------------------------------------------------------------ the operator
    def schedule(self, name: str) -> Schedule:
        return next(schedule for schedule in self.container.catalogue.schedules() if schedule.name == name)

    def switch_schedule_off(self, name: str) -> None:
        self.container.catalogue.switch_schedule(self.schedule(name).id, False)
        self._note_withdrawal(name)

    def move(self, name: str) -> None:
        """To four minutes after it was first planned, and a minute further each time."""
        later = FIRST + timedelta(minutes=3 + sum(wanted.schedule == name for wanted in self.wanted))
        self.container.catalogue.save_schedule(
            replace(self.schedule(name), start=later.replace(tzinfo=None), enabled=True)
        )
        self._note_withdrawal(name)
        self.wanted.append(Wanted(name, later))

    def leave(self, name: str) -> None:
        """The robot with this name is no longer a member of the group; the other one stays."""
        [group] = self.container.catalogue.groups()
        robot = next(robot for robot in self.container.catalogue.robots() if robot.name == name)
        self.container.catalogue.save_group(
            replace(group, members=tuple(key for key in group.members if key != robot.id))
        )

    def switch_robot_off(self, name: str) -> None:
        robot = next(robot for robot in self.container.catalogue.robots() if robot.name == name)
        switch_robot(self.container.catalogue, robot.id, False)

    def cancel(self, name: str) -> None:
        row = next((row for row in self.container.history.open() if row.schedule == name), None)
        if row is None:
            return
        try:
            self.container.operator.cancel_execution(row.id)
        except RobotError:
            return
        self._note_withdrawal(name, row.planned_at)

    def _note_withdrawal(self, name: str, instant: datetime | None = None) -> None:
        """The plan of a schedule, or one start of it."""
        for wanted in self.wanted:
            if wanted.schedule == name and instant in (None, wanted.instant) and wanted.withdrawn_at == math.inf:
                wanted.withdrawn_at = self.seconds()

    # ------------------------------------------------------------------ running
    def run_to_the_end(self) -> None:
        """Until everything has ended and some time has passed."""
        end = self.clock.monotonic() + SETTLES_WITHIN
        quiet_since = None
        while self.clock.monotonic() < end:
            try:
                self.run(5.0)
            except Crash as crash:
                self._restart(cleanly=False, seconds=float(str(crash).split()[1]))
            except Restart:
                self._restart(cleanly=True, seconds=OFF_FOR[0])
            now = self.clock.monotonic()
            quiet_since = (quiet_since or now) if self.is_settled() else None
            if quiet_since is not None and now - quiet_since >= LOOKED_AFTER:
                return

    def _restart(self, *, cleanly: bool, seconds: float) -> None:
        """A crash in the start itself comes after a shorter absence."""
        began = self.seconds()
        self.is_operator_acting = self.network.others_wait = False
        while True:
            try:
                self.switch_off(cleanly=cleanly)
                self.stay_off(seconds)
                self.switch_on()
                break
            except Crash as crash:
                cleanly, seconds = False, float(str(crash).split()[1])
            except Restart:
                cleanly, seconds = True, OFF_FOR[0]
        self.off.append((began, self.seconds()))

    def is_settled(self) -> bool:
        """Whether nothing is planned, open, on the robot or being sent."""
        db = self.container.db.read()
        is_open = db.execute(
            "SELECT 1 FROM executions WHERE ended_at IS NULL UNION SELECT 1 FROM current_schedules WHERE next_at IS NOT NULL"
        )
        return (
            is_open.fetchone() is None and not self._flying() and all(item.finished for _robot, item in self._items())
        )

    def _items(self) -> list[tuple[str, Any]]:
        """The queue items of all robots, or what their fleet was ordered for them, each with its robot's name."""
        return [(name, item) for name in self.machines for item in self.queue(name)]

    def _flying(self) -> list[Submission]:
        """Requests that the app gave up, and that arrive later."""
        return [
            late for late in self.network.submissions if late.lands_at is not None and late.lands_at >= self.seconds()
        ]

    def _beyond(self) -> set[str]:
        """Tokens of those that arrived, or will, after the quiet time."""
        longest = READ_TIMEOUT + self.scenario.quiet
        return {
            late.token
            for late in self.network.submissions
            if late.lands_at is not None and late.lands_at - late.at > longest
        }

    # ------------------------------------------------------------------ what matters for what comes next
    def durable(self, grain: float) -> tuple[object, ...]:
        """What a crash leaves: the database, the robot, requests that still fly, and what the judgement remembers. Times rounded to
        ``grain`` s."""
        c, now = self.container.db.read(), self.seconds()
        names = {row[0]: row[1] for row in c.execute("SELECT token, schedule || planned_at FROM executions")}
        rows = [
            tuple(row)
            for row in c.execute(
                "SELECT schedule, planned_at, state, reason_code, wait, attempts, queue_floor, queue_id,"
                " cancel_code, revoked, hold_until IS NULL, robot, json_extract(tried, '$.1.tries'),"
                " json_extract(tried, '$.2.tries') FROM executions ORDER BY id"
            )
        ]
        members = [tuple(row) for row in c.execute("SELECT * FROM group_members")]
        plan = [
            tuple(row)
            for row in c.execute(
                "SELECT name, start, enabled, next_at, planned_through, started_through FROM schedules"
            )
        ]
        robots = [tuple(row) for row in c.execute("SELECT enabled, last_queue_id FROM robots")]
        items = [(robot, item.id, names.get(item.description), str(item.state)) for robot, item in self._items()]
        orders = [(order.number, order.state.value) for order in self.fleet.book] if self.fleet else []
        flights = [(names.get(late.token), rounded((late.lands_at or 0.0) - now, grain)) for late in self._flying()]
        beyond = sorted(str(names.get(token)) for token in self._beyond())
        judged = [(wanted.schedule, wanted.instant, wanted.withdrawn_at == math.inf) for wanted in self.wanted]
        return rows, plan, robots, members, items, orders, self._progress(grain), flights, beyond, judged

    def _progress(self, grain: float) -> tuple[tuple[float, ...], ...]:
        """The progress of the missions that robots execute."""
        return tuple(
            (machine.run.next_action, rounded(machine.run.elapsed(machine.now) / self.scenario.robot_speed, grain))
            if machine.run
            else ()
            for machine in self.machines.values()
        )

    def memory(self, grain: float) -> object:
        """What else the app remembers."""
        mono, wall = self.clock.monotonic(), self.clock.now()
        inboxes = [(key, [type(message).__name__ for message in inbox]) for key, inbox in self._inboxes.items()]
        due = [(key, rounded(at - mono, grain)) for key, at in self._due.items()]
        blocked = sorted(worker.robot.id for worker in self._blocked)
        return (
            memory_of(self.engine, mono, wall, grain),
            inboxes,
            due,
            rounded(self._next_round - mono, grain),
            blocked,
            self.container.holds.active() is not None,
            self._connection.remembered(grain) if self.fleet else (),
        )

    # ------------------------------------------------------------------ the judgement
    def violations(self) -> Iterator[str]:
        rows = self.executions()
        items = self._items()
        beyond = self._beyond()
        by_start = {(row.schedule, row.planned_at): row for row in rows}
        for row in rows:
            yield from self._about_row(
                row, [(robot, item) for robot, item in items if item.description == row.token], row.token in beyond
            )
        tokens = {row.token for row in rows}
        yield from (
            f"an item that no row knows: {robot} {item.id}" for robot, item in items if item.description not in tokens
        )
        for wanted in self.wanted:
            row = by_start.get((wanted.schedule, wanted.instant))
            if wanted.withdrawn_at == math.inf:
                if row is None:
                    yield f"no row: {wanted.schedule} {wanted.instant:%H:%M}"
                elif row.state is not State.COMPLETED and not self._was_overlapped(row, rows):
                    yield f"did not run: {describe(row)}"
            elif row is not None:
                yield from (
                    f"sent {post.at - wanted.withdrawn_at:.1f} s after it was withdrawn: {describe(row)}"
                    for post in self.network.submissions
                    if post.token == row.token and post.at > wanted.withdrawn_at + GRACE
                )
        yield from (
            f"sent early: {describe(row)}"
            for row in rows
            for post in self.network.submissions
            if post.token == row.token and post.at < (row.planned_at - BEGIN).total_seconds() - 0.001
        )

    def _about_row(self, row: Execution, items: list[tuple[str, Any]], was_beyond: bool) -> Iterator[str]:
        done = [(robot, item.id) for robot, item in items if item.state == "Done"]
        shown = ", ".join(f"{robot} {item.state}" for robot, item in items)
        if row.state.is_open:
            yield f"has not ended: {describe(row)}"
        if len(items) > 1 and not was_beyond:
            yield f"{len(items)} items ({shown}): {describe(row)}"
        if len(done) > 1 and was_beyond and not self._has_alarm(row):
            yield f"ran twice without an alarm: {describe(row)}"
        if (row.state is State.COMPLETED) != bool(done) and not (was_beyond and self._has_alarm(row)):
            yield f"the robot says {shown or 'nothing'}: {describe(row)}"
        if row.state is State.COMPLETED and (row.robot, row.queue_id) not in done:
            yield f"another item than the one that ran: {describe(row)}"

    @staticmethod
    def _was_overlapped(row: Execution, rows: list[Execution]) -> bool:
        """Whether an earlier start of the same schedule, whose runs don't overlap, was still with the robot, or may have been."""
        return (
            row.reason is not None
            and row.reason.code is ReasonCode.OVERLAP
            and any(
                other.schedule == row.schedule
                and other.planned_at < row.planned_at
                and other.attempts > 0
                and other.ended_at is not None
                and other.ended_at > row.planned_at
                for other in rows
            )
        )

    def _has_alarm(self, row: Execution) -> bool:
        codes = self.container.db.read().execute("SELECT code FROM alarms WHERE key = ?", (f"execution:{row.id}",))
        return bool({code for (code,) in codes} & {"duplicate_running", "duplicate_healed", "late_cancelled"})


class Crash(BaseException):
    """The app is off for as many seconds as the text ends with. Not an Exception, so that nothing in the app can catch it."""


class Restart(BaseException):
    """The app is ended properly and started again."""


class Undisturbed:
    """Nothing happens."""

    def fate(self, method: str, path: str, robot: str) -> str:
        return "fine"

    def point(self, where: str) -> str:
        return ""


ACTS: dict[str, Callable[[ChoiceSite], None]] = {
    f"{name} {schedule}": (lambda site, act=act, schedule=schedule: act(site, schedule))  # type: ignore[misc]
    for schedule in "AB"
    for name, act in (
        ("switch off", ChoiceSite.switch_schedule_off),
        ("cancel", ChoiceSite.cancel),
        ("move", ChoiceSite.move),
    )
}


GROUP_ACTS: dict[str, Callable[[ChoiceSite], None]] = {
    "switch off A": ACTS["switch off A"],
    "cancel A": ACTS["cancel A"],
    "move A": ACTS["move A"],
    "leave R1": lambda site: site.leave("R1"),
    "switch R1 off": lambda site: site.switch_robot_off("R1"),
}


def describe(row: Execution) -> str:
    reason = f" {row.reason.code}" if row.reason else ""
    return f"{row.schedule} {row.planned_at:%H:%M} {row.state}{reason}, {row.attempts} attempts, item {row.queue_id}"
