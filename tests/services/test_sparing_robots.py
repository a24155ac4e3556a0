"""Events while a robot with a profile is asked or waited for: starts are withdrawn or sent, and it may return as
another machine."""

from __future__ import annotations

import math
from collections.abc import Callable

from app.domain.check_up import Rest
from app.domain.models import ReasonCode, State
from app.services.dispatch import messages
from tests.services.test_robot_profiles import check_up, deviants, site  # noqa: F401
from tests.support.network import Fate
from tests.support.seen import alarms, items, robot_of
from tests.support.site import Site


def during_the_wait(site: Site, act: Callable[[], None]) -> None:  # noqa: F811
    """Whenever a request waits for its turn."""
    pause = site.network.time_out

    def time_out(seconds: float) -> None:
        act()
        pause(seconds)

    for pace in site._paces.values():
        pace._pause = time_out


def test_a_start_withdrawn_during_a_question_about_a_refusal_changes_no_other(site, plan):  # noqa: F811
    """Whether the robot has the mission is a read that waits for its turn, and what is due goes before reads."""
    check_up(site, "faithful", rest=Rest(1, 10.0))
    saved = [plan("2026-11-23T06:05") for _n in range(3)]
    site.network.next("POST", "/mission_queue", Fate.NOT_FOUND)
    removed = []

    def act() -> None:
        if site.executions(State.SUBMITTING) and not removed:
            removed.append(site.container.catalogue.remove_schedule(saved[1].id))

    during_the_wait(site, act)
    site.run(900)
    assert removed
    assert len(site.executions(State.COMPLETED)) == len(items(site)) == 2
    assert alarms(site) == []


def test_a_start_withdrawn_while_it_waits_for_its_turn_is_not_sent(site, plan):  # noqa: F811
    check_up(site, "faithful", rest=Rest(1, 10.0))
    saved = plan("2026-11-23T06:05")
    removed = []

    def act() -> None:
        if site.executions(State.SUBMITTING) and not removed:
            removed.append(site.container.catalogue.remove_schedule(saved.id))

    during_the_wait(site, act)
    site.run(900)
    assert removed
    assert (items(site), site.network.posts()) == ([], [])
    assert [run.reason.code for run in site.executions()] == [ReasonCode.SCHEDULE_CHANGED]


@deviants("forgets-descriptions")
def test_a_start_that_is_sent_while_the_robot_is_read_is_no_copy_of_another(site, plan):  # noqa: F811
    check_up(site, "forgets-descriptions")
    plan("2026-11-23T06:05")
    plan("2026-11-23T06:06")
    worker = site._workers[robot_of(site).id]
    site.run_until(lambda: len(site.network.posts()) == 1, within=400)
    while site.seconds() < 361 and not math.isfinite(worker._sending.attempts.next_ready_at()):
        site.run(0.01)
    site.network.next("GET", "/status", Fate.SLOW, 0.5)
    site.post(robot_of(site).id, messages.Poll())
    site.run(900)
    assert len(site.executions(State.COMPLETED)) == len(items(site)) == 2
    assert alarms(site) == []


def test_a_robot_that_has_come_back_is_asked_for_its_software_before_its_queue_proves_anything(site, plan):  # noqa: F811
    check_up(site, "faithful")
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run_until(lambda: site.executions(State.SUBMITTING) and site.network.posts(), within=400)
    asked: list[str] = []
    site.network.interrupt = asked.append
    site.network.down.add("R1")
    site.run(100)
    site.machines["R1"].software = "3.8.1"
    site.network.down.clear()
    asked.clear()
    site.run_until(lambda: site.executions(State.QUEUED, State.EXECUTING), within=400)
    asked = [where for where in asked if where.startswith("before ")]
    assert asked.index("before GET /users/me") < asked.index("before POST /mission_queue/search")
