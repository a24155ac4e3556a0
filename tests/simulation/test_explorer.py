"""Every order of faults at a small site, and the proof that such a search would find a bug if there were one."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.database.executions import ExecutionRepository
from app.domain.execution import OPEN_STATES, State
from app.domain.message import message
from app.services.dispatch.duplicates import Duplicates
from app.services.dispatch.in_doubt import InDoubt
from app.services.executions import wanted
from tests.simulation.choices import Scenario
from tests.simulation.explorer import explore

ACTS = ("switch off A", "cancel A", "move A")


@pytest.mark.long
@pytest.mark.parametrize("apart", [0, 1])
def test_no_single_fault_at_any_step_doubles_loses_or_hides_a_start(apart):
    found = explore(Scenario(apart=apart), 1, acts=ACTS, coarse=True)
    assert found.violations == []
    assert found.transitions >= 100


@pytest.mark.long
def test_no_two_faults_in_any_order_double_lose_or_hide_a_start():
    """With fewer acts than there are; all of them, and three faults, by hand: ``python -m tests.simulation.explorer --faults 3``."""
    found = explore(Scenario(), 2, acts=("switch off A",), coarse=True, grain=20.0, off_for=(1.0,))
    assert found.violations == []
    assert found.transitions >= 1500


# ---------------------------------------------------------------- planted bugs: each must be found
def is_found(words: str, faults: int = 1, acts: tuple[str, ...] = ()) -> bool:
    found = explore(Scenario(), faults, acts=acts, coarse=True, grain=20.0, most=1)
    return any(words in problem for problem, _trace in found.violations)


@pytest.mark.long
def test_a_blind_retry_is_found(monkeypatch):
    """Every failed start is sent again, as if the robot certainly did not have it."""
    monkeypatch.setattr(
        InDoubt, "look_for", lambda self, row: self._outcomes.failed([row], message("no answer"), waited=True)
    )
    assert is_found("2 items")


@pytest.mark.long
def test_an_intent_that_is_not_committed_is_found(monkeypatch):
    """The POST leaves before its row says so: a crash in between forgets it."""
    add, change_owned = ExecutionRepository.add_each_once, ExecutionRepository.change_owned

    def forgetful(self, c, executions):
        added = add(self, c, [replace(row, state=State.WAITING, attempts=0) for row in executions])
        return [replace(row, state=State.SUBMITTING, attempts=1) for row in added]

    def from_any(self, c, row, expected, **columns):
        return change_owned(self, c, row, OPEN_STATES, **columns)

    monkeypatch.setattr(ExecutionRepository, "add_each_once", forgetful)
    monkeypatch.setattr(ExecutionRepository, "change_owned", from_any)
    assert is_found("2 items")


@pytest.mark.long
def test_an_unexpected_item_of_an_earlier_run_is_found(monkeypatch):
    """After a crash starts being sent are taken as not sent."""

    def recover(self):
        self._outcomes.not_sent(self._ledger.open_for(self._robot_id, (State.SUBMITTING,)))

    monkeypatch.setattr(InDoubt, "recover", recover)
    assert is_found("2 items")


@pytest.mark.long
def test_an_unexpected_second_copy_is_found(monkeypatch):
    """No alarm is raised for a request that arrives after the quiet time."""
    monkeypatch.setattr(Duplicates, "remove_duplicates", lambda self, open_items: None)
    assert is_found("without an alarm")


@pytest.mark.long
def test_a_start_that_is_sent_again_although_it_was_withdrawn_is_found(monkeypatch):
    """A request is lost, its schedule is switched off, and after the quiet time it leaves again."""
    monkeypatch.setattr(wanted, "why_withdrawn", lambda row: None)
    assert is_found("after it was withdrawn", faults=2, acts=("switch off A",))
