"""What the app does otherwise because a check-up has found out how a robot differs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from app.domain.check_up import Rest, RobotProfile
from app.domain.models import ReasonCode, State
from mir_sim import Profile, deviant
from mir_sim.mission_queue import ItemState
from mir_sim.site import ADMINISTRATOR
from tests.support.expected_findings import checked_up
from tests.support.network import Fate
from tests.support.seen import alarms, items, requests, robot_of
from tests.support.site import USER, Site

START = "2026-11-23T06:05"


@pytest.fixture
def site(request, tmp_path) -> Iterator[Site]:
    """One robot R1 that differs as the test's ``deviant`` says."""
    name = getattr(request, "param", "faithful")
    profile = Profile(timezone="UTC") if name == "faithful" else deviant(name)
    site = Site(tmp_path, profiles={"R1": profile})
    site.add_robots()
    site.add_mission("Deliver")
    site.run(60)
    yield site
    site.switch_off()


def deviants(*names: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("site", names, indirect=True)


def check_up(site: Site, name: str, **values) -> RobotProfile:
    robot = robot_of(site)
    profile = replace(checked_up(name, robot.serial_number, robot.software), **values)
    site.check_up(robot, profile)
    site.run(1)
    assert robot_of(site).known == profile
    return profile


# ---------------------------------------------------------------------- reading
@deviants("no-search")
def test_a_search_that_is_known_to_be_missing_is_never_tried(site, plan):
    check_up(site, "no-search")
    site.switch_off()
    site.switch_on()
    asked = requests(site)
    plan(START)
    site.run_until(lambda: site.executions(State.COMPLETED))
    assert "GET /mission_queue" in asked
    assert "POST /mission_queue/search" not in asked


@deviants("pages-of-50")
@pytest.mark.parametrize("is_known", [True, False])
def test_pages_that_end_early_are_no_proof_that_a_start_did_not_arrive(site, plan, is_known):
    """Its own item is beyond the first page, after 60 others."""
    if is_known:
        check_up(site, "pages-of-50")
    plan(START)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run_until(lambda: site.executions(State.SUBMITTING), within=400)
    site.network.down.add("R1")
    site.run(1)
    client = _others(site)
    for _n in range(60):
        client.enqueue(site.executions()[0].mission_guid, description="of somebody else")
    site.network.down.clear()
    site.run(900)
    [run] = site.executions()
    assert run.attempts == 1
    assert [item.id for item in items(site) if item.description == run.token] == [run.queue_id]


def _others(site: Site):
    """Somebody else's connection, which the outage does not touch."""
    down, site.network.down = site.network.down, set()
    client = site.container.make_client(robot_of(site))
    send = client.enqueue

    def enqueue(*args, **values):
        before, site.network.down = site.network.down, set()
        try:
            return send(*args, **values)
        finally:
            site.network.down = before

    client.enqueue = enqueue
    site.network.down = down
    return client


# ---------------------------------------------------------------------- which item is ours
@deviants("moves-descriptions")
@pytest.mark.parametrize(("fate", "attempts"), [(Fate.ANSWER_LOST, 1), (Fate.LOST, 2)])
def test_a_token_that_comes_back_in_another_field_is_found_there(site, plan, fate, attempts):
    check_up(site, "moves-descriptions")
    plan(START)
    site.network.next("POST", "/mission_queue", fate)
    site.run(900)
    [run] = site.executions(State.COMPLETED)
    assert (run.attempts, [item.id for item in items(site)], alarms(site)) == (attempts, [run.queue_id], [])


@deviants("forgets-descriptions", "renames-descriptions")
@pytest.mark.parametrize(("fate", "attempts"), [(Fate.ANSWER_LOST, 1), (Fate.LATE, 1), (Fate.LOST, 2)])
def test_the_first_start_on_a_robot_that_is_known_to_forget_tokens_is_not_doubled_and_needs_no_alarm(
    site, plan, fate, attempts
):
    check_up(site, "forgets-descriptions")
    plan(START)
    site.network.next("POST", "/mission_queue", fate, 20.0 if fate is Fate.LATE else None)
    site.run(900)
    [run] = site.executions(State.COMPLETED)
    assert (run.attempts, [item.id for item in items(site)], alarms(site)) == (attempts, [run.queue_id], [])


@deviants("forgets-descriptions")
@pytest.mark.parametrize("is_known", [True, False])
def test_a_copy_without_a_token_that_comes_late_is_reported(site, plan, is_known):
    """It is unknown which one a person wanted, so it is left alone."""
    if is_known:
        check_up(site, "forgets-descriptions")
    plan(START)
    site.network.next("POST", "/mission_queue", Fate.LATE, 200.0)
    site.run(900)
    assert len(items(site)) == 2
    assert alarms(site) == ["unmarked_copy"]


@deviants("forgets-descriptions")
def test_what_somebody_else_puts_there_is_no_copy(site, plan):
    check_up(site, "forgets-descriptions")
    plan(START)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(450)
    machine = site.machines["R1"]
    machine.order(site.executions()[0].mission_guid, machine.site.table("/users").get(ADMINISTRATOR))
    site.run(600)
    assert len(items(site)) == 2
    assert alarms(site) == []


@deviants("forgets-descriptions", "german-states")
@pytest.mark.parametrize("is_known", [True, False])
def test_a_start_doubled_by_the_network_is_reported_on_a_deviant_robot(request, site, plan, is_known):
    if is_known:
        check_up(site, request.node.callspec.params["site"])
    plan(START)
    site.run_until(lambda: site.executions(State.QUEUED, State.EXECUTING), within=400)
    [run], machine = site.executions(), site.machines["R1"]
    machine.order(
        run.mission_guid,
        next(row for row in machine.site.table("/users") if row["username"] == USER),
        description=run.token,
    )
    site.run(60)
    assert set(alarms(site)) & {"unmarked_copy", "duplicate_running", "duplicate_healed"}


@deviants("no-id")
def test_a_start_that_was_taken_without_a_number_is_looked_for_at_once(site, plan):
    check_up(site, "no-id")
    plan(START)
    site.run_until(lambda: site.executions(State.QUEUED, State.EXECUTING))
    [run] = site.executions()
    assert (run.submitted_at - run.planned_at).total_seconds() < 1
    assert site.executions()[0].attempts == 1


@deviants("no-id")
@pytest.mark.parametrize("is_known", [True, False])
@pytest.mark.parametrize("is_killed", [True, False])
def test_a_start_that_was_taken_and_can_not_be_found_is_never_sent_again(site, plan, is_known, is_killed):
    if is_known:
        check_up(site, "no-id")
    plan(START)
    site.network.as_answered = lambda robot, path, body: b"[]" if path.startswith("/mission_queue") else body
    site.run_until(lambda: site.network.posts())
    site.run(2)
    if is_killed:
        site.power_cut(5)
    site.run(900)
    [run] = site.executions()
    assert (run.attempts, run.reason.code) == (1, ReasonCode.UNKNOWN_OUTCOME)
    assert "unknown_outcome" in alarms(site)


# ---------------------------------------------------------------------- its words
@deviants("cancelled", "german-states", "german-texts", "faithful")
@pytest.mark.parametrize(
    ("end", "code"), [("cancelled", ReasonCode.USER_CANCELLED), ("failed", ReasonCode.ROBOT_ABORTED), ("done", None)]
)
def test_how_a_run_ended_is_understood_in_the_robot_s_own_words(request, site, plan, end, code):
    check_up(site, request.node.callspec.params["site"])
    plan(START)
    site.run_until(lambda: site.executions(State.EXECUTING), within=400)
    if end == "cancelled":
        site.machines["R1"].cancel_all()
    elif end == "failed":
        machine = site.machines["R1"]
        machine.controller.end(ItemState.ABORTED, "Failed to reach goal position 'Dock'")
        machine.controller.finish_abort()
    site.run(900)
    [run] = site.executions()
    assert (run.reason and run.reason.code) == code
    assert run.state is {"cancelled": State.CANCELLED, "failed": State.FAILED, "done": State.COMPLETED}[end]


# ---------------------------------------------------------------------- its pace
@deviants("slow-disk")
def test_a_robot_that_was_seen_to_be_slow_is_waited_for(site, plan):
    check_up(site, "slow-disk", quiet_s=120.0)
    plan(START)
    site.run(900)
    [run] = site.executions(State.COMPLETED)
    assert run.attempts == 1
    assert "unreachable" not in alarms(site)


def test_the_quiet_time_is_the_longer_of_the_two(site, plan):
    check_up(site, "faithful", quiet_s=200.0)
    plan(START)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(900)
    first, second = site.network.posts()
    assert second.at - first.at > 200
    check_up(site, "faithful", quiet_s=5.0)
    plan("2026-11-23T07:00")
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(3600)
    third, fourth = site.network.posts()[2:]
    assert fourth.at - third.at > 90


@deviants("reboots-under-load")
def test_a_robot_that_boots_when_it_is_asked_too_much_is_asked_less(site, plan):
    check_up(site, "reboots-under-load")
    before = site.machines["R1"].reboots
    client = site.container.make_client(robot_of(site))
    plan(START)
    for _n in range(30):
        site.run(10)
        client.open_items()
    site.run_until(lambda: site.executions(State.COMPLETED))
    [run] = site.executions()
    assert run.attempts == 1
    assert site.machines["R1"].reboots == before


def test_requests_never_come_closer_than_the_robot_bears(site, plan):
    check_up(site, "faithful", rest=Rest(8, 10.0))
    times = []
    site.network.interrupt = lambda where: times.append(site.seconds()) if where.startswith("before ") else None
    for minute in range(5, 9):
        plan(f"2026-11-23T06:0{minute}")
    site.run(600)
    assert len(site.executions(State.COMPLETED)) >= 3
    assert all(later - earlier >= 10.0 for earlier, later in zip(times, times[8:], strict=False))


# ---------------------------------------------------------------------- no longer what was checked up
def test_other_software_ends_the_profile_with_an_alarm_until_the_next_check_up(site, plan):
    check_up(site, "faithful")
    site.machines["R1"].software = "3.8.1"
    site.run(120)
    assert robot_of(site).known is None
    assert alarms(site) == ["check_up_outdated"]
    [alarm] = site.container.alarms.open()
    site.run(3600)
    assert [(each.id, each.count) for each in site.container.alarms.open()] == [(alarm.id, 1)]
    check_up(site, "faithful")
    site.run(60)
    assert all(each.cleared_at for each in site.container.alarms.open())
