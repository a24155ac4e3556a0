"""Every order of what can go wrong: ``python -m tests.simulation.explorer --faults 3`` runs a small site through all of
them.

The site (``tests.simulation.choices``) is run once undisturbed. At each of its steps the process is copied for
everything else that may happen there (a lost request, a crash, an act of the operator …); each copy continues from
there, and does the same until the allowed number of faults has happened. A state that was met before with as many
faults left is not run again. What is the same state is decided by the database's rows, the robot's queue, requests
still on their way, everything that the engine and its workers remember, the place in the code, and the time, with times
rounded to ``grain`` seconds.
"""

from __future__ import annotations

import argparse
import gc
import hashlib
import logging
import os
import pickle
import sys
import tempfile
import traceback
from dataclasses import dataclass, field
from pathlib import Path

from tests.simulation.choices import ACTS, FIRST, GROUP_ACTS, OFF_FOR, ChoiceSite, Scenario
from tests.simulation.memory import rounded, under_way
from tests.support.network import QUEUE
from tests.support.targets import TARGETS

DATABASE = "amr-scheduler.db"
READS = (("POST", f"{QUEUE}/search"),)


COARSE = ("at rest", "after commit", f"before POST {QUEUE}", f"after POST {QUEUE}")


class Known(BaseException):
    """This state was met before."""


@dataclass
class Found:
    """What an exploration brought. ``traces``: for each violation what was chosen, as ``--replay`` takes it."""

    states: int = 0
    transitions: int = 0
    ends: int = 0
    points: int = 0
    violations: list[tuple[str, str]] = field(default_factory=list)
    seconds: float = 0.0

    def add(self, other: Found) -> None:
        self.states += other.states
        self.transitions += other.transitions
        self.ends += other.ends
        self.points += other.points
        self.violations += other.violations

    def line(self) -> str:
        verdict = "0 violations" if not self.violations else f"{len(self.violations)} VIOLATIONS"
        return (
            f"{self.states} states, {self.transitions} transitions, {self.ends} runs to the end, {self.points} steps, "
            f"{self.seconds:.0f} s: {verdict}"
        )


