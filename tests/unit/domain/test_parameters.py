"""The one rule for values of a mission's parameters."""

from __future__ import annotations

import pytest

from app.domain.models import InvalidInput
from app.domain.parameters import has_position_by_name, missing, values_for
from app.domain.robot import MissionParameter
from tests.support.errors import raises

GUID = "3d7c7c49-ce85-11ef-904a-000e8e9884eb"
GOAL = MissionParameter(
    "Goal",
    sets="position",
    choices=(("g-1", "Dock 3"), ("g-2", "Press")),
    on_other_maps=(("g-3", "Press"), ("g-4", "Yard")),
)
SPEED = MissionParameter("Speed", type="Float", default=0.5, minimum=0.1, maximum=1.5)
COUNT = MissionParameter("Count", type="Integer", default=1, minimum=1, maximum=8)
LOUD = MissionParameter("Loud", type="Boolean", default=False)
WAIT = MissionParameter("Wait", type="Duration", default="00:00:05.000000")
NOTE = MissionParameter("Note", default="-")
SIZE = MissionParameter("Size", choices=((1, "Small"), (2, "Large")), default=1)
ALL = (GOAL, SPEED, COUNT, LOUD, WAIT, NOTE, SIZE)


@pytest.mark.parametrize(
    ("name", "entered", "sent"),
    [
        ("Goal", "g-2", "g-2"),
        ("Goal", "dock 3", "g-1"),
        ("Goal", "Press", "g-2"),
        ("Goal", "Yard", "g-4"),
        ("Goal", GUID, GUID),
        ("Speed", 1, 1),
        ("Speed", 0.25, 0.25),
        ("Speed", "0,5", 0.5),
        ("Speed", "0.50", 0.5),
        ("Count", "3.0", 3),
        ("Count", 3, 3),
        ("Count", 3.0, 3),
        ("Count", "4", 4),
        ("Loud", True, True),
        ("Loud", "no", False),
        ("Wait", "1:30", "00:01:30.000000"),
        ("Note", "x", "x"),
        ("Note", 5, 5),
        ("Size", 2, 2),
        ("Size", "Large", 2),
        ("Size", "1", 1),
    ],
)
def test_valid_values_are_sent_in_the_type_of_the_robot(name, entered, sent):
    value = values_for("M", ALL, {"Goal": "Yard", name: entered})[name]
    assert (value, type(value)) == (sent, type(sent))


@pytest.mark.parametrize(
    ("entered", "problem"),
    [
        ({"Sped": 1}, "M has no parameter Sped, it takes Goal, Speed, Count, Loud, Wait, Note, Size"),
        ({"Goal": "Nowhere"}, "M can't take Nowhere for Goal: Choose one of Dock 3, Press"),
        ({"Goal": 3}, "M can't take 3 for Goal: Choose one of Dock 3, Press"),
        ({"Speed": "fast"}, "M can't take fast for Speed: A number is needed"),
        ({"Speed": True}, "M can't take True for Speed: A number is needed"),
        ({"Speed": 2}, "M can't take 2 for Speed: It must be 0.1 to 1.5"),
        ({"Count": 2.5}, "M can't take 2.5 for Count: A whole number is needed"),
        ({"Count": "2,5"}, "M can't take 2,5 for Count: A whole number is needed"),
        ({"Count": "1_5"}, "M can't take 1_5 for Count: A whole number is needed"),
        ({"Count": "1,000"}, "M can't take 1,000 for Count: A whole number is needed"),
        ({"Speed": "0_1.5"}, "M can't take 0_1.5 for Speed: A number is needed"),
        ({"Count": 9}, "M can't take 9 for Count: It must be 1 to 8"),
        ({"Loud": "perhaps"}, "M can't take perhaps for Loud: Choose one"),
        ({"Wait": 5}, "M can't take 5 for Wait: Enter hours, minutes and seconds, such as 00:05:00"),
        ({"Size": 3}, "M can't take 3 for Size: Choose one of Small, Large"),
        ({"Note": None}, "Note is missing: the robot does not start M without it"),
    ],
)
def test_invalid_values_are_refused_with_mission_and_parameter(entered, problem):
    with raises(InvalidInput, field="parameters", text=problem):
        values_for("M", ALL, {"Goal": "Yard"} | entered)


def test_a_parameter_without_a_default_is_required():
    assert missing(ALL) == ["Goal"]
    assert values_for("M", ALL[1:], {}) == {}
    with pytest.raises(InvalidInput, match="Goal is missing"):
        values_for("M", ALL, {})


def test_a_mission_without_parameters_takes_none():
    with pytest.raises(InvalidInput, match="M has no parameter Goal: it takes none"):
        values_for("M", (), {"Goal": 1})


@pytest.mark.parametrize(
    ("entered", "is_by_name"),
    [({"Goal": "Press"}, True), ({"Goal": 3}, True), ({"Goal": GUID}, False), ({"Note": "Press"}, False), ({}, False)],
)
def test_only_a_position_that_is_no_guid_has_to_be_looked_up(entered, is_by_name):
    assert has_position_by_name(ALL, entered) is is_by_name
