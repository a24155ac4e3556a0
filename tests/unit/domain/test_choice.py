"""Sentences of why a start of a group went to a robot."""

from __future__ import annotations

import pytest

from app.domain.choice import awaited, chosen

AT = "2026-11-23T14:52:00+00:00"
AINO, SISU = {"robot": "Aino", "until": AT}, {"robot": "Sisu"}


@pytest.mark.parametrize(
    ("choice", "sentence"),
    [
        ({"robots": [SISU, AINO]}, "Sisu: free now · Aino busy until about 14:52"),
        (
            {"robots": [{"robot": "Sisu", "metres": 22}, AINO]},
            "Sisu: free now, 22 m away · Aino busy until about 14:52",
        ),
        (
            {"robots": [{"robot": "Sisu", "metres": "many"}, {"robot": "Aino", "metres": float("nan")}]},
            "Sisu: free now · Aino: free now",
        ),
        (
            {"robots": [SISU, {"robot": "Veikko", "out": "low_battery", "battery": 18.2}]},
            "Sisu: free now · Veikko 18 % battery",
        ),
        (  # not checked up, or the app has no user of its own there
            {"robots": [SISU, {"robot": "Veikko", "out": "unchecked"}]},
            "Sisu: free now · Veikko: look at its fleet in Settings",
        ),
        (
            {"robots": [AINO], "last_call": True},
            "Aino: into its queue before the start window closes, free about 14:52",
        ),
        (
            {"robots": [SISU, AINO, AINO, AINO, AINO], "more": 3},
            "Sisu: free now" + " · Aino busy until about 14:52" * 3 + " · and 4 more",
        ),
        (
            {"robots": [{**SISU, "why": "soonest", "done": AT}, {"robot": "Veikko"}]},
            "Sisu: free now, will be done soonest, about 14:52 · Veikko: free now",
        ),
        (
            {"robots": [{**SISU, "why": "less_run"}, {"robot": "Veikko"}]},
            "Sisu: free now, has run less today · Veikko: free now",
        ),
        (
            {"robots": [{**SISU, "why": "ahead"}, {"robot": "Veikko"}]},
            "Sisu: free now, keeps the others free for planned missions · Veikko: free now",
        ),
        (
            {"robots": [{**SISU, "metres": 18, "why": "equal"}, {"robot": "Aino", "metres": 7}]},
            "Sisu: free now, 18 m away, will be done as early as the others · Aino: free now, 7 m away",
        ),
        (
            {"robots": [SISU, {"robot": "Aino", "metres": 7, "gets": "Kits"}]},
            "Sisu: free now · Kits is being sent to Aino",
        ),
        ({"robots": [SISU, {"robot": "Aino", "metres": 7, "unread": True}]}, "Sisu: free now · Aino: no reading yet"),
        (
            {"robots": [SISU, {"robot": "Aino", "metres": 7, "late": True}]},
            "Sisu: free now · Aino: free now, 7 m away, would be done too late",
        ),
        (
            {"robots": [SISU, {**AINO, "late": True, "failures": 2}]},
            "Sisu: free now · Aino busy until about 14:52, would be done too late, 2 starts failed in a row",
        ),
        ({"robots": [{**SISU, "why": "unheard of", "done": 5}]}, "Sisu: free now"),
        ({"robots": [{**SISU, "why": "soonest"}]}, "Sisu: free now"),
        ({}, ""),
        ({"robots": "no list", "more": "many"}, ""),
        ({"robots": [{"robot": "Sisu", "until": "nonsense"}, 5]}, "Sisu: free now"),
    ],
)
def test_the_robot_that_was_chosen_comes_first(choice, sentence):
    assert chosen(choice, "UTC") == sentence


@pytest.mark.parametrize(
    ("choice", "sentence"),
    [
        ({"robots": [AINO]}, "Aino busy until about 14:52"),
        ({"robots": [SISU], "kept_for": "Shift bus"}, "kept for Shift bus · Sisu: free now"),
        ({"robots": [{"robot": "Sisu", "out": "an unknown code"}]}, "Sisu"),
    ],
)
def test_a_choice_says_what_it_waits_for(choice, sentence):
    assert awaited(choice, "UTC") == sentence


def test_times_are_those_of_the_plan():
    assert chosen({"robots": [AINO]}, "Europe/Helsinki") == "Aino busy until about 16:52"
