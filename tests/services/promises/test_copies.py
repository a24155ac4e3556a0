"""Of several items with one token exactly one runs, and a row says what its item says, however late that is known (D8)."""

from __future__ import annotations

import pytest

from app.domain.models import Connection, ReasonCode, State
from app.mir.client import RobotClient
from mir_sim.mission_queue import MissionQueue
from tests.support.network import Fate
from tests.support.seen import alarms, items, outcomes, reason, robot_of, sent_at, states


# ---------------------------------------------------------------------- two items of one start
def late_first(site, plan, arrives=130.0):
    """The first request lands long after it was given up and just before the second one, which a hold had delayed."""
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LATE, arrives)
    site.run(385)
    site.container.holds.hold("shift meeting")
    site.run(300 + arrives - 385 + 0.5)
    site.container.holds.release()


def test_the_earlier_item_is_ours_and_a_later_one_that_waits_is_cancelled(site, plan):
    """A request that lands before its second try runs; the second try, which waits behind it, does not."""
    late_first(site, plan)
    site.run(900)
    assert len([state for state in states(site) if state == "Done"]) == 1
    [row] = site.executions()
    assert (row.state, row.queue_id) == (State.COMPLETED, 1)


def test_of_two_items_that_both_wait_the_earlier_one_stays(site, plan):
    """On a robot in pause both wait: the lower number is kept, the other one is cancelled."""
    site.machines["R1"].pause()
    late_first(site, plan)
    site.run(120)
    assert states(site)[0] == "Pending"
    assert states(site).count("Pending") == 1
    site.machines["R1"].resume()
    site.run(600)
    assert states(site)[0] == "Done"
    assert [(row.state, row.queue_id) for row in site.executions()] == [(State.COMPLETED, 1)]


def test_a_first_try_that_lands_behind_the_second_one_is_cancelled_before_it_runs_however_rarely_robots_are_polled(
    site, plan
):
    """A robot with a request that was given up is read again and again, and not only when all robots are polled."""
    site.container.catalogue.change_settings(poll_interval_seconds=600)
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LATE, 110.0)
    site.run(900)
    assert (sent_at(site), states(site)) == ([300, 395], ["Done", "Aborted"])
    assert "duplicate_healed" in alarms(site)


def test_what_was_searched_is_not_searched_again(site, plan, monkeypatch):
    """The history of a robot has thousands of items, and robots are read every 2 s while a request may still arrive."""
    site.container.catalogue.change_settings(poll_interval_seconds=600)
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LATE, 110.0)
    site.run(500)
    search, floors = RobotClient.items_after, []

    def noting(client, floor):
        floors.append(floor)
        return search(client, floor)

    monkeypatch.setattr(RobotClient, "items_after", noting)
    site.run(60)
    assert len(floors) >= 20
    assert set(floors) == {max(item.id for item in items(site))}


def test_a_second_copy_that_has_run_before_anybody_saw_it_is_told_once(site, plan):
    """The robot was idle when it landed, and could not be asked until it had run."""
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LATE, 220.0)
    site.run(300 + 215)
    site.network.down.add("R1")
    site.run(120)
    site.network.down.clear()
    site.run(300)
    assert states(site) == ["Done", "Done"]
    [alarm] = [alarm for alarm in site.container.alarms.open() if alarm.code == "duplicate_running"]
    assert (alarm.count, alarm.details["queue_id"]) == (1, 2)


def test_a_second_copy_is_found_by_the_next_run_of_the_app_too(site, plan):
    """What was given up is looked for after a power cut as before it."""
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LATE, 220.0)
    site.run(300 + 200)
    site.power_cut(5)
    site.run(10)
    site.network.down.add("R1")
    site.run(120)
    site.network.down.clear()
    site.run(300)
    assert states(site) == ["Done", "Done"]
    assert "duplicate_running" in alarms(site)


