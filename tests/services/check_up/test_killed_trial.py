"""A trial that is cut off at any moment leaves nothing on the robot once the app runs again."""

from __future__ import annotations

import itertools

import pytest

from app.domain.check_up import Level, Trial
from app.mir.errors import ConnectionLost, Unreachable
from mir_sim import deviant
from tests.support.check_up_site import CheckedRobot, Killed

pytestmark = pytest.mark.usefixtures("quick_reading")


def requests_of(directory, profile, trial) -> tuple[int, int]:
    """How many there are until the first that changes something, and in all."""
    robot = CheckedRobot(directory, profile)
    robot.check_ups.run(robot.id, trial)
    first = next(number for number, request in enumerate(robot.asked.requests) if request in robot.asked.writes)
    return first, len(robot.asked.requests)


@pytest.mark.parametrize(
    ("name", "mission", "is_handled", "every"),
    [
        (None, None, True, 5),
        *(
            pytest.param(*way, 1, marks=pytest.mark.long)
            for way in (
                (None, None, True),
                (None, None, False),
                (None, "Home", True),
                ("forgets-descriptions", "Home", True),
                ("german-states", None, True),
            )
        ),
    ],
)
def test_whenever_it_is_killed_the_robot_is_restored(tmp_path, name, mission, is_handled, every):
    """At each of so many requests."""
    profile = deviant(name) if name else None
    first, of = requests_of(tmp_path / "whole", profile, Trial(mission))
    for number in range(first, of + 1, every):
        robot = CheckedRobot(tmp_path / str(number), profile)
        robot.kill_at(number, is_handled=is_handled)
        with pytest.raises(Killed):
            robot.trial(mission)
        robot.start_again()
        robot.clean_up()
        robot.check_is_restored(number)
        robot.container.db.close()


LOST, REFUSED = ConnectionLost(address="10.0.0.1"), Unreachable(code="refused", address="10.0.0.1")


@pytest.mark.long
@pytest.mark.parametrize("error", [LOST, REFUSED])
def test_a_robot_that_goes_away_for_a_request_is_restored_at_the_end(tmp_path, error):
    first, of = requests_of(tmp_path / "whole", None, Trial())
    for number in range(first, of + 1):
        robot = CheckedRobot(tmp_path / str(number))
        count = itertools.count(1)
        robot.asked.gives(error, lambda method, path, count=count, number=number: next(count) == number)
        report = robot.trial()
        assert report.is_complete or any(
            finding.topic.is_tried and finding.level is not Level.GREEN for finding in report.findings
        ), number
        robot.check_is_restored(number)
        robot.container.db.close()
