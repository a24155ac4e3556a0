"""Names that can be read: what is refused at the field, what is cleaned where a robot or a file gives it."""

from __future__ import annotations

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.container import Container
from app.database.connection import Database
from app.domain import names
from app.domain.models import InvalidInput, Mission, Robot
from app.domain.robot import MissionInfo
from app.process.requests import find_mission, find_target
from app.screens.settings.missions_view import offers
from app.services.catalogue import checks
from tests.support.clock import VirtualClock

FAMILY = "\U0001f468\u200d\U0001f469\u200d\U0001f467"
PERSIAN = "می\u200cخواهم"  # a non-joiner inside a word
SINHALA = "ශ්\u200dරී"  # a joiner inside a syllable


@pytest.mark.parametrize(
    "text", ["R1", "Kääpä", "Robot 7 – hall B", "电梯", "Ž", FAMILY, PERSIAN, SINHALA, "❤️", "#", "नमस्ते"]
)
def test_ordinary_names_stay_unchanged(text):
    assert checks.name(f" \u3000{text}\n") == unicodedata.normalize("NFC", text)
    assert names.cleaned(text) == unicodedata.normalize("NFC", text)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("R1\u202e2R", "U+202E"),
        ("R\u200b1", "U+200B"),
        ("\u2066R1", "U+2066"),
        ("R\u00ad1", "U+00AD"),
        ("R1\ufeff", "U+FEFF"),
        ("R\u200d1", "U+200D"),
        ("Rob\u200cot", "U+200C"),
        ("\u200dR", "U+200D"),
        ("می\u200c", "U+200C"),
        ("R\ue000", "U+E000"),
        ("R\u0378", "U+0378"),
        ("\u3164", "U+3164"),
        ("R\u2800", "U+2800"),
        ("\u200b\u200b", "U+200B"),
        ("R\U000e0041", "U+E0041"),
        ("\udc80", "U+DC80"),
        ("R1\ufe0f", "U+FE0F"),
        ("R\ufe001", "U+FE00"),
        ("R1\U000e0101", "U+E0101"),
        ("R\u180b1", "U+180B"),
        ("\ufe0fR1", "U+FE0F"),
    ],
)
def test_an_invisible_character_is_refused_and_named(text, code):
    with pytest.raises(InvalidInput) as refused:
        checks.name(text, "robots[0].name")
    assert refused.value.field == "robots[0].name"
    assert code in refused.value.text or "control characters" in refused.value.text
    assert all(character.isprintable() for character in refused.value.text)


@pytest.mark.parametrize("text", ["R\u20281", "R\u20291", "R\x1b1", "a\tb"])
def test_control_characters_and_line_ends_are_refused(text):
    with pytest.raises(InvalidInput, match="control characters"):
        checks.name(text)


@pytest.mark.parametrize("text", ["", "  ", "\u2003\u3000", "\u0301"])
def test_a_name_needs_something_to_see(text):
    with pytest.raises(InvalidInput, match="enter a name"):
        checks.name(text)


def test_two_ways_to_write_one_name_are_one_name(tmp_path):
    clock = VirtualClock()
    container = Container(Database.open(tmp_path / "a.db", clock=clock, threaded=False, durable=False), clock)
    robot = container.catalogue.save_robot(Robot("Ma\u0308ki", "10.0.0.1", "u"), password="p")
    mission = container.catalogue.save_mission(Mission("Tyo\u0308", "g"))
    assert (robot.name, mission.name) == ("M\u00e4ki", "Ty\u00f6")
    with pytest.raises(InvalidInput):
        container.catalogue.save_robot(Robot("M\u00e4ki", "10.0.0.2", "u"), password="p")
    assert find_target(container, "Ma\u0308ki") == robot
    assert find_mission(container, "Tyo\u0308", robot) == mission
    assert len(checks.name("a\u0308" * 80)) == 80
    container.close()


@pytest.mark.parametrize(
    ("raw", "name"),
    [
        ("R1\u202e2R", "R12R"),
        ("Go\u2028home\r\nnow", "Go home now"),
        ("\u200b", ""),
        ("\u3164 \u0301", ""),
        ("x" * 200, "x" * 80),
        ("Do\u200dck", "Dock"),
        (f"{'x' * 79}{FAMILY}", f"{'x' * 79}\U0001f468"),
        (f" {PERSIAN}\u200c", PERSIAN),
    ],
)
def test_names_from_outside_are_cleaned(raw, name):
    assert names.cleaned(raw) == name


ZALGO = "Z" + "\u0301" * 60
VIETNAMESE, HEBREW, TIBETAN = "Phòng chờ lớn", "בְּרֵאשִׁ֖ית", "རྒྱལ"


def test_marks_are_not_heaped_on_a_letter():
    """They would be drawn over the lines above and below."""
    assert names.cleaned(f"Dock {ZALGO}{ZALGO}") == "Dock Ź" + "\u0301" * 2 + "Ź" + "\u0301" * 2
    assert names.visible(f"{ZALGO}!") == "Z" + "\u0301" * 3 + "!"
    with pytest.raises(InvalidInput, match="marks"):
        checks.name(ZALGO)


@pytest.mark.parametrize("text", [VIETNAMESE, HEBREW, TIBETAN, "ที่นี่", "नमस्ते"])
@pytest.mark.parametrize("form", ["NFC", "NFD"])
def test_scripts_that_write_with_marks_keep_theirs(text, form):
    assert names.visible(unicodedata.normalize(form, text)) == unicodedata.normalize(form, text)
    assert checks.name(text) == unicodedata.normalize("NFC", text)


@given(st.text(max_size=120) | st.text("Za\u0301\u0308\u0344\u20dd\u200b", max_size=40))
def test_cleaned_names_can_be_entered(raw):
    name = names.cleaned(raw)
    assert name == "" or checks.name(name) == name


def test_missions_of_a_robot_can_be_taken_over_whatever_they_are_called():
    called = ["Go\u202e home", "\u200b", "\u3164", "Go home", "M" * 79 + FAMILY, "Ma\u0308ki"]
    offered = offers([MissionInfo(f"guid-{n}", name) for n, name in enumerate(called)], [], robot_id=1)
    assert len(offered) == len(called)
    assert sorted(checks.name(offer.name) for offer in offered) == sorted(
        ["Go home", "Go home 2", "guid-1", "guid-2", "M" * 79 + "\U0001f468", "M\u00e4ki"]
    )


def test_a_schedule_without_a_name_gets_one_that_can_be_entered():
    made = names.generated("M" * 72 + FAMILY, "R")
    assert [checks.name(next(made)) for _ in range(3)] == [
        f"{'M' * 72}{FAMILY} on"[:80].strip(),
        f"{'M' * 72}{FAMILY} 2",
        f"{'M' * 72}{FAMILY} 3",
    ]


def test_parameters_keep_the_names_that_the_robot_gave_them():
    assert checks.parameters({"Po\u200bsition ": 1}) == {"Po\u200bsition ": 1}
    for key in ("", " ", "a\nb", "x" * 81):
        with pytest.raises(InvalidInput, match="name of a parameter"):
            checks.parameters({key: 1})


# ---------------------------------------------------------------------- time zones
@pytest.mark.parametrize(
    "zone", ["localtime", "posixrules", "Factory", "posix/Europe/Helsinki", "Mars/Base", "EUROPE/HELSINKI", ""]
)
def test_only_zones_of_iana_are_taken(zone):
    with pytest.raises(InvalidInput, match="is no time zone"):
        checks.timezone(zone)
