"""Robots that bear few requests: what waits for its turn repeats nothing, and holds nothing back that was taken back meanwhile."""
from __future__ import annotations

from collections.abc import Callable

from app.domain.check_up import Rest
from app.domain.models import ReasonCode, State
from tests.services.test_robot_profiles import alarms, check_up, items, site  # noqa: F401
from tests.support.network import Fate
from tests.support.site import Site


def meanwhile(site: Site, act: Callable[[], None]) -> None:  # noqa: F811
    """Whenever a request waits for its turn."""
    pause = site.network.time_out

    def time_out(seconds: float) -> None:
        act()
        pause(seconds)
    for pace in site._paces.values():
        pace._pause = time_out


def test_what_is_taken_back_while_a_refusal_is_asked_about_leaves_the_others_alone(site, plan):  # noqa: F811
    """Whether the robot has the mission is a read that waits for its turn, and what is due goes before reads."""
    check_up(site, "faithful", rest=Rest(1, 10.0))
    saved = [plan("2026-11-23T06:05") for _n in range(3)]
    site.network.next("POST", "/mission_queue", Fate.NOT_FOUND)
    removed = []

    def act() -> None:
        if site.executions(State.SUBMITTING) and not removed:
            removed.append(site.container.catalogue.remove_schedule(saved[1].id))
    meanwhile(site, act)
    site.run(900)
    assert removed
    assert len(site.executions(State.COMPLETED)) == len(items(site)) == 2
    assert alarms(site) == []


def test_nothing_is_sent_that_is_taken_back_while_it_waits_for_its_turn(site, plan):  # noqa: F811
    check_up(site, "faithful", rest=Rest(1, 10.0))
    saved = plan("2026-11-23T06:05")
    removed = []

    def act() -> None:
        if site.executions(State.SUBMITTING) and not removed:
            removed.append(site.container.catalogue.remove_schedule(saved.id))
    meanwhile(site, act)
    site.run(900)
    assert removed
    assert (items(site), site.network.posts()) == ([], [])
    assert [run.reason.code for run in site.executions()] == [ReasonCode.SCHEDULE_CHANGED]
