"""Faults without another test: rows of the fault matrix in docs/reliability.md."""

from __future__ import annotations

import itertools
import sqlite3
import threading

import pytest

from app.database.connection import Database
from app.domain.models import ReasonCode, State
from mir_sim.mission_queue import MissionQueue
from tests.support.network import Fate


def items(site):
    return list(site.machines["R1"].queue)


def robot_of(site):
    return site.container.repositories.robots.all(site.container.db.read())[0]


def alarms(site):
    return [alarm.code for alarm in site.container.alarms.open()]


# ---------------------------------------------------------------- copies and strangers in the queue
def test_a_copy_that_runs_already_is_left_alone_and_alarmed(site, plan):
    """Cancelling it would stop a robot in the middle of something; a person decides."""
    plan("2026-11-23T06:05")
    site.run_until(lambda: site.executions(State.COMPLETED))
    [run] = site.executions()
    copy = site.container.make_client(robot_of(site)).enqueue(run.mission_guid, description=run.token)
    site.run(35)
    assert alarms(site) == ["duplicate_running"]
    assert {item.id: str(item.state) for item in items(site)} == {run.queue_id: "Done", copy: "Executing"}


@pytest.mark.parametrize("description", ["", "7c9e6679-7425-40de-944b-e07fc1f90ae7", "Kuljeta"])
def test_the_same_mission_put_there_by_somebody_else_is_not_taken_for_ours(site, plan, description):
    """Even while the app's own submission is in doubt: on a robot that returns tokens, only the token counts."""
    plan("2026-11-23T06:02", name="first")
    site.run_until(lambda: site.executions(State.COMPLETED))
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306 - site.seconds())
    client, [first, intent] = site.container.make_client(robot_of(site)), site.executions()
    theirs = client.enqueue(intent.mission_guid, description=description)
    site.run(900)
    run = site.executions()[-1]
    assert run.state is State.COMPLETED
    assert run.queue_id != theirs
    assert sorted(item.id for item in items(site)) == sorted([first.queue_id, theirs, run.queue_id])


def test_while_it_is_not_known_whether_tokens_come_back_what_may_be_ours_is_taken_for_it(site, plan):
    """Rather that than sent twice; an alarm says so."""
    site.network.forgets_descriptions = True
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    client, [intent] = site.container.make_client(robot_of(site)), site.executions()
    theirs = client.enqueue(intent.mission_guid)
    site.run(900)
    [run] = site.executions()
    assert (run.state, run.queue_id) == (State.COMPLETED, theirs)
    assert alarms(site) == ["adopted_unproven"]


@pytest.mark.parametrize("unreadable", ["without a state", "an error"])
def test_where_the_last_item_can_not_be_read_it_is_known_from_before_that_descriptions_are_forgotten(
    site, plan, unreadable
):
    """By that item it is judged whether tokens come back; the start in doubt is another one."""
    site.network.forgets_descriptions = True
    plan("2026-11-23T06:05")
    plan("2026-11-23T06:15")
    site.run(600)
    if unreadable == "an error":
        site.network.unreadable.add(("R1", 1))
    else:
        site.network.shown["R1", 1] = {"state": None}
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(600)
    assert [row.state for row in site.executions()] == [State.COMPLETED, State.COMPLETED]
    assert len(items(site)) == 2


@pytest.mark.parametrize(
    ("fate", "sent"),
    [(Fate.ANSWER_LOST, 1), (Fate.LATE, 1), (Fate.ERROR_AFTER, 1), (Fate.LOST, 2), (Fate.ERROR_BEFORE, 2)],
)
def test_a_robot_that_forgets_descriptions_is_judged_by_mission_user_and_number(site, plan, fate, sent):
    """Found out on the item before; what is another's, or another execution's, is not taken."""
    site.network.forgets_descriptions = True
    plan("2026-11-23T06:02", "FREQ=MINUTELY;INTERVAL=5")
    site.run(200)
    site.network.next("POST", "/mission_queue", fate)
    site.run(780)
    runs = site.executions(State.COMPLETED)
    assert [run.attempts for run in runs] == [1, sent, 1]
    assert sorted(item.id for item in items(site)) == sorted(run.queue_id for run in runs)


def test_after_a_restart_too_a_forgetful_robot_is_known(site, plan):
    site.network.forgets_descriptions = True
    plan("2026-11-23T06:02", "FREQ=MINUTELY;INTERVAL=5")
    site.run(200)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run_until(lambda: site.executions(State.SUBMITTING))
    site.switch_off(cleanly=False)
    site.switch_on()
    site.run(200)
    assert len(items(site)) == 2
    assert [run.attempts for run in site.executions()] == [1, 1]


