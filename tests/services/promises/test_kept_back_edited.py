"""What a person keeps back while the clock is ahead waits on when that is corrected, whatever is edited, deleted or undone meanwhile."""
from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.domain.models import HandOver, Overlap, State
from tests.services.promises.test_set_back import begin_ahead, off_and_on, set_right, stored
from tests.support.groups import Hall
from tests.support.seen import outcomes, sent_at


def kept_back(tmp_path, back=300, rule="FREQ=DAILY", where="robot", robots=1, **more):
    """06:10 is kept back by a clock that is ahead; that is corrected; it is the next start still."""
    hall = Hall(tmp_path, robots=robots)
    there = {"robot_id": 1, "group_id": None} if where == "robot" else {}
    schedule = hall.plan("A", "2026-11-23T06:10", recurrence=rule, start_window_minutes=60,
                         **{"respect_working_days": False, **there, **more})
    hall.run(10)
    hall.container.holds.hold("cleaning", None, 1)
    hall.run(600)
    row, = hall.executions(State.WAITING)
    assert hall.container.operator.hold_starts([row.id]) == 1
    hall.container.holds.release(1)
    hall.clock.step(-back)
    hall.kick()
    hall.run(5)
    return hall, schedule, row


def told(hall, schedule):
    return outcomes(hall), hall.alarms(), stored(hall, schedule)


@pytest.mark.parametrize("where", ["robot", "group"])
def test_deleted_and_undone_stays_kept_back(tmp_path, where):
    hall, schedule, _row = kept_back(tmp_path, where=where)
    hall.container.catalogue.restore(hall.container.catalogue.remove_schedule(schedule.id))
    hall.run(600)
    assert hall.items() == [], ("sent though kept back", told(hall, schedule))


@pytest.mark.parametrize("rule", ["FREQ=DAILY", None])
@pytest.mark.parametrize("where", ["robot", "group"])
def test_moved_to_an_earlier_time_runs_then(tmp_path, where, rule):
    hall, schedule, _row = kept_back(tmp_path, where=where, rule=rule)
    hall.container.catalogue.save_schedule(replace(stored(hall, schedule), start=datetime(2026, 11, 23, 6, 8)))
    hall.run(600)
    assert len(hall.items()) == 1, told(hall, schedule)


@pytest.mark.parametrize("where", ["robot", "group"])
def test_another_rule(tmp_path, where):
    hall, schedule, _row = kept_back(tmp_path, where=where)
    hall.container.catalogue.save_schedule(replace(stored(hall, schedule), start=datetime(2026, 11, 23, 6, 0),
                                                   recurrence="FREQ=MINUTELY;INTERVAL=7"))
    hall.run(180)
    assert len(hall.items()) == 1, told(hall, schedule)          # 06:07


def test_off_and_on(tmp_path):
    hall, schedule, _row = kept_back(tmp_path)
    off_and_on(hall, schedule)
    hall.run(600)
    assert len(hall.items()) == 1, told(hall, schedule)


def test_other_robot(tmp_path):
    hall, schedule, _row = kept_back(tmp_path, robots=2)
    hall.container.catalogue.save_schedule(replace(stored(hall, schedule), robot_id=2))
    hall.run(600)
    assert len(hall.items()) == 1, told(hall, schedule)


@pytest.mark.parametrize("let_go", ["before", "after"])
def test_a_pause_that_ends_before_it(tmp_path, let_go):
    hall, schedule, row = kept_back(tmp_path)
    if let_go == "before":
        hall.container.operator.hold_starts([row.id], held=False)
    hall.container.pausing.pause(schedule.id, hall.clock.now() + timedelta(seconds=60))
    if let_go == "after":
        hall.container.operator.hold_starts([row.id], held=False)
    hall.run(600)
    assert len(hall.items()) == 1, told(hall, schedule)


@pytest.mark.parametrize("rule", ["FREQ=MONTHLY", None, "FREQ=DAILY"])
@pytest.mark.parametrize("where", ["robot", "group"])
def test_let_go(tmp_path, where, rule):
    hall, schedule, row = kept_back(tmp_path, where=where, rule=rule, respect_working_days=rule is not None)
    hall.container.operator.hold_starts([row.id], held=False)
    hall.run(600)
    assert len(hall.items()) == 1, told(hall, schedule)


