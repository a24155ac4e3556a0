"""Top bar and banner: the most serious thing first, with the way to where it is solved."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.robots import Hold
from app.domain import rules
from app.domain.execution import Wait
from app.domain.models import Alarm, Priority
from app.screens.common.alarms_view import Act
from app.screens.common.mission_names import NOTHING_KNOWN, MissionNames
from app.screens.frame.facts import OpenIssues, late_starts
from app.screens.frame.view import banner, counting_down, held_back, late_rows, open_lines
from app.services.live.alarms import SENTENCES
from tests.support.alarms import alarm
from tests.support.home_facts import AINO, FACTS, HELD, NOW, RUNNING, SETTINGS, VEIKKO, ago

DOCK = "a1c4e008-5d0f-11ef-93c1-0001297b6e20"
ROBOTS = {robot.id: robot for robot in FACTS.robots}


LATER = NOW + timedelta(hours=1)


def show(*alarms: Alarm, holds=(), late=(), screen="logs"):
    return banner(OpenIssues(alarms, holds, late), ROBOTS, SETTINGS, NOW, screen)


# ---------------------------------------------------------------------- the banner
def test_nothing_wrong_no_banner():
    assert show().text == ""


def test_an_alarm_that_can_not_be_written_is_in_the_banner_though_it_can_not_be_acknowledged():
    assert show(alarm("database", "database", id=0), screen="home").action == "Open settings"


def test_the_worst_robot_is_named_where_none_is_in_sight():
    view = show(alarm("unreachable", "robot:2", details={"robot": "Veikko"}), alarm("emergency_stop"))
    assert (view.text, view.tone) == ("Aino: emergency stop", "fault")
    assert (view.action, view.act, view.about) == ("Show", Act.GO, {"screen": "home", "robot_id": 1})
    assert show(alarm("emergency_stop"), screen="home").text == ""
    assert show(alarm("emergency_stop"), screen="alarms").text == ""


def test_an_emergency_stop_comes_before_errors_that_came_later():
    view = show(
        alarm("emergency_stop", "robot:2", raised_at=ago(minutes=9), details={"robot": "Veikko"}),
        alarm("robot_error", id=2),
    )
    assert view.text == "Veikko: emergency stop"


@pytest.mark.parametrize("values", [{"acknowledged_at": NOW}, {"cleared_at": NOW}, {"shelved_until": LATER}])
def test_what_was_seen_or_shelved_or_is_over_is_only_on_the_page_of_alarms(values):
    assert show(alarm("emergency_stop", **values)).text == ""


@pytest.mark.parametrize("code", ["unauthorized", "wrong_robot", "not_a_robot", "certificate_changed"])
def test_a_problem_of_the_configuration_leads_to_settings(code):
    assert (show(alarm(code)).act, show(alarm(code)).about) == (
        Act.GO,
        {"screen": "settings", "section": "robots", "robot_id": 1},
    )


def test_a_run_that_failed_is_on_the_page_of_alarms_alone():
    assert show(alarm("execution_failed", "schedule:1")).text == ""


@pytest.mark.parametrize("screen", ["home", "logs"])
def test_what_stops_the_whole_plan_is_reported_everywhere(screen):
    view = show(alarm("database", "database", details={"problem": "disk full"}), screen=screen)
    assert view.text == "Nothing is sent, the database can't be written: disk full"
    assert (view.action, view.about) == ("Open settings", {"screen": "settings", "section": "data"})


@pytest.mark.parametrize("code", sorted(SENTENCES))
def test_no_banner_has_a_detail_that_is_not_known(code):
    assert "{" not in show(alarm(code)).text


# ---------------------------------------------------------------------- holds and late starts
def test_a_hold_can_be_released_from_the_banner():
    view = show(holds=[Hold("Maintenance", NOW + timedelta(hours=1))], screen="home")
    assert view.text == "All robots on hold until 15:38 · Maintenance"
    assert (view.action, view.act, view.about) == ("Release", Act.RELEASE, None)
    assert show(holds=[Hold("", None)]).text == "All robots on hold"


def test_a_hold_of_one_robot_names_it():
    view = show(holds=[Hold("", NOW + timedelta(hours=1), robot_id=2)])
    assert (view.text, view.about) == (f"{VEIKKO.name} on hold until 15:38", 2)


def test_the_hold_of_a_check_up_ends_by_itself():
    view = show(holds=[Hold("Check-up", None, robot_id=2)])
    assert (view.text, view.action, view.tone) == (
        f"{VEIKKO.name} on hold: its check-up is not over",
        "Show",
        "neutral",
    )


@pytest.mark.parametrize("screen", ["logs", "scheduler"])
def test_a_high_alarm_comes_before_a_hold_and_a_hold_before_the_rest(screen):
    holds = [Hold("Check-up", None, robot_id=2), Hold("", None)]
    for worse in (alarm("emergency_stop"), alarm("two_tablets", "two_tablets")):
        view = show(worse, holds=holds, screen=screen)
        assert (view.tone, view.text.split(" · ")[1]) == ("fault", "All robots on hold")
    assert show(alarm("unreachable"), holds=holds, screen=screen).act is Act.RELEASE
    seen = alarm("emergency_stop", acknowledged_at=NOW)
    assert show(seen, holds=holds, screen=screen).text == "All robots on hold"


def test_an_implausible_clock_asks_for_a_decision():
    view = show(alarm("clock_implausible", "clock"), holds=[Hold("1 h behind", clock=True)], screen="home")
    assert (view.text, view.action) == ("This clock can't be right. Nothing is sent.", "Decide")


def test_copied_data_comes_first():
    issues = OpenIssues([alarm("emergency_stop")], copy=Hold("copied", is_copy=True))
    view = banner(issues, ROBOTS, SETTINGS, NOW, "logs")
    assert (view.text, view.act) == ("Nothing is sent from this tablet", Act.WHOSE_PLAN)


def test_late_starts_come_before_everything_and_count_down():
    late = replace(HELD, wait=Wait.LATE_START, listed_until=NOW + timedelta(seconds=24))
    assert late_starts([RUNNING, HELD, late], ROBOTS) == [late]
    assert [e.robot for e in late_starts([late], {1: replace(AINO, name="Alma")})] == ["Alma"]
    view = show(alarm("emergency_stop"), late=[late])
    assert (view.text, view.act, view.action) == ("1 starts in 24 s", Act.HOLD, "Hold all")
    several = show(late=[late, replace(late, id=98), replace(late, id=99, held=True, wait=Wait.HOLD)])
    assert (several.text, several.action) == ("2 start in 24 s", "Hold all")


def test_a_late_start_is_named_with_its_values_and_its_group():
    late = replace(HELD, robot_id=None, robot="", robot_group="Hall 1", parameters={"goal": DOCK}, wait=Wait.LATE_START)
    [row] = late_rows([late], MissionNames(names={DOCK: "Dock 3"}), SETTINGS, NOW)
    assert (row.lead, row.title, row.support) == ("14:35", "Waste to compactor · Dock 3", "Hall 1 · 3 min late")
    assert [action.text for action in row.actions] == ["Don't start", "Start"]


def test_a_late_start_that_may_have_run_can_not_be_started():
    held = replace(HELD, id=5, held=True, wait=Wait.HOLD)
    asked = replace(HELD, id=6, wait=Wait.ELSEWHERE, wait_details=rules.LISTED_LATER)
    late = late_starts([asked, held], ROBOTS)
    rows = late_rows(late, NOTHING_KNOWN, SETTINGS, NOW)
    assert [(row.title, row.support) for row in rows] == [
        ("Waste to compactor", "Aino · on hold, not run from 14:50"),
        ("May have run already", ""),
        ("Waste to compactor", "Asking Aino, until 14:50"),
    ]
    assert [[action.name for action in row.actions] for row in rows] == [["drop", "start"], [], ["drop"]]
    assert counting_down(late) == []


def test_what_is_due_at_once_is_counted_before_a_hold_is_released():
    waits = replace(HELD, wait=Wait.HOLD, held=False)
    issues = OpenIssues(holds=[Hold()], waiting_for_hold=[waits, replace(waits, robot_id=2)])
    assert (held_back(issues, None, NOW), held_back(issues, 1, NOW)) == (2, 0)
    both = replace(issues, holds=[Hold(), Hold(robot_id=2)])
    assert held_back(both, None, NOW) == 1


def test_late_starts_that_are_held_are_not_forgotten():
    late = replace(HELD, wait=Wait.LATE_START, listed_until=NOW + timedelta(seconds=21))
    held = replace(late, id=99, held=True, wait=Wait.HOLD)
    assert late_starts([RUNNING, held, late], ROBOTS) == [held, late]
    assert show(alarm("emergency_stop"), late=[held]).tone == "fault"  # nothing runs away
    view = show(late=[held])
    assert (view.text, view.act, view.action) == ("1 late start on hold", Act.LATE_STARTS, "Show")


def test_the_page_lists_alarms_only_the_most_serious_first():
    alarms = (
        alarm("app_was_off", "app", id=1),
        alarm("emergency_stop", id=2),
        alarm("unreachable", "robot:2", id=3),
        alarm("robot_error", id=4, shelved_until=LATER),
    )
    assert [group[0].id for group in open_lines(alarms, NOW)] == [2, 3, 1]


def test_priorities_are_those_of_the_list():
    assert list(Priority) == [Priority.HIGH, Priority.MEDIUM, Priority.LOW]
