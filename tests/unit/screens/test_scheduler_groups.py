"""What the Scheduler says of groups of robots."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, date, datetime, time, timedelta
from types import SimpleNamespace

import pytest

from app.database.robots import Hold
from app.domain.models import Group, InvalidInput, Mission, Overlap, Robot, Schedule
from app.screens.common import priorities
from app.screens.scheduler import form_view, of_groups, view
from app.screens.scheduler.draft import Draft
from app.screens.scheduler.facts import SchedulerFacts
from app.screens.scheduler.form_notes import Preview
from app.services.catalogue.preview import Forecast
from app.services.planning.recurrence import Occurrence

NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)
AINO, SISU, VEIKKO = (Robot(name, f"10.0.0.{n}", id=n) for n, name in enumerate(("Aino", "Sisu", "Veikko"), 1))
HALL = Group("Hall 1", (1, 2), id=5)
KITS, CHARGE, OWN = Mission("Kits", "k", 1), Mission("Charge", "c", 2), Mission("Charge", "own", 3, robot_id=2)
SCHEDULE = Schedule(
    "Kits on Hall 1",
    None,
    1,
    datetime(2026, 11, 23, 6, 30),
    "UTC",
    id=7,
    group_id=5,
    next_at=datetime(2026, 11, 23, 6, 30, tzinfo=UTC),
)
FACTS = SchedulerFacts(robots=(AINO, SISU, VEIKKO), groups=(HALL,), missions=(KITS, CHARGE, OWN), schedules=(SCHEDULE,))
DRAFT = Draft(date(2026, 11, 23), time(6, 30), "UTC", mission_id=1)


def test_groups_are_offered_before_robots_with_their_members():
    assert [(option.key, option.text, option.note) for option in of_groups.target_options(FACTS)][:2] == [
        (("group", 5), "Any of Hall 1", "Aino, Sisu"),
        (1, "Aino", ""),
    ]


@pytest.mark.parametrize(
    ("last", "words"),
    [
        (None, "any of Hall 1 · in 2 d"),
        (SimpleNamespace(robot="Sisu"), "any of Hall 1 (last: Sisu)"),
        (SimpleNamespace(robot=""), "any of Hall 1"),
    ],
)
def test_the_list_names_the_group_and_the_robot_that_came_last(last, words):
    assert words.startswith(of_groups.whose(FACTS, SCHEDULE, last))
    assert of_groups.whose(FACTS, SCHEDULE, last)[:13] == "any of Hall 1"


def test_a_made_name_is_no_name_and_a_group_that_is_off_says_so():
    (row,) = view.schedule_rows(FACTS, NOW)
    assert (row.title, row.aside) == ("Kits", "")
    asleep = replace(FACTS, robots=(replace(AINO, enabled=False), replace(SISU, enabled=False), VEIKKO))
    assert view.schedule_rows(asleep, NOW)[0].support.endswith(" · no robot of the group is switched on")


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ({1: {"x": "X"}, 2: {"x": "X"}}, "no robot of the group has the mission"),
        ({1: {"x": "X"}}, ""),
        ({1: {"x": "X"}, 2: {"k": "Kits"}}, ""),
    ],
)
def test_a_schedule_says_that_no_robot_of_its_group_has_its_mission(names, words):
    assert view.schedule_rows(replace(FACTS, names=names), NOW)[0].support.partition(" · ")[2] == words


def test_the_next_start_of_the_form_is_held_where_all_robots_of_the_group_are():
    forecast = Preview(Forecast((Occurrence(SCHEDULE.next_at, SCHEDULE.start),)))
    draft = DRAFT.aimed_at(("group", 5))
    both = (
        Hold("cleaning", None, NOW, robot_id=1),
        Hold("cleaning", SCHEDULE.next_at + timedelta(hours=1), NOW, robot_id=2),
    )
    shown = [
        form_view.present(replace(FACTS, holds=holds), draft, forecast, NOW).starts[0].text
        for holds in (both[:1], both)
    ]
    assert [text.endswith("not run") for text in shown] == [False, True]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, ""),
        ({"priority": 2}, " · Critical"),
        ({"finish_by_minutes": 90}, " · to be done within 1 h 30 min"),
        ({"priority": -1, "finish_by_minutes": 30}, " · Low · to be done within 30 min"),
    ],
)
def test_the_list_says_what_matters_more_and_what_has_to_be_done_in_time(values, words):
    [row] = view.schedule_rows(replace(FACTS, schedules=(replace(SCHEDULE, **values),)), NOW)
    assert row.support == "Once, Mon 23 Nov 06:30" + words


def test_a_message_calls_a_schedule_of_a_group_by_what_it_does_without_the_number():
    assert [
        FACTS.called(replace(SCHEDULE, name=name)) for name in ("Kits on Hall 1", "Kits on Hall 1 2", "Shift bus")
    ] == ["Kits on Hall 1", "Kits on Hall 1", "Shift bus"]


@pytest.mark.parametrize(
    ("target", "is_listed"), [(None, True), (1, True), (3, False), (("group", 5), True), (("group", 6), False)]
)
def test_schedules_of_a_robot_are_those_of_its_groups_too(target, is_listed):
    assert bool(view.schedule_rows(FACTS, NOW, view.Listing(target=target))) is is_listed


def test_missions_of_a_group_say_who_lacks_them():
    known = replace(FACTS, names={1: {"k": "Kits", "c": "Charge"}, 2: {"own": "Charge"}})
    assert [(option.key, option.note) for option in form_view.mission_options(known, ("group", 5))] == [
        (2, ""),
        (1, "not on Sisu"),
    ]
    nowhere = replace(FACTS, names={1: {"x": "X"}, 2: {"x": "X"}})
    assert form_view.mission_options(nowhere, ("group", 5)) == []


def test_what_only_a_group_can_do_is_dropped_for_a_robot():
    draft = replace(DRAFT.aimed_at(("group", 5)), overlap=Overlap.PARALLEL, finish_by_minutes=30)
    made = draft.schedule()
    assert (made.robot_id, made.group_id, made.overlap, made.finish_by_minutes) == (None, 5, Overlap.PARALLEL, 30)
    made = draft.aimed_at(2).schedule()
    assert (made.robot_id, made.group_id, made.overlap, made.finish_by_minutes) == (2, None, Overlap.SKIP, None)
    with pytest.raises(InvalidInput, match="Choose a robot"):
        DRAFT.schedule()


def test_a_stored_draft_of_a_group_makes_the_schedule_it_came_from():
    stored = replace(SCHEDULE, overlap=Overlap.PARALLEL, finish_by_minutes=45, priority=7)
    assert Draft.of(stored).schedule() == stored
    assert Draft.of(stored).is_stored
    assert Draft.of(stored, FACTS.name(stored)).is_stored  # its name says what it does where


@pytest.mark.parametrize(
    ("number", "word"), [(-9, "Low"), (-1, "Low"), (0, "Normal"), (1, "High"), (2, "Critical"), (70, "Critical")]
)
def test_priorities_in_words(number, word):
    assert priorities.word(number) == word


def test_parallel_is_offered_to_groups_only():
    of_robot, of_group = (
        form_view.present(FACTS, DRAFT.aimed_at(target), Preview(), NOW).overlaps for target in (1, ("group", 5))
    )
    assert [key for key, _word in of_robot] == ["skip", "queue"]
    assert [key for key, _word in of_group] == ["skip", "queue", "parallel"]
