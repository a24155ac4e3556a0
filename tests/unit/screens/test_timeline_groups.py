"""Starts of groups on the timeline: in the lane of the robot that will probably come, marked as a forecast; else in a lane of their own."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.database.robots import Hold
from app.domain.conflicts import ConflictCode
from app.domain.execution import DurationEstimate, Execution, ReasonCode, State, Trigger, Wait
from app.domain.models import Group, Mission, Robot, Schedule, Settings
from app.screens.scheduler import bar_card
from app.screens.scheduler.contested import Contested
from app.screens.scheduler.facts import SchedulerFacts, Window
from app.screens.scheduler.timeline import timeline, with_draft
from app.services.catalogue.preview import Forecast
from app.services.planning.planned import Conflict, PlannedRun, unassigned_robot
from app.services.planning.recurrence import Occurrence

NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)
AINO, SISU = Robot("Aino", "a", id=1), Robot("Sisu", "s", id=2)
HALL, OFFICE = Group("Hall 1", (1, 2), id=5), Group("Office", (1,), id=6)
KITS = Mission("Kits", "k", 1)
SCHEDULE = Schedule("Kits on Hall 1", None, 1, datetime(2026, 11, 20, 13), "UTC", id=7, group_id=5)
AT = NOW + timedelta(minutes=22)
TEN_MIN = DurationEstimate(600.0, 600.0)
FOUND = PlannedRun(AT, SCHEDULE, SISU, KITS, TEN_MIN, group=HALL, begins_at=AT + timedelta(minutes=4))
NOT_FOUND = PlannedRun(AT + timedelta(hours=1), SCHEDULE, unassigned_robot(HALL), KITS, TEN_MIN, group=HALL)
FIXED = PlannedRun(AT, replace(SCHEDULE, id=8, group_id=None, robot_id=1), AINO, KITS, TEN_MIN)
WAITS = Execution(
    Trigger.SCHEDULED,
    None,
    "",
    "Kits",
    "k",
    NOW,
    NOW + timedelta(minutes=15),
    NOW,
    "t",
    "UTC",
    State.WAITING,
    11,
    group_id=5,
    robot_group="Hall 1",
    wait=Wait.ROBOT,
)
FACTS = SchedulerFacts(
    settings=Settings(),
    robots=(AINO, SISU),
    groups=(HALL, OFFICE),
    missions=(KITS,),
    schedules=(SCHEDULE,),
    planned=(FOUND, NOT_FOUND, FIXED),
)


def lanes(facts=FACTS, **window):
    return {lane.key: lane for lane in timeline(facts, NOW, **window).lanes}


def test_a_start_lies_where_the_forecast_has_it_and_says_that_it_is_one():
    [bar] = lanes()[2].bars
    assert (bar.label, bar.shorter, bar.state, bar.movable) == ("≈\N{NO-BREAK SPACE}Kits", (), "planned", False)
    origin = timeline(FACTS, NOW).origin
    assert origin + timedelta(hours=bar.start) == FOUND.begins  # when a robot is free, not when it falls due
    assert [(bar.label, bar.state, bar.movable) for bar in lanes()[1].bars] == [("Kits", "planned", True)]


def test_what_finds_no_robot_has_a_lane_of_its_own_and_without_any_there_is_none():
    assert list(lanes()) == [("group", 5), 1, 2]  # in sight, however many robots there are
    lane = lanes()["group", 5]
    assert (lane.name, [(bar.label, bar.state) for bar in lane.bars]) == ("Any of Hall 1", [("Kits", "planned")])
    assert list(lanes(replace(FACTS, planned=(FOUND, FIXED)))) == [1, 2]


def test_what_waits_for_a_robot_now_is_in_the_lane_of_its_group():
    lane = lanes(replace(FACTS, planned=(), past=(WAITS,)))["group", 5]
    assert [bar.key for bar in lane.bars] == [("execution", 11)]
    card = bar_card.run_card(FACTS, WAITS, NOW)
    assert "any of Hall 1" in card.text
    assert [item.text for item in card.items][:4] == ["Give to a robot", "Priority: Normal", "Hold", "Cancel"]
    held = bar_card.run_card(FACTS, replace(WAITS, held=True), NOW).items
    assert [item.text for item in held][:3] == ["Priority: Normal", "Release", "Cancel"]
    ends = bar_card.run_card(FACTS, replace(WAITS, cancel_code=ReasonCode.USER_CANCELLED), NOW).items
    assert [(item.text, item.off) for item in ends][:2] == [("Cancel", "Being cancelled"), ("Open in Logs", "")]


SEVENTEEN = replace(
    FACTS,
    robots=tuple(Robot(f"Robot {n:02}", "r", id=n) for n in range(1, 18)),
    groups=(Group("Hall 1", tuple(range(1, 9)), id=5), Group("Hall 2", tuple(range(9, 17)), id=6)),
    planned=(),
)


@pytest.mark.parametrize(
    ("chosen", "target"),
    [((), 12), ((1, 2), 12), ((), ("group", 6))],
    ids=["in a folded group", "not among the robots chosen", "a group without starts"],
)
def test_a_draft_is_seen_although_its_lane_was_not(chosen, target):
    plan = timeline(SEVENTEEN, NOW, Window(robots=frozenset(chosen)))
    assert target not in [lane.key for lane in plan.lanes]
    first, *others = with_draft(plan, target, None, Forecast((Occurrence(AT, AT),)), "Kits").lanes
    assert (first.key, [bar.state for bar in first.bars]) == (target, ["draft"])
    assert others == list(plan.lanes)


HOLD = Hold("cleaning", None, NOW, robot_id=1)
LACKING = replace(NOT_FOUND, lacks_mission=True)


@pytest.mark.parametrize(
    ("values", "state", "note"),
    [
        ({"planned": (NOT_FOUND,)}, "planned", "no robot expected"),
        ({"planned": (LACKING,)}, "planned", "none has the mission"),
        ({"planned": (LACKING, NOT_FOUND)}, "planned", "no robot expected"),
        ({"planned": (NOT_FOUND,), "holds": (HOLD,)}, "planned", "no robot expected"),
        ({"planned": (NOT_FOUND,), "holds": (HOLD, replace(HOLD, robot_id=2))}, "held", ""),
    ],
)
def test_the_lane_of_a_group_says_why_no_robot_is_foreseen(values, state, note):
    lane = lanes(replace(FACTS, **values))["group", 5]
    assert ({bar.state for bar in lane.bars}, lane.note) == ({state}, note)


def test_a_start_that_waits_or_has_ended_is_no_lack_of_robots_to_come():
    over = replace(WAITS, state=State.SKIPPED, ended_at=NOW)
    assert [lanes(replace(FACTS, planned=(), past=(row,)))["group", 5].note for row in (WAITS, over)] == [
        "Waits for a robot",
        "",
    ]


def test_the_card_says_what_none_of_the_robots_has():
    assert "No robot of Hall 1 has the mission Kits" in bar_card.start_card(FACTS, LACKING, NOW).text


def test_the_card_at_the_bar_says_that_it_is_a_forecast():
    assert bar_card.start_card(FACTS, FOUND, NOW).text.split("\n") == [
        "any of Hall 1 (≈\N{NO-BREAK SPACE}Sisu) · Fri 20 Nov 13:04–13:14",
        "A forecast: Sisu will probably take it. The robot of Hall 1 is chosen at its time.",
        "Usually 10 min, nine of ten within 10 min",
    ]
    assert "no robot of Hall 1 will be free" in bar_card.start_card(FACTS, NOT_FOUND, NOW).text
    assert "forecast" not in bar_card.start_card(FACTS, FIXED, NOW).text
    assert [item.off for item in bar_card.start_card(FACTS, FOUND, NOW).items if item.key == "move"] == [""]


# ---------------------------------------------------------------------- conflicts
UNTIL = AT + timedelta(minutes=10)
TOO_FEW = Conflict(
    ConflictCode.TOO_FEW_ROBOTS, AT, {"group": "Hall 1", "group_id": 5, "robots": 2, "starts": 4, "until": UNTIL}
)
FULL = Conflict(
    ConflictCode.PLACE_FULL,
    AT,
    {"place": "Dock 2", "place_id": 1, "most": 1, "missions": {"Kits"}, "starts": 2, "until": None},
)
BEHIND = Conflict(
    ConflictCode.CRITICAL_BEHIND,
    AT,
    {"mission": "Kits", "behind": "Bus", "robot": "Aino", "start": UNTIL, "schedule_id": 8},
)
CROWDED = Conflict(ConflictCode.PLACE_CROWDED, AT, {"place": "Dock 2", "place_id": 1, "percent": 80, "until": UNTIL})


@pytest.mark.parametrize(
    ("conflict", "hatched", "words"),
    [
        (TOO_FEW, [2], "At 13:00, 4 starts need the 2 robots of Hall 1, until about 13:10"),
        (FULL, [("group", 5), 1, 2], "At 13:00, 2 missions need Dock 2, which takes 1 at a time"),
        (
            BEHIND,
            [1],
            "Kits at 13:00 usually still runs on Aino when the more important Bus starts at 13:10",
        ),
        (CROWDED, [], ""),
    ],
)
def test_starts_in_conflict_over_a_robot_or_place_are_hatched_and_say_so(conflict, hatched, words):
    facts = replace(FACTS, conflicts=(conflict,))
    found = lanes(facts)
    assert [key for key, lane in found.items() if lane.overlaps] == hatched
    for key in hatched:
        assert list(found[key].overlaps) == [(bar.start, bar.end) for bar in found[key].bars]
    run = FIXED if conflict is BEHIND else FOUND
    lines = bar_card.start_card(facts, run, NOW).text.split("\n")
    assert lines[-1] == (words or "Usually 10 min, nine of ten within 10 min")


def test_a_start_after_a_crowd_is_over_has_no_part_in_it():
    assert lanes(replace(FACTS, conflicts=(TOO_FEW,)))["group", 5].overlaps == ()


def place_full(place_id, begins, until, missions=("Kits",)):
    """From so many minutes after FIXED begins to so many, or with no end that is known."""
    return Conflict(
        ConflictCode.PLACE_FULL,
        AT + timedelta(minutes=begins),
        {
            "place": f"Dock {place_id}",
            "place_id": place_id,
            "most": 1,
            "missions": set(missions),
            "starts": 2,
            "until": None if until is None else AT + timedelta(minutes=until),
        },
    )


@pytest.mark.parametrize(
    ("conflicts", "parts"),
    [
        ([(1, -20, 3), (2, -5, -2)], [0]),  # a later one of another place has ended: the older continues
        ([(1, -20, None), (2, -5, -2)], [0]),
        ([(1, 1, 3), (1, 5, 7), (2, 5, 8)], [0, 1, 2]),  # all of those that are in its time
        ([(2, -9, 1), (1, -8, -3), (1, 9, 12), (2, 10, 12)], [0, 2]),  # it takes 10 minutes
        ([(1, 1, 3, ("Bus",)), (2, 2, 3, ("Bus", "Kits"))], [1]),
    ],
)
def test_a_start_has_a_part_in_every_conflict_of_its_places_in_its_time(conflicts, parts):
    conflicts = [place_full(*each) for each in conflicts]
    assert Contested(conflicts).of(FIXED) == [conflicts[number] for number in parts]


def test_missions_of_one_name_share_the_places_of_that_name_on_every_robot():
    """As at sending: a place counts starts by the name of their mission."""
    own = replace(FIXED, mission=Mission("Kits", "k2", 9, robot_id=1))
    assert Contested([FULL]).of(own) == Contested([FULL]).of(FIXED) == [FULL]
