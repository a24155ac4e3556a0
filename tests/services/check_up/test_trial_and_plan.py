"""A trial in a running app: refused while the plan or a person uses the robot, and without effect on the plan and the
idle rule."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.database.check_ups import CheckUpRepository
from app.domain.check_up import LeftBehind, Level, Topic, Trial
from app.domain.execution import Reason, ReasonCode, State, Trigger
from app.domain.message import render
from app.domain.models import Group, InvalidInput
from app.domain.reasons import sentence
from app.i18n import _, translator
from app.services.check_up.journal import HOLD
from app.services.check_up.service import CheckUps
from tests.support.check_up_site import RunningClock, check_ups_of
from tests.support.examples import at_night
from tests.support.findings import says, why_not_tried


@pytest.fixture
def check_ups(site) -> CheckUps:
    site.run(10)  # robot and clock have been looked at
    return check_ups_of(site)


@pytest.fixture
def robot(site):
    return site.container.catalogue.robots()[0]


@pytest.fixture
def mission(site):
    return site.container.catalogue.missions()[0]


def refused(check_ups, robot, trial=None) -> str:
    with pytest.raises(InvalidInput) as refusal:
        check_ups.run(robot.id, trial or Trial())
    return str(refusal.value)


# ---------------------------------------------------------------------- refused
@pytest.mark.parametrize("of_its_group", [False, True])
def test_a_start_that_is_due_soon_goes_first(site, plan, check_ups, robot, of_its_group):
    schedule = plan("2026-11-23T06:05")
    if of_its_group:
        group = site.container.catalogue.save_group(Group("Tuggers", (robot.id,)))
        site.container.catalogue.save_schedule(replace(schedule, robot_id=None, group_id=group.id))
    assert refused(check_ups, robot) == "S1 is planned at 06:05: check up after it"
    assert not site.network.submissions


def test_one_that_is_skipped_or_later_is_not_in_the_way(site, plan, check_ups, robot):
    plan("2026-11-23T06:07")
    plan("2026-11-23T06:05", enabled=False)
    paused = plan("2026-11-23T06:05", recurrence="FREQ=DAILY")
    site.container.pausing.pause(paused.id, datetime(2026, 11, 24, tzinfo=UTC))
    assert check_ups.run(robot.id, Trial()).is_complete


def test_a_start_that_is_open_goes_first(site, check_ups, robot, mission):
    site.container.operator.run_now(robot.id, mission.id)
    assert refused(check_ups, robot) == "Deliver waits for R1 or runs there: check up after it"


def test_the_reason_of_a_hold_is_said_in_the_language_of_the_screen(site, check_ups, robot):
    def said() -> tuple[str, str]:
        with pytest.raises(InvalidInput) as refused:
            check_ups.run(robot.id, Trial())
        [hold] = site.container.holds.current()
        skipped = Reason(ReasonCode.HOLD, {"hold": hold.reason, "until": "2026-11-23T12:00+00:00"})
        return render(refused.value.message, _), sentence(skipped, "UTC", _)

    site.container.holds.hold(HOLD, robot_id=robot.id)
    assert said() == (
        "R1 is on hold (Check-up): check up when it is released",
        "On hold until its start window closed on 23 Nov 2026 12:00: Check-up",
    )
    translator.use("fi")
    try:
        assert all("tarkastus" in text.casefold() and "Check-up" not in text for text in said())
    finally:
        translator.use("en")


def test_a_robot_that_is_held_switched_off_or_busy_is_left_alone(site, check_ups, robot):
    site.container.holds.hold("Cleaning", robot_id=robot.id)
    assert refused(check_ups, robot) == "R1 is on hold (Cleaning): check up when it is released"
    site.container.holds.release(robot.id)
    site.machines["R1"].pause()
    assert refused(check_ups, robot) == "R1 is not ready with an empty queue: check up when it is"
    site.machines["R1"].resume()
    assert refused(check_ups, robot, Trial("Dance")) == "the robot has no mission Dance"
    assert (
        refused(check_ups, robot, Trial("Go to position"))
        == "Go to position asks for values when it is started: choose another mission"
    )
    site.container.catalogue.save_robot(replace(site.container.catalogue.robot(robot.id), enabled=False))
    assert refused(check_ups, robot) == "R1 is switched off in Settings"
    assert not site.network.submissions


def test_it_can_still_be_read(site, plan, check_ups, robot):
    plan("2026-11-23T06:05")
    site.container.holds.hold("Cleaning", robot_id=robot.id)
    assert check_ups.run(robot.id).is_complete
    assert not site.network.submissions


def test_one_check_up_at_a_time(check_ups, robot):
    met = []

    def on_progress(progress):
        if not met:
            met.append(refused(check_ups, robot))

    assert check_ups.run(robot.id, on_progress=on_progress).is_complete
    assert met == ["R1 is being checked up already"]


def test_what_begins_while_the_robot_is_read_goes_first(site, check_ups, robot, mission):
    site.at(60.0, lambda: site.container.operator.run_now(robot.id, mission.id))
    report = check_ups.run(robot.id, Trial())
    assert why_not_tried(report) == "Not tried: Deliver waits for R1 or runs there: check up after it"
    assert check_ups.report(robot.id) is None


# ---------------------------------------------------------------------- without effect on the rest
def test_a_start_made_during_it_waits_and_completes(site, check_ups, robot, mission):
    def on_progress(progress):
        if site.container.holds.active(robot.id) and not site.executions():
            site.container.operator.run_now(robot.id, mission.id)
            site.kick()

    assert check_ups.run(robot.id, Trial(), on_progress).is_complete
    assert site.the_row().state is State.WAITING
    site.run_until(lambda: site.executions(State.COMPLETED), within=600)
    assert [item.mission_id for item in site.machines["R1"].queue].count(mission.guid) == 1
    assert not site.container.alarms.open()


def test_the_plan_is_kept_afterwards(site, plan, check_ups, robot):
    plan("2026-11-23T06:30")
    assert check_ups.run(robot.id, Trial("Deliver")).is_complete
    site.run(3600)
    [row] = site.executions()
    assert (row.state, row.planned_at) == (State.COMPLETED, datetime(2026, 11, 23, 6, 30, tzinfo=UTC))
    assert row.submitted_at - row.planned_at < timedelta(seconds=2)
    assert not site.container.alarms.open()


@pytest.mark.parametrize("had_its_mission", [True, *at_night(False)])
def test_a_trial_is_no_use_of_the_robot_by_anybody(site, check_ups, robot, had_its_mission):
    home = site.add_mission("Home")
    site.container.catalogue.change_idle_rule(robot.id, mission_id=home.id, after_minutes=10)
    if had_its_mission:
        site.run_until(lambda: site.executions(State.COMPLETED), within=3600)
        site.run(60)
    assert check_ups.run(robot.id, Trial()).is_complete
    site.run(7200)
    assert [(row.trigger, row.state) for row in site.executions()] == [(Trigger.IDLE, State.COMPLETED)]


def test_a_start_that_may_still_arrive_is_not_taken_for_the_trials(site, check_ups, robot, mission):
    """On a robot that forgets descriptions, with the same mission."""
    site.network.forgets_descriptions = True
    assert check_ups.run(robot.id, Trial("Deliver")).is_complete
    site.container.operator.run_now(robot.id, mission.id)
    site.kick()
    site.run_until(lambda: site.executions(State.COMPLETED), within=600)
    assert len(list(site.machines["R1"].queue)) == 5


def test_a_person_ends_it_and_the_robot_is_restored(site, check_ups, robot):
    report = check_ups.run(robot.id, Trial("Deliver"), is_wanted=lambda: len(site.network.submissions) < 3)
    machine = site.machines["R1"]
    assert [str(item.state) for item in machine.queue] == ["Aborted"] * 3
    assert (len(site.network.submissions), machine.paused, report.is_complete) == (3, False, False)
    assert (site.container.holds.current(), check_ups.left_behind(), check_ups.report(robot.id)) == ([], [], None)


# ---------------------------------------------------------------------- a person presses Pause in the app during it
@pytest.mark.parametrize("stage", ["Queueing missions", "Waiting until the missions have ended"])
@pytest.mark.parametrize("is_again", [False, True])
def test_a_persons_pause_ends_it_and_stays(site, robot, stage, is_again):
    """Whether the trial has paused the robot at that moment or not."""
    c, pressed = site.container, []

    def on_progress(progress):
        if render(progress.says) == stage:
            pressed.append(site.clock.now())
            if len(pressed) == (3 if is_again else 1) or (is_again and stage == "Queueing missions"):
                c.operator.pause(robot.id)

    check_ups = c.check_ups
    check_ups._clock = RunningClock(site)
    site.run(10)
    report = check_ups.run(robot.id, Trial("Deliver"), on_progress)
    assert pressed
    assert site.machines["R1"].paused
    assert not report.is_complete
    assert not [item for item in site.machines["R1"].queue if str(item.state) in ("Pending", "Executing")]
    assert says(report, Topic.LEFT) == (
        Level.GREEN,
        "Nothing of the trial is left on it. It is paused, as somebody wanted",
    )
    assert not check_ups.left_behind()
    assert not c.holds.current()


def test_a_persons_pause_after_it_was_cut_off_stays(site, robot):
    c = site.container
    site.run(10)
    left = LeftBehind(site.machines["R1"].serial_number, tokens=("a", "a", "b", "c"), is_paused=True)
    c.db.write(lambda connection: CheckUpRepository().note_left_behind(connection, robot.id, left))
    c.operator.pause(robot.id)
    assert c.check_ups.put_back(robot.id) is None
    assert site.machines["R1"].paused
    assert not c.check_ups.left_behind()
