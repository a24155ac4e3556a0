"""After a backup was restored, robots are asked for everything of the restored time before anything is sent (D9)."""

from __future__ import annotations

import shutil
from dataclasses import replace
from datetime import datetime, timedelta

import pytest

from app.database.backups import back_up, restore
from app.domain.models import Schedule, State
from app.domain.reasons import sentence, waiting_sentence
from app.screens.frame.facts import late_starts
from mir_sim.mission_queue import MissionQueue
from tests.support.network import Fate
from tests.support.seen import items, outcomes, reason, robot_of, sent_at, states
from tests.support.site import Site


@pytest.fixture
def backed_up(site):
    """Makes a backup now; what it returns goes back to it."""
    return lambda: back_up_of(site)


def back_up_of(site):
    backup = site.directory / "before.db"
    back_up(site.container.db.path, backup)

    def go_back(clock_behind=0.0):
        site.switch_off()
        restore(backup, site.container.db.path, site.clock.now() - timedelta(seconds=clock_behind))
        site.switch_on()

    return go_back


def test_what_was_tried_before_the_backup_and_ran_after_it_is_not_sent_again(site, plan, backed_up):
    """The backup knows a start that had been tried in vain; that it ran since, the robot knows."""
    plan("2026-11-23T06:05")
    site.network.down.add("R1")
    site.run(303)
    _runs_after_its_backup_and_once(site, backed_up)


def _runs_after_its_backup_and_once(site, backed_up):
    go_back = backed_up()
    assert [(row.state, row.attempts > 0) for row in site.executions()] == [(State.WAITING, True)]
    site.network.down.clear()
    site.run(200)
    assert states(site) == ["Done"]
    go_back()
    site.run(300)
    assert len(sent_at(site)) == 1
    assert [row.state for row in site.executions()] == [State.COMPLETED]


@pytest.mark.parametrize("has_run", [False, True])
def test_a_robot_whose_many_items_can_be_read_one_by_one_only_answers_too(site, plan, backed_up, has_run):
    """Without search, with a list of its oldest items: so many at a time, until all have been read."""
    for _n in range(350):
        site.stranger_queues("Home")
    site.machines["R1"].cancel_all()
    site.network.short_lists = 10
    plan("2026-11-23T06:05", start_window_minutes=60)
    site.run(200)
    go_back = backed_up()
    site.run(400 if has_run else 20)
    go_back()
    site.run(900)
    assert states(site).count("Done") == len(sent_at(site)) == 1
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


def test_a_restore_noted_by_a_clock_far_ahead_delays_starts_by_little_and_for_minutes_only(site, plan, backed_up):
    """Once the clock is proven right, what is planned later than clocks that agree may differ can't have been sent before; after each
    start of the app too."""
    plan("2026-11-23T06:10", "FREQ=MINUTELY;INTERVAL=10")
    site.run(200)
    backed_up()(clock_behind=-3e8)
    site.run(300)
    assert sent_at(site) == []
    site.run(200)
    site.power_cut(20)
    site.run(1300)
    assert sent_at(site) == [602, 1202, 1800]


def test_what_ran_before_the_robots_numbers_began_anew_is_found_where_it_can_be_seen(site, plan, backed_up):
    """Its newest number is lower than the last that the backup knows: no proof that it has nothing else, but what it shows it has."""
    for _n in range(5):
        site.stranger_queues("Home")
    plan("2026-11-23T06:02")
    plan("2026-11-23T06:10", start_window_minutes=60)
    site.run(400)
    go_back = backed_up()
    site.machines["R1"].queue = MissionQueue()
    site.run(400)
    assert states(site) == ["Done"]
    go_back()
    site.run(120)
    assert [row.state for row in site.executions()] == [State.COMPLETED, State.COMPLETED]
    assert states(site) == ["Done"]


def test_a_mission_that_a_person_started_before_the_backup_is_not_sent_again(site, backed_up):
    """A manual start has its token too, however often it was tried."""
    site.network.down.add("R1")
    site.container.operator.run_now(robot_of(site).id, site.container.catalogue.missions()[0].id)
    site.run(40)
    _runs_after_its_backup_and_once(site, backed_up)


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
    site.network.interrupt = lambda where: (
        made.append(backed_up()) if where == "after POST /mission_queue" and not made else None
    )
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
def test_the_robot_is_asked_before_the_first_try_after_a_restore_even_when_it_answers_only_later(
    site, plan, backed_up, found
):
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


