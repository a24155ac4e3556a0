"""The screen is rebuilt for gloves or larger texts, or shown again in another language, while the form is filled in."""

from __future__ import annotations

import pytest

from app.domain.robot import MissionParameter
from app.i18n import translator
from app.screens.scheduler.cards import FormSheet
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.flow import ParameterFields
from tests.ui.planner import (
    KITS,
    bring_back,
    choose,
    field,
    larger_controls,
    leave_entries,
    new,
    said,
    save_button,
    schedules,
    settle,
)

pytestmark = pytest.mark.long


def test_drafts_that_were_put_aside_are_still_there(screen, container, ui):
    leave_entries(screen, container, ui, priority=3)
    with larger_controls(screen, container, ui):
        bring_back(screen, ui)  # the message is an earlier one
        assert screen.plan.form.draft.priority == 3


def test_a_new_one_without_a_mission_stays_in_the_form(screen, container, ui):
    new(screen, ui)
    screen.plan.form.set(name="Count", priority=3)
    with larger_controls(screen, container, ui):
        settle(screen, ui)
        assert (screen.plan.form.draft.name, screen.plan.form.draft.priority) == ("Count", 3)
        assert ui.find_all(FormSheet)


def test_a_rebuilt_screen_saves_only_once(screen, container, ui, slow):
    choose(screen, ui, "Mission", KITS)
    before = len(schedules(container))
    ui.tap(save_button(ui))
    with larger_controls(screen, container, ui):
        assert screen.plan.form.saving
        slow.set()
        settle(screen, ui)
        assert len(schedules(container)) == before + 1
        assert (screen.plan.form.is_open, screen.plan.form.saving) == (False, None)
        assert said(screen) == [f"{KITS} on Aino is planned"]


def test_a_question_of_the_form_stays_and_its_answer_counts(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    ui.tap(field(ui, "Robot"))
    with larger_controls(screen, container, ui):
        ui.tap(ui.find(OptionRow, ui.find(ChoiceSheet), title="Veikko"))
        settle(screen, ui)
        assert (field(ui, "Mission").value, field(ui, "Robot").value) == (KITS, "Veikko")


def test_words_of_its_parameters_follow_the_language(screen, ui, container, monkeypatch):
    fast = MissionParameter("fast", "Fast", "boolean", True)
    monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: (fast,))
    choose(screen, ui, "Mission", KITS)
    screen.shell.go("logs")
    settle(screen, ui)
    translator.use("fi")
    try:
        screen.shell.go("scheduler")
        settle(screen, ui)
        assert "Kyllä" in ui.texts(ui.find(ParameterFields))
    finally:
        translator.use("en")
        settle(screen, ui)
    assert "Yes" in ui.texts(ui.find(ParameterFields))
