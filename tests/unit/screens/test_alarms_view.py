"""Alarms in words: the state of each, since when and how often, and that every kind leads somewhere sensible."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.domain.message import message_of
from app.domain.models import Alarm
from app.mir.errors import Unreachable
from app.screens.common.alarm_groups import alarm_item, menu_of_group
from app.screens.common.alarms_view import (
    Act,
    Way,
    alarm_note,
    alarm_text,
    bell,
    past_count,
    way_to,
)
from app.services.live.alarms import EVENTS, SENTENCES
from tests.support.alarms import alarm
from tests.support.home_facts import FACTS, NOW, SETTINGS, ago

ROBOTS = {robot.id: robot for robot in FACTS.robots}
UNKNOWN_NAME = Unreachable(code="unknown_name", host="mir7.plant")
LATER = NOW + timedelta(hours=1, minutes=22)


def note(shown_alarm: Alarm) -> str:
    return alarm_note(shown_alarm, SETTINGS, NOW)


def item(shown_alarm: Alarm):
    return alarm_item((shown_alarm,), ROBOTS, SETTINGS, NOW)


def buttons(shown_alarm: Alarm) -> list[str]:
    return [action.text or action.name for action in item(shown_alarm).actions]


# ---------------------------------------------------------------------- since when, how often
def test_repeats_are_counted_and_the_last_one_has_its_time():
    again = alarm("unreachable", raised_at=ago(hours=2), last_at=ago(minutes=36), count=4)
    assert note(again) == "4 times, last 14:02 · Is it switched on?"
    assert note(replace(again, last_at=None)).startswith("4 times · ")  # of a version that did not note it


def test_a_silent_robot_comes_with_what_was_tried_and_what_to_check():
    refused = alarm("unreachable", details={"robot": "Aino", "problem": message_of(UNKNOWN_NAME.at("mir7.plant"))})
    assert alarm_text(refused, SETTINGS, NOW).startswith("Aino does not answer: ")
    assert note(refused) == "the name mir7.plant is not known on this network: check it or enter the IP address"


def test_recovery_is_reported_with_its_time():
    over = item(alarm("unreachable", raised_at=ago(hours=1), cleared_at=ago(minutes=28)))
    assert (over.lead, over.support, over.strong) == ("13:38", "Over since 14:10", True)


def test_an_event_has_the_time_of_the_last_one():
    assert item(alarm("clock_stepped", "clock")).lead == "14:36"
    again = item(alarm("clock_stepped", "clock", count=2, last_at=ago(minutes=1)))
    assert (again.lead, again.support) == ("14:37", "2 times, last 14:37")


def test_instants_in_an_alarm_are_reported_in_the_zone_of_the_settings():
    assert alarm_text(alarm("app_was_off", "app"), SETTINGS, NOW) == "The app was off or asleep from 12:38 to 13:38"


def test_the_alarm_of_a_double_start_advises_to_cancel_one():
    twice = alarm("started_twice", "execution:9", details={"mission": "Kits", "robot": "Aino", "other": "Veikko"})
    assert alarm_text(twice, SETTINGS, NOW) == "Kits reached Aino after all and had been started on Veikko too"
    assert note(twice) == "cancel those that have not run and are not needed"


# ---------------------------------------------------------------------- where it leads
HOME = Act.GO, {"screen": "home", "robot_id": 1}
SETUP = Act.GO, {"screen": "settings", "section": "robots", "robot_id": 1}
DATA = Act.GO, {"screen": "settings", "section": "data"}
LOGS = Act.GO, {"screen": "logs", "unfiltered": True}
RUN = Act.GO, {"screen": "logs", "execution_id": 9}
DESTINATIONS = {  # code: (key as the services give it, what the button does, about what)
    "question": ("robot:1", *HOME),
    "robot_error": ("robot:1", *HOME),
    "emergency_stop": ("robot:1", *HOME),
    "unreachable": ("robot:1", *HOME),
    "unauthorized": ("robot:1", *SETUP),
    "not_a_robot": ("robot:1", *SETUP),
    "wrong_robot": ("robot:1", *SETUP),
    "certificate_changed": ("robot:1", *SETUP),
    "certificate_untrusted": ("robot:1", *SETUP),
    "same_machine": ("serial:25", *SETUP),
    "serial_hidden": ("robot:1", *SETUP),
    "needs_password": ("robot:1", *SETUP),
    "execution_failed": ("schedule:7", Act.SCHEDULE_RUN, 7),
    "execution_skipped": ("manual:1", *LOGS),
    "start_refused": ("schedule:7:robot:1", *LOGS),
    "executions_missed": ("plan", *LOGS),
    "unknown_outcome": ("execution:9", *RUN),
    "duplicate_healed": ("execution:9", *RUN),
    "duplicate_running": ("execution:9", *HOME),
    "started_twice": ("execution:9", *HOME),
    "robot_fails": ("robot:1", *HOME),
    "unmarked_copy": ("execution:9", *HOME),
    "check_up_outdated": ("robot:1", *SETUP),
    "check_up_left": ("robot:1", *HOME),
    "database": ("database", *DATA),
    "backup_failed": ("backup", *DATA),
    "late_cancelled": ("execution:9", *RUN),
    "adopted_unproven": ("execution:9", *RUN),
    "item_unreadable": ("execution:9", *RUN),
    "clock_implausible": ("clock", Act.CLOCK_IS_RIGHT, None),
    "app_was_off": ("app", None, None),
    "backup_restored": ("app", None, None),
    "clock_stepped": ("clock", None, None),
    "two_tablets": ("tablet", None, None),
    "chore_failed": ("chore:Serving commands", None, None),
    "pin_guessed": ("settings", None, None),
    "zone_guessed": ("tablet", Act.TIME_ZONE, None),
    "zone_unknown": ("zone:7", None, None),
    "lock_lost": ("app", None, None),
    "too_few_files": ("app", None, None),
    "network_lost": ("tablet", None, None),
    "tablet_battery_low": ("tablet", None, None),
    "disk_nearly_full": ("tablet", *DATA),
    "clock_not_synchronised": ("tablet", None, None),
}


def test_every_kind_of_alarm_has_a_destination_or_needs_none():
    assert DESTINATIONS.keys() == SENTENCES.keys()


@pytest.mark.parametrize("code", sorted(SENTENCES))
def test_each_leads_to_where_it_is_solved(code):
    key, act, about = DESTINATIONS[code]
    way = way_to(alarm(code, key), ROBOTS)
    if act is None:
        assert way is None
    else:
        assert way is not None
        assert way.word
        assert (way.act, way.about) == (act, about)


@pytest.mark.parametrize("code", sorted(SENTENCES.keys() - EVENTS))
def test_an_ended_alarm_needs_no_solution(code):
    assert way_to(alarm(code, DESTINATIONS[code][0], cleared_at=NOW), ROBOTS) is None


def test_a_question_can_be_answered_where_the_robot_gives_answers():
    asked = alarm("question", details={"robot": "Aino", "question": "Loaded?", "answers": ["Yes", "No"]})
    assert (alarm_text(asked, SETTINGS, NOW), note(asked)) == ("Aino asks: Loaded?", "answers: Yes / No")
    assert way_to(asked, ROBOTS) == Way("Answer", *HOME)
    without = alarm("question", details={"robot": "Aino", "question": "Loaded?", "answers": []})
    assert note(without) == "answer it at the robot"
    assert way_to(without, ROBOTS) == Way("Show", *HOME)
    assert way_to(replace(asked, cleared_at=NOW), ROBOTS) is None


def test_the_alarm_of_a_deleted_robot_leads_nowhere():
    unreachable = alarm("unreachable", "robot:99", details={"robot": "Nobody"})
    assert way_to(unreachable, ROBOTS) is None
    assert buttons(unreachable) == ["Acknowledge", "menu"]


# ---------------------------------------------------------------------- rows and menus
def test_a_row_acknowledges_leads_to_the_solution_and_has_the_rest_in_its_menu():
    stop = item(alarm("emergency_stop"))
    assert (stop.key, stop.whole, stop.tone, stop.loud) == (("alarm", 1), "Aino · Emergency stop", "fault", True)
    assert stop.support == "Release the red button. Then press Reset on the robot."
    assert buttons(alarm("emergency_stop")) == ["Acknowledge", "Show", "menu"]
    assert [(entry.key, entry.text) for entry in menu_of_group((alarm("emergency_stop"),))] == [
        ("note", "Acknowledge with a note"),
        (1, "Shelve for 1 hour"),
        (4, "Shelve for 4 hours"),
        (8, "Shelve for 8 hours"),
        (24, "Shelve for 24 hours"),
    ]


def test_the_error_of_a_robot_has_the_words_of_home_its_own_in_quotes_and_can_be_reset():
    row = item(alarm("robot_error", "robot:1", details={"robot": "Aino", "problem": "Failed to dock to 'Dock 3' (42)"}))
    assert row.whole == "Aino · Can't dock at Dock 3"
    assert row.support == "Clear the place. Then reset. “Failed to dock to 'Dock 3' (42)”"
    assert [action.text or action.name for action in row.actions] == ["Acknowledge", "Reset errors", "menu"]


def test_a_question_is_blue():
    row = item(alarm("question", details={"robot": "Aino", "question": "Is it loaded?", "answers": ["Yes", "No"]}))
    assert (row.tone, row.loud, row.icon) == ("action", False, "comment-question")


def test_an_acknowledged_one_says_when_and_with_what_note():
    seen = alarm("emergency_stop", acknowledged_at=ago(minutes=1), note="Pallet fell over")
    assert (buttons(seen), item(seen).strong) == (["Show", "menu"], False)
    assert note(seen).endswith(" · Seen 14:37: “Pallet fell over”")
    assert note(replace(seen, note="")).endswith(" · Seen 14:37")
    assert menu_of_group((seen,))[0].key == 1


def test_the_alarm_that_cannot_be_written_can_be_neither_acknowledged_nor_shelved():
    assert buttons(alarm("database", "database", id=0)) == ["Open settings"]


def test_a_shelved_one_can_be_unshelved_and_a_past_one_has_no_button():
    shelved = item(alarm("emergency_stop", shelved_until=LATER))
    assert (buttons(alarm("emergency_stop", shelved_until=LATER)), shelved.tone) == (["Unshelve"], "neutral")
    assert shelved.support.startswith("Shelved until 16:00")
    past = alarm("emergency_stop", cleared_at=NOW, acknowledged_at=NOW)
    assert (buttons(past), item(past).tone) == ([], "neutral")
    assert note(past) == "Over since 14:38 · Seen 14:38"


def test_counts_are_reported():
    assert past_count(50, 312) == "The newest 50 of 312"
    assert (past_count(1, 1), past_count(3, 3)) == ("1 past alarm", "3 past alarms")
    assert [bell(2, 3, 1)[1], bell(0, 3, 1)[1], bell(0, 0, 1)[1]] == ["2", "", ""]
    assert len({bell(2, 3, 1)[0], bell(0, 0, 1)[0], bell(0, 0, 0)[0]}) == 3
