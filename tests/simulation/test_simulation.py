"""Days of operation with faults and crashes at every step, and the proof that such a run would find a bug if there were one."""
from __future__ import annotations

import re
from dataclasses import replace

import pytest

from app.database import schema
from app.services.dispatch import ledger, planner
from app.services.dispatch.attempt import Phase
from app.services.dispatch.submission import Submission
from tests.simulation.__main__ import simulate
from tests.simulation.world import Profile, World

ROUGH = Profile(crash_rate=0.02, fault_rate=0.08)


@pytest.mark.parametrize(("seed", "hours"), [(11, 3.0), *(pytest.param(seed, 20.0, marks=pytest.mark.long) for seed in range(1, 11))])
def test_faults_and_crashes_double_nothing_and_lose_nothing(seed, hours):
    """Each is as many simulated hours; any number by hand: ``python -m tests.simulation``."""
    found = simulate(seed, hours)
    assert found.violations == [], found.line(Profile(), seed)
    assert found.occurrences >= 100 * hours
    assert sum(found.faults.values()) >= 40 * hours
    assert found.crashes >= 10 * hours


# ---------------------------------------------------------------- planted bugs: each must be found
def violations(tmp_path, hours=8.0, profile=ROUGH, seed=1):
    return World(tmp_path, seed, profile).run(hours).violations


def is_found(tmp_path, words, hours=8.0):
    """Whether any of some seeds meets the bug: a crash has to fall into the one step where it shows."""
    for seed in range(1, 7):
        directory = tmp_path / f"seed-{seed}"
        directory.mkdir(parents=True)
        if any(word in problem for problem in violations(directory, hours, seed=seed) for word in words):
            return True
    return False


def test_without_a_planted_bug_the_rough_world_is_clean(tmp_path):
    assert violations(tmp_path) == []


def test_a_blind_retry_is_found(tmp_path, monkeypatch):
    """The thesis's algorithm: whatever failed is sent again."""
    post = Submission._post

    def blind(self, intent):
        post(self, intent)
        attempt = self._attempts.get(intent.id)
        if attempt is not None and attempt.phase is Phase.IN_DOUBT:
            self._failed([intent], "no answer")
    monkeypatch.setattr(Submission, "_post", blind)
    monkeypatch.setattr(Submission, "_already_there", lambda self, row, floor: [])
    assert is_found(tmp_path, ["items with one token"])


def test_an_intent_that_is_not_committed_is_found(tmp_path, monkeypatch):
    """The POST leaves before its row says so: a crash in between forgets it."""
    def begin(self, execution, queue_floor):
        self._begun = {**getattr(self, "_begun", {}), execution.id: execution}
        return replace(execution, state=ledger.State.SUBMITTING, attempts=execution.attempts + 1, queue_floor=queue_floor)

    def accepted(self, execution, robot, queue_id):
        return ledger.Move(execution, ledger.NOT_WITH_THE_ROBOT, {"state": ledger.State.QUEUED, "queue_id": queue_id,
                                                                  "attempts": execution.attempts, "submitted_at": self._clock.now()})
    monkeypatch.setattr(ledger.Ledger, "begin_attempt", begin)
    monkeypatch.setattr(ledger.Ledger, "accepted", accepted)
    assert is_found(tmp_path, ["items with one token"])


@pytest.mark.long
def test_a_missing_unique_key_is_found(tmp_path, monkeypatch):
    """Row and advance in two transactions, which the unique key forgives: without it a crash in between makes two rows."""
    advance, pending = planner.ScheduleRepository.advance_all, []
    monkeypatch.setattr(planner.ScheduleRepository, "advance_all", lambda self, c, progress: progress and pending.append(progress))
    insert_due = planner.Planner._take_due

    def split(self, c, batch, ready):
        pending.clear()
        return insert_due(self, c, batch, ready)
    write = planner.Database.write

    def write_then_advance(self, work, patient=False):
        result = write(self, work, patient)
        while pending:
            progress = pending.pop()
            write(self, lambda c, progress=progress: advance(planner.ScheduleRepository(), c, progress))
        return result
    monkeypatch.setattr(planner.Planner, "_take_due", split)
    monkeypatch.setattr(planner.Database, "write", write_then_advance)
    (tmp_path / "with").mkdir()
    assert violations(tmp_path / "with") == []
    without = schema.MIGRATIONS[0].replace("UNIQUE (schedule_id, planned_at)", "CHECK (1)")
    without = re.sub(r"(token +TEXT NOT NULL) UNIQUE", r"\1", without)
    open_database = planner.Database.open.__func__
    monkeypatch.setattr(open_database, "__kwdefaults__", {**open_database.__kwdefaults__, "migrations": (without, *schema.MIGRATIONS[1:])})
    assert is_found(tmp_path / "without", ["2 rows", "one token"])


@pytest.mark.long
def test_a_fold_that_runs_twice_is_found(tmp_path, monkeypatch):
    """The hour that comes twice in the first night: APScheduler, Temporal and croniter run it twice."""
    original = planner.next_occurrence

    def twice(schedule, after, calendar):
        found = original(schedule, after, calendar)
        if schedule.recurrence == "FREQ=DAILY" and after.date().isoformat() == "2026-10-25" and after.hour == 0:
            return after.replace(hour=1, minute=30, second=0, microsecond=0)
        return found
    monkeypatch.setattr(planner, "next_occurrence", twice)
    assert is_found(tmp_path, ["never planned"], hours=16.0)


@pytest.mark.parametrize("seed", [11, pytest.param(12, marks=pytest.mark.long)])
def test_the_same_seed_gives_the_same_run(tmp_path, seed):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    first, again = (World(tmp_path / name, seed, ROUGH).run(2.0) for name in "ab")
    assert first == again
