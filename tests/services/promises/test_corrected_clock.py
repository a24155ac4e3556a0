"""The clock is corrected, by little or much, once or in steps: nothing is doubled or lost, and what is kept back can be let go."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import pytest

from app.domain.models import IdleRule, InvalidInput, Schedule, State
from tests.services.promises.test_pressed_twice import in_doubt_at_a_silent_robot, it_is_at_a_robot_that_fell_silent
from tests.services.promises.test_set_back import (
    begin_ahead,
    off_and_on,
    pause_and_resume,
    robot_off_and_on,
    there_and_back,
)
from tests.support.groups import Hall
from tests.support.network import Fate
from tests.support.seen import outcomes, sent_at
from tests.support.site import Site


@pytest.fixture
def hall(tmp_path):
    hall = Hall(tmp_path, robots=3)
    yield hall
    hall.switch_off()


@pytest.mark.parametrize("back", [20, 180, 300])
@pytest.mark.parametrize("where", ["robot", "group"])
def test_what_is_kept_back_can_be_let_go_after_a_small_correction_of_the_clock(tmp_path, where, back):
    """The tablet is some minutes ahead; a person keeps the 06:10 back; the network corrects the clock; the person lets it go."""
    hall = Hall(tmp_path, robots=1)
    there = {"robot_id": 1, "group_id": None} if where == "robot" else {}
    hall.plan(
        "A", "2026-11-23T06:10", recurrence="FREQ=DAILY", start_window_minutes=60, respect_working_days=False, **there
    )
    hall.run(10)
    hall.container.holds.hold("cleaning", None, 1)
    hall.run(600)
    (row,) = hall.executions(State.WAITING)
    assert hall.container.operator.hold_starts([row.id]) == 1
    hall.container.holds.release(1)
    hall.clock.step(-back)
    hall.kick()
    hall.run(back + 120)
    hall.container.operator.hold_starts([row.id for row in hall.executions(State.WAITING)], held=False)
    hall.run(300)
    assert len(sent_at(hall)) == 1, (outcomes(hall), hall.alarms())


@pytest.mark.parametrize("gap", [2, 20])
def test_a_run_now_between_two_steps_of_one_correction_is_not_lost(tmp_path, gap):
    """Date first, time then; Run now pressed between. No robot answers until then."""
    hall = Hall(tmp_path, robots=1)
    hall.run(10)
    hall.switch_off()
    hall.clock.step(86400.0 + 1200)
    hall.switch_on()
    hall.run(60)
    assert hall.container.holds.active().clock
    hall.clock.step(-86400.0)
    hall.kick()
    hall.run(gap)
    hall.container.operator.run_now(1, 1)
    hall.run(gap)
    hall.clock.step(-1200.0)
    hall.kick()
    hall.run(120)
    assert len(hall.items()) == 1, (outcomes(hall), hall.alarms())


@pytest.mark.parametrize("ahead", [600, 7200, 86400])
@pytest.mark.parametrize("where", ["robot", "group"])
def test_a_run_now_of_a_clock_ahead_starts_when_released(hall, where, ahead):
    hall.run(10)
    begin_ahead(hall, ahead)
    hall.container.operator.run_now(1, 1) if where == "robot" else hall.container.operator.run_on_any(hall.group.id, 1)
    hall.run(20)
    hall.clock.step(-ahead)
    hall.kick()
    hall.network.down.clear()
    hall.run(60)
    assert len(hall.items()) == 1, (outcomes(hall), hall.alarms())


CHANGES = {
    "nothing": lambda site, schedule: None,
    "off and on": off_and_on,
    "robot off and on": robot_off_and_on,
    "pause and resume": pause_and_resume,
    "moved and back": lambda site, schedule: there_and_back(site, schedule, start=datetime(2026, 11, 23, 6, 11)),
    "deleted and undone": lambda site, schedule: site.container.catalogue.restore(
        site.container.catalogue.remove_schedule(schedule.id)
    ),
    "app killed": lambda site, schedule: (site.switch_off(), site.switch_on()),
    "clock ahead and back": lambda site, schedule: [
        (site.clock.step(s), site.kick(), site.run(5)) for s in (900, -900)
    ],
    "clock back and ahead": lambda site, schedule: [
        (site.clock.step(s), site.kick(), site.run(5)) for s in (-900, 900)
    ],
}


@pytest.mark.parametrize("limit", [None, 1])
@pytest.mark.parametrize("where", ["robot", "group"])
@pytest.mark.parametrize("change", CHANGES)
def test_a_skip_is_undone_in_ordinary_life(tmp_path, where, change, limit):
    hall = Hall(tmp_path, robots=1)
    there = {"robot_id": 1, "group_id": None} if where == "robot" else {}
    hall.container.catalogue.change_settings(history_limit=limit)
    schedule = hall.plan(
        "A",
        "2026-11-23T06:10",
        recurrence="FREQ=MINUTELY;INTERVAL=30",
        start_window_minutes=20,
        respect_working_days=False,
        **there,
    )
    hall.run(10)
    at = hall.container.pausing.skip_next(schedule.id)
    hall.run(30)
    CHANGES[change](hall, schedule)
    hall.run(30)
    hall.container.pausing.unskip(schedule.id, at, must_run=True)
    hall.run(700)
    assert sent_at(hall) == [600], outcomes(hall)


@pytest.mark.parametrize("limit", [None, 1])
@pytest.mark.parametrize("where", ["robot", "group"])
@pytest.mark.parametrize("change", CHANGES)
def test_a_skip_stays(tmp_path, where, change, limit):
    hall = Hall(tmp_path, robots=1)
    there = {"robot_id": 1, "group_id": None} if where == "robot" else {}
    hall.container.catalogue.change_settings(history_limit=limit)
    schedule = hall.plan(
        "A",
        "2026-11-23T06:05",
        recurrence="FREQ=MINUTELY;INTERVAL=5",
        start_window_minutes=20,
        respect_working_days=False,
        **there,
    )
    hall.run(10)
    at = hall.container.pausing.skip(schedule.id, datetime(2026, 11, 23, 6, 5, tzinfo=UTC))
    hall.run(30)
    if change != "clock ahead and back":
        CHANGES[change](hall, schedule)
    hall.run(700)
    assert at not in [row.planned_at for row in hall.executions() if row.queue_id], outcomes(hall)


def test_a_cancel_undone_survives_a_correction(tmp_path):
    hall = Hall(tmp_path, robots=1)
    hall.plan(
        "A",
        "2026-11-23T06:10",
        recurrence="FREQ=DAILY",
        start_window_minutes=60,
        respect_working_days=False,
        robot_id=1,
        group_id=None,
    )
    hall.run(10)
    hall.container.holds.hold("cleaning", None, 1)
    hall.run(600)
    (row,) = hall.executions(State.WAITING)
    hall.container.operator.cancel_execution(row.id)
    hall.container.catalogue.wait_again(row.id)
    hall.container.holds.release(1)
    hall.clock.step(-120)
    hall.kick()
    hall.run(400)
    assert len(sent_at(hall)) == 1, outcomes(hall)


def in_doubt(hall):
    hall.run(10)
    hall.network.next("POST", "/mission_queue", Fate.LOST)
    return hall


@pytest.mark.parametrize("killed", [False, True])
def test_a_start_after_the_undo_of_a_cancel_is_not_passed_over(tmp_path, killed):
    """06:10 waits by a clock 5 min ahead, is cancelled; the clock is corrected; the undo is pressed while another one is due."""
    hall = Hall(tmp_path, robots=1)
    hall.plan(
        "A",
        "2026-11-23T06:10",
        recurrence="FREQ=MINUTELY;INTERVAL=1",
        start_window_minutes=60,
        respect_working_days=False,
        robot_id=1,
        group_id=None,
    )
    hall.run(10)
    hall.container.holds.hold("cleaning", None, 1)
    hall.run(610)
    row = hall.executions(State.WAITING)[-1]
    hall.container.operator.cancel_execution(row.id)
    hall.clock.step(-120)
    hall.kick()
    if killed:
        hall.switch_off()
        hall.switch_on()
    hall.run(10)
    hall.container.catalogue.wait_again(row.id)
    hall.container.holds.release(1)
    hall.run(400)
    assert 600 in sent_at(hall) or sent_at(hall), outcomes(hall)
    assert row.planned_at in [each.planned_at for each in hall.executions() if each.queue_id], outcomes(hall)


@pytest.mark.parametrize(
    "steps",
    [(-30, -30), (-300, 300), (300, -300, 300, -300), (1200, -1200, 1200, -1200), (-3, -3, -3), (-400, 3000, -2600)],
)
@pytest.mark.parametrize("where", ["robot", "group"])
@pytest.mark.parametrize("limit", [None, 1])
@pytest.mark.parametrize("kill", [False, True])
def test_steps_double_nothing_and_lose_nothing(tmp_path, steps, where, limit, kill):
    hall = Hall(tmp_path, robots=1)
    there = {"robot_id": 1, "group_id": None} if where == "robot" else {}
    hall.container.catalogue.change_settings(history_limit=limit)
    hall.plan(
        "A",
        "2026-11-23T06:10",
        recurrence="FREQ=MINUTELY;INTERVAL=10",
        start_window_minutes=9,
        respect_working_days=False,
        **there,
    )
    hall.run(1000)
    for step in steps:
        hall.clock.step(step)
        hall.kick()
        hall.run(1)
        if kill:
            hall.switch_off()
            hall.switch_on()
        hall.run(5)
    hall.run(3000)
    tokens = [item.description for item in hall.items()]
    assert len(tokens) == len(set(tokens))
    assert len(tokens) >= 4, outcomes(hall)


def test_a_late_start_that_was_kept_back_can_be_let_go_after_the_network_has_set_the_clock(tmp_path):
    """Monday morning: the tablet boots 90 s ahead, lists 06:10 as late, a person holds it; then the network sets the clock."""
    site = Site(tmp_path, with_window=True)
    site.add_robots()
    mission = site.add_mission("Deliver")
    site.container.catalogue.save_schedule(
        Schedule(
            "A",
            robot_id=1,
            mission_id=mission.id,
            start=datetime(2026, 11, 23, 6, 10),
            timezone="UTC",
            recurrence="FREQ=DAILY",
            start_window_minutes=60,
            respect_working_days=False,
        )
    )
    site.run(10)
    site.switch_off()
    site.clock.sleep(530)  # 06:09
    site.clock.step(90)  # 06:10:30
    site.switch_on()
    site.run(5)
    (row,) = site.executions(State.WAITING)
    assert site.container.operator.hold_starts([row.id]) == 1
    site.clock.step(-90)
    site.kick()
    site.run(180)
    site.container.operator.hold_starts([row.id for row in site.executions(State.WAITING)], held=False)
    site.run(300)
    assert len(sent_at(site)) == 1, (outcomes(site), [alarm.code for alarm in site.container.alarms.open()])


def in_doubt_first(hall):
    row = in_doubt_at_a_silent_robot(hall)
    second, third = (hall.robot(name) for name in hall.machines if name != row.robot)
    return row, second, third


@pytest.mark.parametrize("limit", [None, 1])
@pytest.mark.parametrize("how", ["removed", "off", "hall"])
def test_of_two_others_one_gets_it_though_the_second_robot_is_put_back(hall, how, limit):
    hall.container.catalogue.change_settings(history_limit=limit)
    row, second, third = in_doubt_first(hall)
    hall.hold(second.name)
    new = hall.container.operator.start_on_another(row.id, second.id)
    hall.run(2)
    if how == "removed":
        removed = hall.container.catalogue.remove_robot(second.id)
    elif how == "off":
        hall.container.catalogue.set_robot_enabled(second.id, False)
    else:
        hall.container.operator.hold_starts([new.id])
        hall.run(1)
        removed = hall.container.catalogue.remove_robot(second.id)
    hall.run(5)
    hall.container.operator.start_on_another(row.id, third.id)
    hall.run(60)
    if how == "off":
        hall.container.catalogue.set_robot_enabled(second.id, True)
    else:
        hall.container.catalogue.restore(removed)
    hall.run(2)
    hall.container.holds.release(second.id)
    if hall.container.ledger.get(new.id):
        hall.container.operator.hold_starts([new.id], held=False)
    hall.run(200)
    assert len(hall.items()) == 1, outcomes(hall)


def test_that_both_have_it_is_told_after_the_first_has_been_given_up(hall):
    hall.container.catalogue.change_settings(history_limit=1)
    first = it_is_at_a_robot_that_fell_silent(hall)
    second, third = (hall.robot(name) for name in hall.machines if name != first)
    hall.container.operator.start_on_another(hall.run_of().id, second.id)
    hall.run(900)
    hall.container.operator.run_now(third.id, 1)
    hall.run(300)
    hall.container.operator.run_now(third.id, 1)
    hall.run(300)
    hall.network.down.clear()
    hall.run(200)
    assert "started_twice" in hall.alarms(), (outcomes(hall), hall.alarms())


def test_the_undo_of_a_cancel_passes_over_nothing_that_is_due_just_then(tmp_path):
    """As Pausing.unskip takes care of."""
    hall = Hall(tmp_path, robots=1)
    hall.plan(
        "A",
        "2026-11-23T06:05",
        recurrence="FREQ=MINUTELY;INTERVAL=5",
        start_window_minutes=60,
        respect_working_days=False,
        robot_id=1,
        group_id=None,
    )
    hall.run(10)
    hall.clock.step(890)  # 06:15:00
    hall.container.holds.hold("cleaning", None, 1)
    hall.kick()
    hall.run(20)
    row = hall.executions(State.WAITING)[-1]
    hall.container.operator.cancel_execution(row.id)
    hall.clock.step(-890)
    hall.kick()
    hall.run(250)
    hall.run(19.5)
    hall.clock.sleep(1.0)
    hall.container.catalogue.wait_again(row.id)
    hall.container.holds.release(1)
    hall.run(900)
    planned = [each.planned_at.minute for each in hall.executions() if each.queue_id]
    assert {5, 10, 15} <= set(planned), (planned, outcomes(hall))


@pytest.mark.parametrize("restart", [False, True])
@pytest.mark.parametrize("back", [300, 7200])
@pytest.mark.parametrize("kind", ["doubt", "waits", "group"])
def test_a_run_now_is_not_sent_long_after_its_window(hall, kind, back, restart):
    hall.run(10)
    if kind == "doubt":
        hall.network.next("POST", "/mission_queue", Fate.LOST)
        hall.container.operator.run_now(1, 1)
        hall.run(2)
        hall.network.down |= set(hall.machines)
    else:
        hall.hold(None)
        hall.container.operator.run_now(1, 1) if kind == "waits" else hall.container.operator.run_on_any(
            hall.group.id, 1
        )
    hall.run(5)
    hall.clock.step(-back)
    hall.kick()
    hall.run(120)
    if restart:
        hall.switch_off(cleanly=False)
        hall.switch_on()
    hall.run(32 * 60)
    hall.network.down.clear()
    hall.container.holds.release(None)
    hall.run(200)
    assert hall.items() == [], (outcomes(hall), hall.alarms())


@pytest.mark.parametrize(
    "steps", [(-7200, 7200), (-7200, 3600, 3600), (-300, -300, 600), (-86400, 86400, -86400, 86400)]
)
@pytest.mark.parametrize("restart", [False, True])
@pytest.mark.parametrize("kind", ["waits", "group"])
def test_a_run_now_outlives_steps(hall, kind, steps, restart):
    hall.run(10)
    hall.hold(None)
    hall.container.operator.run_now(1, 1) if kind == "waits" else hall.container.operator.run_on_any(hall.group.id, 1)
    hall.run(5)
    for step in steps:
        hall.clock.step(step)
        hall.kick()
        hall.run(5)
        if restart:
            hall.switch_off(cleanly=False)
            hall.switch_on()
            hall.run(5)
    hall.container.holds.release(None)
    hall.run(120)
    assert len(hall.items()) == 1, (outcomes(hall), hall.alarms())


def test_idle_missions_go_on_after_a_step_back(tmp_path):
    site = Site(tmp_path)
    site.add_robots()
    site.add_mission("Deliver")
    robot = site.container.catalogue.robots()[0]
    site.container.catalogue.save_robot(replace(robot, idle=IdleRule(mission_id=1, after_minutes=5)))
    site.run(280)
    site.clock.step(-3600)
    site.kick()
    site.run(1800)
    assert len(sent_at(site)) == 1, outcomes(site)


@pytest.mark.parametrize("killed", [False, True])
@pytest.mark.parametrize("limit", [None, 1])
def test_a_group_start_kept_back_and_cancelled_never_runs(tmp_path, limit, killed):
    hall = Hall(tmp_path, robots=2)
    hall.container.catalogue.change_settings(history_limit=limit)
    hall.plan(
        "A",
        "2026-11-23T06:10",
        recurrence="FREQ=MINUTELY;INTERVAL=10",
        start_window_minutes=30,
        respect_working_days=False,
    )
    hall.run(10)
    hall.hold(None)
    hall.run(610)
    row = hall.executions(State.WAITING)[-1]
    hall.container.operator.hold_starts([row.id])
    hall.run(5)
    hall.container.operator.cancel_execution(row.id)
    hall.container.holds.release(None)
    for step in (-120, 120, -120):
        hall.clock.step(step)
        hall.kick()
        hall.run(3)
        if killed:
            hall.switch_off(cleanly=False)
            hall.switch_on()
    hall.run(2500)
    assert row.planned_at not in [each.planned_at for each in hall.executions() if each.queue_id]
    assert len(hall.items()) >= 3


def test_a_one_time_start_kept_back_can_be_let_go_after_a_correction(tmp_path):
    """The same of a group's start that a person holds on the timeline; there is no other one of it."""
    hall = Hall(tmp_path, robots=2)
    hall.plan("A", "2026-11-23T06:10", start_window_minutes=120, respect_working_days=False)
    hall.run(10)
    hall.hold(None)
    hall.run(620)
    (row,) = hall.executions(State.WAITING)
    hall.container.operator.hold_starts([row.id])
    hall.container.holds.release(None)
    hall.clock.step(-60)
    hall.kick()
    hall.run(120)
    told = hall.container.operator.hold_starts([row.id for row in hall.executions(State.WAITING)], held=False)
    hall.run(300)
    assert len(hall.items()) == 1, (told, outcomes(hall), hall.alarms())