@pytest.mark.parametrize("restart", [False, True])
def test_several(tmp_path, restart):
    hall = Hall(tmp_path, robots=1)
    schedule = hall.plan("A", "2026-11-23T06:08", recurrence="FREQ=MINUTELY;INTERVAL=1", start_window_minutes=60,
                         respect_working_days=False, robot_id=1, group_id=None, overlap=Overlap.QUEUE)
    hall.run(10)
    hall.container.holds.hold("cleaning", None, 1)
    hall.run(600)
    rows = hall.executions(State.WAITING)
    assert len(rows) == 3
    hall.container.operator.hold_starts([row.id for row in rows])
    hall.clock.step(-300)
    hall.kick()
    hall.run(5)
    if restart:
        hall.switch_off()
        hall.switch_on()
        hall.run(5)
    hall.container.operator.hold_starts([row.id for row in rows], held=False)
    hall.container.holds.release(1)
    hall.run(700)
    planned = sorted(row.planned_at.minute for row in hall.executions() if row.queue_id)
    assert planned[:5] == [8, 9, 10, 11, 12], told(hall, schedule)
    assert len(planned) == len(set(planned))


def test_moved_earlier_after_it_was_let_go(tmp_path):
    hall, schedule, row = kept_back(tmp_path)
    hall.container.operator.hold_starts([row.id], held=False)
    hall.container.catalogue.save_schedule(replace(stored(hall, schedule), start=datetime(2026, 11, 23, 6, 8)))
    hall.run(600)
    assert len(hall.items()) == 1, told(hall, schedule)


@pytest.mark.parametrize("rule", ["FREQ=DAILY", None])
def test_hours_moved_earlier(tmp_path, rule):
    """Real 06:00; tablet 08:05; 08:00 listed, held; clock right; at 06:01 moved to 07:00."""
    hall = Hall(tmp_path, robots=1)
    schedule = hall.plan("A", "2026-11-23T08:00", recurrence=rule, start_window_minutes=60, respect_working_days=False, robot_id=1,
                         group_id=None)
    begin_ahead(hall, 7500.0)
    hall.container.holds.confirm_clock() if hasattr(hall.container.holds, "confirm_clock") else None
    hall.run(30)
    row, = hall.executions(State.WAITING)
    hall.container.operator.hold_starts([row.id])
    hall.network.down.clear()
    hall.clock.step(-7500.0)
    hall.kick()
    hall.run(30)
    hall.container.catalogue.save_schedule(replace(stored(hall, schedule), start=datetime(2026, 11, 23, 7, 0)))
    hall.run(9000)
    assert sent_at(hall) == [3600], told(hall, schedule)


@pytest.mark.parametrize("how", ["mission", "robot", "group"])
def test_other_removals_undone(tmp_path, how):
    hall, schedule, _row = kept_back(tmp_path, where="group" if how == "group" else "robot")
    c = hall.container.catalogue
    removed = {"mission": lambda: c.remove_mission(1), "robot": lambda: c.remove_robot(1),
               "group": lambda: c.remove_group(hall.group.id)}[how]()
    hall.run(2)
    c.restore(removed)
    hall.run(600)
    assert hall.items() == [], told(hall, schedule)


@pytest.mark.parametrize("edit", ["undo", "off and on", "moved and back"])
def test_control_no_correction(tmp_path, edit):
    """In ordinary life: what is sent of a start that is kept back."""
    hall, schedule, _row = kept_back(tmp_path, back=0)
    if edit == "undo":
        hall.container.catalogue.restore(hall.container.catalogue.remove_schedule(schedule.id))
    elif edit == "off and on":
        off_and_on(hall, schedule)
    hall.run(600)
    assert hall.items() == [], told(hall, schedule)


