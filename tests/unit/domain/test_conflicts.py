"""Conflicts in words."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import pytest

from app.domain.conflicts import ConflictCode, line, sentence

AT = datetime(2026, 11, 23, 7, 30, tzinfo=UTC)
DETAILS = {
    "group": "Hall 1",
    "robots": 3,
    "starts": 4,
    "until": AT + timedelta(minutes=11),
    "place": "Dock 2",
    "most": 3,
    "percent": 73,
    "mission": "Kits",
    "behind": "Shift bus",
    "robot": "Aino",
    "start": AT + timedelta(minutes=5),
    "minutes": 30,
    "usual_minutes": 35,
}


@pytest.mark.parametrize(
    ("code", "whole", "short"),
    [
        (
            "too_few_robots",
            "At 07:30, 4 starts need the 3 robots of Hall 1, until about 07:41",
            "4 starts, 3 robots: 07:30",
        ),
        (
            "place_full",
            "At 07:30, 4 missions need Dock 2, which takes 3 at a time, until about 07:41",
            "Dock 2 is full at 07:30",
        ),
        (
            "place_crowded",
            "From 07:30 to 07:41 Dock 2 is in use 73 % of the time: starts will often wait for it",
            "Dock 2 is in use 73 % of an hour",
        ),
        (
            "critical_behind",
            "Kits at 07:30 usually still runs on Aino when the more important Shift bus starts at 07:35",
            "Shift bus would start late",
        ),
        ("finish_by_short", "Kits usually takes 35 min, but only 30 min are allowed", "Usually takes longer: 35 min"),
        ("another", "", ""),
    ],
)
def test_each_conflict_has_its_sentence_and_its_line(code, whole, short):
    assert (sentence(code, AT, DETAILS, "UTC"), line(code, AT, DETAILS, "UTC")) == (whole, short)


@pytest.mark.parametrize("code", list(ConflictCode))
def test_unknown_values_are_omitted_and_never_fail(code):
    assert "–" in sentence(code, None, {}, "Nowhere/At_all")
    assert line(code, AT, {"robots": 0, "group": "Hall 1", "until": "soon"}, "UTC")


@pytest.mark.parametrize("code", list(ConflictCode))
def test_every_text_goes_through_the_translation(code):
    assert "xx" in sentence(code, AT, DETAILS, "UTC", lambda text: f"xx {text}")
