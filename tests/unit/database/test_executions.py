"""The ledger's rows: once per occurrence, changed only from an expected state, pruned without losing an open one."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from dataclasses import replace
from datetime import timedelta

import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from app.database import execution_history
from app.database.execution_history import PRUNED_AT_ONCE, ExecutionFilter, ExecutionHistory, PageKey
from app.database.executions import ExecutionRepository
from app.database.schedules import ScheduleRepository
from app.domain.execution import ENDED_STATES, OPEN_STATES, Reason, ReasonCode, State, Trigger, Wait
from tests.support.examples import examples
from tests.unit.database.conftest import NOON

EXECUTIONS, HISTORY, SCHEDULES = ExecutionRepository(), ExecutionHistory(), ScheduleRepository()


def add(db, execution):
    return db.write(lambda c: EXECUTIONS.add_each_once(c, [execution])[0])


def change(db, execution, expected, **columns):
    return db.write(lambda c: EXECUTIONS.change(c, execution, expected, **columns))


def ended(row, state=State.COMPLETED, minutes=0, **values):
    codes = {
        State.FAILED: ReasonCode.ROBOT_ABORTED,
        State.CANCELLED: ReasonCode.USER_CANCELLED,
        State.SKIPPED: ReasonCode.OVERLAP,
        State.MISSED: ReasonCode.APP_DOWN,
    }
    reason = Reason(codes[state]) if state in codes else None
    return row(state=state, reason=reason, ended_at=NOON + timedelta(minutes=minutes), **values)


# ---------------------------------------------------------------------- once
def test_a_row_is_read_back_unchanged(db, row):
    full = row(
        trigger=Trigger.IDLE,
        parameters={"a": 1},
        priority=-3,
        minimum_battery_percent=30.5,
        state=State.FAILED,
        reason=Reason(ReasonCode.BATTERY_LOW, {"battery": 12.0, "until": "x"}),
        wait=Wait.BATTERY,
        wait_details={"battery": 12.0},
        listed_until=NOON,
        attempts=3,
        queue_floor=7,
        queue_id=9,
        cancel_code=ReasonCode.USER_CANCELLED,
        submitted_at=NOON,
        started_at=NOON + timedelta(microseconds=1),
        ended_at=NOON + timedelta(seconds=1),
        duration_s=1.25,
        robot_delay_s=0.5,
        schedule_id=None,
        schedule="",
    )
    stored = add(db, full)
    assert stored == replace(full, id=stored.id)
    assert EXECUTIONS.get(db.read(), stored.id) == stored == EXECUTIONS.by_token(db.read(), full.token)


def test_an_occurrence_is_in_the_ledger_once(db, row):
    first = add(db, row(planned_at=NOON))
    again = row(planned_at=NOON)
    assert db.write(lambda c: EXECUTIONS.add_once(c, again)) is None
    assert db.write(lambda c: EXECUTIONS.add_once(c, row(planned_at=NOON, schedule_id=2))) is not None
    assert [found.id for found in EXECUTIONS.open_for(db.read(), 1) if found.schedule_id == 1] == [first.id]


def test_only_new_executions_are_added(db, row):
    known = add(db, row(planned_at=NOON))
    new = [row(planned_at=NOON + timedelta(minutes=minute)) for minute in range(1, 251)]
    added = db.write(lambda c: EXECUTIONS.add_each_once(c, [new[0], row(planned_at=NOON), *new[1:]]))
    assert [found.token for found in added] == [wanted.token for wanted in new]
    assert added == [EXECUTIONS.get(db.read(), found.id) for found in added]
    assert EXECUTIONS.get(db.read(), known.id) == known
    assert db.write(lambda c: EXECUTIONS.add_each_once(c, new)) == []
    assert db.write(lambda c: EXECUTIONS.add_each_once(c, [])) == []


def test_a_token_is_in_the_ledger_once(db, row):
    first = add(db, row(schedule_id=None))
    assert db.write(lambda c: EXECUTIONS.add_once(c, row(schedule_id=None, token=first.token))) is None


def test_manual_ones_of_the_same_instant_are_all_taken(db, row):
    for _ in range(2):
        add(db, row(schedule_id=None, planned_at=NOON, trigger=Trigger.MANUAL))
    assert len(EXECUTIONS.open_all(db.read())) == 2


def test_thousands_at_once_omit_what_is_there_already(db, row):
    there = add(db, row(planned_at=NOON))
    rows = [row(planned_at=NOON + timedelta(minutes=number), state=State.MISSED) for number in range(3000)]
    assert db.write(lambda c: EXECUTIONS.add_many(c, rows)) == 2999
    assert EXECUTIONS.get(db.read(), there.id) == there


# ---------------------------------------------------------------------- moves
def test_a_row_moves_from_an_expected_state_only(db, row):
    stored = add(db, row())
    moved = change(db, stored, [State.WAITING], state=State.SUBMITTING, attempts=1)
    assert moved == replace(stored, state=State.SUBMITTING, attempts=1)
    assert change(db, stored, [State.WAITING], state=State.FAILED) is None
    assert EXECUTIONS.get(db.read(), stored.id) == moved
    assert change(db, stored, [State.WAITING, State.SUBMITTING], queue_id=5).queue_id == 5


def test_a_reason_is_set_and_cleared_whole(db, row):
    stored = add(db, row())
    reason = Reason(ReasonCode.REFUSED, {"problem": "no"})
    assert change(db, stored, OPEN_STATES, reason=reason).reason == reason
    assert change(db, stored, OPEN_STATES, reason=None).reason is None


def test_a_column_that_does_not_exist_is_a_mistake_in_the_program(db, row):
    stored = add(db, row())
    with pytest.raises(ValueError, match="nonsense"):
        change(db, stored, OPEN_STATES, nonsense=1)


def test_an_instant_that_was_withdrawn_makes_room_unless_something_was_sent(db, row):
    before, withdrawn, tried, sent = (
        add(
            db,
            row(
                planned_at=NOON + timedelta(minutes=minutes),
                attempts=attempts,
                queue_floor=floor,
                state=State.CANCELLED,
                reason=Reason(ReasonCode.SCHEDULE_CHANGED),
                ended_at=NOON,
            ),
        )
        for minutes, attempts, floor in ((-1, 0, None), (0, 0, 7), (1, 3, None), (2, 1, 7))
    )
    assert [each.was_never_sent for each in (before, withdrawn, tried, sent)] == [True, True, True, False]
    db.write(lambda c: EXECUTIONS.drop_withdrawn(c, 1, NOON))
    assert [EXECUTIONS.get(db.read(), each.id) is None for each in (before, withdrawn, tried, sent)] == [
        False,
        True,
        True,
        False,
    ]


# ---------------------------------------------------------------------- looking
def test_open_ones_oldest_first(db, row):
    second, first = (
        add(db, row(planned_at=NOON + timedelta(minutes=2))),
        add(db, row(planned_at=NOON + timedelta(minutes=1))),
    )
    other = add(db, row(robot_id=2, schedule_id=2, state=State.EXECUTING, planned_at=NOON + timedelta(minutes=3)))
    add(db, ended(row))
    c = db.read()
    assert EXECUTIONS.open_for(c, 1) == [first, second]
    assert EXECUTIONS.open_of_schedules(c, []) == {}
    assert EXECUTIONS.waited_for(c, [1, 2]) == {1}
    assert EXECUTIONS.waited_for(c, []) == set()
    assert EXECUTIONS.open_all(c) == [first, second, other]
    assert EXECUTIONS.open_for(c, 2, [State.EXECUTING, State.QUEUED]) == [other]
    assert EXECUTIONS.open_for(c, 2, [State.WAITING]) == []
    assert (EXECUTIONS.has_sent(c, 1), EXECUTIONS.has_sent(c, 2)) == (False, True)


def test_the_last_of_a_schedule(db, row):
    assert EXECUTIONS.last_of_schedule(db.read(), 1) is None
    late = add(db, row(planned_at=NOON + timedelta(hours=1)))
    add(db, ended(row))
    add(db, row(schedule_id=2, planned_at=NOON + timedelta(hours=2)))
    assert EXECUTIONS.last_of_schedule(db.read(), 1) == late


def test_the_last_that_ended_are_not_the_last_that_were_planned(db, row):
    long, *short = (
        add(db, ended(row, minutes=end, schedule_id=planned, planned_at=NOON + timedelta(minutes=planned)))
        for planned, end in ((1, 9), (2, 3), (4, 5))
    )
    add(db, ended(row, minutes=9, schedule_id=9, planned_at=NOON + timedelta(hours=1)))  # skipped in advance
    add(db, ended(row, minutes=9, schedule_id=8, robot_id=2))
    add(db, row(schedule_id=7))
    assert HISTORY.last_ended(db.read(), 1, NOON + timedelta(minutes=10), 2) == [long, short[1]]


# ---------------------------------------------------------------------- history
DOCK = "3d7c7c40-ce85-11ef-904a-000e8e9884eb"


@pytest.fixture
def history(db, row):
    """Twelve rows, two of each planned instant."""
    rows = []
    for number in range(12):
        state = (*ENDED_STATES, State.WAITING)[number % 6]
        planned = NOON + timedelta(minutes=number // 2)
        values = {
            "robot_id": number % 3 + 1,
            "robot": f"R{number % 3 + 1}",
            "schedule_id": number,
            "planned_at": planned,
            "trigger": Trigger.MANUAL if number % 4 == 0 else Trigger.SCHEDULED,
            "mission": "Päivä" if number < 6 else "Home",
            "parameters": {"Position": DOCK, "Pallets": 2, "Note": "Erä 7"} if number == 5 else {},
        }
        rows.append(add(db, ended(row, state, **values) if state is not State.WAITING else row(**values)))
    return rows


def pages(db, wanted, size):
    found, before = [], None
    while page := HISTORY.page(db.read(), wanted, before, size):
        found += page
        before = PageKey.of(page[-1])
    return found


@pytest.mark.parametrize("size", [1, 3, 5, 12, 13])
def test_pages_join_to_the_whole_newest_first(db, history, size):
    assert pages(db, ExecutionFilter(), size) == history[::-1]


@pytest.mark.parametrize(
    ("wanted", "keeps"),
    [
        (ExecutionFilter(robot_ids=[1, 2]), lambda e: e.robot_id in (1, 2)),
        (ExecutionFilter(robot_ids=[]), lambda e: False),
        (ExecutionFilter(mission="Home"), lambda e: e.mission == "Home"),
        (ExecutionFilter(states=[State.FAILED, State.WAITING]), lambda e: e.state in (State.FAILED, State.WAITING)),
        (ExecutionFilter(triggers=[Trigger.MANUAL]), lambda e: e.trigger is Trigger.MANUAL),
        (
            ExecutionFilter(start=NOON + timedelta(minutes=2), end=NOON + timedelta(minutes=4)),
            lambda e: timedelta(minutes=2) <= e.planned_at - NOON < timedelta(minutes=4),
        ),
        (ExecutionFilter(text="PÄIVÄ"), lambda e: e.mission == "Päivä"),
        (ExecutionFilter(text=" r3 "), lambda e: e.robot == "R3"),
        (ExecutionFilter(text="%"), lambda e: False),
        (ExecutionFilter(text="ERÄ"), lambda e: e.schedule_id == 5),
        (ExecutionFilter(text="dock", values=[DOCK]), lambda e: e.schedule_id == 5),  # as a robot calls it
        (ExecutionFilter(text=DOCK[:8]), lambda e: False),  # it is not searched
        (
            ExecutionFilter(robot_ids=[1], text="home", states=[State.COMPLETED]),
            lambda e: e.robot_id == 1 and e.mission == "Home" and e.state is State.COMPLETED,
        ),
    ],
)
def test_filters_on_pages_counts_and_the_stream(db, history, wanted, keeps):
    expected = [execution for execution in history if keeps(execution)]
    assert pages(db, wanted, 2) == expected[::-1]
    assert sum(HISTORY.counts(db.read(), wanted).values()) == len(expected)
    assert list(HISTORY.stream(db.read(), wanted)) == expected


def test_rows_that_come_between_two_pages_shift_nothing(db, history, row):
    first = HISTORY.page(db.read(), ExecutionFilter(), None, 5)
    add(db, row(planned_at=NOON + timedelta(hours=1), schedule_id=99))
    assert HISTORY.page(db.read(), ExecutionFilter(), PageKey.of(first[-1]), 5) == history[::-1][5:10]


def test_a_blocked_stream_does_not_block_the_log_of_changes(db, row, monkeypatch):
    """Like an export to a pager, which reads no more than it shows."""
    monkeypatch.setattr(execution_history, "PIECE", 2)
    rows = [
        add(db, row(planned_at=NOON + timedelta(minutes=minute), schedule_id=schedule))
        for schedule, minute in enumerate((0, 0, 0, 5, 6), start=1)
    ]
    stream = HISTORY.stream(db.read())
    read = [next(stream)]
    add(db, row(planned_at=NOON + timedelta(hours=1), schedule_id=9))
    with closing(sqlite3.connect(db.path, timeout=0)) as reader:
        busy, *_pages = reader.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
    assert not busy
    assert [*read, *stream][:5] == rows


# ---------------------------------------------------------------------- pruning
@examples(60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    rows=st.lists(
        st.tuples(st.sampled_from([each for each in State if each is not State.SUBMITTING]), st.integers(0, 5)),
        max_size=25,
    ),
    limit=st.integers(1, 6),
)
def test_the_newest_of_each_kind_stay_and_open_ones_always(db, row, rows, limit):
    db.write(lambda c: c.execute("DELETE FROM executions"))
    stored = [
        add(db, row(state=state, ended_at=None if state.is_open else NOON + timedelta(minutes=minutes)))
        for state, minutes in rows
    ]
    db.write(lambda c: HISTORY.drop_oldest(c, HISTORY.surplus(c, limit)))
    kept = {execution.id for execution in HISTORY.stream(db.read())}
    for kind in ((State.COMPLETED, State.FAILED, State.CANCELLED), (State.SKIPPED, State.MISSED)):
        newest = sorted((e for e in stored if e.state in kind), key=lambda e: (e.ended_at, e.id), reverse=True)[:limit]
        assert {e.id for e in stored if e.state in kind} & kept == {e.id for e in newest}
    assert {e.id for e in stored if e.state.is_open} <= kept


def test_a_long_history_is_pruned_in_pieces_oldest_first(db, row):
    rows = [ended(row, minutes=number) for number in range(PRUNED_AT_ONCE + 120)]
    db.write(lambda c: EXECUTIONS.add_many(c, rows))
    surplus = HISTORY.surplus(db.read(), 20)
    assert surplus == (PRUNED_AT_ONCE + 100, 0)
    for left in ((100, 0), (0, 0), (0, 0)):
        surplus = db.write(lambda c, surplus=surplus: HISTORY.drop_oldest(c, surplus))
        assert surplus == left
    assert [e.ended_at for e in HISTORY.stream(db.read())] == [e.ended_at for e in rows[-20:]]


def test_a_robot_with_an_unknown_outcome_keeps_all_that_it_had_of_ours(db, row):
    """Which items of its queue are already somebody's must be known while one is looked for."""
    add(db, row(state=State.SUBMITTING))
    kept, *dropped = add(db, ended(row, queue_id=7)), add(db, ended(row, robot_id=2, queue_id=7)), add(db, ended(row))
    db.write(lambda c: HISTORY.drop_oldest(c, HISTORY.surplus(c, 0)))
    assert [EXECUTIONS.get(db.read(), each.id) for each in (kept, *dropped)] == [kept, None, None]


