"""Top bar and banner: the most serious thing first, with the way to where it is solved."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.robots import Hold
from app.domain.models import Alarm, Connection, Priority, Wait
from app.domain.robot import RobotState
from app.screens.common.alarms_view import NOWHERE, Act, Here
from app.screens.common.mission_names import MissionNames
from app.screens.common.robot_groups import Group
from app.screens.frame.facts import OpenIssues, late_starts
from app.screens.frame.view import banner, issue_entry, open_issues, picker_title, robot_option, top_bar
from app.services.live.alarms import SENTENCES
from tests.support.alarms import alarm
from tests.support.home_facts import AINO, EXECUTING, FACTS, HELD, NOW, RUNNING, SETTINGS, VEIKKO, ago, silent, snapshot

DOCK = "a1c4e008-5d0f-11ef-93c1-0001297b6e20"
ROBOTS = {robot.id: robot for robot in FACTS.robots}


def show(*alarms: Alarm, holds=(), late=(), here=NOWHERE):
    return banner(OpenIssues(alarms, holds, late), ROBOTS, SETTINGS, NOW, here)


HOME = Here("home", 1)


# ---------------------------------------------------------------------- the bar
def test_bar_and_list_say_how_many_of_many_robots_need_help():
    groups = [Group.READY, Group.STOPPED, Group.WORKING, Group.SILENT]
    assert top_bar(AINO, snapshot(1, EXECUTING), SETTINGS, NOW, groups).help_count == "2"
    assert top_bar(AINO, snapshot(1, EXECUTING), SETTINGS, NOW, groups[:3]).help_count == ""
    assert top_bar(AINO, snapshot(1, EXECUTING), SETTINGS, NOW, [Group.READY] * 4).help_count == ""
    assert picker_title(groups) == "Robot · 2 need you"
    assert picker_title([Group.READY] * 4) == "Robot"


def test_the_bar_shows_time_in_the_zone_of_the_settings_and_the_robot_with_its_age():
    bar = top_bar(AINO, snapshot(1, EXECUTING), SETTINGS, NOW)
    assert bar.clock == "14:38"
    assert (bar.robot, bar.link, bar.link_tone) == ("Aino", "Connected · now", "neutral")


def test_without_a_robot_the_bar_says_so():
    assert top_bar(None, None, SETTINGS, NOW).robot == "No robot"


def test_the_list_of_robots_shows_state_and_battery():
    assert robot_option(AINO, snapshot(1, EXECUTING), SETTINGS, NOW, [Hold(robot_id=1)]).note.startswith(
        "Working, held · "
    )
    option = robot_option(AINO, snapshot(1, EXECUTING), SETTINGS, NOW)
    assert (option.text, option.note) == ("Aino", "Working · 78 %")
    assert (
        robot_option(AINO, silent(AINO, EXECUTING, minutes=4), SETTINGS, NOW).note == "No answer · –"
    )  # old, not as it is now


def test_the_robots_that_need_help_stand_out_among_those_to_choose_from():
    """Their number is in the title."""
    paused = replace(EXECUTING, state=RobotState.PAUSE)
    assert robot_option(AINO, snapshot(1, EXECUTING), SETTINGS, NOW).tone == "neutral"
    assert robot_option(AINO, snapshot(1, paused), SETTINGS, NOW).tone == "action"


# ---------------------------------------------------------------------- the banner
def test_nothing_wrong_no_banner():
    assert show().text == ""


def test_an_emergency_stop_says_what_to_do_and_leads_to_the_robot():
    view = show(alarm("emergency_stop"))
    assert view.text == "Aino is stopped: emergency stop pressed"
    assert view.note == "Since 14:36 · release the red button, then press Reset on the robot"
    assert (view.tone, view.action, view.act, view.about) == ("fault", "Show Aino", Act.SHOW_ROBOT, 1)
    assert view.others == "Details"


def test_where_the_robot_is_on_screen_already_it_can_be_acknowledged():
    view = show(alarm("emergency_stop", id=8), here=HOME)
    assert (view.action, view.act, view.about) == ("Acknowledge", Act.ACKNOWLEDGE, 8)
    assert show(alarm("emergency_stop", acknowledged_at=NOW), here=HOME).act is Act.NOTHING


def test_an_error_is_shown_in_full_by_the_banner_or_the_card():
    assert show(alarm("robot_error")).text == "Aino: it broke"
    view = show(alarm("robot_error"), here=HOME)
    assert (view.text, view.note) == ("Aino reports an error", "Since 14:36")
    view = show(alarm("emergency_stop"), here=HOME)
    assert (view.text, view.note) == ("Aino is stopped: emergency stop pressed", "Since 14:36")


def test_an_acknowledged_alarm_is_calm_and_says_when_it_began():
    view = show(alarm("emergency_stop", acknowledged_at=NOW, note="Pallet fell over"))
    assert (
        view.note
        == "Acknowledged 14:38: Pallet fell over · Since 14:36 · release the red button, then press Reset on the robot"
    )
    assert (view.tone, view.calm, view.icon) == ("fault", True, "bell-check-outline")
    assert not show(alarm("emergency_stop")).calm
    several = show(
        *(alarm("unreachable", f"robot:{n}", id=n, acknowledged_at=NOW, details={"robot": f"R{n}"}) for n in range(3))
    )
    assert (several.calm, several.icon) == (True, "bell-check-outline")
    assert several.note.startswith("Acknowledged 14:38 · ")


@pytest.mark.parametrize(
    "code", ["unauthorized", "wrong_robot", "not_a_robot", "certificate_changed", "certificate_untrusted"]
)
def test_a_problem_of_the_configuration_leads_to_settings(code):
    assert (show(alarm(code)).act, show(alarm(code)).about) == (Act.ROBOT_SETTINGS, 1)


def test_the_most_serious_comes_first_and_the_others_are_counted():
    view = show(alarm("app_was_off", "app"), alarm("unreachable", "robot:2"), alarm("robot_error"))
    assert view.text == "Aino: it broke"
    assert view.others == "+2 more"


def test_an_emergency_stop_comes_before_errors_that_came_later():
    view = show(
        alarm("emergency_stop", "robot:2", raised_at=ago(minutes=9), details={"robot": "Veikko"}),
        alarm("robot_error", id=2),
    )
    assert (view.text, view.others) == ("Veikko is stopped: emergency stop pressed", "+1 more")
    over = show(
        alarm("emergency_stop", "robot:2", cleared_at=NOW, details={"robot": "Veikko"}), alarm("robot_error", id=2)
    )
    assert over.text == "Aino: it broke"


def test_a_new_alarm_comes_before_a_more_serious_one_that_was_acknowledged():
    assert (
        show(alarm("emergency_stop", acknowledged_at=NOW), alarm("unreachable", "robot:2")).text
        == "Aino doesn't answer"
    )


def test_a_cleared_alarm_stays_until_acknowledged_and_says_that_it_is_over():
    view = show(alarm("unreachable", cleared_at=NOW))
    assert view.tone == "neutral"
    assert view.text == "Over: Aino doesn't answer"
    assert view.note == "Over since 14:38"
    assert view.act is Act.ACKNOWLEDGE


def test_shelved_alarms_are_out_of_the_way():
    assert show(alarm("unreachable", shelved_until=NOW + timedelta(hours=1))).text == ""
    assert show(alarm("unreachable", shelved_until=ago(hours=1))).text != ""


@pytest.mark.parametrize("code", sorted(SENTENCES))
def test_every_alarm_makes_a_banner(code):
    view = show(alarm(code))
    assert len(view.text) > 8
    assert "{" not in view.text + view.note
    assert view.note


# ---------------------------------------------------------------------- holds and late starts
def test_a_hold_can_be_released_from_the_banner():
    view = show(holds=[Hold("Late starts", None)])
    assert view.text == "Nothing is sent to any robot"
    assert view.note == "Held until released · Late starts"
    assert (view.action, view.act, view.about) == ("Release", Act.RELEASE, None)


def test_a_hold_of_one_robot_names_it():
    view = show(holds=[Hold("", NOW + timedelta(hours=1), robot_id=2)])
    assert view.text == f"Nothing is sent to {VEIKKO.name}"
    assert view.note == "Held until 15:38"
    assert view.about == 2


def test_a_high_alarm_comes_before_a_hold_and_a_hold_before_the_rest():
    hold = Hold("", None)
    assert show(alarm("emergency_stop"), holds=[hold]).act is Act.SHOW_ROBOT
    assert show(alarm("unreachable"), holds=[hold]).act is Act.RELEASE


def test_an_implausible_clock_is_reported_by_its_alarm_alone():
    view = show(alarm("clock_implausible", "clock"), holds=[Hold("1 h behind", clock=True)])
    assert "clock" in view.text
    assert view.others == "Details"


def test_late_starts_come_before_everything_and_count_down():
    late = replace(HELD, wait=Wait.LATE_START, listed_until=NOW + timedelta(seconds=24))
    assert late_starts([RUNNING, HELD, late], ROBOTS) == [late]
    assert [e.robot for e in late_starts([late], {1: replace(AINO, name="Alma")})] == ["Alma"]
    view = show(alarm("emergency_stop"), late=[late])
    assert view.text == "1 late mission starts in 24 s"
    assert view.note == "Due while the app was off: Waste to compactor on Aino (14:35)"
    assert (view.act, view.action, view.others) == (Act.HOLD, "Hold", "+1 more")


def test_a_late_start_that_no_robot_has_yet_names_its_group():
    late = replace(
        HELD,
        robot_id=None,
        robot="",
        robot_group="Hall 1",
        wait=Wait.LATE_START,
        listed_until=NOW + timedelta(seconds=24),
    )
    assert (
        show(late=late_starts([late], ROBOTS)).note == "Due while the app was off: Waste to compactor on Hall 1 (14:35)"
    )


def test_the_button_says_that_it_holds_all_late_starts():
    late = replace(HELD, wait=Wait.LATE_START, listed_until=NOW + timedelta(seconds=24))
    issues = OpenIssues(late_starts=[late, replace(late, id=98), replace(late, id=99, held=True, wait=Wait.HOLD)])
    one = replace(issues, late_starts=issues.late_starts[1:])
    assert [banner(each, ROBOTS, SETTINGS, NOW).action for each in (issues, one)] == ["Hold all", "Hold"]


def test_a_late_start_is_named_with_its_values():
    late = replace(HELD, wait=Wait.LATE_START, listed_until=NOW + timedelta(seconds=24), parameters={"goal": DOCK})
    issues = OpenIssues(late_starts=[late], mission_names=MissionNames(names={DOCK: "Dock 3"}))
    assert (
        banner(issues, ROBOTS, SETTINGS, NOW).note
        == "Due while the app was off: Waste to compactor · Dock 3 on Aino (14:35)"
    )


def test_late_starts_that_are_held_are_neither_counted_down_nor_forgotten():
    late = replace(HELD, wait=Wait.LATE_START, listed_until=NOW + timedelta(seconds=21))
    held = replace(late, id=99, held=True, wait=Wait.HOLD)
    assert late_starts([RUNNING, held, late], ROBOTS) == [held, late]
    assert banner(OpenIssues(late_starts=[held, late]), ROBOTS, SETTINGS, NOW).text == "1 late mission starts in 21 s"
    assert show(alarm("emergency_stop"), late=[held, late]).text == "1 late mission starts in 21 s"
    assert show(alarm("emergency_stop"), late=[held]).tone == "fault"  # nothing runs away
    view = banner(OpenIssues(late_starts=[held]), ROBOTS, SETTINGS, NOW)
    assert (view.text, view.act, view.action) == ("1 late mission is held", Act.LATE_STARTS, "Show")


def test_the_banner_counts_what_the_list_shows_and_shows_its_first_line():
    late = replace(HELD, wait=Wait.LATE_START, listed_until=NOW + timedelta(seconds=24))
    issues = OpenIssues(
        (
            alarm("app_was_off", "app", id=1),
            alarm("emergency_stop", id=2),
            alarm("unreachable", "robot:2", id=3),
            alarm("robot_error", id=4, shelved_until=NOW + timedelta(hours=1)),
        ),
        [Hold("fire drill", None), Hold("", None, robot_id=2), Hold("", clock=True)],
        [late],
    )
    lines = [issue_entry(issue, ROBOTS, SETTINGS, NOW) for issue in open_issues(issues, ROBOTS, SETTINGS, NOW)]
    assert [line.key for line in lines] == [
        ("late", 0),
        ("alarm", 2),
        ("hold", 0),
        ("hold", 2),
        ("alarm", 3),
        ("alarm", 1),
    ]
    assert [line.action for line in lines] == [
        "Hold",
        "Acknowledge",
        "Release",
        "Release",
        "Acknowledge",
        "Acknowledge",
    ]
    view = banner(issues, ROBOTS, SETTINGS, NOW)
    assert (view.text, view.others) == (lines[0].text, "+5 more")


def test_priorities_are_those_of_the_list():
    assert list(Priority) == [Priority.HIGH, Priority.MEDIUM, Priority.LOW]


def test_an_unreachable_robot_shows_in_the_bar():
    bar = top_bar(AINO, snapshot(1, EXECUTING, connection=Connection.UNREACHABLE), SETTINGS, NOW)
    assert (bar.link, bar.link_tone, bar.link_icon) == ("No answer since 14:18", "attention", "wifi-off")