@pytest.mark.parametrize("limit", [None, 1])
@pytest.mark.parametrize("where", ["robot", "group"])
@pytest.mark.parametrize("change", [key for key in CHANGES if not key.startswith("clock")])
def test_a_skip_passed_over_by_a_clock_ahead_stays_whatever_is_edited(tmp_path, where, change, limit):
    hall = Hall(tmp_path, robots=1)
    there = {"robot_id": 1, "group_id": None} if where == "robot" else {}
    hall.container.catalogue.change_settings(history_limit=limit)
    schedule = hall.plan(
        "A",
        "2026-11-23T06:05",
        recurrence="FREQ=MINUTELY;INTERVAL=5",
        start_window_minutes=20,
        respect_working_days=False,
        **there,
    )
    hall.run(310)
    at = hall.container.pausing.skip(schedule.id, datetime(2026, 11, 23, 6, 10, tzinfo=UTC))
    hall.run(5)
    hall.clock.step(595)
    hall.kick()
    hall.run(20)
    hall.clock.step(-595)
    hall.kick()
    hall.run(20)
    CHANGES[change](hall, schedule)
    hall.run(900)
    assert at not in [row.planned_at for row in hall.executions() if row.queue_id], outcomes(hall)
    tokens = [item.description for item in hall.items()]
    assert len(tokens) == len(set(tokens)) >= 3


