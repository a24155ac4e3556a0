"""A mission's parameters: which field each becomes, and the value that travels to the robot."""

from __future__ import annotations

from dataclasses import replace

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
        ("Pick-up place", "choice", ""),
        ("Pallets", "steps", "1 to 8"),
        ("speed", "decimal", "1.5 or less"),
        ("With horn", "choice", ""),
        ("Note", "text", ""),
    ]


def test_entered_values_are_sent_in_the_robots_types():
    entered = {"place": "K2", "count": "3", "speed": "0,8", "loud": True, "note": " hello "}
    assert values_of(ALL, entered) == {"place": "K2", "count": 3, "speed": 0.8, "loud": True, "note": "hello"}


@pytest.mark.parametrize(
    ("name", "text", "problem"),
    [
        ("count", "", "A number is needed"),
        ("count", "2.5", "A whole number is needed"),
        ("speed", "inf", "A number is needed"),
        ("note", " ", "Enter a value"),
        ("place", "K3", "Choose one of Kitting 1, Kitting 2"),
        ("count", "9", "It must be 1 to 8"),
        ("speed", "2", "It must be 1.5 or less"),
        ("place", None, "Choose one"),
    ],
)
def test_an_invalid_value_is_reported_at_its_field(name, text, problem):
    entered = {"place": "K1", "count": "1", "speed": "1", "loud": False, "note": "-", name: text}
    with pytest.raises(Problems) as caught:
        values_of(ALL, entered)
    assert caught.value.by_name == {name: problem}


GOAL = MissionParameter("goal", "Goal", "Reference", choices=(("g-1", "Dock 3"), ("g-2", "Press")), sets="position")
CHARGE = MissionParameter("charge", "Charge", "Integer", 50, 0, 100, sets="minimum_percentage", unit="%")
X = MissionParameter("x", "X", sets="x", unit="m")
PAUSE = MissionParameter("pause", "Pause", "Duration", "00:05:00.000000")


def test_a_position_is_chosen_by_its_name_from_a_list_and_sent_as_its_guid():
    [field] = fields_of([GOAL])
    assert (field.kind, field.choices, field.default) == ("list", (("g-1", "Dock 3"), ("g-2", "Press")), None)
    assert values_of([GOAL], {"goal": "g-2"}) == values_of([GOAL], {"goal": "press"}) == {"goal": "g-2"}
    for nothing, problem in ((None, "Choose one"), ("", "Choose one"), ("Nowhere", "Choose one of Dock 3, Press")):
        with pytest.raises(Problems) as caught:
            values_of([GOAL], {"goal": nothing})
        assert caught.value.by_name == {"goal": problem}


def test_a_value_that_a_schedule_has_by_name_is_shown_as_chosen():
    assert [
        field.default
        for field in fields_of([replace(GOAL, default=default) for default in ("Press", "g-1", "elsewhere")])
    ] == ["g-2", "g-1", None]


@pytest.mark.parametrize(
    ("parameter", "entered", "shown"),
    [(GOAL, "g-2", "g-2"), (GOAL, "Press", "g-2"), (GOAL, "g-9", None), (PLACE, "K3", None), (LOUD, True, True)],
)
def test_what_is_not_in_the_newest_list_is_no_longer_chosen(parameter, entered, shown):
    assert fields_of([parameter], {parameter.name: entered})[0].default == shown


def test_a_default_on_another_map_has_to_be_chosen_by_a_person():
    goal = replace(GOAL, default="g-3", on_other_maps=(("g-3", "Yard"),))
    assert fields_of([goal])[0].default is None


def test_numbers_have_their_unit_and_range():
    charge, x, endless = fields_of([CHARGE, X, replace(CHARGE, maximum=None)])
    assert [(field.kind, field.help) for field in (charge, x, endless)] == [
        ("steps", "0 to 100 %"),
        ("decimal", "m"),
        ("count", "0 or more %"),
    ]
    assert (charge.limits, endless.limits) == ((0, 100), None)
    assert [
        field.default
        for field in fields_of([replace(CHARGE, default=default) for default in ("70", 70.0, "much", None)])
    ] == [70, 70, None, None]
    with pytest.raises(Problems) as caught:
        values_of([CHARGE, X], {"charge": "101", "x": "far"})
    assert caught.value.by_name == {"charge": "It must be 0 to 100 %", "x": "A number is needed"}


