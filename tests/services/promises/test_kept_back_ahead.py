"""What a person keeps back by a clock that is ahead is a start to come once that is corrected: it follows every edit as any other, and when
its time has come it waits to be let go."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.domain.models import DayException, Execution, HandOver, Overlap, State, Wait
from tests.services.promises.test_set_back import begin_ahead, off_and_on, robot_off_and_on, set_right, stored
from tests.support.groups import Hall
from tests.support.seen import outcomes, sent_at

AT = datetime(2026, 11, 23, 6, 10, tzinfo=UTC)


def kept_back(tmp_path, back=300, rule="FREQ=DAILY", where="robot", robots=1, **more):
    """06:10 is kept back by a clock that is ahead; that is corrected, and 06:10 is the next start again."""
    hall = Hall(tmp_path, robots=robots)
    there = {"robot_id": 1, "group_id": None} if where == "robot" else {}
    schedule = hall.plan(
        "A",
        "2026-11-23T06:10",
        recurrence=rule,
        start_window_minutes=60,
        **{"respect_working_days": False, **there, **more},
    )
    hall.run(10)
    hall.container.holds.hold("cleaning", None, 1)
    hall.run(600)
    (row,) = hall.executions(State.WAITING)
    assert hall.container.operator.hold_starts([row.id]) == 1
    hall.container.holds.release(1)
    hall.clock.step(-back)
    hall.kick()
    hall.run(5)
    assert hall.executions(State.WAITING) == []  # nothing waits for an instant to come
    return hall, schedule


def held(hall) -> list[Execution]:
    return [row for row in hall.executions(State.WAITING) if row.held and row.wait is Wait.HOLD]


def let_go(hall, seconds):
    """What waits to be let go is, as long as that."""
    for _n in range(int(seconds / 5)):
        hall.run(5)
        hall.container.operator.hold_starts([row.id for row in held(hall)], held=False)


def minutes_sent(hall) -> list[int]:
    return sorted(row.planned_at.minute for row in hall.executions() if row.queue_id)


def waits_on(hall) -> bool:
    """At its instant it waits to be let go, and is not sent before."""
    hall.run(600)
    is_held = [row.planned_at for row in held(hall)] == [AT] and hall.items() == []
    let_go(hall, 60)
    return is_held and len(hall.items()) == 1


@pytest.mark.parametrize("back", [20, 180, 300])
@pytest.mark.parametrize("rule", ["FREQ=MONTHLY", None, "FREQ=DAILY"])
@pytest.mark.parametrize("where", ["robot", "group"])
def test_it_waits_to_be_let_go_when_its_time_has_come(tmp_path, where, rule, back):
    hall, schedule = kept_back(tmp_path, back, rule, where)
    hall.clock.step(-10)  # once more
    hall.kick()
    hall.switch_off(cleanly=False)
    hall.switch_on()
    assert [(run.at, run.kept_back) for run in hall.container.plan.next(1)] == [(AT, True)]
    assert waits_on(hall), (outcomes(hall), stored(hall, schedule))


def undone(remove):
    def edit(hall, schedule):
        removed = remove(hall.container.catalogue, hall, schedule)
        hall.run(2)
        hall.container.catalogue.restore(removed)

    return edit


def other_robot_and_back(hall, schedule):
    for robot in (2, 1):
        hall.container.catalogue.save_schedule(replace(stored(hall, schedule), robot_id=robot))


def pause_and_resume(hall, schedule):
    hall.container.pausing.pause(schedule.id, hall.clock.now() + timedelta(hours=1))
    hall.run(2)
    hall.container.pausing.resume(schedule.id)


EDITS = {
    "its schedule deleted and undone": undone(
        lambda catalogue, _hall, schedule: catalogue.remove_schedule(schedule.id)
    ),
    "its mission deleted and undone": undone(lambda catalogue, _hall, _schedule: catalogue.remove_mission(1)),
    "its robot deleted and undone": undone(lambda catalogue, _hall, _schedule: catalogue.remove_robot(1)),
    "off and on": off_and_on,
    "its robot off and on": robot_off_and_on,
    "another robot and back": other_robot_and_back,
    "paused till before it": lambda hall, schedule: hall.container.pausing.pause(
        schedule.id, hall.clock.now() + timedelta(seconds=60)
    ),
    "paused and resumed": pause_and_resume,
}


@pytest.mark.parametrize("limit", [None, 1])
@pytest.mark.parametrize("edit", EDITS)
def test_it_does_whatever_is_done_before(tmp_path, edit, limit):
    hall, schedule = kept_back(tmp_path, robots=2)
    hall.container.catalogue.change_settings(history_limit=limit)
    EDITS[edit](hall, schedule)
    assert waits_on(hall), (outcomes(hall), stored(hall, schedule))


def test_it_does_where_it_was_deleted_before_the_clock_was_corrected(tmp_path):
    hall = Hall(tmp_path, robots=1)
    schedule = hall.plan(
        "A", "2026-11-23T06:10", recurrence="FREQ=DAILY", start_window_minutes=60, respect_working_days=False
    )
    hall.run(10)
    hall.container.holds.hold("cleaning", None, 1)
    hall.run(600)
    hall.container.operator.hold_starts([row.id for row in hall.executions(State.WAITING)])
    removed = hall.container.catalogue.remove_schedule(schedule.id)
    hall.container.holds.release(1)
    hall.clock.step(-300)
    hall.kick()
    hall.run(5)
    hall.container.catalogue.restore(removed)
    assert waits_on(hall), outcomes(hall)


@pytest.mark.parametrize("where", ["robot", "group"])
def test_it_can_be_skipped_and_that_taken_back(tmp_path, where):
    hall, schedule = kept_back(tmp_path, where=where)
    assert hall.container.pausing.skip_next(schedule.id) == AT
    hall.run(2)
    hall.container.pausing.unskip(schedule.id, AT, must_run=True)
    hall.run(600)
    assert len(hall.items()) == 1, outcomes(hall)  # the last word on it


@pytest.mark.parametrize("limit", [None, 1])
@pytest.mark.parametrize("where", ["robot", "group"])
def test_what_was_kept_back_and_cancelled_is_kept_back_when_that_is_undone(tmp_path, where, limit):
    hall = Hall(tmp_path, robots=1)
    there = {"robot_id": 1, "group_id": None} if where == "robot" else {}
    hall.container.catalogue.change_settings(history_limit=limit)
    hall.plan(
        "A", "2026-11-23T06:10", recurrence="FREQ=DAILY", start_window_minutes=60, respect_working_days=False, **there
    )
    hall.run(10)
    hall.container.holds.hold("cleaning", None, 1)
    hall.run(600)
    (row,) = hall.executions(State.WAITING)
    hall.container.operator.hold_starts([row.id])
    hall.container.operator.cancel_execution(row.id)
    hall.container.holds.release(1)
    hall.clock.step(-300)
    hall.kick()
    hall.run(5)
    hall.container.catalogue.wait_again(row.id)
    assert waits_on(hall), outcomes(hall)


@pytest.mark.parametrize("where", ["robot", "group"])
def test_what_is_skipped_is_not_sent(tmp_path, where):
    hall, schedule = kept_back(tmp_path, where=where)
    hall.container.pausing.skip_next(schedule.id)
    let_go(hall, 600)
    assert hall.items() == [], outcomes(hall)


@pytest.mark.parametrize("where", ["robot", "group"])
@pytest.mark.parametrize("rule", ["FREQ=DAILY", None])
def test_what_is_moved_before_it_runs_then(tmp_path, where, rule):
    hall, schedule = kept_back(tmp_path, where=where, rule=rule)
    hall.container.catalogue.save_schedule(replace(stored(hall, schedule), start=datetime(2026, 11, 23, 6, 8)))
    hall.run(600)
    assert minutes_sent(hall) == [8], (outcomes(hall), stored(hall, schedule))


@pytest.mark.parametrize("where", ["robot", "group"])
def test_another_rule_has_its_own_starts(tmp_path, where):
    hall, schedule = kept_back(tmp_path, where=where)
    hall.container.catalogue.save_schedule(
        replace(stored(hall, schedule), start=datetime(2026, 11, 23, 6, 0), recurrence="FREQ=MINUTELY;INTERVAL=7")
    )
    hall.run(600)
    assert minutes_sent(hall) == [7, 14], (outcomes(hall), stored(hall, schedule))


@pytest.mark.parametrize("rule", ["FREQ=DAILY", None])
def test_hours_before_it_are_planned_as_ever(tmp_path, rule):
    """It is 06:00, and 08:05 by the tablet; 08:00 is kept back; the clock is set right; at 06:01 it is moved to 07:00."""
    hall = Hall(tmp_path, robots=1)
    schedule = hall.plan(
        "A",
        "2026-11-23T08:00",
        recurrence=rule,
        start_window_minutes=60,
        respect_working_days=False,
        robot_id=1,
        group_id=None,
    )
    begin_ahead(hall, 7500.0)
    hall.run(30)
    hall.container.operator.hold_starts([row.id for row in hall.executions(State.WAITING)])
    set_right(hall, 7500.0)
    hall.container.catalogue.save_schedule(replace(stored(hall, schedule), start=datetime(2026, 11, 23, 7, 0)))
    hall.run(9000)
    assert sent_at(hall) == [3600], (outcomes(hall), stored(hall, schedule))


def test_on_a_day_off_it_does_not_run(tmp_path):
    hall, _schedule = kept_back(tmp_path, respect_working_days=True)
    hall.container.catalogue.save_days(DayException("works outing", AT.date(), AT.date()))
    hall.run(5)
    let_go(hall, 600)
    assert hall.items() == [], outcomes(hall)


@pytest.mark.parametrize("restart", [False, True])
@pytest.mark.parametrize("where", ["robot", "group"])
def test_of_several_one_is_cancelled_and_that_undone_and_two_are_kept_back(tmp_path, where, restart):
    hall = Hall(tmp_path, robots=1)
    there = {"robot_id": 1, "group_id": None} if where == "robot" else {}
    hall.plan(
        "A",
        "2026-11-23T06:08",
        recurrence="FREQ=MINUTELY;INTERVAL=1",
        start_window_minutes=60,
        respect_working_days=False,
        overlap=Overlap.QUEUE,
        **there,
    )
    hall.run(10)
    hall.container.holds.hold("cleaning", None, 1)
    hall.run(595)
    first, *others = sorted(hall.executions(State.WAITING), key=lambda row: row.planned_at)
    hall.container.operator.cancel_execution(first.id)
    hall.container.operator.hold_starts([row.id for row in others])
    hall.clock.step(-300)
    hall.kick()
    hall.run(5)
    if restart:
        hall.switch_off()
        hall.switch_on()
        hall.run(5)
    hall.container.catalogue.wait_again(first.id)
    hall.container.holds.release(1)
    hall.run(440)
    assert minutes_sent(hall) == ([8, 11, 12] if where == "robot" else [8]), outcomes(
        hall
    )  # those of a group go in turn
    assert [row.planned_at.minute for row in held(hall)] == [9, 10]
    let_go(hall, 400)
    planned = minutes_sent(hall)
    assert planned[:5] == [8, 9, 10, 11, 12], outcomes(hall)
    assert len(planned) == len(set(planned))


@pytest.mark.parametrize("hand_over", HandOver)
@pytest.mark.parametrize("where", ["robot", "group"])
def test_other_schedules_go_meanwhile(tmp_path, where, hand_over):
    hall = Hall(tmp_path, robots=1)
    hall.container.catalogue.save_robot(replace(hall.container.catalogue.robots()[0], hand_over=hand_over))
    hall.run(2)
    there = {"robot_id": 1, "group_id": None} if where == "robot" else {}
    hall.plan(
        "A", "2026-11-23T06:40", recurrence="FREQ=DAILY", start_window_minutes=120, respect_working_days=False, **there
    )
    begin_ahead(hall, 2700.0)
    hall.container.operator.hold_starts([row.id for row in hall.executions(State.WAITING)])
    set_right(hall, 2700.0)
    hall.plan(
        "B",
        "2026-11-23T06:05",
        recurrence="FREQ=MINUTELY;INTERVAL=10",
        start_window_minutes=9,
        respect_working_days=False,
        **there,
    )
    hall.run(1400)
    assert sent_at(hall) == [300, 900], outcomes(hall)
    hall.run(1600)
    assert 40 not in minutes_sent(hall)
    let_go(hall, 60)
    assert 40 in minutes_sent(hall)
