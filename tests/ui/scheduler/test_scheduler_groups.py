"""The Scheduler with a group of robots, as a planner uses it: form, timeline, list."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, time

import pytest

from app.domain.models import Group, Overlap, Schedule
from app.widgets.buttons import CommandButton, MenuChip, Segment
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.fields import Field
from app.widgets.lanes import Lanes
from tests.support import month
from tests.ui.planner import KITS, card_of, choose, named, new, reveal, row, save, schedules, settle, tab, tap_bar


@pytest.fixture
def hall(screen, container, ui):
    """All robots in one group, with a schedule of its own this evening."""
    catalogue = container.catalogue
    group = catalogue.save_group(Group("Hall 1", tuple(robot.id for robot in catalogue.robots())))
    mission = next(mission for mission in catalogue.missions() if mission.name == KITS)
    catalogue.save_schedule(
        Schedule("", None, mission.id, datetime(2026, 11, 20, 17, 0), month.ZONE, group_id=group.id)
    )
    settle(screen, ui)
    return group


def test_the_bar_of_a_group_says_that_its_robot_is_a_forecast(screen, container, hall, ui):
    schedule = named(container, KITS, "Hall 1")
    bars = [
        (lane.name, bar)
        for lane in ui.find(Lanes).lanes
        for bar in lane.bars
        if bar.key[:2] == ("schedule", schedule.id)
    ]
    [(name, bar)] = bars
    assert (bar.label, bar.state) == (f"≈\N{NO-BREAK SPACE}{KITS}", "planned")
    tap_bar(ui, ("schedule", schedule.id))
    card = card_of(ui)
    assert f"any of Hall 1 (≈\N{NO-BREAK SPACE}{name})" in card.text
    assert "A forecast: " in card.text
    assert "Edit" in [item.text for item in card.items]


def test_the_list_says_any_of_the_group_and_is_narrowed_to_it(screen, container, hall, ui):
    schedule = named(container, KITS, "Hall 1")
    tab(screen, ui, "schedules")
    ui.tap(ui.find(MenuChip, text="Robot"))
    ui.wait(lambda: ui.find_all(ChoiceSheet))
    ui.advance(0.3)
    assert [option.text for option in ui.find(ChoiceSheet).options][:2] == ["All robots", "Any of Hall 1"]
    ui.tap(ui.find(OptionRow, title="Any of Hall 1"))
    settle(screen, ui)
    assert [item.key for item in screen.plan.listed.rows] == [schedule.id]
    assert row(ui, schedule).item.place == "any of Hall 1"


def test_options_of_a_group_are_chosen_by_taps_and_saved(screen, container, hall, ui):
    choose(screen, ui, "Robot", "Any of Hall 1")
    choose(screen, ui, "Mission", KITS)
    screen.plan.form.more = True
    settle(screen, ui)
    finish = ui.find(Field, label="Must be done")
    assert "Whenever" in ui.texts(finish)
    reveal(ui, finish)
    ui.type(finish, "30")
    ui.tap(ui.find(CommandButton, finish, icon="plus"))
    assert finish.value == 45
    for word in ("Beside it", "Critical"):
        segment = ui.find(Segment, text=word)
        reveal(ui, segment)
        ui.tap(segment)
        settle(screen, ui)
    save(screen, ui)
    made = max(schedules(container), key=lambda schedule: schedule.id)
    assert (made.robot_id, made.group_id, made.priority, made.finish_by_minutes, made.overlap) == (
        None,
        hall.id,
        2,
        45,
        Overlap.PARALLEL,
    )


def test_back_to_one_robot_nothing_of_the_group_stays(screen, container, hall, ui):
    screen.plan.edit(named(container, KITS, "Hall 1").id)
    screen.plan.form.set(overlap=Overlap.PARALLEL, finish_by_minutes=15)
    settle(screen, ui)
    choose(screen, ui, "Robot", "Aino")
    assert not ui.find_all(Field, label="Must be done")
    save(screen, ui)
    made = next(
        schedule
        for schedule in schedules(container)
        if schedule.robot_id is not None and schedule.start.time() == time(17, 0)
    )
    assert (made.group_id, made.finish_by_minutes, made.overlap) == (None, None, Overlap.SKIP)


def test_priority_of_one_robot_is_four_words_too_and_a_number_of_a_file_is_kept(screen, container, hall, ui):
    schedule = next(schedule for schedule in schedules(container) if schedule.robot_id is not None)
    container.catalogue.save_schedule(replace(schedule, priority=7))
    settle(screen, ui)
    screen.plan.edit(schedule.id)
    settle(screen, ui)
    assert screen.plan.form.more  # it is not at its default
    assert ui.find(Segment, text="Critical").selected
    assert screen.plan.form.draft.priority == 7
    reveal(ui, ui.find(Segment, text="Low"))
    ui.tap(ui.find(Segment, text="Low"))
    settle(screen, ui)
    save(screen, ui)
    assert next(each for each in schedules(container) if each.id == schedule.id).priority == -1


def test_a_site_without_a_group_has_no_word_of_them(screen, container, ui):
    assert container.catalogue.groups() == []
    new(screen, ui)
    ui.tap(ui.find(Field, label="Robot"))
    ui.wait(lambda: ui.find_all(ChoiceSheet))
    assert [option.text for option in ui.find(ChoiceSheet).options] == [
        robot.name for robot in container.catalogue.robots()
    ]
    ui.key(27)
    assert [lane.name for lane in ui.find(Lanes).lanes] == [robot.name for robot in container.catalogue.robots()]