# ---------------------------------------------------------------------- a schedule that was on another robot since
@pytest.fixture
def fleet(tmp_path):
    """Three robots. "Linen" is planned on R1 for 06:05, which is 300 s from now."""
    site = Site(tmp_path / "first", robots=3)
    site.add_robots()
    mission = site.add_mission("Deliver")
    site.container.catalogue.save_schedule(
        Schedule(
            name="Linen",
            robot_id=robot_of(site).id,
            mission_id=mission.id,
            start=datetime(2026, 11, 23, 6, 5),
            timezone="UTC",
            start_window_minutes=30,
        )
    )
    site.run(60)
    yield site
    site.switch_off()


def move_to(site, robot):
    [schedule] = site.container.catalogue.schedules()
    site.container.catalogue.save_schedule(replace(schedule, robot_id=robot_of(site, robot).id))


def ran_on_r2(site):
    """Moved and run since the backup; returns what goes back to it."""
    go_back = back_up_of(site)
    move_to(site, "R2")
    site.run(340)
    assert states(site, "R2") == ["Done"]
    return go_back


def rows_of(site):
    return [(row.robot, row.state) for row in site.executions()]


def test_what_ran_on_another_robot_since_the_backup_is_not_sent_to_the_one_that_the_backup_names(fleet):
    """It is that run: the row is the other robot's from then on."""
    go_back = ran_on_r2(fleet)
    go_back()
    fleet.run(600)
    assert sent_at(fleet, "R1") == []
    assert rows_of(fleet) == [("R2", State.COMPLETED)]


def test_what_still_runs_on_another_robot_is_followed_there(fleet):
    """From the moment at which the robot has answered."""
    go_back = back_up_of(fleet)
    move_to(fleet, "R2")
    fleet.machines["R2"].pause()
    fleet.run(340)
    go_back()
    fleet.run(30)
    assert rows_of(fleet) == [("R2", State.QUEUED)]
    fleet.machines["R2"].resume()
    fleet.run(120)
    assert rows_of(fleet) == [("R2", State.COMPLETED)]
    assert sent_at(fleet, "R1") == []


def test_another_robot_that_answers_late_is_waited_for(fleet):
    """The start says for which one it waits."""
    go_back = ran_on_r2(fleet)
    fleet.network.down.add("R2")
    go_back()
    fleet.run(300)
    [row] = fleet.executions()
    assert (row.state, waiting_sentence(row)) == (
        State.WAITING,
        "May have run already; waits until 06:35 for an answer from R2",
    )
    fleet.network.down.clear()
    fleet.run(120)
    assert sent_at(fleet, "R1") == []
    assert rows_of(fleet) == [("R2", State.COMPLETED)]


def test_nothing_is_sent_when_another_robot_never_answers(fleet):
    """It may have run there: the start ends with its window, and its reason names the robot."""
    go_back = ran_on_r2(fleet)
    fleet.network.down.add("R2")
    go_back()
    fleet.run(2400)
    [row] = fleet.executions()
    assert sent_at(fleet, "R1") == []
    assert (
        sentence(reason(row), "UTC")
        == "Its start window closed at 06:35: it may have run already, and R2 did not answer"
    )


def test_another_robot_is_asked_though_it_is_switched_off(fleet):
    """In the backup, or since."""
    robot_id = robot_of(fleet, "R2").id
    fleet.container.catalogue.set_robot_enabled(robot_id, False)
    go_back = back_up_of(fleet)
    fleet.container.catalogue.set_robot_enabled(robot_id, True)
    move_to(fleet, "R2")
    fleet.run(340)
    assert states(fleet, "R2") == ["Done"]
    go_back()
    fleet.run(600)
    assert sent_at(fleet, "R1") == []
    assert rows_of(fleet) == [("R2", State.COMPLETED)]