def test_a_copy_of_what_a_person_cancelled_is_stopped_though_it_runs(site, plan):
    """Its second try was cancelled on the robot, and then the first one lands there and begins at once."""
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LATE, 130.0)
    site.run(300 + 100)
    [row] = site.executions()
    site.container.operator.cancel_execution(row.id)
    site.run(300)
    assert states(site) == ["Aborted", "Aborted"]
    assert outcomes(site) == [(State.CANCELLED, ReasonCode.USER_CANCELLED, 2)]
    assert "late_cancelled" in alarms(site)


@pytest.mark.parametrize("fate", [Fate.LOST, Fate.REFUSED])
def test_a_late_request_that_could_not_be_cancelled_and_ran_is_not_said_to_have_been_cancelled(site, plan, fate):
    """Its schedule is off by then; the robot is idle, so it is executed while the request to cancel it is lost."""
    schedule = plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LATE, 130.0)
    site.run(300 + 20)
    site.container.catalogue.set_schedule_enabled(schedule.id, False)
    site.run(100)
    site.network.next("DELETE", "/mission_queue/1", fate, count=200)
    site.run(300)
    assert states(site) == ["Done"]
    assert outcomes(site) == [(State.COMPLETED, None, 1)]
    assert "late_cancelled" not in alarms(site)


def test_a_second_copy_that_could_not_be_cancelled_at_once_is_cancelled_soon_and_without_reading_the_history(
    site, plan, monkeypatch
):
    """The robot is on screen, so its queue is read between polls, and the network has doubled the request."""
    for _n in range(20):
        site.stranger_queues("Home")
    site.machines["R1"].cancel_all()
    site.container.catalogue.change_settings(poll_interval_seconds=600)
    site.run(10)
    site.engine.watch(1)
    plan("2026-11-23T06:05")
    site.run(296)
    [row] = site.executions()
    for _n in range(5):
        site.stranger_queues("Home")  # so that it waits
    copy = site.container.make_client(robot_of(site)).enqueue(row.mission_guid, description=row.token)
    site.network.next("DELETE", f"/mission_queue/{copy}", Fate.LOST)
    search, floors = RobotClient.items_after, []
    monkeypatch.setattr(
        RobotClient, "items_after", lambda client, floor, *more: floors.append(floor) or search(client, floor, *more)
    )
    site.run(30)
    assert next(str(item.state) for item in items(site) if item.id == copy) == "Aborted"
    assert "duplicate_healed" in alarms(site)
    assert min(floors) >= 20


def test_two_items_of_one_start_of_which_the_second_could_not_be_cancelled_are_told(site, plan):
    """Found when the outcome was looked for; the copy begins before it is met again."""
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(303)
    [row] = site.executions()
    copy = site.container.make_client(robot_of(site)).enqueue(row.mission_guid, description=row.token)
    site.network.next("DELETE", f"/mission_queue/{copy}", Fate.LOST, count=50)
    site.run(400)
    assert states(site) == ["Done", "Done"]
    assert "duplicate_running" in alarms(site)


@pytest.mark.parametrize("gone", [1800.0, 3 * 3600.0])
def test_what_was_given_up_is_searched_for_once_more_however_long_the_robot_was_gone(site, plan, gone):
    """It had the item all the time and comes back long after the search for it has ended."""
    plan("2026-11-23T06:05", start_window_minutes=5)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(300.5)
    site.network.down.add("R1")
    site.run(gone)
    assert outcomes(site) == [(State.FAILED, ReasonCode.UNKNOWN_OUTCOME, 1)]
    site.network.down.clear()
    site.run(120)
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


