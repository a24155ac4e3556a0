"""Entries of the form while other things happen: they are being saved, the schedule is changed or deleted elsewhere."""

from __future__ import annotations

import threading
from dataclasses import replace
from datetime import time, timedelta

import pytest

from app.domain.robot import MissionParameter
from app.widgets.flow import ParameterFields
from app.widgets.snackbar import Snackbar
from tests.ui.planner import (
    KITS,
    PALLETS,
    bring_back,
    choose,
    leave_entries,
    other,
    said,
    save,
    save_button,
    schedules,
    settle,
    stock,
    stored,
)


# ---------------------------------------------------------------------- while it is being saved
def test_a_form_that_is_being_saved_is_not_put_aside(screen, container, ui, slow):
    choose(screen, ui, "Mission", KITS)
    before = len(schedules(container))
    ui.tap(save_button(ui))
    screen.plan.edit(stock(container).id)
    slow.set()
    settle(screen, ui)
    assert len(schedules(container)) == before + 1
    assert screen.plan.form.editing == stock(container).id
    assert said(screen) == [f"{KITS} on Aino is planned"]


@pytest.mark.parametrize("then", ["saved", "left and brought back"])
def test_changes_during_saving_belong_to_the_saved_schedule(screen, container, ui, slow, then):
    choose(screen, ui, "Mission", KITS)
    before = {schedule.id for schedule in schedules(container)}
    ui.tap(save_button(ui))
    screen.plan.form.set(priority=3)
    if then != "saved":
        screen.plan.edit(stock(container).id)
    slow.set()
    settle(screen, ui)
    if then != "saved":
        bring_back(screen, ui)
    assert not screen.plan.form.draft.is_new
    save(screen, ui)
    added = [schedule for schedule in schedules(container) if schedule.id not in before]
    assert [schedule.priority for schedule in added] == [3]


def test_a_refusal_is_said_of_what_was_refused_which_is_put_aside(screen, container, ui, refused):
    choose(screen, ui, "Mission", KITS)
    entered = screen.plan.form.draft
    ui.tap(save_button(ui))
    screen.plan.edit(stock(container).id)
    refused.set()
    settle(screen, ui)
    assert screen.plan.form.view.why == ""
    assert said(screen) == [f"{KITS}: Choose another name"]
    bring_back(screen, ui)
    assert screen.plan.form.draft == entered


def test_another_one_is_saved_while_the_first_is_still_being_written(screen, container, ui, monkeypatch):
    go, write = threading.Event(), container.catalogue.save_schedule
    monkeypatch.setattr(container.catalogue, "save_schedule", lambda schedule: go.wait(30) and write(schedule))
    choose(screen, ui, "Mission", KITS)
    before = len(schedules(container))
    ui.tap(save_button(ui))
    screen.plan.edit(stock(container).id)
    screen.plan.form.set(priority=3)
    ui.advance(1)  # the button rests
    assert not save_button(ui).busy
    ui.tap(save_button(ui))
    ui.wait(lambda: stock(container).priority == 3)
    assert len(schedules(container)) == before
    go.set()
    settle(screen, ui)
    assert (len(schedules(container)), screen.plan.form.is_open) == (before + 1, False)
    assert sorted(said(screen)) == [f"{KITS} on Aino is planned", "Night stock count on Aino is changed"]


# ---------------------------------------------------------------------- what is shown of it
def test_the_starts_that_are_shown_are_those_of_the_schedule_in_the_form(screen, container, ui, monkeypatch):
    other(screen, container, ui)
    assert screen.plan.form.view.starts
    go, foresee = threading.Event(), container.forecasts.of
    monkeypatch.setattr(container.forecasts, "of", lambda *args: go.wait(30) and foresee(*args))
    screen.plan.edit(stock(container).id)
    ui.advance(0.5)
    assert screen.plan.form.view.starts == ()
    go.set()
    settle(screen, ui)
    assert screen.plan.form.view.starts


def test_parameters_are_those_of_the_schedule_in_the_form(screen, container, ui, monkeypatch):
    """Two schedules have the same mission and robot."""
    monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: (PALLETS,))
    first = container.catalogue.save_schedule(replace(stock(container), parameters={"count": 5}))
    second = container.catalogue.save_schedule(replace(first, id=0, name="Second", parameters={"count": 9}))
    for schedule, count in ((first, "5"), (second, "9"), (first, "5")):
        settle(screen, ui)
        screen.plan.edit(schedule.id)
        settle(screen, ui)
        assert ui.find(ParameterFields).values() == {"count": count}


def test_parameters_in_an_open_form_are_those_after_an_undo(screen, container, ui, monkeypatch):
    monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: (PALLETS,))
    schedule = container.catalogue.save_schedule(replace(stock(container), parameters={"count": 5}))
    settle(screen, ui)
    screen.plan.edit(schedule.id)
    typed(screen, ui, "9")
    save(screen, ui)
    screen.plan.edit(schedule.id)
    settle(screen, ui)
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    assert ui.find(ParameterFields).values() == {"count": "5"}
    screen.plan.form.set(priority=3)
    settle(screen, ui)
    save(screen, ui)
    assert stored(container, schedule).parameters == {"count": 5}


# ---------------------------------------------------------------------- what was typed for the mission
def typed(screen, ui, count: str) -> None:
    settle(screen, ui)
    ui.find(ParameterFields).children[0].text = count
    ui.advance(0.2)


@pytest.mark.parametrize("new", [True, False])
def test_parameters_that_were_typed_are_put_aside_and_brought_back(screen, container, ui, monkeypatch, new):
    monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: (PALLETS,))
    if new:
        choose(screen, ui, "Mission", "Bring pallet to dock")
    else:
        screen.plan.edit(stock(container).id)
    typed(screen, ui, "37")
    other(screen, container, ui)
    bring_back(screen, ui)
    assert ui.find(ParameterFields).values() == {"count": "37"}
    save(screen, ui)
    assert [schedule.parameters for schedule in schedules(container) if schedule.parameters] == [{"count": 37}]


