"""A trial ends only its own pause: a robot that a person pauses during it, at the robot or in the app, stays paused."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from app.domain.check_up import Level, Report, Topic
from app.domain.message import render
from tests.support.check_up_site import CheckedRobot, Killed
from tests.support.findings import says

MAYBE_THEIRS = "it is paused, and somebody may have paused it: press Resume there or in the app"


def press_pause(robot: CheckedRobot, is_time: Callable[[str], object]) -> list[str]:
    """At the robot, once, before a request to a path. Returns what is pressed from then on, by anyone: "pause", "resume"."""
    pressed: list[str] = []
    resume = robot.machine.resume

    def press(method: str, path: str) -> None:
        if not pressed and is_time(path):
            pressed.append("pause")
            robot.machine.pause()
            robot.machine.resume = lambda: (pressed.append("resume"), resume())

    robot.asked.before = press
    return pressed


def has_sent(robot: CheckedRobot, request: str) -> int:
    """How often."""
    return robot.asked.writes.count(request)


def runs(robot: CheckedRobot) -> bool:
    robot.machine.catch_up()
    return robot.machine.run is not None and not robot.machine.paused


def is_in_pause(robot: CheckedRobot, number: int) -> bool:
    """The trial's first or second."""
    return robot.machine.paused and has_sent(robot, "PUT /status") == 2 * number - 1


def check_is_paused_and_empty(robot: CheckedRobot) -> None:
    assert (robot.machine.paused, robot.as_it_is()["open"]) == (True, [])


def check_is_left_paused(robot: CheckedRobot, report: Report) -> None:
    check_is_paused_and_empty(robot)
    assert says(report, Topic.LEFT) == (Level.AMBER, "Nothing of the trial is left on it. It is paused")
    assert not report.is_complete
    robot.check_nothing_is_left()


# ---------------------------------------------------------------------- at the robot
@pytest.mark.parametrize("mission", [None, "Home"])
@pytest.mark.parametrize("seconds", [0.0, 0.3])
def test_pause_pressed_while_its_mission_runs_stays(robot, mission, seconds):
    """Also where the app is about to pause it as well."""
    ran_at = []

    def is_time(_path):
        now = robot.asked.clock.monotonic()
        ran_at.extend([now] if runs(robot) else [])
        return ran_at and now - ran_at[0] >= seconds

    pressed = press_pause(robot, is_time)
    report = robot.trial(mission)
    assert pressed == ["pause"]
    assert says(report, Topic.PAUSE) == (Level.AMBER, "Somebody paused it while it was tried")
    check_is_left_paused(robot, report)


@pytest.mark.parametrize(
    ("mission", "is_time"),
    [
        (None, lambda robot: has_sent(robot, "POST /missions")),
        ("Home", lambda robot: has_sent(robot, "PUT /status") == 4 and runs(robot)),
    ],
    ids=["before its first", "after its second"],
)
def test_pause_pressed_before_or_after_the_trials_own_stays(robot, mission, is_time):
    pressed = press_pause(robot, lambda _path: is_time(robot))
    report = robot.trial(mission)
    assert pressed == ["pause"]
    check_is_left_paused(robot, report)


@pytest.mark.parametrize("pauses", [1, 2])
@pytest.mark.parametrize("for_s", [1.0, 2.0])
def test_a_pause_that_was_left_and_has_come_again_stays(robot, pauses, for_s):
    """Released at the robot and paused again, in the first and in the second pause of the trial."""
    left_at = []

    def is_time(path):
        now = robot.asked.clock.monotonic()
        if not left_at and is_in_pause(robot, pauses) and path != "/status":
            robot.machine.resume()
            left_at.append(now)
        return left_at and now - left_at[0] >= for_s

    pressed = press_pause(robot, is_time)
    report = robot.trial("Home")
    assert pressed == ["pause"]
    check_is_left_paused(robot, report)