class Explorer:
    """``acts``: what the operator may do; ``grain`` in s. ``most``: violations after which it ends. ``coarse``: except requests that are
    lost, nothing happens between two reads or before a commit. ``off_for``: s that the tablet is off after a crash."""

    def __init__(
        self,
        directory: Path,
        scenario: Scenario,
        faults: int,
        *,
        grain: float = 5.0,
        acts: tuple[str, ...] = tuple(ACTS),
        most: int = 20,
        coarse: bool = False,
        off_for: tuple[float, ...] = OFF_FOR,
        says_how_far: bool = False,
    ) -> None:
        self._left, self._grain, self._most, self._coarse, self._says_how_far = (
            faults,
            grain,
            most,
            coarse,
            says_how_far,
        )
        self._acts, self._crashes = acts, [f"crash {seconds:g}" for seconds in off_for]
        self._known: dict[bytes, int] = {}  # by state: faults that were left
        self._new: dict[bytes, int] = {}  # of these, what the process that is waited for does not know yet
        self._passed: set[bytes] = set()  # states of this run itself
        self._trace: list[str] = []
        self._number = 0  # of the choice points of this run
        self._report: int | None = None  # where a copy of the process writes what it found
        self.found = Found()
        self.site = ChoiceSite(directory, scenario, self)
        # Opened once and never closed: with the first close this process would lose SQLite's locks.
        self._files = [os.open(directory / f"{DATABASE}{end}", os.O_RDWR) for end in ("", "-wal", "-shm")]

    def run(self) -> Found:
        self._began = _processor_time()
        gc.collect()
        gc.freeze()
        gc.disable()  # it would touch, and so copy, every page of every copy of the process
        try:
            self.site.run_to_the_end()
            self.found.ends += 1
            for problem in self.site.violations():
                self._violated(problem)
        except Known:
            pass
        except BaseException:
            self._violated(traceback.format_exc())
        finally:
            gc.enable()
            gc.unfreeze()
        if self._report is not None:
            try:
                with os.fdopen(self._report, "wb") as pipe:
                    pickle.dump((self.found, self._new), pipe)
            finally:
                os._exit(0)  # a copy of the process must not do the work of the original
        self.found.seconds = _processor_time() - self._began
        return self.found

    def _violated(self, problem: str) -> None:
        trace = " ".join(self._trace)
        self.found.violations.append((problem, trace))
        print(f"{problem}\n    --replay '{trace}'", file=sys.stderr, flush=True)

    # ------------------------------------------------------------------ asked by the site
    def fate(self, method: str, path: str, robot: str) -> str:
        self._number += 1
        if not self._left:
            return "fine"
        if method == "GET" or (method, path) in READS:
            others = ["lost"]
        elif (method, path) == ("POST", QUEUE):
            others = ["refused", "lost", "answer_lost", *(f"late {seconds:g}" for seconds in self.site.scenario.beyond)]
        else:
            others = ["lost", "answer_lost"]
        if not self._is_new(("fate", method, path, robot, self._state()), self._left):
            return "fine"
        return self._branch(others) or "fine"

    def point(self, where: str) -> str:
        self._number += 1
        self.found.points += 1
        if (not self._left and where != "at rest") or (self._coarse and where not in COARSE):
            return ""
        state = self._state()
        if where == "at rest":
            self._stop_if_known(state)
        if not self._left:
            return ""
        others: list[str] = []
        if self._is_new(("crash", state[0]), self._left):
            others += self._crashes
        if self._is_new(("acts", state), self._left):
            others += self._acts
            if where == "at rest":
                others.append("restart")
        return self._branch(others)

    # ------------------------------------------------------------------ the tree
    def _branch(self, others: list[str]) -> str:
        """Try each in a copy of this process, which gets it as the answer; here nothing happens."""
        for other in others:
            if len(self.found.violations) >= self._most:
                return ""
            self.found.transitions += 1
            kept = [os.pread(file, os.fstat(file).st_size, 0) for file in self._files]
            reading, writing = os.pipe()
            child = os.fork()
            if child == 0:
                os.close(reading)
                self._report, self._left, self._new, self.found = writing, self._left - 1, {}, Found()
                self._trace.append(f"{self._number}:{other.replace(' ', '_')}")
                return other
            os.close(writing)
            with os.fdopen(reading, "rb") as pipe:
                report = pipe.read()
            os.waitpid(child, 0)
            for file, content in zip(self._files, kept, strict=True):
                os.ftruncate(file, len(content))
                os.pwrite(file, content, 0)
            if not report:
                self.found.violations.append(("the process ended", f"{' '.join(self._trace)} {self._number}:{other}"))
                continue
            found, known = pickle.loads(report)
            self.found.add(found)
            for key, left in known.items():
                self._note(key, left)
        if self._report is None and others and self._says_how_far:
            self.found.seconds = _processor_time() - self._began
            print(f"step {self._number}: {self.found.line()}", file=sys.stderr, flush=True)
        return ""

    def _stop_if_known(self, state: object) -> None:
        """Another run has been here; this one may well be, while times change less than they are rounded."""
        key = _digest(("rest", state))
        if key not in self._passed and not self._is_new_key(key, self._left):
            raise Known
        self._passed.add(key)

    def _is_new(self, what: object, left: int) -> bool:
        return self._is_new_key(_digest(what), left)

    def _is_new_key(self, key: bytes, left: int) -> bool:
        if self._known.get(key, -1) >= left:
            return False
        if key not in self._known:
            self.found.states += 1
        self._note(key, left)
        return True

    def _note(self, key: bytes, left: int) -> None:
        if self._known.get(key, -1) < left:
            self._known[key] = self._new[key] = left

    def _state(self) -> tuple[object, ...]:
        """What a crash leaves, and what it does not."""
        return self._durable_state(), self.site.memory(self._grain), under_way()

    def _durable_state(self) -> object:
        return self.site.durable(self._grain), rounded(
            self.site.clock.now().timestamp() - FIRST.timestamp(), self._grain
        )


