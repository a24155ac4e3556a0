"""What the judge holds against the app, and what not: a second copy that runs, where it could have been cancelled; a request that lands
too late to be noticed; what the robot has after its queue was reset; a late start that was not listed first, unless a person let it go; a
restored start that waits, unless a robot can't say whether it has it; a start of an absence that has a row of its own, unless a person
cancelled it."""

from __future__ import annotations

from contextlib import ExitStack
from datetime import timedelta

import pytest

from app.domain.execution import State, Wait
from app.domain.models import Schedule
from mir_sim.mission_queue import ItemState
from tests.simulation.diary import KEPT_S, Restore
from tests.simulation.mutants import twice
from tests.simulation.mutants.mutant import DUPLICATES, Patch, planted
from tests.simulation.profile import Profile
from tests.simulation.world import START, World
from tests.support.network import QUEUE, Fate

LANDS_AFTER = 300.0  # s after the request left: the start has been sent again by then, and has run
WAITS_FOR = 200.0  # s for which the robot is paused then
STILL = Profile(acts_per_hour=0, events_per_hour=0, fault_rate=0.0, crash_rate=0.0)
PLACE = {"robots": 1, "every_minutes": 20, "poll_interval": 30, "quiet_s": 90, "fleet": "normal", "history_limit": None}
NOT_CORRECTED = Patch(
    "a late item corrects no row", f"{DUPLICATES}._late_item", "self._reopen(row, item)", "return True"
)
LEFT_ALONE = next(mutant for mutant in twice.MUTANTS if mutant.name == "a second copy that waits is left alone")


@pytest.fixture
def quiet(tmp_path):
    """Make a world in which nothing happens by itself."""
    with ExitStack() as made:

        def make(seed=1, profile=STILL, **place):
            world = World(tmp_path, seed, profile.only(site=PLACE | place))
            made.callback(lambda: world.site.container.db.close())
            return world

        yield make


# ---------------------------------------------------------------------- a second copy
@pytest.fixture
def world(quiet):
    """A second copy of the first start is about to come to its robot, which is paused."""
    world = quiet()
    world.site.network.next("POST", QUEUE, Fate.LATE, LANDS_AFTER)
    world.site.run_until(lambda: world.site.network.submissions, within=120)
    world.site.run(LANDS_AFTER - 10.0)
    assert [item.state for item in robot(world).queue] == [ItemState.DONE]
    robot(world).pause()
    return world


def robot(world):
    machine = world.site.machines["R1"]
    machine.catch_up()
    return machine


def let_it_run(world):
    robot(world).resume()
    world.site.run(30.0)
    assert [item.state for item in robot(world).queue] == [ItemState.DONE, ItemState.DONE]


def wait_while_the_app_is_off(world, seconds=WAITS_FOR):
    trouble = world.diary.begin("app", None, world.site.seconds())
    world.is_on = False
    world.site.power_cut(seconds)
    world.is_on = True
    trouble.end = world.site.seconds() + 5.0


def objections(world):
    world.judge.now_and_then()
    return world.findings.violations


def test_a_copy_that_waits_while_nothing_is_wrong_has_to_be_cancelled(world):
    with planted(LEFT_ALONE):
        world.site.run(WAITS_FOR)
        let_it_run(world)
    (objection,) = objections(world)
    assert "a second copy ran after it had waited" in objection


def test_a_copy_that_waits_while_the_app_is_off_may_run(world):
    wait_while_the_app_is_off(world)
    let_it_run(world)
    assert objections(world) == []


@pytest.mark.long
def test_a_copy_may_have_run_in_downtime_that_the_diary_forgot(world):
    wait_while_the_app_is_off(world)
    let_it_run(world)
    world.site.run(KEPT_S)
    world.diary.forget(world.site.seconds())
    assert objections(world) == []


def test_a_copy_may_have_run_by_any_clock_of_its_robot(world):
    wait_while_the_app_is_off(world)
    let_it_run(world)
    world.diary.begin("robot's clock", "R1", world.site.seconds())
    robot(world).clock.offset += 3600.0
    world.site.run(1.0)
    assert objections(world) == []


def test_a_copy_of_what_a_restored_backup_does_not_know_may_run(world):
    now = world.site.clock.now()
    world.diary.restores.append(Restore(world.site.seconds(), now - timedelta(hours=1), now))
    with planted(LEFT_ALONE):
        world.site.run(WAITS_FOR)
        let_it_run(world)
    assert objections(world) == []


