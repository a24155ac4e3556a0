"""The thesis's own test scenarios (section 6.2), end to end under a virtual clock: real services, simulated robot."""

from __future__ import annotations

from datetime import timedelta

from app.domain.models import ReasonCode, State, Trigger
from app.domain.reasons import sentence
from mir_sim.mission_queue import ItemState
from tests.support.network import Fate


def robot_items(site):
    return list(site.machines["R1"].queue)


def test_manual_run_is_submitted_executed_and_recorded(site):
    container = site.container
    robot = container.repositories.robots.by_name(container.db.read(), "R1")
    mission = container.repositories.missions.all(container.db.read())[0]
    container.operator.run_now(robot.id, mission.id)
    site.kick()
    site.run_until(lambda: site.executions(State.COMPLETED))
    [run] = site.executions()
    assert run.trigger is Trigger.MANUAL
    assert (run.robot, run.mission, run.attempts) == ("R1", "Deliver", 1)
    assert run.planned_at <= run.submitted_at <= run.started_at <= run.ended_at
    assert run.duration_s > 0
    [item] = robot_items(site)
    assert (item.id, item.description) == (run.queue_id, run.token)


def test_a_one_time_mission_runs_at_its_time_and_only_then(site, plan):
    schedule = plan("2026-11-23T06:05")
    site.run(299)
    assert site.executions() == []
    site.run(3)
    [run] = site.executions()
    assert run.trigger is Trigger.SCHEDULED
    assert run.submitted_at - run.planned_at < timedelta(seconds=1)  # at once, not at the next poll
    site.run_until(lambda: site.executions(State.COMPLETED))
    site.run(2 * 3600)
    assert len(site.executions()) == len(robot_items(site)) == 1
    assert site.container.repositories.schedules.get(site.container.db.read(), schedule.id).next_at is None


def test_recurring_missions_run_at_each_interval_and_the_next_entry_follows(site, plan):
    site.keep_charged()
    site.container.catalogue.change_settings(
        poll_interval_seconds=1800
    )  # a week in seconds; dispatch does not wait for polls
    plan("2026-11-23T06:05", "FREQ=DAILY", name="daily")
    plan("2026-11-23T07:00", "FREQ=WEEKLY;BYDAY=MO,WE", name="weekly")
    site.run(8 * 86400)
    days = {"daily": [], "weekly": []}
    for run in site.executions(State.COMPLETED):
        days[run.schedule].append(run.planned_at.strftime("%a"))
    assert days["daily"] == ["Mon", "Tue", "Wed", "Thu", "Fri", "Mon"]  # working days only
    assert days["weekly"] == ["Mon", "Wed", "Mon"]
    assert len(robot_items(site)) == 9
    nexts = [
        s.next_at.strftime("%a %H:%M") for s in site.container.repositories.schedules.all(site.container.db.read())
    ]
    assert nexts == ["Tue 06:05", "Wed 07:00"]


def test_a_communication_failure_is_retried_until_the_robot_answers(site, plan):
    plan("2026-11-23T06:05")
    site.run(290)
    site.network.down.add("R1")
    site.at(30, lambda: site.network.down.discard("R1"))
    site.run_until(lambda: site.executions(State.COMPLETED))
    [run] = site.executions()
    assert run.attempts > 1
    assert len(robot_items(site)) == 1


def test_the_retry_limit_ends_it_as_failed_and_recorded(site, plan):
    container = site.container
    container.catalogue.change_settings(retry_limit=3, poll_interval_seconds=600)
    plan("2026-11-23T06:05", "FREQ=DAILY")
    site.keep_charged()
    site.network.down.add("R1")
    site.run(420)
    [run] = site.executions()
    assert (run.state, run.reason.code, run.attempts) == (State.FAILED, ReasonCode.RETRY_LIMIT, 4)
    assert run.ended_at - run.planned_at < timedelta(minutes=2)
    assert robot_items(site) == []
    site.network.down.clear()
    site.run(86400)
    assert [r.state for r in site.executions()] == [State.FAILED, State.COMPLETED]  # the next occurrence is untouched


def test_a_failing_mission_is_recorded_with_the_robots_message(site, plan):
    plan("2026-11-23T06:05")
    site.machines["R1"].fail_next = "Failed to reach goal position 'Dock 3'"
    site.run_until(lambda: site.executions(State.FAILED))
    [run] = site.executions()
    assert run.reason.code is ReasonCode.ROBOT_ABORTED
    assert "Dock 3" in run.reason.details["message"]


def test_what_the_app_called_it_is_not_taken_for_the_robots_message(site, plan):
    """The robot writes none, so that the message is what was sent."""
    plan("2026-11-23T06:05", name="SE214 50 %")
    site.run_until(lambda: site.executions(State.EXECUTING))
    site.machines["R1"].controller.end(ItemState.ABORTED, "SE214 50 %")
    site.run_until(lambda: site.executions(State.FAILED))
    [run] = site.executions()
    assert sentence(run.reason, "UTC") == "The robot ended it without saying why"


def test_manual_cancellation_of_a_scheduled_mission(site, plan):
    plan("2026-11-23T06:05")
    site.run_until(lambda: site.executions(State.EXECUTING))
    site.container.operator.cancel_execution(site.executions()[0].id)
    site.kick()
    site.run_until(lambda: site.executions(State.CANCELLED), within=60)
    [run] = site.executions()
    assert run.reason.code is ReasonCode.USER_CANCELLED
    [item] = robot_items(site)
    assert str(item.state) == "Aborted"


def test_idle_automation_starts_its_mission_once_after_the_set_time(site):
    container = site.container
    home = site.add_mission("Home")
    robot = container.repositories.robots.by_name(container.db.read(), "R1")
    container.catalogue.save_idle_rule(robot.id, home.id, after_minutes=10)
    site.run(590)
    assert site.executions() == []
    site.run(60)
    site.run_until(lambda: site.executions(State.COMPLETED))
    [run] = site.executions()
    assert (run.trigger, run.mission) == (Trigger.IDLE, "Home")
    site.run(3600)
    assert len(site.executions()) == 1  # once per idle period
    deliver = next(m for m in container.repositories.missions.all(container.db.read()) if m.name == "Deliver")
    container.operator.run_now(robot.id, deliver.id)  # anything else ends the period
    site.kick()
    site.run(3600)
    assert [r.trigger for r in site.executions()] == [Trigger.IDLE, Trigger.MANUAL, Trigger.IDLE]


def test_a_lost_answer_does_not_run_the_mission_twice(site, plan):
    """The thesis's retry would have doubled this one."""
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.network.only = lambda method, path: False
    site.run(600)
    [run] = site.executions()
    assert run.state is State.COMPLETED
    assert len(robot_items(site)) == 1