def test_a_start_cancelled_by_a_clock_ahead_is_planned_again_by_a_later_undo_though_the_next_is_begun(tmp_path):
    """A later start of the right clock has been sent: its undo is refused or it runs, but never says it will and does not."""
    hall = Hall(tmp_path, robots=1)
    hall.plan(
        "A",
        "2026-11-23T06:05",
        recurrence="FREQ=MINUTELY;INTERVAL=5",
        start_window_minutes=60,
        respect_working_days=False,
        robot_id=1,
        group_id=None,
    )
    hall.run(10)
    hall.clock.step(590)  # 06:10
    hall.container.holds.hold("cleaning", None, 1)
    hall.kick()
    hall.run(20)
    row = hall.executions(State.WAITING)[-1]
    hall.container.operator.cancel_execution(row.id)
    hall.clock.step(-590)
    hall.kick()
    hall.run(20)
    hall.container.catalogue.set_schedule_enabled(1, False)
    hall.run(5)
    try:
        hall.container.catalogue.wait_again(row.id)
    except InvalidInput:
        return
    hall.container.catalogue.set_schedule_enabled(1, True)
    hall.container.holds.release(1)
    hall.run(900)
    assert row.planned_at in [each.planned_at for each in hall.executions() if each.queue_id], outcomes(hall)
