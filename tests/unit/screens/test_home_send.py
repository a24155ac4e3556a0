"""Sending the robot: its tiles, all its missions, and what the sheet of a mission says before it runs."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.robots import Hold
from app.domain.execution import DurationEstimate
from app.domain.models import Group, HandOver, Mission
from app.screens.home.facts import HomeFacts
from app.screens.home.send import TILES, SendView, all_missions, send_view, tiles
from app.screens.home.view import present
from tests.support.home_facts import (
    AINO,
    CHARGING,
    COILS,
    EMPTIES,
    FACTS,
    FAILED,
    HELD,
    KITS,
    NOW,
    PALLET,
    QUEUE,
    READY,
    SETTINGS,
    VEIKKO,
    ago,
    with_aino,
    without_aino,
)

HALL = Group("Hall 1", (1, 2), id=5)
USUAL = {
    mission.guid: DurationEstimate(seconds, seconds)
    for mission, seconds in ((KITS, 390.0), (EMPTIES, 480.0), (PALLET, 600.0))
}
USUAL[HELD.mission_guid] = DurationEstimate(300.0, 300.0)


def sheet(facts: HomeFacts, group_id: int | None = None, mission: Mission = KITS) -> SendView:
    return send_view(facts, facts.robot, present(facts, NOW).card, mission, group_id, USUAL, NOW)


def on_hall(**changes) -> SendView:
    mission = changes.pop("mission", KITS)
    return sheet(replace(FACTS, groups=(HALL,), **changes), 5, mission)


# ---------------------------------------------------------------------- which missions
def test_five_missions_are_one_tap_away_favourites_first():
    assert [tile.text for tile in tiles(replace(FACTS, missions=(*FACTS.missions, COILS)))] == [
        "Collect empties",
        "Deliver kits to line 2",
        "Return to charger",
        "Bring pallet to dock",
        "Waste to compactor",
    ]


def test_tiles_have_their_places_before_the_missions_of_the_robot_are_read():
    shown = tiles(FACTS.about(2))
    assert [tile.text for tile in shown] == [""] * TILES


def test_all_missions_can_be_searched_and_those_that_the_robot_lacks_say_so():
    facts = replace(FACTS, entered=(*FACTS.missions, COILS))
    assert next(row for row in all_missions(facts, AINO, {}, "") if row.title == KITS.name).meta == "–"
    rows = {row.title: row for row in all_missions(facts, AINO, USUAL, "")}
    assert (rows[KITS.name].icon, rows[KITS.name].meta) == ("star", "6 min")
    assert (rows["Waste to compactor"].icon, rows["Waste to compactor"].meta) == ("play-circle-outline", "5 min")
    assert (rows[COILS.name].meta, rows[COILS.name].opens) == ("Not on Aino", False)
    found = all_missions(facts, AINO, USUAL, " KITS")
    assert [row.title for row in found[:-1]] == [KITS.name]
    assert found[-1].key == "fetch"


# ---------------------------------------------------------------------- when it starts
@pytest.mark.parametrize(
    ("facts", "starts", "why"),
    [
        (FACTS, "Starts about 15:03", "After 4 others. 78 % battery is enough."),
        (replace(with_aino(READY, ()), open=()), "Starts now", "64 % battery is enough."),
        (replace(with_aino(CHARGING, QUEUE[:1]), open=()), "Starts now", "Battery 19 %, minimum 30 %."),
        (without_aino(), "Sent when Aino answers", "Waits until 14:53 at most. Battery not known, minimum 30 %."),
        (
            replace(FACTS, holds=(Hold("Audit", NOW + timedelta(minutes=10), ago(minutes=1)),)),
            "Starts after 14:48",
            "78 % battery is enough.",
        ),
    ],
)
def test_the_sheet_says_when_it_starts_and_why_then(facts, starts, why):
    shown = sheet(facts)
    assert (shown.starts, shown.why) == (starts, why)


def test_an_unknown_duration_makes_no_time():
    facts = replace(FACTS, open=())
    view = send_view(facts, AINO, present(facts, NOW).card, KITS, None, {}, NOW)
    assert (view.starts, view.why) == ("Starts in its turn", "After 3 others. 78 % battery is enough.")


def test_under_the_minimum_the_button_says_that_it_runs_all_the_same():
    low = sheet(with_aino(replace(READY, battery_percentage=12.0), ()))
    assert (low.text, low.tone, low.off) == ("Run anyway on Aino", "attention", "")
    assert sheet(FACTS).text == "Run on Aino"
    without = replace(FACTS, settings=replace(SETTINGS, minimum_battery_percent=None))
    assert sheet(without).why == "After 4 others."


def test_what_can_not_be_sent_says_why():
    assert sheet(with_aino(FAILED)).off == "Reset errors first"


# ---------------------------------------------------------------------- on a group
def test_a_mission_can_run_on_any_robot_of_its_groups():
    view = on_hall()
    assert [(option.text, option.selected) for option in view.targets] == [("Aino", False), ("Any of Hall 1", True)]
    assert (view.text, view.starts, view.why) == (
        "Run on any of Hall 1",
        "Starts on the first free robot",
        "Waits until 14:53 at most.",
    )
    assert sheet(FACTS).targets == ()
    assert sheet(replace(FACTS, groups=(replace(HALL, members=(2,)),))).targets == ()


@pytest.mark.parametrize(
    ("changes", "off"),
    [
        ({"robots": (AINO, VEIKKO)}, ""),
        ({"known": {1: {"other"}, 2: {"other"}}}, "No robot of Hall 1 has this mission"),
        ({"known": {1: {"other"}, 2: {KITS.guid}}}, ""),
        ({"known": {1: {"other"}}}, ""),  # the other one may have it
        ({"mission": Mission("Own", "g", 77, robot_id=1)}, "This mission is for one robot only"),
        (
            {"robots": tuple(replace(robot, enabled=False) for robot in (AINO, VEIKKO))},
            "No robot of Hall 1 is switched on",
        ),
        ({"holds": (Hold("Audit"),)}, ""),
    ],
)
def test_the_sheet_says_what_prevents_it(changes, off):
    assert on_hall(**changes).off == off


def test_robots_of_the_group_that_lack_it_are_named():
    assert on_hall(known={1: {KITS.guid}, 2: {"other"}}, all_missions=(KITS,)).why.endswith("Not on Veikko.")


def test_a_group_that_sends_at_once_does_not_say_that_it_waits():
    at_once = replace(HALL, hand_over=HandOver.AT_ONCE)
    shown = replace(FACTS, groups=(at_once,))
    assert sheet(shown, 5).starts == "Starts at once, also on a busy robot"
    assert sheet(replace(shown, holds=(Hold("Audit"),)), 5).starts == "Queue, on hold"
