"""A copied data directory: two tablets with one database start each mission once, and nothing is sent until a person has decided (D8)."""

from __future__ import annotations

import shutil

import pytest

from app.domain.models import InvalidInput, State
from tests.support.network import Fate
from tests.support.seen import alarms, items, robot_of, sent_at, states
from tests.support.site import Site


@pytest.fixture
def copy_of(tmp_path):
    """Makes another tablet with a copy of a site's data directory, on the same network, at the same time."""
    made = []

    def make(site: Site) -> Site:
        directory = tmp_path / f"copy {len(made)}"
        shutil.copytree(site.directory, directory)
        made.append(site.another_tablet(directory))
        return made[-1]

    yield make
    for site in made:
        site.switch_off()


def run_both(one, other, seconds):
    """Both apps live through the same time, half a second in turn."""
    for _ in range(int(seconds * 2)):
        one.run(0.5)
        other.run(0.0)


def test_two_tablets_with_one_database_run_each_start_once(site, plan, copy_of):
    """A copy sends nothing before a person has decided; so the robot runs the mission once, and nobody cancels it."""
    plan("2026-11-23T06:05")
    site.run(30)
    other = copy_of(site)
    run_both(site, other, 420)
    assert states(site) == ["Done"]
    assert [row.state for row in site.executions()] == [State.COMPLETED]


def test_a_copied_data_directory_sends_nothing_until_a_person_decides(site, plan, copy_of):
    """The app says at its start that this directory comes from another tablet; what falls due waits."""
    plan("2026-11-23T06:05")
    site.run(30)
    other = copy_of(site)
    other.run(420)
    assert other.container.tablet.is_copy
    assert sent_at(site) == []
    assert [row.state for row in other.executions()] == [State.WAITING]


def test_a_directory_that_moves_here_looks_for_its_old_tokens_and_mints_new_ones(site, plan, copy_of):
    """What the old tablet sent is found and adopted; from then on this one starts everything."""
    plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=10")
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(300.5)
    other = copy_of(site)
    other.container.tablet.move_here()
    other.run(900)
    assert states(site) == ["Done", "Done"]
    assert [row.state for row in other.executions()] == [State.COMPLETED] * 2


def test_a_directory_that_is_looked_at_only_sends_nothing(site, plan, copy_of):
    """An office reads the plan; its starts are the old tablet's."""
    plan("2026-11-23T06:05")
    site.run(30)
    other = copy_of(site)
    other.container.tablet.view_only()
    other.run(1500)
    assert sent_at(site) == []


def test_when_both_tablets_run_after_a_move_everything_is_held_and_told(site, plan, copy_of):
    """Items of the old identity that were ordered after the move mean that the old tablet is still on."""
    plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=10")
    site.run(30)
    other = copy_of(site)
    other.container.tablet.move_here()
    run_both(site, other, 420)
    assert other.container.holds.active(robot_of(other).id) is not None
    assert "two_tablets" in alarms(other)
    assert len(items(site)) <= 2


def test_the_alarm_of_two_tablets_ends_with_the_hold_that_it_asks_to_release(site, plan, copy_of):
    """Once the other tablet is off and the hold is released, nothing says any more that nothing is sent, though its last mission runs."""
    plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=10")
    site.run(30)
    other = copy_of(site)
    other.container.tablet.move_here()
    run_both(site, other, 300)
    assert states(site)[0] == "Executing"
    other.container.holds.release()
    other.run(30)
    assert other.container.holds.active(robot_of(other).id) is None
    assert [alarm.cleared_at is not None for alarm in other.container.alarms.open() if alarm.code == "two_tablets"] == [
        True
    ]


def test_the_other_tablet_is_found_though_its_mission_was_over_before_the_robot_was_read(site, plan, copy_of):
    """Robots that are polled rarely have long ended what the other tablet started."""
    plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=10")
    site.run(30)
    other = copy_of(site)
    other.container.catalogue.change_settings(poll_interval_seconds=480)
    other.container.tablet.move_here()
    run_both(site, other, 800)
    assert "two_tablets" in alarms(other)


@pytest.mark.parametrize("is_view_only", [False, True])
def test_a_mission_run_by_hand_on_a_copy_is_refused_and_says_why(site, plan, copy_of, is_view_only):
    """Nothing is ever sent from here: nor does it wait until the plan moves here."""
    schedule = plan("2026-11-23T06:05")
    site.run(30)
    other = copy_of(site)
    if is_view_only:
        other.container.tablet.view_only()
    with pytest.raises(InvalidInput, match="another tablet"):
        other.container.operator.run_now(schedule.robot_id, schedule.mission_id)
    assert other.executions() == []
