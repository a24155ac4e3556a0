"""Every event in every state: what the table allows writes what the table says, and nothing else writes anything."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from app.database.connection import Database
from app.database.executions import ExecutionRepository
from app.database.groups import GroupRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.domain import rules
from app.domain.execution import Execution, Reason, ReasonCode, State, Wait
from app.domain.models import Group, Mission, Robot, Schedule, Settings
from app.domain.robot import QueueItem, QueueState
from app.services.executions import apply as table
from app.services.executions import transitions
from app.services.executions.apply import RULES, apply_in
from app.services.executions.transitions import Event, Transition
from tests.support.clock import VirtualClock

NOW = datetime(2026, 11, 23, 6, 5, tzinfo=UTC)
STATES = tuple(State)
ITEM = QueueItem(7, QueueState.PENDING, description="token of the item")
ROBOT = Robot("Aino", "http://10.0.0.1", "distributor", serial_number="1", id=1)
REFUSED = Reason(ReasonCode.REFUSED)

# Each with all that it may bring along.
MADE: dict[Event, Any] = {
    Event.WAIT: lambda row: transitions.wait(row, Wait.BATTERY, battery=12.0)[0],
    Event.HOLD: lambda row: transitions.hold(row, True),
    Event.REDEFINE: lambda row: transitions.redefine(row, priority=5),
    Event.ASSIGN: lambda row: transitions.assign(row, ROBOT, "guid", {}, NOW, intent_floor=6),
    Event.UNASSIGN: transitions.unassign,
    Event.BEGIN: lambda row: transitions.begin(row, ROBOT, 6, NOW),
    Event.NOT_SENT: lambda row: transitions.not_sent(row, is_first=True),
    Event.ANSWER: lambda row: transitions.answer(row, {"answer": "?"}, NOW),
    Event.ACCEPT: lambda row: transitions.accept(row, ROBOT, 7, NOW),
    Event.ADOPT: lambda row: transitions.adopt(row, ROBOT, ITEM, NOW),
    Event.FAIL: lambda row: transitions.fail(row, "no answer", may_come=True, is_first=False),
    Event.GIVE_BACK: lambda row: transitions.give_back(row, 1, {"out": "tried"}, is_attempt=True, may_come=True),
    Event.START: lambda row: transitions.start(row, NOW, 2.0),
    Event.COMPLETE: lambda row: transitions.complete(row, NOW, 240.0, 2.0),
    Event.ABORT: lambda row: transitions.end(Event.ABORT, row, Reason(ReasonCode.ROBOT_ABORTED)),
    Event.GIVE_UP: lambda row: transitions.end(Event.GIVE_UP, row, Reason(ReasonCode.UNKNOWN_OUTCOME), may_come=True),
    Event.EXPIRE: lambda row: transitions.end(Event.EXPIRE, row, Reason(ReasonCode.HOLD)),
    Event.REFUSE: lambda row: transitions.end(Event.REFUSE, row, REFUSED, may_come=True),
    Event.WITHDRAW: lambda row: transitions.withdraw(row, Reason(ReasonCode.SCHEDULE_CHANGED)),
    Event.CANCEL: lambda row: transitions.cancel(row, ReasonCode.QUEUE_CLEARED),
    Event.UNCANCEL: lambda row: transitions.uncancel(replace(row, cancel_code=ReasonCode.USER_CANCELLED)),
    Event.WANT_AGAIN: lambda row: transitions.want_again(replace(row, withdrawn=Reason(ReasonCode.SCHEDULE_CHANGED))),
    Event.REMOVE: lambda row: transitions.end(Event.REMOVE, row, Reason(ReasonCode.ROBOT_REMOVED)),
    Event.RESTORE: lambda row: transitions.restore(row, replace(row, state=State.QUEUED, reason=None, ended_at=None)),
    Event.MOVE: lambda row: Transition(Event.MOVE, row, {"closes_at": NOW}),
    Event.REPLACE: lambda row: transitions.replaced(row, Reason(ReasonCode.USER_CANCELLED)),
    Event.REOPEN: lambda row: transitions.reopen(row, ROBOT, 7, NOW),
}
OF_GROUPS: dict[Event, dict[str, Any]] = {
    Event.ASSIGN: {"is_for_group": True, "held": False},
    Event.GIVE_BACK: {"is_for_group": True, "robot_id": 1},
}
SEEN = {
    table.note_begun: "SELECT started_through FROM schedules",
    table.note_skip: "SELECT count(*) FROM skips",
    table.note_accepted: "SELECT last_queue_id FROM robots WHERE id = 1",
    table.note_ran_idle: "SELECT idle_queue_id FROM robots WHERE id = 1",
    table.watch_for_late: "SELECT count(*) FROM watches",
    table.note_outcome: "SELECT failures FROM robots WHERE id = 1",
}


class Site:
    """One robot, alone in a group, and a schedule of each."""

    def __init__(self, db: Database) -> None:
        self.db, self.executions = db, ExecutionRepository()
        self.robot, self.group, self.mission = db.write(self._made)
        self._minutes = 0

    @staticmethod
    def _made(c: Any) -> tuple[Robot, Group, Mission]:
        robot = RobotRepository().add(c, replace(ROBOT, id=0))
        mission = MissionRepository().add(c, Mission("Deliver", "guid"))
        return robot, GroupRepository().add(c, Group("Hall", (robot.id,))), mission

    def add(self, state: State, *, is_for_group: bool = False, **values: Any) -> Execution:
        """A held start in that state, of a schedule of its own; the robot has failed the one before."""
        self._minutes += 1
        target = self.group if is_for_group else self.robot
        where = {"group_id": self.group.id, "robot_id": None} if is_for_group else {"robot_id": self.robot.id}
        at = NOW + timedelta(minutes=self._minutes)

        def work(c: Any) -> Execution:
            c.execute("DELETE FROM schedules")
            RobotRepository().note_outcome(c, self.robot.id, False)
            draft = Schedule("S", None, self.mission.id, at.replace(tzinfo=None), "UTC", changed_at=NOW)
            schedule = ScheduleRepository().add(c, replace(draft, **where))
            row = rules.scheduled(
                schedule, target, self.mission, Settings(), "00000000-0000-4000-8000-000000000000", at, NOW
            )
            ends = {} if state.is_open else {"ended_at": NOW, "reason": Reason(ReasonCode.HOLD)}
            made = replace(row, state=state, **({"held": True} | ends | values))
            return self.executions.add_each_once(c, [made])[0]

        return self.db.write(work)

    def effects(self) -> dict[table.Effect, Any]:
        c = self.db.read()
        return {effect: next(iter(c.execute(question)))[0] for effect, question in SEEN.items()}


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    db = Database.open(tmp_path / "x.db", clock=VirtualClock(NOW), threaded=False, durable=False)
    yield Site(db)
    db.close()


def apply(site: Site, made: Transition) -> Execution | None:
    return site.db.write(lambda c: apply_in(c, made, NOW))


def stored(site: Site, row: Execution) -> Execution:
    return site.executions.get(site.db.read(), row.id)


def test_each_event_has_a_rule_and_is_tried_here():
    assert RULES.keys() == MADE.keys() == set(Event)


@pytest.mark.parametrize("event", Event, ids=lambda event: event.name)
def test_an_event_writes_what_its_rule_says_and_only_in_its_states(site, event):
    for state in STATES:
        if event is Event.ASSIGN and state in transitions.MAY_BE_WITH_THE_ROBOT:
            continue  # such a row has a robot
        row = site.add(state, **OF_GROUPS.get(event, {}))
        made, before = MADE[event](row), site.effects()
        after = apply(site, made)
        rule = RULES[event]
        if state not in rule.sources:
            assert (after, stored(site, row), site.effects()) == (None, row, before), state
            continue
        assert after is not None, state
        assert after == stored(site, row)
        assert after.state in (rule.targets or [state]), state
        assert {name: getattr(after, name) for name in made.columns} == dict(made.columns), state
        assert (after.ended_at is not None) is not after.state.is_open
        expected = set(rule.effects) - {table.note_ran_idle}
        if event is Event.REFUSE and state is State.WAITING:
            expected.discard(table.note_outcome)  # the robot was not sent it
        if after.state.is_open:
            expected.discard(table.note_skip)
        assert {effect for effect, value in site.effects().items() if value != before[effect]} == expected, state


@pytest.mark.parametrize("event", Event, ids=lambda event: event.name)
def test_nothing_is_written_to_a_row_that_has_changed(site, event):
    for read in RULES[event].sources:
        for state in STATES:
            if state is read or (event is Event.ASSIGN and state in transitions.MAY_BE_WITH_THE_ROBOT):
                continue
            row, before = site.add(state, **OF_GROUPS.get(event, {})), site.effects()
            found = apply(site, MADE[event](replace(row, state=read)))
            assert (found, stored(site, row), site.effects()) == (None, row, before), (read, state)


def test_a_start_of_a_group_that_was_not_sent_waits_again_though_its_robot_was_removed(site):
    row = site.add(State.CANCELLED, is_for_group=True, held=False, attempts=1)
    after = apply(site, transitions.not_sent(replace(row, state=State.SUBMITTING, robot_id=None), is_first=True))
    assert (after.state, after.attempts, after.reason, after.ended_at) == (State.WAITING, 0, None, None)


def test_a_start_withdrawn_while_sending_ends_once_it_was_not_sent(site):
    row = site.add(State.SUBMITTING, attempts=1)
    assert apply(site, transitions.withdraw(row, Reason(ReasonCode.SCHEDULE_CHANGED))).state is State.SUBMITTING
    after = apply(site, transitions.not_sent(row, is_first=True))
    assert (after.state, after.reason) == (State.CANCELLED, Reason(ReasonCode.SCHEDULE_CHANGED))


def test_an_edit_covers_no_other_reason_why_it_was_withdrawn(site):
    row = site.add(State.SUBMITTING, withdrawn=Reason(ReasonCode.HOLD))
    assert apply(site, transitions.withdraw(row, Reason(ReasonCode.SCHEDULE_CHANGED))) is None
    assert apply(site, transitions.want_again(row)) is None
    assert stored(site, row).withdrawn == Reason(ReasonCode.HOLD)


def test_any_other_reason_covers_an_edit(site):
    row = site.add(State.SUBMITTING, withdrawn=Reason(ReasonCode.SCHEDULE_CHANGED))
    assert apply(site, transitions.withdraw(row, Reason(ReasonCode.HOLD))).withdrawn == Reason(ReasonCode.HOLD)


def test_a_cleared_queue_includes_a_cancellation_and_the_robot_can_not_undo_it(site):
    row = site.add(State.QUEUED, queue_id=7)
    row = apply(site, transitions.cancel(row, ReasonCode.USER_CANCELLED))
    assert apply(site, transitions.cancel(row, ReasonCode.USER_CANCELLED)) is None
    row = apply(site, transitions.cancel(row, ReasonCode.QUEUE_CLEARED))
    assert apply(site, transitions.uncancel(row)) is None
    assert stored(site, row).cancel_code is ReasonCode.QUEUE_CLEARED
