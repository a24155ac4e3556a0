"""The file of a check-up makes a simulated robot that is found to be the same, and has no secrets."""
from __future__ import annotations

import json

import pytest

from app.domain.check_up import Report, RobotProfile, Topic, Trial
from app.services.files.check_up_file import simulator_profile
from mir_sim import DEVIANTS, deviant
from mir_sim.profile import Profile, profile_of
from tests.support.asked_robot import START, TOKEN
from tests.support.checked_robot import CheckedRobot

NOT_LEARNED = {"german-texts", "fleet"}      # all that it says, and who else queues there


def check_up(directory, profile: Profile | None = None) -> Report:
    directory.mkdir()
    robot = CheckedRobot(directory, profile)
    return robot.check_ups.run(robot.id, Trial())


def levels(report: Report) -> dict[Topic, str]:
    return {finding.topic: finding.level for finding in report.findings}


@pytest.mark.parametrize("name", sorted(set(DEVIANTS) - NOT_LEARNED))
def test_a_robot_made_from_the_file_is_found_to_be_the_same(tmp_path, name):
    found = check_up(tmp_path / "found", deviant(name))
    again = check_up(tmp_path / "again", profile_of(json.loads(simulator_profile(found))))
    assert levels(again) == levels(found)


@pytest.mark.parametrize(("software", "taken"), [("2.14.7", "2.14.7"), ("2.10.3.1", "2.14.7"), ("3.6.0", "3.5.4"), ("3.8.1", "3.8.1"),
                                                 ("4.0", "3.8.1"), ("?", "3.5.4"), (None, "3.5.4")])
def test_the_simulator_knows_the_nearest_definition(software, taken):
    report = Report("Aino", "http://10.0.0.1", "MiR250", START, 95.0, (), RobotProfile("1", software))
    assert profile_of(json.loads(simulator_profile(report))).software == taken


def test_words_ids_and_descriptions_that_a_trial_has_found_are_in_it():
    profile = RobotProfile("1", "3.5.4", token_field="order_description", item_states={"Fertig": "Done", "Weg": "Cancelled"},
                           gives_id=False, order_status=200)
    made = profile_of(json.loads(simulator_profile(Report("Aino", "http://10.0.0.1", "MiR250", START, 95.0, (), profile))))
    assert made.description_field == "order_description"
    assert made.item_states == {"Done": "Fertig", "Cancelled": "Weg"}
    assert made.fields == {"order": {"state"}}
    assert made.order_status == 200
    forgets = RobotProfile("1", "3.5.4", token_field="")
    made = profile_of(json.loads(simulator_profile(Report("Aino", "http://10.0.0.1", "MiR250", START, 95.0, (), forgets))))
    assert made.description_text == ""


def test_it_has_neither_password_nor_token_nor_serial_number(tmp_path):
    report = check_up(tmp_path / "found", deviant("cancelled"))
    text = simulator_profile(report)
    assert str(report.profile.serial_number) not in text
    assert TOKEN.header.split()[-1] not in text
    assert "distributor" not in text