def test_a_duration_is_typed_as_people_write_it_and_sent_as_the_robot_does():
    [field] = fields_of([PAUSE])
    assert (field.kind, field.default, field.help) == ("text", "00:05:00", "hours:minutes:seconds")
    assert [values_of([PAUSE], {"pause": text})["pause"] for text in ("1:30", "00:05:00", "2:00:00")] == [
        "00:01:30.000000",
        "00:05:00.000000",
        "02:00:00.000000",
    ]
    with pytest.raises(Problems):
        values_of([PAUSE], {"pause": "5"})


def test_a_duration_keeps_its_part_of_a_second():
    half = replace(PAUSE, default="00:00:00.500000")
    assert [field.default for field in fields_of([half, replace(PAUSE, default="00:00:10.000000")])] == [
        "00:00:00.5",
        "00:00:10",
    ]
    assert [
        values_of([half], {"pause": text})["pause"] for text in ("00:00:00.5", "0:0,25", "1:30.", "0:1.1234567")
    ] == ["00:00:00.500000", "00:00:00.250000", "00:01:30.000000", "00:00:01.123456"]


@pytest.mark.parametrize("default", [1, 1.0, "1", "true", " True ", "yes", True])
def test_yes_is_yes_however_the_robot_says_it(default):
    loud = replace(LOUD, default=default)
    assert fields_of([loud])[0].default is True
    assert values_of([loud], {"loud": default})["loud"] is True


@pytest.mark.parametrize(
    ("default", "shown"),
    [(0, False), ("0", False), ("False", False), (None, None), ("perhaps", None), (2, None), ("", None)],
)
def test_no_is_no_and_anything_else_is_asked_for(default, shown):
    loud = replace(LOUD, default=default)
    assert fields_of([loud])[0].default is shown
    if shown is None:
        with pytest.raises(Problems) as caught:
            values_of([loud], {"loud": default})
        assert caught.value.by_name == {"loud": "Choose one"}
    else:
        assert values_of([loud], {"loud": default})["loud"] is shown


@pytest.mark.parametrize(("default", "shown"), [(3.0, 3), (3, 3), ("3", "3"), (True, 1), (2.5, 2.5)])
def test_a_whole_number_is_shown_and_sent_as_one(default, shown):
    [field] = fields_of([replace(COUNT, default=default, maximum=None)])
    assert (field.kind, field.default, type(field.default)) == ("count", shown, type(shown))


@pytest.mark.parametrize(
    ("default", "shown"), [(3.0, 3), ("3", 3), (True, 1), (2.5, None), (None, None), ("many", None)]
)
def test_a_whole_number_between_two_limits_is_stepped_to_from_one(default, shown):
    [field] = fields_of([replace(COUNT, default=default)])
    assert (field.kind, field.default) == ("steps", shown)


@pytest.mark.parametrize(("text", "sent"), [("3.0", 3), ("3,0", 3), ("+3", 3), (" 7 ", 7)])
def test_a_whole_number_may_be_written_with_its_decimals(text, sent):
    [value] = values_of([COUNT], {"count": text}).values()
    assert (value, type(value)) == (sent, int)


def test_digits_without_end_stay_as_they_are():
    assert values_of([replace(COUNT, maximum=None)], {"count": "12345678901234567890"}) == {
        "count": 12345678901234567890
    }
    for text in ("1e999", "-inf", "nan"):
        with pytest.raises(Problems) as caught:
            values_of([COUNT], {"count": text})
        assert caught.value.by_name == {"count": "A number is needed"}


def test_a_number_of_unknown_kind_is_sent_as_the_kind_of_its_default():
    unknown = MissionParameter("n", default=3)
    assert [type(values_of([unknown], {"n": text})["n"]) for text in ("3", "4.0", "4.5")] == [int, int, float]
    assert type(values_of([replace(SPEED, default=1)], {"speed": "1"})["speed"]) is float


def test_no_parameters_no_values():
    assert fields_of(()) == []
    assert values_of((), {}) == {}