def test_what_could_not_be_cancelled_after_a_long_absence_is_followed_when_it_runs(site, plan):
    """Too late to run, but the request to cancel it is lost and the robot goes on; its queue is not read again until the next poll."""
    site.container.catalogue.change_settings(poll_interval_seconds=600)
    site.machines["R1"].pause()
    plan("2026-11-23T06:05", start_window_minutes=5)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(300.5)
    site.network.down.add("R1")
    site.run(1800)
    site.network.next("DELETE", "/mission_queue/1", Fate.LOST, count=50)
    site.network.down.clear()
    site.run_until(lambda: len(site.network.planned) < 50, 900)
    site.machines["R1"].resume()
    site.run(900)
    assert states(site) == ["Done"]
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


@pytest.mark.parametrize("away", [900.0, 5 * 3600.0])
def test_what_was_given_up_and_came_while_the_app_was_off_is_found_by_the_next_run(site, plan, away):
    """Its window was long, so that it was planned long before it was sent, and nobody was there while it might still have come."""
    site.container.catalogue.change_settings(history_limit=1)
    plan("2026-11-23T06:05", start_window_minutes=180)
    site.container.holds.hold("cleaning")
    site.run(300 + 10_750)
    site.network.next("POST", "/mission_queue", Fate.LATE, 400.0)
    site.container.holds.release()
    site.run(100)
    assert outcomes(site) == [(State.FAILED, ReasonCode.WINDOW_CLOSED, 1)]
    site.power_cut(away)
    site.run(60)
    assert states(site) == ["Done"]
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


@pytest.fixture
def unsearchable(site, plan):
    """A start that was given up, on a robot whose numbers have begun again since. It is read item by item: a hundred are too many."""
    plan("2026-11-23T06:05", start_window_minutes=5)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(300.5)
    site.network.down.add("R1")
    site.run(900)
    site.machines["R1"].catch_up()
    site.machines["R1"].queue = MissionQueue()
    for _n in range(150):
        site.stranger_queues("Home")
    site.machines["R1"].cancel_all()
    site.network.short_lists = 10
    site.network.down.clear()


def test_a_queue_that_can_not_be_searched_keeps_a_robot_unreadable_for_a_while_only(site, unsearchable):
    site.run(2 * 3600)
    assert site.container.snapshots.get(1).connection is Connection.CONNECTED


def test_what_was_given_up_later_is_found_once_the_search_for_the_older_one_has_ended(site, plan, unsearchable):
    """Both are searched for together; the newer one is within its ten minutes when the hour is over."""
    site.run(3400)
    plan("2026-11-23T07:17", start_window_minutes=1)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(4620.5 - site.seconds())
    site.network.down.add("R1")
    site.run(150)
    site.network.down.clear()
    assert outcomes(site) == [(State.FAILED, ReasonCode.UNKNOWN_OUTCOME, 1)] * 2
    site.run(120)
    assert [row.state for row in site.executions()] == [State.FAILED, State.COMPLETED]


# ---------------------------------------------------------------------- the only item of a row that has ended
def silent(site, plan, how):
    """The row ends in six minutes, while nobody knows that its item is or will be on the robot."""
    plan("2026-11-23T06:05", start_window_minutes=5)
    if how is ReasonCode.UNKNOWN_OUTCOME:  # it has the item, and can't be asked
        site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
        site.run(300.5)
        site.network.down.add("R1")
        site.run(400)
    else:  # it gets the item a minute after the row was given up
        site.container.catalogue.change_settings(unknown_outcome_quiet_seconds=400)
        site.network.next("POST", "/mission_queue", Fate.LATE, 460.0)
        site.run(745)
    assert [code for _state, code, _attempts in outcomes(site)] == [how]


ENDINGS = [ReasonCode.UNKNOWN_OUTCOME, ReasonCode.WINDOW_CLOSED]


@pytest.mark.parametrize("how", ENDINGS)
def test_the_only_item_of_a_row_that_was_given_up_is_cancelled_while_it_waits_and_told_as_what_it_is(site, plan, how):
    """Too late to run, and no second copy of anything: an alarm says that it was cancelled because its time is over."""
    site.machines["R1"].pause()
    silent(site, plan, how)
    site.network.down.clear()
    site.run(120)
    assert states(site) == ["Aborted"]
    assert "duplicate_healed" not in alarms(site)
    assert [alarm.code for alarm in site.container.alarms.open() if alarm.details.get("queue_id") == 1]
    site.machines["R1"].resume()
    site.run(300)
    assert outcomes(site) == [(State.FAILED, how, 1)]