# ---------------------------------------------------------------------- a request that comes too late
def start_whose_request_lands_after(world, seconds, sleeps_for=0.0):
    """No other request of it leaves. The app is started again: one that slept looks for it for longer by its own clock."""
    world.site.network.next("POST", QUEUE, Fate.LATE, seconds)
    world.site.network.next("POST", QUEUE, Fate.REFUSED, count=99)
    world.site.run_until(lambda: world.site.network.submissions, within=120)
    world.site.run(120.0)
    world.site.suspend(sleeps_for)
    world.site.power_cut(1.0)
    world.site.run(1200.0 - sleeps_for)
    assert [item.state for item in robot(world).queue] == [ItemState.DONE]
    assert world.site.the_row().state is State.FAILED
    world.judge.all_is_well(660.0)


@pytest.mark.parametrize(("seconds", "sleeps_for"), [(1100.0, 0.0), (600.0, 500.0)])
def test_a_request_that_lands_when_it_is_no_longer_looked_for_may_run_unseen(quiet, seconds, sleeps_for):
    world = quiet(every_minutes=60)
    start_whose_request_lands_after(world, seconds, sleeps_for)
    assert objections(world) == []


def test_a_request_that_lands_while_it_is_looked_for_has_to_be_noticed(quiet):
    world = quiet(every_minutes=60)
    with planted(NOT_CORRECTED):
        start_whose_request_lands_after(world, 500.0)
    assert any("is failed (window_closed), the robot says" in each for each in objections(world))


def test_a_queue_that_was_reset_can_be_read_though_an_item_before_could_not(quiet):
    """Its numbers begin again."""
    world = quiet()
    world.site.run_until(lambda: robot(world).queue, within=120)
    world.site.network.unreadable.add(("R1", 1))
    world.weather.queue_is_reset()
    world.site.run(1400.0 - world.site.seconds())
    *_, row = sorted(world.site.executions(), key=lambda row: row.planned_at)
    assert (row.state, row.queue_id, len(robot(world).queue)) == (State.COMPLETED, 1, 1)
    world.judge.all_is_well(660.0)
    assert objections(world) == []


# ---------------------------------------------------------------------- a late start
def test_a_late_start_that_a_person_lets_go_need_not_stay_on_the_list(quiet):
    world = quiet(with_window=True)
    world.site.run(30.0)
    world.site.power_cut(WAITS_FOR)
    world.judge.came_back(away_since=30.0)
    world.site.run(5.0)
    (row,) = world.site.executions()
    assert row.wait is Wait.LATE_START
    for held in (True, False):
        assert world.site.container.operator.hold_starts([row.id], held)
        world.diary.decide(world.site.seconds()).held_starts = {row.token} if held else set()
        world.site.run(2.0)
    assert len(world.site.network.submissions) == 1
    assert objections(world) == []


def test_a_start_is_on_time_though_the_clock_was_set_ahead_shortly_before(quiet):
    world = quiet(poll_interval=600)
    world.site.run(700.0)
    world.weather._step(400.0, 5.0)
    world.site.run(300.0)
    assert [round(post.at) for post in world.site.network.submissions] == [60, 21 * 60 - 400]
    assert objections(world) == []


# ---------------------------------------------------------------------- a restored start
@pytest.mark.long
def test_a_restored_start_may_wait_for_a_robot_that_lost_its_queue(quiet):
    world = quiet(with_window=True)
    for _item in range(5):
        world.site.stranger_queues()
    world.site.run_until(lambda: world.site.container.history.open(), within=120)
    world.site.run(30.0)
    robot_id = next(iter(world.diary.names))
    start, deliver = (START + timedelta(minutes=5)).replace(tzinfo=None), next(iter(world.missions))
    world.plan(Schedule("A", robot_id, deliver, start, "UTC", start_window_minutes=60))
    world.person.back_up()
    world.weather.queue_is_reset()
    world.site.run(300.0 - world.site.seconds() - 0.5)
    world._off("restore")
    world.site.run(1100.0 - world.site.seconds())  # until before the next start that the robot would take
    assert [(row.schedule, row.wait) for row in world.site.container.history.open()] == [("A", Wait.ELSEWHERE)]
    world.judge.all_is_well(660.0)
    assert objections(world) == []
    world.diary.lost_items.clear()
    world.judge.all_is_well(660.0)
    assert any("liveness: open for" in each for each in world.findings.violations)


# ---------------------------------------------------------------------- an absence
@pytest.fixture
def absent(quiet):
    """By a clock that is ahead the next start is missed and the one after it waits, as its robot is out of reach."""
    world = quiet(every_minutes=5)
    world.site.run(130.0)
    world.site.network.down.add("R1")
    world.site.clock.step(600.0)
    world.site.run(90.0)
    return world


def away_after_the_clock_was_set_back(world):
    """For hours, in which both fall due."""
    world.site.clock.step(-600.0)
    world.site.network.down.clear()
    world.site.run(40.0)
    wait_while_the_app_is_off(world, 3 * 3600.0)
    world.site.run(10.0)
    world.judge.truth._judge_absences(world.site.executions())


