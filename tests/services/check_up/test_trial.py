"""What a check-up tries: each deviant is reported under the topics in which it differs and no others, and the robot is
restored."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from app.domain.check_up import Level, RobotProfile, Topic
from mir_sim import DEVIANTS, deviant
from tests.services.check_up.test_reading import EMPTY, SIMULATED
from tests.services.check_up.test_reading import NAMED as READ
from tests.support.check_up_site import CheckedRobot
from tests.support.findings import in_words, not_green

AMBER = Level.AMBER
# The topics that are not green, besides those that are read.
TRIED: Mapping[str, dict[Topic, Level]] = {
    "forgets-descriptions": {Topic.RECOGNISED: AMBER},
    "renames-descriptions": {Topic.RECOGNISED: AMBER},
    "moves-descriptions": {Topic.RECOGNISED: AMBER},
    "no-id": {Topic.ORDER: AMBER},
    "german-texts": {Topic.CANCELLED: AMBER},
    "german-states": {Topic.WORDS: AMBER, Topic.CANCELLED: AMBER},
    "cancelled": {Topic.CANCELLED: AMBER},
}
# What else than on a faithful robot stands in the profile.
KNOWN: Mapping[str, dict[str, object]] = {
    "forgets-descriptions": {"token_field": ""},
    "renames-descriptions": {"token_field": ""},
    "moves-descriptions": {"token_field": "order_description"},
    "no-id": {"gives_id": False},
    "german-texts": {"cancelled_message": "Abgebrochen - Benutzeranforderung"},
    "german-states": {
        "item_states": {"Ausstehend": "Pending", "Aktiv": "Executing", "Fertig": "Done", "Abgebrochen": "Aborted"}
    },
    "cancelled": {"item_states": {"Cancelled": "Cancelled"}, "cancelled_message": None},
}
FAITHFUL = {
    "token_field": "description",
    "item_states": {},
    "cancelled_message": "Aborted - User Request",
    "gives_id": True,
    "order_status": 201,
    "priority_counts": False,
}


def tried(profile: RobotProfile) -> dict[str, object]:
    return {name: getattr(profile, name) for name in FAITHFUL}


@pytest.mark.parametrize(
    ("software", "history", "mission"),
    [("2.14.7", 400, None), ("3.5.4", 400, None), ("3.5.4", 0, "Home"), ("3.8.1", 0, None), ("3.8.1", 400, "Home")],
)
def test_a_faithful_robot_is_green(tmp_path, software, history, mission):
    robot = CheckedRobot(tmp_path, software=software, history=history)
    report = robot.trial(mission)
    assert not_green(report) == SIMULATED | ({} if history else EMPTY), in_words(report)
    assert [finding.topic for finding in report.findings] == sorted(
        Topic, key=[each.topic for each in report.findings].index
    )
    assert tried(report.profile) == FAITHFUL
    assert report.is_complete
    assert robot.check_ups.report(robot.id) == report
    assert robot.container.catalogue.robot(robot.id).profile == report.profile
    robot.check_is_restored()


@pytest.mark.parametrize("name", DEVIANTS)
def test_each_deviant_is_named_by_what_differs(tmp_path, name):
    robot = CheckedRobot(tmp_path, deviant(name))
    robot.asked.clock.advance(3630)
    report = robot.trial()
    assert not_green(report) == {**SIMULATED, **READ[name], **TRIED.get(name, {})}, in_words(report)
    assert tried(report.profile) == FAITHFUL | KNOWN.get(name, {})
    assert report.is_complete
    robot.check_is_restored()