def test_text_that_was_typed_and_removed_is_no_entry(screen, container, ui, monkeypatch):
    monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: (PALLETS,))
    schedule = container.catalogue.save_schedule(replace(stock(container), parameters={"count": 5}))
    settle(screen, ui)
    screen.plan.edit(schedule.id)
    typed(screen, ui, "7")
    typed(screen, ui, "5")
    other(screen, container, ui)
    assert said(screen) == []


@pytest.mark.long
def test_a_position_that_another_robot_does_not_list_is_no_longer_chosen(screen, container, ui, monkeypatch):
    dock = MissionParameter("goal", "Goal", choices=(("g-1", "Dock"),), sets="position")
    press, aino = replace(dock, choices=(("g-2", "Press"),)), stock(container).robot_id
    monkeypatch.setattr(
        container.robot_missions, "parameters", lambda robot, _guid: (dock if robot == aino else press,)
    )
    choose(screen, ui, "Mission", "Bring pallet to dock")
    settle(screen, ui)
    ui.find(ParameterFields).children[0].chosen = "g-1"
    assert screen.plan.form.parameters.values() == {"goal": "g-1"}
    choose(screen, ui, "Robot", "Veikko")
    assert ui.find(ParameterFields).values() == {"goal": None}
    assert screen.plan.form.parameters.values() is None


def test_parameters_of_another_mission_are_not_filled_in(screen, container, ui, monkeypatch):
    monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: (PALLETS,))
    choose(screen, ui, "Mission", "Bring pallet to dock")
    typed(screen, ui, "37")
    choose(screen, ui, "Mission", KITS)
    settle(screen, ui)
    assert ui.find(ParameterFields).values() == {"count": "2"}


# ---------------------------------------------------------------------- the schedule is changed or deleted elsewhere
@pytest.mark.parametrize("is_left", [False, True])
def test_values_saved_elsewhere_stay_where_nothing_was_entered(screen, container, ui, is_left):
    if is_left:
        leave_entries(screen, container, ui, priority=3)
    else:
        screen.plan.edit(stock(container).id)
        screen.plan.form.set(priority=3)
    changed = container.catalogue.save_schedule(
        replace(stock(container), name="Inventory", minimum_battery_percent=55.0)
    )
    container.pausing.pause(changed.id, container.clock.now() + timedelta(days=5))
    container.catalogue.switch_schedule(changed.id, False)
    settle(screen, ui)
    if is_left:
        bring_back(screen, ui)
    save(screen, ui)
    after = stored(container, changed)
    assert (after.name, after.priority, after.minimum_battery_percent, after.enabled) == ("Inventory", 3, 55, False)
    assert after.paused_until is not None


def test_times_entered_are_not_written_over_those_saved_elsewhere(screen, container, ui):
    screen.plan.edit(stock(container).id)
    screen.plan.form.set(at=time(5, 45))
    changed = container.catalogue.save_schedule(replace(stock(container), recurrence="FREQ=WEEKLY;BYDAY=TU"))
    settle(screen, ui)
    save(screen, ui)
    assert screen.plan.form.view.why == f"{changed.name} has been changed since you opened it: open it again"
    assert stored(container, changed).recurrence == "FREQ=WEEKLY;BYDAY=TU"


def test_a_robot_that_was_renamed_takes_no_name_from_its_schedules(screen, container, ui):
    screen.plan.edit(stock(container).id)
    screen.plan.form.set(priority=3)
    aino = next(robot for robot in container.catalogue.robots() if robot.name == "Aino")
    container.catalogue.save_robot(replace(aino, name="Aino the first"))
    settle(screen, ui)
    save(screen, ui)
    after = stored(container, next(schedule for schedule in schedules(container) if schedule.priority == 3))
    assert after.name == "Night stock count on Aino the first"


def test_unsaved_entries_are_restored_with_a_deleted_schedule(screen, container, ui):
    before = len(schedules(container))
    screen.plan.edit(stock(container).id)
    screen.plan.form.set(priority=3, name="Count")
    screen.plan.delete(stock(container))
    settle(screen, ui)
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))  # the schedule itself
    settle(screen, ui)
    bring_back(screen, ui)
    assert (screen.plan.form.draft.is_new, screen.plan.form.draft.name) == (False, "Count")
    save(screen, ui)
    assert len(schedules(container)) == before
    assert [schedule.name for schedule in schedules(container) if schedule.priority == 3] == ["Count"]


def test_an_open_form_without_entries_shows_the_schedule_after_an_undo(screen, container, ui):
    schedule = stock(container)
    screen.plan.edit(schedule.id)
    screen.plan.form.set(minimum_battery_percent=40)
    settle(screen, ui)
    save(screen, ui)
    screen.plan.edit(schedule.id)
    settle(screen, ui)
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    assert screen.plan.form.draft.minimum_battery_percent == schedule.minimum_battery_percent != 40
    screen.plan.form.set(minimum_battery_percent=40)
    settle(screen, ui)
    save(screen, ui)
    assert stored(container, schedule).minimum_battery_percent == 40


def test_entries_for_a_schedule_that_was_deleted_elsewhere_are_refused(screen, container, ui):
    screen.plan.edit(stock(container).id)
    screen.plan.form.set(name="Count")
    container.catalogue.remove_schedule(stock(container).id)
    settle(screen, ui)
    save(screen, ui)
    assert (screen.plan.form.view.why, screen.plan.form.draft.name) == ("This schedule no longer exists", "Count")
