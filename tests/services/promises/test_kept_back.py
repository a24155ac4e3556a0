"""What a person keeps back or cancels by a clock that is ahead; a Run now by one that is set back; starts on a third robot."""

from __future__ import annotations

from contextlib import suppress
from datetime import UTC, datetime, timedelta

import pytest

from app.domain.models import InvalidInput, Overlap, Schedule, State
from app.screens.scheduler.facts import SchedulerServices, Window, read
from tests.services.promises.test_pressed_twice import in_doubt_at_a_silent_robot, it_is_at_a_robot_that_fell_silent
from tests.services.promises.test_set_back import FAR, RULE, begin_ahead, each_start_leaves, off_and_on, set_right
from tests.support.groups import Hall
from tests.support.network import Fate
from tests.support.seen import outcomes, sent_at
from tests.support.site import Site

HOURS = 7800.0  # a clock two hours and ten minutes ahead


def put_right(site, ahead=FAR):
    """Until the app has noticed it, too."""
    set_right(site, ahead)
    site.kick()
    site.run(60)
    hold = site.container.holds.active()
    assert hold is None or not hold.clock


@pytest.fixture(params=["robot", "group"])
def one(request, tmp_path):
    """R1 alone, of its own or as a group of one."""
    hall = Hall(tmp_path, robots=1)
    where = {"robot_id": 1, "group_id": None} if request.param == "robot" else {}
    hall.plan_often = lambda **more: hall.plan(
        "A",
        "2026-11-23T06:10",
        **{"recurrence": RULE, "start_window_minutes": 20, "respect_working_days": False, **where, **more},
    )
    hall.container.catalogue.change_settings(poll_interval_seconds=600)
    yield hall
    hall.switch_off()


# ---------------------------------------------------------------------- what a person did not want is a skip now, and can be taken again
@pytest.mark.parametrize("limit", [None, 1])
def test_what_was_cancelled_by_a_clock_ahead_runs_when_it_is_started_after_all(one, limit):
    """The card of it on the timeline says "Start it after all", and then that it is planned again."""
    one.container.catalogue.change_settings(history_limit=limit)
    schedule = one.plan_often()
    begin_ahead(one, HOURS)
    (row,) = one.executions(State.WAITING)
    one.container.operator.cancel_execution(row.id)
    put_right(one, HOURS)
    one.run(100)
    services = SchedulerServices(
        **{name: getattr(one.container, name) for name in SchedulerServices.__dataclass_fields__}
    )
    facts, now = read(services, Window()), one.clock.now()
    assert [facts.may_start_after_all(each, now) for each in facts.past if each.id == row.id] == [True]
    one.container.pausing.unskip(schedule.id, row.planned_at, must_run=True)
    each_start_leaves(one, 4 * 3600)


def test_what_was_tried_and_then_kept_back_too_long_runs_when_it_is_started_after_all(tmp_path):
    one = Hall(tmp_path, robots=1)
    one.container.catalogue.change_settings(poll_interval_seconds=600)
    schedule = one.plan(
        "A",
        "2026-11-23T06:10",
        recurrence=RULE,
        start_window_minutes=6,
        respect_working_days=False,
        robot_id=1,
        group_id=None,
    )
    begin_ahead(one, HOURS)
    one.run(100)
    (row,) = one.executions(State.WAITING)
    one.container.operator.hold_starts([row.id])
    one.run(300)
    put_right(one, HOURS)
    one.run(60)
    one.container.pausing.unskip(schedule.id, row.planned_at, must_run=True)
    each_start_leaves(one, 4 * 3600)


# ---------------------------------------------------------------------- what a person keeps back waits for its instant
@pytest.mark.parametrize("ahead", [FAR, HOURS])
def test_no_start_is_lost_because_a_later_one_is_kept_back(one, ahead):
    one.plan_often()
    begin_ahead(one, ahead)
    (row,) = one.executions(State.WAITING)
    assert one.container.operator.hold_starts([row.id]) == 1
    put_right(one, ahead)
    one.run(200)
    each_start_leaves(one, 5000)


def test_no_start_is_lost_because_the_late_ones_of_a_wrong_clock_were_kept_back(tmp_path):
    """With a window: the list of late starts comes up, a person presses Hold, sets the clock right, and lets them go."""
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
            recurrence=RULE,
            start_window_minutes=20,
            respect_working_days=False,
        )
    )
    begin_ahead(site, FAR)
    (row,) = site.executions(State.WAITING)
    site.container.operator.hold_starts([row.id])
    put_right(site, FAR)
    site.container.operator.hold_starts([row.id], held=False)
    each_start_leaves(site, 7200)


@pytest.mark.parametrize("overlap", [Overlap.SKIP, Overlap.QUEUE])
def test_no_start_is_lost_by_an_edit_after_one_was_kept_back_and_let_go(one, overlap):
    """Without a row, without an alarm."""
    schedule = one.plan_often(overlap=overlap)
    begin_ahead(one, FAR)
    (row,) = one.executions(State.WAITING)
    one.container.operator.hold_starts([row.id])
    put_right(one, FAR)
    one.container.operator.hold_starts([row.id], held=False)
    off_and_on(one, schedule)
    each_start_leaves(one, 7200)


