"""A clock that was ahead is set back: what it had planned and nobody had begun is planned anew, each start at its instant, whatever a
person does meanwhile (D4, D5)."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from datetime import UTC, datetime

import pytest

from app.domain.models import InvalidInput, Overlap, State
from tests.support.groups import Hall
from tests.support.network import Fate
from tests.support.seen import alarms, outcomes, sent_at, states

DAY = 86400.0
FAR = 2 * DAY + 900.0
RULE, EVERY = "FREQ=MINUTELY;INTERVAL=30", 1800  # from 06:10 on, 600 s from the beginning


@pytest.fixture(params=["robot", "group"])
def hall(request, tmp_path):
    """``plan_often`` plans for R1, or for a group of it alone."""
    hall = Hall(tmp_path, robots=1)
    where = {"robot_id": 1, "group_id": None} if request.param == "robot" else {}
    hall.plan_often = lambda: hall.plan(
        "A", "2026-11-23T06:10", recurrence=RULE, start_window_minutes=20, respect_working_days=False, **where
    )
    hall.container.catalogue.change_settings(poll_interval_seconds=600)
    yield hall
    hall.switch_off()


def begin_ahead(site, ahead=FAR):
    """The app begins by a clock that is ahead, and no robot can tell."""
    site.run(10)
    site.switch_off()
    site.clock.step(ahead)
    site.network.down |= set(site.machines)
    site.switch_on()
    site.run(45)


def set_right(site, ahead=FAR):
    site.network.down.clear()
    site.clock.step(-ahead)
    site.run(30)


def stored(site, schedule):
    return site.container.repositories.schedules.get(site.container.db.read(), schedule.id)


def each_start_leaves(site, seconds=7200):
    begun = site.seconds()
    site.run(seconds)
    wanted = [at for at in range(600, int(begun + seconds), EVERY) if at > begun]
    assert [at for at in sent_at(site) if at > begun] == wanted, outcomes(site)[-3:]


def off_and_on(site, schedule):
    for on in (False, True):
        site.container.catalogue.set_schedule_enabled(schedule.id, on)
        site.run(20)


def there_and_back(site, schedule, **changes):
    before = stored(site, schedule)
    site.container.catalogue.save_schedule(replace(before, **changes))
    site.run(20)
    now = stored(site, schedule)
    site.container.catalogue.save_schedule(replace(now, **{name: getattr(before, name) for name in changes}))


def robot_off_and_on(site, _schedule):
    for on in (False, True):
        site.container.catalogue.set_robot_enabled(1, on)
        site.run(20)


def pause_and_resume(site, schedule):
    site.container.pausing.pause(schedule.id, site.clock.now().replace(minute=59))
    site.run(20)
    site.container.pausing.resume(schedule.id)


LATER = datetime(2026, 11, 23, 6, 11)
CHANGES = {
    "nothing": lambda site, schedule: None,
    "off and on": off_and_on,
    "robot off and on": robot_off_and_on,
    "pause and resume": pause_and_resume,
    "moved and back": lambda site, schedule: there_and_back(site, schedule, start=LATER),
    "another rule and back": lambda site, schedule: there_and_back(
        site, schedule, recurrence="FREQ=MINUTELY;INTERVAL=7"
    ),
}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("ahead", [FAR, 7800.0])
def test_no_start_is_lost_by_what_a_person_changes_after_it(hall, change, ahead):
    schedule = hall.plan_often()
    begin_ahead(hall, ahead)
    set_right(hall, ahead)
    hall.run(200)
    CHANGES[change](hall, schedule)
    each_start_leaves(hall, 3 * 3600)


def test_no_start_is_lost_by_an_undo_after_it(hall):
    schedule = hall.plan_often()
    begin_ahead(hall)
    removed = hall.container.catalogue.remove_schedule(schedule.id)
    set_right(hall)
    hall.container.catalogue.restore(removed)
    each_start_leaves(hall)


@pytest.mark.parametrize("limit", [None, 1])
def test_what_a_person_cancelled_is_the_only_one_that_is_left_out(hall, limit):
    """Also where the history has forgotten that."""
    hall.container.catalogue.change_settings(history_limit=limit)
    schedule = hall.plan_often()
    begin_ahead(hall, 7800.0)
    (row,) = hall.executions(State.WAITING)
    hall.container.operator.cancel_execution(row.id)
    set_right(hall, 7800.0)
    hall.run(4 * 3600)
    missed = (row.planned_at - datetime(2026, 11, 23, 6, tzinfo=UTC)).total_seconds()
    assert sent_at(hall) == [at for at in range(600, int(hall.seconds()), EVERY) if at != missed]
    assert stored(hall, schedule).next_at is not None


def test_what_a_person_kept_back_until_it_was_too_late_is_not_sent(site, plan):
    plan("2026-11-23T06:05", start_window_minutes=1)
    site.run(10)
    site.container.holds.hold("cleaning", None, 1)
    site.clock.step(300)
    site.run(5)
    (row,) = site.executions()
    assert site.container.operator.hold_starts([row.id]) == 1
    site.run(60)
    site.container.holds.release(1)
    site.clock.step(-300)
    site.run(900)
    assert sent_at(site) == []


def test_runs_that_must_not_overlap_do_not(site, plan):
    """The later of two was planned first."""
    plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=10", overlap=Overlap.SKIP, start_window_minutes=20)
    site.run(10)
    site.container.holds.hold("cleaning", None, 1)
    site.clock.step(900)
    site.run(20)
    site.clock.step(-900)
    site.run(5)
    site.container.holds.release(1)
    site.at(266, lambda: site.container.operator.pause(1))
    site.run(1400)
    assert len([state for state in states(site) if state in ("Pending", "Executing")]) == 1
    assert "execution_skipped" in alarms(site)


@pytest.mark.parametrize("changed", [False, True])
@pytest.mark.parametrize("limit", [None, 1])
def test_nothing_is_sent_twice_where_another_one_waited_behind_what_was_sent(tmp_path, limit, changed):
    """The clock is so little ahead that robots agree."""
    hall = Hall(tmp_path, robots=1)
    hall.container.catalogue.change_settings(poll_interval_seconds=300, retry_limit=10, history_limit=limit)
    schedule = hall.plan(
        "A",
        "2026-11-23T06:10",
        recurrence="FREQ=MINUTELY;INTERVAL=2",
        overlap=Overlap.PARALLEL,
        start_window_minutes=20,
    )
    hall.run(10)
    hall.clock.step(570)
    hall.run(15)
    hall.network.next("POST", "/mission_queue", Fate.REFUSED, count=6)
    hall.run(128)
    hall.clock.step(-570)
    hall.run(10)
    if changed:
        off_and_on(hall, schedule)
    hall.run(720)
    assert max(Counter(post.token for post in hall.network.posts()).values()) == 1
    hall.switch_off()


def test_a_run_now_lasts_no_longer_by_it(site, plan):
    begin_ahead(site)
    site.container.holds.hold("cleaning", None, 1)
    site.container.operator.run_now(1, site.container.catalogue.missions()[0].id)
    site.run(5)
    set_right(site)
    site.run(6 * 3600)
    assert [row.state.is_open for row in site.executions()] == [False]
    assert sent_at(site) == []


def test_tries_by_the_wrong_clock_do_not_count(hall):
    hall.container.catalogue.change_settings(retry_limit=3)
    hall.plan_often()
    begin_ahead(hall, 7800.0)
    set_right(hall, 7800.0)
    hall.at(7799 - hall.seconds(), lambda: hall.network.down.add("R1"))
    hall.at(7806 - hall.seconds(), hall.network.down.clear)
    hall.run(9000)
    assert {row.state for row in hall.executions()} == {State.COMPLETED}, outcomes(hall)


def test_what_is_still_to_come_keeps_no_robot_from_its_group(tmp_path):
    hall = Hall(tmp_path, robots=1)
    hall.plan(
        "own",
        "2026-11-23T06:10",
        recurrence="FREQ=DAILY",
        start_window_minutes=20,
        respect_working_days=False,
        robot_id=1,
        group_id=None,
    )
    begin_ahead(hall)
    set_right(hall)
    hall.plan("G", "2026-11-23T06:20", respect_working_days=False)
    hall.run(3600)
    assert sent_at(hall) == [600, 1200]
    hall.switch_off()


def test_an_undone_cancel_waits_beside_nothing_that_is_still_to_come(site, plan):
    plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=10", overlap=Overlap.SKIP, start_window_minutes=20)
    site.run(10)
    site.container.holds.hold("cleaning", None, 1)
    site.clock.step(900)
    site.run(20)
    site.clock.step(-900)
    site.run(285)
    (first,) = (row for row in site.executions() if row.planned_at.minute == 5)
    site.container.operator.cancel_execution(first.id)
    site.container.catalogue.wait_again(first.id)
    site.container.holds.release(1)
    site.run(60)
    assert [row.planned_at.minute for row in site.executions() if row.queue_id] == [5]


def test_one_deletion_is_undone_once(site, plan):
    """By then its start has run, and the history has forgotten it."""
    catalogue = site.container.catalogue
    catalogue.change_settings(history_limit=1)
    schedule = plan("2026-11-23T06:05", start_window_minutes=60)
    plan("2026-11-23T06:08", start_window_minutes=60)
    site.container.holds.hold("cleaning", None, 1)
    site.run(310)
    removed = catalogue.remove_schedule(schedule.id)
    catalogue.restore(removed)
    site.container.holds.release(1)
    site.run(900)
    catalogue.remove_schedule(schedule.id)
    with pytest.raises(InvalidInput):
        catalogue.restore(removed)
    site.run(60)
    assert max(Counter(post.token for post in site.network.posts()).values()) == 1


@pytest.mark.parametrize("limit", [None, 1])
@pytest.mark.parametrize("edit", ["off", "rule"])
def test_what_has_run_is_not_sent_again_where_one_after_it_was_refused(site, plan, limit, edit):
    """Nine minutes ahead 06:10 runs and 06:15 is refused; the history forgets 06:10; the clock is set back, and the schedule edited."""
    site.container.catalogue.change_settings(history_limit=limit, retry_limit=20, poll_interval_seconds=300)
    schedule = plan("2026-11-23T06:10", "FREQ=MINUTELY;INTERVAL=5", start_window_minutes=30, overlap=Overlap.QUEUE)
    site.run(10)
    plan("2026-11-23T06:12", "FREQ=DAILY")
    site.clock.step(560)
    site.run(260)
    site.network.next("POST", "/mission_queue", Fate.REFUSED, count=4)
    site.run(85)
    site.clock.step(-590)
    site.run(3)
    if edit == "off":
        off_and_on(site, schedule)
    else:
        there_and_back(site, schedule, recurrence="FREQ=MINUTELY;INTERVAL=7")
    site.run(400)
    items = Counter(item.description for machine in site.machines.values() for item in machine.queue)
    assert max(items.values()) == 1, outcomes(site)