def test_queue_numbers_that_start_again_are_an_unknown_outcome(site, plan):
    """The robot's database was reset while it was asked: its items are lost, and nothing is sent instead."""
    client = site.container.make_client(robot_of(site))
    mission = site.container.repositories.missions.all(site.container.db.read())[0]
    for _ in range(3):
        client.enqueue(mission.guid)
    client.clear_queue()
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run_until(lambda: len(items(site)) == 4, within=310)
    site.machines["R1"].catch_up()
    site.machines["R1"].queue = MissionQueue()
    site.run(200)
    [run] = site.executions()
    assert (run.state, run.reason.code, run.attempts) == (State.FAILED, ReasonCode.UNKNOWN_OUTCOME, 1)
    assert "unknown_outcome" in alarms(site)
    assert items(site) == []


def test_a_robot_that_reboots_in_the_middle_gets_nothing_twice(site, plan):
    plan("2026-11-23T06:05")
    site.run_until(lambda: site.executions(State.EXECUTING))
    site.machines["R1"].reboot(40.0)
    site.run(1200)
    [run] = site.executions()
    assert not run.state.is_open
    assert len(items(site)) == 1


# ---------------------------------------------------------------- changed in the last moment
def _switch_off(site, schedule):
    site.container.catalogue.set_schedule_enabled(schedule.id, False)


def _delete(site, schedule):
    site.container.catalogue.remove_schedule(schedule.id)


def _cancel(site, schedule):
    site.container.operator.cancel_execution(site.executions()[0].id)


def _take_the_robot_away(site, schedule):
    site.container.catalogue.remove_robot(schedule.robot_id)


@pytest.mark.parametrize("change", [_switch_off, _delete, _cancel, _take_the_robot_away])
def test_what_is_taken_back_between_falling_due_and_the_post_is_not_sent(site, plan, change):
    """The robot has just been asked for its status; the intent is written only if the row still waits."""
    schedule = plan("2026-11-23T06:05", minimum_battery_percent=20)
    site.run(295)
    site.network.next("GET", "/status", Fate.REFUSED)  # it could not be read ahead
    asked = itertools.count()

    def meanwhile(where: str) -> None:
        if where == "after GET /status" and site.executions(State.WAITING) and next(asked) == 0:
            change(site, schedule)

    site.network.interrupt = meanwhile
    site.run(300)
    assert next(asked) == 1
    assert items(site) == []
    [run] = site.executions()
    assert run.state is State.CANCELLED
    assert run.attempts == 0


# ---------------------------------------------------------------- the store
def test_a_database_that_somebody_holds_for_a_moment_is_waited_for(tmp_path):
    """A virus scanner, a copy: the writer waits, and what it was given is written."""
    path = tmp_path / "amr-scheduler.db"
    db = Database.open(path)
    other = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
    other.execute("BEGIN IMMEDIATE")
    began = threading.Event()

    def let_go() -> None:
        began.wait(10)
        other.execute("ROLLBACK")

    thread = threading.Thread(target=let_go)
    thread.start()
    writing = threading.Thread(target=lambda: db.write(lambda c: c.execute("INSERT INTO settings VALUES ('x', '1')")))
    writing.start()
    began.set()
    writing.join(20)
    thread.join(20)
    assert db.read().execute("SELECT value FROM settings WHERE name = 'x'").fetchone()[0] == "1"
    other.close()
    db.close()


# ---------------------------------------------------------------- idle automation
def test_idle_automation_goes_on_when_the_robot_s_queue_numbers_start_again(site):
    """Its last number lies above all that the robot will have for long; it is asked whether it still knows it."""
    container, robot = site.container, robot_of(site)
    container.catalogue.save_idle_rule(
        robot.id, container.repositories.missions.all(container.db.read())[0].id, after_minutes=5
    )
    client = container.make_client(robot)
    for _ in range(5):
        client.enqueue(site.container.repositories.missions.all(container.db.read())[0].guid)
    client.clear_queue()
    site.run(1200)
    [first] = site.executions(State.COMPLETED)
    assert first.queue_id > 5
    site.machines["R1"].queue = MissionQueue()
    site.run(1200)
    assert [run.queue_id for run in site.executions(State.COMPLETED)] == [first.queue_id, 1]