def test_one_between_two_looks_at_its_state_shows_by_what_has_run(robot):
    """The robot is released and paused again while one answer is waited for."""

    def is_time(_path):
        found = robot.machine.paused and has_sent(robot, "POST /mission_queue") == 4
        if found:
            robot.machine.resume()
            robot.asked.clock.advance(1.5)
            robot.machine.catch_up()
        return found

    pressed = press_pause(robot, is_time)
    report = robot.trial()
    assert pressed == ["pause"]
    assert says(report, Topic.PAUSE) == (Level.RED, "A mission continued while it was in Pause")
    check_is_left_paused(robot, report)


def test_after_an_emergency_stop_it_stays_in_pause(robot):
    pressed_at = []

    def press(_method, _path):
        now = robot.asked.clock.monotonic()
        if not pressed_at and robot.machine.paused and has_sent(robot, "POST /mission_queue"):
            robot.machine.press_emergency_stop(True)
            pressed_at.append(now)
        elif robot.machine.emergency_stop and now - pressed_at[0] > 1.0:
            robot.machine.press_emergency_stop(False)

    robot.asked.before = press
    report = robot.trial()
    assert says(report, Topic.PAUSE) == (Level.AMBER, "Somebody ended the pause of the trial")
    check_is_left_paused(robot, report)


def test_a_robot_that_somebody_released_is_not_paused_again(robot):
    released = []

    def release(_method, _path):
        if not released and robot.machine.paused and has_sent(robot, "POST /mission_queue"):
            released.append(robot.machine.resume())

    robot.asked.before = release
    report = robot.trial()
    assert says(report, Topic.PAUSE) == (Level.AMBER, "Somebody ended the pause of the trial")
    assert says(report, Topic.LEFT)[0] is Level.GREEN
    assert (has_sent(robot, "PUT /status"), robot.machine.paused) == (1, False)


# ---------------------------------------------------------------------- in the app
def test_pause_pressed_in_the_app_while_it_is_undone_stays(robot):
    pressed = []

    def press(method, path):
        if not pressed and method == "DELETE" and path.startswith("/mission_queue") and len(robot.asked.writes) > 5:
            pressed.append(path)
            robot.container.operator.pause(robot.id)

    robot.asked.before = press
    report = robot.trial(is_wanted=lambda: has_sent(robot, "POST /mission_queue") < 2)
    assert pressed
    assert robot.machine.paused
    assert says(report, Topic.LEFT) == (
        Level.GREEN,
        "Nothing of the trial is left on it. It is paused, as somebody wanted",
    )


# ---------------------------------------------------------------------- after the app was killed
RAN, BOOTED = (lambda robot: robot.machine.resume()), (lambda robot: robot.machine.reboot(20))


@pytest.mark.parametrize(
    ("pauses", "happened"), [(1, RAN), (2, RAN), (1, BOOTED)], ids=["ran", "ran, second pause", "booted"]
)
def test_a_robot_that_was_paused_again_since_stays_paused(robot, pauses, happened):
    """It stood in that of the trial's pauses, with missions in its queue, when the app was killed."""

    def die(_method, _path):
        if is_in_pause(robot, pauses) and has_sent(robot, "POST /mission_queue"):
            robot.kill_at(0, is_handled=False)
            raise Killed

    robot.asked.before = die
    with pytest.raises(Killed):
        robot.trial("Home")
    assert robot.as_it_is()["is_paused"]
    robot.start_again()
    happened(robot)
    robot.asked.clock.advance(120)
    robot.machine.catch_up()
    robot.machine.pause()
    assert render(robot.check_ups.put_back(robot.id)) == MAYBE_THEIRS
    check_is_paused_and_empty(robot)
    assert [alarm.code for alarm in robot.container.alarms.open()] == ["check_up_left"]
    assert robot.container.holds.current()
    robot.machine.resume()  # by a person
    assert robot.check_ups.put_back(robot.id) is None
    robot.check_nothing_is_left()
