"""Set-up in Settings: what is done and what is next, from the facts alone."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from app.domain.check_up import Finding, Level, Report, RobotProfile, Topic
from app.domain.models import Connection, Fleet, Mission, Robot, RobotSnapshot, Schedule, Settings
from app.domain.robot import IdentifiedBy
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.setup_view import setup_phrase, step_items, steps
from app.screens.settings.view import section_items
from app.services.files.places import FoundFile

NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)
AINO = Robot("Aino", "http://10.40.12.21", "scheduler", id=1, identified_by=IdentifiedBy.SERIAL_NUMBER)
SISU = replace(AINO, name="Sisu", id=2)
LOAD = Finding(Topic.LOAD, Level.RED, "It booted", "Ask it less")


def report(robot: Robot, *findings: Finding) -> Report:
    return Report(robot.name, robot.address, "MiR250", NOW, 95.0, findings, RobotProfile(None, None))


READY = SettingsFacts(
    settings=Settings(timezone="Europe/Helsinki"),
    robots=(AINO, SISU),
    missions=(Mission("Deliver", "guid", favourite=True, id=10),),
    reports={1: report(AINO), 2: report(SISU)},
    backups=(FoundFile(Path("b.db"), NOW, 5000),),
    country="Finland",
    has_pin=True,
)


def step(facts: SettingsFacts, key: str):
    return next(step for step in steps(facts) if step.key == key)


def test_a_new_tablet_begins_with_its_robots():
    taken = steps(SettingsFacts())
    assert [each.key for each in taken] == ["robots", "check-ups", "missions", "favourites", "days", "backup", "pin"]
    assert setup_phrase(taken) == "0 of 7"
    assert taken[0].intent == (("add", True),)  # the sheet, and no page with one more Add
    buttons = [item.actions[-1] for item in step_items(taken)]
    assert [button.style for button in buttons if button.text] == ["filled", *["outlined"] * 5]
    beside_sheet = [item.actions[-1].style for item in step_items(taken, is_beside_sheet=True)]
    assert "filled" not in beside_sheet
    assert [button.icon for button in buttons if not button.text] == ["chevron-right"]  # no robot yet to check up


def test_a_fleet_is_checked_up_in_the_place_of_its_robots():
    hall = Fleet("Hall 2", "10.0.0.5", id=3)
    through_it = replace(READY, robots=(replace(AINO, fleet=hall, vehicle="7"),), fleets=(hall,), reports={})
    waiting = step(through_it, "check-ups")
    assert (waiting.is_done, waiting.support, waiting.intent) == (False, "Not yet: Hall 2", (("fleet_id", 3),))
    checked = replace(hall, profile=RobotProfile(None, None))
    done = step(replace(through_it, fleets=(checked,)), "check-ups")
    assert (done.is_done, done.support) == (True, "Hall 2")


def test_steps_that_not_every_tablet_needs_can_be_left_out():
    bare = replace(READY, missions=(Mission("Deliver", "guid"),), backups=(), country="", has_pin=False)
    later = [item.key for item in step_items(steps(bare)) if item.actions[0].text == "Not now"]
    assert later == ["favourites", "days", "backup", "pin"]
    assert setup_phrase(steps(replace(bare, steps_left_out=frozenset({"pin"})))) == "3 of 6"
    assert setup_phrase(steps(replace(bare, steps_left_out=frozenset(later)))) == ""


def test_when_all_is_done_set_up_leaves_the_list():
    assert setup_phrase(steps(READY)) == ""
    assert [item.icon for item in step_items(steps(READY))] == ["check"] * 7
    assert "setup" not in [row.key for row in section_items(READY, NOW, "robots")]
    [setup, *_others] = section_items(READY, NOW, "robots", "5 of 7")
    assert (setup.key, setup.support) == ("setup", "5 of 7")


def test_a_robot_that_answered_once_is_not_said_to_answer_while_it_does_not():
    away = replace(READY, snapshots={2: RobotSnapshot(2, Connection.UNREACHABLE)})
    [robots, *_others] = step_items(steps(away))
    assert (robots.icon, robots.tone, robots.support) == ("exclamation-thick", "attention", "No answer: Sisu")
    assert setup_phrase(steps(away)) == ""  # Set-up does not come back for that


@pytest.mark.parametrize(
    ("changed", "key", "support"),
    [
        ({"robots": (AINO, replace(SISU, identified_by=None))}, "robots", "Not yet: Sisu"),
        ({"robots": ()}, "robots", "none yet"),
        ({"reports": {1: report(AINO)}}, "check-ups", "Not yet: Sisu"),
        ({"reports": {1: report(AINO), 2: report(SISU, LOAD)}}, "check-ups", "Sisu: 1 problem"),
        ({"robots": (replace(AINO, software="4"), SISU)}, "check-ups", "Not yet: Aino"),
        ({"missions": ()}, "missions", "none yet"),
        ({"missions": (Mission("Deliver", "guid", id=10),)}, "favourites", "none yet"),
        ({"country": ""}, "days", "Mon–Fri"),
        ({"backups": ()}, "backup", "none yet"),
        ({"has_pin": False}, "pin", "none yet"),
    ],
)
def test_what_is_missing_is_said_and_leads_there(changed, key, support):
    found = step(replace(READY, **changed), key)
    assert (found.support, found.is_done) == (support, False)
    assert found.action


def test_a_schedule_without_a_value_that_its_mission_needs_is_a_step_that_leads_to_it():
    nightly = Schedule("Night count", 1, 10, NOW.replace(tzinfo=None), "UTC", id=7)
    assert setup_phrase(steps(replace(READY, schedules=(nightly,)))) == ""
    found = step(replace(READY, schedules=(nightly,), refused=frozenset([7])), "values")
    assert (found.support, found.is_wrong) == ("Night count: a value is missing or wrong", True)
    assert (found.screen, found.intent) == ("scheduler", (("schedule_id", 7),))


def test_only_a_problem_of_a_check_up_is_amber_and_its_button_shows_it():
    found = replace(READY, reports={1: report(AINO), 2: report(SISU, LOAD)})
    [item] = [item for item in step_items(steps(found)) if item.key == "check-ups"]
    assert (item.tone, item.icon, step(found, "check-ups").intent) == (
        "attention",
        "exclamation-thick",
        (("check_up", 2),),
    )
    assert [item.tone for item in step_items(steps(READY))] == ["neutral"] * 7


def test_a_robot_that_is_off_needs_nothing():
    off = replace(SISU, enabled=False, identified_by=None)
    assert setup_phrase(steps(replace(READY, robots=(AINO, off), reports={1: report(AINO)}))) == ""


def test_working_days_of_every_day_count_as_chosen():
    every_day = Settings(working_days=("MO", "TU", "WE", "TH", "FR", "SA", "SU"))
    assert step(replace(READY, country="", settings=every_day), "days").is_done