def test_the_only_item_of_a_row_that_was_given_up_corrects_it_once_it_is_known_to_have_run(site, plan):
    """The robot was silent while it ran: when it answers again the row says that it was completed."""
    silent(site, plan, ReasonCode.UNKNOWN_OUTCOME)
    assert states(site) == ["Done"]
    site.network.down.clear()
    site.run(300)
    assert [row.state for row in site.executions()] == [State.COMPLETED]
    assert "duplicate_running" not in alarms(site)


@pytest.mark.parametrize("how", ENDINGS)
def test_the_only_item_of_a_row_that_was_given_up_corrects_it_while_it_runs(site, plan, how):
    """It runs after all, so the row follows it to its end, and no alarm speaks of a second copy."""
    if how is ReasonCode.UNKNOWN_OUTCOME:
        site.machines["R1"].pause()
    silent(site, plan, how)
    assert states(site) == ["Pending"] * (how is ReasonCode.UNKNOWN_OUTCOME)
    site.machines["R1"].resume()
    site.run(30)
    site.network.down.clear()
    site.run(30)
    assert states(site) == ["Executing"]
    assert [row.state for row in site.executions()] == [State.EXECUTING]
    site.run(300)
    assert [row.state for row in site.executions()] == [State.COMPLETED]
    assert "duplicate_running" not in alarms(site)


def test_what_was_taken_back_and_ran_all_the_same_says_so(site, plan):
    """Its request was given up and landed after the quiet time, on a robot that could not be asked until the mission was done."""
    schedule = plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LATE, 130.0)
    site.run(310)
    site.container.catalogue.set_schedule_enabled(schedule.id, False)
    site.run(115)
    assert outcomes(site) == [(State.CANCELLED, ReasonCode.SCHEDULE_CHANGED, 1)]
    site.network.down.add("R1")
    site.run(120)
    site.network.down.clear()
    site.run(120)
    assert states(site) == ["Done"]
    assert [(row.state, row.queue_id) for row in site.executions()] == [(State.COMPLETED, 1)]


def test_a_copy_that_came_while_its_start_waited_is_seen_once_that_has_ended(site, plan):
    """It has run under our token, and nobody sends it again."""
    plan("2026-11-23T06:05", start_window_minutes=5)
    site.network.next("POST", "/mission_queue", Fate.LATE, 120.0)
    site.run(310.0)
    site.container.holds.hold("cleaning")
    site.run(800.0)
    [row] = site.executions()
    assert row.state is State.COMPLETED


def test_what_arrives_late_is_found_though_the_robots_numbers_began_anew_meanwhile(site, plan):
    """The robot's database was set up anew after the start was given up: its request comes as number 1."""
    client = site.container.make_client(robot_of(site))
    mission = site.container.repositories.missions.all(site.container.db.read())[0]
    for _ in range(3):
        client.enqueue(mission.guid)
    client.clear_queue()
    plan("2026-11-23T06:05", start_window_minutes=1)
    site.network.next("POST", "/mission_queue", Fate.LATE, 300.0)
    site.run(420)
    [row] = site.executions()
    assert reason(row).code is ReasonCode.WINDOW_CLOSED
    site.machines["R1"].catch_up()
    site.machines["R1"].queue = MissionQueue()
    site.run(175)
    site.network.down.add("R1")  # it comes, runs and ends while nobody sees it
    site.run(180)
    assert states(site) == ["Done"]
    site.network.down.clear()
    site.run(100)
    assert [row.state for row in site.executions()] == [State.COMPLETED]