def test_no_start_is_lost_where_the_clock_is_put_a_quarter_of_an_hour_ahead_for_a_moment(tmp_path):
    """Nothing is switched off, and the clock is never in doubt."""
    hall = Hall(tmp_path, robots=1)
    hall.plan("A", recurrence="FREQ=MINUTELY;INTERVAL=5", start_window_minutes=30, respect_working_days=False)
    hall.run(10)
    hall.hold("R1")
    hall.clock.step(840)
    hall.kick()
    hall.run(20)
    row = hall.executions(State.WAITING)[-1]
    hall.container.operator.hold_starts([row.id])
    hall.clock.step(-840)
    hall.kick()
    hall.run(60)
    hall.container.holds.release(1)
    hall.run(500)
    assert sent_at(hall) == [300], outcomes(hall)


@pytest.mark.parametrize("edit", ["off and on", "deleted and undone"])
def test_what_was_kept_back_does_not_stay_where_it_is_edited_before_the_clock_is_right(tmp_path, edit):
    hall = Hall(tmp_path, robots=1)
    hall.container.catalogue.change_settings(poll_interval_seconds=600)
    schedule = hall.plan("A", "2026-11-23T06:10", recurrence=RULE, start_window_minutes=20, respect_working_days=False)
    begin_ahead(hall, HOURS)
    (row,) = hall.executions(State.WAITING)
    hall.container.operator.hold_starts([row.id])
    if edit == "off and on":
        off_and_on(hall, schedule)
        put_right(hall, HOURS)
    else:
        removed = hall.container.catalogue.remove_schedule(schedule.id)
        put_right(hall, HOURS)
        hall.container.catalogue.restore(removed)
    hall.run(300)
    each_start_leaves(hall, 3 * 3600 if edit == "off and on" else 6000)  # then it is skipped, as a person kept it back


# ---------------------------------------------------------------------- the undo of a cancel
@pytest.mark.parametrize("edited", [False, True])
def test_no_start_is_lost_by_the_undo_of_a_cancel(tmp_path, edited):
    """Pressed once the clock is right: what waits again is two days ahead."""
    hall = Hall(tmp_path, robots=1)
    hall.container.catalogue.change_settings(poll_interval_seconds=600)
    schedule = hall.plan("A", "2026-11-23T06:10", recurrence=RULE, start_window_minutes=20, respect_working_days=False)
    begin_ahead(hall)
    (row,) = hall.executions(State.WAITING)
    hall.container.operator.cancel_execution(row.id)
    put_right(hall)
    hall.container.catalogue.wait_again(row.id)
    hall.run(100)
    if edited:
        off_and_on(hall, schedule)
    each_start_leaves(hall)


# ---------------------------------------------------------------------- Run now, moved with the clock
@pytest.mark.parametrize("hours", [0.5, 2, 26])
def test_a_run_now_that_waits_outlives_a_clock_that_was_behind_for_a_moment(site, hours):
    """Set back by mistake and set right 20 s later, all within its window."""
    site.run(10)
    site.container.holds.hold("cleaning", None, 1)
    site.container.operator.run_now(1, site.container.catalogue.missions()[0].id)
    site.run(5)
    site.clock.step(-3600 * hours)
    site.run(20)
    site.clock.step(3600 * hours)
    site.run(60)
    site.container.holds.release(1)
    site.run(60)
    assert len(sent_at(site)) == 1, outcomes(site)


def test_a_run_now_in_doubt_outlives_a_clock_that_was_behind_for_a_moment(site):
    site.run(10)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.container.operator.run_now(1, site.container.catalogue.missions()[0].id)
    site.run(5)
    site.clock.step(-7200)
    site.run(20)
    site.clock.step(7200)
    site.run(300)
    assert len(site.machines["R1"].queue) == 1, outcomes(site)


def test_a_run_now_gets_no_second_window_from_a_clock_that_is_set_back(site):
    """23 minutes after the press, with a window of 15."""
    site.run(10)
    site.container.holds.hold("cleaning", None, 1)
    site.container.operator.run_now(1, site.container.catalogue.missions()[0].id)
    site.run(13 * 60)
    site.clock.step(-7200)
    site.kick()
    site.run(10 * 60)
    site.container.holds.release(1)
    site.run(120)
    assert sent_at(site) == []


# ---------------------------------------------------------------------- start on another robot
def test_of_two_other_robots_one_gets_it_though_a_cancel_is_undone(hall):
    """Started on R2, cancelled there, started on R3; the Undo of that cancel is still on the screen."""
    row = in_doubt_at_a_silent_robot(hall)
    second, third = (hall.robot(name) for name in hall.machines if name != row.robot)
    hall.hold(second.name)
    new = hall.container.operator.start_on_another(row.id, second.id)
    hall.run(2)
    hall.container.operator.cancel_execution(new.id)
    hall.container.operator.start_on_another(row.id, third.id)
    hall.run(2)
    with suppress(InvalidInput):  # would be right
        hall.container.catalogue.wait_again(new.id)
    hall.container.holds.release(second.id)
    hall.run(120)
    assert len(hall.items()) == 1


