"""The fields of a mission's parameters: what is missing, and what can't be used."""

from __future__ import annotations

import pytest

from app.domain.robot import MissionParameter
from app.screens.common.parameters_view import fields_of
from app.widgets.fields import Field
from app.widgets.flow import ChoiceField, ParameterFields

GOAL = MissionParameter("goal", "Goal", "Reference", choices=(("g-1", "Dock 3"), ("g-2", "Press")), sets="position")
SPEED = MissionParameter("speed", "Speed", "Float", default=1.5, maximum=2)
NOTE = MissionParameter("note", "Note", "String")


@pytest.fixture
def shown(ui):
    def show(*wanted: MissionParameter) -> ParameterFields:
        return ui.show(ParameterFields(fields=fields_of(wanted)))

    return show


def test_the_problem_of_a_value_disappears_once_another_is_entered(shown, ui):
    fields = shown(GOAL, SPEED)
    problems = {"goal": "Choose one", "speed": "At most 2"}
    fields.problems = problems
    goal, typed = ui.find(ChoiceField, fields), ui.find(Field, fields, kind="decimal")
    assert (goal.problem, typed.problem) == ("Choose one", "At most 2")
    goal.chosen = "g-1"
    assert (goal.problem, typed.problem) == ("", "At most 2")
    typed.text = "1.2"
    assert typed.problem == ""
    fields.problems = dict(problems)  # the same again
    assert (goal.problem, typed.problem) == ("Choose one", "At most 2")


def test_the_first_empty_field_is_reported_as_missing(shown, ui):
    fields = shown(GOAL, NOTE)
    assert fields.missing == "Choose Goal first"
    ui.find(ChoiceField).chosen = "g-2"
    assert fields.missing == "Enter Note first"
    ui.find(Field, kind="text").text = " x"
    assert fields.missing == ""
