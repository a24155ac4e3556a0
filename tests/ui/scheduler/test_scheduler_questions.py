"""A question about one draft does not change another one that is in the form by then."""

from __future__ import annotations

import pytest

from app.screens.scheduler.cards import FormSheet
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.choices import Picker
from app.widgets.sheet import AskSheet
from tests.ui.planner import KITS, bring_back, choose, field, named, new, schedules, settle

pytestmark = pytest.mark.long


def is_asked(ui) -> bool:
    return bool(ui.find_all(Picker))


@pytest.mark.parametrize("label", ["Mission", "Robot", "First day"])
def test_it_closes_when_the_message_above_it_brings_another_draft_back(screen, container, ui, label):
    choose(screen, ui, "Mission", KITS)
    screen.plan.form.set(priority=3)
    screen.plan.edit(named(container, "Night stock count", "Aino").id)
    settle(screen, ui)
    ui.tap(field(ui, label))
    assert is_asked(ui)
    bring_back(screen, ui)
    assert (is_asked(ui), screen.plan.form.draft.priority) == (False, 3)


def test_it_closes_when_the_form_below_it_is_saved(screen, container, ui, slow):
    before = len(schedules(container))
    choose(screen, ui, "Mission", KITS)
    screen.plan.form.save()
    ui.tap(field(ui, "Robot"))
    assert is_asked(ui)
    slow.set()
    settle(screen, ui)
    assert (len(schedules(container)), is_asked(ui), screen.plan.form.is_open) == (before + 1, False, False)


def test_the_cross_of_a_question_leads_back_to_the_form(screen, container, ui):
    schedule = named(container, "Night stock count", "Aino")
    screen.plan.edit(schedule.id)
    screen.plan.actions.run_now(schedule)
    settle(screen, ui)
    ui.tap(ui.find(IconButton, ui.find(AskSheet), icon="close"))
    assert ui.find(FormSheet) is screen.shell.sheets.top


def test_a_form_that_is_saved_under_a_question_does_not_come_back(screen, container, ui, slow):
    schedule = named(container, "Night stock count", "Aino")
    screen.plan.edit(schedule.id)
    screen.plan.form.set(priority=3)
    settle(screen, ui)
    screen.plan.form.save()
    screen.plan.actions.run_now(schedule)
    slow.set()
    settle(screen, ui)
    ui.tap(ui.find(IconButton, ui.find(AskSheet), icon="arrow-left"))
    assert (screen.shell.sheets.top, screen.plan.form.is_open) == (None, False)


def test_without_missions_the_form_leads_to_those_of_settings(screen, container, ui, monkeypatch):
    monkeypatch.setattr("app.screens.scheduler.form_view.mission_options", lambda *_args: [])
    new(screen, ui)
    ui.tap(field(ui, "Mission"))
    settle(screen, ui)
    ui.tap(ui.find(CommandButton, ui.find(AskSheet), text="Open Settings"))
    settle(screen, ui)
    assert screen.shell.navigator.current == "settings"