def test_a_request_to_another_robot_that_is_under_way_at_the_restore_is_waited_for(fleet):
    """All robots have answered before it lands; the quiet time is longer."""
    fleet.network.next("POST", "/mission_queue", Fate.LATE, 50.0)
    go_back = back_up_of(fleet)
    move_to(fleet, "R2")
    fleet.run(250)
    assert items(fleet, "R2") == []
    go_back()
    fleet.run(600)
    assert (sent_at(fleet, "R1"), states(fleet, "R2")) == ([], ["Done"])
    assert rows_of(fleet) == [("R2", State.COMPLETED)]


def test_what_no_robot_has_is_sent_once_all_have_answered(fleet):
    """A restored backup holds nothing up for longer than the quiet time, where all robots are well."""
    fleet.container.holds.hold("shift meeting")
    fleet.run(260)
    go_back = back_up_of(fleet)
    go_back()
    fleet.container.holds.release()
    fleet.run(100)
    assert [round(at / 10) for at in sent_at(fleet, "R1")] == [41]
    assert states(fleet, "R2") == []


def test_a_robot_that_is_gone_for_good_holds_up_no_start_of_after_the_restore(fleet):
    """However often the app is started since."""
    fleet.network.down.add("R3")
    back_up_of(fleet)()
    fleet.run(200)
    fleet.power_cut(60)
    fleet.run(60)
    assert [round(at / 10) for at in sent_at(fleet, "R1")] == [32]


def test_what_ran_on_another_robot_before_the_plan_moved_here_is_not_sent_again(fleet, tmp_path):
    """The data directory was copied before the schedule was moved to another robot, and the old tablet ran it there."""
    shutil.copytree(fleet.directory, tmp_path / "copy")
    move_to(fleet, "R2")
    fleet.run(340)
    assert states(fleet, "R2") == ["Done"]
    other = fleet.another_tablet(tmp_path / "copy")
    other.container.tablet.move_here()
    other.run(600)
    assert sent_at(fleet, "R1") == []
    assert rows_of(other) == [("R2", State.COMPLETED)]
    other.switch_off()


# ---------------------------------------------------------------------- with a window
@pytest.fixture
def with_window(tmp_path):
    """A start at 06:05."""
    site = Site(tmp_path, with_window=True)
    site.add_robots()
    mission = site.add_mission("Deliver")
    robot = site.container.catalogue.robots()[0]
    site.container.catalogue.save_schedule(
        Schedule(
            name="S1", robot_id=robot.id, mission_id=mission.id, start=datetime(2026, 11, 23, 6, 5), timezone="UTC"
        )
    )
    yield site
    site.switch_off()


def listed(site):
    """What is asked about: "Start this now?"."""
    return [row.planned_at for row in late_starts(site.executions(), {})]


def test_nobody_is_asked_about_what_has_run(with_window):
    site = with_window
    site.run(200)
    go_back = back_up_of(site)
    site.run(250)
    assert len(sent_at(site)) == 1
    go_back()
    for _second in range(200):
        site.run(1)
        assert listed(site) == []
    assert [row.state for row in site.executions()] == [State.COMPLETED]
    assert len(sent_at(site)) == 1


def test_what_has_not_run_is_asked_about_once_that_is_known(with_window):
    site = with_window
    site.run(200)
    go_back = back_up_of(site)
    site.switch_off()
    site.clock.advance(250)
    site.switch_on()
    go_back()
    site.run(30)
    assert listed(site) == []
    site.run_until(lambda: listed(site), within=120)
    began = site.seconds()
    assert not sent_at(site)
    site.run_until(lambda: sent_at(site), within=60)
    assert site.seconds() - began >= 29
    assert len(sent_at(site)) == 1


@pytest.mark.parametrize("held_for", [10, 300], ids=["released before that is known", "released after that"])
def test_it_is_asked_about_though_its_robot_was_on_hold_before(with_window, held_for):
    site = with_window
    site.run(200)
    go_back = back_up_of(site)
    site.switch_off()
    site.clock.advance(250)
    site.switch_on()
    go_back()
    site.run(20)
    hold = site.container.holds.hold("cleaning", robot_id=robot_of(site).id)
    site.run(held_for)
    site.container.holds.release(hold.id)
    site.run_until(lambda: listed(site), within=120)
    assert not sent_at(site)
    site.run_until(lambda: sent_at(site), within=60)
    assert len(sent_at(site)) == 1
