"""A mission's parameters: which field each becomes, and the value that travels to the robot."""
from __future__ import annotations

import pytest

from app.domain.robot import MissionParameter
from app.screens.common.parameters_view import Problems, fields_of, values_of

PLACE = MissionParameter("place", "Pick-up place", choices=(("K1", "Kitting 1"), ("K2", "Kitting 2")), default="K1")
COUNT = MissionParameter("count", "Pallets", "Integer", 2, 1, 8)
SPEED = MissionParameter("speed", "", "Float", 0.5, None, 1.5)
LOUD = MissionParameter("loud", "With horn", "Boolean", False)
NOTE = MissionParameter("note", "Note", "String")
ALL = (PLACE, COUNT, SPEED, LOUD, NOTE)


def test_each_kind_becomes_its_field():
    assert [(field.label, field.kind, field.help) for field in fields_of(ALL)] == [
        ("Pick-up place", "choice", ""), ("Pallets", "int", "1 to 8"), ("speed", "decimal", "1.5 or less"), ("With horn", "choice", ""),
        ("Note", "text", "")]


def test_what_was_entered_travels_in_the_robots_types():
    entered = {"place": "K2", "count": "3", "speed": "0,8", "loud": True, "note": " hello "}
    assert values_of(ALL, entered) == {"place": "K2", "count": 3, "speed": 0.8, "loud": True, "note": "hello"}


@pytest.mark.parametrize(("name", "text", "problem"), [
    ("count", "", "A number is needed"), ("count", "2.5", "A number is needed"), ("count", "9", "It must be 1 to 8"),
    ("speed", "2", "It must be 1.5 or less"), ("place", None, "Choose one"), ("note", " ", "Enter a value")])
def test_what_cannot_be_taken_is_said_at_its_field(name, text, problem):
    entered = {"place": "K1", "count": "1", "speed": "1", "loud": False, "note": "x", name: text}
    with pytest.raises(Problems) as caught:
        values_of(ALL, entered)
    assert caught.value.by_name == {name: problem}


def test_no_parameters_no_values():
    assert fields_of(()) == []
    assert values_of((), {}) == {}
