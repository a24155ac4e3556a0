"""A trial ends only its own pause: a robot that a person pauses during it, at the robot or in the app, stays paused."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from app.domain.check_up import Level, Report, Topic, Trial
from app.domain.message import render
from tests.support.check_up_site import ENDED, CheckedRobot, Killed
from tests.support.findings import says

STATE = ("PUT", "/status")
MAYBE_THEIRS = "it is paused, and somebody may have paused it; release it there or in the app"


def at_each_request(robot: CheckedRobot, work: Callable[[], None]) -> None:
    robot.asked.before = lambda method, path: work()


def press_pause(robot: CheckedRobot) -> list[str]:
    """At the robot. Returns a list that shows whether it is released from now on."""
    released: list[str] = []
    resume = robot.machine.resume
    robot.machine.pause()
    robot.machine.resume = lambda: (released.append("released"), resume())
    return released


def runs(robot: CheckedRobot) -> bool:
    robot.machine.catch_up()
    return robot.machine.run is not None and not robot.machine.paused


def check_is_left_paused(robot: CheckedRobot, report: Report) -> None:
    assert robot.machine.paused
    assert all(str(item.state) in ENDED for item in robot.machine.queue)
    assert says(report, Topic.LEFT) == (Level.AMBER, "Nothing of the trial is left on it; it is paused")
    assert not report.is_complete
    assert not robot.check_ups.left_behind()
    assert not robot.container.holds.current()


# ---------------------------------------------------------------------- at the robot
@pytest.mark.parametrize("mission", [None, "Home"])
@pytest.mark.parametrize("seconds", [0.0, 0.3])
def test_pause_pressed_while_its_mission_runs_stays(robot, mission, seconds):
    """Also where the app is about to pause it as well."""
    began, released = [], []

    def press():
        if runs(robot) and not began:
            began.append(robot.asked.clock.monotonic())
        if began and not released and robot.asked.clock.monotonic() - began[0] >= seconds:
            released.append(press_pause(robot))

    at_each_request(robot, press)
    report = robot.check_ups.run(robot.id, Trial(mission))
    assert released == [[]]
    assert says(report, Topic.PAUSE) == (Level.AMBER, "Somebody paused it while it was tried")
    check_is_left_paused(robot, report)


def test_pause_pressed_before_the_trials_own_stays(robot):
    released = []

    def press():
        if "POST /missions" in robot.asked.writes and not released:
            released.append(press_pause(robot))

    at_each_request(robot, press)
    report = robot.check_ups.run(robot.id, Trial())
    assert released == [[]]
    check_is_left_paused(robot, report)


def test_pause_pressed_after_the_trials_second_release_stays(robot):
    put, released = [], []

    def press(method, path):
        put.extend([path] if (method, path) == STATE else [])
        if len(put) == 4 and runs(robot) and not released:
            released.append(press_pause(robot))

    robot.asked.before = press
    report = robot.check_ups.run(robot.id, Trial("Home"))
    assert released == [[]]
    check_is_left_paused(robot, report)


@pytest.mark.parametrize("pauses", [1, 2])
@pytest.mark.parametrize("for_s", [1.0, 2.0])
def test_a_pause_that_was_left_and_has_come_again_stays(robot, pauses, for_s):
    """Released at the robot and paused again, in the first and in the second pause of the trial."""
    put, left_at, released = [], [], []

    def press(method, path):
        now = robot.asked.clock.monotonic()
        put.extend([path] if (method, path) == STATE else [])
        if len(put) == 2 * pauses - 1 and robot.machine.paused and path != "/status" and not left_at:
            robot.machine.resume()
            left_at.append(now)
        if left_at and not released and now - left_at[0] >= for_s:
            released.append(press_pause(robot))

    robot.asked.before = press
    report = robot.check_ups.run(robot.id, Trial("Home"))
    assert released == [[]]
    check_is_left_paused(robot, report)


def test_one_between_two_looks_at_its_state_shows_by_what_has_run(robot):
    """The robot is released and paused again while one answer is waited for."""
    released = []

    def press():
        if robot.machine.paused and robot.asked.writes.count("POST /mission_queue") == 4 and not released:
            robot.machine.resume()
            robot.asked.clock.advance(1.5)
            robot.machine.catch_up()
            released.append(press_pause(robot))

    at_each_request(robot, press)
    report = robot.check_ups.run(robot.id, Trial())
    assert released == [[]]
    assert says(report, Topic.PAUSE) == (Level.RED, "A mission continued while it was in Pause")
    check_is_left_paused(robot, report)


def test_after_an_emergency_stop_it_stays_in_pause(robot):
    released = []

    def press():
        if robot.machine.paused and "POST /mission_queue" in robot.asked.writes and not released:
            robot.machine.press_emergency_stop(True)
            released.append(robot.asked.clock.monotonic())
        elif robot.machine.emergency_stop and robot.asked.clock.monotonic() - released[0] > 1.0:
            robot.machine.press_emergency_stop(False)

    at_each_request(robot, press)
    report = robot.check_ups.run(robot.id, Trial())
    assert says(report, Topic.PAUSE) == (Level.AMBER, "Somebody ended the pause of the trial")
    check_is_left_paused(robot, report)


def test_a_robot_that_somebody_released_is_not_paused_again(robot):
    done = []

    def press():
        if robot.machine.paused and "POST /mission_queue" in robot.asked.writes and not done:
            done.append(robot.machine.resume())

    at_each_request(robot, press)
    report = robot.check_ups.run(robot.id, Trial())
    assert says(report, Topic.PAUSE) == (Level.AMBER, "Somebody ended the pause of the trial")
    assert says(report, Topic.LEFT)[0] is Level.GREEN
    assert robot.asked.writes.count("PUT /status") == 1
    assert not robot.machine.paused


# ---------------------------------------------------------------------- in the app
def test_pause_pressed_in_the_app_while_it_is_undone_stays(robot):
    pressed = []

    def press(method, path):
        if (
            method == "DELETE"
            and path.startswith("/missions/") is False
            and len(robot.asked.writes) > 5
            and not pressed
        ):
            pressed.append(path)
            robot.container.operator.pause(robot.id)

    robot.asked.before = press
    report = robot.check_ups.run(
        robot.id, Trial(), is_wanted=lambda: robot.asked.writes.count("POST /mission_queue") < 2
    )
    assert pressed
    assert robot.machine.paused
    assert says(report, Topic.LEFT) == (
        Level.GREEN,
        "Nothing of the trial is left on it; it is paused, as somebody wanted",
    )


# ---------------------------------------------------------------------- after the app was killed
def killed_in_pause(robot: CheckedRobot, pauses: int) -> None:
    """In that of its pauses, with missions in its queue."""
    put = []

    def die(method, path):
        put.extend([path] if (method, path) == STATE else [])
        if len(put) == 2 * pauses - 1 and robot.machine.paused and "POST /mission_queue" in robot.asked.writes:
            robot.kill_at(0, is_handled=False)
            raise Killed

    robot.asked.before = die
    with pytest.raises(Killed):
        robot.check_ups.run(robot.id, Trial("Home"))
    robot.machine.catch_up()
    assert robot.machine.paused
    robot.start_again()


def check_is_said_until_it_is_released(robot: CheckedRobot) -> None:
    assert render(robot.check_ups.put_back(robot.id)) == MAYBE_THEIRS
    assert robot.machine.paused
    assert all(str(item.state) in ENDED for item in robot.machine.queue)
    assert [alarm.code for alarm in robot.container.alarms.open()] == ["check_up_left"]
    assert robot.container.holds.current()
    robot.machine.resume()  # by a person
    assert robot.check_ups.put_back(robot.id) is None
    assert not robot.container.holds.current()
    assert not robot.check_ups.left_behind()


@pytest.mark.parametrize("pauses", [1, 2])
def test_a_robot_that_ran_and_was_paused_since_stays_paused(robot, pauses):
    killed_in_pause(robot, pauses)
    robot.machine.resume()
    robot.asked.clock.advance(120)
    robot.machine.catch_up()
    robot.machine.pause()
    check_is_said_until_it_is_released(robot)


def test_a_robot_that_has_booted_since_stays_paused(robot):
    killed_in_pause(robot, 1)
    robot.machine.reboot(20)
    robot.asked.clock.advance(60)
    robot.machine.catch_up()
    robot.machine.pause()
    check_is_said_until_it_is_released(robot)