def test_what_the_second_robot_may_have_came_not_to_nothing_because_that_was_removed(hall):
    row = in_doubt_at_a_silent_robot(hall)
    second, third = (hall.robot(name) for name in hall.machines if name != row.robot)
    hall.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    hall.at(0.5, lambda: hall.network.down.add(second.name))
    hall.container.operator.start_on_another(row.id, second.id)
    hall.run(3)
    hall.container.catalogue.remove_robot(second.id)
    hall.run(60)
    with pytest.raises(InvalidInput):
        hall.container.operator.start_on_another(row.id, third.id)


def test_no_alarm_of_two_where_the_second_was_cancelled_before_it_began(hall):
    first = it_is_at_a_robot_that_fell_silent(hall)
    second = hall.robot(next(name for name in hall.machines if name != first))
    hall.stranger_queues(robot=second.name)
    hall.run(5)
    new = hall.container.operator.start_on_another(hall.run_of().id, second.id)
    hall.run(3)
    hall.container.operator.cancel_execution(new.id)
    hall.run(10)
    assert hall.container.ledger.get(new.id).started_at is None
    hall.network.down.clear()
    hall.run(120)
    assert "started_twice" not in hall.alarms()


def test_it_may_be_started_on_a_third_one_whatever_the_history_keeps(hall):
    """The row of the second one is pruned."""
    hall.container.catalogue.change_settings(history_limit=1)
    row = in_doubt_at_a_silent_robot(hall)
    second, third = (hall.robot(name) for name in hall.machines if name != row.robot)
    hall.hold(second.name)
    new = hall.container.operator.start_on_another(row.id, second.id)
    hall.run(2)
    hall.container.operator.cancel_execution(new.id)
    other = hall.container.operator.run_now(third.id, 1)
    hall.run(2)
    hall.container.operator.cancel_execution(other.id)
    hall.run(40)
    assert hall.container.operator.start_on_another(row.id, third.id).robot == third.name


def test_that_both_have_it_is_told_whatever_the_history_keeps(hall):
    hall.container.catalogue.change_settings(history_limit=1)
    first = it_is_at_a_robot_that_fell_silent(hall)
    second, third = (hall.robot(name) for name in hall.machines if name != first)
    hall.container.operator.start_on_another(hall.run_of().id, second.id)
    hall.run(120)
    hall.container.operator.run_now(third.id, 1)
    hall.run(300)
    hall.network.down.clear()
    hall.run(120)
    assert "started_twice" in hall.alarms(), outcomes(hall)


def test_an_undone_cancel_of_it_is_told_where_the_first_robot_had_it_after_all(hall):
    """That was found while it was cancelled, when there was nothing to tell."""
    first = it_is_at_a_robot_that_fell_silent(hall)
    second = hall.robot(next(name for name in hall.machines if name != first))
    hall.hold(second.name)
    new = hall.container.operator.start_on_another(hall.run_of().id, second.id)
    hall.run(2)
    hall.container.operator.cancel_execution(new.id)
    hall.network.down.clear()
    hall.run(5)
    with suppress(InvalidInput):  # would be right
        hall.container.catalogue.wait_again(new.id)
    hall.container.holds.release(second.id)
    hall.run(120)
    assert len(hall.items()) == 1 or "started_twice" in hall.alarms()


# ---------------------------------------------------------------------- skips that are forgotten once something later has begun
@pytest.mark.parametrize("limit", [None, 1])
def test_a_skipped_start_stays_so_where_what_had_begun_after_it_is_taken_back(site, plan, limit):
    """06:05 and 06:15 were refused by a clock a little ahead, 06:10 was skipped; the clock is set back, the schedule switched off, on."""
    site.container.catalogue.change_settings(history_limit=limit, retry_limit=20, poll_interval_seconds=300)
    schedule = plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=5", start_window_minutes=30, overlap=Overlap.QUEUE)
    other = plan("2026-11-23T06:40", "FREQ=DAILY")
    site.run(10)
    skipped = site.container.pausing.skip(schedule.id, datetime(2026, 11, 23, 6, 10, tzinfo=UTC))
    site.container.pausing.skip_next(other.id)
    site.clock.step(560)
    site.network.next("POST", "/mission_queue", Fate.REFUSED, count=16)
    site.run(345)
    site.clock.step(-590)
    site.run(3)
    off_and_on(site, schedule)
    planned = [run.at for run in site.container.plan.between(site.clock.now(), skipped + timedelta(minutes=10)).runs]
    site.run(400)
    assert skipped not in [row.planned_at for row in site.executions() if row.queue_id], "it was sent"
    assert skipped not in planned