# ---------------------------------------------------------------------- cost
SMALL = ("executions_open", "executions_open_of_schedule")  # indexes that hold few rows however long the history


@pytest.mark.parametrize(
    "ask",
    [
        lambda c: EXECUTIONS.get(c, 1),
        lambda c: EXECUTIONS.by_token(c, "t"),
        lambda c: EXECUTIONS.open_for(c, 1),
        EXECUTIONS.open_all,
        lambda c: EXECUTIONS.open_for(c, 1, [State.QUEUED]),
        lambda c: EXECUTIONS.has_sent(c, 1),
        lambda c: EXECUTIONS.open_of_schedules(c, [1, 2]),
        lambda c: EXECUTIONS.waited_for(c, [1, 2]),
        lambda c: EXECUTIONS.open_of_schedule(c, 1, [State.WAITING]),
        lambda c: EXECUTIONS.last_of_schedule(c, 1),
        lambda c: EXECUTIONS.waiting_of_group(c, 1),
        SCHEDULES.with_unsent,
        lambda c: SCHEDULES.with_unsent(c, 1),
        lambda c: EXECUTIONS.late(c, NOON, NOON),
        lambda c: EXECUTIONS.drop_withdrawn(c, 1, NOON),
        lambda c: EXECUTIONS.make_room_after(c, 1, NOON, NOON),
        lambda c: HISTORY.drop_oldest(c, (5, 5)),
        lambda c: HISTORY.page(c, ExecutionFilter(), PageKey(NOON, 5), 9),
        lambda c: EXECUTIONS.change(c, EXECUTIONS.get(c, 1), OPEN_STATES, attempts=1),
    ],
    ids=range(19),
)
def test_no_question_of_daily_work_reads_the_whole_history(db, row, ask):
    add(db, ended(row))
    asked = []

    def work(c):
        c.set_trace_callback(asked.append)
        ask(c)
        c.set_trace_callback(None)
        return [plan["detail"] for sql in asked for plan in c.execute(f"EXPLAIN QUERY PLAN {sql}")]

    plans = [detail for detail in db.write(work) if "executions" in detail]
    assert plans
    for detail in plans:
        assert detail.startswith("SEARCH") or detail.split()[-1] in SMALL, detail
        is_bounded = "open_of_schedule" in detail or "planned_at>?" in detail or "LIMIT 1" in asked[0]
        assert "schedule_id=?" not in detail or is_bounded, detail