def test_skip_undone_before_what_is_kept_back(tmp_path):
    hall = Hall(tmp_path, robots=1)
    schedule = hall.plan("A", "2026-11-23T06:08", recurrence="FREQ=MINUTELY;INTERVAL=2", start_window_minutes=60,
                         respect_working_days=False, robot_id=1, group_id=None)
    hall.run(10)
    at = hall.container.pausing.skip(schedule.id, datetime(2026, 11, 23, 6, 8, tzinfo=UTC))
    hall.container.holds.hold("cleaning", None, 1)
    hall.run(600)
    row = hall.executions(State.WAITING)[0]
    hall.container.operator.hold_starts([row.id])
    hall.clock.step(-300)
    hall.kick()
    hall.run(5)
    hall.container.holds.release(1)
    hall.container.pausing.take_again(schedule.id, at, must_run=True)
    hall.run(300)
    assert at in [each.planned_at for each in hall.executions() if each.queue_id]


@pytest.mark.parametrize("hand_over", HandOver)
@pytest.mark.parametrize("let_go", [False, True])
@pytest.mark.parametrize("where", ["robot", "group"])
def test_others_go_meanwhile(tmp_path, where, let_go, hand_over):
    hall = Hall(tmp_path, robots=1)
    hall.container.catalogue.save_robot(replace(hall.container.catalogue.robots()[0], hand_over=hand_over))
    hall.run(2)
    there = {"robot_id": 1, "group_id": None} if where == "robot" else {}
    hall.plan("A", "2026-11-23T06:40", recurrence="FREQ=DAILY", start_window_minutes=120, respect_working_days=False, **there)
    begin_ahead(hall, 2700.0)
    row, = hall.executions(State.WAITING)
    assert hall.container.operator.hold_starts([row.id]) == 1
    set_right(hall, 2700.0)
    if let_go:
        hall.container.operator.hold_starts([row.id], held=False)
    hall.plan("B", "2026-11-23T06:05", recurrence="FREQ=MINUTELY;INTERVAL=10", start_window_minutes=9, respect_working_days=False,
              **there)
    hall.run(1400)
    assert sent_at(hall) == [300, 900], outcomes(hall)
    hall.run(1600)
    done = [each.planned_at.minute for each in hall.executions() if each.queue_id and each.planned_at.minute == 40]
    assert bool(done) == let_go


def three(tmp_path, where="robot"):
    hall = Hall(tmp_path, robots=1)
    there = {"robot_id": 1, "group_id": None} if where == "robot" else {}
    schedule = hall.plan("A", "2026-11-23T06:08", recurrence="FREQ=MINUTELY;INTERVAL=1", start_window_minutes=60,
                         respect_working_days=False, overlap=Overlap.QUEUE, **there)
    hall.run(10)
    hall.container.holds.hold("cleaning", None, 1)
    hall.run(595)
    return hall, schedule, sorted(hall.executions(State.WAITING), key=lambda row: row.planned_at)


@pytest.mark.parametrize("restart", [False, True])
@pytest.mark.parametrize("where", ["robot", "group"])
@pytest.mark.parametrize("undo", ["wait", "take", "late"])
def test_first_cancelled_second_held(tmp_path, where, undo, restart):
    hall, schedule, rows = three(tmp_path, where)
    assert len(rows) == 3, outcomes(hall)
    first, second, _third = rows
    hall.container.operator.cancel_execution(first.id)
    hall.container.operator.hold_starts([second.id])
    hall.clock.step(-300)
    hall.kick()
    hall.run(5)
    if restart:
        hall.switch_off()
        hall.switch_on()
        hall.run(5)
    if undo == "late":
        hall.clock.step(-60)
        hall.kick()
        hall.run(5)
    if undo == "take":
        hall.container.pausing.take_again(schedule.id, first.planned_at, must_run=True)
    else:
        hall.container.catalogue.wait_again(first.id)
    hall.container.operator.hold_starts([second.id], held=False)
    hall.container.holds.release(1)
    hall.run(800)
    planned = sorted(row.planned_at.minute for row in hall.executions() if row.queue_id)
    assert planned[:5] == [8, 9, 10, 11, 12], told(hall, schedule)
    assert len(planned) == len(set(planned))
