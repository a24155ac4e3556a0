"""Undoing that a waiting start was cancelled: it runs once, as if it had never been cancelled, or a sentence says why it can't any more."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import InvalidInput, Overlap, Schedule, State, Trigger
from app.services.catalogue.undo import may_wait_again
from tests.support.groups import Hall
from tests.support.network import Fate


def cancelled(site):
    """The start that waits for a charge, cancelled a moment ago."""
    [row] = [row for row in site.executions() if row.state is State.WAITING]
    return site.container.operator.cancel_execution(row.id)


@pytest.fixture
def waiting(site, plan) -> Schedule:
    site.machines["R1"].set_battery(12.0)
    schedule = plan("2026-11-23T06:05", "FREQ=DAILY", minimum_battery_percent=30, start_window_minutes=20)
    site.run(310)
    return schedule


def refusal(site, row) -> str:
    with pytest.raises(InvalidInput) as refused:
        site.container.catalogue.wait_again(row.id)
    return refused.value.msgid


def test_what_is_wanted_after_all_runs_once(site, waiting):
    row = cancelled(site)
    assert may_wait_again(row)
    site.run(3)
    site.container.catalogue.wait_again(row.id)
    again = site.container.repositories.executions.get(site.container.db.read(), row.id)
    assert (again.state, again.reason, again.ended_at, again.token) == (State.WAITING, None, None, row.token)
    site.machines["R1"].set_battery(80.0)
    site.run(600)
    assert [run.state for run in site.executions()] == [State.COMPLETED]
    assert len(list(site.machines["R1"].queue)) == 1
    assert refusal(site, row) == "this start does not wait any more, and can't again"  # pressed twice
    assert len(list(site.machines["R1"].queue)) == 1


def test_nothing_of_it_is_sent_while_it_is_cancelled(site, waiting):
    cancelled(site)
    site.machines["R1"].set_battery(80.0)
    site.run(600)
    assert list(site.machines["R1"].queue) == []


def test_it_is_also_wanted_again_after_the_app_was_started_anew(site, waiting):
    row = cancelled(site)
    site.container.catalogue.wait_again(row.id)
    site.switch_off(cleanly=False)
    site.switch_on()
    site.machines["R1"].set_battery(80.0)
    site.run(600)
    assert [run.state for run in site.executions()] == [State.COMPLETED]
    assert len(list(site.machines["R1"].queue)) == 1


def test_what_may_have_been_sent_ever_stays_cancelled(site, plan):
    site.network.next("POST", "/mission_queue", Fate.REFUSED)
    plan("2026-11-23T06:05", start_window_minutes=20)
    site.run(301)
    row = cancelled(site)
    assert row.attempts
    assert not may_wait_again(row)
    assert refusal(site, row) == "this start does not wait any more, and can't again"


def change(site, schedule, **values) -> None:
    stored = next(each for each in site.container.catalogue.schedules() if each.id == schedule.id)
    site.container.catalogue.save_schedule(replace(stored, **values))


SINCE, NO_SCHEDULE = "its schedule has been changed since", "there is no such schedule any more"
MEANWHILE = {
    "too late": (lambda site, schedule: site.run(1200), "it is too late for this start"),
    "schedule moved": (lambda site, schedule: change(site, schedule, start=schedule.start.replace(hour=9)), SINCE),
    "schedule off": (lambda site, schedule: site.container.catalogue.set_schedule_enabled(schedule.id, False), SINCE),
    "schedule paused": (
        lambda site, schedule: site.container.pausing.pause(schedule.id, site.clock.now().replace(hour=23)),
        SINCE,
    ),
    "schedule deleted": (lambda site, schedule: site.container.catalogue.remove_schedule(schedule.id), NO_SCHEDULE),
    "robot off": (
        lambda site, schedule: site.container.catalogue.set_robot_enabled(schedule.robot_id, False),
        "{robot} is switched off in Settings",
    ),
    "robot deleted": (
        lambda site, schedule: site.container.catalogue.remove_robot(schedule.robot_id),
        "there is no such robot any more",
    ),
}


@pytest.mark.parametrize("meanwhile", MEANWHILE)
def test_what_would_have_ended_it_meanwhile_keeps_it_ended(site, waiting, meanwhile):
    row, (happens, why) = cancelled(site), MEANWHILE[meanwhile]
    site.run(1)
    happens(site, waiting)
    assert refusal(site, row) == why
    site.machines["R1"].set_battery(80.0)
    site.run(600)
    assert list(site.machines["R1"].queue) == []


@pytest.mark.parametrize(
    ("overlap", "states"),
    [(Overlap.SKIP, [State.CANCELLED, State.WAITING]), (Overlap.QUEUE, [State.WAITING, State.WAITING])],
)
def test_a_next_start_that_would_have_been_left_out_because_of_it_takes_its_place(site, plan, overlap, states):
    site.machines["R1"].set_battery(12.0)
    plan(
        "2026-11-23T06:05",
        "FREQ=MINUTELY;INTERVAL=5",
        minimum_battery_percent=30,
        start_window_minutes=20,
        overlap=overlap,
    )
    site.run(310)
    row = cancelled(site)
    site.run(300)
    if overlap is Overlap.SKIP:
        assert refusal(site, row) == "the next start of its schedule is there already"
    else:
        site.container.catalogue.wait_again(row.id)
    assert [run.state for run in sorted(site.executions(), key=lambda run: run.planned_at)] == states


def test_of_a_group_any_robot_gets_it_again(tmp_path):
    hall = Hall(tmp_path)
    try:
        for name in hall.machines:
            for _n in range(5):
                hall.stranger_queues(robot=name)
        hall.plan("A", start_window_minutes=30)
        hall.run(310)
        row = hall.container.operator.cancel_execution(hall.run_of().id)
        hall.run(2)
        hall.container.catalogue.wait_again(row.id)
        hall.run(5)
        assert (hall.run_of().state, hall.run_of().robot_id) == (State.WAITING, None)
        hall.run(1500)
        assert hall.run_of().state is State.COMPLETED
    finally:
        hall.switch_off()


def test_idle_starts_are_wanted_anew_by_idleness_itself(site, waiting):
    assert not may_wait_again(replace(cancelled(site), trigger=Trigger.IDLE))