def _processor_time() -> float:
    """s, of this process and its children."""
    return sum(os.times()[:4])


def _digest(what: object) -> bytes:
    return hashlib.blake2b(repr(what).encode(), digest_size=8).digest()


class Replay:
    """The decisions of one trace, with a line for each step."""

    def __init__(self, trace: str) -> None:
        self._chosen = {
            int(number): what.replace("_", " ") if not what.startswith("answer") else what
            for number, _, what in (part.partition(":") for part in trace.split())
        }
        self._number = 0
        self.site: ChoiceSite

    def fate(self, method: str, path: str, robot: str) -> str:
        return self._next(f"{robot} {method} {path}") or "fine"

    def point(self, where: str) -> str:
        return self._next(where)

    def _next(self, where: str) -> str:
        self._number += 1
        chosen = self._chosen.get(self._number, "")
        if chosen or where != "at rest":
            print(f"{self.site.clock.now():%H:%M:%S.%f} {self._number} {where} {chosen}")
        return chosen


def explore(scenario: Scenario, faults: int, **options: object) -> Found:
    logging.disable(logging.CRITICAL)
    try:
        with tempfile.TemporaryDirectory(
            prefix="amr-explorer-", dir="/dev/shm" if Path("/dev/shm").is_dir() else None
        ) as directory:
            return Explorer(Path(directory), scenario, faults, **options).run()  # type: ignore[arg-type]
    finally:
        logging.disable(logging.NOTSET)


def replay(scenario: Scenario, trace: str) -> list[str]:
    with tempfile.TemporaryDirectory(prefix="amr-explorer-") as directory:
        decisions = Replay(trace)
        site = decisions.site = ChoiceSite(Path(directory), scenario, decisions)
        site.run_to_the_end()
        for row in site.executions():
            print(row)
        print([(robot, item.id, str(item.state), item.description[:8]) for robot, item in site._items()])
        return list(site.violations())


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.simulation.explorer", description=__doc__)
    parser.add_argument("--faults", type=int, default=1)
    parser.add_argument(
        "--grain", type=float, default=5.0, help="s to which times are rounded when states are compared"
    )
    parser.add_argument("--robots", type=int, default=1, help="more than one: the starts are for any of them")
    parser.add_argument("--target", choices=TARGETS, default=TARGETS[0], help="what takes the missions")
    parser.add_argument("--apart", type=int, default=0, help="minutes between the two starts")
    parser.add_argument(
        "--quiet", type=int, default=Scenario.quiet, help="s after which a start that was not found may be sent again"
    )
    parser.add_argument("--acts", help="those of the operator, all by default")
    parser.add_argument("--most", type=int, default=20, help="violations after which it ends")
    parser.add_argument(
        "--off", default=",".join(f"{seconds:g}" for seconds in OFF_FOR), help="s that the tablet is off after a crash"
    )
    parser.add_argument("--coarse", action="store_true", help="nothing happens between two reads")
    parser.add_argument("--replay", default=None, help="a violation's trace")
    options = parser.parse_args()
    scenario = Scenario(apart=options.apart, quiet=options.quiet, robots=options.robots, target=options.target)
    if options.replay is not None:
        logging.basicConfig(level=logging.INFO, format="    %(name)s %(message)s")
        problems = replay(scenario, options.replay)
        print("\n".join(problems) or "no violation")
        return 1 if problems else 0
    names = ",".join(ACTS if options.robots == 1 else GROUP_ACTS) if options.acts is None else options.acts
    acts, off_for = tuple(filter(None, names.split(","))), tuple(map(float, options.off.split(",")))
    found = explore(
        scenario,
        options.faults,
        grain=options.grain,
        acts=acts,
        most=options.most,
        coarse=options.coarse,
        off_for=off_for,
        says_how_far=options.faults > 1,
    )
    print(found.line())
    return 1 if found.violations else 0


if __name__ == "__main__":
    sys.exit(main())
