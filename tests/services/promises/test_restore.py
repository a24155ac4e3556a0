"""After a backup was restored, robots are asked for everything of the restored time before anything is sent (D9)."""
from __future__ import annotations

from datetime import timedelta

import pytest

from app.database.backups import back_up, restore
from app.domain.models import State
from tests.support.network import Fate
from tests.support.seen import items, outcomes, robot_of, sent_at, states


@pytest.fixture
def backed_up(site):
    """Makes a backup now; what it returns goes back to it."""
    def make():
        backup = site.directory / "before.db"
        back_up(site.container.db.path, backup)

        def go_back(clock_behind=0.0):
            site.switch_off()
            restore(backup, site.container.db.path, site.clock.now() - timedelta(seconds=clock_behind))
            site.switch_on()
        return go_back
    return make


def test_what_was_tried_before_the_backup_and_ran_after_it_is_not_sent_again(site, plan, backed_up):
    """The backup knows a start that had been tried in vain; that it ran since, the robot knows."""
    plan("2026-11-23T06:05")
    site.network.down.add("R1")
    site.run(303)
    go_back = backed_up()
    assert [(row.state, row.attempts > 0) for row in site.executions()] == [(State.WAITING, True)]
    site.network.down.clear()
    site.run(200)
    assert states(site) == ["Done"]
    go_back()
    site.run(300)
    assert len(sent_at(site)) == 1
    assert [row.state for row in site.executions()] == [State.COMPLETED]


def test_what_ran_since_the_backup_is_not_sent_again_though_the_clock_was_behind_at_the_restore(site, plan, backed_up):
    """A tablet without power forgets the time: what the restore noted is earlier than what ran before it."""
    plan("2026-11-23T06:05", start_window_minutes=120)
    site.run(200)
    go_back = backed_up()
    site.run(300)
    assert states(site) == ["Done"]
    go_back(clock_behind=3600.0)
    site.run(300)
    assert len(sent_at(site)) == 1


def test_a_mission_that_a_person_started_before_the_backup_is_not_sent_again(site, backed_up):
    """A manual start has its token too, however often it was tried."""
    site.network.down.add("R1")
    site.container.operator.run_now(robot_of(site).id, site.container.catalogue.missions()[0].id)
    site.run(40)
    go_back = backed_up()
    assert [(row.state, row.attempts > 0) for row in site.executions()] == [(State.WAITING, True)]
    site.network.down.clear()
    site.run(200)
    assert states(site) == ["Done"]
    go_back()
    site.run(300)
    assert len(sent_at(site)) == 1
    assert [row.state for row in site.executions()] == [State.COMPLETED]


@pytest.mark.parametrize("minutes", [0, 1])
def test_what_waited_untried_in_the_backup_and_ran_since_is_not_sent_again(site, plan, backed_up, minutes):
    """A start that waited for its battery when the backup was made is looked for first."""
    site.machines["R1"].set_battery(12.0)
    plan("2026-11-23T06:05", minimum_battery_percent=30)
    site.run(303 + 60 * minutes)
    go_back = backed_up()
    site.machines["R1"].set_battery(90.0)
    site.run(200)
    go_back()
    site.run(300)
    assert len(sent_at(site)) == 1
    assert [row.state for row in site.executions()] == [State.COMPLETED]


def test_what_was_on_its_way_when_the_backup_was_made_is_looked_for(site, plan, backed_up):
    """A backup may hold a start in the very moment between its intent and its answer."""
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    made = []
    site.network.interrupt = lambda where: made.append(backed_up()) if where == "after POST /mission_queue" and not made else None
    site.run(500)
    assert states(site) == ["Done"]
    made[0]()
    site.run(300)
    assert len(sent_at(site)) == 1
    assert [row.state for row in site.executions()] == [State.COMPLETED]


def test_what_was_cancelled_since_the_backup_is_sent_once_at_most(site, plan, backed_up):
    """A decision that the backup doesn't know is lost; the robot's item of that token is not."""
    plan("2026-11-23T06:05")
    site.run(60)
    go_back = backed_up()
    site.run(260)
    site.container.operator.cancel_execution(site.executions()[0].id)
    site.run(30)
    go_back()
    site.run(300)
    assert len(sent_at(site)) == 1
    assert [row.state for row in site.executions()] == [State.CANCELLED]


def test_a_start_that_falls_due_after_the_restore_is_prepared_as_any(site, plan, backed_up):
    """Being restored once makes nothing late for ever: what is planned after it has its intent on disk before its instant."""
    plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=10")
    site.run(30)
    go_back = backed_up()
    site.run(400)
    go_back()
    site.run(899.95 - 430)
    assert [(f"{row.planned_at:%H:%M}", row.state) for row in site.executions()][1:] == [("06:15", State.SUBMITTING)]
    site.run(300)
    assert sent_at(site) == [300, 900]


@pytest.mark.parametrize("found", ["pending", "done"])
def test_the_robot_is_asked_before_the_first_try_after_a_restore_even_when_it_answers_only_later(site, plan, backed_up, found):
    """As long as the robot can't be asked for the restored time, nothing of that time is sent to it."""
    if found == "pending":
        site.machines["R1"].pause()
    plan("2026-11-23T06:05")
    site.network.down.add("R1")
    site.run(303)
    go_back = backed_up()
    site.network.down.clear()
    site.run(200)
    site.network.down.add("R1")
    go_back()
    site.run(60)
    site.network.down.clear()
    site.run(300)
    assert len(items(site)) == 1
    assert [outcome[0] for outcome in outcomes(site)] == [State.QUEUED if found == "pending" else State.COMPLETED]