def test_a_cancelled_start_has_its_own_row_and_is_not_counted_as_missed(absent):
    absent.person.cancel()
    away_after_the_clock_was_set_back(absent)
    assert (absent.findings.absences, absent.findings.violations) == (1, [])


def test_a_start_due_before_an_absence_and_once_more_in_it_needs_no_list(quiet):
    """It waited already, and a clock that was set back by the time of the absence does not show one."""
    world = quiet(with_window=True)
    world.site.network.down.add("R1")
    world.site.run(130.0)
    world.weather._step(-WAITS_FOR, 5.0)
    left_at = world.site.seconds()
    wait_while_the_app_is_off(world)
    world.judge.came_back(left_at)
    world.site.network.down.clear()
    world.site.run_until(lambda: world.site.network.submissions, within=60)
    assert objections(world) == []


def test_a_start_due_in_an_absence_and_once_more_after_it_is_not_late(quiet):
    world = quiet(with_window=True)
    left_at = world.site.seconds()
    wait_while_the_app_is_off(world)
    world.weather._step(50.0 - WAITS_FOR, 5.0)
    world.judge.came_back(left_at)
    world.site.run_until(lambda: world.site.network.submissions, within=300)
    assert objections(world) == []


def test_a_start_that_the_clock_is_set_past_after_an_absence_is_not_late(quiet):
    """By the clock as it is then it was due in the absence."""
    world = quiet(with_window=True)
    world.site.run(1250.0 - WAITS_FOR)
    left_at = world.site.seconds()
    wait_while_the_app_is_off(world)
    world.judge.came_back(left_at)
    world.site.run(3.0)
    world.weather._step(15.0, 5.0)
    world.site.run_until(lambda: len(world.site.network.submissions) == 2, within=60)
    assert objections(world) == []


def test_a_start_due_before_a_day_was_closed_runs_on_it_though_the_clock_went_back(quiet):
    """By the clock that was set back it falls due after the day was closed."""
    world = quiet(with_window=False)
    world.site.network.down.add("R1")
    world.site.run(130.0)
    world.person.do("day_off")
    world.weather._step(-100.0, 5.0)
    wait_while_the_app_is_off(world)
    world.site.network.down.clear()
    world.site.run_until(lambda: world.site.network.submissions, within=60)
    assert objections(world) == []


def test_a_start_that_a_pause_ended_may_run_once_the_clock_was_set_back(quiet):
    world = quiet(with_window=False)
    world.site.network.down.add("R1")
    world.site.run(130.0)
    world.person._plan = lambda: next(plan for plan in world.diary.now.whole.values() if "MINUTELY" in plan.recurrence)
    world.person.do("pause")
    assert world.diary.now.stopped
    world.person.do("resume")
    world.weather._step(-100.0, 5.0)
    world.site.network.down.clear()
    world.site.run_until(lambda: world.site.network.submissions, within=300)
    assert objections(world) == []


def test_a_start_that_had_passed_when_planned_runs_once_the_clock_was_set_back(quiet):
    """That its robot was switched off did not stop it: it was no start yet."""
    world = quiet(with_window=False)
    world.site.run(400.0)
    (plan,) = [each for each in world.diary.now.plans.values() if each.recurrence == "FREQ=MINUTELY;INTERVAL=20"]
    world.person._edit(plan, start=plan.start + timedelta(minutes=2))
    world.person.do("switch_robot")
    world.site.run(410.0)
    count = len(world.site.network.submissions)
    world.weather._step(-800.0, 5.0)
    world.site.run_until(lambda: len(world.site.network.submissions) > count, within=600)
    assert objections(world) == []


def test_a_start_falls_due_when_the_clock_is_set_past_it_and_when_it_shows_that_time(absent):
    absent.diary.clock[:] = [(0.0, 0.0), (100.0, 300.0), (200.0, -50.0)]
    shown = [list(absent.judge._times_shown(START + timedelta(seconds=at))) for at in (50, 250, 450)]
    assert shown == [[50.0], [100.0, 300.0], [150.0, 500.0]]


@pytest.mark.long
def test_a_start_for_a_group_missed_before_the_clock_was_set_back_need_not_run(quiet):
    world = quiet(3, STILL.with_groups(), robots=3, with_window=False)
    world.site.run(30.0)
    wait_while_the_app_is_off(world, 1200.0)
    world.judge.came_back(30.0)
    world.site.run(20.0)
    world.weather._step(-500.0, 5.0)
    for _ in range(8):
        world.site.run(300.0)
        world.judge.all_is_well(300.0)
    assert objections(world) == []


def test_a_missed_start_with_a_row_that_no_person_caused_is_an_error(absent):
    (row,) = absent.site.container.history.open()
    absent.site.container.operator.cancel_execution(row.id)  # not in the diary
    away_after_the_clock_was_set_back(absent)
    assert any(f"{row.token[:8]} is skipped (hold), and" in each for each in absent.findings.violations)
