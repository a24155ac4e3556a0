"""Changes while the robot is asked or the schedule is being written."""

from __future__ import annotations

import threading
from dataclasses import replace

import pytest

from app.services.live.changes import Topic
from app.widgets.flow import ParameterFields
from tests.ui.planner import (
    KITS,
    PALLETS,
    bring_back,
    choose,
    new,
    save,
    save_button,
    schedules,
    settle,
    stock,
    stored,
)

pytestmark = pytest.mark.long


def test_typed_values_count_although_the_robot_does_not_answer(screen, container, ui, hanging):
    schedule = container.catalogue.save_schedule(replace(stock(container), parameters={"count": 5}))
    settle(screen, ui)
    screen.plan.edit(schedule.id)
    ui.wait(lambda: ui.find(ParameterFields).children)
    ui.find(ParameterFields).children[0].text = "9"
    ui.advance(0.2)
    ui.advance(4)
    ui.tap(save_button(ui))
    ui.wait(lambda: not screen.plan.form.is_open)
    hanging.set()
    settle(screen, ui)
    assert stored(container, schedule).parameters == {"count": 9}


def test_without_an_answer_the_form_says_what_is_not_known_until_it_comes(screen, container, ui, hanging, monkeypatch):
    monkeypatch.setattr(
        container.robot_missions, "parameters", lambda _robot_id, _guid: hanging.wait(30) and (PALLETS,)
    )
    new(screen, ui)
    screen.plan.form.set(mission_id=next(one.id for one in container.catalogue.missions() if one.name == KITS))
    ui.advance(0.2)
    assert "Asking Aino …" in ui.texts()
    ui.advance(4)
    words = "Aino has not said which values this mission needs. Nothing is sent without them"
    assert (words in ui.texts(), save_button(ui).disabled) == (True, False)
    hanging.set()
    ui.wait(lambda: ui.find(ParameterFields).children)
    assert words not in ui.texts()


def test_a_robot_that_failed_is_asked_again_with_the_next_reading(screen, container, ui, hanging, monkeypatch):
    answers = iter((OSError("no answer"), (PALLETS,)))

    def parameters(_robot_id, _guid):
        if isinstance(answer := next(answers), OSError):
            raise answer
        return answer

    monkeypatch.setattr(container.robot_missions, "parameters", parameters)
    choose(screen, ui, "Mission", KITS)
    assert screen.plan.form.parameters.silent == "Aino"
    container.changes.publish(Topic.SETTINGS)
    ui.wait(lambda: ui.find(ParameterFields).children)
    assert screen.plan.form.parameters.silent == ""


def test_a_late_failure_says_nothing_of_the_robot_that_is_asked_now(screen, container, ui, hanging, monkeypatch):
    def parameters(robot_id, _guid):
        hanging.wait(30)
        raise OSError(f"{robot_id}: no answer")

    monkeypatch.setattr(container.robot_missions, "parameters", parameters)
    new(screen, ui)
    form, kits = screen.plan.form, next(one.id for one in container.catalogue.missions() if one.name == KITS)
    form.set(mission_id=kits)
    ui.advance(0.2)
    asked = form.parameters.asking
    go, _known = threading.Event(), hanging.set()
    monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: go.wait(30) and ())
    form.set(robot_id=next(robot.id for robot in container.catalogue.robots() if robot.name != asked))
    ui.advance(1)
    assert form.parameters.asking not in ("", asked)
    assert form.parameters.silent == ""
    go.set()


def test_saving_what_was_not_changed_says_so(screen, container, ui):
    before = stock(container)
    screen.plan.edit(before.id)
    settle(screen, ui)
    save(screen, ui)
    assert screen.shell.snackbars.texts == ["Night stock count on Aino is unchanged"]
    assert (screen.plan.form.is_open, stock(container)) == (False, before)


def test_changes_after_save_are_kept_when_saving_fails(screen, container, ui, refused):
    choose(screen, ui, "Mission", KITS)
    ui.tap(save_button(ui))
    screen.plan.form.set(priority=3)
    screen.plan.edit(stock(container).id)
    refused.set()
    settle(screen, ui)
    bring_back(screen, ui)
    assert screen.plan.form.draft.priority == 3


def test_a_refusal_is_not_held_against_what_was_changed_since(screen, container, ui, refused):
    choose(screen, ui, "Mission", KITS)
    ui.tap(save_button(ui))
    screen.plan.form.set(name="good")
    refused.set()
    settle(screen, ui)
    assert (screen.plan.form.view.why, screen.plan.form.draft.name) == ("", "good")


def test_a_press_on_save_counts_while_the_forecast_is_not_there_yet(screen, container, ui, monkeypatch):
    monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: ())
    before, go, foresee = len(schedules(container)), threading.Event(), container.forecasts.of
    monkeypatch.setattr(container.forecasts, "of", lambda *args: go.wait(30) and foresee(*args))
    new(screen, ui)
    screen.plan.form.set(mission_id=next(one.id for one in container.catalogue.missions() if one.name == KITS))
    ui.wait(lambda: not save_button(ui).disabled)
    ui.tap(save_button(ui))
    ui.wait(lambda: len(schedules(container)) == before + 1)
    go.set()
    settle(screen, ui)


def test_a_forecast_counts_while_a_parameter_is_typed(screen, container, ui, monkeypatch):
    monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: (PALLETS,))
    choose(screen, ui, "Mission", "Bring pallet to dock")
    settle(screen, ui)
    go, foresee = threading.Event(), container.forecasts.of
    monkeypatch.setattr(container.forecasts, "of", lambda *args: go.wait(30) and foresee(*args))
    screen.plan.form.set(priority=3)
    ui.advance(0.3)
    typed_in = ui.find(ParameterFields).children[0]
    typed_in.text = "37"
    go.set()
    settle(screen, ui)
    assert screen.plan.form.view.starts
    assert screen.plan.form.view.why == ""


def test_parameters_of_another_mission_are_not_stored(screen, container, ui, monkeypatch):
    monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: ())
    schedule = container.catalogue.save_schedule(replace(stock(container), parameters={"count": 5}))
    settle(screen, ui)
    screen.plan.edit(schedule.id)
    settle(screen, ui)
    choose(screen, ui, "Mission", KITS)
    settle(screen, ui)
    save(screen, ui)
    assert stored(container, schedule).parameters == {}
